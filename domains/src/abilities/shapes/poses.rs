//! Scan poses: around an object, and over the floor.

use descry_perception::nalgebra::{Point2, Vector2};
use descry_robots::{Place, Pose2, Robot};

use crate::abilities::shapes::floor::FloorThing;
use crate::config::Candidates;
use crate::looking::candidates::ring;
use crate::mind::Mind;
use crate::situation::Situation;
use crate::viewpoint::Candidate;

/// Spacing of the poses for surveying the floor, metres.
const SURVEY_M: f64 = 3.0;

/// Adds viewpoints around a point to the candidate poses; returns their symbols.
pub(super) fn around(
    mind: &mut Mind,
    robot: &dyn Robot,
    config: &Candidates,
    name: &str,
    middle: &Point2<f64>,
) -> Vec<String> {
    let from = mind.known.candidates[mind.known.at].place.clone();
    let found = ring(robot, &*mind.known.own_map, &from, &middle.coords.push(0.0).into(), config);
    let poses = found.into_iter().map(|(k, place)| Candidate { symbol: format!("{name}-{k}"), place });
    let first = mind.known.candidates.len();
    mind.known.candidates.extend(poses);
    mind.known.candidates[first..].iter().map(|c| c.symbol.clone()).collect()
}

/// Adds reachable poses all over the mapped floor to the candidates, each place in two opposite
/// headings.
pub(super) fn survey(mind: &mut Mind, robot: &dyn Robot) {
    let Some(map) = robot.map() else { return };
    let from = mind.known.candidates[mind.known.at].place.clone();
    let size_m = Vector2::new(map.width as f64, map.height as f64) * map.resolution_m;
    let count = size_m.map(|s| (s / SURVEY_M).ceil().max(1.0) as usize);
    let step_m = size_m.component_div(&count.map(|n| n as f64));
    let middles =
        (0..count.y).flat_map(|row| (0..count.x).map(move |column| (column, row))).map(|(column, row)| {
            map.origin_m + Vector2::new((column as f64 + 0.5) * step_m.x, (row as f64 + 0.5) * step_m.y)
        });
    let poses: Vec<Place> = middles
        .flat_map(|p| [0.0, std::f64::consts::PI].map(|yaw| Place::Pose(Pose2::new(p.x, p.y, yaw))))
        .collect();
    let reached = robot.travel(&from, &poses, &[]);
    let open = poses.into_iter().zip(reached).filter(|(_, travel)| travel.is_ok());
    mind.known
        .candidates
        .extend((1..).zip(open).map(|(n, (place, _))| Candidate { symbol: format!("floor-{n}"), place }));
}

/// Route around an object to one of its viewpoints: first to the nearest viewpoint, then from
/// neighbour to neighbour, the shorter open way round. Candidate indices; `None` if no route is
/// open.
pub(super) fn way(s: &Situation, from: usize, to: usize, thing: &FloorThing) -> Option<Vec<usize>> {
    let ring: Vec<usize> = thing.ring.iter().filter_map(|p| s.candidate(p).ok()).collect();
    let n = ring.len();
    let end = ring.iter().position(|&c| c == to)?;
    let start = match ring.iter().position(|&c| c == from) {
        Some(start) => start,
        None => {
            let here = point(s, from)?;
            let far_m = |c: usize| point(s, c).map_or(f64::INFINITY, |p| (p - here).norm());
            let reached = (0..n).filter(|&k| s.travel_s(from, ring[k]).is_finite());
            reached.min_by(|&a, &b| far_m(ring[a]).total_cmp(&far_m(ring[b])))?
        }
    };
    let entry = (ring[start] != from).then_some(ring[start]);
    let there = |step: usize| -> Option<Vec<usize>> {
        let mut at = start;
        let mut way: Vec<usize> = entry.into_iter().collect();
        while at != end {
            let next = (at + step) % n;
            if !beside(s, ring[at], ring[next], &thing.near) {
                return None;
            }
            way.push(ring[next]);
            at = next;
        }
        Some(way)
    };
    let ways = [1, n - 1].into_iter().filter_map(there);
    ways.filter(|w| seconds(s, from, w).is_finite())
        .min_by(|a, b| seconds(s, from, a).total_cmp(&seconds(s, from, b)))
}

/// Travel time of a route, seconds.
pub(super) fn seconds(s: &Situation, from: usize, way: &[usize]) -> f64 {
    let mut at = from;
    way.iter().map(|&next| s.travel_s(std::mem::replace(&mut at, next), next)).sum()
}

/// Minimum distance of a straight drive from the object's centre, metres.
const CLEAR_M: f64 = 0.9;

/// True if the straight line between two candidates stays [`CLEAR_M`] away from a point.
fn beside(s: &Situation, a: usize, b: usize, middle: &Point2<f64>) -> bool {
    let Some((a, b)) = point(s, a).zip(point(s, b)) else { return false };
    let along = b - a;
    let t = (middle - a).dot(&along) / along.norm_squared().max(1e-12);
    (middle - (a + along * t.clamp(0.0, 1.0))).norm() >= CLEAR_M
}

/// Floor position of a candidate; `None` for a station.
pub(super) fn point(s: &Situation, candidate: usize) -> Option<Point2<f64>> {
    match &s.candidates[candidate].place {
        Place::Pose(pose) => Some(pose.point()),
        Place::Station(_) => None,
    }
}
