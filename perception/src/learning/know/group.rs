//! Correspondences that one pose explains (geometric consistency: Chen and Bhanu 2007), and that pose.

use super::feature::{Feature, Features};
use crate::register::rigid;
use nalgebra::{Isometry3, Point3};

/// A place of the model and one of the scene that look alike.
#[derive(Clone, Copy, Debug)]
pub(super) struct Match<'a> {
    model: &'a Feature,
    scene: &'a Feature,
    /// Distance of the descriptors in units of the median of all matches of its kind.
    off: f32,
}

/// Most matches of one kind that are grouped, and most groups begun.
const MATCHES: usize = 300;
const SEEDS: usize = 120;
/// Matches of a group agree in distances to this, metres, and in cosines between normals to this.
const AGREE_M: f32 = 0.01;
const AGREE_COS: f32 = 0.25;
/// Matches nearer to each other tell nothing new, metres.
const APART_M: f32 = 0.012;
/// Fewest matches of a group.
const FEWEST: usize = 3;
/// How far out along its normal a second point of each match lies when the pose is found, metres.
const OUT_M: f64 = 0.02;

/// Features of the scene with the most alike of the model's, best first.
pub(super) fn matches<'a>(scene: &'a Features, model: &'a Features) -> Vec<Match<'a>> {
    let (alike, median) = scene.most_alike(model, MATCHES);
    let median = median.max(1) as f32;
    let found = alike.into_iter().map(|alike| Match {
        model: &model.all[alike.other],
        scene: &scene.all[alike.own],
        off: alike.off as f32 / median,
    });
    found.collect()
}

/// A pose and the number of matches that speak for it.
#[derive(Clone, Copy, Debug)]
pub(super) struct Vote {
    pub scene_from_model: Isometry3<f64>,
    pub matches: usize,
}

/// Poses by groups of matches that agree with each other, those of most matches first.
pub(super) fn votes(mut matches: Vec<Match>) -> Vec<Vote> {
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
        let members: Vec<Match> = group.iter().map(|&g| matches[g]).collect();
        votes.extend(pose(&members).map(|p| Vote { scene_from_model: p, matches: group.len() }));
    }
    votes.sort_by_key(|v| std::cmp::Reverse(v.matches));
    votes
}

fn agree(a: &Match, b: &Match) -> bool {
    let (m, s) = (b.model.at - a.model.at, b.scene.at - a.scene.at);
    let (in_model, in_scene) = (m.norm(), s.norm());
    in_model > APART_M
        && (in_model - in_scene).abs() < AGREE_M
        && (a.model.normal.dot(&m) - a.scene.normal.dot(&s)).abs() < AGREE_M
        && (b.model.normal.dot(&m) - b.scene.normal.dot(&s)).abs() < AGREE_M
        && (a.model.normal.dot(&b.model.normal) - a.scene.normal.dot(&b.scene.normal)).abs() < AGREE_COS
}

/// The pose of least squares of the places and of points out along the normals.
fn pose(group: &[Match]) -> Option<Isometry3<f64>> {
    let out = |f: &Feature| -> [Point3<f64>; 2] {
        let at = f.at.cast::<f64>();
        [at, at + f.normal.cast::<f64>() * OUT_M]
    };
    let both = |m: &Match| {
        let (model, scene) = (out(m.model), out(m.scene));
        [(model[0], scene[0]), (model[1], scene[1])]
    };
    rigid(&group.iter().flat_map(both).collect::<Vec<_>>())
}
