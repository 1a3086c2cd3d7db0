//! Durations and times that numbers decide: chosen by linear programs where no end of a range is right.

use crate::temporal::check;

const PETROL: &str = "(:requirements :duration-inequalities :numeric-fluents) (:predicates (done) (unused)) (:functions (fuel) (cap))
  (:durative-action fill :parameters () :duration (and (>= ?duration 1) (<= ?duration 10))
    :condition (and (at start (unused)) (at start (<= (+ (fuel) (* 2 ?duration)) (cap))))
    :effect (and (at start (not (unused))) (at end (increase (fuel) (* 2 ?duration)))))
  (:durative-action drive :parameters () :duration (= ?duration 3) :condition (at start (>= (fuel) 7))
    :effect (and (at end (decrease (fuel) 7)) (at end (done))))";

#[test]
fn an_action_lasts_as_long_as_a_number_needs() {
    let problem =
        |cap: f64, goal: &str| format!("(:init (= (fuel) 0) (= (cap) {cap}) (unused)) (:goal {goal})");
    // From 3.5 to 4 s.
    check(PETROL, &problem(8.0, "(done)"), Some(6.5));
    check(PETROL, &problem(7.0, "(done)"), Some(6.5));
    // What is left is what was filled in beyond 7.
    check(PETROL, &problem(13.0, "(and (done) (= (fuel) 4))"), Some(8.5));
}

const STOVE: &str =
    "(:requirements :continuous-effects :numeric-fluents) (:predicates (on) (cooked)) (:functions (heat))
  (:durative-action warm :parameters () :duration (= ?duration 15) :condition (over all (<= (heat) 100))
    :effect (and (at start (on)) (increase (heat) (* #t 4)) (at end (not (on)))))
  (:durative-action cook :parameters () :duration (= ?duration 5)
    :condition (and (over all (on)) (over all (>= (heat) 40))) :effect (at end (cooked)))";

#[test]
fn what_flows_is_met_while_it_flows() {
    // Warm enough after 5 s, and for 5 s: the stove is on for 15.
    check(STOVE, "(:init (= (heat) 20)) (:goal (cooked))", Some(15.0));
    check(STOVE, "(:init (= (heat) 4)) (:goal (and (cooked) (>= (heat) 60)))", Some(15.0));
}

#[test]
fn two_choices_add_up_to_a_number() {
    let domain = "(:requirements :duration-inequalities :numeric-fluents) (:predicates (cold) (hot)) (:functions (level) (warmth))
      (:durative-action pour-cold :parameters () :duration (and (>= ?duration 1) (<= ?duration 9)) :condition (at start (cold))
        :effect (and (at start (not (cold))) (at end (increase (level) ?duration))))
      (:durative-action pour-hot :parameters () :duration (and (>= ?duration 1) (<= ?duration 9)) :condition (at start (hot))
        :effect (and (at start (not (hot))) (at end (increase (level) ?duration)) (at end (increase (warmth) (* 10 ?duration)))))";
    let problem =
        "(:init (cold) (hot) (= (level) 0) (= (warmth) 0)) (:goal (and (= (level) 10) (= (warmth) 70)))";
    check(domain, problem, Some(7.0));
}

#[test]
fn a_rule_may_compare_numbers_beside_those_that_times_decide() {
    let domain = PETROL
        .replace("(:predicates", "(:predicates (paid)")
        .replace("(:functions", "(:functions (money)")
        .replace("(at start (unused))", "(at start (unused)) (at start (paid))")
        + "(:derived (paid) (>= (money) 2))";
    let domain = domain.replace("(:requirements", "(:requirements :derived-predicates");
    let problem =
        |money: u32| format!("(:init (= (fuel) 0) (= (cap) 8) (= (money) {money}) (unused)) (:goal (done))");
    check(&domain, &problem(2), Some(6.5));
    check(&domain, &problem(1), None);
}

#[test]
fn what_flows_for_long_begins_before_a_timed_literal_and_ends_after_it() {
    let domain = "(:requirements :duration-inequalities :continuous-effects) (:predicates (night)) (:functions (level))
      (:durative-action fill :parameters () :duration (>= ?duration 2) :effect (increase (level) (* #t 1)))";
    for night_s in [0.5, 2.003, 8.0] {
        let problem = format!("(:init (= (level) 0) (at {night_s} (night))) (:goal (>= (level) 7.5))");
        check(domain, &problem, Some(7.5));
    }
}
