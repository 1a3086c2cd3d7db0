//! Map under construction by a body without a map: observed cells, walls, surfaces and open floor,
//! routes on that floor, and exploration viewpoints.

use std::sync::Arc;

use descry_memory::RecordId;
use descry_memory::remember::Surveyed;
use descry_perception::mapping::{
    ExploreOptions, FieldOfView, Level, MapOptions, Outlook, Reach, RectifyOptions, RoomMap, Survey, Unseen,
    frontiers, outlooks,
};
use descry_perception::nalgebra::{Isometry2, Point2, UnitComplex, Vector2, Vector3};
use descry_perception::occupancy::{Occupancy, Space};
use descry_robots::route::Router;
use descry_robots::{Camera, Description, Failure, OccupancyGrid, Place, Pose2, Robot, Travel};

use super::ground::{self, Footing, Ground};
use crate::config::Candidates;
use crate::known::Known;
use crate::load::Domain;
use crate::own_map::{NoMap, OwnMap};
use crate::past::Past;
use crate::states::{States, state};
use crate::surface::KnownSurface;
use crate::symbol::symbol;
use crate::viewpoint::Candidate;

/// Name of the ability.
pub(super) const NAME: &str = "surveying";
/// Edge length of the cells of observed space, metres.
const CELL_M: f64 = 0.1;
/// Maximum depth used for the map, metres; the noise of a stereo camera grows with its square.
const FAR_M: f64 = 5.0;
/// Height range of obstacles to the body, metres.
pub(super) const BODY_M: std::ops::RangeInclusive<f64> = 0.15..=1.6;
/// Height range of supporting surfaces, metres.
const SURFACE_M: std::ops::RangeInclusive<f64> = 0.3..=1.4;
/// Minimum area of supporting surfaces, square metres.
const SURFACE_M2: f64 = 0.15;
/// Clearance between the footprint and mapped obstacles, metres: half a cell, plus the pose error.
const CLEAR_M: f64 = 0.08;
/// Number of exploration poses offered to the planner.
const WEIGHED: usize = 7;
/// Assumed duration of a view, seconds.
pub(super) const LOOK_S: f64 = 2.0;
/// Area of floor that counts as unknown before the first view, square metres.
pub(super) const NOTHING_SEEN_M2: f64 = 100.0;
/// Maximum height difference of overlapping level surfaces that count as one, metres.
const SAME_HEIGHT_M: f64 = 0.08;

/// Map under construction by a body without a map.
#[derive(Clone, Default)]
pub struct Chart {
    survey: Option<Survey>,
    /// Poses of the body at the views of this run and earlier ones, optimised, in the chart's frame:
    /// that of the first view.
    pub(super) stood: Vec<Isometry2<f64>>,
    /// Poses at the same views as localisation stated them, in the map frame of the body.
    pub(super) believed: Vec<Isometry2<f64>>,
    /// Transform from the chart's frame to the map frame of the body: the heading was some degrees off
    /// at the first view.
    pub(super) map_from_chart: Isometry2<f64>,
    /// Walls, surfaces and open floor; `None` before the first view.
    pub(super) map: Option<Arc<RoomMap>>,
    /// Routes with clearance; `None` before the first view.
    router: Option<Arc<Router>>,
    /// Routes without clearance, for places that are unreachable otherwise.
    narrow: Option<Arc<Router>>,
    /// Passability of floor as learned from drives.
    pub(super) ground: Ground,
    /// Exploration poses, each with its symbol and what is expected to be seen from there.
    pub(super) open: Vec<(String, Outlook)>,
    /// Unknown floor visible only from places that became unreachable through failed drives, square
    /// metres.
    cut_off_m2: f64,
    /// Level supporting surfaces, each with its name.
    pub(super) surfaces: Vec<(String, Level)>,
    /// Number of pose symbols assigned so far.
    given: usize,
    /// Number and distance of the viewpoints placed around a surface.
    pub(super) poses: Candidates,
    /// Ids of the recorded views that the map is built from.
    pub(super) records: Vec<RecordId>,
}

impl Chart {
    /// Initial map of a run: that of an earlier run, if the domain uses one and the body has none.
    pub fn begin(domain: &Domain, past: Option<&Past>, robot: &dyn Robot) -> Self {
        let is_used = domain.config.uses.iter().any(|name| name == NAME);
        let mut chart = Chart { poses: domain.config.candidates, ..Chart::default() };
        let kept = past.and_then(|p| p.remembered.surveyed.as_ref());
        if let Some(kept) = kept.filter(|_| is_used && robot.map().is_none()) {
            chart.survey = Some(kept.survey.clone());
            chart.stood.clone_from(&kept.stood);
            chart.believed.clone_from(&kept.believed);
            chart.surfaces.clone_from(&kept.surfaces);
            chart.ground = Ground::of(kept);
            chart.read(robot.description());
        }
        chart
    }

    /// Survey for a later run; `None` if nothing was seen.
    pub(crate) fn kept(&self) -> Option<Surveyed> {
        let survey = self.survey.clone()?;
        let (stood, believed) = (self.stood.clone(), self.believed.clone());
        let surfaces = self.surfaces.clone();
        let (driven, barred) = (Vec::new(), Vec::new());
        let mut kept = Surveyed { survey, stood, believed, surfaces, driven, barred };
        self.ground.keep(&mut kept);
        Some(kept)
    }

    /// Accumulated survey, begun if there is none.
    pub(super) fn survey(&mut self) -> Result<&mut Survey, String> {
        if self.survey.is_none() {
            self.survey = Some(Survey::new(CELL_M).map_err(|e| e.to_string())?);
        }
        self.survey.as_mut().ok_or_else(|| "nothing was seen".into())
    }

    /// Sets `map_from_chart` by aligning the optimised poses as a whole with the stated ones, so that
    /// the errors of the stated ones average out.
    fn settle(&mut self) {
        let pairs = || self.believed.iter().zip(&self.stood);
        let count = self.stood.len().min(self.believed.len()).max(1) as f64;
        let turns = pairs().map(|(b, s)| *(b.rotation * s.rotation.inverse()));
        let turn = turns
            .reduce(|sum, turn| sum + turn)
            .map_or_else(UnitComplex::identity, UnitComplex::from_complex);
        let shifts = pairs().map(|(b, s)| b.translation.vector - turn * s.translation.vector);
        let shift = shifts.fold(Vector2::zeros(), |sum, shift| sum + shift) / count;
        self.map_from_chart = Isometry2::from_parts(shift.into(), turn);
    }

    /// Extracts walls, surfaces, open floor and routes from the observations.
    pub(super) fn read(&mut self, body: &Description) {
        self.settle();
        let Some(map) = self.survey.as_ref().and_then(|s| s.map(&MapOptions::default()).ok()) else { return };
        for level in map.levels.iter().filter(|l| is_surface(l)) {
            match self.surfaces.iter_mut().find(|(_, known)| is_one(known, level)) {
                Some((_, known)) => known.clone_from(level),
                None => self.surfaces.push((format!("surface {}", self.surfaces.len() + 1), level.clone())),
            }
        }
        self.map = Some(Arc::new(map));
        self.find_ways(body);
    }

    /// Updates the routes over the mapped floor, as observed and as learned from drives.
    pub(super) fn find_ways(&mut self, body: &Description) {
        let (Some((floor, footing)), Some(base)) = (self.footing(body), &body.base) else {
            (self.router, self.narrow) = (None, None);
            return;
        };
        // The grids leave the body's room out already.
        let over = |may: &[bool]| Some(Arc::new(Router::new(&grid(&floor, may), 0.0, base.speeds)));
        (self.router, self.narrow) = (over(&footing.stand), over(&footing.pass));
    }

    /// Positions that the body's centre may take without clearance, in the map frame of the body.
    pub(super) fn passable(&self) -> Vec<Point2<f64>> {
        let Some(router) = &self.narrow else { return Vec::new() };
        let free = router.map();
        let squares = (0..free.occupied.len()).filter(|&square| !free.occupied[square]);
        let middle = |square: usize| free.centre(square % free.width, square / free.width);
        squares.map(|square| self.map_from_chart * middle(square)).collect()
    }

    /// Finds exploration poses; poses found before keep their symbols while they promise anything.
    pub(super) fn look_out(
        &mut self,
        here: &Isometry2<f64>,
        body: &Description,
        given_up: impl Fn(&str) -> bool,
    ) {
        let (Some((floor, footing)), Some(options)) = (self.footing(body), explore(body)) else { return };
        let here = self.map_from_chart.inv_mul(here);
        self.open.retain(|(symbol, _)| !given_up(symbol));
        let keep: Vec<Isometry2<f64>> = self.open.iter().map(|(_, look)| look.pose).collect();
        // The body's own ways decide: what its footprint does not fit is no pose.
        let reach = footing.reach(&floor, &here, &options);
        let found = outlooks(&floor, &reach, &self.stood, &keep, WEIGHED, &options);
        self.cut_off_m2 = self.cut_off_m2(&floor, &footing, &reach, &found, &options);
        let fits = |look: &Outlook| {
            let pose = Pose2::new(look.pose.translation.x, look.pose.translation.y, 0.0);
            look.way_m == 0.0 || self.router.as_ref().is_some_and(|r| r.fits(&pose.point()).is_ok())
        };
        let mut open = Vec::new();
        for look in found.into_iter().filter(|look| fits(look)) {
            let known = self.open.iter().find(|(_, known)| known.pose == look.pose);
            let symbol = known.map(|(symbol, _)| symbol.clone()).unwrap_or_else(|| {
                self.given += 1;
                format!("view-{}", self.given)
            });
            open.push((symbol, look));
        }
        self.open = open;
    }

    /// Additional floor visible from poses that became unreachable through failed drives, square
    /// metres.
    fn cut_off_m2(
        &self,
        floor: &Occupancy,
        footing: &Footing,
        reach: &Reach,
        found: &[Outlook],
        options: &ExploreOptions,
    ) -> f64 {
        if !self.ground.is_barred() {
            return 0.0;
        }
        let before = footing.reach_as_shown(floor, &reach.from, options);
        let keep: Vec<Isometry2<f64>> = found.iter().map(|look| look.pose).collect();
        let all = outlooks(floor, &before, &self.stood, &keep, keep.len() + WEIGHED, options);
        let mut unseen = Unseen::default();
        found.iter().for_each(|look| unseen.look(look));
        let is_cut_off = |look: &&Outlook| {
            let square = ground::square(floor, &look.pose.translation.vector.into());
            !keep.contains(&look.pose) && square.is_some_and(|square| reach.ways_m[square].is_infinite())
        };
        let gain = |look: &Outlook| {
            let gain_m2 = unseen.gain_m2(look);
            unseen.look(look);
            gain_m2
        };
        all.iter().filter(is_cut_off).map(gain).sum()
    }

    fn floor(&self, body: &Description) -> Option<Occupancy> {
        self.footing(body).map(|(floor, _)| floor)
    }

    /// Occupancy of the floor, and the free positions of the body's centre; `None` before the first
    /// view.
    fn footing(&self, body: &Description) -> Option<(Occupancy, Footing)> {
        let mut floor = self.map.as_ref()?.floor(&self.stood, body.radius_m() + CELL_M, *BODY_M.end())?;
        let footing = self.ground.open(&mut floor, (body.radius_m(), CLEAR_M), &self.map_from_chart);
        Some((floor, footing))
    }

    /// Exploration poses as candidates, in the map frame of the body.
    pub(super) fn poses(&self) -> impl Iterator<Item = Candidate> + '_ {
        self.open.iter().map(|(symbol, look)| {
            let at = self.map_from_chart * look.pose;
            let place = Place::Pose(Pose2::new(at.translation.x, at.translation.y, at.rotation.angle()));
            Candidate { symbol: symbol.clone(), place }
        })
    }

    /// Expected view from the exploration pose with a symbol.
    pub(super) fn outlook(&self, symbol: &str) -> Option<&Outlook> {
        self.open.iter().find(|(name, _)| name == symbol).map(|(_, look)| look)
    }

    /// Unknown floor expected to be visible from the remaining poses, square metres.
    pub(super) fn unseen_m2(&self) -> f64 {
        if self.map.is_none() {
            return NOTHING_SEEN_M2;
        }
        let mut unseen = Unseen::default();
        let gain = |(_, look): &(String, Outlook)| {
            let gain_m2 = unseen.gain_m2(look);
            unseen.look(look);
            gain_m2
        };
        self.open.iter().map(gain).sum::<f64>() + self.cut_off_m2
    }

    /// Floor that is known to be open, square metres.
    pub(super) fn open_m2(&self) -> f64 {
        let grid = self.map.as_ref().and_then(|m| m.grid.as_ref());
        grid.map_or(0.0, |g| {
            g.cells.iter().filter(|c| **c == Space::Free).count() as f64 * g.cell_m * g.cell_m
        })
    }

    /// Routes without clearance; `None` if the destination itself has no clearance.
    fn narrow_to(&self, to: &Pose2) -> Option<&Router> {
        let fits = self.router.as_ref().is_some_and(|router| router.fits(&to.point()).is_ok());
        self.narrow.as_deref().filter(|_| fits)
    }
}

/// Pose transformed into another frame.
fn put(other_from_here: &Isometry2<f64>, pose: &Pose2) -> Pose2 {
    let at = other_from_here * pose.point();
    Pose2::new(at.x, at.y, pose.yaw_rad + other_from_here.rotation.angle())
}

fn turn_s(robot: &dyn Robot, from: &Pose2, to: &Pose2) -> f64 {
    let turn = (to.yaw_rad - from.yaw_rad).sin().atan2((to.yaw_rad - from.yaw_rad).cos());
    robot.description().duration_s(0.0, turn.abs())
}

fn is_surface(level: &Level) -> bool {
    level.faces_up && SURFACE_M.contains(&level.height_m) && level.area_m2 >= SURFACE_M2
}

fn is_one(a: &Level, b: &Level) -> bool {
    let middle = |l: &Level| {
        let n = l.outline.len().max(1) as f64;
        Point2::from(l.outline.iter().fold(Vector2::zeros(), |sum, p| sum + p.coords) / n)
    };
    let holds = |l: &Level, p: &Point2<f64>| {
        let n = l.outline.len();
        (0..n).all(|i| (l.outline[(i + 1) % n] - l.outline[i]).perp(&(p - l.outline[i])) >= 0.0)
    };
    (a.height_m - b.height_m).abs() < SAME_HEIGHT_M && (holds(a, &middle(b)) || holds(b, &middle(a)))
}

/// Grid whose free cells are those in which the body's centre may be (`stand`).
fn grid(floor: &Occupancy, stand: &[bool]) -> OccupancyGrid {
    let width = floor.width.max(1);
    OccupancyGrid {
        resolution_m: floor.cell_m,
        origin_m: floor.origin,
        width,
        height: floor.cells.len() / width,
        occupied: stand.iter().map(|may| !may).collect(),
    }
}

/// Horizontal field of view and range of the camera.
fn field(camera: &Camera) -> FieldOfView {
    let c = &camera.intrinsics;
    FieldOfView {
        right_rad: -((c.width as f64 - c.cx) / c.fx).atan(),
        left_rad: (c.cx / c.fx).atan(),
        near_m: camera.range_m.0,
        far_m: far_m(camera),
    }
}

/// Maximum depth of the camera that is used for the map, metres.
pub(super) fn far_m(camera: &Camera) -> f64 {
    camera.range_m.1.min(FAR_M)
}

/// Exploration options; `None` if the body cannot drive or see.
fn explore(body: &Description) -> Option<ExploreOptions> {
    let (base, camera) = (body.base.as_ref()?, body.camera.as_ref()?);
    let seconds = (1.0 / base.speeds.linear_m_s, 1.0 / base.speeds.angular_rad_s, LOOK_S);
    Some(ExploreOptions {
        field: field(camera),
        radius_m: body.radius_m() + CLEAR_M,
        seconds,
        ..ExploreOptions::default()
    })
}

/// Options for correcting poses against the map so far: from the believed pose, within the stated
/// localisation error.
pub(super) fn rectify(body: &Description, camera: &Camera) -> RectifyOptions {
    RectifyOptions {
        band_m: BODY_M,
        field: field(camera),
        way_sigma: (0.0, body.pose_sigma_m.max(1e-3)),
        turn_sigma_rad: body.pose_sigma_rad.max(1e-3),
        ..RectifyOptions::default()
    }
}

state!(Arc<Chart>);

impl Known {
    /// State of *surveying*: the map of the body's own making.
    pub(super) fn chart(&self) -> &Chart {
        self.states.get::<Arc<Chart>>()
    }

    /// Changes the body's own map and recomputes the routes.
    pub(super) fn change_chart<R>(&mut self, change: impl FnOnce(&mut Chart) -> R) -> R {
        self.own_map = Arc::new(NoMap);
        let chart: &mut Arc<Chart> = self.states.get_mut();
        let changed = change(Arc::make_mut(chart));
        self.own_map = Arc::<Chart>::clone(chart);
        changed
    }
}

impl OwnMap for Chart {
    fn surfaces(&self) -> Vec<KnownSurface> {
        let known = self.surfaces.iter().map(|(name, level)| KnownSurface {
            symbol: symbol(name),
            name: name.clone(),
            room: None,
            floor: Vec::new(),
            outline: level
                .outline
                .iter()
                .map(|p| (self.map_from_chart * p).coords.push(level.height_m).into())
                .collect(),
            up: Vector3::z(),
            whole: false,
            doubtful: None,
            placed: None,
            displaced_m: 0.0,
            sensor_doubt: 0.0,
        });
        known.collect()
    }

    fn travel(
        &self,
        robot: &dyn Robot,
        from: &Place,
        to: &[Place],
        shut: &[String],
    ) -> Vec<Result<Travel, Failure>> {
        let (Some(router), Place::Pose(from)) = (&self.router, from) else {
            return robot.travel(from, to, shut);
        };
        let chart_from_map = self.map_from_chart.inverse();
        let pose = |place: &Place| match place {
            Place::Pose(pose) => put(&chart_from_map, pose),
            Place::Station(_) => Pose2::new(f64::NAN, f64::NAN, f64::NAN),
        };
        let (from, to) = (&put(&chart_from_map, from), to.iter().map(pose).collect::<Vec<Pose2>>());
        let mut found = router.travel_to_each(from, &to);
        for (travel, to) in found.iter_mut().zip(&to) {
            if let (Err(_), Some(narrow)) = (&*travel, self.narrow_to(to)) {
                *travel = narrow.travel(from, to);
            }
            // To turn where it stands needs no floor.
            if travel.is_err() && (to.point() - from.point()).norm() < 1e-9 {
                *travel = Ok(Travel { distance_m: 0.0, duration_s: turn_s(robot, from, to) });
            }
        }
        found
    }

    fn way(&self, from: &Place, to: &Place) -> Option<Vec<Place>> {
        let (Place::Pose(from), Place::Pose(to)) = (from, to) else { return None };
        let chart_from_map = self.map_from_chart.inverse();
        let (start, end) = (put(&chart_from_map, from), put(&chart_from_map, to));
        let narrow = || self.narrow_to(&end)?.route(&start, &end).ok();
        let route = self.router.as_ref()?.route(&start, &end).ok().or_else(narrow)?;
        let heading = |a: &Point2<f64>, b: &Point2<f64>| (b.y - a.y).atan2(b.x - a.x);
        let turns =
            route.points_m.windows(2).map(|leg| Pose2::new(leg[1].x, leg[1].y, heading(&leg[0], &leg[1])));
        let mut way: Vec<Place> = turns.map(|pose| Place::Pose(put(&self.map_from_chart, &pose))).collect();
        way.pop();
        way.push(Place::Pose(*to));
        Some(way)
    }

    fn has_ways(&self) -> bool {
        self.router.is_some()
    }

    fn has(&self, surface: &str) -> bool {
        self.surfaces.iter().any(|(name, _)| symbol(name) == surface)
    }

    fn hides(&self, from: &Point2<f64>, to: &Point2<f64>) -> bool {
        let [from, to] = &[from, to].map(|p| self.map_from_chart.inverse_transform_point(p));
        let side = |a: &Point2<f64>, b: &Point2<f64>, p: &Point2<f64>| (b - a).perp(&(p - a));
        let crosses = |a: &Point2<f64>, b: &Point2<f64>| {
            side(a, b, from) * side(a, b, to) < 0.0 && side(from, to, a) * side(from, to, b) < 0.0
        };
        self.map.as_ref().is_some_and(|m| m.feet().any(|(a, b)| crosses(&a, &b)))
    }

    fn goes_on(&self, body: &Description) -> Option<String> {
        let floor = self.floor(body)?;
        let ends = frontiers(&floor, &explore(body)?);
        let length_m = ends.iter().map(|f| f.squares.len()).sum::<usize>() as f64 * floor.cell_m;
        let near = self.map_from_chart * ends.first()?.middle;
        Some(format!(
            "{length_m:.1} m of open floor border on what could not be seen, as near ({:.2}, {:.2}) m",
            near.x, near.y
        ))
    }
}

/// Sets the initial map of a run, and returns it as the body's own map.
pub(super) fn recall(
    domain: &Domain,
    past: Option<&Past>,
    robot: &dyn Robot,
    states: &mut States,
) -> Option<Arc<dyn OwnMap>> {
    let chart = Arc::new(Chart::begin(domain, past, robot));
    *states.get_mut() = Arc::clone(&chart);
    Some(chart)
}
