//! Places in a task's text that call a module.

use crate::diagnostic::Span;
use crate::model::walk::{self, Part};
use crate::task::{ModuleId, Task};

/// All calls of a module in text order, each with the caller in words (such as "the goal") and the
/// span.
pub(crate) fn sites(task: &Task, module: ModuleId) -> Vec<(String, Span)> {
    let mut found = Vec::new();
    for action in &task.actions {
        note(module, &format!("`{}`", action.name), &mut found, |visit| walk::action(action, visit));
    }
    for rule in &task.rules {
        let who = format!("the rule of `{}`", task.predicate(rule.predicate).name);
        note(module, &who, &mut found, |visit| walk::condition(&rule.body, visit));
    }
    note(module, "the goal", &mut found, |visit| walk::condition(&task.goal.body, visit));
    if let Some(metric) = &task.metric {
        note(module, "the metric", &mut found, |visit| walk::expression(&metric.value, visit));
    }
    // One text may stand for several ground conditions.
    found.dedup_by_key(|(_, span)| *span);
    found
}

fn note<'t>(
    module: ModuleId,
    who: &str,
    found: &mut Vec<(String, Span)>,
    walk: impl FnOnce(&mut dyn FnMut(Part<'t>)),
) {
    walk(&mut |part| match part {
        Part::Call(call) if call.module == module => found.push((who.to_string(), call.span)),
        _ => {}
    });
}
