//! Tests of `search::run`.

use super::small;
use descry_planner::ground::GroundTask;
use descry_planner::memory::MemoryLimit;
use descry_planner::search::run::*;
use std::num::NonZeroUsize;

/// Tiles of a puzzle with three by three places, in the order of its rows; 0 is the hole.
fn puzzle(tiles: [usize; 9]) -> GroundTask {
    const DOMAIN: &str = "(define (domain tiles) (:requirements :typing) (:types place tile)
      (:predicates (at ?t - tile ?p - place) (free ?p - place) (beside ?a ?b - place))
      (:action slide :parameters (?t - tile ?a ?b - place)
        :precondition (and (at ?t ?a) (free ?b) (beside ?a ?b))
        :effect (and (at ?t ?b) (free ?a) (not (at ?t ?a)) (not (free ?b)))))";
    let beside = |a: usize, b: usize| (a / 3).abs_diff(b / 3) + (a % 3).abs_diff(b % 3) == 1;
    let (mut init, mut goal) = (String::new(), String::new());
    for (place, tile) in tiles.iter().enumerate() {
        match tile {
            0 => init += &format!("(free p{place}) "),
            tile => init += &format!("(at t{tile} p{place}) "),
        }
        for other in (0..9).filter(|&other| beside(place, other)) {
            init += &format!("(beside p{place} p{other}) ");
        }
    }
    for tile in 1..9 {
        goal += &format!("(at t{tile} p{tile}) ");
    }
    let objects = "p0 p1 p2 p3 p4 p5 p6 p7 p8 - place t1 t2 t3 t4 t5 t6 t7 t8 - tile";
    let problem = format!(
        "(define (problem p) (:domain tiles) (:objects {objects}) (:init {init}) (:goal (and {goal})))"
    );
    small::read(DOMAIN, &problem).1
}

/// However many threads there are, every plan is the same, and so is what it took.
fn check(tiles: [usize; 9], anytime: bool, first_work: u64, solvable: bool) {
    let ground = puzzle(tiles);
    let run = |threads: usize| {
        let options = ClassicalOptions {
            without: Default::default(),
            only_first: false,
            anytime,
            soft: false,
            bound: None,
            memory: MemoryLimit::new(None, None),
            evaluation_limit: None,
            threads: NonZeroUsize::new(threads),
            first_work,
        };
        let mut plans = Vec::new();
        let ended = solve(&ground, &options, &|| false, &mut |plan, cost| {
            plans.push((plan.to_vec(), cost));
        });
        (plans, ended.end, ended.evaluated, ended.expanded, ended.work)
    };
    let alone = run(1);
    assert_eq!(!alone.0.is_empty(), solvable, "{tiles:?}: {:?}", alone.1);
    for threads in [2, 3, 8] {
        assert_eq!(run(threads), alone, "{tiles:?}, {threads} threads, turns of {first_work}");
    }
}

#[test]
fn threads_change_nothing_but_the_time() {
    let hard = [8, 6, 7, 2, 5, 4, 3, 0, 1];
    // Turns so short that several searches take theirs, and some more than one.
    for first_work in [2_000, 20_000, FIRST_WORK] {
        check(hard, false, first_work, true);
    }
    check([1, 0, 2, 3, 4, 5, 6, 7, 8], true, 5_000, true);
}
