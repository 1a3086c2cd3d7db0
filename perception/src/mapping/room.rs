//! Map of a building: walls with their openings, level surfaces, and the occupancy grid.

use super::cells::{Cells, CellsError, Facet, NormalOptions, Region};
use super::cylinder::{CylinderOptions, UprightCylinder, cylinders};
use super::error::{MappingError, check, check_pose};
use super::fuse::{FuseOptions, fuse};
use super::grid::Sightlines;
use super::orientation::{OrientationOptions, orientations};
use super::patch::{Constraints, Growth, Patch, PlaneEstimator, grow, main_direction, through};
use super::scan_matching::{PairFit, RectifyOptions, fit_cut};
use super::station::{Station, shared};
use crate::hull::convex;
use crate::occupancy::{Occupancy, Space};
use crate::plane::Plane;
use crate::polygon::holds;
use crate::quantile::median;
use nalgebra::{Isometry2, Point2, Vector2, Vector3};
use rustc_hash::FxHashSet;
use serde::{Deserialize, Serialize};
use std::ops::RangeInclusive;

/// Accumulated observations of a building; later drives add to them.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Survey {
    cells: Cells,
    lines: Sightlines,
}

/// Minimum number of points of a cell that is used for localising a station.
const LEAST_KNOWN: u32 = 4;
/// Edge of the squares around such cells, metres; points outside them and their neighbours are new.
const NEAR_M: f64 = 0.3;

/// Options for making a map from a survey.
#[derive(Clone, Debug, PartialEq)]
pub struct MapOptions {
    /// Options for normals by regions.
    pub normals: NormalOptions,
    /// Options for the orientations of walls.
    pub orientations: OrientationOptions,
    /// Maximum distance between neighbouring facets of one patch (λ), metres.
    pub grow_m: f64,
    /// Maximum tilt of wall normals from horizontal, and of level surfaces' normals from vertical,
    /// radians.
    pub tilt_rad: f64,
    /// Method for fitting planes to patches.
    pub fit: PlaneEstimator,
    /// True if walls are made upright, and parallel or perpendicular to the majority if nearly so.
    pub constrained: bool,
    /// Options for joining patches of one wall; `None` to leave them apart.
    pub fuse: Option<FuseOptions>,
    /// Options for pillars and round walls; `None` to leave them undetected.
    pub cylinders: Option<CylinderOptions>,
    /// Minimum area of a wall, square metres.
    pub least_area_m2: f64,
    /// Minimum height of a wall, metres; lower upright surfaces are objects.
    pub least_height_m: f64,
    /// Minimum area of a level surface, square metres.
    pub least_level_m2: f64,
    /// Height band, metres, in which a wall must be unseen at its openings.
    pub opening_band_m: RangeInclusive<f64>,
    /// Minimum width of an opening, metres.
    pub opening_m: f64,
}

impl Default for MapOptions {
    fn default() -> Self {
        MapOptions {
            normals: NormalOptions::default(),
            orientations: OrientationOptions::default(),
            grow_m: 0.25,
            tilt_rad: 0.35,
            fit: PlaneEstimator::LeastSquares,
            constrained: true,
            fuse: Some(FuseOptions::default()),
            cylinders: Some(CylinderOptions::default()),
            least_area_m2: 0.3,
            least_height_m: 1.0,
            least_level_m2: 0.15,
            opening_band_m: 0.3..=1.8,
            opening_m: 0.6,
        }
    }
}

/// Bounded vertical plane.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Wall {
    /// Plane of the wall, in the map; its normal points towards the camera.
    pub plane: Plane,
    /// One end of the wall's ground line, metres.
    pub from: Point2<f64>,
    /// Other end of the wall's ground line, metres.
    pub to: Point2<f64>,
    /// Minimum and maximum observed height, metres.
    pub heights_m: (f64, f64),
    /// Observed area, square metres.
    pub area_m2: f64,
    /// Start and end of each solid section of the wall, metres from `from`; the gaps are openings.
    pub stretches_m: Vec<(f64, f64)>,
}

impl Wall {
    /// Start and end points of the wall's solid sections on the floor, metres.
    pub fn feet(&self) -> impl Iterator<Item = (Point2<f64>, Point2<f64>)> {
        let along = (self.to - self.from).try_normalize(0.0).unwrap_or_else(Vector2::x);
        self.stretches_m.iter().map(move |(a, b)| (self.from + along * *a, self.from + along * *b))
    }

    /// Length of the wall from end to end, metres.
    pub fn length_m(&self) -> f64 {
        (self.to - self.from).norm()
    }
}

/// Level surface: the floor, a table top, the ceiling.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Level {
    /// Height above the floor, metres.
    pub height_m: f64,
    /// True if seen from above.
    pub faces_up: bool,
    /// Corners of the convex hull, anticlockwise, metres.
    pub outline: Vec<Point2<f64>>,
    /// Observed area, square metres.
    pub area_m2: f64,
}

/// Map of a building.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct RoomMap {
    /// Walls, the largest first.
    pub walls: Vec<Wall>,
    /// Pillars and round walls; their facets are excluded from walls.
    pub cylinders: Vec<UprightCylinder>,
    /// Level surfaces, the largest first.
    pub levels: Vec<Level>,
    /// Direction of the normals of most walls, modulo a quarter turn, radians; `None` if there is no such direction.
    pub main_rad: Option<f64>,
    /// Occupancy grid, in which walls fill only unknown cells; `None` if nothing was seen or the map is too large for a
    /// grid.
    pub grid: Option<Occupancy>,
}

impl RoomMap {
    /// Line segments (start, end) in which walls and cylinders meet the floor, map frame, metres; the arc of a cylinder is
    /// replaced by chords.
    pub fn feet(&self) -> impl Iterator<Item = (Point2<f64>, Point2<f64>)> + '_ {
        let of_walls = self.walls.iter().flat_map(Wall::feet);
        of_walls.chain(self.cylinders.iter().flat_map(UprightCylinder::feet))
    }

    /// Occupancy for a body of height `height_m`, metres: like `grid`, but occupied at level surfaces too low for the
    /// body, and free within `radius_m` of the poses `stood`, where the body has been. `None` without a grid.
    pub fn floor(&self, stood: &[Isometry2<f64>], radius_m: f64, height_m: f64) -> Option<Occupancy> {
        let mut grid = self.grid.clone()?;
        let tables =
            self.levels.iter().filter(|l| l.faces_up && l.height_m > STEP_M && l.height_m < height_m);
        let tables: Vec<&Level> = tables.collect();
        let off = Vector2::repeat(0.5 * grid.cell_m);
        for (index, cell) in grid.cells.iter_mut().enumerate() {
            let corner = Vector2::new((index % grid.width) as f64, (index / grid.width) as f64) * grid.cell_m;
            let middle = grid.origin + corner + off;
            if tables.iter().any(|t| holds(&t.outline, middle)) {
                *cell = Space::Occupied;
            }
            let here = |p: &Isometry2<f64>| (p.translation.vector - middle.coords).norm() < radius_m;
            if *cell != Space::Free && stood.iter().any(here) {
                *cell = Space::Free;
            }
        }
        Some(grid)
    }
}

/// Maximum height of level surfaces that count as floor, metres.
const STEP_M: f64 = 0.1;

impl Survey {
    /// Creates an empty survey with cells of `edge_m` metres.
    ///
    /// # Errors
    /// If the edge is not positive and finite.
    pub fn new(edge_m: f64) -> Result<Survey, CellsError> {
        Ok(Survey { cells: Cells::new(edge_m)?, lines: Sightlines::default() })
    }

    /// Cells that hold the points of all stations.
    pub fn cells(&self) -> &Cells {
        &self.cells
    }

    /// Adds a station at a pose, seen by a camera `height_m` above the floor, up to depth `far_m`; `band_m`: height
    /// range of obstacles to the body, metres.
    ///
    /// # Errors
    /// If the pose or the height is out of range; nothing is added then.
    pub fn add(
        &mut self,
        station: &Station,
        map_from_level: &Isometry2<f64>,
        height_m: f64,
        far_m: f64,
        band_m: &RangeInclusive<f64>,
    ) -> Result<(), MappingError> {
        check_pose("station", 0, map_from_level)?;
        check(&[("height_m", height_m, -1e3, 1e3)])?;
        self.cells.add(&station.points, map_from_level, height_m, far_m);
        self.lines.add(station, map_from_level, band_m, far_m, self.cells.edge_m());
        Ok(())
    }

    /// Occupancy from lines of sight alone, without walls; `None` if nothing was seen, or the extent exceeds one grid.
    pub fn grid(&self) -> Option<Occupancy> {
        self.lines.occupancy(self.cells.edge_m())
    }

    /// Localises a station in the earlier observations, starting from the pose `believed`, which is returned if the
    /// station does not determine a better one.
    ///
    /// # Errors
    /// If an option or the pose is out of range.
    pub fn locate(
        &self,
        station: &Station,
        believed: &Isometry2<f64>,
        options: &RectifyOptions,
    ) -> Result<PairFit, MappingError> {
        options.check()?;
        check_pose("station", 0, believed)?;
        let known = self.cells.plan(&options.band_m, LEAST_KNOWN, options.thin_m);
        let coarse = |p: &Point2<f64>| ((p.x / NEAR_M).floor() as i64, (p.y / NEAR_M).floor() as i64);
        let around = |p: &Point2<f64>| {
            let (x, y) = coarse(p);
            (-1..=1).flat_map(move |i| (-1..=1).map(move |j| (x + i, y + j)))
        };
        let near: FxHashSet<(i64, i64)> = known.iter().map(|s| coarse(&s.at)).collect();
        let mut moved = station.plan(&options.band_m, &options.field, options.thin_m);
        moved.retain(|s| around(&(believed * s.at)).any(|square| near.contains(&square)));
        Ok(fit_cut(&shared(&known, &believed.inverse(), &options.field), &moved, believed, options))
    }

    /// Makes the map from all observations so far.
    ///
    /// # Errors
    /// If an option is out of range.
    pub fn map(&self, options: &MapOptions) -> Result<RoomMap, MappingError> {
        let _span = tracing::debug_span!("map", cells = self.cells.len()).entered();
        check(&[
            ("grow_m", options.grow_m, 1e-3, 1e3),
            ("the reach of normals", options.normals.reach as f64, 1.0, 10.0),
        ])?;
        let edge_m = self.cells.edge_m();
        let regions = self.cells.regions(&options.normals);
        let facets: Vec<Facet> = regions.iter().filter_map(Region::facet).collect();
        let (mut patches, main_rad) = upright(&facets, options, edge_m);
        let heights_m = (&options.opening_band_m, options.least_height_m);
        let cylinders = options
            .cylinders
            .as_ref()
            .map(|how| cylinders(&regions, &mut patches, heights_m, how, edge_m))
            .unwrap_or_default();
        let mut walls: Vec<Wall> = patches.iter().filter_map(|p| wall(p, &facets, options, edge_m)).collect();
        walls.sort_by(|a, b| b.area_m2.total_cmp(&a.area_m2));
        let levels = levels(&facets, options, edge_m);
        let mut map = RoomMap { walls, cylinders, levels, main_rad, grid: None };
        map.grid = self.grid().map(|mut grid| {
            map.feet().for_each(|foot| draw(foot, &mut grid));
            grid
        });
        Ok(map)
    }
}

/// Patches of upright facets, joined, and the direction of most of their normals, modulo a quarter turn, radians.
fn upright(facets: &[Facet], options: &MapOptions, edge_m: f64) -> (Vec<Patch>, Option<f64>) {
    let members: Vec<u32> = (0u32..)
        .zip(facets)
        .filter(|(_, f)| f.normal.z.abs() <= options.tilt_rad.sin())
        .map(|(i, _)| i)
        .collect();
    let directions: Vec<f64> =
        members.iter().map(|&m| facets[m as usize].normal).map(|n| n.y.atan2(n.x)).collect();
    let found = orientations(&directions, &options.orientations);
    let growth = Growth {
        within_m: options.grow_m,
        across_m: edge_m,
        turned_rad: 2.0 * options.orientations.within_rad,
    };
    let group = |number: Option<u32>| -> Vec<u32> {
        members.iter().zip(&found.of).filter(|(_, of)| **of == number).map(|(m, _)| *m).collect()
    };
    let mut grown: Vec<Vec<u32>> = Vec::new();
    for (number, centre) in (0u32..).zip(&found.centres_rad) {
        let normal = Vector3::new(centre.cos(), centre.sin(), 0.0);
        grown.extend(grow(facets, &group(Some(number)), Some(normal), &growth));
    }
    let alone = Growth { turned_rad: options.orientations.within_rad, ..growth };
    grown.extend(grow(facets, &group(None), None, &alone));
    let least = options.least_area_m2.min(0.1) / (edge_m * edge_m);
    grown.retain(|patch| patch.len() as f64 >= least);
    let within_rad = options.orientations.within_rad.min(0.2);
    let mut constraints = Constraints { upright: options.constrained, main_rad: None, within_rad };
    let fit = |constraints: &Constraints| -> Vec<Patch> {
        grown
            .iter()
            .map(|members| through(facets, members.clone(), options.fit, constraints, edge_m))
            .collect()
    };
    let mut patches = fit(&constraints);
    if options.constrained {
        // Long walls tell the direction best: it is asked of what has been joined, and then kept to from the fit on.
        let joined =
            fuse(facets, patches.clone(), options.fit, &constraints, &FuseOptions::default(), edge_m);
        constraints.main_rad = main_direction(&joined, within_rad);
        patches = fit(&constraints);
    }
    if let Some(how) = &options.fuse {
        patches = fuse(facets, patches, options.fit, &constraints, how, edge_m);
    }
    (patches, constraints.main_rad)
}

/// Patch as a wall with its openings; `None` if its area or height is too small.
fn wall(patch: &Patch, facets: &[Facet], options: &MapOptions, edge_m: f64) -> Option<Wall> {
    let [(left, right), (low, high)] = patch.limits_m;
    if patch.area_m2 < options.least_area_m2 || high - low < options.least_height_m {
        return None;
    }
    let foot = |along: f64| (patch.middle + patch.along * along).xy();
    let mut seen: Vec<f64> = patch
        .facets
        .iter()
        .map(|&m| facets[m as usize].at)
        .filter(|at| options.opening_band_m.contains(&at.z))
        .map(|at| (at - patch.middle).dot(&patch.along) - left)
        .collect();
    seen.sort_by(f64::total_cmp);
    let mut stretches_m: Vec<(f64, f64)> = Vec::new();
    for at in seen {
        match stretches_m.last_mut() {
            Some(last) if at - last.1 < options.opening_m => last.1 = at,
            _ => stretches_m.push((at, at)),
        }
    }
    stretches_m.retain(|(from, to)| to - from >= edge_m);
    let z = patch.middle.z;
    Some(Wall {
        plane: patch.plane,
        from: foot(left),
        to: foot(right),
        heights_m: (z + low, z + high),
        area_m2: patch.area_m2,
        stretches_m,
    })
}

/// Marks the unknown cells under a line on the floor as occupied.
fn draw((from, to): (Point2<f64>, Point2<f64>), grid: &mut Occupancy) {
    let steps = ((to - from).norm() / (0.5 * grid.cell_m)).ceil() as usize;
    for i in 0..=steps {
        let at = from + (to - from) * (i as f64 / steps.max(1) as f64);
        let square = ((at - grid.origin) / grid.cell_m).map(f64::floor);
        let rows = grid.cells.len() / grid.width.max(1);
        let inside = square.x >= 0.0 && square.y >= 0.0 && (square.x as usize) < grid.width;
        if inside && (square.y as usize) < rows {
            let cell = &mut grid.cells[square.y as usize * grid.width + square.x as usize];
            if *cell == Space::Unknown {
                *cell = Space::Occupied;
            }
        }
    }
}

/// Level surfaces seen from above or from below, the largest first.
fn levels(facets: &[Facet], options: &MapOptions, edge_m: f64) -> Vec<Level> {
    let growth = Growth { within_m: options.grow_m, across_m: 0.5 * edge_m, turned_rad: options.tilt_rad };
    let mut found: Vec<Level> = Vec::new();
    for faces_up in [true, false] {
        let normal = Vector3::z() * if faces_up { 1.0 } else { -1.0 };
        let is_level = |f: &Facet| f.normal.dot(&normal) >= options.tilt_rad.cos();
        let members: Vec<u32> = (0u32..).zip(facets).filter(|(_, f)| is_level(f)).map(|(i, _)| i).collect();
        for patch in grow(facets, &members, Some(normal), &growth) {
            let places: Vec<Point2<f64>> = patch.iter().map(|&m| facets[m as usize].at.xy()).collect();
            let squares: FxHashSet<(i32, i32)> = places
                .iter()
                .map(|p| ((p.x / edge_m).floor() as i32, (p.y / edge_m).floor() as i32))
                .collect();
            let area_m2 = squares.len() as f64 * edge_m * edge_m;
            if area_m2 >= options.least_level_m2 {
                let height_m = median(patch.iter().map(|&m| facets[m as usize].at.z));
                found.push(Level { height_m, faces_up, outline: convex(places), area_m2 });
            }
        }
    }
    found.sort_by(|a, b| b.area_m2.total_cmp(&a.area_m2));
    found
}
