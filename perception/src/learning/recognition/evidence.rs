//! Evidence for a model at a pose: the camera ray of each model point ends at the point, in front
//! of it, or behind it.

use super::scene::SceneView;
use super::surfels::{Surfels, across};
use crate::noise::frontal_sigma_m;
use nalgebra::{Isometry3, Point3, Vector3};
use serde::{Deserialize, Serialize};

/// Evidence for a model at a pose.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct PoseEvidence {
    /// Number of model points facing the camera, plus back-facing points that no learned point hides: these stand for a
    /// visible side that was never learned.
    pub facing: usize,
    /// Number of these points near a measured surface of similar normal.
    pub explained: usize,
    /// Number of facing points that the camera saw through.
    pub through: usize,
    /// Number of points without information: occluded, without return, outside the image, or
    /// back-facing.
    pub hidden: usize,
    /// Colour similarity of explained points, 1 (equal) to 0; `None` if model or scene has no
    /// colour.
    pub colour: Option<f64>,
    /// Mean distance along the ray at explained points, in standard deviations of the camera.
    pub off_sigmas: f64,
    /// Mean angle between model and scene normals at explained points, radians.
    pub turned_rad: f64,
    /// Share of border positions just beyond the model where the scene surface continues, so that
    /// the model may be part of something larger.
    pub beyond: f64,
    /// Number of feature matches that voted for the pose.
    pub votes: usize,
}

/// Number of weights of a [`Judge`], including the constant.
pub const WEIGHTS: usize = 9;

/// Logistic regression from evidence to probability.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Judge {
    /// Weights of [`PoseEvidence::measures`]; the last is the constant term.
    pub weights: [f64; WEIGHTS],
}

impl Default for Judge {
    /// Weights in the order of [`PoseEvidence::measures`], fitted by part `judge` of
    /// `experiments/measure/src/learning` (seed 501, 80 scenes) on generated objects that no
    /// evaluation uses: half known from all sides, half from one or two views, among furniture and
    /// leaflets without a model.
    fn default() -> Self {
        Judge { weights: [8.30, 8.01, 1.52, -15.86, 1.41, -4.78, -2.84, -9.09, -7.26] }
    }
}

impl PoseEvidence {
    /// Inputs of a [`Judge`]: explained share of the unoccluded points; colour similarity; 1 if there is no colour;
    /// continuation beyond the border; logarithm of votes; hidden share of the facing points; seen-through share of the
    /// unoccluded points; normal deviation, radians; and 1 for the constant term.
    pub fn measures(&self) -> [f64; WEIGHTS] {
        [
            self.explained_share(),
            self.colour.unwrap_or(0.0),
            f64::from(u8::from(self.colour.is_none())),
            self.beyond,
            (1.0 + self.votes as f64).ln(),
            self.hidden as f64 / self.facing.max(1) as f64,
            self.through as f64 / self.open().max(1) as f64,
            self.turned_rad,
            1.0,
        ]
    }

    /// Explained share of the unoccluded points.
    pub fn explained_share(&self) -> f64 {
        self.explained as f64 / self.open().max(1) as f64
    }

    /// Number of facing points that are not hidden.
    pub(super) fn open(&self) -> usize {
        self.facing.saturating_sub(self.hidden)
    }

    /// Scales the counts of points by a factor.
    pub(super) fn times(self, factor: f64) -> PoseEvidence {
        let times = |count: usize| (count as f64 * factor).round() as usize;
        PoseEvidence {
            facing: times(self.facing),
            explained: times(self.explained),
            through: times(self.through),
            hidden: times(self.hidden),
            ..self
        }
    }
}

impl Judge {
    /// Probability that a model with this evidence is at its pose.
    pub fn confidence(&self, evidence: &PoseEvidence) -> f64 {
        let sum: f64 = self.weights.iter().zip(evidence.measures()).map(|(w, m)| w * m).sum();
        1.0 / (1.0 + (-sum).exp())
    }
}

/// Minimum cosine between model and scene normals at an explained point.
const TURNED_AS: f32 = 0.6;
/// Maximum distance of a scene point from the model point that explains it, metres.
pub(super) const NEAR_M: f32 = 0.012;
/// Colour difference (CIE 1976, lightness at half weight) at which similarity falls to 1/e.
const UNLIKE: f32 = 14.0;
/// Distance beyond explained points at which continuation of the scene is tested, metres.
const BEYOND_M: f32 = 0.018;
/// Minimum distance of a tested position from all model points, metres.
const WITHIN_M: f32 = 0.010;
/// Minimum cosine between the normals of an explained point and of the surface that continues it.
const SMOOTH: f32 = 0.94;
/// Number of border positions without continuation that are added, so that a short border has little weight.
const LEAST_BORDER: usize = 10;

/// Evidence for a pose, and the scene's points that the model explains there.
pub struct Verified {
    pub evidence: PoseEvidence,
    /// Indices of the explained surfels of the scene, ascending.
    pub claims: Vec<u32>,
}

/// Gathers the evidence for a pose of a model's surfels in a scene; `votes`: number of matches that voted for the pose.
pub fn verify(
    model: &Surfels,
    camera_from_model: &Isometry3<f64>,
    scene: &SceneView,
    votes: usize,
) -> Verified {
    let Rays { mut evidence, pairs, seen } = rays(model, camera_from_model, scene);
    evidence.votes = votes;
    add_backs(&mut evidence, model, camera_from_model, scene, &seen);
    let mut claims: Vec<u32> = pairs.iter().map(|pair| pair.1 as u32).collect();
    claims.sort_unstable();
    claims.dedup();
    evidence.beyond = beyond(model, camera_from_model, scene, &claims);
    Verified { evidence, claims }
}

/// Optimistic evidence: as if the scene did not continue beyond the model and each side of the model had been learned.
pub(super) fn unbounded(
    model: &Surfels,
    camera_from_model: &Isometry3<f64>,
    scene: &SceneView,
    votes: usize,
) -> PoseEvidence {
    PoseEvidence { votes, ..rays(model, camera_from_model, scene).evidence }
}

/// Score of an unrefined pose: explained share of the unoccluded points, times a factor for colour similarity.
pub(super) fn first_sight(model: &Surfels, camera_from_model: &Isometry3<f64>, scene: &SceneView) -> f64 {
    let evidence = rays(model, camera_from_model, scene).evidence;
    evidence.explained_share() * (0.5 + evidence.colour.unwrap_or(0.5))
}

/// Evidence of the rays alone; explaining pairs of model and scene point, by index; and the model points that face the
/// camera, by index.
struct Rays {
    evidence: PoseEvidence,
    pairs: Vec<(usize, usize)>,
    seen: Vec<u32>,
}

/// Maximum difference between a measured depth and a surface's depth `z_m` at which both are one surface, metres.
pub(super) fn tolerance_m(z_m: f32) -> f32 {
    (3.0 * frontal_sigma_m(z_m)).max(0.006)
}

/// Unit vector from the model's origin towards the camera, model frame.
fn towards_camera(camera_from_model: &Isometry3<f64>) -> Vector3<f32> {
    (camera_from_model.inverse() * Point3::origin()).coords.cast::<f32>().normalize()
}

/// True if a camera looks through a point at depth `z_m`: all depths around its pixel, `nearest_m` the least, lie
/// behind it by more than the measurement error.
fn sees_through(z_m: f32, nearest_m: f32) -> bool {
    nearest_m > z_m + tolerance_m(z_m).max(0.01)
}

/// Adds the evidence of visible sides that were never learned: each of their points is seen through, or hidden.
fn add_backs(
    evidence: &mut PoseEvidence,
    model: &Surfels,
    camera_from_model: &Isometry3<f64>,
    scene: &SceneView,
    seen: &[u32],
) {
    for i in model.backs_from(&towards_camera(camera_from_model), seen) {
        let p = camera_from_model * model.points[i as usize].cast::<f64>();
        let through = scene.around(&p).is_some_and(|(_, nearest)| sees_through(p.z as f32, nearest));
        evidence.facing += 1;
        evidence.through += usize::from(through);
        evidence.hidden += usize::from(!through);
    }
}

fn rays(model: &Surfels, camera_from_model: &Isometry3<f64>, scene: &SceneView) -> Rays {
    let mut e = PoseEvidence::default();
    let (mut pairs, mut off, mut turned_rad) = (Vec::new(), 0.0, 0.0);
    let seen = model.seen_from(&towards_camera(camera_from_model));
    for &i in &seen {
        let p = camera_from_model * model.points[i as usize].cast::<f64>();
        e.facing += 1;
        let Some((depth, nearest)) = scene.around(&p) else {
            e.hidden += 1;
            continue;
        };
        let sigma = frontal_sigma_m(p.z as f32);
        let tolerance = tolerance_m(p.z as f32);
        if sees_through(p.z as f32, nearest) {
            e.through += 1;
        } else if depth < p.z as f32 - tolerance {
            e.hidden += 1;
        } else if (depth - p.z as f32).abs() <= tolerance {
            let normal = (camera_from_model.rotation * model.normals[i as usize].cast::<f64>()).cast::<f32>();
            let near = scene.surfels.tree.nearest(&p.cast(), NEAR_M).map(|n| n.index as usize);
            let alike = near.map(|k| (k, scene.surfels.normals[k].dot(&normal)));
            let Some((k, alike)) = alike.filter(|(_, alike)| *alike >= TURNED_AS) else { continue };
            e.explained += 1;
            turned_rad += f64::from(alike.min(1.0).acos());
            off += f64::from((depth - p.z as f32).abs() / sigma);
            pairs.push((i as usize, k));
        }
    }
    e.off_sigmas = off / e.explained.max(1) as f64;
    e.turned_rad = turned_rad / e.explained.max(1) as f64;
    e.colour = likeness(model, &scene.surfels, &pairs);
    Rays { evidence: e, pairs, seen }
}

/// Mean colour similarity of pairs (model, scene), 0 to 1, after equalising lightness; `None` without colours.
fn likeness(model: &Surfels, scene: &Surfels, pairs: &[(usize, usize)]) -> Option<f64> {
    let (a, b) = (model.lab.as_ref()?, scene.lab.as_ref()?);
    if pairs.is_empty() {
        return Some(0.0);
    }
    let mut lighter: Vec<f32> = pairs.iter().map(|&(i, k)| b[k][0] - a[i][0]).collect();
    let middle = lighter.len() / 2;
    let gain = lighter.select_nth_unstable_by(middle, f32::total_cmp).1.clamp(-15.0, 15.0);
    let alike = |&(i, k): &(usize, usize)| {
        let lightness = 0.5 * (b[k][0] - a[i][0] - gain);
        let off_sq = lightness.powi(2) + (b[k][1] - a[i][1]).powi(2) + (b[k][2] - a[i][2]).powi(2);
        f64::from((-off_sq / (UNLIKE * UNLIKE)).exp())
    };
    Some(pairs.iter().map(alike).sum::<f64>() / pairs.len() as f64)
}

/// Share of border positions where the scene continues the model's surface; occluded positions and missing measurements
/// do not count. Any patch fits a larger wall, so wide planes count too.
pub fn beyond(model: &Surfels, camera_from_model: &Isometry3<f64>, scene: &SceneView, claims: &[u32]) -> f64 {
    let model_from_camera = camera_from_model.inverse();
    let (mut carried, mut asked) = (0_usize, 0_usize);
    for &claim in claims {
        let (at, normal) = (scene.surfels.points[claim as usize], scene.surfels.normals[claim as usize]);
        let right = across(&normal);
        let up = normal.cross(&right);
        for side in [right, up, -right, -up] {
            let q = (at + side * BEYOND_M).cast::<f64>();
            if model.tree.nearest(&(model_from_camera * q).cast(), WITHIN_M).is_none()
                && let Some(carries_on) = carries_on(scene, &q, &normal)
            {
                asked += 1;
                carried += usize::from(carries_on);
            }
        }
    }
    carried as f64 / (asked + LEAST_BORDER) as f64
}

/// True if a surface of the given normal is measured at a camera-frame point; `None` if the point is occluded or
/// outside the image.
fn carries_on(scene: &SceneView, q: &Point3<f64>, normal: &Vector3<f32>) -> Option<bool> {
    let off = scene.around(q)?.0 - q.z as f32;
    let tolerance = tolerance_m(q.z as f32);
    let smooth = || {
        let near = scene.surfels.tree.nearest(&q.cast(), NEAR_M)?;
        Some(scene.surfels.normals[near.index as usize].dot(normal) > SMOOTH)
    };
    (off >= -tolerance).then(|| off <= tolerance && smooth().unwrap_or(false))
}
