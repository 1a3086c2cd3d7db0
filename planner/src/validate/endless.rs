//! Unbounded metrics: a step that can be repeated for ever makes a plan better without limit.

use super::verdict::validate;
use crate::attachment::Attachments;
use crate::model::walk::{self, Part};
use crate::plan::{EPSILON_S, Plan, Step};
use crate::task::{Assignment, Change, Expression, FunctionId, Task};

/// Maximum number of distinct steps of a plan that are tested.
const MOST_TRIED: usize = 8;
/// Number of repetitions tested; a step with constant gain over all of them counts as repeatable for
/// ever.
const OFTEN: usize = 100;

/// Step of a valid plan that can be repeated at the plan's end for ever, with the improvement of the
/// metric per repetition; `None` if none is found. A hundred repetitions are tested.
pub fn endless(task: &Task, attachments: &Attachments, plan: &Plan) -> Option<(Step, f64)> {
    let metric = task.metric.as_ref()?;
    let sign = if metric.minimise { 1.0 } else { -1.0 };
    let cost = |plan: &Plan| {
        let verdict = validate(task, attachments, plan);
        verdict.metric.filter(|_| verdict.valid).map(|value| sign * value)
    };
    let counted = counted(task);
    let mut tried: Vec<&Step> = Vec::new();
    for step in plan.steps.iter().filter(|step| may_help(task, step, &counted)) {
        if !tried.iter().any(|other| other.action == step.action && other.arguments == step.arguments) {
            tried.push(step);
        }
    }
    let before = cost(plan)?;
    tried.into_iter().take(MOST_TRIED).find_map(|step| {
        let gain = before - cost(&with_more(plan, step, 1))?;
        let gains = || Some(before - cost(&with_more(plan, step, OFTEN))?);
        let least = OFTEN as f64 * gain * (1.0 - 1e-9);
        (gain > 0.0 && gains()? >= least).then(|| (step.clone(), gain))
    })
}

/// Functions that the metric reads, and true if the metric contains no subtraction or negation.
fn counted(task: &Task) -> (Vec<FunctionId>, bool) {
    let (mut counted, mut adds) = (Vec::new(), true);
    if let Some(metric) = &task.metric {
        walk::expression(&metric.value, &mut |part| match part {
            Part::Expression(Expression::Fluent(fluent)) => counted.push(fluent.function),
            Part::Expression(Expression::Subtract(_) | Expression::Negative(_)) => adds = false,
            _ => {}
        });
    }
    (counted, adds)
}

/// True if an action of the step's name changes a function of the metric, possibly for the better.
fn may_help(task: &Task, step: &Step, (counted, adds): &(Vec<FunctionId>, bool)) -> bool {
    let worse = match task.metric.as_ref().is_some_and(|metric| metric.minimise) {
        true => Assignment::Increase,
        false => Assignment::Decrease,
    };
    let own = task.actions.iter().filter(|action| action.name == step.action);
    own.flat_map(|action| action.effects.start.iter().chain(&action.effects.end)).any(|effect| {
        matches!(&effect.change, Change::Number(how, fluent, _)
            if counted.contains(&fluent.function) && !(*adds && *how == worse))
    })
}

/// Plan with a step repeated `times` times at its end.
fn with_more(plan: &Plan, step: &Step, times: usize) -> Plan {
    let mut more = plan.clone();
    let mut next_s = plan.makespan_s().map(|end_s| end_s + EPSILON_S);
    for _ in 0..times {
        more.steps.push(Step { start_s: next_s, ..step.clone() });
        next_s = next_s.map(|start_s| start_s + step.duration_s + EPSILON_S);
    }
    more
}
