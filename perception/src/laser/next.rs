//! Next-best scan: the pose from which a scan is expected to decide most of the undetermined outline.
//!
//! A cell may belong to the object if no scan looked past or through it. Such cells outside the hull of the readings
//! are undetermined. A scan from another pose is expected to look past or through some of them; the expectation takes
//! the object to be its hull.

use super::scan::{direction, origin};
use super::shape::ShapeModel;
use crate::hull::Hull;
use nalgebra::{Isometry2, Point2, Point3};

/// Options for undetermined cells.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct NextOptions {
    /// Edge of the square around the hull's centre in which undetermined cells are counted, metres.
    pub within_m: f64,
    /// Edge of a cell, metres.
    pub cell_m: f64,
    /// Angular resolution of the laser, radians; a bound is this far from the object.
    pub step_rad: f64,
    /// Depth resolution of readings, metres.
    pub depth_m: f64,
}

impl Default for NextOptions {
    fn default() -> Self {
        NextOptions { within_m: 2.0, cell_m: 0.02, step_rad: std::f64::consts::PI / 180.0, depth_m: 0.03 }
    }
}

/// Maximum number of cells along the square's edge.
const MOST_ACROSS: f64 = 2000.0;

/// Expected gain of a scan from a pose.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct NextScan {
    /// Index of the pose.
    pub index: usize,
    /// Undetermined area that the scan is expected to decide, square metres.
    pub settles_m2: f64,
    /// Undetermined area that is expected to remain, square metres.
    pub leaves_m2: f64,
}

/// Area outside the hull of the readings that may still belong to the object, square metres.
pub fn undetermined_m2(model: &ShapeModel, options: &NextOptions) -> f64 {
    undetermined(model, &model.hull(), options).len() as f64 * options.cell_m * options.cell_m
}

/// Expected gain of scans from several poses, jointly and separately.
#[derive(Clone, Debug, PartialEq)]
pub struct ScanGain {
    /// Perimeter of the hull of all readings, metres.
    pub perimeter_m: f64,
    cell_m2: f64,
    open: usize,
    /// Indices of the undetermined cells that a scan is expected to decide, for each pose.
    settles: Vec<Vec<u32>>,
}

impl ScanGain {
    /// Computes the undetermined cells of a model, and which of them scans from the given laser poses (model frame) are
    /// expected to decide.
    pub fn new(model: &ShapeModel, poses: &[Isometry2<f64>], options: &NextOptions) -> ScanGain {
        let _span = tracing::debug_span!("outlook", poses = poses.len()).entered();
        let hull = model.hull();
        let open = undetermined(model, &hull, options);
        let settled = |pose: &Isometry2<f64>| {
            let laser = origin(pose);
            let cells = (0u32..).zip(&open).filter(|(_, cell)| settles(&laser, cell, &hull, options));
            cells.map(|(index, _)| index).collect()
        };
        ScanGain {
            perimeter_m: hull.perimeter_m(),
            cell_m2: options.cell_m * options.cell_m,
            open: open.len(),
            settles: poses.iter().map(settled).collect(),
        }
    }

    /// Undetermined area that is expected to remain after scans from some of the poses (by index), square metres.
    pub fn leaves_m2(&self, poses: &[usize]) -> f64 {
        let mut settled = vec![false; self.open];
        for &cell in poses.iter().flat_map(|&pose| &self.settles[pose]) {
            settled[cell as usize] = true;
        }
        settled.iter().filter(|is| !**is).count() as f64 * self.cell_m2
    }

    /// Mean distance by which the object may exceed its measured outline after scans from some of the poses (by index),
    /// metres.
    pub fn looseness_m(&self, poses: &[usize]) -> f64 {
        self.leaves_m2(poses) / self.perimeter_m
    }
}

/// Ranks laser poses (model frame) by the area that a scan is expected to decide, best first, ties in the given order.
///
/// Reachability and cost of the poses are left to the caller.
pub fn next_scan(model: &ShapeModel, poses: &[Isometry2<f64>], options: &NextOptions) -> Vec<NextScan> {
    let outlook = ScanGain::new(model, poses, options);
    let all_m2 = outlook.leaves_m2(&[]);
    let of = |index: usize| {
        let leaves_m2 = outlook.leaves_m2(&[index]);
        NextScan { index, settles_m2: all_m2 - leaves_m2, leaves_m2 }
    };
    let mut ranked: Vec<NextScan> = (0..poses.len()).map(of).collect();
    ranked.sort_by(|a, b| b.settles_m2.total_cmp(&a.settles_m2).then(a.index.cmp(&b.index)));
    ranked
}

/// Centres of the undetermined cells: outside the hull, and no scan looked past or through them.
fn undetermined(model: &ShapeModel, hull: &Hull, options: &NextOptions) -> Vec<Point2<f64>> {
    let centre = hull.centre();
    let across = (options.within_m / options.cell_m).ceil().clamp(0.0, MOST_ACROSS) as usize;
    let at = |i: usize| (i as f64 + 0.5 - 0.5 * across as f64) * options.cell_m;
    let lasers: Vec<Isometry2<f64>> = model.scans().iter().map(|s| s.model_from_laser.inverse()).collect();
    let open = |place: &Point2<f64>| {
        model.scans().iter().zip(&lasers).all(|(s, laser_from_model)| {
            let seen = laser_from_model * place;
            let scan = &s.scan;
            let past = direction(scan.left_bound_rad).perp(&seen.coords) > 0.0
                || direction(scan.right_bound_rad).perp(&seen.coords) < 0.0;
            !past && !through(&scan.points, &seen, options)
        })
    };
    (0..across)
        .flat_map(|row| (0..across).map(move |column| Point2::new(at(column), at(row)) + centre.coords))
        .filter(|place| hull.distance_m(&Point3::new(place.x, place.y, 0.0)) > 0.0 && open(place))
        .collect()
}

/// True if a reading in about the direction of a cell (laser frame) ended beyond the cell.
fn through(points: &[Point2<f64>], place: &Point2<f64>, options: &NextOptions) -> bool {
    let range_m = place.coords.norm();
    points.iter().any(|p| {
        let beside = p.coords.perp(&place.coords).abs() <= 0.5 * options.step_rad * range_m * p.coords.norm();
        beside && p.coords.norm() > range_m + options.depth_m && p.coords.dot(&place.coords) > 0.0
    })
}

/// True if a scan from `laser` would look past or through a cell, if the object were its hull.
fn settles(laser: &Point2<f64>, place: &Point2<f64>, hull: &Hull, options: &NextOptions) -> bool {
    let towards = place - laser;
    let middle = hull.centre() - laser;
    let angle = |v: nalgebra::Vector2<f64>| middle.perp(&v).atan2(middle.dot(&v));
    let angles = hull.corners.iter().map(|c| angle(c - laser));
    let (right, left) = angles.fold((0.0_f64, 0.0_f64), |(r, l), a| (r.min(a), l.max(a)));
    let own = angle(towards);
    if own > left + options.step_rad || own < right - options.step_rad {
        return true;
    }
    // In front: the way from the laser to a little behind the place meets no side of the hull.
    let end = place + towards.normalize() * options.depth_m;
    let n = hull.corners.len();
    let crosses = (0..n).any(|i| {
        let (a, b) = (hull.corners[i], hull.corners[(i + 1) % n]);
        let side = |p: &Point2<f64>, q: &Point2<f64>, r: &Point2<f64>| (q - p).perp(&(r - p));
        side(laser, &end, &a) * side(laser, &end, &b) < 0.0 && side(&a, &b, laser) * side(&a, &b, &end) < 0.0
    });
    !crosses && own >= right && own <= left
}
