//! Which actions must have their start and end apart in the search.

use rustc_hash::FxHashSet;

use crate::ground::{Change, Conjunction, Effect, Fact, NumericId, Outcome};

use super::touch::Touched;
use super::world::{Act, World};

/// By action, whether it makes something true (or larger) only while it runs that others ask for. All other actions
/// can be done in one go in the search: what happens inside them is of use to nobody.
pub(crate) fn envelopes(world: &World) -> Vec<bool> {
    let wanted = Wanted::new(world);
    world
        .acts
        .iter()
        .enumerate()
        .map(|(index, act)| act.durative && wanted.inside(index as u32, act))
        .collect()
}

/// By action, whether it takes time: with all of them apart, the search sees every interleaving.
pub(crate) fn all_apart(world: &World) -> Vec<bool> {
    world.acts.iter().map(|act| act.durative).collect()
}

struct Wanted {
    facts: FxHashSet<Fact>,
    numbers: FxHashSet<NumericId>,
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
        Wanted { facts, numbers: touched.numbers.iter().copied().collect() }
    }

    fn inside(&self, _index: u32, act: &Act) -> bool {
        act.start_effects.iter().any(|effect| match &effect.outcome {
            Outcome::Set(fact) => self.facts.contains(fact) && undone(*fact, act.end_effects),
            Outcome::Change { fluent, change: Change::Increase, .. } => {
                self.numbers.contains(fluent)
                    && act.end_effects.iter().any(|end| {
                        matches!(&end.outcome, Outcome::Change { fluent: other, change: Change::Decrease, .. } if other == fluent)
                    })
            }
            _ => false,
        })
    }
}

fn undone(fact: Fact, end: &[Effect]) -> bool {
    let sets = |effect: &Effect| match effect.outcome {
        Outcome::Set(other) => Some(other).filter(|other| other.variable == fact.variable),
        _ => None,
    };
    end.iter().any(|effect| sets(effect).is_some_and(|other| other.value != fact.value))
        && !end.iter().any(|effect| sets(effect) == Some(fact))
}
