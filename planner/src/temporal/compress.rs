//! Durative actions done in one go, as instantaneous ones for the classical search.

use std::sync::atomic::{AtomicBool, Ordering};

use crate::ground::{Action, Conjunction, Effect, Expression, Fact, GroundTask, Metric, Outcome};
use crate::search::compiled::is_classical;
use crate::search::run::{ClassicalOptions, solve};

use super::advance::Step;
use super::relaxed::Part;
use super::space::Space;
use super::world::{Act, Span};

/// A first plan by the classical search on actions done in one go; `None` where the task does not allow it, or where
/// that search finds none.
pub(crate) fn classical_plan(
    space: &Space,
    memory_bytes: usize,
    stop: &(dyn Fn() -> bool + Sync),
) -> Option<(Vec<Step>, u64)> {
    if space.tight {
        return None;
    }
    let (task, acts) = compressed(space)?;
    if !is_classical(&task) {
        return None;
    }
    let options = ClassicalOptions {
        anytime: false,
        bound: None,
        memory_limit_bytes: Some(memory_bytes),
        evaluation_limit: None,
    };
    // The first plan is enough: what is cheap one after the other need not be quick side by side.
    let found = AtomicBool::new(false);
    let enough = || found.load(Ordering::Relaxed) || stop();
    let mut actions: Option<Vec<u32>> = None;
    let outcome = solve(&task, &options, &enough, &mut |plan, _| {
        actions.get_or_insert_with(|| plan.to_vec());
        found.store(true, Ordering::Relaxed);
    });
    let actions = actions?;
    let nothing = Span { least_s: 0.0, most_s: 0.0 };
    let step =
        |&action: &u32| Step { act: acts[action as usize], part: Part::Whole, proposal: None, span: nothing };
    Some((actions.iter().map(step).collect(), outcome.evaluated))
}

/// The task with every action in one go, and by its actions the space's.
fn compressed(space: &Space) -> Option<(GroundTask, Vec<u32>)> {
    let world = space.world;
    let mut task = GroundTask { durative: Vec::new(), actions: Vec::new(), ..world.ground.clone() };
    let mut origins = Vec::new();
    for (index, act) in world.acts.iter().enumerate() {
        let Some(action) = in_one_go(act, seconds(act)?) else { continue };
        task.actions.push(action);
        origins.push(index as u32);
    }
    let expression = Expression::Constant(0.0);
    task.metric = Some(Metric { minimise: true, expression, additive: true, time_weight: 0.0 });
    Some((task, origins))
}

fn seconds(act: &Act) -> Option<f64> {
    let mut least_s: f64 = 0.0;
    for bound in act.bounds {
        let Expression::Constant(seconds) = bound.seconds else { return None };
        least_s = least_s.max(seconds);
    }
    Some(least_s)
}

/// `None` if the action needs something inside that its own start takes away.
fn in_one_go(act: &Act, seconds: f64) -> Option<Action> {
    let set = |effect: &Effect| match effect.outcome {
        Outcome::Set(fact) => Some(fact),
        _ => None,
    };
    let after_start =
        |variable: u32| act.start_effects.iter().rev().filter_map(set).find(|fact| fact.variable == variable);
    let mut condition = act.at_start.clone();
    for later in [act.over_all, act.at_end] {
        condition.comparisons.extend(&later.comparisons);
        condition.calls.extend(&later.calls);
        for fact in &later.facts {
            match after_start(fact.variable) {
                Some(given) if given == *fact => {}
                Some(_) => return None,
                None => condition.facts.push(*fact),
            }
        }
    }
    condition.facts.sort_unstable();
    condition.facts.dedup();
    if condition.facts.windows(2).any(|pair| pair[0].variable == pair[1].variable) {
        return None;
    }
    let overwritten = |fact: Fact| {
        act.end_effects
            .iter()
            .any(|end| end.when.is_none() && set(end).is_some_and(|e| e.variable == fact.variable))
    };
    let start = act.start_effects.iter().filter(|effect| set(effect).is_none_or(|fact| !overwritten(fact)));
    let effects: Vec<Effect> = start.chain(act.flow_effects).chain(act.end_effects).cloned().collect();
    // Conditions on effects at the end would be looked up after the start; those are left to the other search.
    let plain = |part: &Conjunction| part.is_empty();
    let odd = act.durative
        && effects.iter().filter_map(|e| e.when.as_ref()).any(|w| !plain(&w.at_start) || !plain(&w.over_all));
    if odd || !act.grounding.is_empty() {
        return None;
    }
    Some(Action { origin: act.origin.clone(), condition, effects, cost: Expression::Constant(seconds) })
}
