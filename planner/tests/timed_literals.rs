//! Timed initial literals: the goal is judged after the last of them (PDDL 2.2), by search and validator alike.

use descry_planner::{Attachments, Plan, Source, validate};

use crate::solving::read;
use crate::temporal::check;

const EVENING: &str = "(:requirements :timed-initial-literals) (:predicates (night) (fed))
  (:durative-action feed :parameters () :duration (= ?duration 1) :effect (at end (fed)))";

#[test]
fn a_goal_is_brought_about_by_a_timed_literal_after_the_last_action() {
    let problem = |goal: &str| format!("(:init (at 10 (night))) (:goal {goal})");
    check(EVENING, &problem("(and (fed) (night))"), Some(1.0));
    // Nothing has to be done for it.
    check(EVENING, &problem("(night)"), Some(0.0));
    check(EVENING, &problem("(and (fed) (not (night)))"), None);
}

const SHOP: &str = "(:requirements :negative-preconditions :timed-initial-literals) (:predicates (open) (bought))
  (:durative-action buy :parameters () :duration (= ?duration 1) :condition (over all (open)) :effect (at end (bought)))";

#[test]
fn a_goal_is_taken_away_by_a_timed_literal_after_the_last_action() {
    let problem = |goal: &str| format!("(:init (open) (at 2 (not (open)))) (:goal {goal})");
    check(SHOP, &problem("(and (bought) (not (open)))"), Some(1.0));
    check(SHOP, &problem("(and (bought) (open))"), None);
}

#[test]
fn what_a_timed_literal_takes_away_is_brought_back_after_it() {
    let domain = "(:requirements :timed-initial-literals) (:predicates (clean) (fed))
      (:durative-action feed :parameters () :duration (= ?duration 4) :effect (at end (fed)))
      (:durative-action sweep :parameters () :duration (= ?duration 1) :effect (at end (clean)))";
    check(domain, "(:init (clean) (at 5 (not (clean)))) (:goal (and (fed) (clean)))", Some(5.0));
    check(domain, "(:init (at 5 (not (clean))) (at 7 (clean))) (:goal (and (fed) (clean)))", Some(4.0));
}

#[test]
fn an_action_lasts_until_what_a_timed_literal_brings() {
    let domain = |end: &str| {
        format!(
            "(:requirements :negative-preconditions :timed-initial-literals :duration-inequalities) (:predicates (day) (watched))
             (:durative-action watch :parameters () :duration (and (>= ?duration 1) (<= ?duration 5))
               :condition (and (at start (day)) {end}) :effect (at end (watched)))"
        )
    };
    let problem = "(:init (day) (at 2 (not (day)))) (:goal (and (watched) (not (day))))";
    check(&domain(""), problem, Some(1.0));
    check(&domain("(at end (not (day)))"), problem, Some(2.0));
}

#[test]
fn a_plan_is_valid_by_what_holds_after_the_last_timed_literal() {
    let verdict = |domain: &str, problem: &str, plan: &str| {
        let task = read(
            &format!("(define (domain d) (:requirements :durative-actions) {domain})"),
            &format!("(define (problem p) (:domain d) {problem})"),
        );
        let plan = Plan::read(&Source::new("plan", plan)).unwrap_or_else(|_| panic!("a plan"));
        validate(&task, &Attachments::new(), &plan).valid
    };
    let evening = "(:init (at 10 (night))) (:goal (and (fed) (night)))";
    let shop = |goal: &str| format!("(:init (open) (at 2 (not (open)))) (:goal (and (bought) {goal}))");
    for (domain, problem, plan, valid) in [
        (EVENING, evening.to_string(), "0.000: (feed) [1.000]", true),
        (EVENING, evening.to_string(), "9.500: (feed) [1.000]", true),
        (EVENING, "(:init (at 10 (night))) (:goal (night))".to_string(), "", true),
        (SHOP, shop("(not (open))"), "0.000: (buy) [1.000]", true),
        (SHOP, shop("(open)"), "0.000: (buy) [1.000]", false),
    ] {
        assert_eq!(verdict(domain, &problem, plan), valid, "{problem} {plan}");
    }
}
