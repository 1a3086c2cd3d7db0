//! Tests of `looking::change`.

use descry_domains::looking::change::*;
use descry_perception::nalgebra::{Point3, Vector3};

#[test]
fn what_was_seen_of_a_changed_place_or_through_it_is_void() {
    let foot = Point3::new(1.0, 0.0, 0.7);
    let change = Change { stamp_ns: 0, foot, up: Vector3::z(), radius_m: 0.3, height_m: 0.2 };
    let eye = Point3::new(0.0, 0.0, 1.4);
    for (to, crossed, what) in [
        ((1.0, 0.0, 0.8), true, "within"),
        ((2.0, 0.0, 0.3), true, "through it to the floor behind"),
        ((1.0, 0.0, 0.7), true, "the table under it"),
        ((1.0, 0.5, 0.7), false, "the table beside it"),
        ((3.0, 0.0, 1.3), false, "over it"),
        ((0.5, 0.0, 0.9), false, "before it"),
        ((-1.0, 0.0, 0.7), false, "away from it"),
    ] {
        assert_eq!(change.is_crossed(&eye, &Point3::new(to.0, to.1, to.2)), crossed, "{what}");
    }
}
