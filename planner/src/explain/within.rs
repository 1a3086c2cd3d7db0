//! Explanation of `within` constraints whose deadline no plan can meet.

use crate::diagnostic::Diagnostic;
use crate::ground::{Earliest, GroundTask, Keep, WITNESS, compile, ground_with};
use crate::plan::{EPSILON_S, number_text};
use crate::task::{Modal, Task, Trajectory};

use super::Explanation;

/// Explanation that the condition of a `within` constraint cannot become true by the constraint's
/// deadline; `None` if that is not proven. `free`: the task without preferences and constraints.
pub(crate) fn too_slow(
    task: &Task,
    free: Task,
    memory_limit_bytes: Option<usize>,
    stop: &(dyn Fn() -> bool + Sync),
) -> Option<Explanation> {
    let within: Vec<Trajectory> = task.constraints.iter().filter(is_within).cloned().collect();
    if within.is_empty() || !task.is_temporal() {
        return None;
    }
    let compiled = compile(&Task { constraints: within.clone(), ..free })?.task;
    let grounded = ground_with(&compiled, memory_limit_bytes, Keep::Relevant, stop).ok()?;
    if !grounded.goal_reachable {
        return None;
    }
    let earliest = Earliest::new(&grounded);
    let finding = |constraint: &Trajectory| {
        let &[given_s] = &constraint.times_s[..] else { return None };
        let mut seen_s = witnesses(&compiled, constraint).map(|schema| seen_s(&grounded, &earliest, schema));
        // What is over before it can be seen is told by others.
        let late_s = seen_s.find(|seen_s| *seen_s > given_s + 3.0 * EPSILON_S && seen_s.is_finite())?;
        let [late, given] = [late_s, given_s].map(number_text);
        let message = format!("this cannot come about within {given} s: it takes {late} s at least");
        Some(Diagnostic::error("unsolvable", message, constraint.span, format!("not before {late} s")))
    };
    let list: Vec<Diagnostic> = within.iter().filter_map(finding).collect();
    (!list.is_empty()).then(|| Explanation::new(task, list))
}

fn is_within(constraint: &&Trajectory) -> bool {
    constraint.operator == Modal::Within && constraint.preference.is_none()
}

/// Indices of the witness actions that the compilation made for a constraint; one of these must be
/// applied while the condition holds, in time.
fn witnesses(compiled: &Task, constraint: &Trajectory) -> impl Iterator<Item = u32> {
    let own = |action: &crate::task::Action| action.name == WITNESS && action.span == constraint.span;
    (0..).zip(&compiled.actions).filter(move |(_, action)| own(action)).map(|(schema, _)| schema)
}

/// Lower bound on the time at which some instance of an action is applicable, seconds from the
/// plan's start; 0 without instances.
fn seen_s(grounded: &GroundTask, earliest: &Earliest, schema: u32) -> f64 {
    let own = grounded.actions.iter().filter(|action| action.origin.schema == schema);
    own.map(|action| earliest.of(&action.condition)).reduce(f64::min).unwrap_or_default()
}
