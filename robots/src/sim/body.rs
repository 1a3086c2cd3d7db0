//! The body in the simulated room: a round base with a pan-tilt head that carries a Kinect, and an arm with a hand.

use crate::parts::{Arm, Base, Camera, Description, Footprint, Frames, Gripper, Head, Speeds};
use crate::sim::laser::LaserModel;
use descry_perception::Intrinsics;
use nalgebra::{Point3, Vector3};

/// Head of the simulated body.
pub const HEAD: Head = Head {
    base_from_head: Point3::new(0.0, 0.0, CAMERA_HEIGHT_M),
    pan_limit_rad: 2.6,
    tilt_down_rad: 1.2,
    tilt_up_rad: 0.8,
};
/// Clearance between the footprint and mapped obstacles, metres: about two standard deviations of
/// localisation.
pub const SAFETY_M: f64 = 0.05;
/// Reach of the arm from the base's origin, metres.
pub const REACH_M: f64 = 1.8;
/// Maximum width of a graspable object, metres.
pub const HAND_OPENING_M: f64 = 0.12;
/// Radius of the round base, metres.
pub const RADIUS_M: f64 = 0.25;
/// Speeds of the base.
pub const SPEEDS: Speeds = Speeds { linear_m_s: 0.4, angular_rad_s: 0.8 };
/// Turning speed of the head, radians a second.
pub const HEAD_SPEED_RAD_S: f64 = 1.0;

const FIELD_OF_VIEW_DEG: (f64, f64) = (57.0, 43.0);
const IMAGE: (usize, usize) = (640, 480);
const CAMERA_HEIGHT_M: f64 = 1.4;

/// Intrinsics of the camera in the published set-up: 640x480 pixels, 57° x 43°.
pub fn intrinsics() -> Intrinsics {
    let (width, height) = IMAGE;
    let focal = |pixels: usize, field_deg: f64| 0.5 * pixels as f64 / (0.5 * field_deg.to_radians()).tan();
    Intrinsics {
        width,
        height,
        fx: focal(width, FIELD_OF_VIEW_DEG.0),
        fy: focal(height, FIELD_OF_VIEW_DEG.1),
        cx: 0.5 * (width as f64 - 1.0),
        cy: 0.5 * (height as f64 - 1.0),
    }
}

/// Description of the camera, with its range.
pub fn camera() -> Camera {
    Camera {
        frame: "camera".into(),
        intrinsics: intrinsics(),
        range_m: (0.45, 5.0),
        colour: true,
        latency_s: 0.0,
    }
}

/// Description of the simulated body.
pub fn description() -> Description {
    Description {
        name: "simulated tabletop robot".into(),
        simulated: true,
        base: Some(Base { footprint: Footprint::Disc { radius_m: RADIUS_M }, speeds: SPEEDS }),
        head: Some(HEAD),
        arm: Some(Arm { reach_m: REACH_M, hand: Some(Gripper { opening_m: HAND_OPENING_M }) }),
        camera: Some(camera()),
        laser: Some(LaserModel::default().part()),
        senses: Vec::new(),
        frames: Frames::default(),
        up: Some(Vector3::z()),
        pose_sigma_m: 0.03,
        pose_sigma_rad: 2f64.to_radians(),
    }
}
