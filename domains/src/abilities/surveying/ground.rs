//! Floor knowledge from drives: visited places are passable, and places where a drive failed are not
//! tried again.
//!
//! Both are kept in the map frame of the body. Localisation errs by centimetres there, and so does the
//! map read from views: at corners that are passed closely no margin is enough.

use descry_memory::remember::Surveyed;
use descry_perception::mapping::{ExploreOptions, Reach, standable};
use descry_perception::nalgebra::{Isometry2, Point2, Vector2};
use descry_perception::occupancy::{Occupancy, Space};
use descry_robots::{Failure, Place, Pose2, Robot};
use descry_skills::SkillFailure;

use super::taken;
use crate::mind::Mind;
use crate::own_map::OwnMap;
use crate::situation::Situation;

/// Distance from the body and the remaining route within which the body is asked, after a failed drive,
/// where it fits, metres.
const ASKED_M: f64 = 0.8;
/// Maximum distance of a cell's centre from a driven line for the cell to count as passed, cells.
const PASSED: f64 = std::f64::consts::FRAC_1_SQRT_2;

/// Floor knowledge from drives.
#[derive(Clone, Debug, Default)]
pub struct Ground {
    /// Straight lines along which the body's centre drove, map frame.
    pub driven: Vec<[Point2<f64>; 2]>,
    /// Places where the body reports that it does not fit, though views show nothing there; map frame.
    pub barred: Vec<Point2<f64>>,
}

/// Cells of the floor's grid in which the body's centre may be.
pub struct Footing {
    /// For each cell, true if all knowledge allows the body there with clearance.
    pub stand: Vec<bool>,
    /// For each cell, true if all knowledge allows the body there without clearance: used where no other
    /// route leads on.
    pub pass: Vec<bool>,
    /// For each cell, true if views and drives alone allow the body there, without clearance and without
    /// regard to reports.
    pub shown: Vec<bool>,
}

impl Footing {
    /// Reachable positions of a body: with clearance as far as such routes lead, and beyond
    /// without.
    pub(super) fn reach(&self, floor: &Occupancy, from: &Isometry2<f64>, options: &ExploreOptions) -> Reach {
        let mut reach = Reach::over(floor, from, &self.stand, options);
        let narrow = self.reach_through(&self.pass, floor, from, options);
        let ways = reach.ways_m.iter_mut().zip(&narrow.ways_m);
        ways.filter(|(way_m, _)| way_m.is_infinite()).for_each(|(way_m, narrow_m)| *way_m = *narrow_m);
        reach
    }

    /// Positions with clearance that are reachable if the body's reports are ignored along the way.
    pub(super) fn reach_as_shown(
        &self,
        floor: &Occupancy,
        from: &Isometry2<f64>,
        options: &ExploreOptions,
    ) -> Reach {
        self.reach_through(&self.shown, floor, from, options)
    }

    /// Positions with clearance that are reachable across the cells `over`.
    fn reach_through(
        &self,
        over: &[bool],
        floor: &Occupancy,
        from: &Isometry2<f64>,
        options: &ExploreOptions,
    ) -> Reach {
        let mut reach = Reach::over(floor, from, over, options);
        let ways = reach.ways_m.iter_mut().zip(&self.stand);
        ways.filter(|(_, may)| !**may).for_each(|(way_m, _)| *way_m = f64::INFINITY);
        reach
    }
}

impl Ground {
    pub(super) fn of(kept: &Surveyed) -> Ground {
        Ground { driven: kept.driven.clone(), barred: kept.barred.clone() }
    }

    pub(super) fn keep(&self, kept: &mut Surveyed) {
        kept.driven.clone_from(&self.driven);
        kept.barred.clone_from(&self.barred);
    }

    /// Marks the floor that was driven over as free, and returns where a body of this radius may be,
    /// with and without this clearance, metres.
    pub fn open(
        &self,
        floor: &mut Occupancy,
        (radius_m, margin_m): (f64, f64),
        map_from_chart: &Isometry2<f64>,
    ) -> Footing {
        let chart_from_map = map_from_chart.inverse();
        let mut driven: Vec<usize> = Vec::new();
        for [from, to] in &self.driven {
            let [from, to] = [from, to].map(|p| chart_from_map * p);
            let steps = ((to - from).norm() / (0.5 * floor.cell_m)).ceil().clamp(1.0, 1e4) as usize;
            for k in 0..=steps {
                driven.extend(passed(floor, &(from + (to - from) * (k as f64 / steps as f64))));
            }
        }
        driven.iter().for_each(|&square| floor.cells[square] = Space::Free);
        let may = |room_m: f64| {
            let mut may = standable(floor, room_m);
            driven.iter().for_each(|&square| may[square] = true);
            may
        };
        let (mut stand, shown) = (may(radius_m + margin_m), may(radius_m));
        let mut pass = shown.clone();
        for square in self.barred.iter().filter_map(|p| square(floor, &(chart_from_map * p))) {
            (stand[square], pass[square]) = (false, false);
        }
        Footing { stand, pass, shown }
    }

    /// True if the body reported places where it does not fit though they seem to be passable.
    pub(super) fn is_barred(&self) -> bool {
        !self.barred.is_empty()
    }

    /// Adds the part of a route that was driven, from its start to `to`, where the body stopped.
    pub fn drove(&mut self, from: &Place, way: &[Place], to: &Place) {
        let (Place::Pose(from), Place::Pose(to)) = (from, to) else { return };
        let mut corners = vec![from.point()];
        corners.extend(points(way));
        let lines: Vec<[Point2<f64>; 2]> = corners.windows(2).map(|line| [line[0], line[1]]).collect();
        let end = to.point();
        let off_m = |line: &[Point2<f64>; 2]| (nearest(line, &end) - end).norm();
        let Some(last) = (0..lines.len()).min_by(|&a, &b| off_m(&lines[a]).total_cmp(&off_m(&lines[b])))
        else {
            return;
        };
        self.driven.extend(&lines[..last]);
        let begun = lines[last][0];
        let stopped = nearest(&lines[last], &end);
        let both = [[begun, stopped], [stopped, end]];
        self.driven.extend(both.iter().filter(|line| line[0] != line[1]));
    }
}

/// Handles a finished drive: opens the driven floor in the body's own map.
pub(super) fn has_driven(mind: &mut Mind, s: &Situation) {
    let (from, to) = (&s.candidates[s.at].place, mind.known.candidates[mind.known.at].place.clone());
    if let Some(way) = s.chart().way(from, &to) {
        mind.known.change_chart(|chart| chart.ground.drove(from, &way, &to));
    }
}

/// Handles a drive that ended early on the body's own map: opens the driven part, and bars places where
/// the body reports not to fit. Returns a sentence; `None` without such a map or new barred places.
pub(super) fn drive_failed(
    mind: &mut Mind,
    robot: &dyn Robot,
    s: &Situation,
    to: &str,
    failure: &SkillFailure,
) -> Option<String> {
    let (from, to) = (&s.candidates[s.at].place, &s.candidates[s.candidate(to).ok()?].place);
    let way = s.chart().way(from, to)?;
    let here = mind.known.candidates[mind.known.at].place.clone();
    let is_of_ways = matches!(
        failure,
        SkillFailure::Body(Failure::Blocked { by: None, .. } | Failure::Unreachable { .. })
    );
    let news = mind.known.change_chart(|chart| {
        chart.ground.drove(from, &way, &here);
        let seem = chart.passable();
        let news = if is_of_ways { ask(&mut chart.ground, seem, robot, &here, &way) } else { 0 };
        chart.find_ways(robot.description());
        news
    });
    taken::look_out(mind, robot, "");
    let square_m = mind.known.chart().map.as_ref()?.grid.as_ref()?.cell_m;
    (news > 0).then(|| {
        let news_m2 = news as f64 * square_m * square_m;
        format!("{news_m2:.2} m² of floor near there seem to be open and are not: ways lead around them")
    })
}

/// Asks the body at which of the positions `seem`, which seem passable, it does not fit, around it and
/// along its route; bars them and returns their number.
pub fn ask(
    ground: &mut Ground,
    seem: Vec<Point2<f64>>,
    robot: &dyn Robot,
    here: &Place,
    way: &[Place],
) -> usize {
    let Place::Pose(at) = here else { return 0 };
    let mut corners = vec![at.point(), at.point()];
    corners.extend(points(way));
    let off_m = |line: &[Point2<f64>], p: &Point2<f64>| (nearest(&[line[0], line[1]], p) - p).norm();
    let is_near = |p: &Point2<f64>| corners.windows(2).any(|line| off_m(line, p) <= ASKED_M);
    let asked: Vec<Point2<f64>> = seem.into_iter().filter(is_near).collect();
    let places: Vec<Place> = asked.iter().map(|p| Place::Pose(Pose2::new(p.x, p.y, 0.0))).collect();
    let said = robot.travel(here, &places, &[]);
    // Where none of it can be reached, it is something else that is wrong.
    if !said.iter().any(Result::is_ok) {
        return 0;
    }
    let is_refused = |said: &Result<_, Failure>| matches!(said, Err(Failure::Unreachable { .. }));
    let before = ground.barred.len();
    ground.barred.extend(asked.iter().zip(&said).filter(|(_, said)| is_refused(said)).map(|(p, _)| *p));
    ground.barred.len() - before
}

fn points(way: &[Place]) -> impl Iterator<Item = Point2<f64>> {
    way.iter().filter_map(|place| match place {
        Place::Pose(pose) => Some(pose.point()),
        Place::Station(_) => None,
    })
}

/// Point of a segment nearest to a point.
pub fn nearest([a, b]: &[Point2<f64>; 2], p: &Point2<f64>) -> Point2<f64> {
    let along = b - a;
    let share = (p - a).dot(&along) / along.norm_squared();
    if share.is_finite() { a + along * share.clamp(0.0, 1.0) } else { *a }
}

/// Index of the cell that contains a point; `None` outside the grid.
pub fn square(grid: &Occupancy, place: &Point2<f64>) -> Option<usize> {
    let at = ((place - grid.origin) / grid.cell_m).map(f64::floor);
    let rows = grid.cells.len() / grid.width.max(1);
    let inside = at.x >= 0.0 && at.y >= 0.0 && at.x < grid.width as f64 && at.y < rows as f64;
    inside.then(|| at.y as usize * grid.width + at.x as usize)
}

/// Indices of the cells that a line through a point passes, see [`PASSED`].
fn passed(grid: &Occupancy, place: &Point2<f64>) -> impl Iterator<Item = usize> {
    let (grid, place) = (grid, *place);
    let around = (-1..=1).flat_map(|x| (-1..=1).map(move |y| Vector2::new(f64::from(x), f64::from(y))));
    around.filter_map(move |step| {
        let square = square(grid, &(place + step * grid.cell_m))?;
        ((middle(grid, square) - place).norm() <= PASSED * grid.cell_m).then_some(square)
    })
}

/// Centre of the cell with an index.
pub fn middle(grid: &Occupancy, square: usize) -> Point2<f64> {
    let width = grid.width.max(1);
    let steps = Vector2::new((square % width) as f64 + 0.5, (square / width) as f64 + 0.5);
    grid.origin + steps * grid.cell_m
}
