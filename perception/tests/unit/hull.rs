//! Tests of `hull`.

use descry_perception::hull::*;
use descry_perception::plane::Plane;
use nalgebra::{Point2, Point3, Vector3};
use proptest::prelude::*;

fn square() -> Hull {
    let plane = Plane { normal: Vector3::z(), offset_m: 0.7 };
    let points: Vec<Point3<f32>> =
        (0..121).map(|i| Point3::new((i % 11) as f32 * 0.1, (i / 11) as f32 * 0.1, 0.7)).collect();
    Hull::around(plane, &points).unwrap()
}

#[test]
fn a_square_metre() {
    let hull = square();
    assert_eq!(hull.corners.len(), 4);
    assert!((hull.area_m2() - 1.0).abs() < 1e-6 && (hull.perimeter_m() - 4.0).abs() < 1e-6);
    assert!((hull.lift(&hull.centre()) - Point3::new(0.5, 0.5, 0.7)).norm() < 1e-6);
    assert!(hull.contains(&Point3::new(0.5, 0.5, 9.0), 0.0));
    assert!(!hull.contains(&Point3::new(1.05, 0.5, 0.7), 0.0));
    assert!(hull.contains(&Point3::new(1.05, 0.5, 0.7), 0.06));
    assert!(!hull.contains(&Point3::new(0.95, 0.5, 0.7), -0.06));
}

#[test]
fn points_on_a_line_and_in_one_place() {
    let plane = Plane { normal: Vector3::z(), offset_m: 0.0 };
    let line: Vec<Point3<f32>> = (0..5).map(|i| Point3::new(i as f32, 0.0, 0.0)).collect();
    let hull = Hull::around(plane, &line).unwrap();
    assert_eq!((hull.corners.len(), hull.area_m2()), (2, 0.0));
    assert!(
        hull.contains(&Point3::new(2.0, 0.0, 0.0), 1e-9) && !hull.contains(&Point3::new(2.0, 0.1, 0.0), 1e-9)
    );
    assert!((hull.lift(&hull.centre()) - Point3::new(2.0, 0.0, 0.0)).norm() < 1e-6);
    let place = Hull::around(plane, &[Point3::origin(); 3]).unwrap();
    assert_eq!((place.corners.len(), place.area_m2()), (1, 0.0));
    assert!(Hull::around(plane, &[]).is_none());
}

proptest! {
    #[test]
    fn holds_every_point(points in proptest::collection::vec((-1.0f64..1.0, -1.0f64..1.0), 1..60)) {
        let points: Vec<Point2<f64>> = points.into_iter().map(|(x, y)| Point2::new(x, y)).collect();
        let corners = convex(points.clone());
        for i in 0..corners.len() {
            let (a, b) = (corners[i], corners[(i + 1) % corners.len()]);
            prop_assert!(points.iter().all(|p| (b - a).perp(&(p - a)) > -1e-12));
        }
    }
}
