//! The body in the simulated room: a round base with a pan-tilt head that carries a Kinect, and an arm with a hand.

use crate::body::{Description, Footprint, Frames, Head, Speeds};
use crate::sim::laser::Laser;
use descry_perception::Intrinsics;
use nalgebra::{Point3, Vector3};

/// Kept between the footprint and what the map shows, metres: about two standard deviations of localisation.
pub const SAFETY_M: f64 = 0.05;
/// How far from the base's origin the arm reaches, metres.
pub const REACH_M: f64 = 1.8;
/// The widest thing that the hand takes, metres.
pub const HAND_OPENING_M: f64 = 0.12;
/// How fast the head turns.
pub const HEAD_SPEED_RAD_S: f64 = 1.0;

const FIELD_OF_VIEW_DEG: (f64, f64) = (57.0, 43.0);
const IMAGE: (usize, usize) = (640, 480);
const CAMERA_HEIGHT_M: f64 = 1.4;

/// The camera of the published set-up: 640x480, 57° x 43°.
pub fn camera() -> Intrinsics {
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

/// What the simulated body is.
pub fn description() -> Description {
    Description {
        name: "simulated tabletop robot".into(),
        simulated: true,
        footprint: Footprint::Disc { radius_m: 0.25 },
        speeds: Speeds { linear_m_s: 0.4, angular_rad_s: 0.8 },
        camera: camera(),
        range_m: (0.45, 5.0),
        head: Some(Head {
            base_from_head: Point3::new(0.0, 0.0, CAMERA_HEIGHT_M),
            pan_limit_rad: 2.6,
            tilt_down_rad: 1.2,
            tilt_up_rad: 0.8,
        }),
        frames: Frames::default(),
        reach_m: Some(REACH_M),
        hand_opening_m: Some(HAND_OPENING_M),
        laser: Some(Laser::default().part()),
        up: Some(Vector3::z()),
        pose_sigma_m: 0.03,
        pose_sigma_rad: 2f64.to_radians(),
    }
}
