//! Tests of `temporal::joined`.

use super::small;
use descry_planner::attachment::Attachments;
use descry_planner::calls::Calls;
use descry_planner::temporal::advance::TemporalStep;
use descry_planner::temporal::envelope::envelopes;
use descry_planner::temporal::joined::*;
use descry_planner::temporal::space::Measure;
use descry_planner::temporal::space::Space;
use descry_planner::temporal::world::{Act, World};

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
        TemporalStep::whole(act)
    };
    let mut steps: Vec<TemporalStep> = plan.iter().map(step).collect();
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
