//! Numeric condition that forbids every drive, reported as the reason for no plan before refusals
//! by attachments.

use descry_planner::semantics::{Binding, Compared};
use descry_planner::state::State;
use descry_planner::task::{Action, Condition, ObjectId};
use descry_planner::{NoPlan, Semantics};

use crate::actions;
use crate::config::ActionKind;
use crate::load::Domain;
use crate::round::Round;

/// Maximum number of instances of an action that are examined.
const DRIVES: usize = 20_000;

/// Numeric comparison nearest to holding, if numbers alone forbid every moving action; else `None`.
pub fn of_drives(domain: &Domain, round: &Round) -> Option<Compared> {
    let semantics = Semantics::new(&round.task, &round.attachments);
    let state = semantics.initial().ok()?;
    let is_moving = |action: &&Action| actions::kind(&domain.config, &action.name) == ActionKind::Moving;
    let mut nearest: Option<Compared> = None;
    for action in round.task.actions.iter().filter(is_moving) {
        let mut drives = Drives { semantics: &semantics, state: &state, action, left: DRIVES, nearest: None };
        if drives.some_is_free(0, &mut Binding::new(action.slots)) {
            return None;
        }
        let found = drives.nearest;
        nearest = match (nearest, found) {
            (Some(one), Some(other)) if lacks(&other) < lacks(&one) => Some(other),
            (one, other) => one.or(other),
        };
    }
    nearest
}

/// Difference between the sides of a comparison; infinite if a side is undefined.
fn lacks(compared: &Compared) -> f64 {
    let sides = compared.left_value.zip(compared.right_value);
    sides.map_or(f64::INFINITY, |(left, right)| (left - right).abs())
}

/// Reasons for no plan; a numeric condition that forbids every drive replaces the refusals of
/// attachments.
pub fn reasons(domain: &Domain, round: &Round, all: Vec<NoPlan>) -> Vec<NoPlan> {
    let Some(compared) = of_drives(domain, round) else { return all };
    let message = format!("no drive can be taken: {}", told(&compared, &|text| text.to_string()));
    let others = all.into_iter().filter(|reason| !matches!(reason, NoPlan::Refused { .. }));
    std::iter::once(NoPlan::Finding { message, help: None }).chain(others).collect()
}

/// Unmet comparison in words; `say` verbalises a PDDL term.
pub fn told(compared: &Compared, say: &dyn Fn(&str) -> String) -> String {
    let value =
        |value: Option<f64>| value.map_or("without a value".to_string(), |value| format!("{value:.2}"));
    let Compared { left, left_value, comparison, right, right_value } = compared;
    match (left_value, right_value) {
        (None, _) => format!("{} has no value", say(left)),
        (_, None) => format!("{} has no value", say(right)),
        _ => format!(
            "{} is {}, and {} {} is wanted",
            say(left),
            value(*left_value),
            words(*comparison),
            value(*right_value)
        ),
    }
}

fn words(comparison: descry_planner::task::Comparison) -> &'static str {
    use descry_planner::task::Comparison;
    match comparison {
        Comparison::Less => "less than",
        Comparison::LessOrEqual => "at most",
        Comparison::Equal => "exactly",
        Comparison::GreaterOrEqual => "at least",
        Comparison::Greater => "more than",
    }
}

/// Search through the instances of a moving action for one that no numeric condition forbids.
struct Drives<'a> {
    semantics: &'a Semantics<'a>,
    state: &'a State,
    action: &'a Action,
    left: usize,
    nearest: Option<Compared>,
}

impl Drives<'_> {
    /// True if the action is possible for some binding of the parameters from the `n`-th on.
    fn some_is_free(&mut self, n: usize, binding: &mut Binding) -> bool {
        let Some(parameter) = self.action.parameters.get(n) else {
            self.left = self.left.saturating_sub(1);
            // What is not looked at may be free.
            return self.left == 0 || self.is_free(binding);
        };
        let objects: Vec<ObjectId> = parameter.objects.to_vec();
        objects.into_iter().any(|object| {
            binding.objects[n] = object;
            self.some_is_free(n + 1, binding)
        })
    }

    fn is_free(&mut self, binding: &mut Binding) -> bool {
        let parts = match &self.action.condition.start {
            Condition::And(parts) => parts.as_slice(),
            one => std::slice::from_ref(one),
        };
        let (numbers, others): (Vec<&Condition>, Vec<&Condition>) =
            parts.iter().partition(|part| matches!(part, Condition::Compare(..)));
        let holds = |part: &Condition, binding: &mut Binding| {
            self.semantics.holds(self.state, part, binding).unwrap_or(false)
        };
        if !others.into_iter().all(|part| holds(part, binding)) || !self.lasts(binding) {
            return false;
        }
        let Some(unmet) = numbers.into_iter().find(|part| !holds(part, binding)) else { return true };
        let why = self.semantics.why_not(self.state, unmet, binding).ok().flatten();
        if let Some(compared) = why.and_then(|why| why.compared)
            && self.nearest.as_ref().is_none_or(|nearest| lacks(&compared) < lacks(nearest))
        {
            self.nearest = Some(compared);
        }
        false
    }

    /// True if the action's duration is finite, that is, a route exists.
    fn lasts(&self, binding: &Binding) -> bool {
        let mut bounds = self.action.duration.iter().flatten();
        bounds.all(|bound| {
            let seconds = self.semantics.number(self.state, &bound.value, binding).ok().flatten();
            seconds.is_some_and(f64::is_finite)
        })
    }
}
