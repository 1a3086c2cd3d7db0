//! Recognition of learned objects (section VI; Aldoma et al. 2013).
//!
//! Local features of shape and pattern are matched by nearest neighbour. Matches are grouped by the pose that they
//! share, where the up direction is known also by the object's usual standing pose. Poses are refined on the scene's
//! surface; the remaining ones are judged by their visibility in the view and chosen together, so that no part of the
//! scene is explained twice.

mod error;
pub mod evidence;
#[doc(hidden)]
pub mod feature;
#[doc(hidden)]
pub mod group;
#[doc(hidden)]
pub mod resting_pose;
#[doc(hidden)]
pub mod scene;
pub mod several;
#[doc(hidden)]
pub mod surfels;

use crate::cloud::Cloud;
use crate::pool;
use crate::register::{Method, Prepared, RegisterOptions, align};
use crate::view::View;
pub use error::KnowError;
use evidence::{Judge, PoseEvidence, Verified, first_sight, unbounded, verify};
use feature::{DescriptorKind, Descriptors};
use group::{Vote, matches, standing, votes};
use nalgebra::{Isometry3, Point3, Unit, Vector3};
use scene::SceneView;
use serde::{Deserialize, Serialize};
use surfels::Surfels;
pub use surfels::outward;

/// Options for recognising learned objects.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct KnowOptions {
    /// Maximum range of the points used, metres.
    pub range_m: f64,
    /// Spacing of the keypoints that get a descriptor, metres (paper: 1.5 cm).
    pub keypoint_m: f32,
    /// Minimum confidence of a reported object.
    pub least_confidence: f64,
    /// Candidates are dropped if an upper bound of their probability, from a few model points, is below this; far below
    /// any reported probability, so that only time is saved.
    pub hopeless: f64,
    /// Judge that turns evidence into a probability.
    pub judge: Judge,
    /// Up direction in the frames of the models and of the world, if both share one: objects mostly stand as they stood
    /// when learned. `None` if unknown.
    pub up: Option<Unit<Vector3<f64>>>,
}

impl Default for KnowOptions {
    fn default() -> Self {
        KnowOptions {
            range_m: 2.5,
            keypoint_m: 0.015,
            least_confidence: 0.8,
            hopeless: 0.005,
            judge: Judge::default(),
            up: None,
        }
    }
}

/// A learned object found in a view.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Recognised {
    /// Index of the model in the library, in order of addition.
    pub model: usize,
    /// Pose of the model in the world, from the stated camera pose of the view, metres.
    pub world_from_model: Isometry3<f64>,
    /// Probability of this object at this pose.
    pub confidence: f64,
    /// Evidence for the recognised pose.
    pub evidence: PoseEvidence,
}

/// Learned models, prepared for recognition.
#[derive(Default)]
pub struct Library {
    models: Vec<Known>,
}

struct Known {
    surfels: Surfels,
    /// Few of the points, about [`COARSE_M`] apart, for a first check of candidates.
    coarse: Surfels,
    features: [Descriptors; 2],
    /// Largest extent, metres.
    size_m: f64,
}

const KINDS: [DescriptorKind; 2] = [DescriptorKind::Shape, DescriptorKind::Pattern];
/// Spacing of the model points used for a first check of candidates, metres.
const COARSE_M: f32 = 0.01;
/// Minimum number of points of a model, at surfel spacing.
const LEAST_POINTS: usize = 60;
/// Maximum number of voted poses of a model that are checked.
const LOOKED_AT: usize = 60;
/// Maximum number of voted poses of a model that are refined and judged.
const REFINED: usize = 6;
/// Difference below which two voted poses count as one, metres and radians.
const SAME: (f64, f64) = (0.02, 0.26);
/// Difference below which two poses refined with a few points count as one, metres and radians.
const SETTLED: (f64, f64) = (0.005, 0.07);
/// Maximum correspondence distances for refining a voted pose, coarse to fine, metres.
const WITHIN_M: [f32; 2] = [0.025, 0.01];
/// Maximum correspondence distances for refining a pose already refined with a few points, metres.
const SETTLED_WITHIN_M: [f32; 1] = [0.01];
/// Prior probability ratio of an object that lies or hangs to one that stands as when learned; an assumption: nine in
/// ten stand.
const LYING: f64 = 0.1;
/// Maximum share of the points explained by two reported objects, relative to the one with fewer points.
const SHARED: f64 = 0.2;

/// Vertices of an icosahedron, as unit vectors: the viewing directions from which a model is described.
fn directions() -> Vec<Vector3<f32>> {
    let golden = 0.5 * (1.0 + 5_f32.sqrt());
    let mut all = Vec::new();
    for (a, b) in [(1.0, golden), (-1.0, golden), (1.0, -golden), (-1.0, -golden)] {
        all.extend([Vector3::new(0.0, a, b), Vector3::new(a, b, 0.0), Vector3::new(b, 0.0, a)]);
    }
    all.into_iter().map(|v| v.normalize()).collect()
}

impl Library {
    /// Adds a model and returns its index. `cloud`: points with outward normals about any origin, optionally coloured.
    ///
    /// # Errors
    /// If the cloud has too few points with normals.
    pub fn add(&mut self, cloud: &Cloud, options: &KnowOptions) -> Result<usize, KnowError> {
        let surfels = Surfels::of(cloud)?;
        if surfels.points.len() < LEAST_POINTS {
            return Err(KnowError::Model { points: surfels.points.len() });
        }
        let mut all = KINDS.map(Descriptors::none);
        for away in directions() {
            let part = surfels.part(&surfels.seen_from(&away))?;
            let keypoints = part.keypoints(options.keypoint_m, |_| true);
            for (features_of, kind) in all.iter_mut().zip(KINDS) {
                features_of.add_new(&Descriptors::of(&part, &keypoints, kind));
            }
        }
        let few: Vec<u32> = surfels.keypoints(COARSE_M, |_| true);
        let coarse = surfels.part(&few)?;
        let size_m = cloud.bounds().map_or(0.0, |(low, high)| f64::from((high - low).norm()));
        self.models.push(Known { surfels, coarse, features: all, size_m });
        Ok(self.models.len() - 1)
    }

    /// Number of models.
    pub fn len(&self) -> usize {
        self.models.len()
    }

    /// True if the library has no models.
    pub fn is_empty(&self) -> bool {
        self.models.is_empty()
    }

    /// Recognises models in a view, the surest first.
    ///
    /// # Errors
    /// If the view is no depth image.
    pub fn recognise(&self, view: &View, options: &KnowOptions) -> Result<Vec<Recognised>, KnowError> {
        Ok(choose(self.judged(view, options)?, options.least_confidence))
    }

    /// Hypotheses of all models in a view, each judged in isolation and possibly overlapping: input of [`choose`] and
    /// for fitting a [`Judge`].
    ///
    /// # Errors
    /// As [`Library::recognise`].
    pub fn judged(&self, view: &View, options: &KnowOptions) -> Result<Vec<Hypothesis>, KnowError> {
        let _span = tracing::debug_span!("know again", models = self.models.len()).entered();
        self.candidates_in(&self.scene(view, options)?, &view.world_from_camera, options)
    }

    /// View prepared for recognition.
    fn scene(&self, view: &View, options: &KnowOptions) -> Result<SceneView, KnowError> {
        let widest_m = self.models.iter().map(|m| m.size_m).fold(0.0, f64::max);
        SceneView::new(view, options.range_m, widest_m * widest_m)
    }

    fn candidates_in(
        &self,
        scene: &SceneView,
        world_from_camera: &Isometry3<f64>,
        options: &KnowOptions,
    ) -> Result<Vec<Hypothesis>, KnowError> {
        let keypoints = scene.surfels.keypoints(options.keypoint_m, |i| !scene.wide[i]);
        let described = KINDS.map(|kind| Descriptors::of(&scene.surfels, &keypoints, kind));
        let of_model = |(number, model): (usize, &Known)| {
            model.find(number, &described, scene, world_from_camera, options)
        };
        let all: Vec<Vec<Hypothesis>> = pool::each(self.models.len(), 1, |n| of_model((n, &self.models[n])))
            .into_iter()
            .collect::<Result<_, _>>()?;
        Ok(all.into_iter().flatten().collect())
    }
}

/// Model at a pose in a view, judged in isolation.
#[derive(Clone, Debug, PartialEq)]
pub struct Hypothesis {
    /// Recognised object, with its confidence regardless of other hypotheses.
    pub recognised: Recognised,
    /// Indices of the view's surface points that the model explains, ascending.
    explained: Vec<u32>,
}

impl Hypothesis {
    /// True if both explain too many of the same points to hold together.
    fn conflicts(&self, other: &Hypothesis) -> bool {
        let shared = self.explained.iter().filter(|c| other.explained.binary_search(c).is_ok()).count();
        shared as f64 > SHARED * self.explained.len().min(other.explained.len()) as f64
    }

    /// Contribution to the explanation of the scene: explained points, weighted by confidence above one half.
    fn worth(&self) -> f64 {
        self.explained.len() as f64 * (self.recognised.confidence - 0.5)
    }

    fn odds(&self) -> f64 {
        let p = self.recognised.confidence.clamp(0.0, 1.0 - 1e-9);
        p / (1.0 - p)
    }
}

impl Known {
    fn find(
        &self,
        number: usize,
        described: &[Descriptors; 2],
        scene: &SceneView,
        world_from_camera: &Isometry3<f64>,
        options: &KnowOptions,
    ) -> Result<Vec<Hypothesis>, KnowError> {
        let up = options.up.map(|up| [*up, world_from_camera.rotation.inverse() * *up]);
        let mut judged = Vec::new();
        for vote in self.promising(described, scene, up.as_ref(), options)? {
            let pose = refined(&self.surfels, &vote.scene_from_model, scene, &SETTLED_WITHIN_M)?;
            let Verified { evidence, claims } = verify(&self.surfels, &pose, scene, vote.matches);
            let stands = up.is_none_or(|up| resting_pose::stands(&self.surfels, &pose, scene, &up));
            let confidence = options.confidence(&evidence, stands);
            let world_from_model = world_from_camera * pose;
            let recognised = Recognised { model: number, world_from_model, confidence, evidence };
            judged.push(Hypothesis { recognised, explained: claims });
        }
        Ok(judged)
    }

    /// Poses that feature matches vote for, refined on the scene with a few model points and kept if promising;
    /// duplicates are merged. `up`: up direction in the model and in the scene.
    fn promising(
        &self,
        described: &[Descriptors; 2],
        scene: &SceneView,
        up: Option<&[Vector3<f64>; 2]>,
        options: &KnowOptions,
    ) -> Result<Vec<Vote>, KnowError> {
        let mut all: Vec<_> = described.iter().zip(&self.features).flat_map(|(s, m)| matches(s, m)).collect();
        let mut votes = votes(&mut all);
        votes.truncate(LOOKED_AT);
        votes.extend(up.iter().flat_map(|up| standing(&all, up, LOOKED_AT)));
        let at = |vote: &Vote| first_sight(&self.coarse, &vote.scene_from_model, scene);
        let mut ranked: Vec<(f64, Vote)> = votes.iter().map(|v| (at(v), *v)).collect();
        ranked.sort_by(|a, b| b.0.total_cmp(&a.0));
        let mut kept: Vec<Vote> = Vec::new();
        for (_, vote) in ranked {
            let is_known = |k: &Vote| same(&k.scene_from_model, &vote.scene_from_model, SAME);
            if kept.len() < REFINED && !kept.iter().any(is_known) {
                kept.push(vote);
            }
        }
        let mut promising: Vec<Vote> = Vec::new();
        for vote in kept {
            let settled = refined(&self.coarse, &vote.scene_from_model, scene, &WITHIN_M)?;
            let is_one = |p: &&mut Vote| same(&p.scene_from_model, &settled, SETTLED);
            if let Some(known) = promising.iter_mut().find(is_one) {
                known.matches = known.matches.max(vote.matches);
                continue;
            }
            let poses = [vote.scene_from_model, settled];
            if self.at_most(&poses, vote.matches, scene, &options.judge) >= options.hopeless {
                promising.push(Vote { scene_from_model: settled, ..vote });
            }
        }
        Ok(promising)
    }

    /// Upper bound of the confidence over some poses, from a few model points; 1 if too few of these are in open view.
    fn at_most(&self, poses: &[Isometry3<f64>], votes: usize, scene: &SceneView, judge: &Judge) -> f64 {
        let by_points = self.surfels.points.len() as f64 / self.coarse.points.len().max(1) as f64;
        let mut most = 0.0_f64;
        for pose in poses {
            let few = unbounded(&self.coarse, pose, scene, votes);
            if few.open() < LEAST_POINTS / 2 {
                return 1.0;
            }
            most = most.max(judge.confidence(&few.times(by_points)));
        }
        most
    }
}

impl KnowOptions {
    /// Probability that a model with this evidence is at its pose. `stands`: true if it stands as when learned.
    fn confidence(&self, evidence: &PoseEvidence, stands: bool) -> f64 {
        let p = self.judge.confidence(evidence);
        if stands { p } else { LYING * p / (1.0 - p + LYING * p) }
    }
}

/// Pose of surfels after ICP of their visible side with the scene, at decreasing correspondence distances, metres;
/// steps that move the pose too far are dropped.
fn refined(
    surfels: &Surfels,
    start: &Isometry3<f64>,
    scene: &SceneView,
    within_m: &[f32],
) -> Result<Isometry3<f64>, KnowError> {
    let mut pose = *start;
    for &within_m in within_m {
        let eye = pose.inverse() * Point3::origin();
        let seen = surfels.seen_from(&eye.coords.cast().normalize());
        let points: Vec<Point3<f32>> = seen.iter().map(|&i| surfels.points[i as usize]).collect();
        if points.len() < LEAST_POINTS / 2 {
            return Ok(pose);
        }
        let options = RegisterOptions {
            method: Method::PointToPlane,
            start_target_from_source: pose,
            within_m,
            rounds: 15,
            settle_m: 2e-4,
            settle_rad: 1e-3,
            robust_m: Some(0.004),
            ..RegisterOptions::default()
        };
        let fit = align(&Prepared::new(&points)?, &scene.target, &options)?;
        // What slips away along a plane or around an axis was held by features, not by the surface.
        if fit.moved_m < 0.04 && fit.moved_rad < 0.5 {
            pose = fit.target_from_source;
        }
    }
    Ok(pose)
}

fn same(a: &Isometry3<f64>, b: &Isometry3<f64>, (within_m, within_rad): (f64, f64)) -> bool {
    (a.translation.vector - b.translation.vector).norm() < within_m
        && a.rotation.angle_to(&b.rotation) < within_rad
}

/// Recognised objects that together explain the scene best without explaining any point twice, most confident first.
///
/// Greedy: adds the hypothesis of greatest gain, dropping those that conflict with it, until none improves the
/// explanation. Competing models share confidence by their odds; objects below `least_confidence` are dropped.
pub fn choose(mut found: Vec<Hypothesis>, least_confidence: f64) -> Vec<Recognised> {
    found.sort_by(|a, b| b.worth().total_cmp(&a.worth()));
    let n = found.len();
    let conflicts: Vec<Vec<bool>> =
        found.iter().map(|a| found.iter().map(|b| a.conflicts(b)).collect()).collect();
    let mut chosen = vec![false; n];
    loop {
        let gain = |i: usize| {
            let lost: f64 = (0..n).filter(|&j| chosen[j] && conflicts[i][j]).map(|j| found[j].worth()).sum();
            found[i].worth() - lost
        };
        let best = (0..n).filter(|&i| !chosen[i]).map(|i| (i, gain(i))).max_by(|a, b| a.1.total_cmp(&b.1));
        let Some((i, _)) = best.filter(|b| b.1 > 0.0) else { break };
        (0..n).filter(|&j| conflicts[i][j]).for_each(|j| chosen[j] = false);
        chosen[i] = true;
    }
    let told = |i: usize| {
        let own = &found[i].recognised;
        let mut rivals = rustc_hash::FxHashMap::<usize, f64>::default();
        for rival in (0..n).filter(|&j| conflicts[i][j]).map(|j| &found[j]) {
            if rival.recognised.model != own.model {
                let odds = rivals.entry(rival.recognised.model).or_default();
                *odds = odds.max(rival.odds());
            }
        }
        let odds = found[i].odds();
        let others: f64 = rivals.values().sum();
        Recognised { confidence: odds / (1.0 + odds + others), ..own.clone() }
    };
    let mut all: Vec<Recognised> = (0..n).filter(|&i| chosen[i]).map(told).collect();
    all.retain(|r| r.confidence >= least_confidence);
    all.sort_by(|a, b| b.confidence.total_cmp(&a.confidence));
    all
}
