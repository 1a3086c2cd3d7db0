//! Registration of two consecutive stations of a drive (section 3).
//!
//! Both plans are cut to the part that both fields of view cover. In the paper they share one centroid, about which
//! ICP-EM finds the rotation: each point of one plan corresponds to each of the other's with a probability (Eq. 3),
//! computed anew after each rotation. The translation is the one near odometry with the least error. Points without a
//! match are outliers, as likely as points at three standard deviations. Odometry counts as a measurement, so that it
//! determines the position along a bare corridor, where the plans do not.
//!
//! A wrong heading shifts what is ahead sideways, about the camera and not about a centroid. [`Matcher::IcpEm`]
//! therefore searches the best heading first and then estimates rotation and translation jointly.

use super::error::{MappingError, check, check_pose};
use super::likelihood_field::{Field, OUTLIERS, REACH};
use super::station::{FieldOfView, Spot, Station, shared};
use crate::pool;
use crate::register::{self, Method, Prepared, RegisterOptions};
use nalgebra::{Isometry2, Isometry3, Matrix3, Point2, Point3, Rotation2, UnitComplex, Vector2, Vector3};
use std::ops::RangeInclusive;

/// Method for matching two plans.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Matcher {
    /// Odometry alone.
    Odometry,
    /// Iterative closest point (Besl and McKay 1992) on all points of the height band: the paper's baseline.
    Icp,
    /// Iterative closest point on the jointly visible plan points.
    IcpShared,
    /// The paper's method: EM over all correspondences, with rotation about a common centroid, then translation near
    /// odometry.
    IcpEmSplit,
    /// EM with rotation and translation estimated jointly, from the best heading.
    #[default]
    IcpEm,
}

/// Options for rectifying a drive.
#[derive(Clone, Debug, PartialEq)]
pub struct RectifyOptions {
    /// Method for matching consecutive plans.
    pub matcher: Matcher,
    /// Height band of the points used, between floor and ceiling, metres.
    pub band_m: RangeInclusive<f64>,
    /// The camera's field of view.
    pub field: FieldOfView,
    /// Cell size for thinning the plan, metres.
    pub thin_m: f64,
    /// Standard deviation of plan points around their partners in the first and the last iteration, metres.
    pub sigma_m: (f64, f64),
    /// Standard deviation of odometry's shift per step: a share of the step's length, and an absolute part in metres.
    pub way_sigma: (f64, f64),
    /// Standard deviation of odometry's rotation per step, radians.
    pub turn_sigma_rad: f64,
    /// Minimum share of the second plan that must match the first for a result of [`Matcher::IcpEm`] to be accepted;
    /// otherwise odometry is used.
    pub explained: f64,
    /// Number of independent points that a whole plan counts for, because errors of neighbouring points are correlated.
    pub looks: f64,
}

impl Default for RectifyOptions {
    fn default() -> Self {
        RectifyOptions {
            matcher: Matcher::IcpEm,
            band_m: 0.2..=2.2,
            field: FieldOfView::default(),
            thin_m: 0.05,
            sigma_m: (0.25, 0.05),
            way_sigma: (0.05, 0.01),
            turn_sigma_rad: 0.035,
            explained: 0.5,
            looks: 100.0,
        }
    }
}

impl RectifyOptions {
    /// Checks that all options are within their ranges.
    ///
    /// # Errors
    /// Names the first option out of range.
    pub fn check(&self) -> Result<(), MappingError> {
        check(&[
            ("the nearest depth of the field of view (m)", self.field.near_m, 0.0, 1e3),
            ("the farthest depth of the field of view (m)", self.field.far_m, 1e-3, 1e3),
            ("thin_m", self.thin_m, 1e-3, 10.0),
            ("the first of sigma_m", self.sigma_m.0, 1e-3, 10.0),
            ("the second of sigma_m", self.sigma_m.1, 1e-2, 10.0),
            ("the first of way_sigma", self.way_sigma.0, 0.0, 10.0),
            ("the second of way_sigma (m)", self.way_sigma.1, 1e-6, 1e3),
            ("turn_sigma_rad", self.turn_sigma_rad, 1e-6, 10.0),
            ("looks", self.looks, 1e-3, 1e9),
        ])
    }
}

/// Pose of the second of two stations in the frame of the first, with its information.
#[derive(Clone, Debug, PartialEq)]
pub struct PairFit {
    /// Estimated pose of the second station in the frame of the first, metres.
    pub before_from_after: Isometry2<f64>,
    /// Share of the second plan's jointly visible points that match the first plan.
    pub explained: f64,
    /// Numbers of jointly visible plan points, of the first and of the second plan.
    pub shared: (usize, usize),
    /// Inverse covariance of the pose: shift in the frame of the first station (metres), and rotation about the
    /// second's origin (radians).
    pub information: Matrix3<f64>,
}

/// Minimum number of jointly visible points of each plan; with fewer, odometry is used.
const FEWEST: usize = 12;
/// Number of EM iterations at each standard deviation.
const EXPECTATIONS: usize = 3;
/// Number of final alternations between the translation search and joint EM.
const ROUNDS: usize = 2;
/// Step of the heading search, radians.
const HEADING_STEP_RAD: f64 = 0.01;
/// Maximum standard deviation of the likelihood field of the heading search, metres.
const HEADING_SIGMA_M: f64 = 0.12;
/// Factor from one standard deviation to the next (annealing).
const COOLING: f64 = 0.7;
/// Coarse and fine step of the translation search, metres.
const STEPS_M: [f64; 2] = [0.03, 0.006];
/// Search range of the translation, in standard deviations of odometry.
const WINDOW: f64 = 3.0;
/// Maximum distance of an accepted fit from odometry, in standard deviations.
const STRAYED: f64 = 4.0;
/// Steps for the numerical curvature of the cost at the result: metres, radians.
const PROBE: (f64, f64) = (0.03, 0.015);

/// Estimates the relative pose of two consecutive stations.
///
/// # Errors
/// If an option or an odometry pose is out of range.
pub fn rectify_pair(
    before: &Station,
    after: &Station,
    options: &RectifyOptions,
) -> Result<PairFit, MappingError> {
    options.check()?;
    check_pose("station", 0, &before.odom_from_level)?;
    check_pose("station", 1, &after.odom_from_level)?;
    Ok(step(before, after, options))
}

/// Estimates the relative pose of each two consecutive stations of a drive: one fewer than stations.
///
/// # Errors
/// If an option or an odometry pose is out of range.
pub fn rectify_drive(stations: &[Station], options: &RectifyOptions) -> Result<Vec<PairFit>, MappingError> {
    let _span = tracing::debug_span!("rectify", stations = stations.len()).entered();
    options.check()?;
    stations.iter().enumerate().try_for_each(|(i, s)| check_pose("station", i, &s.odom_from_level))?;
    Ok(pool::each(stations.len().saturating_sub(1), 1, |n| step(&stations[n], &stations[n + 1], options)))
}

fn step(before: &Station, after: &Station, options: &RectifyOptions) -> PairFit {
    let plan = |s: &Station| s.plan(&options.band_m, &options.field, options.thin_m);
    let odometry = before.odom_from_level.inv_mul(&after.odom_from_level);
    fit(&plan(before), &plan(after), &odometry, options)
}

/// Station poses in the frame of the first station, chained from pairwise fits.
pub fn chained(pairs: &[PairFit]) -> Vec<Isometry2<f64>> {
    let mut poses = vec![Isometry2::identity()];
    for pair in pairs {
        let mut next = poses[poses.len() - 1] * pair.before_from_after;
        next.rotation.renormalize();
        poses.push(next);
    }
    poses
}

/// Registers the plan of one station to that of another, starting from odometry.
fn fit(before: &[Spot], after: &[Spot], odometry: &Isometry2<f64>, options: &RectifyOptions) -> PairFit {
    let seen = shared(before, &odometry.inverse(), &options.field);
    let moved = shared(after, odometry, &options.field);
    if options.matcher == Matcher::Icp {
        fit_cut(before, after, odometry, options)
    } else {
        fit_cut(&seen, &moved, odometry, options)
    }
}

/// Registers two plans already cut to their common field of view; `moved` is the second one.
pub(super) fn fit_cut(
    seen: &[Spot],
    moved: &[Spot],
    odometry: &Isometry2<f64>,
    options: &RectifyOptions,
) -> PairFit {
    let shared = (seen.len(), moved.len());
    let prior = Prior::of(odometry, options);
    let field = Field::of(seen, options.sigma_m.1);
    let (Some(field), true) = (field, shared.0 >= FEWEST && shared.1 >= FEWEST) else {
        return PairFit {
            before_from_after: *odometry,
            explained: 0.0,
            shared,
            information: prior.information(),
        };
    };
    let problem = Problem::of(seen, moved, &field, &prior, options);
    let pose = match options.matcher {
        Matcher::Odometry => *odometry,
        Matcher::Icp | Matcher::IcpShared => icp(seen, moved, odometry, options),
        Matcher::IcpEmSplit => problem.split(),
        Matcher::IcpEm => problem.joint(),
    };
    let explained = field.explained(moved, &pose);
    let kept = explained >= options.explained && prior.cost(&pose) < 0.5 * STRAYED * STRAYED;
    if options.matcher == Matcher::IcpEm && !kept {
        return PairFit { before_from_after: *odometry, explained, shared, information: prior.information() };
    }
    PairFit { before_from_after: pose, explained, shared, information: problem.information(&pose) }
}

/// Prior of a step by odometry.
pub(super) struct Prior {
    pose: Isometry2<f64>,
    way_sigma_m: f64,
    turn_sigma_rad: f64,
}

impl Prior {
    pub fn of(odometry: &Isometry2<f64>, options: &RectifyOptions) -> Prior {
        let (share, least_m) = options.way_sigma;
        let way_sigma_m = share * odometry.translation.vector.norm() + least_m;
        Prior { pose: *odometry, way_sigma_m, turn_sigma_rad: options.turn_sigma_rad }
    }

    pub fn information(&self) -> Matrix3<f64> {
        let way = self.way_sigma_m.powi(-2);
        Matrix3::from_diagonal(&Vector3::new(way, way, self.turn_sigma_rad.powi(-2)))
    }

    /// Half the squared Mahalanobis distance of a pose from odometry.
    fn cost(&self, pose: &Isometry2<f64>) -> f64 {
        let way = (pose.translation.vector - self.pose.translation.vector).norm() / self.way_sigma_m;
        let turn = self.pose.rotation.angle_to(&pose.rotation) / self.turn_sigma_rad;
        0.5 * (way * way + turn * turn)
    }
}

struct Problem<'a> {
    /// Plan points of the first station, sorted by x.
    before: Vec<Spot>,
    after: &'a [Spot],
    field: &'a Field,
    prior: &'a Prior,
    options: &'a RectifyOptions,
    /// Common centroid of both plans, in the frame of the first station.
    centroid: Point2<f64>,
    /// Density of outliers, in the units of the plan points' weights.
    outliers: f64,
}

impl<'a> Problem<'a> {
    fn of(
        before: &[Spot],
        after: &'a [Spot],
        field: &'a Field,
        prior: &'a Prior,
        options: &'a RectifyOptions,
    ) -> Problem<'a> {
        let mut before = before.to_vec();
        before.sort_by(|a, b| a.at.x.total_cmp(&b.at.x).then(a.at.y.total_cmp(&b.at.y)));
        let put = after.iter().map(|s| (prior.pose * s.at, s.weight));
        let all = before.iter().map(|s| (s.at, s.weight)).chain(put);
        let (sum, weight) =
            all.fold((Vector2::zeros(), 0.0), |(s, w), (p, weight)| (s + p.coords * weight, w + weight));
        let usual = before.iter().map(|s| s.weight).sum::<f64>() / before.len() as f64;
        Problem {
            before,
            after,
            field,
            prior,
            options,
            centroid: (sum / weight).into(),
            outliers: OUTLIERS * usual,
        }
    }

    /// Pose from the paper's method: rotation first, then translation (section 3).
    fn split(&self) -> Isometry2<f64> {
        let turned = self.annealed(self.prior.pose, |pose, sigma_m| self.turned(pose, sigma_m));
        // The rotation is applied to the plan as it was, which turns about the camera.
        self.shifted(&Isometry2::from_parts(self.prior.pose.translation, turned.rotation))
    }

    /// Pose from joint EM of rotation and translation, starting at the best heading.
    fn joint(&self) -> Isometry2<f64> {
        let mut pose = self.annealed(self.headed(), |pose, sigma_m| self.moved(pose, sigma_m));
        for _ in 0..ROUNDS {
            pose = self.shifted(&pose);
            pose = (0..EXPECTATIONS).fold(pose, |pose, _| self.moved(&pose, self.options.sigma_m.1));
        }
        pose
    }

    /// Pose after EM steps at ever smaller standard deviations.
    fn annealed(
        &self,
        start: Isometry2<f64>,
        step: impl Fn(&Isometry2<f64>, f64) -> Isometry2<f64>,
    ) -> Isometry2<f64> {
        let (first_m, last_m) = self.options.sigma_m;
        let (mut pose, mut sigma_m) = (start, first_m.max(last_m));
        loop {
            pose = (0..EXPECTATIONS).fold(pose, |pose, _| step(&pose, sigma_m));
            if sigma_m <= last_m {
                return pose;
            }
            sigma_m = (sigma_m * COOLING).max(last_m);
        }
    }

    /// Odometry's pose with the heading nearby at which the plans match best, on a coarse grid.
    fn headed(&self) -> Isometry2<f64> {
        let start = self.prior.pose;
        let Some(field) = Field::of(&self.before, self.options.sigma_m.0.min(HEADING_SIGMA_M)) else {
            return start;
        };
        let steps = (WINDOW * self.prior.turn_sigma_rad / HEADING_STEP_RAD).ceil() as i32;
        let headings = (-steps..=steps).map(|i| {
            let turn = UnitComplex::new(start.rotation.angle() + f64::from(i) * HEADING_STEP_RAD);
            let pose = Isometry2::from_parts(start.translation, turn);
            (self.prior.cost(&pose) - self.options.looks * field.mean(self.after, &pose), pose)
        });
        headings.min_by(|a, b| a.0.total_cmp(&b.0)).map_or(start, |best| best.1)
    }

    /// Calls `found` with the probability and position of each possible partner, in the first plan, of a point of the
    /// second (z of Eq. 3).
    fn expected(&self, at: &Point2<f64>, sigma_m: f64, mut found: impl FnMut(f64, &Point2<f64>)) {
        let (reach_m, per) = (REACH * sigma_m, 0.5 / (sigma_m * sigma_m));
        let from = self.before.partition_point(|b| b.at.x < at.x - reach_m);
        let to = from + self.before[from..].partition_point(|b| b.at.x <= at.x + reach_m);
        let density = |b: &Spot| {
            let apart = (b.at - at).norm_squared();
            if apart < reach_m * reach_m { b.weight * (-apart * per).exp() } else { 0.0 }
        };
        let sum = self.outliers + self.before[from..to].iter().map(density).sum::<f64>();
        for b in &self.before[from..to] {
            let z = density(b) / sum;
            if z > 0.0 {
                found(z, &b.at);
            }
        }
    }

    /// Factor on the weights of the second plan's points, so that the whole plan counts as `looks` independent points.
    fn worth(&self, sigma_m: f64) -> f64 {
        let all: f64 = self.after.iter().map(|s| s.weight).sum();
        self.options.looks / (all * sigma_m * sigma_m)
    }

    /// Pose after one EM iteration of the rotation about the centroid (Eq. 3).
    fn turned(&self, pose: &Isometry2<f64>, sigma_m: f64) -> Isometry2<f64> {
        let (mut along, mut across) = (0.0, 0.0);
        for spot in self.after {
            let at = pose * spot.at;
            let arm = at - self.centroid;
            self.expected(&at, sigma_m, |z, partner| {
                let partner = partner - self.centroid;
                along += spot.weight * z * arm.dot(&partner);
                across += spot.weight * z * arm.perp(&partner);
            });
        }
        let (worth, prior) = (self.worth(sigma_m), self.prior.turn_sigma_rad.powi(-2));
        let off = self.prior.pose.rotation.angle_to(&pose.rotation);
        let turn = (worth * across - prior * off) / (worth * along.max(0.0) + prior);
        self.about_centroid(pose, turn.clamp(-0.2, 0.2))
    }

    /// Pose after one EM iteration of rotation and translation.
    fn moved(&self, pose: &Isometry2<f64>, sigma_m: f64) -> Isometry2<f64> {
        let worth = self.worth(sigma_m);
        let prior = self.prior.information();
        let shift = pose.translation.vector - self.prior.pose.translation.vector;
        let mut normal = prior;
        let mut right = -prior * shift.push(self.prior.pose.rotation.angle_to(&pose.rotation));
        for spot in self.after {
            let at = pose * spot.at;
            let arm = at.coords - pose.translation.vector;
            let (mut all, mut pull) = (0.0, Vector2::zeros());
            self.expected(&at, sigma_m, |z, partner| {
                all += z;
                pull += (partner - at) * z;
            });
            let (all, pull) = (worth * spot.weight * all, pull * (worth * spot.weight));
            let side = Vector2::new(-arm.y, arm.x);
            right += pull.push(side.dot(&pull));
            normal[(0, 0)] += all;
            normal[(1, 1)] += all;
            for k in 0..2 {
                normal[(k, 2)] += all * side[k];
                normal[(2, k)] += all * side[k];
            }
            normal[(2, 2)] += all * side.norm_squared();
        }
        let Some(by) = normal.cholesky().map(|c| c.solve(&right)) else { return *pose };
        let turn = UnitComplex::new(pose.rotation.angle() + by.z.clamp(-0.2, 0.2));
        Isometry2::from_parts((pose.translation.vector + by.xy()).into(), turn)
    }

    fn about_centroid(&self, pose: &Isometry2<f64>, turn: f64) -> Isometry2<f64> {
        let shift =
            Rotation2::new(turn) * (pose.translation.vector - self.centroid.coords) + self.centroid.coords;
        Isometry2::from_parts(shift.into(), UnitComplex::new(pose.rotation.angle() + turn))
    }

    /// Pose with the translation of least cost near odometry, by grid search; the rotation is kept.
    fn shifted(&self, pose: &Isometry2<f64>) -> Isometry2<f64> {
        let at = |shift: Vector2<f64>| Isometry2::from_parts(shift.into(), pose.rotation);
        let mut best = (self.cost(pose), pose.translation.vector);
        let mut middle = self.prior.pose.translation.vector;
        let mut window_m = WINDOW * self.prior.way_sigma_m;
        for step_m in STEPS_M {
            let steps = (window_m / step_m).ceil().min(40.0) as i32;
            for (i, j) in (-steps..=steps).flat_map(|i| (-steps..=steps).map(move |j| (i, j))) {
                let shift = middle + Vector2::new(f64::from(i), f64::from(j)) * step_m;
                let cost = self.cost(&at(shift));
                if cost < best.0 {
                    best = (cost, shift);
                }
            }
            middle = best.1;
            window_m = step_m;
        }
        at(best.1)
    }

    fn cost(&self, pose: &Isometry2<f64>) -> f64 {
        self.prior.cost(pose) - self.options.looks * self.field.mean(self.after, pose)
    }

    /// Curvature of the matching cost at a pose plus the information of odometry.
    fn information(&self, pose: &Isometry2<f64>) -> Matrix3<f64> {
        let cost = |by: Vector3<f64>| {
            let at = Isometry2::new(pose.translation.vector + by.xy(), pose.rotation.angle() + by.z);
            -self.options.looks * self.field.mean(self.after, &at)
        };
        let step = |i: usize| {
            let size = if i < 2 { PROBE.0 } else { PROBE.1 };
            Vector3::from_fn(|k, _| if k == i { size } else { 0.0 })
        };
        let here = cost(Vector3::zeros());
        let curvature = Matrix3::from_fn(|i, j| {
            let (a, b) = (step(i), step(j));
            let bent = if i == j {
                cost(a) + cost(-a) - 2.0 * here
            } else {
                0.25 * (cost(a + b) + cost(-a - b) - cost(a - b) - cost(b - a))
            };
            bent / (a[i] * b[j])
        });
        let eigen = (0.5 * (curvature + curvature.transpose())).symmetric_eigen();
        let held = Matrix3::from_diagonal(&eigen.eigenvalues.map(|v| v.max(0.0)));
        eigen.eigenvectors * held * eigen.eigenvectors.transpose() + self.prior.information()
    }
}

/// Pose from iterative closest point, started at odometry; odometry's pose if that fails.
fn icp(
    before: &[Spot],
    after: &[Spot],
    odometry: &Isometry2<f64>,
    options: &RectifyOptions,
) -> Isometry2<f64> {
    let flat = |spots: &[Spot]| -> Vec<Point3<f32>> {
        spots.iter().map(|s| Point3::new(s.at.x as f32, s.at.y as f32, 0.0)).collect()
    };
    let turn = UnitComplex::from(odometry.rotation);
    let start = Isometry3::new(odometry.translation.vector.push(0.0), Vector3::z() * turn.angle());
    let options = RegisterOptions {
        method: Method::PointToPoint,
        start_target_from_source: start,
        within_m: (2.0 * options.sigma_m.0) as f32,
        ..RegisterOptions::default()
    };
    let prepared = |spots: &[Spot]| Prepared::new(&flat(spots)).ok();
    let fit = prepared(after).zip(prepared(before)).and_then(|(s, t)| register::align(&s, &t, &options).ok());
    fit.map_or(*odometry, |f| {
        let pose = f.target_from_source;
        let ahead = pose.rotation * Vector3::x();
        Isometry2::new(pose.translation.vector.xy(), ahead.y.atan2(ahead.x))
    })
}
