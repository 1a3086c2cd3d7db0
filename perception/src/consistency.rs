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
/// Share of the statement's misfit that a named fault may leave. From: chosen.
const LEFT_SHARE: f64 = 0.35;
/// Minimum number of looks for a common fault; in a single look, a wrong pose looks the same.
/// From: derived.
const FEWEST: usize = 2;
/// Prior probability of a camera or pose fault. From: chosen.
const PRIOR: f64 = 0.02;
/// Probability of a fault below which the looks count as honest. From: chosen.
const NEGLIGIBLE: f64 = 0.02;
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

impl Inconsistency {
    /// True if the fault is likelier than the statement.
    pub fn is_likely(&self) -> bool {
        self.probability > 0.5
    }
}

/// Finds the fault that explains why looks at a mapped surface disagree with the map; `None` if
/// they agree, or show too little of the surface.
///
/// Each look is a view and its stated pose. `asked` is the number of the surface in `map`. `neighbours` has, for each number of frames by
/// which poses may be late, the poses that the looks would have.
pub fn judge(
    looks: &[(&View, Isometry3<f64>)],
    map: &[MapSurface],
    asked: usize,
    neighbours: &[(i64, Vec<Isometry3<f64>>)],
) -> Option<Inconsistency> {
    let surface = map.get(asked)?;
    let seen = |(view, pose): &(&View, Isometry3<f64>)| Sight::of(view, pose, surface);
    let (at, sights): (Vec<usize>, Vec<Sight>) =
        looks.iter().enumerate().filter_map(|(n, look)| Some((n, seen(look)?))).unzip();
    let fit = Fit::new(&sights, map, asked);
    let stated = Model::default();
    let misfits: Vec<f64> = (0..sights.len()).map(|n| fit.misfit(n, &stated)).collect();
    let before = total(&misfits);
    // With less, no fault could be likelier than the statement.
    if before < 2.0 * (1.0 / PRIOR).ln() {
        return None;
    }
    let (left, model) = likeliest(&fit, &sights, before, || {
        neighbours.iter().map(|(frames, poses)| Model {
            poses: Some(at.iter().map(|&n| poses[n]).collect()),
            ..Model::of(Fault::Late(*frames))
        })
    });
    let wrong = misfits.iter().filter(|misfit| **misfit > MISFIT).count();
    let is_named = left < LEFT_SHARE * before && !model.is_mended(&sights);
    if is_named {
        let odds = PRIOR * ((before - left) / 2.0 - model.fault.numbers() as f64).exp();
        let (probability, spread_m) = (odds / (1.0 + odds), fit.displacement_m(&model));
        return (probability > NEGLIGIBLE).then_some(Inconsistency {
            fault: model.fault,
            probability,
            spread_m,
        });
    }
    let spread_m = surface.radius_m();
    (2 * wrong >= sights.len()).then_some(Inconsistency {
        fault: Fault::Unexplained,
        probability: 1.0 - NEGLIGIBLE,
        spread_m,
    })
}

/// Fault with the minimum misfit; the stated values if none is better.
fn likeliest<M: Iterator<Item = Model>>(
    fit: &Fit<'_>,
    sights: &[Sight],
    before: f64,
    late: impl Fn() -> M,
) -> (f64, Model) {
    let mut best = (before, Model::default());
    if sights.len() < FEWEST {
        return best;
    }
    let mut misfit = |model: Model| {
        let misfit = total(&(0..sights.len()).map(|n| fit.misfit(n, &model)).collect::<Vec<_>>());
        if misfit < best.0 {
            best = (misfit, model);
        }
        misfit
    };
    late().chain([Model::of(Fault::Mirrored)]).for_each(|model| {
        misfit(model);
    });
    for family in Family::ALL {
        family.search(before, &mut |fault| misfit(Model::of(fault)));
    }
    best
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
    poses: Option<Vec<Isometry3<f64>>>,
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
        let stated = self.poses.as_ref().map_or(sights[n].world_from_camera, |poses| poses[n]);
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

    /// The fault of some numbers; `x` counts steps.
    fn fault(self, x: &[f64; 3]) -> Fault {
        match self {
            Family::DepthScale => Fault::DepthScale((0.02 * x[0]).exp()),
            Family::FocalLength => Fault::FocalLength((0.02 * x[0]).exp()),
            Family::PrincipalPoint => Fault::PrincipalPoint(8.0 * Vector2::new(x[0], x[1])),
            Family::Displaced => Fault::Displaced(0.05 * Vector2::new(x[0], x[1]), 0.05 * x[2]),
        }
    }

    /// Pattern search (Hooke and Jeeves 1961) for the minimum misfit, starting from the stated
    /// values; abandoned if no first step removes a good part of the misfit.
    fn search(self, before: f64, misfit: &mut impl FnMut(Fault) -> f64) {
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
                return;
            }
            if least == start {
                step /= 2.0;
            }
        }
    }
}
