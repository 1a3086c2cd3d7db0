//! Routes of a body on its map, and their cost.
//!
//! The map is inflated by the footprint. Shortest any-angle routes bend only at convex corners of obstacles,
//! so the search runs on those corners (a visibility graph, Lozano-Pérez and Wesley 1979), and a pair of
//! poses costs a few lines of sight. Duration after TFD/M's navigation module: Σ max(ds/v, dθ/ω) over the
//! steps of the route, where a base that turns on the spot makes each turn and each straight line a separate
//! step.

use crate::body::{Pose2, Travel};
use crate::failure::Failure;
use crate::grid::OccupancyGrid;
use crate::parts::Speeds;
use nalgebra::Point2;
use pathfinding::directed::dijkstra::dijkstra_all;
use std::collections::{BTreeMap, HashMap};
use std::f64::consts::PI;
use std::sync::{Arc, Mutex, MutexGuard, OnceLock, PoisonError};

/// Maximum distance by which a start too close to an obstacle is moved to free floor, metres: by its
/// estimate, a base may stand closer to a table than is allowed.
const START_SLACK_M: f64 = 0.35;

/// Relative tolerance by which summed lengths may fall short of the straight line.
const ROUNDING: f64 = 1e-9;
/// Maximum number of points with cached lines of sight; the cache is cleared beyond that.
const MOST_ACCESSES: usize = 4096;
/// Maximum number of pose pairs with cached routes; the cache is cleared beyond that.
const MOST_WAYS: usize = 1 << 20;

/// Bit patterns of x, y and heading of a pose, as a cache key.
type PoseBits = [u64; 3];

/// A route with its cost.
#[derive(Clone, Debug, PartialEq)]
pub struct Route {
    /// Waypoints from start to goal, both included, map frame, metres: straight lines between them, a turn on
    /// the spot at each.
    pub points_m: Vec<Point2<f64>>,
    /// Cost, including the turns at both ends.
    pub travel: Travel,
}

/// Routes on one map for one footprint. Distances between corners, and the corners visible from a point, are
/// computed once, when they are first needed.
#[derive(Debug)]
pub struct Router {
    blocked: OccupancyGrid,
    map: OccupancyGrid,
    radius_m: f64,
    speeds: Speeds,
    corners: Vec<Point2<f64>>,
    seen: Vec<OnceLock<Vec<u32>>>,
    rows: Vec<OnceLock<Vec<Option<Leg>>>>,
    /// Cached visible corners of each point, by the bit patterns of x and y.
    accesses: Mutex<BTreeMap<[u64; 2], Arc<Access>>>,
    /// Cached cost and course of the route between two poses; `None` where there is no route.
    ways: Mutex<HashMap<(PoseBits, PoseBits), Option<(Travel, Via)>>>,
}

/// Shortest route from one corner to another: length, turning on the way, first and last heading, and the
/// corner before the last.
#[derive(Clone, Copy, Debug)]
struct Leg {
    distance_m: f64,
    turned_rad: f64,
    first_heading_rad: f64,
    last_heading_rad: f64,
    previous: u32,
}

/// Corners that are visible from a point: index, distance in metres and heading in radians of each.
#[derive(Debug)]
struct Access {
    point: Point2<f64>,
    corners: Vec<(u32, f64, f64)>,
}

/// Course of a route: a straight line, or around corners, given by the indices of the first and the last.
#[derive(Clone, Copy, Debug)]
enum Via {
    Straight,
    Corners(u32, u32),
}

impl Router {
    /// Inflates the map by `radius_m` (footprint and safety margin) and finds its convex corners.
    pub fn new(map: &OccupancyGrid, radius_m: f64, speeds: Speeds) -> Self {
        let blocked = inflate(map, radius_m);
        let corners = convex_corners(&blocked);
        Router {
            seen: corners.iter().map(|_| OnceLock::new()).collect(),
            rows: corners.iter().map(|_| OnceLock::new()).collect(),
            accesses: Mutex::default(),
            ways: Mutex::default(),
            map: map.clone(),
            blocked,
            radius_m,
            speeds,
            corners,
        }
    }

    /// Inflated map, in which every cell is occupied that the centre of the base must not enter.
    pub fn blocked(&self) -> &OccupancyGrid {
        &self.blocked
    }

    /// Map before its inflation.
    pub fn map(&self) -> &OccupancyGrid {
        &self.map
    }

    /// Checks that the base can stand at a point.
    ///
    /// # Errors
    /// [`Failure::Unreachable`] with the obstacle.
    pub fn fits(&self, p: &Point2<f64>) -> Result<(), Failure> {
        if !(p.x.is_finite() && p.y.is_finite()) {
            return Err(unreachable(format!("({}, {}) is no place", p.x, p.y)));
        }
        if self.blocked.cell(p).is_none() {
            return Err(unreachable(format!("({:.2}, {:.2}) lies outside the map", p.x, p.y)));
        }
        if !self.blocked.is_occupied(p) {
            return Ok(());
        }
        Err(unreachable(match nearest_occupied(&self.map, p, self.radius_m) {
            Some((at, gap_m)) => format!(
                "({:.2}, {:.2}) is {gap_m:.2} m from what stands at ({:.2}, {:.2}); the base needs {:.2} m",
                p.x, p.y, at.x, at.y, self.radius_m
            ),
            None => format!("({:.2}, {:.2}) is too near to the edge of the map", p.x, p.y),
        }))
    }

    /// Cost of the drive from one pose to another.
    ///
    /// # Errors
    /// [`Failure::Unreachable`] with the reason.
    pub fn travel(&self, from: &Pose2, to: &Pose2) -> Result<Travel, Failure> {
        self.travel_to_each(from, std::slice::from_ref(to)).swap_remove(0)
    }

    /// Cost of the drives from one pose to each of the others, in the order of `to`; the lines of sight of
    /// the start are shared.
    pub fn travel_to_each(&self, from: &Pose2, to: &[Pose2]) -> Vec<Result<Travel, Failure>> {
        let start = self.start_access(from);
        to.iter()
            .map(|goal| {
                let start = start.as_ref().map_err(Clone::clone)?;
                let end = self.goal_access(goal)?;
                self.best(from, start, goal, &end).map(|(travel, _)| travel)
            })
            .collect()
    }

    /// Cost of the drives between all poses: `table[from][to]`.
    pub fn travel_table(&self, poses: &[Pose2]) -> Vec<Vec<Result<Travel, Failure>>> {
        let ends: Vec<_> = poses.iter().map(|p| self.goal_access(p)).collect();
        let row = |from: &Pose2, start: &Result<Arc<Access>, Failure>| {
            let cost = |(to, end): (&Pose2, &Result<Arc<Access>, Failure>)| {
                let start = start.as_ref().map_err(Clone::clone)?;
                let end = end.as_ref().map_err(Clone::clone)?;
                self.best(from, start, to, end).map(|(travel, _)| travel)
            };
            poses.iter().zip(&ends).map(cost).collect()
        };
        poses.iter().map(|from| row(from, &self.start_access(from))).collect()
    }

    /// Finds the quickest route between two poses, with its waypoints.
    ///
    /// # Errors
    /// [`Failure::Unreachable`] with the reason.
    pub fn route(&self, from: &Pose2, to: &Pose2) -> Result<Route, Failure> {
        let start = self.start_access(from)?;
        let end = self.goal_access(to)?;
        let (travel, via) = self.best(from, &start, to, &end)?;
        let mut points_m = vec![from.point()];
        if start.point != from.point() {
            points_m.push(start.point);
        }
        if let Via::Corners(first, last) = via {
            points_m.extend(self.corner_path(first, last).into_iter().map(|c| self.corners[c as usize]));
        }
        points_m.push(to.point());
        points_m.dedup();
        Ok(Route { points_m, travel })
    }

    fn start_access(&self, from: &Pose2) -> Result<Arc<Access>, Failure> {
        check_heading(from)?;
        let point = match self.fits(&from.point()) {
            Ok(()) => from.point(),
            Err(why) => self.nearest_free(&from.point()).ok_or(why)?,
        };
        Ok(self.access(point))
    }

    fn goal_access(&self, to: &Pose2) -> Result<Arc<Access>, Failure> {
        check_heading(to)?;
        self.fits(&to.point())?;
        Ok(self.access(to.point()))
    }

    fn access(&self, point: Point2<f64>) -> Arc<Access> {
        let key = [point.x.to_bits(), point.y.to_bits()];
        let kept = || self.accesses.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some(access) = kept().get(&key) {
            return access.clone();
        }
        let access = Arc::new(self.find_access(point));
        let mut kept = kept();
        if kept.len() >= MOST_ACCESSES {
            kept.clear();
        }
        kept.insert(key, access.clone());
        access
    }

    fn find_access(&self, point: Point2<f64>) -> Access {
        let line = |(c, corner): (u32, &Point2<f64>)| {
            let step = corner - point;
            self.sees(&point, corner).then(|| (c, step.norm(), step.y.atan2(step.x)))
        };
        Access { point, corners: (0u32..).zip(&self.corners).filter_map(line).collect() }
    }

    /// Centre of the free cell nearest to a point; `None` if there is none within [`START_SLACK_M`].
    fn nearest_free(&self, p: &Point2<f64>) -> Option<Point2<f64>> {
        let reach = (START_SLACK_M / self.blocked.resolution_m).ceil() as i64;
        let (column, row) = self.blocked.cell(p)?;
        let mut best: Option<(f64, Point2<f64>)> = None;
        for dr in -reach..=reach {
            for dc in -reach..=reach {
                let (c, r) = (column as i64 + dc, row as i64 + dr);
                if c < 0 || r < 0 || is_blocked(&self.blocked, c, r) {
                    continue;
                }
                let centre = self.blocked.centre(c as usize, r as usize);
                let gap_m = (centre - p).norm();
                if gap_m <= START_SLACK_M && best.is_none_or(|(least, _)| gap_m < least) {
                    best = Some((gap_m, centre));
                }
            }
        }
        best.map(|(_, centre)| centre)
    }

    /// Cost and course of the quickest route between two poses, cached.
    fn best(&self, from: &Pose2, start: &Access, to: &Pose2, end: &Access) -> Result<(Travel, Via), Failure> {
        let key = (bits(from), bits(to));
        let known = self.known_ways().get(&key).copied();
        let best = known.unwrap_or_else(|| {
            let best = self.find_best(from, start, to, end);
            let mut ways = self.known_ways();
            if ways.len() >= MOST_WAYS {
                ways.clear();
            }
            ways.insert(key, best);
            best
        });
        best.ok_or_else(|| {
            unreachable(format!(
                "no passage {:.2} m wide leads from ({:.2}, {:.2}) to ({:.2}, {:.2})",
                2.0 * self.radius_m,
                from.x_m,
                from.y_m,
                to.x_m,
                to.y_m
            ))
        })
    }

    fn known_ways(&self) -> MutexGuard<'_, HashMap<(PoseBits, PoseBits), Option<(Travel, Via)>>> {
        self.ways.lock().unwrap_or_else(PoisonError::into_inner)
    }

    fn find_best(&self, from: &Pose2, start: &Access, to: &Pose2, end: &Access) -> Option<(Travel, Via)> {
        let seconds = |distance_m: f64, turned_rad: f64| {
            distance_m / self.speeds.linear_m_s + turned_rad / self.speeds.angular_rad_s
        };
        let escape = start.point - from.point();
        let (escape_m, escape_rad, heading_rad) = match escape.norm() {
            gap if gap > 0.0 => {
                let heading = escape.y.atan2(escape.x);
                (gap, turn(from.yaw_rad, heading), heading)
            }
            _ => (0.0, 0.0, from.yaw_rad),
        };
        let total = |distance_m: f64, turned_rad: f64| Travel {
            distance_m: escape_m + distance_m,
            duration_s: seconds(escape_m + distance_m, escape_rad + turned_rad),
        };
        if self.sees(&start.point, &end.point) {
            let step = end.point - start.point;
            let distance_m = step.norm();
            let turned = if distance_m > 0.0 {
                let heading = step.y.atan2(step.x);
                turn(heading_rad, heading) + turn(heading, to.yaw_rad)
            } else {
                turn(heading_rad, to.yaw_rad)
            };
            return Some((total(distance_m, turned), Via::Straight));
        }
        self.best_bent(heading_rad, start, to.yaw_rad, end, total)
    }

    /// Finds the quickest route around corners; `total` converts metres and radians to a cost. First corners
    /// are tried in the order of a lower bound on the cost, until the bound exceeds the best; ties go to the
    /// earlier one.
    fn best_bent(
        &self,
        heading_rad: f64,
        start: &Access,
        goal_rad: f64,
        end: &Access,
        total: impl Fn(f64, f64) -> Travel,
    ) -> Option<(Travel, Via)> {
        let least = |(i, &(a, out_m, out_rad)): (usize, &(u32, f64, f64))| {
            let ahead_m = (end.point - self.corners[a as usize]).norm() * (1.0 - ROUNDING);
            (total(out_m + ahead_m, turn(heading_rad, out_rad)).duration_s, i)
        };
        let mut firsts: Vec<(f64, usize)> = start.corners.iter().enumerate().map(least).collect();
        firsts.sort_unstable_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
        let arriving: Vec<f64> =
            end.corners.iter().map(|(_, _, back_rad)| turn(back_rad + PI, goal_rad)).collect();
        let mut best: Option<(Travel, usize, Via)> = None;
        for (least_s, i) in firsts {
            let (a, out_m, out_rad) = start.corners[i];
            if best.is_some_and(|(best, ..)| least_s > best.duration_s) {
                break;
            }
            let row = self.row(a);
            let leaving = turn(heading_rad, out_rad);
            for (&(b, in_m, back_rad), &arriving) in end.corners.iter().zip(&arriving) {
                let Some(leg) = row[b as usize] else { continue };
                let length_m = out_m + leg.distance_m + in_m;
                let least_s = total(length_m, leaving + arriving).duration_s;
                if best.is_some_and(|(best, ..)| least_s > best.duration_s) {
                    continue;
                }
                let in_rad = back_rad + PI;
                let bends = if a == b {
                    turn(out_rad, in_rad)
                } else {
                    turn(out_rad, leg.first_heading_rad) + leg.turned_rad + turn(leg.last_heading_rad, in_rad)
                };
                let travel = total(length_m, leaving + bends + arriving);
                let better = |(best, first, _): (Travel, usize, Via)| {
                    (travel.duration_s, i) < (best.duration_s, first)
                };
                if best.is_none_or(better) {
                    best = Some((travel, i, Via::Corners(a, b)));
                }
            }
        }
        best.map(|(travel, _, via)| (travel, via))
    }

    fn neighbours(&self, corner: u32) -> &[u32] {
        self.seen[corner as usize].get_or_init(|| {
            let here = &self.corners[corner as usize];
            let visible = |&(c, there): &(u32, &Point2<f64>)| c != corner && self.sees(here, there);
            (0u32..).zip(&self.corners).filter(visible).map(|(c, _)| c).collect()
        })
    }

    /// Shortest routes from one corner to all others, by corner; `None` for a corner that cannot be reached.
    fn row(&self, from: u32) -> &[Option<Leg>] {
        self.rows[from as usize].get_or_init(|| {
            let micrometres = |a: u32, b: u32| {
                ((self.corners[b as usize] - self.corners[a as usize]).norm() * 1e6).round() as u64
            };
            let reached =
                dijkstra_all(&from, |&c| self.neighbours(c).iter().map(move |&n| (n, micrometres(c, n))));
            let mut row: Vec<Option<Leg>> = vec![None; self.corners.len()];
            row[from as usize] = Some(Leg {
                distance_m: 0.0,
                turned_rad: 0.0,
                first_heading_rad: 0.0,
                last_heading_rad: 0.0,
                previous: from,
            });
            let mut by_distance: Vec<(u64, u32, u32)> =
                reached.iter().map(|(&c, &(previous, d))| (d, c, previous)).collect();
            by_distance.sort_unstable();
            for (_, corner, previous) in by_distance {
                let Some(before) = row[previous as usize] else { continue };
                let step = self.corners[corner as usize] - self.corners[previous as usize];
                let heading = step.y.atan2(step.x);
                let first = previous == from;
                row[corner as usize] = Some(Leg {
                    distance_m: before.distance_m + step.norm(),
                    turned_rad: before.turned_rad
                        + if first { 0.0 } else { turn(before.last_heading_rad, heading) },
                    first_heading_rad: if first { heading } else { before.first_heading_rad },
                    last_heading_rad: heading,
                    previous,
                });
            }
            row
        })
    }

    fn corner_path(&self, from: u32, to: u32) -> Vec<u32> {
        let row = self.row(from);
        let mut path = vec![to];
        let mut at = to;
        while at != from {
            let Some(leg) = row[at as usize] else { break };
            at = leg.previous;
            path.push(at);
        }
        path.reverse();
        path
    }

    /// True if the centre of the base can go straight from `a` to `b`: every cell that the line touches is free.
    pub fn sees(&self, a: &Point2<f64>, b: &Point2<f64>) -> bool {
        let scaled = |p: &Point2<f64>| (p - self.blocked.origin_m) / self.blocked.resolution_m;
        let (from, to) = (scaled(a), scaled(b));
        let step = to - from;
        let (mut column, mut row) = (from.x.floor() as i64, from.y.floor() as i64);
        let (last_column, last_row) = (to.x.floor() as i64, to.y.floor() as i64);
        let (sign_x, sign_y) = (if step.x > 0.0 { 1 } else { -1 }, if step.y > 0.0 { 1 } else { -1 });
        let first_edge = |at: f64, cell: i64, step: f64| match step {
            s if s > 0.0 => (cell as f64 + 1.0 - at) / s,
            s if s < 0.0 => (cell as f64 - at) / s,
            _ => f64::INFINITY,
        };
        let (mut next_x, mut next_y) = (first_edge(from.x, column, step.x), first_edge(from.y, row, step.y));
        let (stride_x, stride_y) = (1.0 / step.x.abs(), 1.0 / step.y.abs());
        let steps = (last_column - column).abs() + (last_row - row).abs();
        if is_blocked(&self.blocked, column, row) {
            return false;
        }
        let mut done = 0;
        while done < steps {
            if (next_x - next_y).abs() < 1e-9 && column != last_column && row != last_row {
                // Through the very corner of four cells: a gap of no width between two blocked ones is none.
                if is_blocked(&self.blocked, column + sign_x, row)
                    && is_blocked(&self.blocked, column, row + sign_y)
                {
                    return false;
                }
                (column, row) = (column + sign_x, row + sign_y);
                (next_x, next_y) = (next_x + stride_x, next_y + stride_y);
                done += 2;
            } else if (next_x < next_y && column != last_column) || row == last_row {
                column += sign_x;
                next_x += stride_x;
                done += 1;
            } else {
                row += sign_y;
                next_y += stride_y;
                done += 1;
            }
            if is_blocked(&self.blocked, column, row) {
                return false;
            }
        }
        true
    }
}

fn bits(pose: &Pose2) -> PoseBits {
    [pose.x_m, pose.y_m, pose.yaw_rad].map(f64::to_bits)
}

fn check_heading(pose: &Pose2) -> Result<(), Failure> {
    if pose.yaw_rad.is_finite() {
        Ok(())
    } else {
        Err(unreachable(format!("{} is no heading", pose.yaw_rad)))
    }
}

fn unreachable(because: String) -> Failure {
    Failure::Unreachable { because }
}

/// Absolute angle between two headings, 0 to π radians.
pub fn turn(from_rad: f64, to_rad: f64) -> f64 {
    let full = std::f64::consts::TAU;
    let d = (to_rad - from_rad).rem_euclid(full);
    d.min(full - d)
}

fn is_blocked(grid: &OccupancyGrid, column: i64, row: i64) -> bool {
    column < 0
        || row < 0
        || column >= grid.width as i64
        || row >= grid.height as i64
        || grid.occupied[row as usize * grid.width + column as usize]
}

/// Blocks every cell whose centre is nearer than `radius_m` to an occupied cell or to the edge of the map.
fn inflate(map: &OccupancyGrid, radius_m: f64) -> OccupancyGrid {
    let mut blocked = map.clone();
    let cells = radius_m / map.resolution_m;
    let reach = (cells + 0.5).ceil() as i64;
    let gap = |d: i64| (d.abs() as f64 - 0.5).max(0.0);
    let disc: Vec<(i64, i64)> = (-reach..=reach)
        .flat_map(|r| (-reach..=reach).map(move |c| (c, r)))
        .filter(|&(c, r)| gap(c).hypot(gap(r)) < cells)
        .collect();
    let (width, height) = (map.width as i64, map.height as i64);
    // The rows and columns just outside count as occupied: beyond the map nothing is known.
    for row in -1..=height {
        for column in -1..=width {
            let hidden =
                [(1, 0), (-1, 0), (0, 1), (0, -1)].iter().all(|&(c, r)| is_blocked(map, column + c, row + r));
            if !is_blocked(map, column, row) || hidden {
                continue;
            }
            for &(dc, dr) in &disc {
                let (c, r) = (column + dc, row + dr);
                if c >= 0 && r >= 0 && c < width && r < height {
                    blocked.occupied[(r * width + c) as usize] = true;
                }
            }
        }
    }
    blocked
}

/// Convex corners of the obstacles, where shortest routes bend: centres of the free cells that touch a
/// blocked cell at a corner only.
fn convex_corners(blocked: &OccupancyGrid) -> Vec<Point2<f64>> {
    let mut corners = Vec::new();
    for row in 0..blocked.height as i64 {
        for column in 0..blocked.width as i64 {
            let is_corner = |dc: i64, dr: i64| {
                is_blocked(blocked, column + dc, row + dr)
                    && !is_blocked(blocked, column + dc, row)
                    && !is_blocked(blocked, column, row + dr)
            };
            let bends = [(1, 1), (1, -1), (-1, 1), (-1, -1)].iter().any(|&(c, r)| is_corner(c, r));
            if bends && !is_blocked(blocked, column, row) {
                corners.push(blocked.centre(column as usize, row as usize));
            }
        }
    }
    corners
}

/// Centre of the occupied cell nearest to a point, and the distance from the point to that cell, metres. Only
/// cells up to about `reach_m` away are searched.
fn nearest_occupied(map: &OccupancyGrid, p: &Point2<f64>, reach_m: f64) -> Option<(Point2<f64>, f64)> {
    let half_m = 0.5 * map.resolution_m;
    let cells = (reach_m / map.resolution_m).ceil() as usize + 1;
    let (column, row) = map.cell(p)?;
    let mut best: Option<(Point2<f64>, f64)> = None;
    for row in row.saturating_sub(cells)..(row + cells + 1).min(map.height) {
        for column in column.saturating_sub(cells)..(column + cells + 1).min(map.width) {
            if !map.occupied[row * map.width + column] {
                continue;
            }
            let centre = map.centre(column, row);
            let off = (centre - p).abs();
            let gap_m = (off.x - half_m).max(0.0).hypot((off.y - half_m).max(0.0));
            if best.is_none_or(|(_, least)| gap_m < least) {
                best = Some((centre, gap_m));
            }
        }
    }
    best
}
