//! Durations that are left open: what depends on them, and what may then be said of a plan.

use descry_planner::Options;

use crate::solving::{read, solve};

/// Expected result of a task with times.
enum Expect {
    /// A plan of this metric, or of this makespan where there is none; whether it is said to be the best.
    Plan(f64, bool),
    /// Neither a plan nor a proof that there is none.
    Open,
}

fn check(domain: &str, problem: &str, anytime: bool, expect: Expect) {
    let task = read(
        &format!("(define (domain d) (:requirements :durative-actions :numeric-fluents) {domain})"),
        &format!("(define (problem p) (:domain d) {problem})"),
    );
    let options = Options { anytime, evaluation_limit: Some(1_500), ..Options::default() };
    let (outcome, verdict) = solve(&task, &options);
    match (expect, outcome.plan(), verdict) {
        (Expect::Plan(expected, optimal), Some(plan), Some(verdict)) => {
            let measured = verdict.metric.or(plan.makespan_s()).unwrap_or_default();
            assert!((measured - expected).abs() < 0.02, "{measured}, not {expected}:\n{plan}");
            assert_eq!(outcome.statistics().optimal, optimal, "{outcome:?}");
        }
        (Expect::Open, None, None) => {
            assert!(!matches!(outcome, descry_planner::Outcome::Unsolvable { .. }), "{outcome:?}");
        }
        _ => panic!("unexpected outcome {outcome:?}"),
    }
}

const POUR: &str = "(:predicates (idle) (on) (done) (dry)) (:functions (used))
  (:durative-action pour :parameters () :duration (and (>= ?duration 2) (<= ?duration 10)) :condition (at start (idle))
    :effect (and (at start (not (idle))) (at start (on)) (at end (not (on))) (at end (increase (used) (* 2 ?duration)))))
  (:durative-action work :parameters () :duration (= ?duration 5) :condition (over all (on)) :effect (at end (done)))
  (:action look :parameters () :precondition (and (done) (<= (used) 4) (> (used) 0)) :effect (dry))";

#[test]
fn an_action_that_is_stretched_does_what_it_does_in_that_time() {
    let problem = |goal: &str| format!("(:init (idle) (= (used) 0)) (:goal {goal})");
    for (goal, expect) in [
        ("(done)", Expect::Plan(5.0, false)),
        ("(and (done) (<= (used) 11))", Expect::Plan(5.0, false)),
        // Work that fits in makes it use at least ten.
        ("(and (done) (<= (used) 9))", Expect::Open),
        ("(dry)", Expect::Open),
        // Half of what may be is as much as this.
        ("(and (done) (>= (used) 12))", Expect::Plan(6.0, false)),
    ] {
        check(POUR, &problem(goal), false, expect);
    }
}

#[test]
fn a_length_is_chosen_and_none_is_proven_to_be_impossible() {
    for (used, expect) in [
        (4, Expect::Plan(2.0, false)),
        (12, Expect::Plan(6.0, false)),
        (14, Expect::Plan(7.0, false)),
        (21, Expect::Open),
        (20, Expect::Plan(10.0, false)),
    ] {
        check(POUR, &format!("(:init (idle) (= (used) 0)) (:goal (= (used) {used}))"), false, expect);
    }
}

#[test]
fn what_a_longer_action_earns_is_gone_after() {
    let domain = "(:predicates (idle) (done)) (:functions (gold))
      (:durative-action dig :parameters () :duration (and (>= ?duration 2) (<= ?duration 10)) :condition (at start (idle))
        :effect (and (at start (not (idle))) (at end (done)) (at end (increase (gold) (* ?duration ?duration)))))";
    let problem = |metric: &str| format!("(:init (idle) (= (gold) 0)) (:goal (done)) (:metric {metric})");
    check(domain, &problem("maximize (gold)"), true, Expect::Plan(100.0, false));
    check(domain, &problem("minimize (gold)"), true, Expect::Plan(4.0, false));
}

#[test]
fn what_is_made_better_by_going_on_is_gone_on_with() {
    // What is bought is dear at first, and a part of it comes back.
    let domain = "(:predicates (bought ?x) (done)) (:functions (spent))
      (:durative-action buy :parameters (?x) :duration (= ?duration 1) :condition (at start (>= (spent) 0))
        :effect (and (at end (bought ?x)) (at end (done)) (at end (increase (spent) 3))))
      (:durative-action refund :parameters (?x) :duration (= ?duration 1)
        :condition (and (at start (bought ?x)) (at start (>= (spent) 3)))
        :effect (and (at start (not (bought ?x))) (at end (decrease (spent) 2))))";
    let problem = "(:objects a) (:init (= (spent) 0)) (:goal (done)) (:metric minimize (spent))";
    check(domain, problem, true, Expect::Plan(1.0, false));
}

#[test]
fn what_only_looks_like_a_plan_without_its_times_is_put_off_to_the_right_ones() {
    // The rate is another one on the way; what must stand apart makes an action longer than it may be; a number has no value yet.
    let rated = "(:requirements :continuous-effects) (:predicates (idle) (full)) (:functions (level) (rate))
      (:durative-action fill :parameters () :duration (>= ?duration 1) :condition (at start (idle))
        :effect (and (at start (not (idle))) (at end (full)) (increase (level) (* #t (rate))) (at end (decrease (level) (* 2 ?duration)))))";
    let rate = "(:init (idle) (= (level) 0) (= (rate) 1) (at 5 (not (idle))) (at 12 (= (rate) 3)))";
    let stretched = "(:requirements :adl) (:predicates (lit) (wet) (dry)) (:functions (level))
      (:durative-action fill :parameters () :duration (and (>= ?duration 2) (<= ?duration 7)) :condition (at start (dry))
        :effect (and (at start (not (dry))) (at end (assign (level) ?duration)) (when (at end (not (lit))) (at end (wet)))))";
    let unknown = "(:requirements :continuous-effects) (:predicates (full)) (:functions (level))
      (:durative-action fill :parameters () :duration (= ?duration 2) :effect (and (at end (full)) (increase (level) (* #t 1))))";
    for (domain, problem, expect) in [
        // From just before 5 s on, until it has flown fast for long enough.
        (
            rated,
            format!("{rate} (:goal (and (full) (>= (level) 1) (>= (rate) 3)))"),
            Expect::Plan(20.0, false),
        ),
        (
            stretched,
            "(:init (dry) (lit) (= (level) 0) (at 2 (lit))) (:goal (= (level) 2))".into(),
            // It ends a moment after the literal.
            Expect::Plan(2.0, false),
        ),
        (unknown, "(:init) (:goal (full))".into(), Expect::Open),
    ] {
        check(domain, &problem, false, expect);
    }
}

#[test]
fn a_duration_without_a_greatest_value_is_as_long_as_the_goal_needs() {
    let domain = "(:predicates (idle) (done)) (:functions (charge))
      (:durative-action charge :parameters () :duration (>= ?duration 1) :condition (at start (idle))
        :effect (and (at start (not (idle))) (at end (idle)) (at end (increase (charge) (* 2 ?duration)))))
      (:durative-action run :parameters () :duration (= ?duration 3)
        :condition (and (at start (idle)) (at start (>= (charge) 20)))
        :effect (and (at start (not (idle))) (at end (idle)) (at end (decrease (charge) 20)) (at end (done))))";
    let domain = format!("(define (domain d) (:requirements :durative-actions :numeric-fluents) {domain})");
    for (charge, steps, longest_s) in [(0, 2, 10.0), (15, 2, 3.0), (20, 1, 3.0)] {
        let problem =
            format!("(define (problem p) (:domain d) (:init (idle) (= (charge) {charge})) (:goal (done)))");
        let (outcome, _) = solve(&read(&domain, &problem), &Options::default());
        let plan = outcome.plan().expect("a plan");
        let longest = plan.steps.iter().map(|step| step.duration_s).fold(0.0, f64::max);
        assert!(plan.steps.len() == steps && (longest - longest_s).abs() < 0.01, "{charge}: {plan}");
    }
}
