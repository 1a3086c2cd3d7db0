//! Viewpoints around a novel object, and routes from one to the next (Fäulhammer et al., section IV-A).

use std::collections::BTreeMap;

use descry_perception::learning::{AroundOptions, stands, trajectories};
use descry_perception::nalgebra::{Point2, Point3};
use descry_robots::{Place, Pose2, Robot};

use super::news::Novelty;
use crate::mind::Mind;
use crate::situation::Situation;
use crate::viewpoint::Candidate;

/// Number of lines around an object, on each of which a viewpoint is sought: one every 30 degrees
/// (paper: 20 lines, and a view every 15 degrees).
const LINES: usize = 12;
/// Height band of obstacles to the body, metres; with a tilt error of two degrees, the floor two
/// metres away seems as high as the lower bound.
const BAND_M: (f64, f64) = (0.15, 1.5);
/// Minimum number of returns of one view in a grid cell for the cell to be occupied; at depth edges,
/// single returns hang in the air.
const RETURNS: usize = 8;
/// Edge length of the grid cells of obstacles, metres.
const CELL_M: f32 = 0.05;
/// Clearance between the footprint and observed obstacles, metres: about two standard deviations of
/// localisation.
const CLEAR_M: f64 = 0.06;

/// Finds viewpoints around a point, one per line (`None` where the body does not fit), and adds them as
/// candidates. The second list is true where the route from a viewpoint to the next is no detour.
pub(super) fn make(
    mind: &mut Mind,
    robot: &dyn Robot,
    name: &str,
    centre: &Point3<f64>,
    seen: &[Point3<f32>],
) -> (Vec<Option<String>>, Vec<bool>) {
    let options = AroundOptions {
        lines: LINES,
        band_m: BAND_M,
        footprint_m: robot.description().radius_m() + CLEAR_M,
        ..AroundOptions::default()
    };
    let found = stands(centre, &obstacles(robot, centre, seen, options.most_m), &options).unwrap_or_default();
    let place = |p: &Point2<f64>| Place::Pose(Pose2::facing(p.x, p.y, &centre.xy()));
    let places: Vec<Vec<Place>> = found.iter().map(|line| line.iter().map(place).collect()).collect();
    let here = &mind.known.candidates[mind.known.at].place;
    let mut ways = mind.known.own_map.travel(robot, here, &places.concat(), &[]).into_iter();
    // Of each line all ways are taken off, also those behind the first that leads there.
    let mut reached = |line: Vec<Place>| -> Vec<Place> {
        line.into_iter().filter(|_| ways.next().is_some_and(|way| way.is_ok())).collect()
    };
    let poses: Vec<Option<Candidate>> = places
        .into_iter()
        .enumerate()
        .map(|(line, places)| {
            let place = reached(places).into_iter().next()?;
            Some(Candidate { symbol: format!("{name}-{}", line + 1), place })
        })
        .collect();
    let joined = |line: usize| {
        let (a, b) = (poses[line].as_ref()?, poses[(line + 1) % poses.len()].as_ref()?);
        let straight_m = (at(&a.place)? - at(&b.place)?).norm();
        let way =
            mind.known.own_map.travel(robot, &a.place, std::slice::from_ref(&b.place), &[]).pop()?.ok()?;
        Some(way.distance_m <= options.detour * straight_m)
    };
    let joined = (0..poses.len()).map(|line| joined(line).unwrap_or(false)).collect();
    mind.known.candidates.extend(poses.iter().flatten().cloned());
    (poses.into_iter().map(|pose| pose.map(|p| p.symbol)).collect(), joined)
}

/// Floor position of a place; `None` for a station.
fn at(place: &Place) -> Option<Point2<f64>> {
    match place {
        Place::Pose(pose) => Some(pose.point()),
        Place::Station(_) => None,
    }
}

/// Points of obstacles within `within_m` + 1 metres of a place: observed points in the height band, and
/// the occupied cells of the body's map.
fn obstacles(
    robot: &dyn Robot,
    centre: &Point3<f64>,
    seen: &[Point3<f32>],
    within_m: f64,
) -> Vec<Point3<f32>> {
    let near = |x: f64, y: f64| (x - centre.x).hypot(y - centre.y) < within_m + 1.0;
    let cell = |p: &Point3<f32>| [p.x, p.y].map(|c| (c / CELL_M).floor() as i32);
    let in_band = |p: &&Point3<f32>| (BAND_M.0..BAND_M.1).contains(&f64::from(p.z));
    let tall: Vec<&Point3<f32>> =
        seen.iter().filter(in_band).filter(|p| near(p.x.into(), p.y.into())).collect();
    let mut returns: BTreeMap<[i32; 2], usize> = BTreeMap::new();
    tall.iter().for_each(|p| *returns.entry(cell(p)).or_default() += 1);
    let mut all: Vec<Point3<f32>> =
        tall.into_iter().filter(|p| returns[&cell(p)] >= RETURNS).copied().collect();
    if let Some(map) = robot.map() {
        let height_m = BAND_M.0 as f32 + 0.1;
        let cells = (0..map.occupied.len()).filter(|&k| map.occupied[k]).map(|k| {
            let middle = |at: usize, low: f64| low + (at as f64 + 0.5) * map.resolution_m;
            (middle(k % map.width, map.origin_m.x), middle(k / map.width, map.origin_m.y))
        });
        all.extend(
            cells.filter(|(x, y)| near(*x, *y)).map(|(x, y)| Point3::new(x as f32, y as f32, height_m)),
        );
    }
    all
}

/// Floor position of a pose symbol; `None` for a station or an unknown symbol.
fn point(s: &Situation, pose: &str) -> Option<Point2<f64>> {
    at(&s.candidates[s.candidate(pose).ok()?].place)
}

/// Viewpoints by line; `None` where the body does not fit or a drive has failed.
fn left(s: &Situation, novelty: &Novelty) -> Vec<Option<String>> {
    let can_go = |pose: &&String| s.candidate(pose).is_ok_and(|n| !s.out_of_reach.contains(&n));
    novelty.stands.iter().map(|stand| stand.as_ref().filter(can_go).cloned()).collect()
}

/// Reachable viewpoints around the object, in sequences whose successive members are connected without a
/// detour.
fn strings(s: &Situation, novelty: &Novelty) -> Vec<Vec<String>> {
    let left = left(s, novelty);
    let places: Vec<Option<Point2<f64>>> =
        left.iter().map(|p| p.as_ref().and_then(|p| point(s, p))).collect();
    let line = |p: &Point2<f64>| places.iter().position(|at| at.as_ref() == Some(p));
    let way_m = |a: &Point2<f64>, b: &Point2<f64>| novelty.joined[line(a)?].then(|| (b - a).norm());
    let strung = trajectories(&places, 1.0, way_m);
    let named = |p: &Point2<f64>| left[line(p)?].clone();
    strung.iter().map(|string| string.iter().filter_map(named).collect()).collect()
}

/// Pairs of neighbouring viewpoints whose connecting route is no detour.
pub(super) fn neighbours(s: &Situation, novelty: &Novelty) -> Vec<(String, String)> {
    let strings = strings(s, novelty);
    let mut pairs: Vec<(String, String)> = strings
        .iter()
        .flat_map(|string| string.windows(2).map(|w| (w[0].clone(), w[1].clone())).collect::<Vec<_>>())
        .collect();
    // A ring is closed.
    if let [ring] = strings.as_slice()
        && ring.len() == novelty.stands.len()
        && let (Some(first), Some(last)) = (ring.first(), ring.last())
    {
        pairs.push((last.clone(), first.clone()));
    }
    pairs
}

/// Viewpoints that may be approached from anywhere: ends of connected sequences and, if the object is
/// next in turn, its nearest unused viewpoint.
pub(super) fn ways_in(s: &Situation, novelty: &Novelty, is_next: bool) -> Vec<String> {
    let strings = strings(s, novelty);
    let mut ends: Vec<String> =
        strings.iter().flat_map(|string| string.first().into_iter().chain(string.last())).cloned().collect();
    let way_s = |pose: &str| s.candidate(pose).map_or(f64::INFINITY, |n| s.travel_s(s.at, n));
    let closest = novelty.open_stands(s).min_by(|a, b| way_s(a).total_cmp(&way_s(b)));
    ends.extend(closest.filter(|_| is_next).cloned());
    ends.sort();
    ends.dedup();
    ends
}
