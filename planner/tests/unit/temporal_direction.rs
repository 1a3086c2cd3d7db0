//! Tests of `temporal::direction`.

use descry_planner::attachment::{Answer, Attachments};
use descry_planner::calls::Calls;
use descry_planner::ground::GroundOutcome;
use descry_planner::temporal::direction::may_help;
use descry_planner::temporal::world::World;

use super::small;

#[test]
fn what_drains_by_an_answer_helps_no_lower_bound() {
    let domain = |effect: &str| {
        format!(
            "(define (domain d) (:requirements :durative-actions :fluents :modules) (:predicates (done))
               (:modules (far cost far@x)) (:functions (charge) (other))
               (:durative-action go :parameters () :duration (= ?duration 2)
                 :condition (at start (>= (charge) (* 0.5 [far]))) :effect (and (at end (done)) (at end {effect}))))"
        )
    };
    let problem = "(define (problem p) (:domain d) (:init (= (charge) 9) (= (other) 0)) (:goal (done)))";
    let mut attachments = Attachments::new();
    attachments.insert("far", |_: &descry_planner::Call| Ok(Answer::Number(3.0)));
    for (effect, helps) in [
        ("(decrease (charge) (* 0.5 [far]))", false),
        ("(decrease (charge) (+ 1 [far]))", false),
        ("(decrease (charge) 2)", false),
        ("(decrease (charge) (- 2 [far]))", true),
        ("(increase (charge) (* 0.5 [far]))", true),
        ("(assign (charge) [far])", true),
        ("(increase (other) 1)", false),
    ] {
        let (task, grounded) = small::read(&domain(effect), problem);
        let calls = Calls::bind(&task, &grounded, &attachments).expect("it has an answer");
        let world = World::new(&task, &grounded, calls);
        let outcomes: Vec<&GroundOutcome> =
            world.acts[0].end_effects.iter().map(|effect| &effect.outcome).collect();
        assert_eq!(may_help(&world, &outcomes, 0), helps, "{effect}");
    }
}
