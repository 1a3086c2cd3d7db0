//! Problems that are grounded once and planned for again.

use descry_planner::{Attachments, Options, Outcome, Problem, Regrounded, Source, Task, validate};

const ROOMS: &str = "(define (domain rooms) (:requirements :typing :fluents) (:types room)
  (:predicates (at ?r - room) (joined ?a ?b - room) (locked ?r - room) (clean ?r - room)) (:functions (battery))
  (:action go :parameters (?a ?b - room) :precondition (and (at ?a) (joined ?a ?b) (not (locked ?b)) (>= (battery) 1))
    :effect (and (not (at ?a)) (at ?b) (decrease (battery) 1)))
  (:action unlock :parameters (?a ?b - room) :precondition (and (at ?a) (joined ?a ?b) (locked ?b)) :effect (not (locked ?b)))
  (:action sweep :parameters (?a - room) :precondition (at ?a) :effect (clean ?a)))";
const PROBLEM: &str = "(define (problem three) (:domain rooms) (:objects hall study attic - room)
  (:init (at hall) (joined hall study) (joined study attic) (joined study hall) (locked attic) (= (battery) 9))
  (:goal (at attic)))";

fn problem() -> Problem {
    let task = Task::read(&Source::new("domain", ROOMS), &Source::new("problem", PROBLEM));
    Problem::new(task.unwrap_or_else(|findings| panic!("{findings}")))
}

/// The number of steps to the goal, 0 without a plan; and why it was grounded anew.
fn steps(problem: &mut Problem) -> (usize, Option<Regrounded>) {
    let calls = Attachments::new();
    let outcome = problem.plan(&calls, &Options::default(), &|| false, &mut |_| {});
    let outcome = outcome.unwrap_or_else(|error| panic!("{error}"));
    let count = match &outcome {
        Outcome::Solved { plan, .. } => {
            assert!(validate(problem.task(), &calls, plan).valid, "{plan}");
            plan.steps.len()
        }
        _ => 0,
    };
    (count, problem.regrounded().cloned())
}

#[test]
fn a_problem_is_grounded_once_and_again_where_what_was_taken_for_granted_changes() {
    let mut own = problem();
    let set = |own: &mut Problem, facts: &[(&str, &[&str], bool)]| {
        for (name, arguments, holds) in facts {
            own.set_fact(name, arguments, *holds).unwrap_or_else(|error| panic!("{error}"));
        }
        steps(own)
    };
    assert_eq!(set(&mut own, &[]), (3, Some(Regrounded::First)));
    assert_eq!(set(&mut own, &[("at", &["hall"], false), ("at", &["study"], true)]), (2, None));
    assert_eq!(set(&mut own, &[("locked", &["attic"], false)]), (1, None));
    // No action locks a door: one that never was locked is taken for granted.
    let (count, why) = set(&mut own, &[("locked", &["hall"], true)]);
    assert!(count == 1 && matches!(why, Some(Regrounded::Fact(_))), "{why:?}");
    let (count, why) = set(&mut own, &[("joined", &["study", "attic"], false)]);
    assert!(count == 0 && why == Some(Regrounded::Fact("`(joined study attic)`".into())), "{why:?}");
}

#[test]
fn goals_and_numbers_change_without_grounding_anew() {
    let mut own = problem();
    assert_eq!(steps(&mut own), (3, Some(Regrounded::First)));
    let goal = own.fact("clean", &["study"]).expect("a fact");
    own.set_goal(goal);
    assert_eq!(steps(&mut own), (2, None));
    own.set_number("battery", &[], 0.0).expect("a number");
    assert_eq!(steps(&mut own), (0, Some(Regrounded::NoPlan)));
    own.set_number("battery", &[], 4.0).expect("a number");
    assert_eq!(steps(&mut own).0, 2);
}

#[test]
fn a_name_that_the_task_does_not_have_is_told_with_the_nearest() {
    let mut own = problem();
    let mut said =
        |name: &str, arguments: &[&str]| own.set_fact(name, arguments, true).unwrap_err().to_string();
    assert_eq!(said("lockd", &["hall"]), "the task has no predicate `lockd`; did you mean `locked`?");
    assert_eq!(said("locked", &["hal"]), "the task has no object `hal`; did you mean `hall`?");
    assert_eq!(said("locked", &[]), "`locked` takes 1 arguments, not 0");
}
