//! Tests of `temporal::compress`.

use super::small;
use descry_planner::attachment::Attachments;
use descry_planner::calls::Calls;
use descry_planner::ground::GroundFact;
use descry_planner::memory::MemoryLimit;
use descry_planner::task::Task;
use descry_planner::temporal::advance::Part;
use descry_planner::temporal::compress::{classical_plan, compressed};
use descry_planner::temporal::envelope::envelopes;
use descry_planner::temporal::space::Measure;
use descry_planner::temporal::space::Space;
use descry_planner::temporal::world::World;

fn in_space<R>(domain: &str, problem: &str, look: impl FnOnce(&Task, &Space) -> R) -> R {
    let (task, grounded) = small::read(domain, problem);
    let nobody = Attachments::default();
    let calls = Calls::bind(&task, &grounded, &nobody).expect("nothing to bind");
    let world = World::new(&task, &grounded, calls);
    look(&task, &Space::new(&world, envelopes(&world), Measure::Makespan))
}

#[test]
fn a_start_and_its_end_enclose_what_needs_them() {
    let found = in_space(small::CELLAR, small::FUSES, |_, space| {
        classical_plan(space, MemoryLimit::new(None, None), 1000, Default::default(), &|| false)
    });
    let (steps, _, _) = found.expect("the classical search finds a plan");
    let parts: Vec<Part> = steps.iter().map(|step| step.part).collect();
    assert_eq!(parts, [Part::Start, Part::Whole, Part::Whole, Part::End]);
    assert_eq!(steps[0].act, steps[3].act);
}

#[test]
fn what_excludes_what_is_known_of_actions_in_one_go() {
    // While somebody is on the way, a place is neither clear nor somebody's: no transition alone says that it is one of both.
    let domain = "(define (domain tiles) (:requirements :typing :durative-actions) (:types robot tile)
      (:predicates (at ?r - robot ?t - tile) (clear ?t - tile))
      (:durative-action go :parameters (?r - robot ?a ?b - tile) :duration (= ?duration 1)
        :condition (and (at start (at ?r ?a)) (at start (clear ?b)))
        :effect (and (at start (not (at ?r ?a))) (at start (not (clear ?b)))
                     (at end (at ?r ?b)) (at end (clear ?a)))))";
    let problem = "(define (problem p) (:domain tiles) (:objects r s - robot a b c - tile)
      (:init (at r a) (at s b) (clear c)) (:goal (at r b)))";
    let together = in_space(domain, problem, |task, space| {
        let (compressed, _) = compressed(space)?;
        let said = |fact: &GroundFact| small::fact(task, &compressed, *fact);
        let groups = compressed.mutex_groups.iter();
        let groups = groups.map(|group| group.iter().map(said).collect::<Vec<_>>().join(" "));
        Some(groups.collect::<Vec<_>>())
    });
    let expected = ["a", "c", "b"].map(|tile| format!("(at r {tile}) (at s {tile}) (clear {tile})"));
    assert_eq!(together.expect("nothing forbids it"), expected);
}
