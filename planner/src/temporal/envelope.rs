//! Actions whose start and end must be separate steps in the search, because other actions have to
//! happen in between (required concurrency).

use std::collections::BTreeSet;

use rustc_hash::FxHashSet;

use crate::ground::{
    Change, Conjunction, GroundEffect, GroundExpression, GroundFact, GroundOutcome, NumericId,
};

use super::touch::Touched;
use super::world::{Act, World};

/// True, by action, if other actions may need a fact or a higher number that exists only while the
/// action runs (an envelope). All other actions can be compressed into one step.
pub fn envelopes(world: &World) -> Vec<bool> {
    let wanted = Wanted::new(world);
    world.acts.iter().map(|act| act.durative && wanted.inside(act)).collect()
}

/// True, by action, if the action is durative: splitting all of them covers every interleaving.
pub fn all_apart(world: &World) -> Vec<bool> {
    world.acts.iter().map(|act| act.durative).collect()
}

/// Checks that every plan can be rearranged into a sequence of compressed actions. Returns the actions
/// for which this holds only if they do not overlap themselves; `None` if it is not known to hold. The
/// condition: no timed literals, and every action can delay its start until just before its end, or end
/// right after its start (compare the compression-safe actions of Coles et al. 2009).
pub fn in_one_go_suffices(world: &World) -> Option<BTreeSet<u32>> {
    if !world.ground.timed.is_empty() {
        return None;
    }
    let wanted = Wanted::new(world);
    let mut written = vec![Vec::new(); world.ground.variables.len()];
    let mut touched = Touched::default();
    for (index, act) in world.acts.iter().enumerate() {
        for effect in act.start_effects.iter().chain(act.end_effects) {
            touched.clear();
            touched.outcome(world, &effect.outcome);
            touched.variables.iter().for_each(|&variable| written[variable as usize].push(index as u32));
        }
    }
    let locked: Vec<bool> = written
        .iter()
        .enumerate()
        .map(|(variable, writers)| is_locked(world, &wanted, variable as u32, writers))
        .collect();
    let alone: Vec<Option<u32>> = written
        .iter()
        .map(|writers| writers.first().copied().filter(|first| writers.iter().all(|writer| writer == first)))
        .collect();
    let mut alone_with_itself = BTreeSet::new();
    for (index, act) in (0..).zip(&world.acts).filter(|(_, act)| act.durative) {
        let derived = |variable: u32| world.ground.variables[variable as usize].stratum.is_some();
        let never_changes = |variable: u32| !derived(variable) && written[variable as usize].is_empty();
        if ends_early(&locked, act) || starts_late(world, never_changes, act) {
            continue;
        }
        let kept = |variable: u32| {
            never_changes(variable) || !derived(variable) && alone[variable as usize] == Some(index)
        };
        if !starts_late(world, kept, act) {
            return None;
        }
        alone_with_itself.insert(index);
    }
    Some(alone_with_itself)
}

/// True if an action can start just before its end whenever it can start earlier. `kept` is true for
/// variables that no other action changes.
fn starts_late(world: &World, kept: impl Fn(u32) -> bool, act: &Act) -> bool {
    let kept = |fact: &GroundFact| act.over_all.facts.contains(fact) || kept(fact.variable);
    act.start_effects.is_empty()
        && act.flow_effects.is_empty()
        && act.at_start.facts.iter().all(kept)
        && act.at_start.comparisons.is_empty()
        && act.at_start.calls.iter().all(|&(call, _)| world.calls.settles(call))
        && act.bounds.iter().all(|bound| settled(world, &bound.seconds))
        && act
            .end_effects
            .iter()
            .filter_map(|effect| effect.when.as_ref())
            .all(|when| when.at_start.is_empty() && when.over_all.is_empty())
}

/// True if an action can end right after its start without loss, because its end changes only locked
/// variables.
fn ends_early(locked: &[bool], act: &Act) -> bool {
    act.at_end.comparisons.is_empty()
        && act.at_end.calls.is_empty()
        && act.at_end.facts.iter().all(|fact| act.over_all.facts.contains(fact))
        && act.flow_effects.is_empty()
        && act
            .end_effects
            .iter()
            .all(|effect| plain(effect).is_some_and(|fact| locked[fact.variable as usize]))
}

fn plain(effect: &GroundEffect) -> Option<GroundFact> {
    match (&effect.when, &effect.outcome) {
        (None, GroundOutcome::Set(fact)) => Some(*fact),
        _ => None,
    }
}

/// True if only one action at a time can change a variable: every writer sets the variable at its start
/// to the same value, which no condition needs and in which no writer can start.
fn is_locked(world: &World, wanted: &Wanted, variable: u32, writers: &[u32]) -> bool {
    let between = |writer: &u32| {
        let act = &world.acts[*writer as usize];
        let given = act.start_effects.iter().filter_map(plain).rfind(|fact| fact.variable == variable)?;
        let free = act.at_start.facts.iter().find(|fact| fact.variable == variable)?;
        (free.value != given.value && !wanted.facts.contains(&given)).then_some(given.value)
    };
    let first = writers.first().and_then(between);
    first.is_some()
        && !wanted.read[variable as usize]
        && writers.iter().all(|writer| between(writer) == first)
}

/// True if the value of an expression is the same in every state.
pub(crate) fn settled(world: &World, expression: &GroundExpression) -> bool {
    match expression {
        GroundExpression::Constant(_) => true,
        GroundExpression::Call(call) => world.calls.settles(*call),
        GroundExpression::Sum(parts) | GroundExpression::Product(parts) => {
            parts.iter().all(|part| settled(world, part))
        }
        GroundExpression::Difference(left, right) | GroundExpression::Quotient(left, right) => {
            settled(world, left) && settled(world, right)
        }
        GroundExpression::Negative(inner) => settled(world, inner),
        GroundExpression::Fluent(_)
        | GroundExpression::Duration
        | GroundExpression::TotalTime
        | GroundExpression::Violated(_) => false,
    }
}

struct Wanted {
    facts: FxHashSet<GroundFact>,
    numbers: FxHashSet<NumericId>,
    /// True, by variable, if some call reads the variable.
    read: Vec<bool>,
}

impl Wanted {
    fn new(world: &World) -> Wanted {
        let mut facts = FxHashSet::default();
        let mut touched = Touched::default();
        let mut want = |condition: &Conjunction| {
            facts.extend(condition.facts.iter().copied());
            touched.condition(world, condition);
        };
        for act in &world.acts {
            want(act.at_start);
            want(act.over_all);
            want(act.at_end);
            for when in
                act.start_effects.iter().chain(act.end_effects).filter_map(|effect| effect.when.as_ref())
            {
                want(&when.here);
                want(&when.at_start);
                want(&when.over_all);
            }
        }
        world.ground.axioms.iter().for_each(|axiom| want(&axiom.body));
        want(&world.ground.goal);
        let mut read = vec![false; world.ground.variables.len()];
        for call in 0..world.ground.calls.len() as u32 {
            world.calls.reads(call).0.iter().for_each(|&variable| read[variable as usize] = true);
        }
        Wanted { facts, numbers: touched.numbers.iter().copied().collect(), read }
    }

    fn inside(&self, act: &Act) -> bool {
        act.start_effects.iter().any(|effect| match &effect.outcome {
            GroundOutcome::Set(fact) => self.facts.contains(fact) && undone(*fact, act.end_effects),
            GroundOutcome::Change { fluent, change: Change::Increase, .. } => {
                self.numbers.contains(fluent)
                    && act.end_effects.iter().any(|end| {
                        matches!(&end.outcome, GroundOutcome::Change { fluent: other, change: Change::Decrease, .. } if other == fluent)
                    })
            }
            _ => false,
        })
    }
}

fn undone(fact: GroundFact, end: &[GroundEffect]) -> bool {
    let sets = |effect: &GroundEffect| match effect.outcome {
        GroundOutcome::Set(other) => Some(other).filter(|other| other.variable == fact.variable),
        _ => None,
    };
    end.iter().any(|effect| sets(effect).is_some_and(|other| other.value != fact.value))
        && !end.iter().any(|effect| sets(effect) == Some(fact))
}
