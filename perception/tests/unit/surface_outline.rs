//! Tests of `surface::outline`.

use descry_perception::surface::Surface;
use descry_perception::surface::outline::*;
use nalgebra::{Isometry3, Unit};
use nalgebra::{Point3, Vector3};
use proptest::prelude::*;

proptest! {
    #[test]
    fn rows_tell_what_the_edges_tell(
        corners in prop::collection::vec((-0.7..0.7_f64, -0.4..0.4_f64), 0..12),
        places in prop::collection::vec((-0.9..0.9_f64, -0.6..0.6_f64), 1..400),
        turn in prop::array::uniform3(-3.0..3.0_f64),
    ) {
        let hull = descry_perception::polygon::convex_hull(corners.iter().map(|c| [c.0, c.1]).collect());
        let world_from_surface = Isometry3::new(Vector3::new(0.3, -0.2, 0.7), Vector3::from(turn));
        let surface = Surface {
            up: Unit::new_normalize(world_from_surface * Vector3::z()),
            offset_m: 0.0,
            hull: hull.iter().map(|c| world_from_surface * Point3::new(c[0], c[1], 0.0)).collect(),
            area_m2: 0.0,
            points: 0,
            share: 0.0,
            residual_m: 0.0,
            surface_from_world: world_from_surface.inverse(),
            role: descry_perception::surface::Role::Support,
            because: descry_perception::surface::Sign::Asked,
            above_floor_m: None,
            up_chance: 1.0,
            over: Vec::new(),
        };
        let (rows, outline) = (Rows::of(&surface), surface.outline());
        for (x, y) in places {
            let flat = Point3::new(x, y, 0.1);
            let place = world_from_surface * flat;
            prop_assert_eq!(rows.covers(&flat, &place), outline.covers(&place, 0.0), "{} {}", x, y);
        }
    }
}
