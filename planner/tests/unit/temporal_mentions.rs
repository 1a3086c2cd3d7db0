//! Tests of `temporal::mentions`.

use super::small;
use descry_planner::attachment::Attachments;
use descry_planner::calls::Calls;
use descry_planner::temporal::advance::TemporalStep;
use descry_planner::temporal::envelope::all_apart;
use descry_planner::temporal::mentions::*;
use descry_planner::temporal::space::Measure;
use descry_planner::temporal::space::Space;
use descry_planner::temporal::world::World;

#[test]
fn of_a_long_plan_less_is_done_once_asked_to_stop() {
    let domain = "(define (domain d) (:requirements :numeric-fluents) (:predicates (p)) (:functions (n))
      (:action more :parameters () :precondition (>= (n) 0) :effect (and (p) (increase (n) 1))))";
    let problem = "(define (problem p) (:domain d) (:init (= (n) 0)) (:goal (and (p) (> (n) 0))))";
    let (task, grounded) = small::read(domain, problem);
    let nobody = Attachments::default();
    let calls = Calls::bind(&task, &grounded, &nobody).expect("nothing to bind");
    let world = World::new(&task, &grounded, calls);
    let space = Space::new(&world, all_apart(&world), Measure::Makespan);
    for (count, stopped) in [(1, false), (100, false), (2_000, true)] {
        let mut steps = vec![TemporalStep::whole(0); count];
        let replayed = space.replay_to_goal(&mut steps, &|| true).expect("no call");
        assert_eq!(replayed.is_none(), stopped, "{count}");
        let mut track = space.track(&steps).expect("it fits");
        assert_eq!(
            keep_apart(&space, &steps, &mut track, &|| true).is_ok_and(|all| !all),
            stopped,
            "{count}"
        );
    }
}
