//! Where a task calls a module.

use crate::diagnostic::Span;
use crate::task::{Action, Call, Change, Condition, Expression, ModuleId, Task};

/// Every call of a module, in the order of the text: who makes it, and where.
pub(crate) fn sites(task: &Task, module: ModuleId) -> Vec<(String, Span)> {
    let mut found = Vec::new();
    let mut note = |who: String, calls: Vec<&Call>| {
        let own = calls.into_iter().filter(|call| call.module == module);
        found.extend(own.map(|call| (who.clone(), call.span)));
    };
    for action in &task.actions {
        let mut calls = Vec::new();
        in_action(action, &mut calls);
        note(format!("`{}`", action.name), calls);
    }
    for rule in &task.rules {
        let mut calls = Vec::new();
        in_condition(&rule.body, &mut calls);
        note(format!("the rule of `{}`", task.predicate(rule.predicate).name), calls);
    }
    let mut calls = Vec::new();
    in_condition(&task.goal.body, &mut calls);
    note("the goal".to_string(), calls);
    if let Some(metric) = &task.metric {
        let mut calls = Vec::new();
        in_expression(&metric.value, &mut calls);
        note("the metric".to_string(), calls);
    }
    // One text may stand for several ground conditions.
    found.dedup_by_key(|(_, span)| *span);
    found
}

fn in_action<'t>(action: &'t Action, calls: &mut Vec<&'t Call>) {
    calls.extend(&action.grounding);
    for bound in action.duration.iter().flatten() {
        in_expression(&bound.value, calls);
    }
    let condition = &action.condition;
    [&condition.start, &condition.over_all, &condition.end]
        .into_iter()
        .for_each(|part| in_condition(part, calls));
    for effect in action.effects.start.iter().chain(&action.effects.end) {
        let when = &effect.when;
        [&when.start, &when.over_all, &when.end].into_iter().for_each(|part| in_condition(part, calls));
        match &effect.change {
            Change::Number(_, _, value) => in_expression(value, calls),
            Change::Call(call) => calls.push(call),
            Change::Add(_) | Change::Delete(_) | Change::Object(..) => {}
        }
    }
    action.continuous.iter().for_each(|rate| in_expression(&rate.per_second, calls));
}

fn in_condition<'t>(condition: &'t Condition, calls: &mut Vec<&'t Call>) {
    match condition {
        Condition::And(parts) | Condition::Or(parts) => {
            parts.iter().for_each(|part| in_condition(part, calls))
        }
        Condition::Not(inner) | Condition::Forall(_, inner) | Condition::Exists(_, inner) => {
            in_condition(inner, calls);
        }
        Condition::Call(call) => calls.push(call),
        Condition::Compare(_, sides, _) => sides.iter().for_each(|side| in_expression(side, calls)),
        Condition::Atom(_) | Condition::Same(..) => {}
    }
}

fn in_expression<'t>(expression: &'t Expression, calls: &mut Vec<&'t Call>) {
    match expression {
        Expression::Call(call) => calls.push(call),
        Expression::Add(parts) | Expression::Multiply(parts) => {
            parts.iter().for_each(|part| in_expression(part, calls));
        }
        Expression::Subtract(sides) | Expression::Divide(sides) => {
            sides.iter().for_each(|side| in_expression(side, calls));
        }
        Expression::Negative(inner) => in_expression(inner, calls),
        _ => {}
    }
}
