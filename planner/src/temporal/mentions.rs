//! What conditions mention though it can never matter to them.
//!
//! Where a static fact decides a part of a quantified or disjunctive condition, grounding leaves the rest of that part
//! out. PDDL 2.1 (section 8.1) takes all that a condition mentions for what it reads, and so do strict validators: what
//! changes it must not happen at the same time. Before or after makes no difference, so the search knows nothing of
//! this: in the schedule of a finished plan, such happenings are moved apart.

use rustc_hash::FxHashMap;

use crate::ground::{Meaning, VariableId};
use crate::solve::EPSILON_S;
use crate::task::{Condition, Quantified, Term};

use super::advance::Step;
use super::order::Inconsistent;
use super::space::{Space, Track};
use super::world::World;

/// Rounds of moving happenings apart, each of which may bring others together.
const MOST_ROUNDS: usize = 100;

/// A happening of a plan that mentions or changes a variable.
#[derive(Clone, Copy)]
struct Touch {
    happening: u32,
    step: usize,
}

/// By variable, the happenings that mention it and those that change it.
type Touches = FxHashMap<VariableId, [Vec<Touch>; 2]>;

/// Moves apart what happens at the same time where one changes what the other mentions.
pub(super) fn keep_apart(space: &Space, steps: &[Step], track: &mut Track) -> Result<(), Inconsistent> {
    if !space
        .world
        .task
        .actions
        .iter()
        .any(|action| [&action.condition.start, &action.condition.end].into_iter().any(mentions_more))
    {
        return Ok(());
    }
    let touches = touches(space, steps, track);
    for _ in 0..MOST_ROUNDS {
        let order = &track.order;
        let mut together: Vec<(u32, u32)> = Vec::new();
        for [mentions, changes] in touches.values() {
            for mention in mentions {
                let at_once = |change: &&Touch| {
                    let apart_s = order.earliest_s(change.happening) - order.earliest_s(mention.happening);
                    change.step != mention.step && apart_s.abs() < EPSILON_S / 2.0
                };
                let pair = |change: &Touch| {
                    let (one, other) = (mention.happening, change.happening);
                    (one.min(other), one.max(other))
                };
                together.extend(changes.iter().filter(at_once).map(pair));
            }
        }
        if together.is_empty() {
            return Ok(());
        }
        together.sort_unstable();
        together.dedup();
        track.order.separate(&together)?;
    }
    Ok(())
}

/// Whether a condition may mention more than its ground instances hold.
fn mentions_more(condition: &Condition) -> bool {
    match condition {
        Condition::And(parts) => parts.iter().any(mentions_more),
        other => matches!(other, Condition::Or(_) | Condition::Forall(..) | Condition::Exists(..)),
    }
}

fn touches(space: &Space, steps: &[Step], track: &Track) -> Touches {
    let reader = Reader::new(space.world);
    let mut touches = Touches::default();
    let variables = space.world.ground.variables.len() as u32;
    for (step, action) in track.actions.iter().enumerate() {
        let &Some((start, end)) = action else { continue };
        let act = steps[step].act;
        let (at_start, at_end) = space.accesses.of(act);
        let condition =
            &space.world.task.actions[space.world.acts[act as usize].origin.schema as usize].condition;
        let happenings =
            [(Some(start), Some(at_start), &condition.start), (end, at_end.as_ref(), &condition.end)];
        for (happening, access, condition) in happenings {
            let (Some(happening), Some(access)) = (happening, access) else { continue };
            let touch = Touch { happening, step };
            for variable in reader.mentioned(space.world, act, condition) {
                touches.entry(variable).or_default()[0].push(touch);
            }
            for &variable in access.writes.iter().filter(|&&resource| resource < variables) {
                touches.entry(variable).or_default()[1].push(touch);
            }
        }
    }
    touches
}

/// Ground atoms by name.
struct Reader {
    variables: FxHashMap<(u32, Vec<u32>), VariableId>,
}

impl Reader {
    fn new(world: &World) -> Reader {
        let mut variables = FxHashMap::default();
        for (variable, declared) in world.ground.variables.iter().enumerate() {
            for meaning in &declared.values {
                if let Meaning::Atom { predicate, arguments } = meaning {
                    variables.insert((*predicate, arguments.clone()), variable as VariableId);
                }
            }
        }
        Reader { variables }
    }

    /// The variables that a condition of an action mentions; none where they are all in its ground condition.
    fn mentioned(&self, world: &World, act: u32, condition: &Condition) -> Vec<VariableId> {
        let mut found = Vec::new();
        if mentions_more(condition) {
            let origin = world.acts[act as usize].origin;
            let mut binding = vec![0; world.task.actions[origin.schema as usize].slots];
            binding[..origin.arguments.len()].copy_from_slice(&origin.arguments);
            self.walk(condition, &mut binding, &mut found);
            found.sort_unstable();
            found.dedup();
        }
        found
    }

    fn walk(&self, condition: &Condition, binding: &mut [u32], into: &mut Vec<VariableId>) {
        match condition {
            Condition::And(parts) | Condition::Or(parts) => {
                parts.iter().for_each(|part| self.walk(part, binding, into));
            }
            Condition::Not(inner) => self.walk(inner, binding, into),
            Condition::Forall(variables, inner) | Condition::Exists(variables, inner) => {
                self.every(variables, inner, binding, into);
            }
            Condition::Atom(atom) => {
                let object = |term: &Term| match term {
                    Term::Variable(slot) => Some(binding[slot.index()]),
                    Term::Object(object) => Some(object.0),
                    Term::Function(_) => None,
                };
                let arguments: Option<Vec<u32>> = atom.arguments.iter().map(object).collect();
                let variable =
                    arguments.and_then(|arguments| self.variables.get(&(atom.predicate.0, arguments)));
                into.extend(variable);
            }
            Condition::Same(..) | Condition::Compare(..) | Condition::Call(_) => {}
        }
    }

    fn every(
        &self,
        variables: &[Quantified],
        inner: &Condition,
        binding: &mut [u32],
        into: &mut Vec<VariableId>,
    ) {
        let Some((first, others)) = variables.split_first() else { return self.walk(inner, binding, into) };
        for object in first.parameter.objects.iter() {
            binding[first.slot.index()] = object.0;
            self.every(others, inner, binding, into);
        }
    }
}
