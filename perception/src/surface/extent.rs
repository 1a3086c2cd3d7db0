//! Extent of a plane under objects that hide it: the plane continues from its visible part as long
//! as no camera saw its absence.

use super::connected::parts;
use super::face::Grid;
use super::level::Surface;
use super::planes::Plane;
use super::sample::Sample;
use super::tiles::Tiles;
use crate::camera::Intrinsics;
use crate::noise::range_sigma_m;
use crate::polygon::{area, convex_hull};
use crate::pool;
use crate::visibility::{DepthMap, Visibility};
use nalgebra::{Point3, Translation3, UnitQuaternion, Vector3};
use rustc_hash::FxHashSet;

/// Maximum assumed continuation of a plane behind and beneath objects, metres: few objects are
/// twice as wide. From: chosen.
const HIDDEN_M: f64 = 0.3;
/// Maximum height of an object on a plane, metres. From: chosen.
pub(crate) const TALLEST_M: f64 = 0.6;
/// Maximum depth below a plane of points that show an object to stand beside the plane, metres.
/// From: chosen.
const BESIDE_M: f64 = 0.3;

/// Tested positions inside a cell, from its corner, in cells. From: chosen, the middle and near the
/// corners.
const PLACES: [[f64; 2]; 5] = [[0.5, 0.5], [0.1, 0.1], [0.9, 0.1], [0.1, 0.9], [0.9, 0.9]];

/// Owner of a cell.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) enum Owner {
    /// Cell not tested yet.
    #[default]
    Untold,
    /// The plane may continue here, for whichever part reaches the cell first.
    Open,
    /// The plane does not continue here.
    Nobody,
    /// Part with this number.
    Part(u32),
}

/// Owner of each cell of a plane.
pub(super) type Owners = Tiles<Owner>;

/// The occlusion of a plane in the views of the cameras.
pub(super) struct Hiding<'a> {
    cameras: Vec<Above<'a>>,
    /// Maximum number of cells over which a plane continues hidden.
    rings: usize,
}

/// A camera above a plane.
struct Above<'a> {
    map: &'a DepthMap,
    /// Height of the camera above the plane, metres.
    high_m: f64,
    /// Corner of cell zero in the camera frame, metres.
    origin: Vector3<f64>,
    /// Steps of one cell along x and y of the plane, camera frame, metres.
    steps: [Vector3<f64>; 2],
    /// Length of the longest image ray per metre of depth.
    longest: f64,
}

impl<'a> Hiding<'a> {
    pub fn of(plane: &Plane, grid: &Grid, seen: &'a Visibility) -> Hiding<'a> {
        let world_from_flat = grid.turn.inverse() * Translation3::new(0.0, 0.0, plane.offset);
        let above = seen.maps.iter().map(|map| {
            let camera_from_flat = map.camera_from_world * world_from_flat;
            let step = |axis: Vector3<f64>| camera_from_flat * axis * grid.side_m;
            Above {
                map,
                high_m: plane.distance(&map.viewpoint()),
                origin: camera_from_flat.translation.vector,
                steps: [step(Vector3::x()), step(Vector3::y())],
                longest: longest_ray(&map.intrinsics),
            }
        });
        let cameras = above.filter(|camera| camera.high_m > 0.0).collect();
        Hiding { cameras, rings: (HIDDEN_M / grid.side_m) as usize }
    }

    /// True if no camera saw anything below the plane at a cell and (unless `unseen`) a camera saw
    /// something above it.
    fn allows(&self, [x, y]: [i32; 2], unseen: bool) -> bool {
        let mut any = unseen;
        for [dx, dy] in PLACES {
            for camera in &self.cameras {
                let above = camera.above([f64::from(x) + dx, f64::from(y) + dy]);
                if above == Some(false) {
                    return false;
                }
                any |= above == Some(true);
            }
        }
        any
    }

    /// Decides for each untested neighbour of the border cells whether the plane may continue
    /// there; keeps the border cells that are not surrounded by their own part.
    fn ask(&self, owners: &mut Owners, border: &mut Vec<[i32; 2]>, unseen: bool) {
        /// Number of cells per thread. From: work.
        const SOME: usize = 256;
        let mut asked = Vec::new();
        border.retain(|cell| {
            let (own, mut amid) = (owners.get(*cell), true);
            for cell in around(*cell) {
                let of = owners.get(cell);
                amid &= of == own;
                if of == Owner::Untold {
                    *owners.at(cell) = Owner::Nobody;
                    asked.push(cell);
                }
            }
            !amid
        });
        let open = pool::map(&asked, SOME, |cell| self.allows(*cell, unseen));
        let open = asked.iter().zip(open).filter(|(_, open)| *open);
        open.for_each(|(cell, _)| *owners.at(*cell) = Owner::Open);
    }

    /// Grows owned cells over hidden neighbours, ring by ring (with `unseen`, also over cells
    /// outside all views); returns the pairs of owners that meet.
    pub fn spread(&self, owners: &mut Owners, mut border: Vec<[i32; 2]>, unseen: bool) -> Vec<[u32; 2]> {
        let mut meeting = Vec::new();
        for _ in 0..self.rings {
            self.ask(owners, &mut border, unseen);
            let mut next = Vec::new();
            for cell in border {
                let Owner::Part(owner) = owners.get(cell) else { continue };
                for around in around(cell) {
                    match owners.get(around) {
                        Owner::Open => {
                            *owners.at(around) = Owner::Part(owner);
                            next.push(around);
                        }
                        Owner::Part(other) if other != owner => meeting.push([owner, other]),
                        Owner::Part(_) | Owner::Nobody | Owner::Untold => {}
                    }
                }
            }
            border = next;
        }
        meeting.sort_unstable();
        meeting.dedup();
        meeting
    }
}

/// Cell with its eight neighbours.
pub(super) fn around([x, y]: [i32; 2]) -> impl Iterator<Item = [i32; 2]> {
    (0..9).map(move |k| [x + k % 3 - 1, y + k / 3 - 1])
}

impl Above<'_> {
    /// True if the return at a plane position (in cells) is above the plane, false if below; `None`
    /// if on the plane or missing.
    fn above(&self, [x, y]: [f64; 2]) -> Option<bool> {
        let q = self.origin + self.steps[0] * x + self.steps[1] * y;
        let (u, v) = self.map.intrinsics.project(&q.into())?;
        let depth_m = f64::from(self.map.depths_m[self.map.intrinsics.pixel(u, v)?]);
        let share = depth_m / q.z;
        let above_m = self.high_m * (1.0 - share);
        let is_beyond = |range_m: f64| above_m.abs() > Plane::band_of(range_sigma_m(range_m));
        // Where nothing returns it is not a number. What is off as if the ray were the longest, or not even as if it were the shortest,
        // needs no length.
        let is_off = is_beyond(depth_m) && (is_beyond(depth_m * self.longest) || is_beyond(share * q.norm()));
        is_off.then_some(above_m > 0.0)
    }
}

fn longest_ray(camera: &Intrinsics) -> f64 {
    let corners = [[0.0, 0.0], [1.0, 0.0], [0.0, 1.0], [1.0, 1.0]];
    let far = corners.map(|[x, y]| camera.unproject(x * camera.width as f64, y * camera.height as f64, 1.0));
    far.iter().map(|p| p.coords.norm()).fold(1.0, f64::max)
}

impl Surface {
    /// Surface extended by the places where objects hide its edge.
    pub(super) fn with_hidden(self, samples: &[Sample], seen: &Visibility) -> Surface {
        let plane = Plane { normal: self.up.into_inner(), offset: self.offset_m };
        let grid = Grid::fine(&plane);
        let (outline, over) = (self.outline(), self.overhung());
        // What stands beside the outline, and what lies lower there.
        let (mut high, mut low) = (Vec::new(), FxHashSet::default());
        for s in samples {
            let height_m = plane.distance(&s.point);
            let near = height_m > -BESIDE_M && height_m < TALLEST_M && height_m.abs() > Plane::band_m(s);
            if !near || outline.covers(&s.point, 0.0) || !outline.covers(&s.point, 2.0 * HIDDEN_M) {
                continue;
            }
            let cell = grid.cell_of(&s.point);
            if height_m < 0.0 {
                low.insert(cell);
            } else if !over(height_m, &s.point) {
                high.push((cell, s.point));
            }
        }
        if high.is_empty() {
            return self;
        }
        let border = along_edges(&self, &grid);
        let mut owners = Owners::new();
        border.iter().for_each(|cell| *owners.at(*cell) = Owner::Part(0));
        Hiding::of(&plane, &grid, seen).spread(&mut owners, border, true);
        let is_beside = |cell: &[i32; 2]| around(*cell).any(|beside| low.contains(&beside));
        let cells: FxHashSet<[i32; 2]> = high.iter().map(|(cell, _)| *cell).collect();
        let mut things = parts(cells.into_iter().map(|cell| (cell, 1)).collect());
        things.retain(|cells| !cells.iter().any(is_beside));
        let standing: FxHashSet<[i32; 2]> = things.into_iter().flatten().collect();
        let is_reached = |cell: &[i32; 2]| matches!(owners.get(*cell), Owner::Part(_));
        high.retain(|(cell, _)| standing.contains(cell) && is_reached(cell));
        self.widened(&grid.turn, high.iter().map(|(_, p)| p))
    }

    /// Extends the hull to contain further points.
    fn widened<'a>(
        self,
        turn: &UnitQuaternion<f64>,
        places: impl Iterator<Item = &'a Point3<f64>>,
    ) -> Surface {
        let flat = |p: &Point3<f64>| (turn * p).xy().coords.into();
        let corners = self.hull.iter().map(flat).chain(places.map(flat));
        let hull = convex_hull(corners.collect());
        let lift = turn.inverse();
        let onto = |[x, y]: [f64; 2]| lift * Point3::new(x, y, self.offset_m);
        Surface { hull: hull.iter().map(|c| onto(*c)).collect(), area_m2: area(&hull), ..self }
    }
}

/// Cells along the edges of a surface, in order.
fn along_edges(surface: &Surface, grid: &Grid) -> Vec<[i32; 2]> {
    /// Maximum number of points listed along one edge. From: chosen.
    const MOST: f64 = 2000.0;
    let ends = surface.hull.iter().zip(surface.hull.iter().cycle().skip(1));
    let edge = |(a, b): (&Point3<f64>, &Point3<f64>)| {
        let (a, way) = (*a, b - a);
        let steps = (way.norm() / grid.side_m).ceil().clamp(1.0, MOST) as usize;
        (0..steps).map(move |k| a + way * (k as f64 / steps as f64))
    };
    let mut cells: Vec<[i32; 2]> = ends.flat_map(edge).map(|p| grid.cell_of(&p)).collect();
    cells.dedup();
    cells
}
