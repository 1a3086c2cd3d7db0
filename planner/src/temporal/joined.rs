//! Shortcuts: replaces two steps of one action by a single one, such as `(move a b)`, `(move b c)` by
//! `(move a c)`. A search that follows relaxed plans reaches one goal after another and does not notice
//! such detours.

use crate::calls::Failure;
use crate::ground::GroundOutcome;

use super::advance::{Part, TemporalStep};
use super::schedule::Replayed;
use super::space::Space;
use super::world::{Act, World};

/// Maximum number of steps replayed for one plan.
const MOST_REPLAYED: usize = 20_000;
/// Maximum number of actions inspected for one plan.
const MOST_LOOKED_AT: usize = 20_000_000;

/// Plan in which pairs of steps are replaced by one step or removed, as long as the plan gets no worse.
/// The result is a complete replay.
pub fn shortened(space: &Space, mut plan: Replayed, stop: &dyn Fn() -> bool) -> Result<Replayed, Failure> {
    let mut left = MOST_REPLAYED;
    let mut looks = MOST_LOOKED_AT / space.world.acts.len().max(1);
    'shorter: loop {
        if left <= plan.1.len() {
            return Ok(plan);
        }
        for (first, second) in pairs(space.world, &plan.1, stop) {
            looks = looks.saturating_sub(1);
            if looks == 0 {
                return Ok(plan);
            }
            let one = instead(space.world, plan.1[first].act, plan.1[second].act);
            for act in one.map(Some).chain([None]) {
                left = left.saturating_sub(plan.1.len());
                if left == 0 || stop() {
                    return Ok(plan);
                }
                let mut steps = plan.1.clone();
                match act {
                    Some(act) => steps[second].act = act,
                    None => drop(steps.remove(second)),
                }
                steps.remove(first);
                if let Some((measured, base)) = space.replay_to_goal(&mut steps, stop)?
                    && measured <= plan.0
                {
                    plan = (measured, steps, base);
                    continue 'shorter;
                }
            }
        }
        return Ok(plan);
    }
}

/// Pairs of compressed steps of one action schema, the second of which needs an effect of the first;
/// incomplete if `stop` returns true.
fn pairs(world: &World, steps: &[TemporalStep], stop: &dyn Fn() -> bool) -> Vec<(usize, usize)> {
    let act = |step: &TemporalStep| &world.acts[step.act as usize];
    let is_whole = |step: &TemporalStep| step.part == Part::Whole && step.proposal.is_none();
    let follows = |first: &Act, second: &Act| {
        first.origin.schema == second.origin.schema
            && first.start_effects.iter().chain(first.end_effects).any(|effect| match &effect.outcome {
                GroundOutcome::Set(fact) => second.at_start.facts.contains(fact),
                _ => false,
            })
    };
    let mut pairs = Vec::new();
    for (at, second) in steps.iter().enumerate().filter(|(_, step)| is_whole(step)) {
        if stop() {
            break;
        }
        let before = steps[..at].iter().enumerate().rev().filter(|(_, step)| is_whole(step));
        let first = before.into_iter().find(|(_, first)| follows(act(first), act(second)));
        pairs.extend(first.map(|(first, _)| (first, at)));
    }
    pairs
}

/// Actions of the same schema, each of whose arguments comes from one of two actions.
fn instead<'w>(world: &'w World, first: u32, second: u32) -> impl Iterator<Item = u32> + use<'w> {
    let [one, other] = [first, second].map(|act| world.acts[act as usize].origin);
    let is_instead = move |act: &Act| {
        let arguments = act.origin.arguments.iter().zip(one.arguments.iter().zip(&other.arguments));
        act.origin.schema == one.schema
            && act.origin.arguments != other.arguments
            && act.origin.arguments != one.arguments
            && arguments.into_iter().all(|(own, (one, other))| own == one || own == other)
    };
    let fitting = world.acts.iter().zip(0..).filter(move |(act, _)| is_instead(act));
    fitting.map(|(_, act)| act)
}
