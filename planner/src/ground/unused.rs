//! Parameters that an action does not use: one object is enough for each.

use super::normal::{Action_, Change_, Effect_, Formula, Pattern, Term};
use crate::task::{Action, GroundChange, Task};

/// Reduces each unused parameter of an action to its first object, unless a durative action may
/// have to overlap itself under different objects.
pub(super) fn leave_out_what_nothing_uses(task: &Task, actions: &mut [Action_]) {
    let bare = |lifted: &Action| lifted.grounding.is_empty() && lifted.preferences.is_empty();
    let once: Vec<bool> = actions
        .iter()
        .map(|action| {
            let durative = action.duration.is_some();
            !durative || ends_first(task, actions, action) || alone(task, actions, action)
        })
        .collect();
    for (action, once) in actions.iter_mut().zip(once) {
        if !once || !bare(&task.actions[action.schema as usize]) {
            continue;
        }
        let used = used(action);
        for (domain, _) in action.domains[..action.arity].iter_mut().zip(&used).filter(|(_, used)| !**used) {
            *domain = domain.iter().copied().take(1).collect();
        }
    }
}

/// True, by slot, if the action mentions the slot.
fn used(action: &Action_) -> Vec<bool> {
    let mut used = vec![false; action.domains.len()];
    let mut note = |term: &Term| {
        if let Term::Slot(slot) = term {
            used[*slot as usize] = true;
        }
    };
    for formula in action.condition.all() {
        formula.terms(&mut note);
    }
    for (_, _, bound) in action.duration.iter().flatten() {
        bound.terms(&mut note);
    }
    for (fluent, rate) in &action.flows {
        fluent.terms.iter().for_each(&mut note);
        rate.terms(&mut note);
    }
    for effect in action.start_effects.iter().chain(&action.end_effects) {
        effect.when.all().into_iter().for_each(|formula| formula.terms(&mut note));
        match &effect.change {
            Change_::Add(pattern) | Change_::Delete(pattern) | Change_::Unset(pattern) => {
                pattern.terms.iter().for_each(&mut note);
            }
            Change_::Number(_, fluent, amount) => {
                fluent.terms.iter().for_each(&mut note);
                amount.terms(&mut note);
            }
            Change_::Call(call) => call.terms.iter().for_each(&mut note),
        }
    }
    used
}

/// True if overlapping instances bring no more than the one that ends first: the action has no
/// effects but atoms added at its end, which nothing deletes.
fn ends_first(task: &Task, actions: &[Action_], action: &Action_) -> bool {
    let lasts = |effect: &Effect_| match &effect.change {
        Change_::Add(added) => {
            let deletes = |other: &Effect_| match &other.change {
                Change_::Delete(gone) | Change_::Unset(gone) => gone.predicate == added.predicate,
                Change_::Call(_) => true,
                Change_::Add(_) | Change_::Number(..) => false,
            };
            let given = |change: &GroundChange| matches!(change, GroundChange::Delete(fact) if fact.predicate.0 == added.predicate);
            let mut timed = task.init.timed.iter();
            added.predicate < task.predicates.len() as u32
                && !effects(actions).any(deletes)
                && !timed.any(|timed| given(&timed.change))
        }
        _ => false,
    };
    let always = |effect: &Effect_| effect.when.all().into_iter().all(is_true);
    action.start_effects.is_empty()
        && action.flows.is_empty()
        && action.end_effects.iter().all(|effect| always(effect) && lasts(effect))
}

/// True if no two instances of an action can overlap: its start needs and deletes an atom that only
/// ends of actions of the same kind restore.
fn alone(task: &Task, actions: &[Action_], action: &Action_) -> bool {
    let mut taken = action.start_effects.iter().filter_map(|effect| match &effect.change {
        Change_::Delete(pattern) => Some(pattern),
        _ => None,
    });
    taken.any(|pattern| {
        let adds = |effect: &Effect_| match &effect.change {
            Change_::Add(added) => added.predicate == pattern.predicate,
            Change_::Call(_) => true,
            _ => false,
        };
        let gives_back = |other: &Action_| {
            let own = |effect: &Effect_| {
                !adds(effect) || matches!(&effect.change, Change_::Add(added) if takes(other, added))
            };
            !other.start_effects.iter().any(adds) && other.end_effects.iter().all(own)
        };
        let given = |change: &GroundChange| {
            matches!(change, GroundChange::Add(fact) if fact.predicate.0 == pattern.predicate)
        };
        pattern.predicate < task.predicates.len() as u32
            && takes(action, pattern)
            && actions.iter().all(gives_back)
            && !task.init.timed.iter().any(|timed| given(&timed.change))
    })
}

/// True if an action needs an atom at its start and deletes it there unconditionally.
fn takes(action: &Action_, pattern: &Pattern) -> bool {
    let same = |other: &Pattern| other.predicate == pattern.predicate && other.terms == pattern.terms;
    let bound = |term: &Term| !matches!(term, Term::Slot(slot) if *slot as usize >= action.arity);
    let takes = |effect: &Effect_| {
        let always = effect.forall.is_empty() && effect.when.all().into_iter().all(is_true);
        always && matches!(&effect.change, Change_::Delete(gone) if same(gone))
    };
    pattern.terms.iter().all(bound)
        && asks(&action.condition.start, &same)
        && action.start_effects.iter().any(takes)
}

fn asks(formula: &Formula, same: &dyn Fn(&Pattern) -> bool) -> bool {
    match formula {
        Formula::And(parts) => parts.iter().any(|part| asks(part, same)),
        Formula::Literal(pattern, true) => same(pattern),
        _ => false,
    }
}

fn is_true(formula: &Formula) -> bool {
    matches!(formula, Formula::And(parts) if parts.is_empty())
}

fn effects(actions: &[Action_]) -> impl Iterator<Item = &Effect_> {
    actions.iter().flat_map(|action| action.start_effects.iter().chain(&action.end_effects))
}
