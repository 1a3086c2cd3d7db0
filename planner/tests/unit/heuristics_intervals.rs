//! Tests of `heuristics::intervals`.

use super::small;
use descry_planner::classical::compiled::Compiled;
use descry_planner::heuristics::relaxed::{Counting, Relaxed};

/// The estimate and how often each step of the relaxed plan is repeated.
fn check(effects: &[&str], init: f64, goal: &str, expected: Option<(u32, &[u32])>) {
    let action = |(i, effect)| format!("(:action step{i} :parameters () :precondition () :effect {effect})");
    let actions: String = effects.iter().enumerate().map(action).collect();
    let domain = format!(
        "(define (domain d) (:requirements :numeric-fluents) (:predicates (p)) (:functions (n) (m)) {actions})"
    );
    let problem = format!("(define (problem q) (:domain d) (:init (= (n) {init}) (= (m) 2)) (:goal {goal}))");
    let (_, grounded) = small::read(&domain, &problem);
    let compiled = Compiled::new(&grounded);
    let mut relaxed = Relaxed::new(&compiled, Counting::Steps);
    let estimate = relaxed.evaluate(&compiled, &compiled.initial);
    let times: Vec<u32> = relaxed.plan.iter().map(|relevant| relevant.times).collect();
    assert_eq!(estimate, expected.map(|(estimate, _)| estimate), "{effects:?} {goal}");
    if let Some((_, repeated)) = expected {
        assert_eq!(times, repeated, "{effects:?} {goal}");
    }
}

#[test]
fn numbers_are_moved_as_often_as_it_takes() {
    check(&["(increase (n) 3)"], 0.0, "(>= (n) 10)", Some((4, &[4])));
    check(&["(increase (n) (m))"], 0.0, "(>= (n) 10)", Some((5, &[5])));
    check(&["(decrease (n) 1)"], 0.0, "(<= (n) -2)", Some((2, &[2])));
    check(&["(assign (n) 7)"], 0.0, "(= (n) 7)", Some((1, &[1])));
    check(&["(decrease (n) 1)"], 0.0, "(>= (n) 1)", None);
}

#[test]
fn amounts_are_taken_as_they_can_soon_be() {
    let (grow, faster) = ("(increase (n) (m))", "(increase (m) 1)");
    check(&[grow, faster], 0.0, "(>= (n) 30)", Some((11, &[10, 1])));
    // Not worth while.
    check(&[grow, faster], 0.0, "(>= (n) 3)", Some((2, &[2])));
    check(&[grow, "(decrease (m) 4)"], 0.0, "(<= (n) -30)", Some((16, &[15, 1])));
    // What takes away helps nobody, even if it could be repeated without end.
    check(&["(decrease (n) (m))", grow], 0.0, "(>= (n) 10)", Some((5, &[5])));
}
