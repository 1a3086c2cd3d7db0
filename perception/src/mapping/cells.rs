//! Points of a building accumulated in cubes, whose number grows with the surface area, not with
//! the points; and normals by regions (section 4.1).

use super::station::{Spot, thinned};
use crate::cloud::is_finite;
use crate::pool;
use crate::voxel::{self, Table};
use nalgebra::{Isometry2, Point3, Vector2, Vector3};
use serde::{Deserialize, Serialize};
use std::ops::RangeInclusive;

/// Sums over the points of each cube and over their directions to the camera; points are added station by station and
/// not kept.
#[derive(Clone, Debug, Serialize, Deserialize)]
#[serde(try_from = "Stored", into = "Stored")]
pub struct Cells {
    edge_m: f64,
    table: Table,
    sums: Vec<Sums>,
}

/// Sums over the points in one cube.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
struct Sums {
    /// Integer coordinates of the cube.
    cube: [i32; 3],
    count: u32,
    /// Sum of the points relative to the cube's corner, metres.
    sum: [f32; 3],
    /// Sum of the points' unit vectors towards the camera.
    towards: [f32; 3],
}

/// Serialised form of [`Cells`].
#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct Stored {
    edge_m: f64,
    cells: Vec<Sums>,
}

/// Reason why cells are invalid.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum CellsError {
    /// The edge length is not positive and finite.
    #[error("cells with an edge of {edge_m} m: give a positive length, such as 0.1")]
    Edge {
        /// Given edge length, metres.
        edge_m: f64,
    },
    /// A stored cell has no points, a sum that is not finite, or occurs twice.
    #[error(
        "cell {index} of the stored ones is damaged (its count is {count}, or a sum is no number, or it occurs twice): store the map anew"
    )]
    Damaged {
        /// Index of the stored cell.
        index: usize,
        /// Its number of points.
        count: u32,
    },
}

impl PartialEq for Cells {
    fn eq(&self, other: &Self) -> bool {
        self.edge_m == other.edge_m && self.sums == other.sums
    }
}

impl From<Cells> for Stored {
    fn from(cells: Cells) -> Stored {
        Stored { edge_m: cells.edge_m, cells: cells.sums }
    }
}

impl TryFrom<Stored> for Cells {
    type Error = CellsError;

    fn try_from(stored: Stored) -> Result<Cells, CellsError> {
        let mut cells = Cells::new(stored.edge_m)?;
        for (index, sums) in stored.cells.into_iter().enumerate() {
            let key = voxel::key(sums.cube.map(i64::from));
            let number = key.map(|key| cells.table.number(key) as usize);
            let is_finite = sums.sum.iter().chain(&sums.towards).all(|v| v.is_finite());
            if sums.count == 0 || !is_finite || number != Some(index) {
                return Err(CellsError::Damaged { index, count: sums.count });
            }
            cells.sums.push(sums);
        }
        Ok(cells)
    }
}

/// Surface element: mean point of a cube, and normal.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Facet {
    /// Centroid, in the map, metres.
    pub at: Point3<f64>,
    /// Unit normal, towards the camera.
    pub normal: Vector3<f64>,
    /// Number of points in the cube.
    pub points: u32,
}

/// Points of one cube in summary, with or without a known normal.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Region {
    /// Centroid, in the map, metres.
    pub at: Point3<f64>,
    /// Mean of the unit vectors towards the camera.
    pub towards: Vector3<f64>,
    /// Unit normal, towards the camera; `None` if the evidence does not suffice.
    pub normal: Option<Vector3<f64>>,
    pub points: u32,
}

impl Region {
    /// Surface element of the region; `None` without a normal.
    pub fn facet(&self) -> Option<Facet> {
        self.normal.map(|normal| Facet { at: self.at, normal, points: self.points })
    }
}

/// Options for normals by regions.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct NormalOptions {
    /// Minimum number of points of a cube; cubes with fewer are noise.
    pub least_points: u32,
    /// Minimum number of points of a cube, as a share of those in the fullest cube within `reach`; others are blurred
    /// edges.
    pub least_share: f64,
    /// Range of the neighbouring cubes from which a cube's normal is computed, in cubes to each side.
    pub reach: i64,
    /// Minimum number of neighbouring cubes for a normal.
    pub least_regions: usize,
    /// Minimum ratio of the length of the mean cross product (Eq. 4) to the products' mean length; below it, the
    /// products disagree about the direction, and there is no normal.
    pub agreement: f64,
}

impl Default for NormalOptions {
    fn default() -> Self {
        NormalOptions { least_points: 3, least_share: 0.1, reach: 2, least_regions: 6, agreement: 0.6 }
    }
}

impl Cells {
    /// Creates an empty grid with cubes of an edge, metres.
    ///
    /// # Errors
    /// If the edge is not positive and finite.
    pub fn new(edge_m: f64) -> Result<Cells, CellsError> {
        if !(edge_m > 0.0 && edge_m.is_finite()) {
            return Err(CellsError::Edge { edge_m });
        }
        Ok(Cells { edge_m, table: Table::with_room_for(0), sums: Vec::new() })
    }

    /// Edge of a cell, metres.
    pub fn edge_m(&self) -> f64 {
        self.edge_m
    }

    /// Number of cells that hold points.
    pub fn len(&self) -> usize {
        self.sums.len()
    }

    /// True if no points were added.
    pub fn is_empty(&self) -> bool {
        self.sums.is_empty()
    }

    /// Number of points that were added.
    pub fn points(&self) -> u64 {
        self.sums.iter().map(|s| u64::from(s.count)).sum()
    }

    /// Adds the points of a station (level frame, metres) up to depth `far_m`; the camera is `height_m` above its
    /// origin.
    ///
    /// Points that are not finite, or farther out than a million cells, are skipped.
    pub fn add(
        &mut self,
        points: &[Point3<f32>],
        map_from_level: &Isometry2<f64>,
        height_m: f64,
        far_m: f64,
    ) {
        let per_m = 1.0 / self.edge_m;
        let turn = map_from_level.rotation.to_rotation_matrix();
        let shift = map_from_level.translation.vector;
        let mut last = (u64::MAX, 0);
        for p in points.iter().filter(|p| is_finite(p) && f64::from(p.x) <= far_m) {
            let plan = turn * Vector2::new(f64::from(p.x), f64::from(p.y));
            let at = [plan.x + shift.x, plan.y + shift.y, f64::from(p.z)];
            let cube = at.map(|c| voxel::floor(c * per_m));
            let Some(key) = voxel::key(cube) else { continue };
            if key != last.0 {
                last = (key, self.table.number(key) as usize);
                if last.1 == self.sums.len() {
                    let cube = cube.map(|c| c as i32);
                    self.sums.push(Sums { cube, count: 0, sum: [0.0; 3], towards: [0.0; 3] });
                }
            }
            let sums = &mut self.sums[last.1];
            let back = [-plan.x, -plan.y, height_m - at[2]];
            let per = 1.0 / (back[0] * back[0] + back[1] * back[1] + back[2] * back[2]).sqrt().max(1e-9);
            sums.count = sums.count.saturating_add(1);
            for k in 0..3 {
                sums.sum[k] += (at[k] - cube[k] as f64 * self.edge_m) as f32;
                sums.towards[k] += (back[k] * per) as f32;
            }
        }
    }

    /// Surface elements of all cells with sufficient evidence, ordered by cell coordinates.
    pub fn facets(&self, options: &NormalOptions) -> Vec<Facet> {
        self.regions(options).iter().filter_map(Region::facet).collect()
    }

    /// Regions of all cells above the noise limits, ordered by cell coordinates.
    pub(super) fn regions(&self, options: &NormalOptions) -> Vec<Region> {
        let _span = tracing::debug_span!("normals by regions", cells = self.len()).entered();
        let region = |sums: &Sums| {
            if sums.count < options.least_points {
                return None;
            }
            let at = self.centroid(sums);
            let towards = Vector3::from(sums.towards).cast();
            let around = self.around(sums, options.reach);
            let fullest = around.iter().map(|s| s.count).max().unwrap_or(0).max(sums.count);
            let least = f64::from(options.least_points).max(options.least_share * f64::from(fullest));
            if f64::from(sums.count) < least {
                return None;
            }
            let full = around.into_iter().filter(|s| f64::from(s.count) >= least);
            let others: Vec<Point3<f64>> = full.map(|s| self.centroid(s)).collect();
            let normal = by_regions(&at, &others, &towards, options);
            let towards = towards / f64::from(sums.count);
            Some((sums.cube, Region { at, towards, normal, points: sums.count }))
        };
        let mut found: Vec<_> = pool::filter(self.sums.len(), 1, |n| region(&self.sums[n]));
        found.sort_unstable_by_key(|(cube, _)| *cube);
        found.into_iter().map(|(_, region)| region).collect()
    }

    /// Plan points of the cells in a height band, weighted by their points and thinned to `thin_m`, so that vertically
    /// stacked cells form one plan point.
    pub(super) fn plan(&self, band_m: &RangeInclusive<f64>, least_points: u32, thin_m: f64) -> Vec<Spot> {
        let kept = self.sums.iter().filter(|s| s.count >= least_points);
        let at = kept.map(|s| (self.centroid(s), f64::from(s.count)));
        let spots = at.filter(|(at, _)| band_m.contains(&at.z));
        thinned(spots.map(|(at, weight)| Spot { at: at.xy(), weight }), thin_m)
    }

    fn centroid(&self, sums: &Sums) -> Point3<f64> {
        let axis =
            |k: usize| f64::from(sums.cube[k]) * self.edge_m + f64::from(sums.sum[k]) / f64::from(sums.count);
        Point3::new(axis(0), axis(1), axis(2))
    }

    /// Occupied cubes at most `reach` cubes from the given one along each axis, without that cube.
    fn around(&self, own: &Sums, reach: i64) -> Vec<&Sums> {
        let span = || -reach..=reach;
        let [a, b, c] = own.cube.map(i64::from);
        let others = span().flat_map(|x| span().flat_map(move |y| span().map(move |z| (x, y, z))));
        let keys =
            others.filter(|o| *o != (0, 0, 0)).filter_map(|(x, y, z)| voxel::key([a + x, b + y, c + z]));
        keys.filter_map(|key| self.table.find(key)).map(|number| &self.sums[number as usize]).collect()
    }
}

/// Surface normal at `at`: normalised sum of the cross products of all pairs of vectors to the centroids of
/// neighbouring regions (Eq. 4). `None` if the regions are too few or disagree.
///
/// Each product is first flipped `towards` the camera, as opposite pairs would cancel.
pub fn by_regions(
    at: &Point3<f64>,
    regions: &[Point3<f64>],
    towards: &Vector3<f64>,
    options: &NormalOptions,
) -> Option<Vector3<f64>> {
    if regions.len() < options.least_regions.max(2) {
        return None;
    }
    let ways: Vec<Vector3<f64>> = regions.iter().map(|r| r - at).collect();
    let (mut sum, mut lengths) = (Vector3::zeros(), 0.0);
    for (i, a) in ways.iter().enumerate() {
        for b in &ways[i + 1..] {
            let product = a.cross(b);
            lengths += product.norm();
            sum += if product.dot(towards) < 0.0 { -product } else { product };
        }
    }
    let length = sum.norm();
    (length > options.agreement * lengths && length > 0.0).then(|| sum / length)
}
