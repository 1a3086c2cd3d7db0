//! Tests of `abilities::learning::again`.

use descry_domains::abilities::learning::again::*;
use descry_memory::learned::LearnedThing;
use descry_memory::learned::Place;
use descry_perception::Cloud;
use descry_perception::nalgebra::Point3;
use descry_perception::recognise::Percept;
use descry_perception::recognise::{Evidence, Stance};

/// A thing 20 cm long of which so much was seen, and an object that looks have not told.
fn chance(sides: f64, views: usize, height_m: f64) -> f64 {
    let cloud = Cloud::from_points(vec![Point3::origin(), Point3::new(0.0, 0.0, 0.2)]);
    let seen = Place { unix_s: 0.0, at_m: Point3::origin(), on: "table".into() };
    let (name, learned_unix_s) = ("lamp".into(), 0.0);
    let thing = LearnedThing { name, learned_unix_s, cloud, sides, directions: 0, meetings: 1, seen };
    let percept = Percept {
        label: None,
        kind: None,
        probabilities: Vec::new(),
        kinds: Vec::new(),
        unknown: 1.0,
        colours: Vec::new(),
        position_m: Point3::origin(),
        position_sigma_m: 0.001,
        size_m: [0.05, 0.05, height_m],
        stance: Stance::Upright,
        points: 100,
        seen_fraction: 0.9,
        evidence: Evidence { views, ..Evidence::default() },
        indices: Vec::new(),
    };
    missed(&percept, &thing, None)
}

#[test]
fn looks_tell_less_of_what_was_seen_from_few_sides() {
    // Three looks exclude what is known from all sides, and hardly what is known from a fifth of them.
    assert!(chance(1.0, 3, 0.2) < 0.03 && chance(0.2, 3, 0.2) > 0.15);
    // What is longer than it is not it, unless its model may lack a part.
    assert_eq!(chance(1.0, 0, 0.3), NOT_IT);
    assert!(chance(0.2, 0, 0.3) > 0.25);
}
