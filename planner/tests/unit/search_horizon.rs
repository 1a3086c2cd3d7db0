//! Tests of `search::horizon`.

use super::small;
use descry_planner::search::horizon::*;
use descry_planner::search::lazy::{Allowed, End, Shared};
use std::sync::atomic::AtomicBool;

/// Checks the number of operators of a plan cheaper than a bound, or that there is none.
fn check(domain: &str, problem: &str, bound: u32, expected: Option<usize>) {
    let (_, ground) = small::read(domain, problem);
    small::lend(&ground, |shared| check_shared(shared, bound, expected));
}

fn check_shared(shared: &Shared<'_>, bound: u32, expected: Option<usize>) {
    let task = shared.task;
    let mut search = SatSearch::new(shared, bound);
    let end = loop {
        // In pieces: going on must make no difference.
        let work = search.counts().work + 200_000;
        let cancelled = &AtomicBool::new(false);
        match search.run(Allowed { work, evaluations: u64::MAX, memory: shared.memory, cancelled }) {
            End::Limit => {}
            end => break end,
        }
    };
    let plan = match &end {
        End::Plan(plan) => Some(plan),
        _ => None,
    };
    assert_eq!(plan.map(Vec::len), expected, "{end:?}");
    let mut state = task.initial.clone();
    for &operator in plan.into_iter().flatten() {
        assert!(task.applicable(operator, &state));
        task.advance(operator, &mut state);
    }
    assert_eq!(task.is_goal(&state), expected.is_some());
}

const LAMPS: &str = "(define (domain lamps) (:requirements :adl) (:types lamp)
  (:predicates (lit ?l - lamp) (dark))
  (:action light :parameters (?l - lamp) :precondition (not (lit ?l)) :effect (lit ?l))
  (:action quench :parameters (?l - lamp) :effect (not (lit ?l))))";

#[test]
fn plans_are_found_whatever_shares_a_step() {
    check(small::SHUTTLE, small::ROW, u32::MAX, Some(4));
    check(small::SHUTTLE, small::ROW, 5, Some(4));
    check(small::SHUTTLE, small::ROW, 4, None);
    // Nothing to be done, and many things at once.
    let lamps = "(define (problem p) (:domain lamps) (:objects a b c - lamp) (:init (lit a)) (:goal ";
    check(LAMPS, &format!("{lamps} (lit a)))"), u32::MAX, Some(0));
    check(LAMPS, &format!("{lamps} (and (not (lit a)) (lit b) (lit c))))"), u32::MAX, Some(3));
}

#[test]
fn tasks_of_other_kinds_are_left_alone() {
    let when = "(when (dark) (not (lit ?l))))\n (:action draw :effect (not (dark)))";
    let problem = "(define (problem p) (:domain lamps) (:objects a - lamp) (:init (lit a) (dark))
      (:goal (not (lit a))))";
    check(LAMPS, problem, u32::MAX, Some(1));
    check(&LAMPS.replace("(not (lit ?l))))", &format!("{when})")), problem, u32::MAX, None);
}
