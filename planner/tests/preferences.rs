//! Preferences and constraints: what is planned for, beside all short plans of random small tasks.

mod brute;

use descry_planner::{Attachments, Options, Outcome, PlanError, Source, plan};

use crate::solving::{read, solve, solve_twice};

/// Rooms in a row, a lamp, and a load that wears the carrier.
const ROOMS: &str = "(define (domain rooms) (:requirements :adl :numeric-fluents :preferences :constraints)
  (:types room)
  (:predicates (at ?r - room) (next ?a ?b - room) (lit) (clean ?r - room))
  (:functions (wear))
  (:action go :parameters (?a ?b - room) :precondition (and (at ?a) (next ?a ?b))
    :effect (and (not (at ?a)) (at ?b) (increase (wear) 1)))
  (:action switch :parameters () :precondition (and)
    :effect (and (when (lit) (not (lit))) (when (not (lit)) (lit))))
  (:action sweep :parameters (?r - room) :precondition (and (at ?r) (preference seeing (lit)))
    :effect (clean ?r)))";

/// A way round: a to d through b or through c, where c is the longer way.
const ROUND: &str = "(:domain rooms) (:objects a b c e d - room)
  (:init (at a) (= (wear) 0) (next a b) (next b a) (next b d) (next d b)
         (next a c) (next c a) (next c e) (next e c) (next e d) (next d e))";

/// Expected result of a task: its least value, or that it has no plan.
#[derive(Debug, Clone, Copy)]
enum Expected {
    Least(f64),
    Never,
}

use Expected::{Least, Never};

fn problem(aims: &str) -> String {
    format!("(define (problem round) {ROUND} {aims})")
}

/// Plans for what is asked on the way round until nothing better is left.
fn check(aims: &str, expected: Expected) {
    let (domain, problem) = (ROOMS.replace("(preference seeing (lit))", ""), problem(aims));
    let options = Options { anytime: true, ..Options::default() };
    let (outcome, verdict) = solve_twice(&domain, &problem, &options);
    match expected {
        Never => assert!(matches!(outcome, Outcome::Unsolvable { .. }), "{aims}: {outcome:?}"),
        Least(value) => {
            assert_eq!(verdict.and_then(|verdict| verdict.cost), Some(value), "{aims}: {outcome:?}");
            assert!(outcome.statistics().optimal, "{aims}: {outcome:?}");
        }
    }
    // Without time to improve, what is found keeps the constraints too.
    let (at_once, _) = solve_twice(&domain, &problem, &Options::default());
    assert_eq!(at_once.plan().is_some(), matches!(expected, Least(_)), "{aims}: {at_once:?}");
}

#[test]
fn preferences_are_kept_where_they_pay() {
    for (goal, metric, least) in [
        // The whole way for something small, and for something worth it.
        ("(preference p (at d))", "(+ (total-time) (is-violated p))", 1.0),
        ("(preference p (at d))", "(+ (total-time) (* 5 (is-violated p)))", 2.0),
        ("(preference p (or (at d) (at a)))", "(+ (total-time) (is-violated p))", 0.0),
        // One of two, and both under one name.
        (
            "(and (preference p (at d)) (preference q (at b)))",
            "(+ (* 2 (is-violated p)) (is-violated q))",
            1.0,
        ),
        ("(forall (?r - room) (preference p (at ?r)))", "(is-violated p)", 4.0),
        ("(forall (?r - room) (preference p (clean ?r)))", "(+ (is-violated p) (* 0.1 (total-time)))", 0.9),
        // Nothing averts it; nothing can break it; nothing counts it.
        ("(preference p (next a d))", "(is-violated p)", 1.0),
        ("(preference p (next a b))", "(+ (total-time) (is-violated p))", 0.0),
        ("(and (at b) (preference p (at d)))", "(total-time)", 1.0),
        // Worth something only together with the goal, and hidden in a maximum.
        ("(and (at d) (preference p (lit)))", "(+ (total-time) (* 2 (is-violated p)))", 3.0),
        ("(preference p (< (wear) 2))", "(+ (wear) (is-violated p))", 0.0),
        ("(and (at d) (preference p (= (wear) 3)))", "(+ (total-time) (* 9 (is-violated p)))", 3.0),
        ("(preference p (at d))", "(- (total-time) (* 5 (- 1 (is-violated p))))", -3.0),
        // On the way of an action.
        ("(clean a)", "(is-violated seeing)", 0.0),
        ("(clean a)", "(+ (total-time) (* 0.5 (is-violated seeing)))", 1.5),
        ("(clean a)", "(+ (total-time) (* 3 (is-violated seeing)))", 2.0),
    ] {
        let task = read(ROOMS, &problem(&format!("(:goal {goal}) (:metric minimize {metric})")));
        let (outcome, verdict) = solve(&task, &Options { anytime: true, ..Options::default() });
        let value = verdict.and_then(|verdict| verdict.cost).expect("every one has a plan");
        assert!((value - least).abs() < 1e-6, "{goal} {metric}: {outcome:?}");
        let counted = metric.contains("is-violated") || !goal.contains("preference");
        assert_eq!(outcome.statistics().scored_only, !counted, "{goal} {metric}");
    }
}

#[test]
fn constraints_are_planned_for() {
    for (constraint, expected) in [
        ("(always (not (at b)))", Least(3.0)),
        ("(always (and (not (at b)) (not (at c))))", Never),
        ("(always (< (wear) 2))", Never),
        ("(always (<= (wear) 2))", Least(2.0)),
        ("(always (not (at a)))", Never),
        ("(sometime (at c))", Least(3.0)),
        ("(forall (?r - room) (sometime (at ?r)))", Least(5.0)),
        ("(sometime (and (lit) (at b)))", Least(3.0)),
        ("(and (sometime (at c)) (sometime (at b)))", Least(4.0)),
        ("(at-most-once (at a))", Least(2.0)),
        ("(and (at-most-once (at a)) (sometime (at c)) (sometime (at b)))", Least(5.0)),
        ("(and (forall (?r - room) (at-most-once (at ?r))) (sometime (at c)) (sometime (at b)))", Never),
        ("(sometime-after (at a) (lit))", Least(3.0)),
        ("(sometime-after (lit) (at c))", Least(2.0)),
        ("(and (sometime (lit)) (sometime-after (lit) (at c)))", Least(5.0)),
        ("(sometime-before (at d) (lit))", Least(3.0)),
        ("(sometime-before (at d) (at c))", Least(3.0)),
        ("(sometime-before (at a) (lit))", Never),
        ("(at end (lit))", Least(3.0)),
        ("(and (sometime (lit)) (at end (not (lit))))", Least(4.0)),
    ] {
        check(&format!("(:goal (at d)) (:constraints {constraint})"), expected);
    }
}

#[test]
fn preferences_on_the_way_are_kept_where_they_pay() {
    for (constraints, metric, least) in [
        ("(preference p (always (not (at b))))", "(+ (total-time) (* 3 (is-violated p)))", 3.0),
        ("(preference p (always (not (at b))))", "(+ (total-time) (* 0.5 (is-violated p)))", 2.5),
        ("(preference p (sometime (at c)))", "(is-violated p)", 0.0),
        ("(preference p (sometime-before (at a) (lit)))", "(+ (total-time) (is-violated p))", 3.0),
        ("(forall (?r - room) (preference p (sometime (at ?r))))", "(is-violated p)", 0.0),
        ("(forall (?r - room) (preference p (always (not (at ?r)))))", "(is-violated p)", 3.0),
        (
            "(and (always (not (at b))) (preference p (sometime (at b))))",
            "(+ (total-time) (* 9 (is-violated p)))",
            12.0,
        ),
        ("(preference p (at-most-once (lit)))", "(+ (total-time) (is-violated p))", 2.0),
        ("(preference p (sometime-after (at a) (at c)))", "(+ (total-time) (* 2 (is-violated p)))", 3.0),
    ] {
        let aims = format!("(:goal (at d)) (:constraints {constraints}) (:metric minimize {metric})");
        let task = read(ROOMS, &problem(&aims));
        let (outcome, verdict) = solve(&task, &Options { anytime: true, ..Options::default() });
        let value = verdict.and_then(|verdict| verdict.cost);
        assert!(value.is_some_and(|value| (value - least).abs() < 1e-6), "{aims}: {outcome:?}");
        assert!(!outcome.statistics().scored_only);
    }
}

#[test]
fn constraints_on_times_are_checked_and_said_not_to_be_planned_for() {
    let task = read(ROOMS, &problem("(:goal (at d)) (:constraints (within 1 (lit)))"));
    let found = plan(&task, &Attachments::new(), &Options::default(), &|| false, &mut |_| {});
    assert!(matches!(&found, Err(PlanError::Untried(_))), "{found:?}");
    let hold = Source::new("problem.pddl", problem("(:goal (at d)) (:constraints (hold-during 1 2 (lit)))"));
    let found = descry_planner::check(&Source::new("domain.pddl", ROOMS), Some(&hold));
    let told = found.render(false);
    assert!(told.contains("[not-planned]") && told.contains("`hold-during` is checked in plans"), "{told}");
    let aims =
        "(:goal (at d)) (:constraints (preference p (within 1 (lit)))) (:metric minimize (is-violated p))";
    let (outcome, verdict) = solve(&read(ROOMS, &problem(aims)), &Options::default());
    assert!(outcome.statistics().scored_only && !outcome.statistics().optimal);
    assert_eq!(verdict.and_then(|verdict| verdict.cost), Some(1.0));
}

#[test]
fn why_constraints_leave_no_plan_is_said() {
    let task = read(ROOMS, &problem("(:goal (at d)) (:constraints (always (not (at a))))"));
    let Outcome::Unsolvable { why, .. } = solve(&task, &Options::default()).0 else {
        panic!("a is the start")
    };
    assert!(why.to_string().contains("on no way to it are all constraints kept"), "{why}");
    let label = &why.findings.list[0].labels[0];
    let text = &task.sources[1].text;
    assert!(why.findings.render(false).contains("always"), "{label:?} {text}");
}

#[test]
fn rewards_are_maximised() {
    let aims = "(:goal (and (preference p (at d)) (preference q (at e))))
      (:metric maximize (- (+ (* 3 (- 1 (is-violated p))) (* 4 (- 1 (is-violated q)))) (* 0.5 (total-time))))";
    let (outcome, verdict) =
        solve(&read(ROOMS, &problem(aims)), &Options { anytime: true, ..Options::default() });
    assert_eq!(verdict.and_then(|verdict| verdict.cost), Some(3.0), "{outcome:?}");
}

/// Rooms with doors that take time.
const WALKS: &str = "(define (domain walks) (:requirements :adl :durative-actions :preferences :constraints)
  (:types room)
  (:predicates (at ?r - room) (next ?a ?b - room) (lit))
  (:durative-action go :parameters (?a ?b - room) :duration (= ?duration 2)
    :condition (and (at start (at ?a)) (at start (next ?a ?b)))
    :effect (and (at start (not (at ?a))) (at end (at ?b))))
  (:durative-action switch :parameters () :duration (= ?duration 1) :condition (at start (not (lit)))
    :effect (at end (lit))))";

#[test]
fn plans_with_times_keep_constraints_and_preferences() {
    for (aims, most) in [
        ("(:goal (at d)) (:constraints (always (not (at b))))", 6.1),
        ("(:goal (at d)) (:constraints (sometime-before (at b) (lit)))", 4.1),
        ("(:goal (at d)) (:constraints (sometime (at c)))", 6.1),
        ("(:goal (preference p (at d))) (:metric minimize (+ (total-time) (* 9 (is-violated p))))", 4.1),
        ("(:goal (preference p (at d))) (:metric minimize (+ (total-time) (* 2 (is-violated p))))", 2.0),
        (
            "(:goal (at d)) (:constraints (preference p (always (not (at b)))))
             (:metric minimize (+ (total-time) (* 5 (is-violated p))))",
            6.1,
        ),
    ] {
        let text = problem(aims).replace("(:domain rooms)", "(:domain walks)").replace("(= (wear) 0)", "");
        let options = Options { anytime: true, evaluation_limit: Some(2_000), ..Options::default() };
        let (outcome, verdict) = solve(&read(WALKS, &text), &options);
        let value = verdict.and_then(|verdict| verdict.metric.or(verdict.makespan));
        assert!(value.is_some_and(|value| value <= most), "{aims}: {value:?} {outcome:?}");
        assert!(!outcome.statistics().optimal && !outcome.statistics().scored_only);
    }
    for aims in [
        "(:goal (at d)) (:constraints (within 5 (lit)))",
        "(:goal (at d)) (:constraints (and (within 3 (at b)) (within 3 (lit))))",
        "(:goal (at d)) (:constraints (preference p (within 2.5 (lit)))) (:metric maximize (- 1 (is-violated p)))",
    ] {
        let text = problem(aims).replace("(:domain rooms)", "(:domain walks)").replace("(= (wear) 0)", "");
        let (outcome, verdict) = solve(&read(WALKS, &text), &Options::default());
        assert!(outcome.plan().is_some_and(|plan| plan.steps.len() == 3), "{aims}: {outcome:?}");
        assert!(verdict.is_some_and(|verdict| verdict.metric.is_none_or(|value| value == 1.0)));
    }
    let aims = "(:goal (at d)) (:constraints (always (not (at a))))";
    let text = problem(aims).replace("(:domain rooms)", "(:domain walks)").replace("(= (wear) 0)", "");
    let (outcome, _) = solve(&read(WALKS, &text), &Options::default());
    assert!(outcome.plan().is_none());
}

#[test]
fn random_tasks_are_planned_for_as_all_short_plans_say() {
    let tally = brute::compare_all(0..300);
    assert!(tally.solved > 100 && tally.unsolvable > 20 && tally.optimal > 100, "{tally:?}");
}

#[test]
#[ignore = "long: twenty thousand tasks: minutes"]
fn many_random_tasks_are_planned_for_as_all_short_plans_say() {
    println!("{:?}", brute::compare_all(1_000..21_000));
}
