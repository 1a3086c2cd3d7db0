//! Recognition from several views: candidates of each view are tested against all others.

use super::error::KnowError;
use super::evidence::{PoseEvidence, verify};
use super::resting_pose::stands;
use super::scene::SceneView;
use super::{KnowOptions, Library, Recognised, WITHIN_M, refined};
use crate::view::View;
use nalgebra::Isometry3;

/// Minimum confidence of a candidate by its own view.
const LEAST: f64 = 0.02;
/// Minimum number of unoccluded model points in a view for the view to count as evidence.
const FEWEST: usize = 40;

/// Prepared view, with its recognition candidates.
pub struct Glance {
    scene: SceneView,
    /// Candidates, most confident first, possibly overlapping.
    pub guesses: Vec<Guess>,
}

/// Candidate for a model in a view.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Guess {
    /// Index of the model in the library.
    pub model: usize,
    /// Pose in the camera frame of the view, metres.
    pub camera_from_model: Isometry3<f64>,
    /// Probability, from this view alone.
    pub confidence: f64,
    /// Number of feature matches that voted for the candidate.
    pub votes: usize,
}

/// Model at a pose, judged from several views.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Judged {
    /// Pose in the world, from the view that shows most of the model.
    pub world_from_model: Isometry3<f64>,
    /// Combined evidence of all views.
    pub evidence: PoseEvidence,
    /// Probability of this object at this pose.
    pub confidence: f64,
    /// Number of views in which enough of the model could be visible.
    pub looks: usize,
}

impl Library {
    /// Prepares a view and finds candidates in it.
    ///
    /// # Errors
    /// If the view is no depth image.
    pub fn glance(&self, view: &View, options: &KnowOptions) -> Result<Glance, KnowError> {
        let scene = self.scene(view, options)?;
        let found = self.candidates_in(&scene, &view.world_from_camera, options)?;
        let camera_from_world = view.world_from_camera.inverse();
        let mut found: Vec<Recognised> = found.into_iter().map(|c| c.recognised).collect();
        found.retain(|c| c.confidence >= LEAST);
        found.sort_by(|a, b| b.confidence.total_cmp(&a.confidence));
        let guess = |c: &Recognised| Guess {
            model: c.model,
            camera_from_model: camera_from_world * c.world_from_model,
            confidence: c.confidence,
            votes: c.evidence.votes,
        };
        let guesses = found.iter().map(guess).collect();
        Ok(Glance { scene, guesses })
    }

    /// Judges a candidate at a world pose from several views, each with its camera pose; `None` if enough of it could
    /// be visible in none.
    ///
    /// # Errors
    /// If a pose cannot be refined.
    pub fn judge(
        &self,
        guess: &Guess,
        world_from_model: &Isometry3<f64>,
        looks: &[(&Glance, Isometry3<f64>)],
        options: &KnowOptions,
    ) -> Result<Option<Judged>, KnowError> {
        let Some(known) = self.models.get(guess.model) else { return Ok(None) };
        let mut told: Vec<(PoseEvidence, Isometry3<f64>, bool)> = Vec::new();
        for (glance, world_from_camera) in looks {
            let stated = world_from_camera.inverse() * world_from_model;
            let of =
                |pose: &Isometry3<f64>| verify(&known.surfels, pose, &glance.scene, guess.votes).evidence;
            let refined = refined(&known.surfels, &stated, &glance.scene, &WITHIN_M)?;
            let best = [stated, refined]
                .map(|pose| (of(&pose), pose))
                .into_iter()
                .max_by(|a, b| a.0.explained_share().total_cmp(&b.0.explained_share()));
            let Some((evidence, pose)) = best.filter(|(e, _)| e.open() >= FEWEST) else { continue };
            let stands = options.up.is_none_or(|up| {
                let up = [*up, world_from_camera.rotation.inverse() * *up];
                stands(&known.surfels, &pose, &glance.scene, &up)
            });
            told.push((evidence, world_from_camera * pose, stands));
        }
        let Some(most) = told.iter().max_by_key(|(e, ..)| e.explained) else { return Ok(None) };
        let evidence = PoseEvidence::of_several(&told.iter().map(|(e, ..)| *e).collect::<Vec<_>>());
        Ok(Some(Judged {
            world_from_model: most.1,
            confidence: options.confidence(&evidence, most.2),
            evidence,
            looks: told.len(),
        }))
    }
}

impl PoseEvidence {
    /// Combines the evidence of several views: free space in one view counts against matches in others. Errors of views
    /// are correlated, so n views count as √n.
    fn of_several(all: &[PoseEvidence]) -> PoseEvidence {
        let root = (all.len().max(1) as f64).sqrt();
        let sum = |of: fn(&PoseEvidence) -> usize| {
            (all.iter().map(of).sum::<usize>() as f64 / root).round() as usize
        };
        let explained: usize = all.iter().map(|e| e.explained).sum();
        let mean = |of: &dyn Fn(&PoseEvidence) -> f64| {
            all.iter().map(|e| of(e) * e.explained as f64).sum::<f64>() / explained.max(1) as f64
        };
        PoseEvidence {
            facing: sum(|e| e.facing),
            explained: sum(|e| e.explained),
            through: sum(|e| e.through),
            hidden: sum(|e| e.hidden),
            colour: all.iter().all(|e| e.colour.is_some()).then(|| mean(&|e| e.colour.unwrap_or_default())),
            off_sigmas: mean(&|e| e.off_sigmas),
            turned_rad: mean(&|e| e.turned_rad),
            beyond: mean(&|e| e.beyond),
            votes: all.iter().map(|e| e.votes).max().unwrap_or_default(),
        }
    }
}
