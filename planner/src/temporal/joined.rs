//! Two steps of a plan by one, where the same action leads from where the first begins to where the second ends: `(move a b)`,
//! `(move b c)` by `(move a c)`. A search that follows a relaxed plan takes what it needs one after the other, and nothing in it sees the
//! detour.

use crate::calls::Failure;
use crate::ground::Outcome;

use super::advance::Step;
use super::relaxed::Part;
use super::schedule::Replayed;
use super::space::Space;
use super::world::{Act, World};

/// Steps that are replayed, and actions that are looked at, at most for one plan.
const MOST_REPLAYED: usize = 20_000;
const MOST_LOOKED_AT: usize = 20_000_000;

/// The plan with pairs of steps done by one, or left out, as long as that makes it no worse; always replayed.
pub(crate) fn shortened(
    space: &Space,
    mut plan: Replayed,
    stop: &dyn Fn() -> bool,
) -> Result<Replayed, Failure> {
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

/// Pairs of steps by the same action of which the second asks for what the first has brought about; once asked to stop,
/// those found so far.
fn pairs(world: &World, steps: &[Step], stop: &dyn Fn() -> bool) -> Vec<(usize, usize)> {
    let act = |step: &Step| &world.acts[step.act as usize];
    let is_whole = |step: &Step| step.part == Part::Whole && step.proposal.is_none();
    let follows = |first: &Act, second: &Act| {
        first.origin.schema == second.origin.schema
            && first.start_effects.iter().chain(first.end_effects).any(|effect| match &effect.outcome {
                Outcome::Set(fact) => second.at_start.facts.contains(fact),
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

/// The actions of the same kind about the objects of one or the other, parameter by parameter.
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::attachment::Attachments;
    use crate::calls::Calls;
    use crate::small;
    use crate::temporal::envelope::envelopes;
    use crate::temporal::space::Measure;

    const DRIVES: &str =
        "(define (domain drives) (:requirements :durative-actions :typing :numeric-fluents) (:types place)
      (:predicates (at ?p - place) (seen ?p - place) (road ?a ?b - place)) (:functions (far ?a ?b - place))
      (:durative-action go :parameters (?a ?b - place) :duration (= ?duration (far ?a ?b))
        :condition (and (at start (at ?a)) (at start (road ?a ?b)))
        :effect (and (at start (not (at ?a))) (at end (at ?b))))
      (:durative-action see :parameters (?p - place) :duration (= ?duration 1)
        :condition (over all (at ?p)) :effect (at end (seen ?p))))";

    /// Roads from a, by where they lead and how far that is; from b to c it is 2; what is left of a plan.
    fn check(roads: &[(&str, f64)], goal: &str, plan: &[&str], expected: &[&str]) {
        let facts = |(to, far): &(&str, f64)| format!("(road a {to}) (= (far a {to}) {far})");
        let roads: String = roads.iter().map(facts).collect();
        let problem = format!(
            "(define (problem p) (:domain drives) (:objects a b c - place) (:init (at a) {roads}
               (road b c) (= (far b c) 2) (road b a) (= (far b a) 1)) (:goal {goal}))"
        );
        let (task, grounded) = small::read(DRIVES, &problem);
        let nobody = Attachments::default();
        let calls = Calls::bind(&task, &grounded, &nobody).expect("nothing to bind");
        let world = World::new(&task, &grounded, calls);
        let space = Space::new(&world, envelopes(&world), Measure::Makespan);
        let called = |act: &Act| small::called(&task, act.origin);
        let step = |call: &&str| {
            let act = world.acts.iter().position(|act| called(act) == *call).expect("an action") as u32;
            Step::whole(act)
        };
        let mut steps: Vec<Step> = plan.iter().map(step).collect();
        let (measured, base) = space.replay_to_goal(&mut steps, &|| false).expect("no call").expect("a plan");
        let (_, shorter, _) = shortened(&space, (measured, steps, base), &|| false).expect("no call");
        let left: Vec<String> = shorter.iter().map(|step| called(&world.acts[step.act as usize])).collect();
        assert_eq!(left, expected, "{roads} {goal}");
    }

    #[test]
    fn a_detour_is_driven_straight() {
        let (near, far) = ([("b", 1.0), ("c", 2.5)], [("b", 1.0), ("c", 9.0)]);
        check(&near, "(at c)", &["go a b", "go b c"], &["go a c"]);
        check(&near, "(seen c)", &["go a b", "go b c", "see c"], &["go a c", "see c"]);
        check(&near, "(seen a)", &["go a b", "go b a", "see a"], &["see a"]);
        // It is longer, there is no such way, or something is done on the way.
        check(&far, "(at c)", &["go a b", "go b c"], &["go a b", "go b c"]);
        check(&near[..1], "(at c)", &["go a b", "go b c"], &["go a b", "go b c"]);
        let on_the_way = ["go a b", "see b", "go b c"];
        check(&near, "(and (at c) (seen b))", &on_the_way, &on_the_way);
    }
}
