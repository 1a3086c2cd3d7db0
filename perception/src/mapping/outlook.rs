//! Joint gain of several viewpoints, for a planner to weigh: a few poses from which all visible unknown floor would be
//! seen. Also the usual alternative, the nearest frontier.

use super::frontier::{
    ExploreOptions, Floor, LEAST_M2, NextPose, RAYS, Reach, bearing_rad, frontiers, is_ahead, next_within,
    standable, was_looked_from,
};
use crate::occupancy::{Occupancy, Space};
use nalgebra::{Isometry2, Point2};
use rustc_hash::{FxHashMap, FxHashSet};

/// Viewpoint with the floor that an observation from there is expected to show.
#[derive(Clone, Debug, PartialEq)]
pub struct Outlook {
    /// Pose of the body in the map.
    pub pose: Isometry2<f64>,
    /// Length of the route from the body, metres.
    pub way_m: f64,
    /// Indices of unknown floor cells, each with the probability that an observation shows the cell.
    shows: Vec<(usize, f64)>,
    /// Area of a cell, square metres.
    square_m2: f64,
}

/// Floor that is expected to be still unknown after some planned observations.
#[derive(Clone, Debug, Default)]
pub struct Unseen {
    /// Probability that a cell is still unknown; 1 for cells without an entry.
    left: FxHashMap<usize, f64>,
}

impl Unseen {
    /// Floor that an observation is expected to show beyond the earlier ones, square metres.
    pub fn gain_m2(&self, look: &Outlook) -> f64 {
        let left = |index: &usize| self.left.get(index).copied().unwrap_or(1.0);
        look.shows.iter().map(|(index, likely)| left(index) * likely).sum::<f64>() * look.square_m2
    }

    /// Accounts for an observation as made.
    pub fn look(&mut self, look: &Outlook) {
        for (index, likely) in &look.shows {
            *self.left.entry(*index).or_insert(1.0) *= 1.0 - likely;
        }
    }
}

/// Number of candidate poses with the best gain per cost that are compared; of the others, a sample.
const COMPARED: usize = 240;

/// At most `most` viewpoints that jointly show most of the visible unknown floor: first those of `keep` that are still
/// useful, then greedily by additional gain per cost.
///
/// `looked`: the poses of all observations so far; none of them is chosen again.
pub fn outlooks(
    grid: &Occupancy,
    reach: &Reach,
    looked: &[Isometry2<f64>],
    keep: &[Isometry2<f64>],
    most: usize,
    options: &ExploreOptions,
) -> Vec<Outlook> {
    let _span = tracing::debug_span!("outlooks", squares = grid.cells.len()).entered();
    let floor = Floor::of(grid, options.field.far_m);
    let missed = floor.missed(looked, options);
    let mut unseen = Unseen::default();
    let mut chosen: Vec<Outlook> = Vec::new();
    for pose in keep.iter().filter(|pose| !was_looked_from(pose, looked)) {
        let way_m = floor.way_m(&reach.ways_m, &pose.translation.vector.into());
        let look = floor.outlook(pose, way_m, &missed, options);
        if way_m.is_finite() && unseen.gain_m2(&look) >= LEAST_M2 && chosen.len() < most {
            unseen.look(&look);
            chosen.push(look);
        }
    }
    let mut found = next_within(grid, reach, looked, options);
    found.retain(|next| !was_looked_from(&next.pose, looked));
    // Those that promise most for their cost, and some of all the others.
    let every = found.len().div_ceil(COMPARED).max(1);
    let compared = found.iter().take(COMPARED).chain(found.iter().skip(COMPARED).step_by(every));
    let mut open: Vec<(Outlook, f64)> =
        compared.map(|p| (floor.outlook(&p.pose, p.way_m, &missed, options), p.cost_s)).collect();
    while chosen.len() < most {
        // What others show already is never shown again: what promises too little now is left out for good.
        open.retain(|(look, _)| unseen.gain_m2(look) >= LEAST_M2);
        let rate = |(look, cost_s): &(Outlook, f64)| unseen.gain_m2(look) / cost_s;
        let Some(best) =
            (0..open.len()).max_by(|&a, &b| rate(&open[a]).total_cmp(&rate(&open[b])).then(b.cmp(&a)))
        else {
            break;
        };
        let (look, _) = open.swap_remove(best);
        unseen.look(&look);
        chosen.push(look);
    }
    chosen
}

impl Floor<'_> {
    fn way_m(&self, ways: &[f64], place: &Point2<f64>) -> f64 {
        let (column, row) = self.square(place);
        let inside = column >= 0 && row >= 0 && column < self.grid.width as i64;
        let index = if inside { self.index((column, row)) } else { usize::MAX };
        ways.get(index).copied().unwrap_or(f64::INFINITY)
    }

    fn outlook(
        &self,
        pose: &Isometry2<f64>,
        way_m: f64,
        missed: &[f64],
        options: &ExploreOptions,
    ) -> Outlook {
        let mut shows: FxHashMap<usize, f64> = FxHashMap::default();
        let heading = pose.rotation.angle();
        for ray in (0..RAYS).filter(|r| is_ahead(*r, heading, &options.field)) {
            self.ray(&pose.translation.vector, bearing_rad(ray), options, |_, index, likely| {
                let known = shows.entry(index).or_insert(0.0);
                *known = known.max(likely * missed[index]);
            });
        }
        let mut shows: Vec<(usize, f64)> = shows.into_iter().collect();
        shows.sort_unstable_by_key(|(index, _)| *index);
        Outlook { pose: *pose, way_m, shows, square_m2: self.grid.cell_m * self.grid.cell_m }
    }
}

/// Maximum viewing distance of a frontier, as a share of the camera's range.
const IN_RANGE: f64 = 0.9;
/// Cells that another observation shows with at most this probability are given up: by default after two observations
/// that should have shown them.
const LEFT: f64 = 0.2;

/// Viewpoint of the nearest reachable frontier: the first place towards it, by route length, that has the frontier in
/// range and unoccluded, facing it (Yamauchi 1997).
///
/// If none is reachable, the body turns to the nearest frontier where it stands. `None` if no frontier promises gain.
pub fn nearest_frontier(
    grid: &Occupancy,
    looked: &[Isometry2<f64>],
    options: &ExploreOptions,
) -> Option<NextPose> {
    let from = looked.last()?;
    let floor = Floor::of(grid, options.field.far_m);
    let start = Point2::from(from.translation.vector);
    let ways = floor.ways_m(&start, &standable(grid, options.radius_m), options.radius_m);
    let missed = floor.missed(looked, options);
    let is_left =
        |square: &(i64, i64)| floor.unknown_beside(*square).iter().any(|&index| missed[index] > LEFT);
    let of_frontiers = frontiers(grid, options).into_iter().flat_map(|f| f.squares);
    let squares: FxHashSet<(i64, i64)> = of_frontiers.map(|p| floor.square(&p)).filter(is_left).collect();
    // The body's middle may not come that near to what is occupied: as near as it comes.
    let goal = |s| (floor.nearest_way_m(&ways, s, options.radius_m), floor.middle(s));
    let mut goals: Vec<(f64, Point2<f64>)> =
        floor.squares().filter(|s| squares.contains(s)).map(goal).collect();
    goals.sort_by(|(way_a, a), (way_b, b)| {
        way_a.total_cmp(way_b).then((a - start).norm().total_cmp(&(b - start).norm()))
    });
    let next = |at: &Point2<f64>, way_m: f64, goal: &Point2<f64>| {
        let ahead = goal - at;
        let pose = Isometry2::new(at.coords, ahead.y.atan2(ahead.x));
        let turn = from.rotation.angle_to(&pose.rotation).abs();
        let (metre_s, radian_s, look_s) = options.seconds;
        let gain_m2 = Unseen::default().gain_m2(&floor.outlook(&pose, way_m, &missed, options));
        NextPose { pose, gain_m2, way_m, cost_s: metre_s * way_m + radian_s * turn + look_s }
    };
    goals.iter().find_map(|(way_m, goal)| {
        let (at, way_m) = match way_m.is_finite() {
            true => floor.seen_from(goal, *way_m, &start, &ways, options)?,
            false => (start, 0.0),
        };
        Some(next(&at, way_m, goal)).filter(|look| look.gain_m2 >= LEAST_M2)
    })
}

impl Floor<'_> {
    fn unknown_beside(&self, (column, row): (i64, i64)) -> Vec<usize> {
        let around = [(1, 0), (-1, 0), (0, 1), (0, -1)].map(|(x, y)| (column + x, row + y));
        let unknown = around.into_iter().filter(|s| self.space(*s) == Space::Unknown);
        unknown.filter_map(|s| self.index_beyond(s)).collect()
    }

    /// Position with the shortest route, at most `most_m`, that has `goal` in range and unoccluded; with the length of
    /// that route, metres. `None` if there is none.
    fn seen_from(
        &self,
        goal: &Point2<f64>,
        most_m: f64,
        start: &Point2<f64>,
        ways: &[f64],
        options: &ExploreOptions,
    ) -> Option<(Point2<f64>, f64)> {
        let reach_m = IN_RANGE * options.field.far_m;
        let sees = |p: &Point2<f64>| (goal - p).norm() <= reach_m && self.is_clear(p, goal);
        let stands = self.squares().map(|s| (self.middle(s), ways[self.index(s)]));
        let on_way =
            std::iter::once((*start, 0.0)).chain(stands).filter(|(p, way)| *way <= most_m && sees(p));
        on_way.min_by(|a, b| a.1.total_cmp(&b.1))
    }

    /// Length of the shortest route to any free cell within the body's radius plus one cell of the given cell, metres.
    fn nearest_way_m(&self, ways: &[f64], (column, row): (i64, i64), radius_m: f64) -> f64 {
        let reach = (radius_m / self.grid.cell_m).ceil() as i64 + 1;
        let around = (-reach..=reach).flat_map(|x| (-reach..=reach).map(move |y| (column + x, row + y)));
        let there = around.filter(|s| self.space(*s) == Space::Free);
        there.map(|s| ways[self.index(s)]).fold(f64::INFINITY, f64::min)
    }

    /// True if all cells on the line between two places are free.
    fn is_clear(&self, from: &Point2<f64>, to: &Point2<f64>) -> bool {
        let steps = ((to - from).norm() / (0.5 * self.grid.cell_m)).ceil().max(1.0) as usize;
        (0..=steps).all(|k| {
            self.space(self.square(&(from + (to - from) * (k as f64 / steps as f64)))) == Space::Free
        })
    }
}
