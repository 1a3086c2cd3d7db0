//! Known round bodies on or in another object, segmented together with it.
//!
//! The height map of a segment is searched for circles with the radius of a known body along which
//! the height drops. The points around such a circle show the height of the body's support, or the
//! vessel that it stands in.

use super::model::{ObjectModel, Range, Shape};
use crate::round::{self, Round, SECTORS, distance, sector};
use crate::scale::{APART_M, EDGE_M, HANDLE_M, PLACE_M, SHAPE_M};
use crate::segment::stand::BOTTOM_M;
use crate::segment::{Scene, Segment, bounds, top_m};
use crate::surface::floor;
use nalgebra::Point3;

/// Side of a cell of the height map, metres. From: derived, no edge is known better than within a place.
const CELL_M: f64 = PLACE_M;
/// Minimum drop of height at the edge of a body's top, metres. From: derived, two points farther
/// apart are in two places.
const DROP_M: f64 = APART_M;
/// Minimum share of a circle with a height drop for a body to be sought there. From: chosen, a
/// single view shows half of a top.
const CIRCLE: f64 = 0.5;
/// Step of the tried radii, metres. From: derived, half a cell.
const RADII_M: f64 = EDGE_M;
/// Maximum number of circles followed up per segment. From: work.
const MOST: usize = 3;
/// Minimum and maximum distance from a body in which its surroundings are searched, metres.
/// From: chosen, no nearer than an edge is known.
const AROUND_M: (f64, f64) = (EDGE_M + SHAPE_M, 0.02);
/// Minimum number of directions (of 36) around a body in which its support is seen. From: chosen, a
/// single view shows half of what is around a foot.
const BEARS: usize = 9;
/// Minimum number of directions in which a level is seen, as a share of that of the most seen
/// level; the highest such level is the support. From: chosen, nearly all.
const NEARLY: f64 = 0.8;
/// Standard deviation of the support's height, metres. From: derived, a place.
const LEVEL_SIGMA_M: f64 = PLACE_M;
/// Minimum number of directions (of 36) in which a vessel must be seen around a body that stands in
/// it. From: chosen.
const ALL_AROUND: usize = 27;
/// Minimum number of directions (of 36) in which a level must be seen right beside the foot for
/// that level, not the bottom of a vessel, to be the support. From: chosen.
const BORNE: usize = 14;
/// Height below the top within which points determine the axis, as a share of the height of the
/// lowest known body. From: chosen.
const SIDE: f64 = 0.8;
/// Minimum share of the points around the circle's side that lie on the fitted body. From: chosen,
/// more than half.
const ON_SIDE: f64 = 0.55;
/// Maximum distance of a handle's points from the body, metres. From: derived, the greatest reach
/// of one.
const REACH_M: f64 = HANDLE_M.1;

/// Minimum number of remaining points that form an object of their own. From: derived, the fewest
/// of a segment.
const FEWEST_LEFT: usize = 60;

/// Body found in a segment, and the remaining points.
pub(super) struct Resting {
    pub body: Segment,
    pub rest: Segment,
    /// True if the remaining points are a vessel in which the body stands.
    pub is_within: bool,
}

/// A circle in the height map along which the height drops.
#[derive(Clone, Copy, Debug)]
struct Circle {
    x: f64,
    y: f64,
    radius_m: f64,
    top_m: f64,
    /// Share of the circle with a height drop.
    share: f64,
}

/// Radii of the known round bodies, and a lower bound of their heights, metres.
pub(super) struct Rounds {
    radii_m: Vec<f64>,
    least_m: f64,
}

impl Rounds {
    pub fn of(models: &[ObjectModel]) -> Rounds {
        let rounds = || models.iter().filter(|model| model.shape == Shape::Round);
        let steps = |Range { low, high }: Range| {
            let count = (0.5 * (high - low) / RADII_M).ceil() as usize;
            (0..=count).map(move |n| 0.5 * low + 0.5 * (high - low) * n as f64 / count.max(1) as f64)
        };
        let mut radii_m: Vec<f64> = rounds().filter_map(|model| model.diameter_m).flat_map(steps).collect();
        radii_m.sort_by(f64::total_cmp);
        radii_m.dedup_by(|b, a| *b - *a < 0.5 * RADII_M);
        let least_m = rounds().map(|model| model.height_m.low).fold(f64::INFINITY, f64::min) - APART_M;
        Rounds { radii_m, least_m }
    }
}

/// Finds bodies with one of the given radii on or in a segment; `sigma_m`: standard deviation of a
/// measurement, metres.
pub(super) fn seek(segment: &Segment, models: &Rounds, sigma_m: f64) -> Vec<Resting> {
    let Some(map) = HeightMap::of(segment) else { return Vec::new() };
    let circles = map.circles(&models.radii_m);
    circles.iter().filter_map(|circle| resting(segment, circle, models.least_m, sigma_m)).collect()
}

/// Segment `of` moved onto the bottom of another segment, a possible vessel that surrounds its
/// foot, with the vessel's index; `None` if there is none.
pub(super) fn in_vessel(scene: &Scene, of: usize, sigma_m: f64) -> Option<(Segment, usize)> {
    let segment = &scene.segments[of];
    if segment.base_m < BOTTOM_M.0 + PLACE_M {
        return None;
    }
    let axis = round::fit(&segment.points, segment.base_m, top_m(segment), sigma_m, round::SEED)?;
    let is_around = |other: &Segment| Bearing::of(other, &axis, segment.base_m).around >= ALL_AROUND;
    let mut others = scene.segments.iter().enumerate().filter(|(n, _)| *n != of);
    let (vessel, holder) = others.find(|(_, other)| is_around(other))?;
    let (bottom_m, base_sigma_m) = BOTTOM_M;
    Some((Segment { base_m: holder.base_m + bottom_m, base_sigma_m, ..segment.clone() }, vessel))
}

/// Height map of a segment.
struct HeightMap {
    /// Least x and y, surface frame, metres.
    low: [f64; 2],
    /// Number of columns (along x) and rows (along y).
    size: [usize; 2],
    /// Lowest height, surface frame, metres.
    base_m: f64,
    /// Number of height levels, each as high as a cell is wide.
    levels: usize,
    /// Height of the highest point of each cell, row by row, metres; −∞ without points.
    tops_m: Vec<f64>,
}

impl HeightMap {
    /// Height map of a segment; `None` if the segment is as large as furniture.
    fn of(segment: &Segment) -> Option<HeightMap> {
        /// Maximum number of cells, counted over all levels. From: work.
        const MOST_CELLS: usize = 1 << 20;
        let (low, high) = bounds(&segment.points);
        let cells = |k: usize| ((high[k] - low[k]) / CELL_M) as usize + 1;
        let (size, levels) = ([cells(0), cells(1)], cells(2) + 1);
        if size[0] * size[1] * levels > MOST_CELLS {
            return None;
        }
        let mut tops_m = vec![f64::NEG_INFINITY; size[0] * size[1]];
        for p in &segment.points {
            let [i, j] = [0, 1].map(|k| ((p[k] - low[k]) / CELL_M) as usize);
            let top = &mut tops_m[j * size[0] + i];
            *top = top.max(p.z);
        }
        Some(HeightMap { low: [low.x, low.y], size, base_m: low.z, levels, tops_m })
    }

    /// Cells next to a height drop: column, row and height.
    fn edges(&self) -> Vec<(usize, usize, f64)> {
        /// Number of cells to either side that are searched. From: derived, an edge may lie on the border
        /// between two.
        const BESIDE: i64 = 2;
        let [width, height] = self.size;
        let at = |i: i64, j: i64| match (0..width as i64).contains(&i) && (0..height as i64).contains(&j) {
            true => self.tops_m[j as usize * width + i as usize],
            false => f64::NEG_INFINITY,
        };
        let drops = |&(i, j, top): &(usize, usize, f64)| {
            let (i, j) = (i as i64, j as i64);
            let beside = [(BESIDE, 0), (-BESIDE, 0), (0, BESIDE), (0, -BESIDE)];
            beside.into_iter().any(|(di, dj)| at(i + di, j + dj) < top - DROP_M)
        };
        let cells = self.tops_m.iter().enumerate().filter(|(_, top)| top.is_finite());
        cells.map(|(n, top)| (n % width, n / width, *top)).filter(drops).collect()
    }

    /// Circles with the most height drops, without overlaps.
    fn circles(&self, radii_m: &[f64]) -> Vec<Circle> {
        let edges = self.edges();
        let mut found: Vec<Circle> =
            radii_m.iter().flat_map(|&radius_m| self.circles_of(&edges, radius_m)).collect();
        found.sort_by(|a, b| b.share.total_cmp(&a.share));
        let mut kept: Vec<Circle> = Vec::new();
        for circle in found {
            let is_over = |other: &Circle| distance(other.x - circle.x, other.y - circle.y) < other.radius_m;
            if kept.len() < MOST && !kept.iter().any(is_over) {
                kept.push(circle);
            }
        }
        kept
    }

    fn circles_of(&self, edges: &[(usize, usize, f64)], radius_m: f64) -> Vec<Circle> {
        let [width, height] = self.size;
        let ring = ring(radius_m);
        let needed = CIRCLE * std::f64::consts::TAU * radius_m / CELL_M;
        if (edges.len() as f64) < needed {
            return Vec::new();
        }
        let mut votes = vec![0_u16; width * height * self.levels];
        for &(i, j, top) in edges {
            let level = ((top - self.base_m) / CELL_M) as usize;
            for (di, dj) in &ring {
                let (x, y) = (i as i32 + di, j as i32 + dj);
                if x >= 0 && y >= 0 && (x as usize) < width && (y as usize) < height {
                    votes[(level * height + y as usize) * width + x as usize] += 1;
                }
            }
        }
        let layer = width * height;
        let mut circles = Vec::new();
        for n in 0..layer * (self.levels - 1) {
            let count = f64::from(votes[n] + votes[n + layer]);
            if count >= needed {
                let (i, j) = (n % width, n / width % height);
                circles.push(Circle {
                    x: self.low[0] + (i as f64 + 0.5) * CELL_M,
                    y: self.low[1] + (j as f64 + 0.5) * CELL_M,
                    radius_m,
                    top_m: self.base_m + (n / layer + 2) as f64 * CELL_M,
                    share: CIRCLE * count / needed,
                });
            }
        }
        circles
    }
}

/// Cells of a circle, relative to its centre.
fn ring(radius_m: f64) -> Vec<(i32, i32)> {
    /// Maximum distance of a cell's middle from a circle that goes through the cell, cells. From: derived,
    /// between half a side and half a diagonal.
    const THROUGH: f64 = 0.6;
    let reach = floor(radius_m / CELL_M) + 1;
    let cells = (-reach..=reach).flat_map(|i| (-reach..=reach).map(move |j| (i, j)));
    let is_on = |&(i, j): &(i32, i32)| {
        (distance(f64::from(i), f64::from(j)) * CELL_M - radius_m).abs() < THROUGH * CELL_M
    };
    cells.filter(is_on).collect()
}

/// Finds the body whose upper edge may be `circle`, on a support or in a vessel; `None` if none
/// fits or it is not higher than `least_m`.
fn resting(segment: &Segment, circle: &Circle, least_m: f64, sigma_m: f64) -> Option<Resting> {
    let outside_m = |p: &Point3<f64>| distance(p.x - circle.x, p.y - circle.y) - circle.radius_m;
    let mut beside = [false; SECTORS];
    let lower = segment.points.iter().filter(|p| p.z < circle.top_m - APART_M && outside_m(p) > AROUND_M.0);
    lower.for_each(|p| beside[sector(p.x - circle.x, p.y - circle.y)] = true);
    if beside.iter().filter(|seen| **seen).count() < BEARS {
        return None;
    }
    let foot_m = (circle.top_m - SIDE * least_m).max(segment.base_m);
    let near = |p: &&Point3<f64>| p.z > foot_m && p.z < circle.top_m + CELL_M && outside_m(p).abs() < APART_M;
    let side: Vec<Point3<f64>> = segment.points.iter().filter(near).copied().collect();
    let axis = round::fit(&side, foot_m, circle.top_m, sigma_m, round::SEED)?;
    if axis.inliers < ON_SIDE || (axis.radius_m - circle.radius_m).abs() > PLACE_M {
        return None;
    }
    let level_m = level_m(segment, &axis, circle.top_m)?;
    let Bearing { around, level } = Bearing::of(segment, &axis, level_m);
    let is_within = around >= ALL_AROUND && level < BORNE;
    let (base_m, base_sigma_m) = match is_within {
        true => (segment.base_m + BOTTOM_M.0, BOTTOM_M.1),
        false => (level_m, LEVEL_SIGMA_M),
    };
    if circle.top_m - base_m <= least_m {
        return None;
    }
    let (body, rest) = parted(segment, &axis, circle.top_m, level_m);
    let body = Segment { base_m, base_sigma_m, ..body };
    (rest.indices.len() >= FEWEST_LEFT).then_some(Resting { body, rest, is_within })
}

/// Surroundings of a body's foot.
struct Bearing {
    /// Number of directions (of 36) with points beside the body at or above the foot.
    around: usize,
    /// Number of directions (of 36) with points right beside the body at the foot's height.
    level: usize,
}

impl Bearing {
    fn of(other: &Segment, axis: &Round, foot_m: f64) -> Bearing {
        /// Maximum height difference between a level and the foot, metres. From: derived, an edge,
        /// and how far things differ from their forms.
        const OFF_M: f64 = EDGE_M + SHAPE_M;
        let [mut around, mut level] = [[false; SECTORS]; 2];
        for p in other.points.iter().filter(|p| (p.z - foot_m).abs() < REACH_M) {
            let outside_m = axis.outside_m(p);
            if (AROUND_M.0..REACH_M).contains(&outside_m) {
                let direction = sector(p.x - axis.x, p.y - axis.y);
                around[direction] |= p.z > foot_m - PLACE_M;
                level[direction] |= (p.z - foot_m).abs() < OFF_M && outside_m < AROUND_M.1;
            }
        }
        let [around, level] = [around, level].map(|seen| seen.iter().filter(|seen| **seen).count());
        Bearing { around, level }
    }
}

/// Height of the support seen around a body, metres above the surface; `None` if none is seen above
/// the segment's base.
fn level_m(segment: &Segment, axis: &Round, top_m: f64) -> Option<f64> {
    let band_m = segment.base_m..top_m - APART_M;
    let level = |z: f64| ((z - segment.base_m) / EDGE_M) as usize;
    let mut seen = vec![[false; SECTORS]; level(top_m) + 2];
    let mut sums = vec![(0.0, 0.0); seen.len()];
    let beside =
        |p: &&Point3<f64>| band_m.contains(&p.z) && (AROUND_M.0..AROUND_M.1).contains(&axis.outside_m(p));
    for p in segment.points.iter().filter(beside) {
        let (level, direction) = (level(p.z), sector(p.x - axis.x, p.y - axis.y));
        seen[level][direction] = true;
        sums[level] = (sums[level].0 + p.z, sums[level].1 + 1.0);
    }
    // Two levels together: a height may lie on the border.
    let count = |n: usize| (0..SECTORS).filter(|&k| seen[n][k] || seen[n + 1][k]).count();
    let counts: Vec<usize> = (0..seen.len() - 1).map(count).collect();
    let most = counts.iter().copied().max().unwrap_or(0);
    // Below the top of what bears it, its side may be seen in as many directions.
    let bears = |count: &usize| *count >= BEARS && *count as f64 >= NEARLY * most as f64;
    let highest = counts.iter().rposition(bears)?;
    let (sum, n) = (sums[highest].0 + sums[highest + 1].0, sums[highest].1 + sums[highest + 1].1);
    let level_m = sum / n;
    (level_m > segment.base_m + PLACE_M).then_some(level_m)
}

/// Segment split into the body above its surroundings, and the rest.
fn parted(segment: &Segment, axis: &Round, top_m: f64, level_m: f64) -> (Segment, Segment) {
    let is_body = |p: &Point3<f64>| {
        p.z > level_m + PLACE_M
            && p.z < top_m + APART_M
            && distance(p.x - axis.x, p.y - axis.y) < axis.radius_at(p.z) + REACH_M
    };
    let part = |of_body: bool| {
        let kept = segment.indices.iter().zip(&segment.points).filter(|(_, p)| is_body(p) == of_body);
        let (indices, points) = kept.map(|(i, p)| (*i, *p)).unzip();
        Segment { indices, points, base_m: segment.base_m, base_sigma_m: segment.base_sigma_m }
    };
    (part(true), part(false))
}
