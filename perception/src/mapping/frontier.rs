//! Where to go next to see more of a building: frontiers between open and unknown floor (Yamauchi 1997), and for poses around, what each is expected to
//! show and what the way there costs.

use super::station::FieldOfView;
use crate::laser::{Occupancy, Space};
use nalgebra::{Isometry2, Point2, Vector2};
use rustc_hash::FxHashSet;
use std::cmp::Reverse;
use std::collections::BinaryHeap;
use std::f64::consts::TAU;

/// How the next pose is chosen.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ExploreOptions {
    /// What the camera sees of the plan.
    pub field: FieldOfView,
    /// The body keeps so far from what is occupied, metres.
    pub radius_m: f64,
    /// Frontiers with fewer squares are left alone.
    pub least_squares: usize,
    /// Seconds a metre of the way takes, and a radian of the turn at its end, and a look.
    pub seconds: (f64, f64, f64),
    /// How likely an unknown square is occupied: what lies behind many of them is seldom seen.
    pub occupied: f64,
}

impl Default for ExploreOptions {
    fn default() -> Self {
        ExploreOptions {
            field: FieldOfView::default(),
            radius_m: 0.3,
            least_squares: 6,
            seconds: (2.0, 1.0, 1.0),
            occupied: 0.1,
        }
    }
}

/// Open squares in a row that border on unknown ones.
#[derive(Clone, Debug, PartialEq)]
pub struct Frontier {
    /// Middles of its squares, metres.
    pub squares: Vec<Point2<f64>>,
    /// The square nearest to their middle.
    pub middle: Point2<f64>,
}

/// A pose that may be next.
#[derive(Clone, Debug, PartialEq)]
pub struct NextPose {
    /// Where, in the map.
    pub pose: Isometry2<f64>,
    /// Floor that is unknown now and expected to be seen, square metres.
    pub gain_m2: f64,
    /// Length of the way there, metres.
    pub way_m: f64,
    /// What going there and looking takes, seconds.
    pub cost_s: f64,
}

impl NextPose {
    /// What is expected to be seen for a second.
    pub fn rate(&self) -> f64 {
        self.gain_m2 / self.cost_s
    }
}

/// Headings tried at a place.
const HEADINGS: usize = 12;
/// Places that are tried lie so far apart, metres.
const PLACES_M: f64 = 0.6;
/// Places are tried within this of a frontier, metres.
const AROUND_M: f64 = 2.0;
/// Least gain that makes a pose worth a look, square metres.
const LEAST_M2: f64 = 0.2;
/// Ways to neighbouring squares, and their lengths in squares.
const STEPS: [(i64, i64, f64); 8] = {
    const D: f64 = std::f64::consts::SQRT_2;
    [(1, 0, 1.0), (-1, 0, 1.0), (0, 1, 1.0), (0, -1, 1.0), (1, 1, D), (1, -1, D), (-1, 1, D), (-1, -1, D)]
};

/// A grid, read by columns and rows.
struct Floor<'a> {
    grid: &'a Occupancy,
    width: i64,
    height: i64,
}

impl<'a> Floor<'a> {
    fn of(grid: &'a Occupancy) -> Floor<'a> {
        let width = grid.width.max(1);
        Floor { grid, width: width as i64, height: (grid.cells.len() / width) as i64 }
    }

    fn space(&self, (column, row): (i64, i64)) -> Space {
        let inside = column >= 0 && row >= 0 && column < self.width && row < self.height;
        if inside { self.grid.cells[(row * self.width + column) as usize] } else { Space::Unknown }
    }

    fn index(&self, (column, row): (i64, i64)) -> usize {
        (row * self.width + column) as usize
    }

    fn square(&self, place: &Point2<f64>) -> (i64, i64) {
        let at = (place - self.grid.origin) / self.grid.cell_m;
        (at.x.floor() as i64, at.y.floor() as i64)
    }

    fn middle(&self, (column, row): (i64, i64)) -> Point2<f64> {
        self.grid.origin + Vector2::new(column as f64 + 0.5, row as f64 + 0.5) * self.grid.cell_m
    }

    fn squares(&self) -> impl Iterator<Item = (i64, i64)> + use<> {
        let width = self.width;
        (0..self.height).flat_map(move |row| (0..width).map(move |column| (column, row)))
    }

    /// Squares on which the middle of the body may be: open, and nothing occupied near.
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

    /// Length of the shortest way to each square over squares where the body may be, metres; infinite where there is none.
    fn ways_m(&self, from: &Point2<f64>, radius_m: f64) -> Vec<f64> {
        let free = self.standable(radius_m);
        let mut ways = vec![f64::INFINITY; free.len()];
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
                if (free[index] || near(next)) && there < ways[index] {
                    ways[index] = there;
                    open.push(Reverse((there.to_bits(), next)));
                }
            }
        }
        ways
    }

    /// Unknown floor that a look from a pose is expected to show, square metres.
    fn gain_m2(&self, pose: &Isometry2<f64>, options: &ExploreOptions) -> f64 {
        let field = &options.field;
        let step = self.grid.cell_m / field.far_m;
        let rays = ((field.left_rad - field.right_rad) / step).ceil().max(1.0) as usize;
        let mut seen: FxHashSet<(i64, i64)> = FxHashSet::default();
        let mut gain = 0.0;
        for ray in 0..=rays {
            let bearing = field.right_rad + (field.left_rad - field.right_rad) * ray as f64 / rays as f64;
            let along = pose.rotation * Vector2::new(1.0, bearing.tan());
            let mut likely = 1.0;
            let mut last = (i64::MIN, 0);
            let steps = ((field.far_m - field.near_m) / (0.5 * self.grid.cell_m)) as usize;
            for k in 0..=steps {
                let depth = field.near_m + 0.5 * self.grid.cell_m * k as f64;
                let square = self.square(&Point2::from(pose.translation.vector + along * depth));
                if square == last {
                    continue;
                }
                last = square;
                match self.space(square) {
                    Space::Occupied => break,
                    Space::Free => {}
                    Space::Unknown => {
                        if seen.insert(square) {
                            gain += likely;
                        }
                        likely *= 1.0 - options.occupied;
                    }
                }
            }
        }
        gain * self.grid.cell_m * self.grid.cell_m
    }
}

/// Frontiers of a grid, the longest first.
pub fn frontiers(grid: &Occupancy, options: &ExploreOptions) -> Vec<Frontier> {
    let floor = Floor::of(grid);
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
    found.sort_by(|a, b| b.squares.len().cmp(&a.squares.len()));
    found
}

/// Poses from which more would be seen, those that are expected to show most for their cost first. None: all that can be reached is known.
pub fn next_poses(grid: &Occupancy, from: &Isometry2<f64>, options: &ExploreOptions) -> Vec<NextPose> {
    let _span = tracing::debug_span!("next poses", squares = grid.cells.len()).entered();
    let floor = Floor::of(grid);
    let ways = floor.ways_m(&Point2::from(from.translation.vector), options.radius_m);
    let stride = (PLACES_M / grid.cell_m).ceil().max(1.0) as i64;
    let around = (AROUND_M / grid.cell_m).ceil() as i64;
    let mut places: FxHashSet<(i64, i64)> = FxHashSet::default();
    for frontier in frontiers(grid, options) {
        for square in frontier.squares.iter().map(|p| floor.square(p)) {
            let snap = |c: i64| (c.div_euclid(stride)) * stride;
            let steps = || (-around..=around).step_by(stride as usize);
            places
                .extend(steps().flat_map(|x| steps().map(move |y| (snap(square.0 + x), snap(square.1 + y)))));
        }
    }
    let mut places: Vec<(i64, i64)> = places
        .into_iter()
        .filter(|s| {
            s.0 >= 0
                && s.1 >= 0
                && s.0 < floor.width
                && s.1 < floor.height
                && ways[floor.index(*s)].is_finite()
        })
        .collect();
    places.push(floor.square(&Point2::from(from.translation.vector)));
    places.sort_unstable();
    places.dedup();
    let (metre_s, radian_s, look_s) = options.seconds;
    let mut found: Vec<NextPose> = Vec::new();
    for square in places {
        let way_m = if floor.space(square) == Space::Unknown { 0.0 } else { ways[floor.index(square)] };
        for heading in (0..HEADINGS).map(|h| TAU * h as f64 / HEADINGS as f64) {
            let pose = Isometry2::new(floor.middle(square).coords, heading);
            let gain_m2 = floor.gain_m2(&pose, options);
            if gain_m2 >= LEAST_M2 && way_m.is_finite() {
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

#[cfg(test)]
mod tests {
    use super::*;

    /// `#` occupied, `.` open, blank unknown; the first row is the lowest.
    fn grid(rows: &[&str]) -> Occupancy {
        let cells = rows.iter().flat_map(|row| {
            row.chars().map(|c| match c {
                '#' => Space::Occupied,
                '.' => Space::Free,
                _ => Space::Unknown,
            })
        });
        Occupancy { origin: Point2::origin(), cell_m: 0.5, width: rows[0].len(), cells: cells.collect() }
    }

    fn options() -> ExploreOptions {
        ExploreOptions { radius_m: 0.2, least_squares: 2, ..ExploreOptions::default() }
    }

    #[test]
    fn the_open_end_is_the_frontier_and_the_next_pose_looks_there() {
        let open = grid(&[
            "############    ",
            "#..........     ",
            "#..........     ",
            "#..........     ",
            "############    ",
        ]);
        let found = frontiers(&open, &options());
        assert_eq!(found.len(), 1, "{found:?}");
        assert!((found[0].middle - Point2::new(5.25, 1.25)).norm() < 0.1);
        let next = next_poses(&open, &Isometry2::new(Vector2::new(0.75, 1.25), 0.0), &options());
        let first = &next[0];
        assert!(first.pose.rotation.angle().abs() < 0.6 && first.gain_m2 > 1.0, "{first:?}");
        assert!(next.iter().all(|n| n.cost_s > 0.0 && n.way_m.is_finite()));
    }

    #[test]
    fn a_closed_room_has_none_and_what_cannot_be_reached_is_no_pose() {
        let closed = grid(&["######", "#....#", "#....#", "######"]);
        let from = Isometry2::new(Vector2::new(1.25, 0.75), 0.0);
        assert!(
            frontiers(&closed, &options()).is_empty() && next_poses(&closed, &from, &options()).is_empty()
        );
        let walled = grid(&["#######.... ", "#....##.... ", "#....##.... ", "#######.... "]);
        assert!(!frontiers(&walled, &options()).is_empty());
        let next = next_poses(&walled, &from, &options());
        assert!(next.iter().all(|n| n.pose.translation.x < 3.0), "{next:?}");
        // Outside of the grid nothing is known: there is nowhere to go.
        let outside = Isometry2::new(Vector2::new(-5.0, 0.0), 0.0);
        assert!(next_poses(&closed, &outside, &options()).iter().all(|n| n.way_m == 0.0));
    }
}
