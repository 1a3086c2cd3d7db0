//! Geometric-consistency grouping of correspondences (Chen and Bhanu 2007), and the pose of each
//! group.

use super::feature::{Descriptors, Feature};
use crate::register::rigid;
use nalgebra::{Isometry3, Point3, Rotation3, UnitQuaternion, Vector3};

/// Feature of the model and a similar feature of the scene.
#[derive(Clone, Copy, Debug)]
pub struct Correspondence<'a> {
    pub model: &'a Feature,
    pub scene: &'a Feature,
    /// Descriptor distance, in units of the median distance of the scene's features of this kind.
    pub off: f32,
}

/// Maximum number of matches of one kind that are grouped.
const MATCHES: usize = 300;
/// Maximum number of matches from which a group is started.
const SEEDS: usize = 120;
/// Maximum difference, metres, between the distance of two matches in the model and in the scene for the matches to be
/// in one group.
const AGREE_M: f32 = 0.01;
/// Maximum difference between the cosine of two matches' normals in the model and in the scene for the matches to be in
/// one group.
const AGREE_COS: f32 = 0.25;
/// Minimum distance between two matches of a group in the model, metres; nearer ones are redundant.
const APART_M: f32 = 0.012;
/// Minimum number of matches of a group.
const FEWEST: usize = 3;
/// Offset along the normal at which each match contributes a second point to the pose, metres.
const OUT_M: f64 = 0.02;

/// Features of the scene with the most similar features of the model, best first.
pub fn matches<'a>(scene: &'a Descriptors, model: &'a Descriptors) -> Vec<Correspondence<'a>> {
    let (alike, median) = scene.most_alike(model, MATCHES);
    let median = median.max(1) as f32;
    let found = alike.into_iter().map(|alike| Correspondence {
        model: &model.all[alike.other],
        scene: &scene.all[alike.own],
        off: alike.off as f32 / median,
    });
    found.collect()
}

/// Pose with its number of supporting matches.
#[derive(Clone, Copy, Debug)]
pub struct Vote {
    pub scene_from_model: Isometry3<f64>,
    pub matches: usize,
}

/// Poses of consistent groups of matches, most matches first.
pub(super) fn votes(matches: &mut [Correspondence]) -> Vec<Vote> {
    matches.sort_by(|a, b| a.off.total_cmp(&b.off));
    let n = matches.len();
    let mut used = vec![0_u8; n];
    let mut votes = Vec::new();
    for seed in 0..n.min(SEEDS) {
        if used[seed] > 1 {
            continue;
        }
        let mut group = vec![seed];
        for other in 0..n {
            if group.iter().all(|&g| agree(&matches[g], &matches[other])) {
                group.push(other);
            }
        }
        if group.len() < FEWEST {
            continue;
        }
        group.iter().for_each(|&g| used[g] += 1);
        let members: Vec<Correspondence> = group.iter().map(|&g| matches[g]).collect();
        votes.extend(pose(&members).map(|p| Vote { scene_from_model: p, matches: group.len() }));
    }
    votes.sort_by_key(|v| std::cmp::Reverse(v.matches));
    votes
}

/// Minimum horizontal component of a normal for the normal to determine the heading of a standing object.
const LEVEL: f64 = 0.4;
/// Difference below which the upright poses of two matches count as one, metres and radians.
const ONE: (f64, f64) = (0.02, 0.26);

/// At most `most` upright poses of an object, most supporting matches first. With a known up direction, position and
/// normal of one match determine the pose, so that small smooth objects get poses without consistent groups. `up`: up
/// direction in model and scene.
pub fn standing(matches: &[Correspondence], up: &[Vector3<f64>; 2], most: usize) -> Vec<Vote> {
    let poses: Vec<Isometry3<f64>> = matches.iter().filter_map(|m| stood(m, up)).collect();
    let is_one = |a: &Isometry3<f64>, b: &Isometry3<f64>| {
        (a.translation.vector - b.translation.vector).norm_squared() < ONE.0 * ONE.0
            && a.rotation.angle_to(&b.rotation) < ONE.1
    };
    let count = |pose: &Isometry3<f64>| poses.iter().filter(|other| is_one(pose, other)).count();
    let mut votes: Vec<Vote> =
        poses.iter().map(|pose| Vote { scene_from_model: *pose, matches: count(pose) }).collect();
    votes.retain(|v| v.matches >= FEWEST);
    votes.sort_by_key(|v| std::cmp::Reverse(v.matches));
    let mut apart: Vec<Vote> = Vec::new();
    for vote in votes {
        let is_known = apart.iter().any(|a| is_one(&a.scene_from_model, &vote.scene_from_model));
        if !is_known && apart.len() < most {
            apart.push(vote);
        }
    }
    apart
}

/// Upright pose from one match; `None` if the normal is nearly vertical, or slopes differently in the scene.
fn stood(m: &Correspondence, up: &[Vector3<f64>; 2]) -> Option<Isometry3<f64>> {
    let (of_model, of_scene) = (m.model.normal.cast::<f64>(), m.scene.normal.cast::<f64>());
    let rises = (of_model.dot(&up[0]), of_scene.dot(&up[1]));
    if (rises.0 - rises.1).abs() >= f64::from(AGREE_COS) {
        return None;
    }
    let axes = |normal: &Vector3<f64>, rise: f64, up: &Vector3<f64>| {
        let ahead = (normal - up * rise).try_normalize(LEVEL)?;
        Some(Rotation3::from_basis_unchecked(&[ahead, up.cross(&ahead), *up]))
    };
    let turn = axes(&of_scene, rises.1, &up[1])? * axes(&of_model, rises.0, &up[0])?.inverse();
    let shift = m.scene.at.cast::<f64>().coords - turn * m.model.at.cast::<f64>().coords;
    Some(Isometry3::from_parts(shift.into(), UnitQuaternion::from_rotation_matrix(&turn)))
}

fn agree(a: &Correspondence, b: &Correspondence) -> bool {
    let (m, s) = (b.model.at - a.model.at, b.scene.at - a.scene.at);
    let (in_model, in_scene) = (m.norm(), s.norm());
    in_model > APART_M
        && (in_model - in_scene).abs() < AGREE_M
        && (a.model.normal.dot(&m) - a.scene.normal.dot(&s)).abs() < AGREE_M
        && (b.model.normal.dot(&m) - b.scene.normal.dot(&s)).abs() < AGREE_M
        && (a.model.normal.dot(&b.model.normal) - a.scene.normal.dot(&b.scene.normal)).abs() < AGREE_COS
}

/// Least-squares pose of the model in the scene, from the matched points and points offset along their normals; `None`
/// if not determined.
pub fn pose(group: &[Correspondence]) -> Option<Isometry3<f64>> {
    let out = |f: &Feature| -> [Point3<f64>; 2] {
        let at = f.at.cast::<f64>();
        [at, at + f.normal.cast::<f64>() * OUT_M]
    };
    let both = |m: &Correspondence| {
        let (model, scene) = (out(m.model), out(m.scene));
        [(model[0], scene[0]), (model[1], scene[1])]
    };
    rigid(&group.iter().flat_map(both).collect::<Vec<_>>())
}
