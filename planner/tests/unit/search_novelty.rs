//! Tests of `search::novelty`.

use super::small;
use descry_planner::search::lazy::{Allowed, End, Shared};
use descry_planner::search::novelty::*;
use rustc_hash::FxHashMap;
use std::sync::atomic::AtomicBool;

/// Checks that a search ends, with a plan or without.
fn check(problem: &str, narrow: bool, solvable: bool) {
    let (_, ground) = small::read(small::SHUTTLE, problem);
    small::lend(&ground, |shared| check_shared(shared, problem, narrow, solvable));
}

fn check_shared(shared: &Shared<'_>, problem: &str, narrow: bool, solvable: bool) {
    let task = shared.task;
    let mut search = NoveltySearch::new(shared, u32::MAX, narrow);
    let cancelled = &AtomicBool::new(false);
    let all = Allowed { work: u64::MAX, evaluations: u64::MAX, memory: shared.memory, cancelled };
    let End::Plan(plan) = search.run(all) else {
        assert!(!solvable, "{problem}");
        return;
    };
    let mut state = task.initial.clone();
    for &operator in &plan {
        assert!(task.applicable(operator, &state));
        task.advance(operator, &mut state);
    }
    assert!(solvable && task.is_goal(&state), "{problem}");
}

#[test]
fn narrow_or_in_full_a_plan_is_found() {
    let two = small::ROW.replace("x - box", "x y - box").replace("(lies x a)", "(lies x a) (lies y b)");
    let both = two.replace("(:goal (lies x c))", "(:goal (and (lies x c) (lies y a) (at b)))");
    for narrow in [true, false] {
        check(small::ROW, narrow, true);
        check(&both, narrow, true);
        check(&small::ROW.replace("(road b c)", ""), narrow, false);
    }
}

#[test]
fn a_fact_is_new_once_and_then_its_pairs_are() {
    let mut novelty = Novelty { facts: 4, pairs: true, seen: FxHashMap::default(), bytes: 0 };
    let key = (1, 0);
    for (state, changed, expected) in [
        (&[0, 2], &[0, 2][..], 1),
        (&[0, 2], &[0, 2], 3),
        (&[0, 3], &[3], 1),
        (&[1, 2], &[1], 1),
        (&[1, 3], &[1], 2),
        (&[1, 3], &[3], 3),
        (&[0, 3], &[], 3),
    ] {
        assert_eq!(novelty.of(key, state, changed), expected, "{state:?} {changed:?}");
    }
    assert_eq!(novelty.of((2, 0), &[1, 3], &[3]), 1, "states of another kind are not compared");
}
