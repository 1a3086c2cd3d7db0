//! Consistency of looks with the map: tests camera and poses against their stated values, and finds
//! the fault that explains the looks better.
//!
//! Each look predicts what the map has of a level surface: its height, its tilt, and where it ends. One error model covers camera and
//! poses; every look adds its own small pose error under the stated spread. A fault is named where it explains the looks far better
//! than the statement does, and leaves nothing unexplained.

mod fit;
mod sight;

use crate::view::View;
use fit::Fit;
use nalgebra::{Isometry3, Point2, Point3, Translation3, UnitQuaternion, Vector2, Vector3};
use serde::{Deserialize, Serialize};
use sight::Sight;
use std::fmt;

/// Misfit above which a look contradicts the stated values regardless of any explanation: more than
/// five standard deviations of a stated quantity. From: chosen, five times what honest simulated
/// recordings reach.
const MISFIT: f64 = 30.0;
/// Maximum misfit of a single look, so that one gross pose error cannot suggest a common fault.
/// From: chosen.
const MOST_MISFIT: f64 = 150.0;
/// Minimum number of looks for a common fault; in a single look, a wrong pose looks the same.
/// From: derived.
const FEWEST: usize = 2;
/// Prior probability of a camera or pose fault; the kinds of faults share it. From: chosen.
const PRIOR: f64 = 0.02;
/// Number of kinds of faults. From: derived, those that can be named.
const KINDS: f64 = 7.0;
/// Standard deviations of calibration errors, if there is one: logarithms of depth scale and focal length, and principal
/// point, pixels. From: chosen, half of the largest errors that uncalibrated depth cameras show.
const CALIBRATION_SIGMA: f64 = 0.05;
const PRINCIPAL_SIGMA_PX: f64 = 16.0;
/// Factors between units of length that are confused: metres, decimetres, millimetres and inches. From: derived.
const UNITS: [f64; 8] = [10.0, 0.1, 100.0, 0.01, 1000.0, 0.001, 1.0 / INCH_M, INCH_M];
/// Length of an inch, metres. From: derived, by definition.
const INCH_M: f64 = 0.0254;
/// Maximum displacement that aligning a surface with its outline corrects, in standard deviations
/// of the stated pose. From: chosen, as far as views are laid on an outline.
const MENDED: f64 = 4.0;

/// A level surface that the map states, in a map whose z axis points up.
#[derive(Clone, Debug, PartialEq)]
pub struct MapSurface {
    /// Corners of the convex outline in order, metres.
    pub outline_m: Vec<Point2<f64>>,
    /// Height of the surface, metres.
    pub height_m: f64,
}

/// A fault of the camera or of the poses, common to all looks.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Fault {
    /// Measured depth is the true depth times this factor.
    DepthScale(f64),
    /// The stated focal length is the true one times this factor.
    FocalLength(f64),
    /// Offset of the stated from the true principal point, pixels.
    PrincipalPoint(Vector2<f64>),
    /// Columns run from right to left.
    Mirrored,
    /// Poses are shifted in time by a number of frames: each look has the pose of so many frames
    /// before (after, if negative).
    Late(i64),
    /// All stated poses are displaced by a common shift in the map, metres, and rotation about the
    /// surface's centre, radians.
    Displaced(Vector2<f64>, f64),
    /// No single fault of camera or poses explains the looks.
    Unexplained,
}

impl Fault {
    /// Number of parameters of the fault.
    fn numbers(&self) -> usize {
        match self {
            Fault::DepthScale(_) | Fault::FocalLength(_) => 1,
            Fault::PrincipalPoint(_) => 2,
            Fault::Displaced(..) => 3,
            Fault::Mirrored | Fault::Late(_) | Fault::Unexplained => 0,
        }
    }
}

impl fmt::Display for Fault {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let percent = |times: f64| 100.0 * (times - 1.0).abs();
        match self {
            Fault::DepthScale(times) if is_unit(*times) => {
                let (times, way) = if *times > 1.0 { (*times, "long") } else { (1.0 / times, "short") };
                write!(f, "depth reads {times:.0} times too {way}, as in another unit of length")
            }
            Fault::DepthScale(times) => {
                let way = if *times > 1.0 { "long" } else { "short" };
                write!(f, "depth reads {:.0} % too {way}", percent(*times))
            }
            Fault::FocalLength(times) => {
                let way = if *times > 1.0 { "long" } else { "short" };
                write!(f, "the focal length is stated {:.0} % too {way}", percent(*times))
            }
            Fault::PrincipalPoint(by) => {
                write!(f, "the principal point is stated {:.0} pixels beside the true one", by.norm())
            }
            Fault::Mirrored => write!(f, "images are mirrored"),
            Fault::Late(1) => write!(f, "poses are one frame late"),
            Fault::Late(-1) => write!(f, "poses are one frame early"),
            Fault::Late(n) if *n > 0 => write!(f, "poses are {n} frames late"),
            Fault::Late(n) => write!(f, "poses are {} frames early", -n),
            Fault::Displaced(shift, turn) => {
                write!(
                    f,
                    "all stated poses are {:.0} cm and {:.0}° off",
                    100.0 * shift.norm(),
                    turn.to_degrees().abs()
                )
            }
            Fault::Unexplained => {
                write!(f, "no single fault of the camera or of the poses explains what the looks show")
            }
        }
    }
}

/// A contradiction between looks and map.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Inconsistency {
    /// The likeliest fault.
    pub fault: Fault,
    /// Probability of the fault.
    pub probability: f64,
    /// Displacement that the fault causes for objects on the surface, metres.
    pub spread_m: f64,
}

/// Evidence of looks at a mapped surface for and against camera and poses as stated.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Consistency {
    /// Contradiction; `None` if a fault is not likelier than the stated values.
    pub inconsistency: Option<Inconsistency>,
    /// Probability that camera or poses have a fault that laying the surface on its outline does not correct.
    pub doubt: f64,
    /// Standard deviation of places on the surface by errors of calibration that the looks allow, metres.
    pub spread_m: f64,
}

/// Poses of the looks where poses are late by a number of frames; `None` where the frame is unknown.
pub type Late = (i64, Vec<Option<Isometry3<f64>>>);

/// Weighs the faults of camera and poses that may explain why looks at a mapped surface disagree with the map.
///
/// Each look is a view and its stated pose. `asked` is the number of the surface in `map`. `neighbours` has the poses that the looks
/// would have, were poses late.
pub fn judge(
    looks: &[(&View, Isometry3<f64>)],
    map: &[MapSurface],
    asked: usize,
    neighbours: &[Late],
) -> Consistency {
    let Some(surface) = map.get(asked) else { return Consistency::default() };
    let seen = |(n, (view, pose)): (usize, &(&View, Isometry3<f64>))| {
        Some((n, Sight::of(view, pose, surface, 1.0)?))
    };
    let (at, sights): (Vec<usize>, Vec<Sight>) = looks.iter().enumerate().filter_map(seen).unzip();
    let fit = Fit::new(&sights, map, asked);
    let misfits: Vec<f64> = (0..sights.len()).map(|n| fit.misfit(n, &Model::default())).collect();
    let wrong = misfits.iter().filter(|misfit| **misfit > MISFIT).count();
    if wrong == sights.len()
        && let Some(inconsistency) = other_unit(looks, map, asked)
    {
        return Consistency {
            inconsistency: Some(inconsistency),
            doubt: inconsistency.probability,
            spread_m: 0.0,
        };
    }
    let late = neighbours.iter().map(|(frames, poses)| Model {
        poses: Some(at.iter().map(|&n| poses[n]).collect()),
        ..Model::of(Fault::Late(*frames))
    });
    let (spread_m, explained) = explanations(&fit, &sights, &misfits, late.collect());
    // A displacement leaves what is seen as it is, but for its place.
    let displaced = |e: &&Explanation| matches!(e.model.fault, Fault::Displaced(..));
    let most = explained.iter().map(|e| e.log_odds).fold(0.0, f64::max);
    let share = |e: &Explanation| (e.log_odds - most).exp();
    let all = (-most).exp() + explained.iter().map(share).sum::<f64>();
    let doubt = explained.iter().filter(|e| !displaced(e)).map(share).sum::<f64>() / all;
    let likeliest = explained.iter().max_by(|a, b| a.log_odds.total_cmp(&b.log_odds));
    let named =
        likeliest.filter(|e| sights.len() >= FEWEST && !e.model.is_mended(&sights) && e.log_odds > 0.0);
    let is_gross = 2 * wrong >= sights.len() && wrong > 0;
    let inconsistency = match named {
        Some(e) => {
            let left = (0..sights.len()).filter(|&n| fit.misfit(n, &e.model) > MISFIT).count();
            let fault = if 2 * left >= sights.len() { Fault::Unexplained } else { e.model.fault };
            let spread_m = fit.displacement_m(&e.model, false);
            Some(Inconsistency { fault, probability: 1.0 - (-most).exp() / all, spread_m })
        }
        None if is_gross => Some(Inconsistency {
            fault: Fault::Unexplained,
            probability: 1.0 - PRIOR,
            spread_m: surface.radius_m(),
        }),
        None => None,
    };
    let is_unexplained = inconsistency.is_some_and(|found| found.fault == Fault::Unexplained);
    Consistency { inconsistency, doubt: if is_unexplained { 1.0 - PRIOR } else { doubt }, spread_m }
}

/// Unit of length by which most looks show the surface where the map has it, if they do not in metres.
fn other_unit(looks: &[(&View, Isometry3<f64>)], map: &[MapSurface], asked: usize) -> Option<Inconsistency> {
    let agreeing = |times: f64| {
        let sights: Vec<Sight> =
            looks.iter().filter_map(|(view, pose)| Sight::of(view, pose, &map[asked], times)).collect();
        let fit = Fit::new(&sights, map, asked);
        (0..sights.len()).filter(|&n| fit.misfit(n, &Model::default()) < MISFIT).count()
    };
    let counts = UNITS.map(agreeing);
    let best = (0..UNITS.len()).max_by_key(|&n| counts[n])?;
    (2 * counts[best] > looks.len()).then_some(Inconsistency {
        fault: Fault::DepthScale(UNITS[best]),
        probability: 1.0 - PRIOR,
        spread_m: map[asked].radius_m(),
    })
}

/// True if a factor on depth is that between units of length rather than an error of calibration.
fn is_unit(times: f64) -> bool {
    times.ln().abs() > 2f64.ln()
}

/// A fault with its logarithmic odds against the stated values.
#[derive(Debug)]
struct Explanation {
    model: Model,
    log_odds: f64,
}

/// Standard deviation of places by calibration errors that the looks allow, metres, and the faults that may explain the looks.
fn explanations(
    fit: &Fit<'_>,
    sights: &[Sight],
    stated: &[f64],
    late: Vec<Model>,
) -> (f64, Vec<Explanation>) {
    let before = total(stated);
    let misfit = |model: &Model| {
        // Where a model has no pose for a look, it explains nothing of the look.
        let of_look = |n: usize| if model.knows(n) { fit.misfit(n, model) } else { stated[n] };
        total(&(0..sights.len()).map(of_look).collect::<Vec<_>>())
    };
    let prior = (PRIOR / KINDS).ln();
    let mut found: Vec<Explanation> = Vec::new();
    // With less, no fault could be likelier than the statement.
    let is_promising = before > 2.0 * (1.0 / PRIOR).ln();
    if is_promising {
        for model in late.into_iter().chain([Model::of(Fault::Mirrored)]) {
            let log_odds = prior + (before - misfit(&model)) / 2.0;
            found.push(Explanation { model, log_odds });
        }
    }
    let mut spread_m: f64 = 0.0;
    for family in Family::ALL {
        let mut best = (before, [0.0; 3]);
        if is_promising {
            best = family.search(before, &mut |fault| misfit(&Model::of(fault)));
        }
        let sigmas = family.sigmas();
        if sigmas.is_empty() {
            let model = Model::of(family.fault(&best.1));
            let log_odds = prior + (before - best.0) / 2.0 - model.fault.numbers() as f64;
            found.push(Explanation { model, log_odds });
            continue;
        }
        let (of_family_m, explanation) = laplace(fit, family, best, &misfit, before);
        spread_m = spread_m.max(of_family_m);
        found.push(explanation);
    }
    (spread_m, found)
}

/// Laplace approximation of a family of calibration errors about the numbers of minimum misfit (MacKay 2003, chapter 28): the
/// standard deviation of places that it allows, metres, and its odds.
fn laplace(
    fit: &Fit<'_>,
    family: Family,
    (least, at): (f64, [f64; 3]),
    misfit: &impl Fn(&Model) -> f64,
    before: f64,
) -> (f64, Explanation) {
    let prior = (PRIOR / KINDS).ln();
    let (mut numbers, mut log_odds, mut square_m2) = (at, prior + (before - least) / 2.0, 0.0);
    for (axis, sigma) in family.sigmas().iter().enumerate() {
        let moved = |by: f64| {
            let mut next = at;
            next[axis] += by;
            Model::of(family.fault(&next))
        };
        let (low, high) = (misfit(&moved(-1.0)), misfit(&moved(1.0)));
        let curvature = ((low + high) / 2.0 - least).max(0.0);
        let weight = curvature + sigma.powi(-2);
        let to_mode = ((low - high) / 4.0 - at[axis] * sigma.powi(-2)) / weight;
        let step = to_mode.clamp(-1.0, 1.0);
        numbers[axis] += step;
        log_odds += (weight * step * (2.0 * to_mode - step) - (at[axis] / sigma).powi(2)) / 2.0;
        log_odds -= (sigma * weight.sqrt()).ln();
        let mut alone = [0.0; 3];
        alone[axis] = 1.0;
        let a_step_m = fit.displacement_m(&Model::of(family.fault(&alone)), true);
        square_m2 += a_step_m.powi(2) * (numbers[axis].powi(2) + 1.0 / weight);
    }
    (square_m2.sqrt(), Explanation { model: Model::of(family.fault(&numbers)), log_odds })
}

/// Misfit of all looks together.
fn total(misfits: &[f64]) -> f64 {
    misfits.iter().map(|misfit| misfit.min(MOST_MISFIT)).sum()
}

impl MapSurface {
    /// Mean of the corners, at the surface's height.
    fn centre(&self) -> Point3<f64> {
        let sum = self.outline_m.iter().fold(Vector2::zeros(), |sum, p| sum + p.coords);
        let mean = sum / self.outline_m.len().max(1) as f64;
        Point3::new(mean.x, mean.y, self.height_m)
    }

    /// Maximum distance of a corner from the centre, metres.
    fn radius_m(&self) -> f64 {
        let centre = self.centre().xy();
        self.outline_m.iter().map(|p| (p - centre).norm()).fold(0.0, f64::max)
    }
}

/// Camera and poses under one fault.
#[derive(Clone, Debug)]
struct Model {
    fault: Fault,
    /// Poses of the sights, if they differ from the stated ones.
    poses: Option<Vec<Option<Isometry3<f64>>>>,
}

impl Default for Model {
    fn default() -> Model {
        Model::of(Fault::DepthScale(1.0))
    }
}

impl Model {
    fn of(fault: Fault) -> Model {
        Model { fault, poses: None }
    }

    /// True if the model has a pose for a sight.
    fn knows(&self, n: usize) -> bool {
        self.poses.as_ref().is_none_or(|poses| poses[n].is_some())
    }

    /// True if aligning the outline of the surface corrects the fault: a displacement within the stated
    /// localisation error.
    fn is_mended(&self, sights: &[Sight]) -> bool {
        let Fault::Displaced(shift, turn) = self.fault else { return false };
        sights.iter().all(|s| shift.norm() < MENDED * s.sigma_m && turn.abs() < MENDED * s.sigma_rad)
    }

    /// True position in the optical frame of the point measured at `p`.
    fn point(&self, sight: &Sight, p: &Vector3<f64>) -> Vector3<f64> {
        let camera = &sight.camera;
        match self.fault {
            Fault::DepthScale(times) => p / times,
            Fault::FocalLength(times) => Vector3::new(p.x * times, p.y * times, p.z),
            Fault::PrincipalPoint(by) => {
                Vector3::new(p.x + by.x / camera.fx * p.z, p.y + by.y / camera.fy * p.z, p.z)
            }
            Fault::Mirrored => {
                let ends = (camera.width as f64 - 1.0 - 2.0 * camera.cx) / camera.fx;
                Vector3::new(ends * p.z - p.x, p.y, p.z)
            }
            Fault::Late(_) | Fault::Displaced(..) | Fault::Unexplained => *p,
        }
    }

    /// The true pose of a sight.
    fn pose(&self, sights: &[Sight], n: usize, centre: &Point3<f64>) -> Isometry3<f64> {
        let stated = self.poses.as_ref().and_then(|poses| poses[n]).unwrap_or(sights[n].world_from_camera);
        match self.fault {
            Fault::Displaced(shift, turn) => {
                let about = Translation3::from(centre.coords);
                let turned = UnitQuaternion::from_axis_angle(&Vector3::z_axis(), -turn);
                let back = Translation3::new(-shift.x, -shift.y, 0.0);
                about * turned * about.inverse() * back * stated
            }
            _ => stated,
        }
    }
}

/// Step of the logarithm of a factor, and of the principal point, pixels. From: work.
const LOG_STEP: f64 = 0.02;
const STEP_PX: f64 = 8.0;

/// Family of faults with free parameters.
#[derive(Clone, Copy, Debug)]
enum Family {
    DepthScale,
    FocalLength,
    PrincipalPoint,
    Displaced,
}

impl Family {
    const ALL: [Family; 4] =
        [Family::DepthScale, Family::FocalLength, Family::PrincipalPoint, Family::Displaced];

    /// Standard deviations of the numbers, in steps, of a calibration error; none for poses.
    fn sigmas(self) -> &'static [f64] {
        match self {
            Family::DepthScale | Family::FocalLength => &[CALIBRATION_SIGMA / LOG_STEP],
            Family::PrincipalPoint => &[PRINCIPAL_SIGMA_PX / STEP_PX; 2],
            Family::Displaced => &[],
        }
    }

    /// The fault of some numbers; `x` counts steps.
    fn fault(self, x: &[f64; 3]) -> Fault {
        match self {
            Family::DepthScale => Fault::DepthScale((LOG_STEP * x[0]).exp()),
            Family::FocalLength => Fault::FocalLength((LOG_STEP * x[0]).exp()),
            Family::PrincipalPoint => Fault::PrincipalPoint(STEP_PX * Vector2::new(x[0], x[1])),
            Family::Displaced => Fault::Displaced(0.05 * Vector2::new(x[0], x[1]), 0.05 * x[2]),
        }
    }

    /// Pattern search (Hooke and Jeeves 1961) for the minimum misfit, starting from the stated
    /// values; abandoned if no first step removes a good part of the misfit.
    fn search(self, before: f64, misfit: &mut impl FnMut(Fault) -> f64) -> (f64, [f64; 3]) {
        /// Maximum number of evaluations. From: work.
        const EVALUATIONS: usize = 60;
        /// Maximum share of the misfit that a first step may leave for the search to go on. From: chosen.
        const PROMISING: f64 = 0.8;
        let mut at = [0.0; 3];
        let numbers = self.fault(&at).numbers();
        let (mut least, mut step, mut left) = (before, 2.0, EVALUATIONS);
        while step > 0.1 && left > 0 {
            let start = least;
            for axis in 0..numbers {
                for way in [step, -step] {
                    let mut next = at;
                    next[axis] += way;
                    let found = misfit(self.fault(&next));
                    left = left.saturating_sub(1);
                    if found < least {
                        (at, least) = (next, found);
                        break;
                    }
                }
            }
            if step < 1.0 && least > PROMISING * before {
                break;
            }
            if least == start {
                step /= 2.0;
            }
        }
        (least, at)
    }
}
