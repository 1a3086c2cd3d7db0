//! Optimal planning: proofs, bounds, and tasks that the proof does not cover.

use std::path::Path;

use descry_planner::{Attachments, Options, Outcome, PlanError, plan_optimally, validate};

use crate::solving::read;

/// Expected result.
enum Expect<'a> {
    /// A plan that is proven optimal, of this cost.
    Optimal(f64),
    /// Proven to have no plan.
    Unsolvable,
    /// Neither after so many evaluations; the bound is above the first of these and at most the second.
    Bound(u64, f64, f64),
    /// Refused with a finding at this text, with a message that contains the other.
    Refused(&'a str, &'a str),
}

fn check(domain: &str, problem: &str, expect: Expect) {
    let task = read(domain, problem);
    let evaluation_limit = if let Expect::Bound(most, ..) = expect { Some(most) } else { None };
    let options = Options { evaluation_limit, ..Options::default() };
    let mut last = None;
    let mut on_bound = |bound| last = Some(bound);
    match (expect, plan_optimally(&task, &Attachments::new(), &options, &|| false, &mut on_bound)) {
        (Expect::Optimal(cost), Ok(Outcome::Solved { plan, statistics })) => {
            assert!(statistics.optimal && validate(&task, &Attachments::new(), &plan).valid, "{plan}");
            let found = plan.cost.expect("every plan has a cost");
            assert!((found - cost).abs() < 1e-9, "{found} instead of {cost}\n{plan}");
            let bound = statistics.lower_bound.expect("what is proven");
            assert!((bound - cost).abs() < 1e-9 && last == Some(bound), "{bound} {last:?} beside {cost}");
        }
        (Expect::Unsolvable, Ok(Outcome::Unsolvable { statistics, .. })) => {
            assert_eq!(statistics.lower_bound, None);
        }
        (Expect::Bound(_, above, most), Ok(Outcome::OutOfTime { best: None, statistics })) => {
            let bound = statistics.lower_bound.expect("a bound");
            assert!(bound > above && bound <= most && last == Some(bound), "{bound}");
        }
        (Expect::Refused(text, message), Err(PlanError::Refused(findings))) => {
            let finding = &findings.list[0];
            let span = finding.labels[0].span;
            let source = &findings.sources[span.source as usize].text;
            let place = &source[span.start as usize..span.end as usize];
            assert!(place.contains(text) && finding.message.contains(message), "{findings}");
            assert!(finding.help.is_some(), "{findings}");
        }
        (_, other) => panic!("unexpected outcome {other:?}"),
    }
}

/// Ways of different lengths between places, and a parcel that is worth a detour.
const WAYS: &str = "(define (domain ways) (:requirements :adl :action-costs) (:types place)
  (:predicates (at ?p - place) (road ?a ?b - place) (toll-paid) (wet))
  (:functions (total-cost) (length ?a ?b - place))
  (:action go :parameters (?a ?b - place) :precondition (and (at ?a) (road ?a ?b))
    :effect (and (not (at ?a)) (at ?b) (increase (total-cost) (length ?a ?b))
      (when (not (toll-paid)) (wet))))
  (:action pay :parameters () :precondition (not (toll-paid))
    :effect (and (toll-paid) (increase (total-cost) 2.5))))";

fn ways(goal: &str, metric: &str) -> String {
    format!(
        "(define (problem p) (:domain ways) (:objects a b c d - place)
          (:init (at a) (= (total-cost) 0) (road a b) (road b c) (road a c) (road c a)
            (= (length a b) 1) (= (length b c) 1.25) (= (length a c) 4) (= (length c a) 0))
          (:goal {goal}) {metric})"
    )
}

#[test]
fn costs_conditional_effects_and_constants_are_counted() {
    let cost = "(:metric minimize (total-cost))";
    for (goal, metric, expected) in [
        ("(at c)", cost, Expect::Optimal(2.25)),
        ("(at c)", "", Expect::Optimal(1.0)),
        ("(and (at c) (not (wet)))", cost, Expect::Optimal(4.75)),
        ("(and (at a) (wet))", cost, Expect::Optimal(2.25)),
        ("(at c)", "(:metric minimize (+ 7 (* 2 (total-cost))))", Expect::Optimal(11.5)),
        ("(at c)", "(:metric maximize (- 0 (total-cost)))", Expect::Optimal(-2.25)),
        ("(at d)", cost, Expect::Unsolvable),
        ("(and (at a) (at b))", cost, Expect::Unsolvable),
        ("(at c)", "(:metric maximize (total-cost))", Expect::Refused("maximize", "may improve it")),
    ] {
        check(WAYS, &ways(goal, metric), expected);
    }
}

#[test]
fn derived_facts_numbers_and_soft_goals_are_planned_optimally() {
    let domain = "(define (domain tank) (:requirements :adl :fluents :derived-predicates :preferences)
      (:predicates (full) (clean)) (:functions (level) (total-cost))
      (:derived (full) (>= (level) 6))
      (:action cup :parameters () :effect (and (increase (level) 1) (increase (total-cost) 2)))
      (:action bucket :parameters () :effect (and (increase (level) 4) (increase (total-cost) 5) (not (clean))))
      (:action wash :parameters () :precondition (full) :effect (and (clean) (increase (total-cost) 3))))";
    for (goal, metric, cost) in [
        ("(full)", "(total-cost)", 9.0),
        ("(and (full) (clean))", "(total-cost)", 12.0),
        ("(and (full) (preference p (clean)))", "(+ (total-cost) (* 2 (is-violated p)))", 11.0),
        ("(and (full) (preference p (clean)))", "(+ (total-cost) (* 9 (is-violated p)))", 12.0),
    ] {
        let problem = format!(
            "(define (problem p) (:domain tank) (:init (= (level) 0) (= (total-cost) 0))
              (:goal {goal}) (:metric minimize {metric}))"
        );
        check(domain, &problem, Expect::Optimal(cost));
    }
}

/// A lock of dials, each of which is turned on its own: long plans, and no landmark beyond the last turns.
const DIALS: &str = "(define (domain dials) (:requirements :fluents) (:functions (a) (b) (c))
  (:action turn-a :parameters () :effect (increase (a) 1))
  (:action turn-b :parameters () :precondition (>= (a) 1) :effect (and (increase (b) 1) (decrease (a) 1)))
  (:action turn-c :parameters () :precondition (>= (b) 1) :effect (and (increase (c) 1) (decrease (b) 1))))";

#[test]
fn what_ends_early_leaves_a_bound() {
    let problem =
        "(define (problem p) (:domain dials) (:init (= (a) 0) (= (b) 0) (= (c) 0)) (:goal (>= (c) 9)))";
    check(DIALS, problem, Expect::Bound(40, 1.0, 27.0));
}

#[test]
fn what_the_proof_does_not_cover_is_named() {
    let walk = "(define (domain walk) (:requirements :durative-actions) (:predicates (there))
      (:durative-action walk :parameters () :duration (= ?duration 4) :effect (at end (there))))";
    let bare = "(define (domain walk) (:requirements :timed-initial-literals) (:predicates (there) (dry))
      (:action walk :parameters () :precondition (dry) :effect (there)))";
    let climb =
        "(define (domain walk) (:requirements :fluents) (:predicates (there)) (:functions (height) (toil))
      (:action walk :parameters () :effect (and (there) (increase (height) 1) (increase (toil) (height)))))";
    for (domain, init, metric, place, message) in [
        (walk, "", "", "walk", "`walk` has a duration"),
        (bare, "(at 3 (dry))", "", "dry", "a timed literal"),
        (climb, "(= (height) 1) (= (toil) 0)", "(:metric minimize (toil))", "toil", "depends on the state"),
    ] {
        let problem = format!("(define (problem p) (:domain walk) (:init {init}) (:goal (there)) {metric})");
        check(domain, &problem, Expect::Refused(place, message));
    }
}

#[test]
fn small_tasks_of_the_competitions_have_their_known_costs() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../shared/pddl/classical");
    if !root.exists() {
        println!("skipped: {} is not there", root.display());
        return;
    }
    for (domain, cost) in [("blocks", 12.0), ("driverlog", 12.0), ("gripper", 23.0), ("satellite", 17.0)] {
        let text = |file: &str| std::fs::read_to_string(root.join(domain).join(file)).expect("a task");
        check(&text("domain.pddl"), &text("S.pddl"), Expect::Optimal(cost));
    }
}
