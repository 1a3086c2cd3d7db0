//! Next-best scan: the pose from which a scan is expected to settle most of the undetermined
//! outline.
//!
//! A place may belong to the thing if no scan looked past it on either side and none looked through it. What of these places lies outside the hull of the
//! readings is undetermined: constraints that the thing may still violate. A scan from elsewhere, if the thing is as its hull, looks past or through some of them.

use super::scan::{direction, origin};
use super::shape::ShapeModel;
use crate::hull::Hull;
use nalgebra::{Isometry2, Point2, Point3};

/// Options for undetermined cells.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct NextOptions {
    /// Edge of the square around the hull's centre that contains the object, metres.
    pub within_m: f64,
    /// Edge of a cell, metres.
    pub cell_m: f64,
    /// Angular resolution of the laser, radians: spacing of a bound from the object.
    pub step_rad: f64,
    /// Depth resolution of readings, metres.
    pub depth_m: f64,
}

impl Default for NextOptions {
    fn default() -> Self {
        NextOptions { within_m: 2.0, cell_m: 0.02, step_rad: std::f64::consts::PI / 180.0, depth_m: 0.03 }
    }
}

/// Cells along the square's edge, at the most.
const MOST_ACROSS: f64 = 2000.0;

/// Expected gain of a scan from a pose.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct NextScan {
    /// Index of the pose.
    pub index: usize,
    /// Undetermined area that the scan is expected to settle, square metres.
    pub settles_m2: f64,
    /// Undetermined area that is expected to stay, square metres.
    pub leaves_m2: f64,
}

/// Area beyond the hull of the readings that may belong to the object, square metres.
pub fn undetermined_m2(model: &ShapeModel, options: &NextOptions) -> f64 {
    undetermined(model, &model.hull(), options).len() as f64 * options.cell_m * options.cell_m
}

/// Expected gain of scans from several poses, jointly and separately.
#[derive(Clone, Debug, PartialEq)]
pub struct ScanGain {
    /// Perimeter of the hull of all hits, metres.
    pub perimeter_m: f64,
    cell_m2: f64,
    open: usize,
    /// The undetermined cells that a scan from each pose is expected to settle, by pose.
    settles: Vec<Vec<u32>>,
}

impl ScanGain {
    /// Undetermined cells of a model, and those that scans from the given laser poses (model frame)
    /// would settle.
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

    /// The undetermined area after scans from some of the poses, square metres.
    pub fn leaves_m2(&self, poses: &[usize]) -> f64 {
        let mut settled = vec![false; self.open];
        for &cell in poses.iter().flat_map(|&pose| &self.settles[pose]) {
            settled[cell as usize] = true;
        }
        settled.iter().filter(|is| !**is).count() as f64 * self.cell_m2
    }

    /// Mean distance by which the object may exceed its measured outline after scans from the given
    /// poses, metres.
    pub fn looseness_m(&self, poses: &[usize]) -> f64 {
        self.leaves_m2(poses) / self.perimeter_m
    }
}

/// Ranks laser poses (model frame) by the expected settled area of a scan, best first, ties in list
/// order.
///
/// Whether a pose can be reached, and what that costs, is for the caller to weigh.
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

/// Centres of the cells outside the hull that no scan looked past or through.
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

/// True if a reading next to a cell's direction ended beyond the cell.
fn through(points: &[Point2<f64>], place: &Point2<f64>, options: &NextOptions) -> bool {
    let range_m = place.coords.norm();
    points.iter().any(|p| {
        let beside = p.coords.perp(&place.coords).abs() <= 0.5 * options.step_rad * range_m * p.coords.norm();
        beside && p.coords.norm() > range_m + options.depth_m && p.coords.dot(&place.coords) > 0.0
    })
}

/// True if a scan from here would look past or through the cell, if the object were its hull.
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
