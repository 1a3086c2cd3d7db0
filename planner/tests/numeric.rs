//! Planning with numbers and without times, from text to a validated plan.

use descry_planner::{Options, Outcome};

use crate::solving::solve_twice;

/// Expected result.
enum Expect {
    /// A plan.
    Plan,
    /// With time to improve, a plan whose metric is at most this.
    MetricAtMost(f64),
    /// With time to improve, a plan that is proven best, of this metric.
    Best(f64),
    /// With time to improve, a plan whose metric is at least this, and which is not said to be the best.
    Unproven(f64),
    /// Without further time, a plan of at most so many steps.
    StepsAtMost(usize),
    /// Proven to have no plan.
    Unsolvable,
}

fn check(domain: &str, problem: &str, expect: Expect) {
    let anytime = matches!(expect, Expect::MetricAtMost(_) | Expect::Best(_) | Expect::Unproven(_));
    let options = Options { anytime, evaluation_limit: Some(20_000), ..Options::default() };
    let (outcome, verdict) = solve_twice(domain, problem, &options);
    match (expect, verdict) {
        (Expect::Unsolvable, None) => assert!(matches!(outcome, Outcome::Unsolvable { .. }), "{outcome:?}"),
        (Expect::Plan, Some(_)) => {}
        (Expect::StepsAtMost(most), Some(_)) => {
            let steps = outcome.plan().map_or(0, |plan| plan.steps.len());
            assert!(steps <= most, "{steps} steps, more than {most}: {outcome:?}");
        }
        (Expect::Best(metric), Some(verdict)) => {
            assert!(outcome.statistics().optimal, "{outcome:?}");
            assert_eq!(verdict.metric, Some(metric), "{outcome:?}");
        }
        (Expect::Unproven(least), Some(verdict)) => {
            assert!(!outcome.statistics().optimal, "{outcome:?}");
            assert!(verdict.metric.is_some_and(|metric| metric >= least), "{outcome:?}");
        }
        (Expect::MetricAtMost(most), Some(verdict)) => {
            let metric = verdict.metric.or(verdict.cost).expect("the problem has a metric");
            assert!(metric <= most + 1e-9, "metric {metric} above {most}: {outcome:?}");
        }
        _ => panic!("unexpected outcome {outcome:?}"),
    }
}

const LADDER: &str = "(define (domain ladder) (:requirements :typing :fluents) (:types rung)
  (:functions (height ?r - rung) (top))
  (:action raise :parameters (?r - rung) :precondition (<= (+ (height ?r) 1) (top))
    :effect (increase (height ?r) 1))
  (:action lower :parameters (?r - rung) :precondition (>= (height ?r) 1) :effect (decrease (height ?r) 1)))";

/// Rungs in rising order: what settles one pair unsettles the next, and there is room for one order only.
fn ladder(rungs: usize) -> String {
    let names: Vec<String> = (0..rungs).map(|r| format!("r{r}")).collect();
    let heights = (0..rungs).map(|r| format!("(= (height r{r}) {})", (rungs - 1 - r) * 7 % rungs));
    let pairs = (1..rungs).map(|r| format!("(<= (+ (height r{}) 1) (height r{r}))", r - 1));
    format!(
        "(define (problem p) (:domain ladder) (:objects {} - rung) (:init (= (top) {}) {}) (:goal (and {})))",
        names.join(" "),
        rungs - 1,
        heights.collect::<String>(),
        pairs.collect::<String>()
    )
}

#[test]
fn conditions_over_two_numbers() {
    for rungs in [2, 5, 16] {
        check(LADDER, &ladder(rungs), Expect::Plan);
    }
}

#[test]
fn a_number_that_only_grows_never_falls() {
    let domain = LADDER.replace("(decrease (height ?r) 1)", "(increase (height ?r) 2)");
    let problem =
        "(define (problem p) (:domain ladder) (:objects a - rung) (:init (= (top) 9) (= (height a) 3))
      (:goal (< (height a) 2)))";
    check(&domain, problem, Expect::Unsolvable);
    check(LADDER, problem, Expect::Plan);
}

const VAN: &str = "(define (domain van) (:requirements :typing :fluents) (:types place)
  (:predicates (at ?p - place) (road ?a ?b - place) (pump ?p - place) (seen ?p - place))
  (:functions (fuel) (used) (need ?a ?b - place))
  (:action go :parameters (?a ?b - place)
    :precondition (and (at ?a) (road ?a ?b) (>= (fuel) (need ?a ?b)))
    :effect (and (not (at ?a)) (at ?b) (seen ?b) (decrease (fuel) (need ?a ?b)) (increase (used) (need ?a ?b))))
  (:action fill :parameters (?p - place) :precondition (and (at ?p) (pump ?p) (<= (fuel) 8))
    :effect (increase (fuel) 4)))";

/// A star of places around a pump: every way out must be paid for twice.
fn van(arms: usize, metric: &str) -> String {
    let arm = |i: usize| {
        format!("(road hub p{i}) (road p{i} hub) (= (need hub p{i}) {0}) (= (need p{i} hub) {0})", 2 + i % 3)
    };
    let names: Vec<String> = (0..arms).map(|i| format!("p{i}")).collect();
    let seen: String = (0..arms).map(|i| format!("(seen p{i})")).collect();
    format!(
        "(define (problem p) (:domain van) (:objects hub {} - place)
          (:init (at hub) (pump hub) (= (fuel) 3) (= (used) 0) {}) (:goal (and (at hub) {seen})) {metric})",
        names.join(" "),
        (0..arms).map(arm).collect::<String>()
    )
}

#[test]
fn what_is_used_up_is_filled_up() {
    check(VAN, &van(3, ""), Expect::Plan);
    check(VAN, &van(14, ""), Expect::Plan);
}

#[test]
fn metrics_are_made_small() {
    // Two, three and four units out, and back.
    check(VAN, &van(3, "(:metric minimize (used))"), Expect::MetricAtMost(18.0));
    // A metric over a number that conditions read.
    check(VAN, &van(3, "(:metric minimize (+ (used) (fuel)))"), Expect::MetricAtMost(22.0));
}

const SHOP: &str = "(define (domain shop) (:requirements :fluents :adl)
  (:predicates (open) (happy) (rich))
  (:functions (money) (wage) (stock) (price))
  (:derived (rich) (> (money) 50))
  (:action learn :parameters () :precondition (< (wage) 20) :effect (scale-up (wage) 2))
  (:action work :parameters () :precondition (> (wage) 0) :effect (increase (money) (wage)))
  (:action ask :parameters () :precondition () :effect (and (open) (assign (price) (* 2 (wage)))))
  (:action buy :parameters () :precondition (and (open) (>= (money) (price)))
    :effect (and (decrease (money) (price)) (increase (stock) 1) (when (rich) (happy))))
  (:action give :parameters () :precondition (>= (stock) 2) :effect (and (assign (stock) 0) (happy))))";

fn shop(goal: &str) -> String {
    format!(
        "(define (problem p) (:domain shop) (:init (= (money) 0) (= (wage) 3) (= (stock) 0)) (:goal (and {goal})))"
    )
}

#[test]
fn assignments_products_and_amounts_that_depend_on_the_state() {
    check(SHOP, &shop("(>= (money) 40)"), Expect::Plan);
    check(SHOP, &shop("(>= (* (money) (stock)) 100) (happy)"), Expect::Plan);
    check(SHOP, &shop("(>= (/ (money) (wage)) 4) (= (wage) 24)"), Expect::Plan);
    check(SHOP, &shop("(< (wage) 3)"), Expect::Unsolvable);
}

#[test]
fn rounding_decides_nothing() {
    let domain = "(define (domain sums) (:requirements :fluents)
      (:predicates (done)) (:functions (a) (b) (limit) (x))
      (:action grow :parameters () :precondition (<= (+ (a) (b)) (limit)) :effect (increase (x) .1))
      (:action finish :parameters () :precondition (and (= (* 1.1 1.1) 1.21) (not (> (+ (a) (b)) (limit))))
        :effect (done)))";
    let problem = |goal: &str| {
        format!(
            "(define (problem p) (:domain sums) (:init (= (a) .1) (= (b) .2) (= (limit) .3) (= (x) 0)) (:goal {goal}))"
        )
    };
    check(domain, &problem("(done)"), Expect::Plan);
    check(domain, &problem("(= (x) .3)"), Expect::Plan);
    check(domain, &problem("(and (>= (x) .3) (<= (x) .3))"), Expect::Plan);
    check(domain, &problem("(and (> (x) .6) (<= (x) .7))"), Expect::Plan);
    check(domain, &problem("(> (+ (a) (b)) (limit))"), Expect::Unsolvable);
    check(domain, &problem("(< (x) (/ (a) 0))"), Expect::Unsolvable);
}

#[test]
fn large_numbers_are_told_apart() {
    let domain = "(define (domain far) (:requirements :fluents) (:predicates (p)) (:functions (x))
      (:action step :parameters () :precondition (p) :effect (increase (x) 1)))";
    let problem =
        |goal: &str| format!("(define (problem p) (:domain far) (:init (= (x) 100000000)) (:goal {goal}))");
    check(domain, &problem("(>= (x) 100000001)"), Expect::Unsolvable);
    check(domain, &problem("(= (x) 100000000)"), Expect::Plan);
}

#[test]
fn products_of_two_changing_numbers() {
    let domain = "(define (domain area) (:requirements :fluents) (:predicates (p)) (:functions (x) (y))
      (:action wide :parameters () :precondition (p) :effect (increase (x) 1))
      (:action high :parameters () :precondition (p) :effect (increase (y) 1)))";
    let problem = |goal: &str| {
        format!("(define (problem p) (:domain area) (:init (p) (= (x) 1) (= (y) 1)) (:goal {goal}))")
    };
    check(domain, &problem("(>= (* (x) (y)) 6)"), Expect::Plan);
    check(domain, &problem("(and (= (/ (x) (y)) 1.5) (= (x) 3))"), Expect::Plan);
}

#[test]
fn an_undefined_number_is_asked_for_in_vain() {
    // Nothing can be bought before the price is known.
    check(SHOP, &shop("(>= (stock) 1)"), Expect::Plan);
    let mute = SHOP.replace("(assign (price) (* 2 (wage)))", "(increase (price) 1)");
    check(&mute, &shop("(>= (stock) 1)"), Expect::Unsolvable);
}

#[test]
fn derived_predicates_and_conditional_effects_over_numbers() {
    check(SHOP, &shop("(rich) (happy) (<= (stock) 1) (>= (stock) 1)"), Expect::Plan);
}

#[test]
fn what_steps_undo_of_one_another_goes() {
    // There is room for one order only, so that every rung has one height to come to.
    for (rungs, away) in [(16, 86), (24, 206)] {
        let (outcome, _) = solve_twice(LADDER, &ladder(rungs), &Options::default());
        assert_eq!(outcome.plan().map(|plan| plan.steps.len()), Some(away), "{rungs} rungs");
    }
}

#[test]
fn what_has_no_result_is_never_done() {
    // What is set and raised at once has no value: one of the two must not happen, or nobody does it.
    let domain = "(define (domain d) (:requirements :fluents :conditional-effects :negative-preconditions)
      (:predicates (high) (wet) (done)) (:functions (level) (rain))
      (:action fill :parameters () :precondition (not (done))
        :effect (and (done) (when (high) (assign (level) 5)) (when (wet) (increase (level) 2))))
      (:action dry :parameters () :precondition (wet) :effect (not (wet)))
      (:action splash :parameters () :effect (and (done) (assign (rain) 1) (assign (rain) 2))))";
    for (init, goal, expect) in [
        ("(high)", "(= (level) 5)", Expect::StepsAtMost(1)),
        ("(wet)", "(= (level) 2)", Expect::StepsAtMost(1)),
        ("(high) (wet)", "(= (level) 5)", Expect::StepsAtMost(2)),
        ("(high) (wet)", "(= (level) 7)", Expect::Unsolvable),
        ("(high) (wet)", "(and (done) (wet))", Expect::Unsolvable),
    ] {
        let problem = format!(
            "(define (problem p) (:domain d) (:init {init} (= (level) 0) (= (rain) 0)) (:goal {goal}))"
        );
        check(domain, &problem, expect);
    }
}

#[test]
fn what_the_last_state_is_worth_is_made_as_large_as_can_be() {
    let purse = "(define (domain d) (:requirements :fluents :negative-preconditions) (:predicates (done)) (:functions (gold))
      (:action get :parameters () :precondition (and (not (done)) (< (gold) 5)) :effect (increase (gold) 1))
      (:action stop :parameters () :precondition (not (done)) :effect (done)))";
    let gate = "(define (domain d) (:requirements :fluents :typing :conditional-effects) (:types coin)
      (:predicates (in) (open)) (:functions (spent) (worth ?c - coin))
      (:action pay :parameters (?c - coin)
        :effect (and (in) (when (open) (increase (spent) (worth ?c))) (when (not (open)) (increase (spent) 7)) (increase (spent) 1)))
      (:action open :parameters () :effect (and (open) (increase (spent) 2))))";
    let coins = "(:objects a b - coin) (:init (= (spent) 0) (= (worth a) 3) (= (worth b) 1.5)) (:goal (in))";
    for (domain, problem, most) in [
        (purse, "(:init (= (gold) 0)) (:goal (done)) (:metric minimize (- 10 (gold)))", 5.0),
        (gate, &format!("{coins} (:metric minimize (+ 3 (* 2 (spent))))"), 12.0),
    ] {
        check(domain, &format!("(define (problem p) (:domain d) {problem})"), Expect::MetricAtMost(most));
    }
}

#[test]
fn what_can_be_earned_is_gone_after() {
    let domain = |gain: &str| {
        format!(
            "(define (domain d) (:requirements :fluents :typing :negative-preconditions) (:types coin)
              (:predicates (done) (taken ?c - coin)) (:functions (gold) (spent) (worth ?c - coin))
              (:action take :parameters (?c - coin) :precondition (not (taken ?c))
                :effect (and (taken ?c) (increase (gold) (worth ?c)) (increase (spent) 2)))
              (:action dig :effect {gain})
              (:action stop :parameters () :effect (done)))"
        )
    };
    let problem = |goal: &str, metric: &str| {
        format!(
            "(define (problem p) (:domain d) (:objects a b c - coin) (:init (= (gold) 0) (= (spent) 0)
               (= (worth a) 3) (= (worth b) 1) (= (worth c) 5)) (:goal {goal}) (:metric {metric}))"
        )
    };
    let nothing = domain("(done)");
    check(&nothing, &problem("(done)", "maximize (gold)"), Expect::Best(9.0));
    check(&nothing, &problem("(done)", "maximize (- (gold) (spent))"), Expect::Best(4.0));
    check(&nothing, &problem("(done)", "minimize (- (spent) (* 2 (gold)))"), Expect::Best(-12.0));
    check(&nothing, &problem("(and)", "maximize (gold)"), Expect::Best(9.0));
    // What grows for ever has no largest value.
    for gain in ["(increase (gold) 1)", "(and (increase (gold) 1) (done))", "(increase (gold) (- (gold) -1))"]
    {
        let domain = domain(gain);
        check(&domain, &problem("(done)", "maximize (gold)"), Expect::Unproven(12.0));
        check(
            &domain,
            &problem("(and (done) (taken a) (not (taken a)))", "maximize (gold)"),
            Expect::Unsolvable,
        );
    }
    check(
        &domain("(decrease (spent) 1)"),
        &problem("(done)", "maximize (- 0 (spent))"),
        Expect::Unproven(3.0),
    );
}

#[test]
fn a_long_way_is_worth_going_faster() {
    let domain = "(define (domain boat) (:requirements :fluents) (:predicates (met)) (:functions (x) (y) (v))
      (:action east :parameters () :effect (increase (x) (* 2 (v))))
      (:action west :parameters () :effect (decrease (x) (* 2 (v))))
      (:action north :parameters () :effect (increase (y) (v)))
      (:action south :parameters () :effect (decrease (y) (v)))
      (:action faster :parameters () :precondition (<= (v) 9) :effect (increase (v) 1))
      (:action slower :parameters () :precondition (>= (v) 2) :effect (decrease (v) 1))
      (:action meet :parameters () :effect (met)
        :precondition (and (>= (+ (x) (y)) 700) (<= (- (x) (y)) 40) (<= (v) 1))))";
    let problem = |from: i32| {
        format!(
            "(define (problem p) (:domain boat) (:init (= (x) {from}) (= (y) 0) (= (v) 1)) (:goal (met)))"
        )
    };
    check(domain, &problem(0), Expect::StepsAtMost(90));
    check(domain, &problem(2000), Expect::StepsAtMost(250));
}
