//! Occupancy grid of the floor plan, from the cells that lines of sight cross and the cells in which they end.

use super::station::Station;
use crate::cloud::is_finite;
use crate::occupancy::{Occupancy, Space};
use nalgebra::{Isometry2, Point2, Vector2};
use rustc_hash::FxHashMap;
use serde::{Deserialize, Serialize};
use std::f64::consts::{PI, TAU};
use std::ops::RangeInclusive;

/// For each cell, the number of stations with a line of sight through it and the number with an end point in it.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(from = "Vec<(i32, i32, u32, u32)>", into = "Vec<(i32, i32, u32, u32)>")]
pub(super) struct Sightlines {
    squares: FxHashMap<(i32, i32), (u32, u32)>,
}

impl From<Vec<(i32, i32, u32, u32)>> for Sightlines {
    fn from(stored: Vec<(i32, i32, u32, u32)>) -> Sightlines {
        Sightlines {
            squares: stored.into_iter().map(|(x, y, through, ended)| ((x, y), (through, ended))).collect(),
        }
    }
}

impl From<Sightlines> for Vec<(i32, i32, u32, u32)> {
    fn from(lines: Sightlines) -> Self {
        let mut stored: Vec<_> =
            lines.squares.into_iter().map(|((x, y), (through, ended))| (x, y, through, ended)).collect();
        stored.sort_unstable();
        stored
    }
}

/// Number of bearings into which a station's points are sorted.
const BEARINGS: usize = 720;
/// Maximum length of followed lines of sight, metres.
const FARTHEST_M: f64 = 100.0;
/// Maximum number of cells of a grid.
const MOST_SQUARES: usize = 1 << 28;
/// Share of a bearing's nearest points that are discarded as mismatches; the next point ends the line of sight.
const STRAY: f64 = 0.1;
/// Minimum number of a station's points in a cell for an end point there.
const SOMETHING: u32 = 3;
/// Maximum distance of floor points from floor height, metres.
const FLOOR_M: f64 = 0.1;
/// Minimum number of stations with an end point in an occupied cell, and their minimum share of the stations that
/// observed the cell.
const OCCUPIED: (u32, f64) = (2, 0.35);

impl Sightlines {
    /// Adds a station's lines of sight, which end at its points in the height band `band_m`.
    pub(super) fn add(
        &mut self,
        station: &Station,
        map_from_level: &Isometry2<f64>,
        band_m: &RangeInclusive<f64>,
        far_m: f64,
        edge_m: f64,
    ) {
        let square = |p: &Point2<f64>| ((p.x / edge_m).floor() as i32, (p.y / edge_m).floor() as i32);
        let mut ranges: Vec<Vec<f32>> = vec![Vec::new(); BEARINGS];
        let mut floors = vec![0.0_f64; BEARINGS];
        let mut points: FxHashMap<(i32, i32), u32> = FxHashMap::default();
        for p in station.points.iter().filter(|p| is_finite(p) && f64::from(p.x) <= far_m) {
            let place = Point2::new(f64::from(p.x), f64::from(p.y));
            if place.coords.norm() > FARTHEST_M {
                continue;
            }
            let bearing = ((place.y.atan2(place.x) + PI) / TAU * BEARINGS as f64) as usize % BEARINGS;
            let z = f64::from(p.z);
            if band_m.contains(&z) {
                ranges[bearing].push(place.coords.norm() as f32);
                *points.entry(square(&(map_from_level * place))).or_default() += 1;
            } else if z.abs() < FLOOR_M {
                floors[bearing] = floors[bearing].max(place.coords.norm());
            }
        }
        let mut through: FxHashMap<(i32, i32), ()> = FxHashMap::default();
        for (bearing, ranges) in ranges.iter_mut().enumerate() {
            let stray = (STRAY * ranges.len() as f64) as usize;
            let open_m = if ranges.is_empty() {
                floors[bearing]
            } else {
                f64::from(*ranges.select_nth_unstable_by(stray, f32::total_cmp).1) - edge_m
            };
            let angle = (bearing as f64 + 0.5) / BEARINGS as f64 * TAU - PI;
            let ray = Vector2::new(angle.cos(), angle.sin());
            let steps = (open_m / (0.5 * edge_m)).max(0.0) as usize;
            (0..steps).for_each(|i| {
                through.insert(square(&(map_from_level * Point2::from(ray * (0.5 * edge_m * i as f64)))), ());
            });
        }
        points.retain(|_, count| *count >= SOMETHING);
        points.keys().for_each(|key| self.squares.entry(*key).or_default().1 += 1);
        through
            .keys()
            .filter(|key| !points.contains_key(*key))
            .for_each(|key| self.squares.entry(*key).or_default().0 += 1);
    }

    /// Grid with a border of unknown cells; `None` if nothing was seen or the grid would be too large.
    pub(super) fn occupancy(&self, edge_m: f64) -> Option<Occupancy> {
        let (first, _) = self.squares.iter().next()?;
        let (low, high) = self
            .squares
            .keys()
            .fold((*first, *first), |(l, h), k| ((l.0.min(k.0), l.1.min(k.1)), (h.0.max(k.0), h.1.max(k.1))));
        let span = |low: i32, high: i32| (i64::from(high) - i64::from(low)) as usize + 3;
        let (width, height) = (span(low.0, high.0), span(low.1, high.1));
        if width.saturating_mul(height) > MOST_SQUARES {
            return None;
        }
        let origin = Point2::new(f64::from(low.0) - 1.0, f64::from(low.1) - 1.0) * edge_m;
        let mut cells = vec![Space::Unknown; width * height];
        for (key, (through, ended)) in &self.squares {
            let (column, row) = ((key.0 - low.0) as usize + 1, (key.1 - low.1) as usize + 1);
            let (least, share) = OCCUPIED;
            let is_occupied = *ended >= least && f64::from(*ended) >= share * f64::from(through + ended);
            cells[row * width + column] = match (is_occupied, *through) {
                (true, _) => Space::Occupied,
                (false, 0) => Space::Unknown,
                (false, _) => Space::Free,
            };
        }
        Some(Occupancy { origin, cell_m: edge_m, width, cells })
    }
}
