//! Kinematics of the head that turns the camera: pan about the base's z, then tilt.

use crate::parts::Head;
use nalgebra::{Isometry3, Matrix3, Point3, Rotation3, Translation3, UnitQuaternion, Vector3};

/// Direction of the head, in the base frame.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Gaze {
    /// Pan angle, counter-clockwise from the base's x, radians.
    pub pan_rad: f64,
    /// Tilt angle, downwards from horizontal, radians.
    pub tilt_rad: f64,
}

/// Returns the gaze towards a point in the base frame, within the head's limits, and the remaining angle
/// between the line of sight and the point, radians.
pub fn aim(head: &Head, base_point: &Point3<f64>) -> (Gaze, f64) {
    let line = base_point - head.base_from_head;
    if line.norm() < 1e-9 {
        return (Gaze::default(), 0.0);
    }
    let wanted = Gaze { pan_rad: line.y.atan2(line.x), tilt_rad: (-line.z).atan2(line.x.hypot(line.y)) };
    let gaze = Gaze {
        pan_rad: wanted.pan_rad.clamp(-head.pan_limit_rad, head.pan_limit_rad),
        tilt_rad: wanted.tilt_rad.clamp(-head.tilt_up_rad, head.tilt_down_rad),
    };
    let miss_rad = if gaze == wanted { 0.0 } else { sight(&gaze).angle(&line) };
    (gaze, miss_rad)
}

/// Direction of the line of sight, a unit vector in the base frame.
fn sight(gaze: &Gaze) -> Vector3<f64> {
    let level = gaze.tilt_rad.cos();
    Vector3::new(level * gaze.pan_rad.cos(), level * gaze.pan_rad.sin(), -gaze.tilt_rad.sin())
}

/// Pose of the camera's optical frame (x right, y down, z forward) in the base frame.
pub fn base_from_camera(head: &Head, gaze: &Gaze) -> Isometry3<f64> {
    let forward = sight(gaze);
    let right = Vector3::new(gaze.pan_rad.sin(), -gaze.pan_rad.cos(), 0.0);
    let down = forward.cross(&right);
    let axes = Rotation3::from_matrix_unchecked(Matrix3::from_columns(&[right, down, forward]));
    Isometry3::from_parts(
        Translation3::from(head.base_from_head.coords),
        UnitQuaternion::from_rotation_matrix(&axes),
    )
}

/// Pose of the camera in the map, with the base at `map_from_base` and the head turned towards `look_at`, a
/// point in the map; straight ahead and horizontal if `None`.
pub fn camera_towards(
    head: &Head,
    map_from_base: &Isometry3<f64>,
    look_at: Option<&Point3<f64>>,
) -> Isometry3<f64> {
    let gaze = look_at.map_or(Gaze::default(), |p| aim(head, &map_from_base.inverse_transform_point(p)).0);
    map_from_base * base_from_camera(head, &gaze)
}
