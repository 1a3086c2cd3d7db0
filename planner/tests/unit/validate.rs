//! Tests of `validate`.

use descry_planner::attachment::Attachments;
use descry_planner::diagnostic::Source;
use descry_planner::plan::Plan;
use descry_planner::task::Task;
use descry_planner::validate::*;

#[test]
fn once_asked_to_stop_nothing_is_said() {
    let variables = "?a ?b ?c ?d ?e ?f ?g ?h";
    let objects: String = (0..40).map(|index| format!(" o{index}")).collect();
    let domain = "(define (domain d) (:requirements :adl) (:predicates (met ?x)) (:action meet :parameters (?x) :effect (met ?x)))";
    for goal in ["(forall (VARIABLES) (not (met ?h)))", "(exists (VARIABLES) (met ?h))"] {
        let goal = goal.replace("VARIABLES", variables);
        let problem = format!("(define (problem p) (:domain d) (:objects{objects}) (:init) (:goal {goal}))");
        let task = Task::read(&Source::new("domain", domain), &Source::new("problem", problem));
        let task = task.unwrap_or_else(|findings| panic!("{findings}"));
        let verdict = validate_until(&task, &Attachments::new(), &Plan::default(), &|| true);
        assert_eq!(verdict, None, "{goal}");
    }
}
