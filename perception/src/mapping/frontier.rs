//! Frontier exploration (Yamauchi 1997): frontiers between open and unknown floor, and for
//! candidate poses the expected view and the route cost.

use super::station::FieldOfView;
use crate::occupancy::{Occupancy, Space};
use nalgebra::{Isometry2, Point2, Vector2};
use rustc_hash::FxHashSet;
use std::cmp::Reverse;
use std::collections::BinaryHeap;
use std::f64::consts::{PI, TAU};

/// Options for choosing the next pose.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ExploreOptions {
    /// Horizontal field of view of the camera.
    pub field: FieldOfView,
    /// Clearance of the body's centre from occupied cells, metres.
    pub radius_m: f64,
    /// Minimum number of cells of a frontier; smaller ones are ignored.
    pub least_squares: usize,
    /// Cost in seconds: per metre of route, per radian of the final turn, and per observation.
    pub seconds: (f64, f64, f64),
    /// Probability that an unknown cell is occupied; it lowers the expected view of the cells behind.
    pub occupied: f64,
    /// Probability that the next observation shows a cell that an earlier one should have shown but did not, such as a
    /// cell at a bare wall.
    pub again: f64,
}

impl Default for ExploreOptions {
    fn default() -> Self {
        ExploreOptions {
            field: FieldOfView::default(),
            radius_m: 0.3,
            least_squares: 6,
            seconds: (2.0, 1.0, 1.0),
            occupied: 0.1,
            again: 0.3,
        }
    }
}

/// Connected free cells, each beside an unknown cell.
#[derive(Clone, Debug, PartialEq)]
pub struct Frontier {
    /// Cell centres in the map frame, metres.
    pub squares: Vec<Point2<f64>>,
    /// Centre of the cell nearest to the frontier's centroid, map frame, metres.
    pub middle: Point2<f64>,
}

/// Candidate for the next pose to observe from.
#[derive(Clone, Debug, PartialEq)]
pub struct NextPose {
    /// Pose in the map.
    pub pose: Isometry2<f64>,
    /// Floor that is unknown now and expected to be seen, square metres.
    pub gain_m2: f64,
    /// Length of the shortest route to the pose, metres.
    pub way_m: f64,
    /// Cost of route, final turn and observation, seconds.
    pub cost_s: f64,
}

impl NextPose {
    /// Expected newly seen area per second of cost, square metres per second.
    pub fn rate(&self) -> f64 {
        self.gain_m2 / self.cost_s
    }
}

/// Number of headings tried at a place.
const HEADINGS: usize = 12;
/// Maximum number of cells along a ray.
const MOST_STEPS: usize = 2000;
/// Number of rays around a place.
pub(super) const RAYS: usize = 180;
/// Spacing of the poses that are tried, metres.
const PLACES_M: f64 = 0.6;
/// Radius around a frontier in which places are tried, metres.
const AROUND_M: f64 = 2.0;
/// Minimum gain for a pose to be worth an observation, square metres.
pub(super) const LEAST_M2: f64 = 0.2;
/// Steps to the eight neighbouring cells: columns, rows, and length in cells.
const STEPS: [(i64, i64, f64); 8] = {
    const D: f64 = std::f64::consts::SQRT_2;
    [(1, 0, 1.0), (-1, 0, 1.0), (0, 1, 1.0), (0, -1, 1.0), (1, 1, D), (1, -1, D), (-1, 1, D), (-1, -1, D)]
};

/// Occupancy grid, accessed by column and row.
pub(super) struct Floor<'a> {
    pub(super) grid: &'a Occupancy,
    width: i64,
    height: i64,
    /// Number of cells beyond each side of the grid that an observation may still reach.
    margin: i64,
}

impl<'a> Floor<'a> {
    pub(super) fn of(grid: &'a Occupancy, far_m: f64) -> Floor<'a> {
        let width = grid.width.max(1);
        let margin = ((far_m / grid.cell_m).ceil() as i64).clamp(0, MOST_STEPS as i64) + 1;
        Floor { grid, width: width as i64, height: (grid.cells.len() / width) as i64, margin }
    }

    /// Index of a cell within the grid extended by its margin; `None` if the cell lies outside.
    pub(super) fn index_beyond(&self, (column, row): (i64, i64)) -> Option<usize> {
        let (column, row) = (column + self.margin, row + self.margin);
        let (width, height) = (self.width + 2 * self.margin, self.height + 2 * self.margin);
        (column >= 0 && row >= 0 && column < width && row < height).then(|| (row * width + column) as usize)
    }

    pub(super) fn space(&self, (column, row): (i64, i64)) -> Space {
        let inside = column >= 0 && row >= 0 && column < self.width && row < self.height;
        if inside { self.grid.cells[(row * self.width + column) as usize] } else { Space::Unknown }
    }

    pub(super) fn index(&self, (column, row): (i64, i64)) -> usize {
        (row * self.width + column) as usize
    }

    pub(super) fn square(&self, place: &Point2<f64>) -> (i64, i64) {
        // Far outside is far outside, and so is what is no place.
        let at = ((place - self.grid.origin) / self.grid.cell_m).map(|c| c.clamp(-1e9, 1e9));
        (at.x.floor() as i64, at.y.floor() as i64)
    }

    pub(super) fn middle(&self, (column, row): (i64, i64)) -> Point2<f64> {
        self.grid.origin + Vector2::new(column as f64 + 0.5, row as f64 + 0.5) * self.grid.cell_m
    }

    pub(super) fn squares(&self) -> impl Iterator<Item = (i64, i64)> + use<> {
        let width = self.width;
        (0..self.height).flat_map(move |row| (0..width).map(move |column| (column, row)))
    }

    /// For each cell, true if the body's centre may be there: free, and no occupied cell within `radius_m`.
    fn standable(&self, radius_m: f64) -> Vec<bool> {
        let mut free: Vec<bool> = self.squares().map(|s| self.space(s) == Space::Free).collect();
        let reach = (radius_m / self.grid.cell_m).ceil() as i64;
        let limit = (radius_m / self.grid.cell_m).powi(2);
        for (column, row) in self.squares().filter(|s| self.space(*s) == Space::Occupied) {
            for (dx, dy) in (-reach..=reach).flat_map(|x| (-reach..=reach).map(move |y| (x, y))) {
                let other = (column + dx, row + dy);
                let inside = other.0 >= 0 && other.1 >= 0 && other.0 < self.width && other.1 < self.height;
                if inside && (dx * dx + dy * dy) as f64 <= limit {
                    free[self.index(other)] = false;
                }
            }
        }
        free
    }

    /// Length of the shortest route from `from` to each cell, metres; infinite if unreachable.
    pub(super) fn ways_m(&self, from: &Point2<f64>, stand: &[bool], radius_m: f64) -> Vec<f64> {
        let may_stand = |index: usize| stand.get(index).copied().unwrap_or(false);
        let mut ways = vec![f64::INFINITY; (self.width * self.height) as usize];
        // The body stands where it stands, however near to something.
        let start = self.square(from);
        let slack = (radius_m / self.grid.cell_m).ceil() as i64 + 1;
        let near = |s: (i64, i64)| (s.0 - start.0).abs() <= slack && (s.1 - start.1).abs() <= slack;
        if !(start.0 >= 0 && start.1 >= 0 && start.0 < self.width && start.1 < self.height) {
            return ways;
        }
        let mut open = BinaryHeap::new();
        ways[self.index(start)] = 0.0;
        // Non-negative floats order as their bits do.
        open.push(Reverse((0_u64, start)));
        while let Some(Reverse((bits, square))) = open.pop() {
            let way = f64::from_bits(bits);
            if way > ways[self.index(square)] {
                continue;
            }
            for (dx, dy, length) in STEPS {
                let next = (square.0 + dx, square.1 + dy);
                if self.space(next) != Space::Free {
                    continue;
                }
                let index = self.index(next);
                let there = way + length * self.grid.cell_m;
                if (may_stand(index) || near(next)) && there < ways[index] {
                    ways[index] = there;
                    open.push(Reverse((there.to_bits(), next)));
                }
            }
        }
        ways
    }

    /// Calls `found` for each unknown cell along a ray: range in metres, index within the extended grid, and the
    /// probability that all unknown cells before it are free.
    pub(super) fn ray(
        &self,
        from: &Vector2<f64>,
        angle_rad: f64,
        options: &ExploreOptions,
        mut found: impl FnMut(f64, usize, f64),
    ) {
        let along = Vector2::new(angle_rad.cos(), angle_rad.sin());
        let (near_m, far_m) = (options.field.near_m, options.field.far_m);
        let steps = (((far_m - near_m) / self.grid.cell_m).max(0.0) as usize).min(MOST_STEPS);
        let mut likely = 1.0;
        for k in 0..=steps {
            let range_m = near_m + self.grid.cell_m * k as f64;
            let square = self.square(&Point2::from(from + along * range_m));
            match self.space(square) {
                Space::Occupied => break,
                Space::Free => {}
                Space::Unknown => {
                    let Some(index) = self.index_beyond(square) else { break };
                    found(range_m, index, likely);
                    likely *= 1.0 - options.occupied;
                }
            }
        }
    }

    /// For each cell of the extended grid, the probability that another observation shows the cell; each pose of
    /// `looked` that should have shown the cell lowers it from 1.
    pub(super) fn missed(&self, looked: &[Isometry2<f64>], options: &ExploreOptions) -> Vec<f64> {
        let (width, height) = (self.width + 2 * self.margin, self.height + 2 * self.margin);
        let mut missed = vec![1.0; (width * height) as usize];
        let mut last = vec![0; missed.len()];
        for (number, pose) in (1..).zip(looked) {
            let heading = pose.rotation.angle();
            for ray in (0..RAYS).filter(|r| is_ahead(*r, heading, &options.field)) {
                self.ray(&pose.translation.vector, bearing_rad(ray), options, |_, index, likely| {
                    if std::mem::replace(&mut last[index], number) != number {
                        missed[index] *= 1.0 - likely * (1.0 - options.again);
                    }
                });
            }
        }
        missed
    }

    /// Unknown floor that each of the [`RAYS`] rays from a place is expected to show, square metres.
    fn gains_m2(&self, place: &Point2<f64>, missed: &[f64], options: &ExploreOptions) -> Vec<f64> {
        let width = TAU / RAYS as f64 * self.grid.cell_m;
        let gain = |ray: usize| {
            let mut sum = 0.0;
            self.ray(&place.coords, bearing_rad(ray), options, |range_m, index, likely| {
                sum += likely * missed[index] * range_m * width;
            });
            sum
        };
        (0..RAYS).map(gain).collect()
    }
}

/// Direction of a ray in the map, radians.
pub(super) fn bearing_rad(ray: usize) -> f64 {
    TAU * (ray as f64 + 0.5) / RAYS as f64
}

/// True if a ray lies in the horizontal field of view of a camera with the given heading.
pub(super) fn is_ahead(ray: usize, heading_rad: f64, field: &FieldOfView) -> bool {
    let off = (bearing_rad(ray) - heading_rad + PI).rem_euclid(TAU) - PI;
    off >= field.right_rad && off <= field.left_rad
}

/// For each cell, true if the body's centre may be there: free, and no occupied cell within `radius_m`.
pub fn standable(grid: &Occupancy, radius_m: f64) -> Vec<bool> {
    Floor::of(grid, 0.0).standable(radius_m)
}

/// Floor reachable from a pose of the body.
#[derive(Clone, Debug, PartialEq)]
pub struct Reach {
    /// Pose of the body.
    pub from: Isometry2<f64>,
    /// Shortest route length to each cell, metres; infinite if unreachable.
    pub ways_m: Vec<f64>,
}

impl Reach {
    /// Computes the routes from a pose over the free cells for which `stand` is true, usually those of [`standable`].
    pub fn over(grid: &Occupancy, from: &Isometry2<f64>, stand: &[bool], options: &ExploreOptions) -> Reach {
        let start = Point2::from(from.translation.vector);
        let ways_m = Floor::of(grid, options.field.far_m).ways_m(&start, stand, options.radius_m);
        Reach { from: *from, ways_m }
    }
}

/// Frontiers of a grid, those with most cells first.
pub fn frontiers(grid: &Occupancy, options: &ExploreOptions) -> Vec<Frontier> {
    let floor = Floor::of(grid, options.field.far_m);
    let borders = |s: (i64, i64)| {
        let around = STEPS[..4].iter().map(|(dx, dy, _)| (s.0 + dx, s.1 + dy));
        floor.space(s) == Space::Free && around.into_iter().any(|o| floor.space(o) == Space::Unknown)
    };
    let mut left: FxHashSet<(i64, i64)> = floor.squares().filter(|s| borders(*s)).collect();
    let mut found: Vec<Frontier> = Vec::new();
    for first in floor.squares() {
        if !left.remove(&first) {
            continue;
        }
        let mut squares = vec![first];
        let mut next = 0;
        while next < squares.len() {
            let (column, row) = squares[next];
            next += 1;
            squares
                .extend(STEPS.iter().map(|(dx, dy, _)| (column + dx, row + dy)).filter(|s| left.remove(s)));
        }
        if squares.len() < options.least_squares {
            continue;
        }
        let squares: Vec<Point2<f64>> = squares.into_iter().map(|s| floor.middle(s)).collect();
        let mean = squares.iter().map(|s| s.coords).sum::<Vector2<f64>>() / squares.len() as f64;
        let off = |s: &Point2<f64>| (s.coords - mean).norm_squared();
        let nearest = squares.iter().copied().min_by(|a, b| off(a).total_cmp(&off(b)));
        found.extend(nearest.map(|middle| Frontier { squares, middle }));
    }
    found.sort_by_key(|f| Reverse(f.squares.len()));
    found
}

/// Candidate poses by expected gain per cost, best first; empty if everything reachable is known.
///
/// `looked`: the poses of all observations so far; the body stands at the last one. Less gain is expected of cells that
/// these should have shown but did not.
pub fn next_poses(grid: &Occupancy, looked: &[Isometry2<f64>], options: &ExploreOptions) -> Vec<NextPose> {
    let Some(from) = looked.last() else { return Vec::new() };
    next_within(grid, &Reach::over(grid, from, &standable(grid, options.radius_m), options), looked, options)
}

/// Candidate poses as of [`next_poses`], over the given reachable floor.
pub(super) fn next_within(
    grid: &Occupancy,
    reach: &Reach,
    looked: &[Isometry2<f64>],
    options: &ExploreOptions,
) -> Vec<NextPose> {
    let _span = tracing::debug_span!("next poses", squares = grid.cells.len()).entered();
    let (floor, from) = (Floor::of(grid, options.field.far_m), &reach.from);
    let (start, ways) = (Point2::from(from.translation.vector), &reach.ways_m);
    let missed = floor.missed(looked, options);
    let (metre_s, radian_s, look_s) = options.seconds;
    let mut found: Vec<NextPose> = Vec::new();
    for place in places(&floor, ways, &start, options) {
        let square = floor.square(&place);
        let way_m = if place == start { 0.0 } else { ways[floor.index(square)] };
        let gains = floor.gains_m2(&place, &missed, options);
        for heading in (0..HEADINGS).map(|h| TAU * h as f64 / HEADINGS as f64) {
            let pose = Isometry2::new(place.coords, heading);
            let ahead = (0..RAYS).filter(|r| is_ahead(*r, heading, &options.field));
            let gain_m2: f64 = ahead.map(|r| gains[r]).sum();
            if gain_m2 >= LEAST_M2 {
                let turn = from.rotation.angle_to(&pose.rotation).abs();
                found.push(NextPose {
                    pose,
                    gain_m2,
                    way_m,
                    cost_s: metre_s * way_m + radian_s * turn + look_s,
                });
            }
        }
    }
    found.sort_by(|a, b| b.rate().total_cmp(&a.rate()));
    found
}

/// True if an observation was made from nearly the same position and heading.
pub(super) fn was_looked_from(pose: &Isometry2<f64>, looked: &[Isometry2<f64>]) -> bool {
    let (apart_m, turned_rad) = (0.5 * PLACES_M, 0.5 * TAU / HEADINGS as f64);
    looked.iter().any(|look| {
        (look.translation.vector - pose.translation.vector).norm() < apart_m
            && look.rotation.angle_to(&pose.rotation).abs() < turned_rad
    })
}

/// The body's position, then reachable positions on a coarse grid around all frontiers.
fn places(floor: &Floor, ways: &[f64], start: &Point2<f64>, options: &ExploreOptions) -> Vec<Point2<f64>> {
    let stride = (PLACES_M / floor.grid.cell_m).ceil().max(1.0) as i64;
    let around = (AROUND_M / floor.grid.cell_m).ceil() as i64;
    let mut squares: FxHashSet<(i64, i64)> = FxHashSet::default();
    for frontier in frontiers(floor.grid, options) {
        for square in frontier.squares.iter().map(|p| floor.square(p)) {
            let snap = |c: i64| c.div_euclid(stride) * stride;
            let steps = || (-around..=around).step_by(stride as usize);
            squares
                .extend(steps().flat_map(|x| steps().map(move |y| (snap(square.0 + x), snap(square.1 + y)))));
        }
    }
    let inside = |s: &(i64, i64)| s.0 >= 0 && s.1 >= 0 && s.0 < floor.width && s.1 < floor.height;
    let mut squares: Vec<(i64, i64)> = squares
        .into_iter()
        .filter(|s| inside(s) && ways.get(floor.index(*s)).is_some_and(|way| way.is_finite()))
        .collect();
    squares.sort_unstable();
    std::iter::once(*start).chain(squares.into_iter().map(|s| floor.middle(s))).collect()
}
