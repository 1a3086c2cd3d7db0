//! Angular constraints between scans, and their violation by poses (Eq. 1 to 3).
//!
//! All errors are distances of points from lines, for the worst or the best point of a scan; either is always a corner
//! of the scan's convex hull.

use super::scan::direction;
use super::shape::PosedScan;
use crate::hull::convex;
use nalgebra::{Isometry2, Point2, Vector2};
use serde::Serialize;

/// Amount by which poses of scans violate the angular constraints.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Violation {
    /// Boundary violation (BV): sum of the squared errors over ordered pairs of scans (Eq. 3), square metres.
    pub boundary_m2: f64,
    /// Largest exterior error (Eq. 1), metres.
    pub exterior_m: f64,
    /// Largest interior error (Eq. 2), metres.
    pub interior_m: f64,
    /// Number of ordered pairs of compared scans.
    pub pairs: usize,
}

impl Violation {
    /// Root of the boundary violation per pair of scans, metres; comparable between different numbers of scans.
    pub fn per_pair_m(&self) -> f64 {
        (self.boundary_m2 / self.pairs.max(1) as f64).sqrt()
    }
}

/// Scan prepared for comparison.
#[derive(Clone, Debug)]
struct Part {
    /// Index of the group of rigidly connected scans.
    group: usize,
    /// Index of the scan's first corner in `Assembly::corners`.
    begin: usize,
    /// Index behind the scan's last corner.
    end: usize,
    /// True if both bounds are near the object; otherwise the scan may have missed an end, and its points need not
    /// reach the extent seen by others.
    is_whole: bool,
}

/// Angle between a bound and the object's last reading beyond which the bound does not constrain the end, radians.
const FAR_RAD: f64 = 0.2;

/// End of the object in a scan.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum ScanEnd {
    /// Left end, as seen from the laser.
    Left,
    /// Right end, as seen from the laser.
    Right,
}

/// Position of a scan's laser, direction of the middle between its bounds, and unit normals of its bounding lines,
/// pointing away from the object.
#[derive(Clone, Copy, Debug)]
struct Rays {
    laser: Point2<f64>,
    middle: Vector2<f64>,
    left_bound: Vector2<f64>,
    right_bound: Vector2<f64>,
    left_object: Vector2<f64>,
    right_object: Vector2<f64>,
}

impl Rays {
    fn map(
        &self,
        at: impl Fn(&Point2<f64>) -> Point2<f64>,
        turn: impl Fn(&Vector2<f64>) -> Vector2<f64>,
    ) -> Rays {
        Rays {
            laser: at(&self.laser),
            middle: turn(&self.middle),
            left_bound: turn(&self.left_bound),
            right_bound: turn(&self.right_bound),
            left_object: turn(&self.left_object),
            right_object: turn(&self.right_object),
        }
    }

    /// End of the object that the scan of a laser at `other` must reach (Eq. 2), with the normals of the object ray and
    /// of the bound on that side; `None` if `other` lies between the bounds and need not see either end.
    fn facing(&self, other: &Point2<f64>) -> Option<(ScanEnd, Vector2<f64>, Vector2<f64>)> {
        let towards = other - self.laser;
        let side = self.middle.perp(&towards);
        if side < 0.0 && self.right_bound.dot(&towards) > 0.0 {
            Some((ScanEnd::Right, self.right_object, self.right_bound))
        } else if side > 0.0 && self.left_bound.dot(&towards) > 0.0 {
            Some((ScanEnd::Left, self.left_object, self.left_bound))
        } else {
            None
        }
    }
}

/// Scans in groups; those of a group are rigidly connected.
#[derive(Clone, Debug)]
pub struct Assembly {
    parts: Vec<Part>,
    corners: Vec<Point2<f64>>,
    rays: Vec<Rays>,
    /// Pivot of each group in its own frame: mean of its corners.
    pivots: Vec<Point2<f64>>,
    /// Number of ordered pairs of scans in different groups.
    pairs: usize,
}

/// Assembly with its groups moved to given poses.
pub struct Placed {
    corners: Vec<Point2<f64>>,
    rays: Vec<Rays>,
}

/// Kind of error: exterior (Eq. 1), interior (Eq. 2), or slack, the signed distance of an end of the object from the
/// midpoint between the last hit and the first miss.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kind {
    Exterior,
    Interior,
    Slack,
}

/// Violated constraint, or slack: `value_m = normal · (at - a point of the line)`.
#[derive(Clone, Copy, Debug)]
pub struct Residual {
    pub kind: Kind,
    /// End of the object that the line bounds.
    pub side: ScanEnd,
    pub value_m: f64,
    pub normal: Vector2<f64>,
    pub at: Point2<f64>,
    /// Index of the group of the scan with the line.
    pub line: usize,
    /// Index of the group of the scan with the point.
    pub point: usize,
}

impl Assembly {
    /// Assembles groups of scans; the poses of each group are in a frame of its own.
    pub fn new<'a>(groups: impl IntoIterator<Item = &'a [PosedScan]>) -> Assembly {
        let mut assembly = Assembly {
            parts: Vec::new(),
            corners: Vec::new(),
            rays: Vec::new(),
            pivots: Vec::new(),
            pairs: 0,
        };
        for (group, scans) in groups.into_iter().enumerate() {
            let first = assembly.corners.len();
            assembly.pairs += 2 * assembly.parts.len() * scans.len();
            scans.iter().for_each(|scan| assembly.add(group, scan));
            let corners = &assembly.corners[first..];
            let sum: Vector2<f64> = corners.iter().map(|c| c.coords).sum();
            assembly.pivots.push((sum / corners.len().max(1) as f64).into());
        }
        assembly
    }

    fn add(&mut self, group: usize, posed: &PosedScan) {
        let (scan, pose) = (&posed.scan, &posed.model_from_laser);
        let begin = self.corners.len();
        self.corners.extend(convex(scan.points.clone()).iter().map(|p| pose * p));
        let gap_rad =
            (scan.left_bound_rad - scan.left_object_rad).max(scan.right_object_rad - scan.right_bound_rad);
        let is_whole = gap_rad < FAR_RAD;
        self.parts.push(Part { group, begin, end: self.corners.len(), is_whole });
        let left = |angle: f64| direction(angle + std::f64::consts::FRAC_PI_2);
        let rays = Rays {
            laser: Point2::origin(),
            middle: direction(0.5 * (scan.left_bound_rad + scan.right_bound_rad)),
            left_bound: left(scan.left_bound_rad),
            right_bound: -left(scan.right_bound_rad),
            left_object: left(scan.left_object_rad),
            right_object: -left(scan.right_object_rad),
        };
        self.rays.push(rays.map(|p| pose * p, |v| pose * v));
    }

    /// Pivot of a group in its own frame.
    pub fn pivot(&self, group: usize) -> Point2<f64> {
        self.pivots[group]
    }

    /// Moves all scans to the poses of their groups.
    pub fn placed(&self, poses: &[Isometry2<f64>]) -> Placed {
        let mut placed = Placed {
            corners: Vec::with_capacity(self.corners.len()),
            rays: Vec::with_capacity(self.rays.len()),
        };
        for (part, rays) in self.parts.iter().zip(&self.rays) {
            let turn = poses[part.group].rotation.to_rotation_matrix();
            let shift = poses[part.group].translation.vector;
            placed.corners.extend(self.corners[part.begin..part.end].iter().map(|c| turn * c + shift));
            placed.rays.push(rays.map(|p| turn * p + shift, |v| turn * v));
        }
        placed
    }

    /// Calls `each` for every violated constraint and every slack between scans of different groups; see [`farthest`]
    /// for `soft_m`.
    pub fn residuals(&self, placed: &Placed, soft_m: f64, mut each: impl FnMut(Residual)) {
        for (of_line, rays) in self.parts.iter().zip(&placed.rays) {
            for (of_points, other) in self.parts.iter().zip(&placed.rays) {
                if of_line.group != of_points.group {
                    let corners = &placed.corners[of_points.begin..of_points.end];
                    let from = of_points.is_whole.then_some(&other.laser);
                    errors(rays, from, corners, soft_m, |(kind, side), value_m, normal, at| {
                        each(Residual {
                            kind,
                            side,
                            value_m,
                            normal,
                            at,
                            line: of_line.group,
                            point: of_points.group,
                        })
                    });
                }
            }
        }
    }

    /// Violation at poses of the groups.
    pub fn violation(&self, poses: &[Isometry2<f64>]) -> Violation {
        let mut violation = Violation { pairs: self.pairs, ..Violation::default() };
        self.residuals(&self.placed(poses), 0.0, |r| {
            let longest = match r.kind {
                Kind::Exterior => &mut violation.exterior_m,
                Kind::Interior => &mut violation.interior_m,
                Kind::Slack => return,
            };
            violation.boundary_m2 += r.value_m * r.value_m;
            *longest = longest.max(r.value_m);
        });
        violation
    }
}

/// Calls `each` for the errors of points against a scan's lines, without zeros. `whole`: laser position of the points'
/// scan if that scan saw both ends, else `None`.
#[inline(always)]
fn errors(
    rays: &Rays,
    whole: Option<&Point2<f64>>,
    corners: &[Point2<f64>],
    soft_m: f64,
    mut each: impl FnMut((Kind, ScanEnd), f64, Vector2<f64>, Point2<f64>),
) {
    // Eq. 1, left and right: the point farthest beyond the bound.
    for (side, bound) in [(ScanEnd::Left, rays.left_bound), (ScanEnd::Right, rays.right_bound)] {
        let (beyond, at) = farthest(&bound, &rays.laser, corners, soft_m);
        if beyond > 0.0 {
            each((Kind::Exterior, side), beyond, bound, at);
        }
    }
    // Eq. 2: some point must reach the object ray; the one that lacks least.
    if let Some((side, object, bound)) = whole.and_then(|other| rays.facing(other)) {
        let (beyond, at) = farthest(&object, &rays.laser, corners, soft_m);
        if beyond < 0.0 {
            each((Kind::Interior, side), -beyond, -object, at);
        }
        let between = (object + bound).normalize();
        let (beyond, at) = farthest(&between, &rays.laser, corners, soft_m);
        each((Kind::Slack, side), beyond, between, at);
    }
}

/// Farthest point along a normal from `from`, and its distance.
///
/// If `soft_m` is positive: mean of points, each with a weight that falls to zero where it is nearer than the farthest
/// point by `soft_m`. The result then changes continuously when another point becomes the farthest, as derivatives
/// require.
#[inline(always)]
fn farthest(
    normal: &Vector2<f64>,
    from: &Point2<f64>,
    points: &[Point2<f64>],
    soft_m: f64,
) -> (f64, Point2<f64>) {
    let along = |p: &Point2<f64>| normal.dot(&(p - from));
    let (mut most, mut at) = (f64::NEG_INFINITY, *from);
    for p in points {
        let distance = along(p);
        if distance > most {
            (most, at) = (distance, *p);
        }
    }
    if soft_m <= 0.0 {
        return (most, at);
    }
    let (mut weights, mut sum) = (0.0, Vector2::zeros());
    for p in points {
        let weight = (1.0 - (most - along(p)) / soft_m).max(0.0).powi(2);
        weights += weight;
        sum += p.coords * weight;
    }
    let mean = Point2::from(sum / weights);
    (along(&mean), mean)
}
