//! Motion of the simulated base: its estimated pose follows the route, and its true pose deviates from that.

use crate::body::Pose2;
use crate::parts::Speeds;
use crate::route::{Route, turn};
use nalgebra::{Isometry3, Point2, Translation3, UnitQuaternion, Vector3};
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};

/// Length of the steps of a straight drive, metres; the base can be stopped between two.
const STEP_M: f64 = 0.05;

/// One step of a drive: a turn on the spot, or a part of a straight line.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DriveStep {
    /// Estimated pose of the base after the step.
    pub pose: Pose2,
    /// Duration of the step, seconds.
    pub seconds: f64,
    /// Distance driven in the step, metres.
    pub metres: f64,
}

/// Steps of a route: for each line a turn on the spot, then parts of the line; finally a turn to the goal's
/// heading. Their durations add up to that of the route.
pub fn steps(from: &Pose2, route: &Route, goal: &Pose2, speeds: &Speeds) -> Vec<DriveStep> {
    let mut steps = Vec::new();
    let mut heading_rad = from.yaw_rad;
    let turn_to = |at: &Point2<f64>, from_rad: f64, to_rad: f64, steps: &mut Vec<DriveStep>| {
        let seconds = turn(from_rad, to_rad) / speeds.angular_rad_s;
        if seconds > 0.0 {
            steps.push(DriveStep { pose: Pose2::new(at.x, at.y, to_rad), seconds, metres: 0.0 });
        }
    };
    for line in route.points_m.windows(2) {
        let along = line[1] - line[0];
        let length_m = along.norm();
        if length_m <= 0.0 {
            continue;
        }
        let line_rad = along.y.atan2(along.x);
        turn_to(&line[0], heading_rad, line_rad, &mut steps);
        heading_rad = line_rad;
        let count = (length_m / STEP_M).ceil().max(1.0);
        for k in 1..=count as usize {
            let at = line[0] + along * (k as f64 / count);
            steps.push(DriveStep {
                pose: Pose2::new(at.x, at.y, heading_rad),
                seconds: length_m / count / speeds.linear_m_s,
                metres: length_m / count,
            });
        }
    }
    turn_to(&goal.point(), heading_rad, goal.yaw_rad, &mut steps);
    steps
}

/// Accuracy of localisation and of stopping.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Localisation {
    /// Standard deviation of the estimate along x and y, metres.
    pub sigma_m: f64,
    /// Standard deviation of the estimated heading, radians.
    pub sigma_rad: f64,
    /// Standard deviation of the stopping position relative to the goal, along x and y, metres. The estimated
    /// pose includes this deviation.
    pub stop_sigma_m: f64,
    /// Standard deviation of the heading at a stop, radians.
    pub stop_sigma_rad: f64,
}

impl Default for Localisation {
    /// 3 cm and 2°, as in the published set-up.
    fn default() -> Self {
        Localisation {
            sigma_m: 0.03,
            sigma_rad: 2f64.to_radians(),
            stop_sigma_m: 0.01,
            stop_sigma_rad: 0.5f64.to_radians(),
        }
    }
}

impl Localisation {
    /// Draws the estimated pose at a stop, around the intended one.
    pub fn stop(&self, wanted: &Pose2, rng: &mut ChaCha8Rng) -> Pose2 {
        Pose2::new(
            wanted.x_m + self.stop_sigma_m * normal(rng),
            wanted.y_m + self.stop_sigma_m * normal(rng),
            wanted.yaw_rad + self.stop_sigma_rad * normal(rng),
        )
    }

    /// Draws the error of localisation at a stop, as `estimate_from_truth`. The error is constant while the
    /// base stands, so that repeated queries do not average it out.
    pub fn error(&self, rng: &mut ChaCha8Rng) -> Isometry3<f64> {
        shift(self.sigma_m * normal(rng), self.sigma_m * normal(rng), self.sigma_rad * normal(rng))
    }

    /// Draws the error of a failed localisation, as `estimate_from_truth`: 10 cm and 6° in random directions.
    pub fn bad_error(rng: &mut ChaCha8Rng) -> Isometry3<f64> {
        let direction: f64 = std::f64::consts::TAU * rand::Rng::random::<f64>(rng);
        let sign = if rand::Rng::random::<bool>(rng) { 1.0 } else { -1.0 };
        shift(0.1 * direction.cos(), 0.1 * direction.sin(), sign * 6f64.to_radians())
    }
}

/// A standard normal number.
pub(crate) fn normal(rng: &mut ChaCha8Rng) -> f64 {
    StandardNormal.sample(rng)
}

fn shift(x_m: f64, y_m: f64, yaw_rad: f64) -> Isometry3<f64> {
    Isometry3::from_parts(
        Translation3::new(x_m, y_m, 0.0),
        UnitQuaternion::from_axis_angle(&Vector3::z_axis(), yaw_rad),
    )
}
