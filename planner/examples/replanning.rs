//! A robot that plans again whenever the world is otherwise than it thought: `cargo run -p descry-planner --example replanning`.

use descry_planner::{Attachments, Options, Problem, Source, Task};

const DOMAIN: &str = "(define (domain rooms) (:requirements :typing)
  (:types room) (:predicates (at ?r - room) (open ?r - room) (joined ?a ?b - room))
  (:action go :parameters (?a ?b - room) :precondition (and (at ?a) (joined ?a ?b) (open ?b))
    :effect (and (not (at ?a)) (at ?b)))
  (:action unlock :parameters (?a ?b - room) :precondition (and (at ?a) (joined ?a ?b)) :effect (open ?b)))";
const PROBLEM: &str = "(define (problem three) (:domain rooms) (:objects hall study attic - room)
  (:init (at hall) (open study) (joined hall study) (joined study attic) (joined study hall)) (:goal (at attic)))";

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let task = Task::read(&Source::new("rooms.pddl", DOMAIN), &Source::new("three.pddl", PROBLEM))?;
    let mut problem = Problem::new(task);
    let calls = Attachments::new();
    for room in ["hall", "study", "attic"] {
        let outcome = problem.plan(&calls, &Options::default(), &|| false, &mut |_| {})?;
        let grounded = problem.regrounded().map_or("grounded before".to_string(), ToString::to_string);
        println!("from {room} ({grounded}):");
        outcome.plan().into_iter().for_each(|plan| print!("{plan}"));
        // The robot goes on by one room, and finds the door behind it shut.
        let next = if room == "hall" { "study" } else { "attic" };
        problem.set_fact("at", &[room], false)?;
        problem.set_fact("at", &[next], true)?;
        problem.set_fact("open", &["study"], false)?;
    }
    Ok(())
}
