//! Values that are objects, and objects that nothing uses, in plans that take time.

use descry_planner::Source;

use crate::temporal::{check, outcome};

#[test]
fn what_is_read_of_an_object_that_a_value_names_is_kept_apart_from_its_change() {
    // No place that can be come to is ever burnt: which one it is does not matter to resting, but is read.
    let domain = "(:requirements :adl :object-fluents) (:types place) (:constants a b c - place)
      (:predicates (burnt ?p - place) (done) (lit ?p - place)) (:functions (spot) - place (beside ?p - place) - place)
      (:durative-action come :parameters () :duration (= ?duration 1) :effect (at end (assign (spot) c)))
      (:durative-action rest :parameters () :duration (= ?duration 2)
        :condition (and (at start (not (burnt (spot)))) (over all (= (spot) c))) :effect (at end (done)))
      (:durative-action turn :parameters () :duration (= ?duration 1) :effect (at end (assign (beside c) a)))
      (:durative-action light :parameters () :duration (= ?duration 2)
        :condition (and (at start (not (burnt (beside (spot))))) (over all (= (beside c) a)) (at end (done)))
        :effect (at end (lit a)))";
    check(domain, "(:init (burnt b)) (:goal (done))", Some(3.0));
    check(domain, "(:init (burnt b)) (:goal (and (done) (lit a)))", Some(3.0));
    // What is given at a time is such a change, too.
    check(domain, "(:init (at 1 (= (spot) c))) (:goal (done))", Some(3.0));
}

#[test]
fn an_end_that_names_an_undefined_object_has_no_result() {
    // What was so at the start decides at the end whether something is done to what is held then.
    let domain = "(:types thing) (:predicates (armed) (idle) (done) (marked ?t - thing)) (:functions (held) - thing (under ?t - thing) - thing)
      (:constants x y - thing)
      (:durative-action act :parameters () :duration (= ?duration 2)
        :effect (and (at end (done)) (when (at start (armed)) (at end (marked (under (held)))))))
      (:durative-action keep :parameters () :duration (= ?duration 3)
        :effect (and (at end (done)) (when (over all (armed)) (at end (assign (held) (under (held)))))))
      (:durative-action disarm :parameters () :duration (= ?duration 1) :condition (at start (idle)) :effect (at end (not (armed))))";
    for (init, goal, expected_s) in [
        ("(armed) (= (held) x) (= (under x) y)", "(marked y)", Some(2.0)),
        ("(armed) (= (held) x)", "(done)", None),
        ("(armed)", "(done)", None),
        ("(= (held) x)", "(done)", Some(2.0)),
        ("(armed) (idle) (= (held) x)", "(and (done) (not (marked y)))", Some(3.0)),
        ("(armed) (= (held) x) (= (under x) y)", "(= (held) y)", Some(3.0)),
    ] {
        check(domain, &format!("(:init {init}) (:goal {goal})"), expected_s);
    }
}

#[test]
fn an_object_gets_one_value_at_a_time() {
    let domain =
        "(:types thing) (:predicates (p) (q) (done)) (:functions (held) - thing) (:constants x y - thing)
      (:durative-action act :parameters () :duration (= ?duration 2) :condition (at start (p))
        :effect (and (at start (not (p))) (when (at start (p)) (at end (assign (held) x)))
          (when (at end (not (p))) (at end (assign (held) y))) (at end (done))))
      (:durative-action restore :parameters () :duration (= ?duration 1) :condition (at start (q))
        :effect (and (at start (not (q))) (at start (p)) (at end (done))))";
    check(domain, "(:init (p) (q) (= (held) x)) (:goal (= (held) y))", None);
    // What holds again at the end is restored while it goes on.
    check(domain, "(:init (p) (q) (= (held) y)) (:goal (= (held) x))", Some(2.0));
}

#[test]
fn a_parameter_that_nothing_uses_stands_for_one_object_where_no_two_runs_help() {
    let objects: String = (0..12).map(|index| format!(" o{index}")).collect();
    let alone = "(at start (free)) (at start (not (met ?a)))";
    for (condition, effect, more, actions) in [
        // The one that ends first is enough; or it goes on alone.
        ("", "(at end (met ?a))", "", 12),
        (
            alone,
            "(and (at start (not (free))) (at end (free)) (at end (met ?a)) (at end (increase (count) 1)))",
            "",
            12,
        ),
        (alone, "(and (at start (not (free))) (at end (met ?a)) (at end (increase (count) 1)))", "", 12),
        // Two runs may help, or are possible.
        ("", "(and (at end (met ?a)) (at end (increase (count) 1)))", "", 12 * 12),
        ("", "(and (at start (met ?a)) (at end (not (met ?a))))", "", 12 * 12),
        (
            alone,
            "(and (at start (not (free))) (at end (free)) (at end (met ?a)) (at end (increase (count) 1)))",
            "(:action free :parameters () :effect (free))",
            12 * 12 + 1,
        ),
        // It is used.
        ("(at start (not (met ?u)))", "(at end (met ?a))", "", 12 * 12),
    ] {
        let domain = format!(
            "(define (domain d) (:requirements :adl :durative-actions :numeric-fluents) (:predicates (free) (met ?x)) (:functions (count))
              (:durative-action meet :parameters (?a ?u) :duration (= ?duration 3) :condition (and {condition}) :effect {effect}) {more})"
        );
        let problem = format!(
            "(define (problem p) (:domain d) (:objects{objects}) (:init (free) (= (count) 0)) (:goal (and (forall (?x) (met ?x)) (>= (count) 0))))"
        );
        let found = outcome(Source::new("domain.pddl", domain), Source::new("problem.pddl", problem));
        assert_eq!(found.statistics().actions, actions, "{condition} {effect} {more}");
    }
}
