//! What drives teach of the floor: where the body has been it may be again, and where it could not go it does not try again.
//!
//! Both are in the body's own map. It errs there by centimetres, as the map that is read from looks does: at corners that are passed closely no
//! margin is enough.

use std::sync::Arc;

use descry_memory::remember::Surveyed;
use descry_perception::mapping::{ExploreOptions, Reach, standable};
use descry_perception::nalgebra::{Isometry2, Point2, Vector2};
use descry_perception::occupancy::{Occupancy, Space};
use descry_robots::{Failure, Place, Pose2, Robot};
use descry_skills::SkillFailure;

use super::taken;
use crate::mind::Mind;
use crate::situation::Situation;

/// After a failed drive the body is asked for the floor up to this far from where it stands and from the rest of its way, metres.
const ASKED_M: f64 = 0.8;
/// Squares whose middle lies this near to a line that was driven are those that it passes, in squares.
const PASSED: f64 = std::f64::consts::FRAC_1_SQRT_2;

/// See the module.
#[derive(Clone, Debug, Default)]
pub(super) struct Ground {
    /// Straight lines that were driven.
    driven: Vec<[Point2<f64>; 2]>,
    /// Places where the body does not fit, as it says, though looks show nothing there.
    barred: Vec<Point2<f64>>,
}

/// Squares on which the middle of the body may be, in the order of a grid's cells.
pub(super) struct Footing {
    /// By all that is known, with a margin.
    pub(super) stand: Vec<bool>,
    /// The same without a margin: where it may go if no other way leads on.
    pub(super) pass: Vec<bool>,
    /// By looks and what was driven alone, without a margin.
    pub(super) shown: Vec<bool>,
}

impl Footing {
    /// What a body can get to: with a margin as far as ways with one lead, and from there on without.
    pub(super) fn reach(&self, floor: &Occupancy, from: &Isometry2<f64>, options: &ExploreOptions) -> Reach {
        let mut reach = Reach::over(floor, from, &self.stand, options);
        let narrow = self.reach_through(&self.pass, floor, from, options);
        let ways = reach.ways_m.iter_mut().zip(&narrow.ways_m);
        ways.filter(|(way_m, _)| way_m.is_infinite()).for_each(|(way_m, narrow_m)| *way_m = *narrow_m);
        reach
    }

    /// What it could get to if it went by looks and by what was driven alone.
    pub(super) fn reach_as_shown(
        &self,
        floor: &Occupancy,
        from: &Isometry2<f64>,
        options: &ExploreOptions,
    ) -> Reach {
        self.reach_through(&self.shown, floor, from, options)
    }

    /// To where it may stand, over some squares.
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

    /// Opens the floor that was driven over, and says where a body may be that is so large and keeps a margin from what is occupied, metres.
    pub(super) fn open(
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

    /// Whether drives have told of floor that only seems to be open.
    pub(super) fn is_barred(&self) -> bool {
        !self.barred.is_empty()
    }

    /// Takes in a drive that has come as far as `to`.
    pub(super) fn drove(&mut self, from: &Place, way: &[Place], to: &Place) {
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

/// A drive has come to its end: where it led over the map that the body has made itself, that floor is open.
pub(in crate::abilities) fn drove(mind: &mut Mind, s: &Situation, to: usize) {
    let (from, to) = (&s.candidates[s.at].place, &s.candidates[to].place);
    if let Some(way) = s.chart.way(from, to) {
        Arc::make_mut(&mut mind.known.chart).ground.drove(from, &way, to);
    }
}

/// A drive over the map that the body has made itself has ended early: what of its way was driven is open, and where the body says by now that it does
/// not fit it does not try again. What is concluded from that; nothing if it has no such map or says nothing new.
pub(in crate::abilities) fn drive_failed(
    mind: &mut Mind,
    robot: &dyn Robot,
    s: &Situation,
    to: &str,
    failure: &SkillFailure,
) -> Option<String> {
    let (from, to) = (&s.candidates[s.at].place, &s.candidates[s.candidate(to).ok()?].place);
    let way = s.chart.way(from, to)?;
    let here = mind.known.candidates[mind.known.at].place.clone();
    let chart = Arc::make_mut(&mut mind.known.chart);
    chart.ground.drove(from, &way, &here);
    let is_of_ways = matches!(
        failure,
        SkillFailure::Body(Failure::Blocked { by: None, .. } | Failure::Unreachable { .. })
    );
    let seem = chart.passable();
    let news = if is_of_ways { ask(&mut chart.ground, seem, robot, &here, &way) } else { 0 };
    chart.find_ways(robot.description());
    taken::look_out(mind, robot, "");
    let square_m = mind.known.chart.map.as_ref()?.grid.as_ref()?.cell_m;
    (news > 0).then(|| {
        let news_m2 = news as f64 * square_m * square_m;
        format!("{news_m2:.2} m² of floor near there seem to be open and are not: ways lead around them")
    })
}

/// Asks the body where it does not fit, of the places around it and along its way where it seems to; how many there are.
fn ask(ground: &mut Ground, seem: Vec<Point2<f64>>, robot: &dyn Robot, here: &Place, way: &[Place]) -> usize {
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

/// The point of a line that is nearest to a place.
fn nearest([a, b]: &[Point2<f64>; 2], p: &Point2<f64>) -> Point2<f64> {
    let along = b - a;
    let share = (p - a).dot(&along) / along.norm_squared();
    if share.is_finite() { a + along * share.clamp(0.0, 1.0) } else { *a }
}

/// Number of the square that holds a place.
pub(super) fn square(grid: &Occupancy, place: &Point2<f64>) -> Option<usize> {
    let at = ((place - grid.origin) / grid.cell_m).map(f64::floor);
    let rows = grid.cells.len() / grid.width.max(1);
    let inside = at.x >= 0.0 && at.y >= 0.0 && at.x < grid.width as f64 && at.y < rows as f64;
    inside.then(|| at.y as usize * grid.width + at.x as usize)
}

/// The squares that a body passes there.
fn passed(grid: &Occupancy, place: &Point2<f64>) -> impl Iterator<Item = usize> {
    let (grid, place) = (grid, *place);
    let around = (-1..=1).flat_map(|x| (-1..=1).map(move |y| Vector2::new(f64::from(x), f64::from(y))));
    around.filter_map(move |step| {
        let square = square(grid, &(place + step * grid.cell_m))?;
        ((middle(grid, square) - place).norm() <= PASSED * grid.cell_m).then_some(square)
    })
}

/// The middle of a square.
fn middle(grid: &Occupancy, square: usize) -> Point2<f64> {
    let width = grid.width.max(1);
    let steps = Vector2::new((square % width) as f64 + 0.5, (square / width) as f64 + 0.5);
    grid.origin + steps * grid.cell_m
}

#[cfg(test)]
mod tests {
    use descry_robots::sim::{SceneSpec, SimOptions, SimRobot, arrange};

    use super::*;

    const ROOM_M: (f64, f64) = (0.25, 0.08);

    fn pose(x: f64, y: f64) -> Place {
        Place::Pose(Pose2::new(x, y, 0.0))
    }

    /// A corridor 2 m long and `width_m` wide between walls, cells of 10 cm.
    fn corridor(width_m: f64) -> Occupancy {
        let (width, rows) = (20, (width_m / 0.1).round() as usize + 2);
        let is_wall = |n: usize| n / width == 0 || n / width == rows - 1;
        let cells = (0..width * rows).map(|n| if is_wall(n) { Space::Occupied } else { Space::Free });
        Occupancy { origin: Point2::origin(), cell_m: 0.1, width, cells: cells.collect() }
    }

    /// Where it was driven it is open, whatever looks show there, in the frame that the map has by now; where the body does not fit it is not.
    #[test]
    fn ways_lead_over_what_was_driven_and_not_where_the_body_does_not_fit() {
        let at = |x: f64, y: f64| Point2::new(x, y);
        let here = Isometry2::identity();
        let moved = Isometry2::new(Vector2::new(-0.3, 0.2), 0.1);
        // Too narrow for the body with its margin, so that nothing is left; with a place that is noise, in its middle.
        for map_from_chart in [here, moved] {
            let mut floor = corridor(0.3);
            let noise = square(&floor, &at(1.05, 0.25)).unwrap();
            floor.cells[noise] = Space::Occupied;
            let none = Ground::default().open(&mut floor, ROOM_M, &map_from_chart);
            assert!(none.stand.iter().chain(&none.pass).chain(&none.shown).all(|may| !may));
            let [from, to] = [at(0.15, 0.25), at(1.85, 0.26)].map(|p| map_from_chart * p);
            let mut ground = Ground { driven: vec![[from, to]], barred: Vec::new() };
            let open = ground.open(&mut floor, ROOM_M, &map_from_chart);
            let squares: Vec<usize> =
                (0..20).map(|x| square(&floor, &at(0.1 * f64::from(x) + 0.05, 0.25)).unwrap()).collect();
            assert!(squares[1..19].iter().all(|&n| open.stand[n]), "{map_from_chart}");
            assert!(floor.cells[noise] == Space::Free && open.pass == open.shown);
            ground.barred.push(map_from_chart * at(1.05, 0.25));
            let barred = ground.open(&mut floor, ROOM_M, &map_from_chart);
            assert!(
                !barred.stand[noise]
                    && !barred.pass[noise]
                    && barred.shown[noise]
                    && barred.stand[squares[3]]
            );
        }
    }

    /// A drive that ended early has come as far as where the body stands; beyond that nothing is known.
    #[test]
    fn what_is_open_is_what_was_driven() {
        let way = [pose(2.0, 0.0), pose(2.0, 2.0)];
        let check = |end: (f64, f64), lines: usize, off: &[(f64, f64)]| {
            let mut ground = Ground::default();
            ground.drove(&pose(0.0, 0.0), &way, &pose(end.0, end.1));
            assert_eq!(ground.driven.len(), lines, "{end:?}: {:?}", ground.driven);
            let is_on = |x, y| {
                let p = Point2::new(x, y);
                ground.driven.iter().any(|line| (nearest(line, &p) - p).norm() < 0.05)
            };
            assert!(off.iter().all(|&(x, y)| !is_on(x, y)) && (lines == 0 || is_on(end.0, end.1)), "{end:?}");
        };
        check((1.0, 0.02), 2, &[(1.2, 0.0), (2.0, 1.0)]);
        check((2.0, 1.0), 2, &[(2.0, 1.2)]);
        check((2.01, 2.0), 3, &[]);
        check((0.0, 0.0), 0, &[(0.2, 0.0)]);
    }

    #[test]
    fn a_body_that_failed_is_asked_where_it_does_not_fit() {
        let scene = "[room]\nsize_m = [5.0, 5.0]\n[[surface]]\nname = \"table\"\nsize_m = [1.0, 1.0]\nheight_m = 0.7\n[start]\nposition_m = [-1.5, 0.0]";
        let spec = SceneSpec::parse("room.toml", scene).unwrap();
        let robot = SimRobot::new(arrange(&spec, 1).unwrap(), SimOptions::default());
        let places =
            (-10..=10).flat_map(|x| (-10..=10).map(move |y| (0.2 * f64::from(x), 0.2 * f64::from(y))));
        let seem: Vec<Point2<f64>> = places.map(|(x, y)| Point2::new(x, y)).collect();
        let (here, way) = (pose(-1.2, 0.0), [pose(-0.9, 0.9), pose(1.2, 1.2)]);
        let mut ground = Ground::default();
        let count = ask(&mut ground, seem.clone(), &robot, &here, &way);
        let reach_m = |p: &Point2<f64>| p.coords.amax();
        assert!(count > 10 && count == ground.barred.len(), "{count}");
        assert!(ground.barred.iter().all(|p| reach_m(p) < 0.85), "what is free is not barred");
        let left: Vec<Point2<f64>> = seem.into_iter().filter(|p| !ground.barred.contains(p)).collect();
        assert_eq!(ask(&mut ground, left.clone(), &robot, &here, &way), 0, "what is known is no news");
        assert!(left.iter().any(|p| reach_m(p) < 0.85 && p.x > p.y + 0.5), "nobody asks far from the way");
        // Where nothing can be reached, nothing is learned.
        let within = vec![Point2::new(-0.2, 0.6), Point2::new(0.2, 0.6)];
        assert_eq!(ask(&mut Ground::default(), within, &robot, &here, &way), 0);
    }
}
