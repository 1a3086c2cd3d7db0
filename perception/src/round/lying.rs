//! Round body lying on its side: axis parallel to the surface.

use super::{NO_CIRCLE, Round, SEED, side_band};
use crate::outline::Rectangle;
use crate::quantile::{POINT_ENDS, end};
use crate::scale::{APART_M, PLACE_M};
use nalgebra::{Isometry3, Matrix3, Point3, Rotation3, Translation3, UnitQuaternion, Vector3};

/// Turns of the trial axes from the sides of the bounding rectangle seen from above, radians. From: chosen.
const TURNS: [f64; 3] = [0.0, 0.1, -0.1];
/// Maximum number of points for the search of the axis direction. From: chosen.
const SCOUTS: usize = 300;

/// A round body about an axis along the surface.
#[derive(Clone, Copy)]
pub struct LyingRound {
    /// Transform from the surface's frame to the body's: z along the axis, y away from the surface.
    pub turned: Isometry3<f64>,
    /// Body about an axis along z, body frame.
    pub round: Round,
    /// Positions of the body's two ends along z, metres.
    pub ends_m: [f64; 2],
}

impl LyingRound {
    /// Body with its other end down.
    pub fn over(&self) -> LyingRound {
        let over = UnitQuaternion::from_axis_angle(&Vector3::y_axis(), std::f64::consts::PI);
        let LyingRound { turned, round, ends_m: [foot, rim] } = *self;
        let round = Round { x: -round.x, slope: -round.slope, middle_m: -round.middle_m, ..round };
        LyingRound { turned: over * turned, round, ends_m: [-rim, -foot] }
    }
}

/// Lying round body fitted to points.
pub(crate) struct Found {
    pub body: LyingRound,
    /// Points in the body's frame, metres.
    pub points: Vec<Point3<f64>>,
    /// Direction of the axis along the surface, radians from x.
    angle: f64,
    /// Mean squared distance of the points from the side, each clamped, square metres.
    miss_m2: f64,
}

/// Fits a round body about an axis along the surface; `None` if none rests there.
///
/// `bounds`: rectangle around the points seen from above; `base_m`: height of the support;
/// `sigma_m`: standard deviation of a measurement, metres.
pub(crate) fn fit(points: &[Point3<f64>], bounds: &Rectangle, base_m: f64, sigma_m: f64) -> Option<Found> {
    let few: Vec<Point3<f64>> =
        points.iter().step_by(points.len().div_ceil(SCOUTS).max(1)).copied().collect();
    let sides = [0.0, std::f64::consts::FRAC_PI_2];
    let angle = bounds.turn.0.atan2(bounds.turn.1);
    let angles = sides.into_iter().flat_map(|side| TURNS.map(|by| angle + side + by));
    let origin = Translation3::new(-bounds.x, -bounds.y, -base_m);
    let best = |a: &Found, b: &Found| a.miss_m2.total_cmp(&b.miss_m2);
    let scouted = angles.filter_map(|angle| about(&few, &origin, (angle, 0.0), sigma_m)).min_by(best)?;
    let found = about(points, &origin, (scouted.angle, 0.0), sigma_m)?;
    // What narrows rests on its side: its axis rises towards the wider end.
    let rise = found.body.round.slope.atan();
    let risen = about(points, &origin, (found.angle, rise), sigma_m);
    [Some(found), risen].into_iter().flatten().min_by(best)
}

/// Fits a body of revolution about an axis of given direction and elevation; `None` unless it rests
/// on the support.
fn about(
    points: &[Point3<f64>],
    origin: &Translation3<f64>,
    (angle, rise): (f64, f64),
    sigma_m: f64,
) -> Option<Found> {
    let (sin, cos) = angle.sin_cos();
    let (up, level) = rise.sin_cos();
    let along = Vector3::new(level * cos, level * sin, up);
    let across = Vector3::new(-sin, cos, 0.0);
    let rows = Matrix3::from_rows(&[across.transpose(), along.cross(&across).transpose(), along.transpose()]);
    let turned = UnitQuaternion::from_rotation_matrix(&Rotation3::from_matrix_unchecked(rows)) * origin;
    let points: Vec<Point3<f64>> = points.iter().map(|p| turned * p).collect();
    let places: Vec<f64> = points.iter().map(|p| p.z).collect();
    let ends_m = [end(&places, POINT_ENDS.0), end(&places, POINT_ENDS.1)];
    let round = super::fit(&points, ends_m[0], ends_m[1], sigma_m, SEED)?;
    // It rests on its side, about a circle that is one to go by.
    let rests = (round.y - round.radius_m).abs() < PLACE_M + sigma_m;
    let is_told = round.radius_sigma_m < APART_M && round.inliers >= NO_CIRCLE;
    let band = side_band(ends_m[0], ends_m[1]);
    let misses = points.iter().filter(|p| band.contains(&p.z)).map(|p| round.outside_m(p).abs().min(PLACE_M));
    let (count, squares) = misses.fold((0.0, 0.0), |(n, sum), miss| (n + 1.0, sum + miss * miss));
    let miss_m2 = squares / f64::max(count, 1.0);
    (rests && is_told).then_some(Found { body: LyingRound { turned, round, ends_m }, points, angle, miss_m2 })
}
