//! Small tasks that unit tests look into.

use descry_planner::classical::compiled::Compiled;
use descry_planner::classical::successor::Successors;
use descry_planner::diagnostic::Source;
use descry_planner::ground::{GroundFact, GroundTask, Meaning, Origin, ground};
use descry_planner::heuristics::landmarks::Landmarks;
use descry_planner::memory::MemoryLimit;
use descry_planner::search::lazy::Shared;
use descry_planner::task::Task;

/// Places in a row, boxes, and someone who carries one box at a time.
pub const SHUTTLE: &str = "(define (domain shuttle) (:requirements :typing)
  (:types place box)
  (:predicates (at ?p - place) (in ?b - box) (lies ?b - box ?p - place) (road ?a ?b - place) (free))
  (:action go :parameters (?a ?b - place) :precondition (and (at ?a) (road ?a ?b))
    :effect (and (not (at ?a)) (at ?b)))
  (:action take :parameters (?b - box ?p - place) :precondition (and (at ?p) (lies ?b ?p) (free))
    :effect (and (in ?b) (not (free)) (not (lies ?b ?p))))
  (:action put :parameters (?b - box ?p - place) :precondition (and (at ?p) (in ?b))
    :effect (and (not (in ?b)) (free) (lies ?b ?p))))";

/// A box to be taken from one end of three places to the other.
pub const ROW: &str = "(define (problem row) (:domain shuttle) (:objects a b c - place x - box)
  (:init (at a) (free) (lies x a) (road a b) (road b a) (road b c) (road c b))
  (:goal (lies x c)))";

/// A match gives light while it burns, and mending takes light from its start to its end.
pub const CELLAR: &str = "(define (domain cellar) (:requirements :durative-actions :typing)
  (:types match fuse)
  (:predicates (light) (unused ?m - match) (mended ?f - fuse))
  (:durative-action burn :parameters (?m - match) :duration (= ?duration 5)
    :condition (at start (unused ?m))
    :effect (and (at start (not (unused ?m))) (at start (light)) (at end (not (light)))))
  (:durative-action mend :parameters (?f - fuse) :duration (= ?duration 2)
    :condition (over all (light)) :effect (at end (mended ?f))))";

/// One match and two fuses.
pub const FUSES: &str = "(define (problem fuses) (:domain cellar) (:objects m - match f g - fuse)
  (:init (unused m)) (:goal (and (mended f) (mended g))))";

/// Reads and grounds a task.
pub fn read(domain: &str, problem: &str) -> (Task, GroundTask) {
    let source = |name: &str, text: &str| Source { name: name.into(), text: text.into() };
    let task = Task::read(&source("domain", domain), &source("problem", problem));
    let task = task.unwrap_or_else(|findings| panic!("{}", findings.render(false)));
    let grounded = ground(&task, None, &|| false).expect("a small task is grounded");
    (task, grounded)
}

/// A fact as people write it.
pub fn fact(task: &Task, grounded: &GroundTask, fact: GroundFact) -> String {
    match &grounded.variables[fact.variable as usize].values[fact.value as usize] {
        Meaning::Atom { predicate, arguments } => {
            let names = arguments.iter().map(|&object| format!(" {}", task.objects[object as usize].name));
            format!("({}{})", task.predicates[*predicate as usize].name, names.collect::<String>())
        }
        other => format!("{other:?}"),
    }
}

/// A ground action as people write it.
pub fn action(task: &Task, grounded: &GroundTask, index: usize) -> String {
    let origin = &grounded.actions[index].origin;
    let names = origin.arguments.iter().map(|&object| format!(" {}", task.objects[object as usize].name));
    format!("({}{})", task.actions[origin.schema as usize].name, names.collect::<String>())
}

/// An action as it is called: its name and its objects.
pub fn called(task: &Task, origin: &Origin) -> String {
    let name = &task.actions[origin.schema as usize].name;
    let objects = origin.arguments.iter().map(|&o| format!(" {}", task.objects[o as usize].name));
    format!("{name}{}", objects.collect::<String>())
}

/// Lends what searches of a small task share, without limits.
pub fn lend(ground: &GroundTask, to: impl FnOnce(&Shared<'_>)) {
    let task = &Compiled::new(ground);
    to(&Shared {
        task,
        successors: &Successors::new(task),
        landmarks: &Landmarks::new(task, &ground.mutex_groups, &|| false),
        mutex_groups: &ground.mutex_groups,
        memory: MemoryLimit::new(None, None),
        stop: &|| false,
    });
}
