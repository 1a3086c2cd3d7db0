//! Tests of `search::lookahead`.

use super::small;
use descry_planner::classical::compiled::Compiled;
use descry_planner::heuristics::relaxed::{Counting, Relaxed};
use descry_planner::search::lookahead::Lookahead;

/// Follows the relaxed plan from the first state to the goal, in at most so many steps.
fn check(domain: &str, problem: &str, most: usize) {
    let (_, grounded) = small::read(domain, problem);
    let task = Compiled::new(&grounded);
    let mut relaxed = Relaxed::new(&task, Counting::Steps);
    relaxed.evaluate(&task, &task.initial).expect("the goal is in reach");
    let mut lookahead = Lookahead::new(&task);
    lookahead.run(&task, &task.initial, &relaxed.plan);
    let mut state = task.initial.clone();
    for &operator in &lookahead.plan {
        assert!(task.applicable(operator, &state), "{:?}", lookahead.plan);
        task.advance(operator, &mut state);
    }
    assert!(task.is_goal(&state), "{:?}", lookahead.plan);
    assert!(lookahead.plan.len() <= most, "{} steps, more than {most}", lookahead.plan.len());
}

#[test]
fn what_is_needed_is_taken_before_leaving() {
    let domain = "(define (domain round) (:requirements :typing :fluents) (:types market good)
      (:predicates (at ?m - market)) (:functions (had ?g - good) (sold ?g - good ?m - market))
      (:action drive :parameters (?a ?b - market) :precondition (at ?a) :effect (and (not (at ?a)) (at ?b)))
      (:action buy :parameters (?g - good ?m - market) :precondition (and (at ?m) (> (sold ?g ?m) 0))
        :effect (and (increase (had ?g) (sold ?g ?m)) (assign (sold ?g ?m) 0))))";
    let problem = "(define (problem p) (:domain round) (:objects a b c - market x y z - good)
      (:init (at a) (= (had x) 0) (= (had y) 0) (= (had z) 0) (= (sold x a) 3) (= (sold y b) 4) (= (sold z c) 5)
        (= (sold x b) 0) (= (sold x c) 0) (= (sold y a) 0) (= (sold y c) 0) (= (sold z a) 0) (= (sold z b) 0))
      (:goal (and (>= (had x) 3) (>= (had y) 4) (>= (had z) 5))))";
    check(domain, problem, 5);
}

#[test]
fn as_much_is_carried_as_will_be_needed() {
    let domain = "(define (domain garden) (:requirements :typing :fluents) (:types plant)
      (:functions (x) (carried) (place ?p - plant) (poured ?p - plant))
      (:action right :parameters () :precondition (<= (x) 20) :effect (increase (x) 1))
      (:action left :parameters () :precondition (>= (x) 1) :effect (decrease (x) 1))
      (:action load :parameters () :precondition (and (= (x) 0) (<= (carried) 4)) :effect (increase (carried) 1))
      (:action pour :parameters (?p - plant) :precondition (and (= (x) (place ?p)) (>= (carried) 1))
        :effect (and (decrease (carried) 1) (increase (poured ?p) 1))))";
    let problem = "(define (problem p) (:domain garden) (:objects a b - plant)
      (:init (= (x) 0) (= (carried) 0) (= (place a) 7) (= (place b) 12) (= (poured a) 0) (= (poured b) 0))
      (:goal (and (= (poured a) 10) (= (poured b) 5))))";
    // Fifteen units in and out, on four ways to the tap.
    check(domain, problem, 30 + 2 * 4 * 12);
}
