//! Tests of `temporal::tours`.

use super::small;
use descry_planner::attachment::Attachments;
use descry_planner::calls::Calls;
use descry_planner::temporal::advance::TemporalStep;
use descry_planner::temporal::envelope::envelopes;
use descry_planner::temporal::space::Measure;
use descry_planner::temporal::space::Space;
use descry_planner::temporal::tours::*;
use descry_planner::temporal::world::Act;
use descry_planner::temporal::world::World;

const LINE: &str =
    "(define (domain line) (:requirements :durative-actions :typing :numeric-fluents) (:types place thing)
  (:predicates (at ?p - place) (seen ?t - thing) (sees ?p - place ?t - thing)) (:functions (far ?a ?b - place))
  (:durative-action go :parameters (?a ?b - place) :duration (= ?duration (far ?a ?b))
    :condition (at start (at ?a)) :effect (and (at start (not (at ?a))) (at end (at ?b))))
  (:durative-action see :parameters (?p - place ?t - thing) :duration (= ?duration 1)
    :condition (and (over all (at ?p)) (at start (sees ?p ?t))) :effect (at end (seen ?t))))";

/// Places a, b, c and d on a line, 2 apart; which things are seen from where; what is made of a plan that begins at a.
fn check(sees: &[&str], goal: &[&str], plan: &str, expected: &str) {
    let places = ["a", "b", "c", "d"];
    let far = (0..4_usize).flat_map(|n| (0..4).map(move |m| (n, m))).filter(|(n, m)| n != m);
    let far: String =
        far.map(|(n, m)| format!("(= (far {} {}) {}) ", places[n], places[m], 2 * n.abs_diff(m))).collect();
    let sees: String = sees.iter().map(|sees| format!("(sees {sees}) ")).collect();
    let goal: String = goal.iter().map(|thing| format!("(seen {thing}) ")).collect();
    let problem = format!(
        "(define (problem p) (:domain line) (:objects a b c d - place t u v - thing) (:init (at a) {far} {sees})
           (:goal (and {goal})))"
    );
    let (task, grounded) = small::read(LINE, &problem);
    let nobody = Attachments::default();
    let calls = Calls::bind(&task, &grounded, &nobody).expect("nothing to bind");
    let world = World::new(&task, &grounded, calls);
    let space = Space::new(&world, envelopes(&world), Measure::Makespan);
    let called = |act: &Act| small::called(&task, act.origin);
    let step = |call: &str| {
        TemporalStep::whole(world.acts.iter().position(|act| called(act) == call).expect("an action") as u32)
    };
    let mut steps: Vec<TemporalStep> = plan.split(", ").map(step).collect();
    let (measured, base) = space.replay_to_goal(&mut steps, &|| false).expect("no call").expect("a plan");
    let tours = Tours::new(&world).expect("they are few");
    let better = tours.rearranged(&space, (measured, steps, base), &|| false);
    let (better, steps, _) = better.expect("no call");
    assert!(better <= measured, "{better} {measured}");
    let left: Vec<String> = steps.iter().map(|step| called(&world.acts[step.act as usize])).collect();
    assert_eq!(left.join(", "), expected, "{goal}{sees}");
}

#[test]
fn what_is_on_the_way_is_done_on_the_way() {
    let each = ["b t", "c u", "d v"];
    let sorted = "go a b, see b t, go b c, see c u, go c d, see d v";
    check(&each, &["t", "u", "v"], "go a d, see d v, go d b, see b t, go b c, see c u", sorted);
    check(&each, &["t", "u", "v"], "go a d, see d v, go d c, see c u, go c b, see b t", sorted);
    check(&each, &["t", "u", "v"], sorted, sorted);
    // What is seen twice is left out once, and so is the way there.
    check(&["b t", "d t"], &["t"], "go a d, see d t, go d b, see b t", "go a b, see b t");
}
