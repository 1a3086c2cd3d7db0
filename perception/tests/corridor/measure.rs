//! Agreement of a map's walls with a building.

use super::{Building, CAMERA_HEIGHT_M, Opening};
use descry_perception::mapping::{RoomMap, Station, Survey, UprightCylinder};
use descry_perception::nalgebra::{Isometry2, Point2, Rotation2, Vector2};

/// Height range of obstacles to the body, metres.
pub const BODY_M: std::ops::RangeInclusive<f64> = 0.15..=1.6;
/// Maximum depth of points used for the map, metres.
pub const MAP_FAR_M: f64 = 5.0;
const STEP_M: f64 = 0.1;

/// Walls held to the truth.
#[derive(Clone, Copy, Debug, Default)]
pub struct Score {
    /// Share of the found walls' length that is at a true upright surface.
    pub precision: f64,
    /// Share of the length of the corridor's walls that was found.
    pub recall: f64,
    /// Mean angle between found and true walls, weighted by length, degrees.
    pub angle_deg: f64,
    /// Mean distance of found from true walls, metres.
    pub offset_m: f64,
    /// Numbers of open doors left open by the found walls, and of all open doors.
    pub openings: (usize, usize),
    /// Walls found.
    pub walls: usize,
}

/// All stations put together by poses.
pub fn survey(stations: &[Station], poses: &[Isometry2<f64>]) -> Survey {
    let mut survey = Survey::new(0.1).expect("a length");
    for (station, pose) in stations.iter().zip(poses) {
        survey.add(station, pose, CAMERA_HEIGHT_M, MAP_FAR_M, &BODY_M).expect("a pose");
    }
    survey
}

/// Poses rigidly aligned with the true ones.
pub fn on_truth(poses: &[Isometry2<f64>], truths: &[Isometry2<f64>]) -> Vec<Isometry2<f64>> {
    let n = poses.len() as f64;
    let mean = |p: &[Isometry2<f64>]| p.iter().map(|p| p.translation.vector).sum::<Vector2<f64>>() / n;
    let (from, to) = (mean(poses), mean(truths));
    let (sin, cos) = poses.iter().zip(truths).fold((0.0, 0.0), |(s, c), (p, t)| {
        let (a, b) = (p.translation.vector - from, t.translation.vector - to);
        (s + a.perp(&b), c + a.dot(&b))
    });
    let turn = Rotation2::new(f64::atan2(sin, cos));
    let all = Isometry2::from_parts((to - turn * from).into(), turn.into());
    poses.iter().map(|p| all * p).collect()
}

fn samples((a, b): (Point2<f64>, Point2<f64>)) -> impl Iterator<Item = Point2<f64>> {
    let steps = ((b - a).norm() / STEP_M).ceil().max(1.0) as usize;
    (0..steps).map(move |i| a + (b - a) * ((i as f64 + 0.5) / steps as f64))
}

fn distance_m(p: &Point2<f64>, (a, b): &(Point2<f64>, Point2<f64>)) -> f64 {
    let along = b - a;
    let t = ((p - a).dot(&along) / along.norm_squared().max(1e-12)).clamp(0.0, 1.0);
    (p - (a + along * t)).norm()
}

/// Angle between two lines, radians.
fn between(a: &(Point2<f64>, Point2<f64>), b: &(Point2<f64>, Point2<f64>)) -> f64 {
    let (u, v) = ((a.1 - a.0).normalize(), (b.1 - b.0).normalize());
    u.perp(&v).abs().asin()
}

/// Compares the upright surfaces of a map with a building; they match within `within_m`. A door is
/// searched where the nearest station of the drive places it; `poses` and `truths` belong to the
/// same stations.
pub fn score(
    map: &RoomMap,
    building: &Building,
    within_m: f64,
    poses: &[Isometry2<f64>],
    truths: &[Isometry2<f64>],
) -> Score {
    const ALIKE_RAD: f64 = 0.3;
    let found: Vec<(Point2<f64>, Point2<f64>)> = map.feet().collect();
    let panels: Vec<_> = building.panels.iter().map(|p| (p.a, p.b)).collect();
    let (mut right, mut all, mut angle, mut offset) = (0.0, 0.0, 0.0, 0.0);
    for foot in &found {
        for at in samples(*foot) {
            all += 1.0;
            let alike = panels.iter().filter(|p| between(foot, p) < ALIKE_RAD);
            let near = alike.map(|p| (distance_m(&at, p), p)).min_by(|a, b| a.0.total_cmp(&b.0));
            if let Some((off, panel)) = near.filter(|(off, _)| *off < within_m) {
                right += 1.0;
                angle += between(foot, panel).to_degrees();
                offset += off;
            }
        }
    }
    let true_walls = building.walls.iter().flat_map(|w| samples(*w).map(move |at| (at, w)));
    let (hit, true_all) = true_walls.fold((0.0, 0.0), |(hit, all), (at, wall)| {
        let is_found = found.iter().any(|f| between(f, wall) < ALIKE_RAD && distance_m(&at, f) < within_m);
        (hit + f64::from(u8::from(is_found)), all + 1.0)
    });
    let kept = building.openings.iter().filter(|opening| {
        let away = |t: &Isometry2<f64>| (t.translation.vector - opening.a.coords).norm();
        let near = (0..truths.len()).min_by(|&a, &b| away(&truths[a]).total_cmp(&away(&truths[b])));
        let local = near.map_or(Isometry2::identity(), |i| poses[i] * truths[i].inverse());
        let opening = Opening { a: local * opening.a, b: local * opening.b };
        let along = (opening.b - opening.a).normalize();
        let is_closed = |at: &Point2<f64>| {
            let covers = |f: &&(Point2<f64>, Point2<f64>)| {
                let (way, to) = (f.1 - f.0, at - f.0);
                let share = to.dot(&way) / way.norm_squared().max(1e-12);
                (0.0..=1.0).contains(&share) && distance_m(at, f) < 0.3
            };
            found.iter().filter(covers).any(|f| between(f, &(opening.a, opening.b)) < ALIKE_RAD)
        };
        // Half a metre in a row without a wall, no farther than 35 cm from where the door is.
        let (mut open_m, mut widest_m) = (0.0_f64, 0.0_f64);
        for at in samples((opening.a - along * 0.35, opening.b + along * 0.35)) {
            open_m = if is_closed(&at) { 0.0 } else { open_m + STEP_M };
            widest_m = widest_m.max(open_m);
        }
        widest_m + 1e-9 >= 0.5
    });
    Score {
        precision: right / f64::max(all, 1.0),
        recall: hit / f64::max(true_all, 1.0),
        angle_deg: angle / f64::max(right, 1.0),
        offset_m: offset / f64::max(right, 1.0),
        openings: (kept.count(), building.openings.len()),
        walls: map.walls.len(),
    }
}

/// Pillars held to the truth.
#[derive(Clone, Copy, Debug, Default)]
pub struct PillarScore {
    /// Number of found pillars; further fields: false ones, and true ones in all.
    pub found: usize,
    pub wrong: usize,
    pub all: usize,
    /// Mean errors over the correct pillars, metres.
    pub off_m: f64,
    pub radius_off_m: f64,
}

/// Compares the cylinders of a map with the pillars of a building; one is correct within 10 cm of a
/// pillar's axis.
pub fn score_pillars(cylinders: &[UprightCylinder], building: &Building) -> PillarScore {
    let mut score = PillarScore { all: building.pillars.len(), ..PillarScore::default() };
    let mut left = building.pillars.clone();
    for cylinder in cylinders {
        let off_m = |p: &super::Pillar| (p.middle - cylinder.middle).norm();
        let nearest = (0..left.len()).min_by(|&a, &b| off_m(&left[a]).total_cmp(&off_m(&left[b])));
        score.found += 1;
        match nearest.filter(|&n| off_m(&left[n]) < 0.1) {
            Some(n) => {
                let pillar = left.swap_remove(n);
                score.off_m += off_m(&pillar);
                score.radius_off_m += (pillar.radius_m - cylinder.radius_m).abs();
            }
            None => score.wrong += 1,
        }
    }
    let right = f64::max((score.found - score.wrong) as f64, 1.0);
    (score.off_m, score.radius_off_m) = (score.off_m / right, score.radius_off_m / right);
    score
}
