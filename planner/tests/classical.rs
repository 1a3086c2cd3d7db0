//! Classical planning from text to a validated plan: small domains of our own, and (slow) the competition's.

use std::path::Path;
use std::sync::atomic::{AtomicUsize, Ordering};

use descry_planner::{Attachments, Options, Outcome, plan};

use crate::solving::{read, solve, solve_twice};

/// Expected result.
enum Expect {
    /// A plan whose cost is at most this.
    CostAtMost(f64),
    /// A plan that is proven best, of this cost.
    Best(f64),
    /// Proven to have no plan.
    Unsolvable,
}

fn check(domain: &str, problem: &str, expect: Expect) {
    let options = Options { anytime: matches!(expect, Expect::Best(_)), ..Options::default() };
    let (outcome, verdict) = solve_twice(domain, problem, &options);
    match (expect, &outcome, verdict) {
        (Expect::Unsolvable, Outcome::Unsolvable { .. }, _) => {}
        (Expect::CostAtMost(most), Outcome::Solved { plan, .. }, Some(verdict)) => {
            let cost = verdict.cost.unwrap_or(plan.steps.len() as f64);
            assert!(cost <= most, "cost {cost} above {most}: {plan:?}");
        }
        (Expect::Best(cost), Outcome::Solved { plan, statistics }, Some(verdict)) => {
            assert!(statistics.optimal);
            assert_eq!(verdict.cost.unwrap_or(plan.steps.len() as f64), cost);
        }
        (_, other, _) => panic!("unexpected outcome {other:?}"),
    }
}

const SHUTTLE: &str = "(define (domain shuttle) (:requirements :typing :action-costs)
  (:types place box)
  (:predicates (at ?p - place) (in ?b - box) (box-at ?b - box ?p - place) (road ?a ?b - place) (free))
  (:functions (total-cost) (length ?a ?b - place))
  (:action go :parameters (?a ?b - place) :precondition (and (at ?a) (road ?a ?b))
    :effect (and (not (at ?a)) (at ?b) (increase (total-cost) (length ?a ?b))))
  (:action take :parameters (?b - box ?p - place) :precondition (and (at ?p) (box-at ?b ?p) (free))
    :effect (and (in ?b) (not (free)) (not (box-at ?b ?p)) (increase (total-cost) 1)))
  (:action put :parameters (?b - box ?p - place) :precondition (and (at ?p) (in ?b))
    :effect (and (not (in ?b)) (free) (box-at ?b ?p) (increase (total-cost) 1))))";

const SHUTTLE_PROBLEM: &str = "(define (problem p) (:domain shuttle) (:objects a b c - place x y - box)
  (:init (at a) (free) (box-at x a) (box-at y c) (road a b) (road b a) (road b c) (road c b) (road a c)
    (= (total-cost) 0) (= (length a b) 1) (= (length b a) 1) (= (length b c) 2) (= (length c b) 2) (= (length a c) 9))
  (:goal (and (box-at x c) (box-at y a))) (:metric minimize (total-cost)))";

#[test]
fn harm_under_a_condition_that_nobody_wants_is_done() {
    // Whoever leaves the lamp on anywhere but in the cellar is seen.
    let domain = "(define (domain lamp) (:requirements :adl) (:types place)
      (:predicates (at ?p - place) (lit) (was-lit) (seen)) (:constants cellar - place)
      (:action go :parameters (?a ?b - place) :precondition (at ?a) :effect (and (not (at ?a)) (at ?b)))
      (:action light :precondition (not (lit)) :effect (and (lit) (was-lit)))
      (:action quench :precondition (lit) :effect (and (not (lit)) (when (not (at cellar)) (seen)))))";
    let problem = "(define (problem p) (:domain lamp) (:objects hall attic - place) (:init (at hall))
      (:goal (and (at hall) (was-lit) (not (lit)) (not (seen)))))";
    check(domain, problem, Expect::Best(4.0));
}

#[test]
fn costs_are_minimised() {
    check(SHUTTLE, SHUTTLE_PROBLEM, Expect::CostAtMost(10.0));
    check(SHUTTLE, SHUTTLE_PROBLEM, Expect::Best(10.0));
    // Nothing costs less than nothing.
    check(SHUTTLE, &SHUTTLE_PROBLEM.replace("(and (box-at x c) (box-at y a))", "(at a)"), Expect::Best(0.0));
}

#[test]
fn a_goal_that_nothing_reaches_is_unsolvable() {
    check(SHUTTLE, &SHUTTLE_PROBLEM.replace("(road b c)", ""), Expect::CostAtMost(99.0));
    check(SHUTTLE, &SHUTTLE_PROBLEM.replace("(road c b)", ""), Expect::Unsolvable);
}

#[test]
fn what_nobody_achieves_is_named() {
    let problem = SHUTTLE_PROBLEM.replace("(road c b)", "").replace("(box-at x a)", "");
    let (outcome, _) = solve(&read(SHUTTLE, &problem), &Options::default());
    let Outcome::Unsolvable { why, .. } = outcome else { panic!("{outcome:?}") };
    let text = why.to_string();
    assert!(text.contains("`(box-at x c)` never holds"), "{text}");
    assert!(text.contains("`(in x)` never holds"), "{text}");
}

#[test]
fn a_dead_end_that_only_search_shows_is_unsolvable() {
    let domain = "(define (domain keys) (:predicates (key) (left) (right))
      (:action open-left :parameters () :precondition (key) :effect (and (left) (not (key))))
      (:action open-right :parameters () :precondition (key) :effect (and (right) (not (key)))))";
    let problem = "(define (problem p) (:domain keys) (:init (key)) (:goal (and (left) (right))))";
    check(domain, problem, Expect::Unsolvable);
}

#[test]
fn conditional_effects_quantifiers_disjunctions_and_negations() {
    let domain = "(define (domain lamps) (:requirements :adl)
      (:types lamp) (:predicates (on ?l - lamp) (next ?a ?b - lamp) (inverted))
      (:action press :parameters (?l - lamp)
        :precondition (or (on ?l) (exists (?n - lamp) (and (next ?n ?l) (on ?n))) (not (inverted)))
        :effect (and (when (on ?l) (not (on ?l))) (when (not (on ?l)) (on ?l))
          (forall (?n - lamp) (when (next ?l ?n) (on ?n)))))
      (:action invert :parameters () :precondition (forall (?l - lamp) (imply (on ?l) (not (inverted))))
        :effect (inverted)))";
    let problem = "(define (problem p) (:domain lamps) (:objects a b c d - lamp)
      (:init (next a b) (next b c) (next c d)) (:goal (and (forall (?l - lamp) (on ?l)) (inverted))))";
    check(domain, problem, Expect::CostAtMost(6.0));
}

#[test]
fn what_names_an_undefined_object_has_no_result() {
    let domain = "(define (domain parcels) (:requirements :adl :object-fluents) (:types parcel place)
      (:predicates (seen ?p - place) (opened ?p - parcel)) (:functions (at ?p - parcel) - place (next ?p - place) - place)
      (:action send :parameters (?p - parcel) :effect (and (assign (at ?p) (next (at ?p))) (opened ?p)))
      (:action look :parameters (?p - parcel) :effect (seen (at ?p)))
      (:action open :parameters (?p - parcel)
        :effect (and (when (opened ?p) (seen (at ?p))) (opened ?p))))";
    let problem = |goal: &str| {
        format!(
            "(define (problem p) (:domain parcels) (:objects x y - parcel a b c - place)
               (:init (= (at x) a) (= (next a) b) (= (next b) c)) (:goal {goal}))"
        )
    };
    check(domain, &problem("(and (= (at x) c) (seen b) (opened x))"), Expect::Best(3.0));
    // Nobody knows where y is, and nothing is behind c.
    check(domain, &problem("(opened y)"), Expect::Best(1.0));
    check(
        &domain.replace("(when (opened ?p) (seen (at ?p)))", "(seen (at ?p))"),
        &problem("(opened y)"),
        Expect::Unsolvable,
    );
    check(domain, &problem("(exists (?p - place) (= (at y) ?p))"), Expect::Unsolvable);
}

#[test]
fn an_object_gets_one_value_at_once() {
    let domain = |effect: &str| {
        format!(
            "(define (domain d) (:requirements :adl :object-fluents) (:types thing place) (:constants a b - place x - thing)
               (:predicates (p) (q) (done)) (:functions (at ?t - thing) - place (next ?p - place) - place)
               (:action act :parameters (?one ?other - thing) :precondition (not (= ?one ?other)) :effect (and (done) {effect}))
               (:action same :parameters (?one - thing) :effect (and (done) (assign (at ?one) a) (assign (at x) (next b))))
               (:action off :effect (not (p))) (:action on :effect (q)))"
        )
    };
    let problem = |goal: &str| {
        format!(
            "(define (problem p) (:domain d) (:objects y - thing) (:init (p) (= (at x) b) (= (next b) b)) (:goal {goal}))"
        )
    };
    for (effect, goal, expect) in [
        ("(assign (at x) a) (assign (at x) b)", "(and (done) (= (at x) a))", Expect::Unsolvable),
        ("(assign (at x) a) (assign (at x) undefined)", "(not (= (at x) b))", Expect::Unsolvable),
        ("(assign (at ?one) a) (assign (at ?other) b)", "(and (= (at x) b) (= (at y) a))", Expect::Best(1.0)),
        ("(assign (at x) a) (when (p) (assign (at x) b))", "(= (at x) a)", Expect::Best(2.0)),
        (
            "(when (q) (assign (at x) a)) (when (not (p)) (assign (at x) b))",
            "(= (at x) a)",
            Expect::Best(2.0),
        ),
        (
            "(when (not (q)) (assign (at x) b)) (when (not (q)) (assign (at x) (next (at x))))",
            "(done)",
            Expect::Best(1.0),
        ),
    ] {
        check(&domain(effect), &problem(goal), expect);
    }
}

#[test]
fn a_predicate_about_a_function_may_be_called_like_a_connective() {
    let domain = "(define (domain stack) (:requirements :typing :object-fluents) (:types thing)
      (:predicates (on ?a ?b - thing) (r ?a - thing)) (:functions (top) - thing (under ?t - thing) - thing)
      (:action lift :parameters () :precondition (on (top) (under (top))) :effect (r (top))))";
    let problem = "(define (problem p) (:domain stack) (:objects a b - thing)
      (:init (on a b) (= (top) a) (= (under a) b)) (:goal (and (r (top)) (on (top) b))))";
    check(domain, problem, Expect::Best(1.0));
}

#[test]
fn derived_predicates_with_negation() {
    let domain = "(define (domain net) (:requirements :typing :derived-predicates :adl)
      (:types node) (:predicates (link ?a ?b - node) (up ?n - node) (fed ?n - node) (source ?n - node) (dark ?n - node))
      (:derived (fed ?n - node) (or (source ?n) (exists (?m - node) (and (fed ?m) (up ?m) (link ?m ?n)))))
      (:derived (dark ?n - node) (not (fed ?n)))
      (:action switch-on :parameters (?n - node) :precondition (and (fed ?n) (not (up ?n))) :effect (up ?n))
      (:action switch-off :parameters (?n - node) :precondition (up ?n) :effect (not (up ?n))))";
    let problem = "(define (problem p) (:domain net) (:objects a b c d - node)
      (:init (source a) (link a b) (link b c) (link a d) (up c)) (:goal (and (fed c) (not (up c)))))";
    check(domain, problem, Expect::Best(3.0));
    check(domain, &problem.replace("(and (fed c) (not (up c)))", "(and (up b) (dark d))"), Expect::Best(3.0));
}

#[test]
fn grounding_hears_the_stop_signal_where_it_finds_nothing() {
    let variables = "?a ?b ?c ?d ?e ?f ?g ?h";
    let objects: String = (0..40).map(|index| format!(" o{index}")).collect();
    let simply = ":parameters () :effect (done)".to_string();
    for (body, goal) in [
        // Nothing fits what is asked of the last two.
        (
            format!(
                ":parameters ({variables}) :precondition (and (= ?g ?h) (not (= ?g ?h)))
                 :effect (and (done) (met {variables}))"
            ),
            "(done)".to_string(),
        ),
        (
            format!(":parameters () :effect (and (done) (forall ({variables}) (met {variables})))"),
            "(done)".into(),
        ),
        (simply.clone(), format!("(forall ({variables}) (or (done) (met {variables})))")),
        (simply.clone(), format!("(exists ({variables}) (and (done) (not (= ?a ?b))))")),
        // What never changes decides, but only once all objects were tried.
        (
            format!(
                ":parameters () :precondition (forall ({variables}) (not (met {variables}))) :effect (done)"
            ),
            "(done)".into(),
        ),
    ] {
        let domain = format!(
            "(define (domain d) (:requirements :adl) (:predicates (done) (met {variables})) (:action meet {body}))"
        );
        let problem = format!("(define (problem p) (:domain d) (:objects{objects}) (:init) (:goal {goal}))");
        let asked = AtomicUsize::new(0);
        let found = plan(
            &read(&domain, &problem),
            &Attachments::default(),
            &Options::default(),
            &|| asked.fetch_add(1, Ordering::Relaxed) >= 20,
            &mut |_| {},
        );
        assert!(matches!(found, Ok(Outcome::OutOfTime { best: None, .. })), "{found:?}");
    }
}

#[test]
fn a_parameter_that_nothing_uses_takes_no_objects_but_one() {
    let objects: String = (0..60).map(|index| format!(" o{index}")).collect();
    for (unused, body, actions) in [
        ("?u ?v ?w", ":precondition (not (met ?a)) :effect (met ?a)", 60),
        ("", ":precondition (not (met ?a)) :effect (met ?a)", 60),
        ("?u", ":precondition (not (met ?a)) :effect (and (met ?a) (when (met ?u) (done)))", 60 * 60),
        (
            "?u",
            ":precondition (not (met ?a)) :effect (and (met ?a) (forall (?x) (when (met ?x) (done))))",
            60,
        ),
        ("?u", ":precondition (not (= ?a ?u)) :effect (met ?a)", 60 * 59),
        ("?u", ":effect (and (met ?a) (increase (total-cost) (price ?u)))", 60 * 60),
    ] {
        let domain = format!(
            "(define (domain d) (:requirements :adl :action-costs) (:predicates (done) (met ?x))
              (:functions (total-cost) (price ?x)) (:action meet :parameters (?a {unused}) {body}))"
        );
        let problem = format!(
            "(define (problem p) (:domain d) (:objects{objects}) (:init (= (total-cost) 0) (= (price o1) 3) (= (price o2) 1))
              (:goal (and (met o1) (met o2))) (:metric minimize (total-cost)))"
        );
        let (outcome, _) = solve_twice(&domain, &problem, &Options { anytime: true, ..Options::default() });
        assert_eq!(outcome.plan().map(|plan| plan.steps.len()), Some(2), "{unused} {body}: {outcome:?}");
        // Without a price there is no such action.
        let actions = if body.contains("price") { 2 * 60 } else { actions };
        assert!(outcome.statistics().actions <= actions, "{unused} {body}: {outcome:?}");
    }
}

#[test]
fn however_far_a_goal_seems_it_is_not_out_of_reach() {
    // Every rung asks for both hands on the one below: what they add up to doubles with each.
    let domain =
        "(define (domain climb) (:requirements :typing :fluents) (:types rung) (:functions (total-cost))
      (:predicates (left ?r - rung) (right ?r - rung) (above ?a ?b - rung))
      (:action left :parameters (?a ?b - rung) :precondition (and (left ?a) (right ?a) (above ?b ?a))
        :effect (and (left ?b) (increase (total-cost) 3)))
      (:action right :parameters (?a ?b - rung) :precondition (and (left ?a) (right ?a) (above ?b ?a))
        :effect (and (right ?b) (increase (total-cost) 3))))";
    for (metric, cost) in [("", 80.0), ("(:metric minimize (total-cost))", 240.0)] {
        let names: String = (0..=40).map(|n| format!("r{n} ")).collect();
        let above: String = (0..40).map(|n| format!("(above r{} r{n}) ", n + 1)).collect();
        let problem = format!(
            "(define (problem p) (:domain climb) (:objects {names} - rung)
               (:init (= (total-cost) 0) (left r0) (right r0) {above}) (:goal (and (left r40) (right r40))) {metric})"
        );
        check(domain, &problem, Expect::CostAtMost(cost));
    }
}

#[test]
fn a_plan_may_cost_more_than_the_search_can_count() {
    let domain = "(define (domain count) (:requirements :fluents) (:functions (x) (total-cost))
      (:action up :effect (and (increase (x) 1) (increase (total-cost) 1000000))))";
    for (far, proven) in [(3, true), (4400, false)] {
        let problem = format!(
            "(define (problem p) (:domain count) (:init (= (x) 0) (= (total-cost) 0)) (:goal (>= (x) {far}))
               (:metric minimize (total-cost)))"
        );
        let options = Options { anytime: true, evaluation_limit: Some(9_000), ..Options::default() };
        let (outcome, verdict) = solve(&read(domain, &problem), &options);
        assert_eq!(verdict.and_then(|verdict| verdict.cost), Some(1e6 * f64::from(far)), "{far}");
        assert_eq!(outcome.statistics().optimal, proven, "{far}");
    }
}

#[test]
fn small_costs_are_told_apart() {
    let domain = "(define (domain crumbs) (:requirements :fluents)
      (:predicates (one) (two) (three) (full)) (:functions (total-cost))
      (:action first :effect (and (one) (increase (total-cost) 0.0004)))
      (:action second :precondition (one) :effect (and (two) (increase (total-cost) 0.0004)))
      (:action third :precondition (two) :effect (and (three) (increase (total-cost) 0.0004)))
      (:action fourth :precondition (three) :effect (and (full) (increase (total-cost) 0.0004)))
      (:action loaf :effect (and (full) (increase (total-cost) 0.0014))))";
    let problem = "(define (problem p) (:domain crumbs) (:init (= (total-cost) 0)) (:goal (full))
      (:metric minimize (total-cost)))";
    let options = Options { anytime: true, evaluation_limit: Some(5_000), ..Options::default() };
    let (outcome, _) = solve(&read(domain, problem), &options);
    assert!(matches!(outcome, Outcome::Solved { .. }) && !outcome.statistics().optimal, "{outcome:?}");
    let cost = outcome.plan().and_then(|plan| plan.cost).expect("a plan");
    assert!((cost - 0.0014).abs() < 1e-9, "{cost}");
}

#[test]
fn object_fluents() {
    let domain = "(define (domain tow) (:requirements :typing :object-fluents :negative-preconditions)
      (:types place robot) (:predicates (road ?a ?b - place)) (:functions (where ?r - robot) - place)
      (:action go :parameters (?r - robot ?to - place) :precondition (road (where ?r) ?to)
        :effect (assign (where ?r) ?to))
      (:action follow :parameters (?r ?s - robot) :precondition (not (= (where ?r) (where ?s)))
        :effect (assign (where ?r) (where ?s))))";
    let problem = "(define (problem p) (:domain tow) (:objects a b c d - place r s - robot)
      (:init (= (where r) a) (= (where s) d) (road a b) (road b c) (road c d))
      (:goal (and (= (where r) d) (= (where s) d))))";
    check(domain, problem, Expect::Best(1.0));
}

#[test]
fn the_stop_signal_is_asked_all_the_while_instances_are_made() {
    let domain = "(define (domain relay) (:predicates (held) (warm ?a ?b ?c))
      (:action pass :parameters (?a ?b ?c) :precondition (held) :effect (warm ?a ?b ?c)))";
    let names: Vec<String> = (0..32).map(|n| format!("o{n}")).collect();
    let names = names.join(" ");
    let problem = format!(
        "(define (problem p) (:domain relay) (:objects {names}) (:init (held)) (:goal (warm o1 o2 o3)))"
    );
    let task = read(domain, &problem);
    let asked = AtomicUsize::new(0);
    let never = || {
        asked.fetch_add(1, Ordering::Relaxed);
        false
    };
    let run = |stop: &(dyn Fn() -> bool + Sync)| {
        plan(&task, &Attachments::default(), &Options::default(), stop, &mut |_| {}).expect("no refusal")
    };
    assert!(run(&never).plan().is_some());
    // Every 1024 of the 32^3 atoms, and again of the instances.
    let asked_in_all = asked.swap(0, Ordering::Relaxed);
    assert!(asked_in_all >= 64, "asked {asked_in_all} times");
    let soon = || asked.fetch_add(1, Ordering::Relaxed) >= 40;
    assert!(matches!(run(&soon), Outcome::OutOfTime { best: None, .. }));
    assert!(asked.load(Ordering::Relaxed) < 50, "not heard at once");
}

/// Every classical task of the competition files, with a limit on evaluated states.
#[test]
#[ignore = "slow: minutes; reads ../shared/pddl/classical"]
fn competition_tasks() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../shared/pddl/classical");
    let folders = std::fs::read_dir(&root).expect("the published tasks are there");
    let mut solved = 0;
    let mut folders: Vec<_> = folders.flatten().map(|f| f.path()).collect();
    folders.sort();
    for folder in folders {
        for size in ["S", "M", "L"] {
            let text = |name: &str| std::fs::read_to_string(folder.join(name)).expect("readable");
            let task = read(&text("domain.pddl"), &text(&format!("{size}.pddl")));
            let options = Options { evaluation_limit: Some(100_000), ..Options::default() };
            let Some(verdict) = solve(&task, &options).1 else {
                println!("{} {size}: no plan", folder.display());
                continue;
            };
            println!("{} {size}: cost {:?}", folder.display(), verdict.cost);
            solved += 1;
        }
    }
    assert!(solved >= 33, "{solved} solved");
}
