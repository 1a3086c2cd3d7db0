//! Perception of a laser sweep: recorded, read back by its timestamp, separated from the map, and
//! assigned to objects.

use std::sync::Arc;

use descry_memory::{Meta, RecordId};
use descry_perception::laser::{
    Alignment, Cluster, FitOptions, NextOptions, Objective, ObserveError, ObserveOptions, Occupancy,
    RecogniseOptions, Recognition, Scan, ScanGain, SolverOptions, Space, Verdict, align_consistent, observe,
    recognise_scans, things,
};
use descry_perception::nalgebra::{Isometry2, Point2, Vector2};
use descry_robots::{Description, OccupancyGrid, Place, Scanned};
use serde_json::json;

use super::floor::{Floor, Outline, THIS, least_width_m, place};
use super::poses;
use crate::abilities::shapes::floor::FloorThing;
use crate::error::WorldError;
use crate::eyes::Eyes;
use crate::mind::Mind;
use crate::note::{Note, OnTheFloor};
use crate::situation::Situation;
use crate::symbol::symbol;

/// Minimum distance of a reading in front of the mapped obstacle to belong to an object, metres;
/// twice the localisation error is added.
const BEFORE_MAP_M: f64 = 0.1;
/// Maximum distance of an object from the laser in a usable scan, metres.
const NEAR_M: f64 = 3.0;
/// Minimum number of readings of an object in a usable scan.
const LEAST_READINGS: usize = 5;
/// Maximum distance of a cluster of readings from the believed outline of the object that it belongs to,
/// metres.
const SAME_M: f64 = 0.5;
/// Half width assumed for an object with few readings, metres.
const USUAL_RADIUS_M: f64 = 0.2;
/// Alignment error beyond which scans contradict each other, metres: twice the laser's precision.
pub(super) const LONGEST_M: f64 = 0.02;

/// Options for aligning scans, from the body's localisation accuracy.
pub(super) fn solver(body: &Description) -> SolverOptions {
    let objective =
        Objective::Centred { pose_sigma_m: body.pose_sigma_m, pose_sigma_rad: body.pose_sigma_rad };
    SolverOptions { objective, ..SolverOptions::default() }
}

/// Processes a sweep and records it.
pub(super) fn take(
    mind: &mut Mind,
    eyes: Eyes<'_>,
    from: &str,
    scanned: &Scanned,
) -> Result<Note, WorldError> {
    let scan = remember(mind, eyes, from, scanned)?;
    let body = eyes.robot.description();
    let map = eyes.robot.map().map(occupancy);
    let laser = scan.map_from_laser.translation.vector;
    let is_background = |p: &Point2<f64>| {
        let off_m = body.pose_sigma_m + (p.coords - laser).norm() * body.pose_sigma_rad;
        map.as_ref().is_none_or(|map| map.is_background(p, BEFORE_MAP_M + 2.0 * off_m))
    };
    let strange = |e: ObserveError| WorldError::Bug(format!("a sweep of the laser: {e}"));
    // A single reading before what the map shows is of something, too.
    let options = ObserveOptions { least: 1, ..ObserveOptions::default() };
    let clusters = things(&scan, is_background, &options).map_err(strange)?;
    let mut changed: Vec<usize> = Vec::new();
    for cluster in nearest_first(clusters, &laser) {
        let index = assign(mind.known.floor_mut(), &cluster, &laser);
        if make_ring(mind, eyes, index) {
            changed.push(index);
        }
        if (cluster.middle.coords - laser).norm() > NEAR_M || cluster.readings.len() < LEAST_READINGS {
            continue;
        }
        let only = ObserveOptions { within_m: 1e-3, ..options };
        let seen =
            observe(std::slice::from_ref(&scan), &cluster.middle, is_background, &only).map_err(strange)?;
        let thing = &mut mind.known.floor_mut().things[index];
        thing.ignored.extend(seen.ignored.into_iter().map(|(_, why)| (from.to_string(), why)));
        for posed in seen.scans {
            thing.scans.push((from.to_string(), posed));
            thing.taken_for = None;
            changed.push(index);
        }
    }
    for index in changed {
        bring_together(mind, eyes, index);
    }
    look_over_floor(mind, eyes, &scan);
    Ok(note(mind.known.floor(), from))
}

/// Records a sweep with its transforms, and reads it back by its timestamp.
fn remember(mind: &mut Mind, eyes: Eyes<'_>, from: &str, scanned: &Scanned) -> Result<Scan, WorldError> {
    let (record, body) = (eyes.record, eyes.robot.description());
    for t in &scanned.transforms {
        record.put_transform_soon(t.stamp_ns, &t.parent, &t.child, &t.parent_from_child)?;
    }
    let frame = body.laser.as_ref().map_or("laser", |laser| laser.frame.as_str());
    let at = scanned.scan.map_from_laser.translation.vector;
    let meta =
        Meta { seen_from_m: Some([at.x, at.y, 0.0]), body: json!({ "from": from }), ..Meta::default() };
    let id = record.put_scan(scanned.stamp_ns, frame, &scanned.scan, meta)?;
    mind.views += 1;
    let floor = mind.known.floor_mut();
    floor.sweeps.push((scanned.stamp_ns, from.into()));
    floor.records.push(id);
    let records: &[RecordId] = &floor.records;
    record.hold(records, "scans")?;
    Ok(record.scan_at(scanned.stamp_ns, &body.frames.map)?)
}

/// Occupancy map in the type that perception uses, with a border of occupied cells added.
fn occupancy(grid: &OccupancyGrid) -> Occupancy {
    let width = grid.width + 2;
    let taken = |row: usize, column: usize| {
        let edge = row == 0 || column == 0 || row > grid.height || column > grid.width;
        edge || grid.occupied[(row - 1) * grid.width + column - 1]
    };
    let cells = (0..grid.height + 2).flat_map(|row| (0..width).map(move |column| (row, column)));
    let space = |(row, column)| if taken(row, column) { Space::Occupied } else { Space::Free };
    Occupancy {
        origin: grid.origin_m - Vector2::repeat(grid.resolution_m),
        cell_m: grid.resolution_m,
        width,
        cells: cells.map(space).collect(),
    }
}

fn nearest_first(mut clusters: Vec<Cluster>, laser: &Vector2<f64>) -> Vec<Cluster> {
    clusters.sort_by(|a, b| (a.middle.coords - laser).norm().total_cmp(&(b.middle.coords - laser).norm()));
    clusters
}

/// Index of the object that a cluster of readings belongs to: one detected earlier, or else a new one.
fn assign(floor: &mut Floor, cluster: &Cluster, laser: &Vector2<f64>) -> usize {
    let off_m = |t: &FloorThing| {
        let (middle, width_m) = place(floor, t);
        (middle - cluster.middle).norm() - 0.5 * width_m
    };
    let nearest = floor.things.iter().enumerate().map(|(n, t)| (n, off_m(t)));
    if let Some((n, _)) = nearest.min_by(|a, b| a.1.total_cmp(&b.1)).filter(|(_, off_m)| *off_m <= SAME_M) {
        return n;
    }
    let behind = (cluster.middle.coords - laser).try_normalize(1e-9).unwrap_or_default() * USUAL_RADIUS_M;
    let number = floor.things.len() + 1;
    floor.things.push(FloorThing {
        symbol: if number == 1 { THIS.into() } else { format!("thing-{number}") },
        near: cluster.middle + behind,
        scans: Vec::new(),
        ignored: Vec::new(),
        ring: Vec::new(),
        outline: None,
        taken_for: None,
    });
    number - 1
}

/// Adds viewpoints around an object that the goal is about, unless it has some; true if added.
fn make_ring(mind: &mut Mind, eyes: Eyes<'_>, index: usize) -> bool {
    let thing = &mind.known.floor().things[index];
    let is_asked = !mind.known.floor().sought.is_empty() || thing.symbol == THIS;
    if !is_asked || !thing.ring.is_empty() {
        return false;
    }
    let (name, near, config) = (thing.symbol.clone(), thing.near, mind.known.floor().poses);
    let ring = poses::around(mind, eyes.robot, &config, &name, &near);
    mind.known.floor_mut().things[index].ring = ring;
    true
}

/// Aligns the scans of an object, and computes the expected gain of further scans; without alignment,
/// nothing changes.
fn bring_together(mind: &mut Mind, eyes: Eyes<'_>, index: usize) {
    let thing = &mind.known.floor().things[index];
    let scans: Vec<_> = thing.scans.iter().map(|(_, posed)| posed.clone()).collect();
    let Ok(alignment) = align_consistent(&scans, LONGEST_M, &solver(eyes.robot.description())) else {
        return;
    };
    let known = &mind.known;
    let pose = |symbol: &String| known.candidates.iter().find(|c| c.symbol == *symbol);
    let lasers: Vec<Isometry2<f64>> = thing
        .ring
        .iter()
        .filter_map(|p| match &pose(p)?.place {
            Place::Pose(pose) => Some(Isometry2::new(pose.point().coords, pose.yaw_rad)),
            Place::Station(_) => None,
        })
        .collect();
    let outlook = ScanGain::new(&alignment.model, &lasers, &NextOptions::default());
    let thing = &mut mind.known.floor_mut().things[index];
    thing.outline = Some(Arc::new(Outline { alignment, outlook }));
}

/// Recognises the shape of aligned scans; scans that contradict each other rule out no known shape.
pub(super) fn recognise(s: &Situation, alignment: &Alignment, loose_m: f64) -> Recognition {
    let options = RecogniseOptions {
        fit: FitOptions { solver: solver(s.robot.description()), ..FitOptions::default() },
        ..RecogniseOptions::default()
    };
    if alignment.longest_m() > LONGEST_M {
        // What contradicts itself is nothing that anybody has learned: more scans must tell.
        let may_be: Vec<String> = s.floor().known.iter().map(|k| k.name.clone()).collect();
        let verdict = Verdict::OneOf(may_be.clone());
        return Recognition { verdict, candidates: Vec::new(), ruled_out: 0, may_be };
    }
    recognise_scans(&alignment.model, loose_m, &s.floor().known, &options)
}

/// Clause on scans, and ends of scans, that contradict the others; empty if none do.
pub(super) fn contradict(alignment: &Alignment) -> String {
    let scans = match alignment.left_out.len() {
        0 => String::new(),
        n => format!("; {n} scans contradict the others and are left out"),
    };
    let ends = match alignment.opened.len() {
        0 => String::new(),
        n => format!("; {n} ends of scans contradict the others and bound nothing"),
    };
    scans + &ends
}

/// Updates the unobserved floor, the room left there for a sought shape, and the poses that would show
/// that room.
fn look_over_floor(mind: &mut Mind, eyes: Eyes<'_>, scan: &Scan) {
    let reach_m = eyes.robot.description().laser.as_ref().map_or(0.0, |laser| laser.reach_m);
    let known = &mut mind.known;
    let floor: &mut Floor = known.states.get_mut();
    floor.unseen.pass(scan, reach_m);
    let places: Vec<(Point2<f64>, f64)> = floor.things.iter().map(|t| place(floor, t)).collect();
    for (middle, width_m) in &places {
        floor.unseen.know(middle, 0.5 * width_m);
    }
    let Some(radius_m) = floor.sought_radius_m() else { return };
    floor.room = floor.unseen.room_for(radius_m);
    let discs: Vec<_> = places.iter().map(|(middle, width_m)| (*middle, 0.4 * width_m)).collect();
    let passes = |place: &Place| match place {
        Place::Pose(pose) => {
            let heading = Vector2::new(pose.yaw_rad.cos(), pose.yaw_rad.sin());
            floor.unseen.would_pass(&pose.point(), &heading, reach_m, &floor.room, &discs)
        }
        Place::Station(_) => false,
    };
    floor.promising =
        known.candidates.iter().filter(|c| passes(&c.place)).map(|c| c.symbol.clone()).collect();
}

impl Floor {
    /// Radius of the largest disc inside the smallest sought shape, metres, slightly reduced for its
    /// uncertainty; `None` if no sought shape is known.
    fn sought_radius_m(&self) -> Option<f64> {
        let of = self.known.iter().filter(|k| self.sought.contains(&symbol(&k.name)));
        let least = of.map(|k| least_width_m(&k.model.hull().corners)).reduce(f64::min)?;
        Some(0.4 * least)
    }
}

fn note(floor: &Floor, from: &str) -> Note {
    let scans = |t: &FloorThing| match t.scans.len() {
        0 => "seen from afar".into(),
        1 => "1 scan".to_string(),
        n => format!("{n} scans"),
    };
    let line = |t: &FloorThing| {
        let (middle, _) = place(floor, t);
        let why = t.ignored.iter().filter(|(pose, _)| pose == from);
        let why: String = why.map(|(_, why)| format!("; this one is left out: {why}")).collect();
        let loose = match &t.outline {
            Some(_) => format!(", may reach {:.1} cm beyond what was met", 1e2 * t.looseness_m()),
            None => String::new(),
        };
        let text = format!("{} at ({:.2}, {:.2}) m: {}{loose}{why}", t.symbol, middle.x, middle.y, scans(t));
        OnTheFloor::Thing { text, is_far: t.scans.is_empty() }
    };
    Note::Swept { things: floor.things.iter().map(line).collect() }
}
