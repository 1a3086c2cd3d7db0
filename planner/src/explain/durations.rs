//! Findings about actions that are never applicable, because no duration is allowed.

use crate::diagnostic::{Diagnostic, Span};
use crate::ground::{GroundDurationBound, GroundExpression, GroundTask, Relation};
use crate::plan::number_text;
use crate::task::Task;

/// Minimum and maximum duration, seconds, from the constant bounds of an action, if they contradict
/// each other; else `None`.
fn contradiction(bounds: &[GroundDurationBound]) -> Option<(f64, f64)> {
    let (mut least_s, mut most_s) = (0.0_f64, f64::INFINITY);
    for bound in bounds {
        let GroundExpression::Constant(seconds) = bound.seconds else { continue };
        if matches!(bound.relation, Relation::AtLeast | Relation::Greater | Relation::Equal) {
            least_s = least_s.max(seconds);
        }
        if matches!(bound.relation, Relation::AtMost | Relation::Less | Relation::Equal) {
            most_s = most_s.min(seconds);
        }
    }
    (least_s > most_s).then_some((least_s, most_s))
}

/// Findings about actions all of whose ground instances have contradictory duration bounds.
pub(super) fn without_duration(task: &Task, ground: &GroundTask) -> Vec<Diagnostic> {
    let mut findings = Vec::new();
    for (schema, action) in (0..).zip(&task.actions) {
        let instances = ground.durative.iter().filter(|own| own.origin.schema == schema);
        let ranges: Option<Vec<(f64, f64)>> = instances.map(|own| contradiction(&own.duration)).collect();
        let spans = action.duration.iter().flatten().map(|bound| bound.span);
        let (Some(&[(least_s, most_s), ..]), Some(span)) = (ranges.as_deref(), spans.reduce(Span::to)) else {
            continue;
        };
        let (least, most) = (number_text(least_s), number_text(most_s));
        let (message, help) = match most_s < 0.0 {
            true => (
                format!(
                    "`{}` can never be taken: its duration comes to {most} s, which is below 0",
                    action.name
                ),
                "a duration is a number of seconds from 0 on: look at the values that it is made of",
            ),
            false => (
                format!(
                    "`{}` can never be taken: it must last at least {least} s and at most {most} s",
                    action.name
                ),
                "let the bounds leave a duration",
            ),
        };
        let finding = Diagnostic::error("no-duration", message, span, "no duration is allowed");
        findings.push(finding.with_help(help));
    }
    findings
}
