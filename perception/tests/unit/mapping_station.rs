//! Tests of `mapping::station`.

use descry_perception::cloud::Cloud;
use descry_perception::mapping::station::*;
use descry_perception::view::View;
use nalgebra::Translation3;
use nalgebra::{Isometry3, Point3, UnitQuaternion, Vector3};

#[test]
fn a_view_is_levelled() {
    // Looks along +y, tilted down by 0.3, 1.5 m up.
    let down = UnitQuaternion::from_axis_angle(&Vector3::x_axis(), -0.3 - std::f64::consts::FRAC_PI_2);
    let mut view =
        View::alone(Cloud::from_points(vec![Point3::new(0.0, 0.0, 2.0), Point3::new(f32::NAN, 0.0, 1.0)]));
    view.world_from_camera = Isometry3::from_parts(Translation3::new(3.0, 1.0, 1.5), down);
    let station = Station::of(&view).unwrap();
    assert!((station.odom_from_level.rotation.angle() - std::f64::consts::FRAC_PI_2).abs() < 1e-9);
    let expected = Point3::new(2.0 * 0.3_f32.cos(), 0.0, 1.5 - 2.0 * 0.3_f32.sin());
    assert_eq!(station.points.len(), 1);
    assert!((station.points[0] - expected).norm() < 1e-5, "{:?}", station.points);
    view.world_from_camera = Isometry3::identity();
    assert_eq!(Station::of(&view), Err(StationError::Upright));
    view.world_from_camera = Translation3::new(f64::NAN, 0.0, 0.0).into();
    assert_eq!(Station::of(&view), Err(StationError::Pose));
}
