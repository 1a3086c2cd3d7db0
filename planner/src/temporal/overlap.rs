//! Actions that overlap themselves: two instances of one action in progress at once.
//!
//! PDDL 2.1 allows this, and it makes planning harder: deciding whether a plan exists needs polynomial
//! space without self-overlap, exponential space with it if ends are kept apart, and is undecidable
//! otherwise (Gigante, Micheli, Montanari and Scala, Decidability and complexity of action-based
//! temporal planning over dense time, 2022). The searches therefore start no action while it is
//! running, and record where they could have: their proofs cover only plans in which no action overlaps
//! itself.

use std::collections::BTreeSet;

use rustc_hash::FxHashMap;

use crate::calls::Failure;
use crate::ground::{GroundFact, GroundOutcome};

use super::advance::{Part, Situation, TemporalStep};
use super::touch::Touched;
use super::world::{Act, DurationRange, World};

/// True if an action can start while it is in progress. For an action with a grounding module, this is
/// assumed.
pub(super) fn starts_again(world: &World, situation: &Situation, act: u32) -> Result<bool, Failure> {
    let nothing = DurationRange { least_s: 0.0, most_s: 0.0 };
    let mut step = TemporalStep { act, part: Part::Start, proposal: None, taken_s: None, span: nothing };
    Ok(!world.acts[act as usize].grounding.is_empty() || world.advance(situation, &mut step)?.is_some())
}

/// Actions, out of `acts`, that may be worth running in two instances at once.
///
/// An action without effects other than facts at its end that nothing ever changes again is left out:
/// of several instances, the first to end suffices. If actions can improve the metric (`earn`), none is
/// left out.
pub(super) fn helpful(world: &World, acts: BTreeSet<u32>, earn: bool) -> Vec<u32> {
    if acts.is_empty() || earn {
        return acts.into_iter().collect();
    }
    let kept = kept(world);
    let once = |act: &Act| {
        let for_ever = |fact: GroundFact| kept.get(&fact.variable) == Some(&Some(fact.value));
        act.start_effects.is_empty()
            && act.flow_effects.is_empty()
            && act.end_effects.iter().all(|effect| match effect.outcome {
                GroundOutcome::Set(fact) => effect.when.is_none() && for_ever(fact),
                _ => false,
            })
    };
    acts.into_iter().filter(|&act| !once(&world.acts[act as usize])).collect()
}

/// Only value that actions and timed literals ever give to each variable that they change; `None` if
/// there are several.
fn kept(world: &World) -> FxHashMap<u32, Option<u32>> {
    let acts = world.acts.iter().flat_map(|act| act.start_effects.iter().chain(act.end_effects));
    let given = world.ground.timed.iter().flat_map(|timed| &timed.outcomes);
    let mut kept: FxHashMap<u32, Option<u32>> = FxHashMap::default();
    let mut touched = Touched::default();
    for outcome in acts.map(|effect| &effect.outcome).chain(given) {
        if let GroundOutcome::Set(fact) = outcome {
            let value = kept.entry(fact.variable).or_insert(Some(fact.value));
            *value = value.filter(|value| *value == fact.value);
            continue;
        }
        touched.clear();
        touched.outcome(world, outcome);
        kept.extend(touched.variables.iter().map(|&variable| (variable, None)));
    }
    kept
}
