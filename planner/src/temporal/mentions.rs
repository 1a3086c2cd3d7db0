//! Keeps apart happenings that interfere by the strict rule of PDDL 2.1 ("no moving targets"), where
//! grounding hides the interference.
//!
//! A condition reads everything that it mentions (PDDL 2.1, section 8.1, and strict validators),
//! and nothing that it reads may change at the same time. Grounding drops parts of conditions that
//! static facts decide, instances that cannot derive a derived fact, conditions that always hold, and
//! effects that no condition needs. So the search does not see these reads and writes. This is no loss,
//! as such happenings may still come before or after one another: they are moved apart in the schedule
//! of the finished plan.

use rustc_hash::{FxHashMap, FxHashSet};

use crate::plan::EPSILON_S;
use crate::semantics::reads::depends_on;
use crate::task::{
    Assignment, Change, Condition, Expression, GroundChange, PredicateId, Quantified, Task, Term,
};

use super::advance::TemporalStep;
use super::order::{Access, Inconsistent};
use super::space::{Space, Track};
use super::world::{Act, World};

/// Maximum number of passes over all happenings; separating two of them may bring others together.
const MOST_ROUNDS: usize = 100;
/// Number of compared happenings between two checks of the stop signal.
const TOUCHES_A_LOOK: usize = 1024;

/// Predicate or function: true for a function, and its index in the task.
type Place = (bool, u32);
/// Ground atom or function instance: true for a function, index of the predicate or function, and
/// argument objects.
type Name = (bool, u32, Vec<u32>);

/// Stands, in place of arguments, for all instances of a predicate or function.
const ALL: u32 = u32::MAX;
/// Stands, in place of arguments, for one instance that depends on the state.
const SOME: u32 = u32::MAX - 1;
/// Stands, in place of a step, for a timed literal.
const GIVEN: usize = usize::MAX;

/// Way in which a happening uses an atom or number.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
enum Use {
    Mentions,
    Adds,
    Deletes,
    /// Adds or deletes some instance of a predicate or function, no matter which.
    Changes,
    /// Assigns a number; excludes every other use at the same time, including another assignment.
    Writes,
}

/// All uses of atoms and numbers by one happening.
type Uses = FxHashSet<(Name, Use)>;

/// A happening of a plan that uses an atom or number.
#[derive(Clone, Copy)]
struct Touch {
    happening: u32,
    step: usize,
    does: Use,
}

/// Separates interfering happenings that are at the same time; false if stopped before it is done.
/// Fails if the times do not allow it.
pub fn keep_apart(
    space: &Space,
    steps: &[TemporalStep],
    track: &mut Track,
    stop: &dyn Fn() -> bool,
) -> Result<bool, Inconsistent> {
    let mut looks = 0;
    let mut touches = touches(space, steps, track)?;
    for _ in 0..MOST_ROUNDS {
        let order = &track.order;
        let mut together: Vec<(u32, u32)> = Vec::new();
        for touches in touches.values_mut() {
            let time_s = |touch: &Touch| order.earliest_s(touch.happening);
            touches.sort_by(|one, other| time_s(one).total_cmp(&time_s(other)));
            for (index, one) in touches.iter().enumerate() {
                looks += 1;
                if looks % TOUCHES_A_LOOK == 0 && stop() {
                    return Ok(false);
                }
                let near = |other: &&Touch| time_s(other) - time_s(one) < EPSILON_S / 2.0;
                let disturbs = |other: &&Touch| {
                    other.step != one.step && (other.does != one.does || one.does == Use::Writes)
                };
                let others = touches[index + 1..].iter().take_while(near).filter(disturbs);
                together.extend(others.map(|other| in_order(one, other)));
            }
        }
        if together.is_empty() {
            return Ok(true);
        }
        together.sort_unstable();
        together.dedup();
        track.order.separate(&together)?;
    }
    Ok(true)
}

/// True if the start and the end of an action interfere.
pub(super) fn disturbs_itself(world: &World, act: &Act) -> bool {
    let [at_start, at_end] = Named::new(world.task).uses(world, act);
    at_start.iter().any(|(name, does)| {
        at_end.iter().any(|(other, also)| other == name && (also != does || *does == Use::Writes))
    })
}

/// Two happenings in the order in which they are to be separated: timed literals, which cannot move,
/// come first.
fn in_order(one: &Touch, other: &Touch) -> (u32, u32) {
    let key = |touch: &Touch| (touch.step != GIVEN, touch.happening);
    if key(one) < key(other) { (one.happening, other.happening) } else { (other.happening, one.happening) }
}

/// Happenings that use each atom or number, for those used in more than one way or assigned; adds the
/// timed literals to the network.
fn touches(
    space: &Space,
    steps: &[TemporalStep],
    track: &mut Track,
) -> Result<FxHashMap<Name, Vec<Touch>>, Inconsistent> {
    let mut touches: FxHashMap<Name, Vec<Touch>> = FxHashMap::default();
    let mut note = |happening: u32, step: usize, uses: Uses| {
        for (name, does) in uses {
            touches.entry(name).or_default().push(Touch { happening, step, does });
        }
    };
    let named = Named::new(space.world.task);
    for (step, action) in track.actions.iter().enumerate() {
        let &Some((start, end)) = action else { continue };
        let [at_start, at_end] = named.uses(space.world, &space.world.acts[steps[step].act as usize]);
        note(start, step, at_start);
        if let Some(end) = end {
            note(end, step, at_end);
        }
    }
    for timed in &space.world.task.init.timed {
        let mut uses = Uses::default();
        match &timed.change {
            GroundChange::Add(fact) | GroundChange::Delete(fact) => {
                let adds = matches!(timed.change, GroundChange::Add(_));
                let arguments = fact.arguments.iter().map(|object| object.0).collect();
                let does = if adds { Use::Adds } else { Use::Deletes };
                named.written((false, fact.predicate.0), arguments, does, &mut uses);
            }
            GroundChange::Number(fluent, _) | GroundChange::Object(fluent, _) => {
                let arguments = fluent.arguments.iter().map(|object| object.0).collect();
                named.written((true, fluent.function.0), arguments, Use::Writes, &mut uses);
            }
        }
        let happening = track.order.push_fixed(&Access::default(), timed.time_s)?;
        note(happening, GIVEN, uses);
    }
    touches.retain(|_, touches| {
        touches.iter().any(|touch| touch.does != touches[0].does || touch.does == Use::Writes)
    });
    Ok(touches)
}

/// Finds the atoms and numbers that an action's happenings use.
struct Named {
    /// Predicates on which each derived predicate depends; empty for other predicates.
    roots: Vec<Vec<u32>>,
    /// True if the task has object functions: the instance that a term denotes may then depend on the
    /// state.
    is_loose: bool,
}

impl Named {
    fn new(task: &Task) -> Named {
        let roots = |index: usize| {
            let predicate = PredicateId(index as u32);
            let mut roots = FxHashSet::default();
            if task.predicate(predicate).stratum.is_some() {
                depends_on(task, predicate, &mut roots);
            }
            let mut roots: Vec<u32> = roots.into_iter().map(|root| root.0).collect();
            roots.sort_unstable();
            roots
        };
        let is_loose = task.functions.iter().any(|function| function.result.is_some());
        Named { roots: (0..task.predicates.len()).map(roots).collect(), is_loose }
    }

    /// Uses of atoms and numbers by the start of an action and by its end.
    fn uses(&self, world: &World, act: &Act) -> [Uses; 2] {
        let origin = act.origin;
        let action = &world.task.actions[origin.schema as usize];
        let mut binding = vec![0; action.slots];
        binding[..origin.arguments.len()].copy_from_slice(&origin.arguments);
        let mut both = [Uses::default(), Uses::default()];
        let halves =
            [(&action.condition.start, &action.effects.start), (&action.condition.end, &action.effects.end)];
        for (uses, (condition, effects)) in both.iter_mut().zip(halves) {
            self.walk(condition, &mut binding, uses);
            for effect in effects {
                every(&effect.forall, &mut binding, &mut |binding| {
                    self.walk(&effect.when.start, binding, uses);
                    self.walk(&effect.when.end, binding, uses);
                    self.change(&effect.change, binding, uses);
                });
            }
        }
        both
    }

    fn change(&self, change: &Change, binding: &[u32], into: &mut Uses) {
        let (place, terms, does) = match change {
            Change::Add(atom) => ((false, atom.predicate.0), &atom.arguments, Use::Adds),
            Change::Delete(atom) => ((false, atom.predicate.0), &atom.arguments, Use::Deletes),
            Change::Number(how, fluent, amount) => {
                self.read(amount, binding, into);
                let adds = matches!(how, Assignment::Increase | Assignment::Decrease);
                let does = if adds { Use::Adds } else { Use::Writes };
                ((true, fluent.function.0), &fluent.arguments, does)
            }
            Change::Object(fluent, value) => {
                self.terms(value.as_slice(), binding, into);
                ((true, fluent.function.0), &fluent.arguments, Use::Writes)
            }
            Change::Call(_) => return,
        };
        self.terms(terms, binding, into);
        match objects(terms, binding) {
            Some(arguments) => self.written(place, arguments, does, into),
            None => {
                into.insert(((place.0, place.1, vec![ALL]), Use::Changes));
                into.insert(((place.0, place.1, vec![SOME]), Use::Writes));
            }
        }
    }

    /// Records the change of an instance, and of the whole predicate or function where reads of all its
    /// instances matter.
    fn written(&self, (is_function, place): Place, arguments: Vec<u32>, does: Use, into: &mut Uses) {
        into.insert(((is_function, place, arguments), does));
        if self.is_loose || !is_function {
            into.insert(((is_function, place, vec![ALL]), Use::Changes));
        }
        if self.is_loose {
            into.insert(((is_function, place, vec![SOME]), Use::Mentions));
        }
    }

    /// Records the read of an instance, and of the functions in its arguments.
    fn mentioned(&self, (is_function, place): Place, terms: &[Term], binding: &[u32], into: &mut Uses) {
        self.terms(terms, binding, into);
        let arguments = objects(terms, binding).unwrap_or_else(|| vec![ALL]);
        into.insert(((is_function, place, arguments), Use::Mentions));
        if self.is_loose {
            into.insert(((is_function, place, vec![SOME]), Use::Mentions));
        }
    }

    /// Records reads of the functions that occur in terms.
    fn terms(&self, terms: &[Term], binding: &[u32], into: &mut Uses) {
        for term in terms {
            if let Term::Function(fluent) = term {
                self.mentioned((true, fluent.function.0), &fluent.arguments, binding, into);
            }
        }
    }

    fn walk(&self, condition: &Condition, binding: &mut [u32], into: &mut Uses) {
        match condition {
            Condition::And(parts) | Condition::Or(parts) => {
                parts.iter().for_each(|part| self.walk(part, binding, into));
            }
            Condition::Not(inner) => self.walk(inner, binding, into),
            Condition::Forall(variables, inner) | Condition::Exists(variables, inner) => {
                every(variables, binding, &mut |binding| self.walk(inner, binding, into));
            }
            Condition::Atom(atom) => {
                self.mentioned((false, atom.predicate.0), &atom.arguments, binding, into);
                let roots = self.roots[atom.predicate.index()].iter();
                into.extend(roots.map(|&root| ((false, root, vec![ALL]), Use::Mentions)));
            }
            Condition::Compare(_, sides, _) => sides.iter().for_each(|side| self.read(side, binding, into)),
            Condition::Same(terms, _) => self.terms(&**terms, binding, into),
            Condition::Call(call) => self.terms(&call.arguments, binding, into),
        }
    }

    /// Records the reads of an expression.
    fn read(&self, expression: &Expression, binding: &[u32], into: &mut Uses) {
        match expression {
            Expression::Fluent(fluent) => {
                self.mentioned((true, fluent.function.0), &fluent.arguments, binding, into);
            }
            Expression::Add(parts) | Expression::Multiply(parts) => {
                parts.iter().for_each(|part| self.read(part, binding, into));
            }
            Expression::Subtract(sides) | Expression::Divide(sides) => {
                sides.iter().for_each(|side| self.read(side, binding, into));
            }
            Expression::Negative(inner) => self.read(inner, binding, into),
            Expression::Call(call) => self.terms(&call.arguments, binding, into),
            Expression::Number(_)
            | Expression::Duration
            | Expression::TotalTime
            | Expression::Violated(_) => {}
        }
    }
}

fn objects(terms: &[Term], binding: &[u32]) -> Option<Vec<u32>> {
    let object = |term: &Term| match term {
        Term::Variable(slot) => Some(binding[slot.index()]),
        Term::Object(object) => Some(object.0),
        Term::Function(_) => None,
    };
    terms.iter().map(object).collect()
}

fn every(variables: &[Quantified], binding: &mut [u32], visit: &mut dyn FnMut(&mut [u32])) {
    let Some((first, others)) = variables.split_first() else { return visit(binding) };
    for object in first.parameter.objects.iter() {
        binding[first.slot.index()] = object.0;
        every(others, binding, visit);
    }
}
