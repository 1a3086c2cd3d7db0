//! Removal of steps from a plan, for the large neighbourhood search.

use crate::ground::{Conjunction, GroundFact, GroundOutcome};

use super::advance::{Part, TemporalStep};
use super::space::Space;
use super::touch::Touched;
use super::world::World;

/// Pseudorandom generator (SplitMix64).
#[derive(Debug, Clone)]
pub(crate) struct Chance(u64);

impl Chance {
    /// Generator that starts from a seed.
    pub fn new(seed: u64) -> Chance {
        Chance(seed)
    }

    /// Pseudorandom number below `end`; 0 if `end` is 0.
    pub fn below(&mut self, end: usize) -> usize {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut mixed = (self.0 ^ (self.0 >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        mixed = (mixed ^ (mixed >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        mixed ^= mixed >> 31;
        if end == 0 { 0 } else { ((u128::from(mixed) * end as u128) >> 64) as usize }
    }
}

/// Image of a number under a permutation chosen by the seed (finaliser of SplitMix64); the number
/// itself for seed 0.
pub(super) fn shuffled(number: u64, seed: u64) -> u64 {
    if seed == 0 {
        return number;
    }
    let mut mixed = number.wrapping_add(seed.wrapping_mul(0x9e37_79b9_7f4a_7c15));
    mixed = (mixed ^ (mixed >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    mixed = (mixed ^ (mixed >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    mixed ^ (mixed >> 31)
}

/// Facts and numbers that later steps require, while a plan is walked backwards.
struct Asked<'w, 'a> {
    world: &'w World<'a>,
    facts: Vec<Option<u32>>,
    numbers: Vec<bool>,
}

impl Asked<'_, '_> {
    fn ask(&mut self, condition: &Conjunction) {
        for fact in &condition.facts {
            self.facts[fact.variable as usize] = Some(fact.value);
        }
        let mut touched = Touched::default();
        let only = Conjunction { facts: Vec::new(), ..condition.clone() };
        touched.condition(self.world, &only);
        touched.numbers.iter().for_each(|&number| self.numbers[number as usize] = true);
        // A call that reads a fact asks for it as it is; which value that is does not matter to what is kept.
        touched.variables.iter().for_each(|&variable| self.facts[variable as usize] = Some(u32::MAX));
    }
}

/// Steps of a plan that a goal needs, found by regression: the last writers of the needed facts, and
/// what these writers need in turn. For derived facts, numbers and calls, all steps that may contribute
/// are kept.
///
/// An action that is split into start and end is kept or dropped as a whole: once its start is found
/// useful, the walk begins again with its end kept.
pub(crate) fn keep_for(world: &World, steps: &[TemporalStep], goal: &Conjunction) -> Vec<TemporalStep> {
    let mut forced = vec![false; steps.len()];
    loop {
        let keep = walk(world, steps, goal, &forced);
        let ends = pairs(steps);
        let lacking: Vec<usize> = ends
            .iter()
            .flat_map(|&(start, end)| [(start, end), (end, start)])
            .filter(|&(one, other)| keep[one] && !keep[other])
            .map(|(_, other)| other)
            .collect();
        if lacking.is_empty() {
            return steps.iter().zip(keep).filter(|(_, keep)| *keep).map(|(step, _)| step.clone()).collect();
        }
        lacking.into_iter().for_each(|index| forced[index] = true);
    }
}

/// Indices of the start and the end of each split action.
fn pairs(steps: &[TemporalStep]) -> Vec<(usize, usize)> {
    let mut open: Vec<usize> = Vec::new();
    let mut pairs = Vec::new();
    for (index, step) in steps.iter().enumerate() {
        match step.part {
            Part::Start => open.push(index),
            Part::End => {
                let same =
                    |&start: &usize| steps[start].act == step.act && steps[start].proposal == step.proposal;
                if let Some(position) = open.iter().position(same) {
                    pairs.push((open.remove(position), index));
                }
            }
            Part::Whole | Part::Free => {}
        }
    }
    pairs
}

fn walk(world: &World, steps: &[TemporalStep], goal: &Conjunction, forced: &[bool]) -> Vec<bool> {
    let variables = world.ground.variables.len();
    let numbers = vec![false; world.ground.numerics.len()];
    let mut asked = Asked { world, facts: vec![None; variables], numbers };
    asked.ask(goal);
    let supports = derived_supports(world);
    let mut keep = vec![false; steps.len()];
    for (index, step) in steps.iter().enumerate().rev() {
        spread_derived(&supports, &mut asked);
        if step.part == Part::Free {
            keep[index] = true;
            continue;
        }
        let act = &world.acts[step.act as usize];
        let (from_start, from_end) = (step.part != Part::End, step.part != Part::Start);
        let mut effects = Vec::new();
        if from_start {
            effects.extend(act.start_effects);
        }
        if from_end {
            effects.extend(act.flow_effects.iter().chain(act.end_effects));
        }
        let useful = effects.iter().any(|effect| match &effect.outcome {
            GroundOutcome::Set(fact) => {
                asked.facts[fact.variable as usize].is_some_and(|v| v == fact.value || v == u32::MAX)
            }
            other => {
                let mut touched = Touched::default();
                touched.outcome(world, other);
                touched.numbers.iter().any(|&number| asked.numbers[number as usize])
                    || touched.variables.iter().any(|&variable| asked.facts[variable as usize].is_some())
            }
        });
        if !(useful || forced[index]) {
            continue;
        }
        keep[index] = true;
        for effect in &effects {
            if let GroundOutcome::Set(GroundFact { variable, .. }) = effect.outcome
                && effect.when.is_none()
            {
                asked.facts[variable as usize] = None;
            }
        }
        for when in effects.iter().filter_map(|effect| effect.when.as_ref()) {
            [&when.here, &when.at_start, &when.over_all]
                .into_iter()
                .for_each(|condition| asked.ask(condition));
        }
        let conditions = [(act.at_end, from_end), (act.over_all, true)];
        for (condition, own) in conditions {
            if own {
                ask_but_for(
                    &mut asked,
                    condition,
                    if from_start { act.start_effects } else { &[] },
                    from_start && from_end,
                );
            }
        }
        if from_start {
            asked.ask(act.at_start);
        }
    }
    keep
}

/// Requires the condition of an action, except facts that the action's own start achieves.
fn ask_but_for(
    asked: &mut Asked,
    condition: &Conjunction,
    start: &[crate::ground::GroundEffect],
    whole: bool,
) {
    let given =
        |fact: &GroundFact| whole && start.iter().any(|effect| effect.outcome == GroundOutcome::Set(*fact));
    let facts = condition.facts.iter().filter(|fact| !given(fact)).copied().collect();
    asked.ask(&Conjunction { facts, ..condition.clone() });
}

/// Variables and numbers that the axioms of each derived variable read; `None` for other variables.
fn derived_supports(world: &World) -> Vec<Option<Touched>> {
    let mut supports: Vec<Option<Touched>> =
        world.ground.variables.iter().map(|v| v.stratum.map(|_| Touched::default())).collect();
    for axiom in &world.ground.axioms {
        if let Some(touched) = &mut supports[axiom.head.variable as usize] {
            touched.condition(world, &axiom.body);
        }
    }
    supports
}

fn spread_derived(supports: &[Option<Touched>], asked: &mut Asked) {
    let mut agenda: Vec<usize> =
        (0..supports.len()).filter(|&v| supports[v].is_some() && asked.facts[v].is_some()).collect();
    let mut spread = agenda.clone();
    while let Some(variable) = agenda.pop() {
        let Some(touched) = &supports[variable] else { continue };
        touched.numbers.iter().for_each(|&number| asked.numbers[number as usize] = true);
        for &read in &touched.variables {
            if asked.facts[read as usize] != Some(u32::MAX) {
                asked.facts[read as usize] = Some(u32::MAX);
                if supports[read as usize].is_some() && !spread.contains(&(read as usize)) {
                    agenda.push(read as usize);
                    spread.push(read as usize);
                }
            }
        }
    }
    spread.into_iter().for_each(|variable| asked.facts[variable] = None);
}

/// Random part of a plan, to be kept while the rest is replanned: a prefix, or the steps that some of
/// the goals need.
pub(crate) fn taken_apart(space: &Space, steps: &[TemporalStep], chance: &mut Chance) -> Vec<TemporalStep> {
    let goal = &space.world.ground.goal;
    let parts = goal.facts.len() + goal.comparisons.len() + goal.calls.len();
    if parts < 2 || chance.below(4) == 0 {
        return beginning(steps, chance);
    }
    // One goal, a few, or up to half of them are given up.
    let most = [1, 1, 2, 3, parts.div_ceil(3), parts.div_ceil(2)][chance.below(6)].min(parts);
    let mut kept = goal.clone();
    // What is fulfilled last decides when the plan ends: it is given up more often.
    if let Ok(track) = space.track(steps) {
        let ready_s = track.order.ready_s();
        let done_s = |fact: &GroundFact| ready_s[fact.variable as usize];
        kept.facts.sort_by(|one, other| done_s(other).total_cmp(&done_s(one)).then(one.cmp(other)));
    }
    for _ in 0..most {
        let within = 1 + chance.below(kept.facts.len() + kept.comparisons.len());
        let at = chance.below(within);
        if at < kept.facts.len() {
            kept.facts.remove(at);
        } else if at - kept.facts.len() < kept.comparisons.len() {
            kept.comparisons.remove(at - kept.facts.len());
        }
    }
    keep_for(space.world, steps, &kept)
}

fn beginning(steps: &[TemporalStep], chance: &mut Chance) -> Vec<TemporalStep> {
    let mut end = chance.below(steps.len());
    // Not while an action is in progress.
    let open = |end: usize| {
        let starts = steps[..end].iter().filter(|step| step.part == Part::Start).count();
        starts > steps[..end].iter().filter(|step| step.part == Part::End).count()
    };
    while end > 0 && open(end) {
        end -= 1;
    }
    steps[..end].to_vec()
}
