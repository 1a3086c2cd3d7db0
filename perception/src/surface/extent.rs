//! How far a plane reaches where what stands on it hides it: on from where it was seen, as long as no camera saw it to be absent.

use super::face::{CELL_M, cell_of, level};
use super::hull::{area, convex_hull, parts};
use super::planes::{Plane, Sample};
use super::{Surface, range_sigma_m};
use crate::visibility::{DepthMap, Visibility};
use nalgebra::{Isometry3, Point3, Translation3, UnitQuaternion};
use rustc_hash::{FxHashMap, FxHashSet};

/// So far a plane is taken to reach on behind and beneath what hides it, metres: few things are twice as wide.
const HIDDEN_M: f64 = 0.3;
/// What stands on a plane is no taller, metres.
const TALLEST_M: f64 = 0.6;
/// What is this much lower at the edge of a plane stands beside it, metres.
const BESIDE_M: f64 = 0.3;

/// Which cells of a plane belong to which of its parts.
pub(super) type Owners = FxHashMap<[i32; 2], usize>;

/// What hides a plane from the cameras.
pub(super) struct Hiding<'a> {
    /// Each camera, how high it is above the plane, metres, and places on the plane as seen from it.
    maps: Vec<(&'a DepthMap, f64, Isometry3<f64>)>,
}

impl<'a> Hiding<'a> {
    pub fn of(plane: &Plane, seen: &'a Visibility) -> Hiding<'a> {
        let world_from_flat = level(plane).inverse() * Translation3::new(0.0, 0.0, plane.offset);
        let maps = seen.maps.iter().map(|map| {
            (map, plane.distance(&map.viewpoint()), map.camera_from_world * world_from_flat)
        });
        Hiding { maps: maps.filter(|(_, high_m, _)| *high_m > 0.0).collect() }
    }

    /// True if no camera saw anything lower than the plane at a cell, and, unless that may be unseen, one saw something above it.
    fn allows(&self, [x, y]: [i32; 2], unseen: bool) -> bool {
        const PLACES: [[f64; 2]; 5] = [[0.5, 0.5], [0.1, 0.1], [0.9, 0.1], [0.1, 0.9], [0.9, 0.9]];
        let mut any = unseen;
        for [dx, dy] in PLACES {
            let place = Point3::new(f64::from(x) + dx, f64::from(y) + dy, 0.0) * CELL_M;
            for (map, high_m, camera_from_flat) in &self.maps {
                let q = camera_from_flat * place;
                let pixel = map.intrinsics.project(&q).and_then(|(u, v)| map.intrinsics.pixel(u, v));
                let share = pixel.map_or(f64::NAN, |pixel| f64::from(map.depths_m[pixel]) / q.z);
                let band_m = Plane::band_of(range_sigma_m(share * q.coords.norm()));
                let above_m = high_m * (1.0 - share);
                if above_m < -band_m {
                    return false;
                }
                any |= above_m > band_m;
            }
        }
        any
    }

    /// Gives the hidden cells around those that are owned to their owners, ring by ring, those that no camera had in view as well if told so;
    /// tells which owners meet.
    pub fn spread(&self, owners: &mut Owners, mut border: Vec<[i32; 2]>, unseen: bool) -> Vec<[usize; 2]> {
        let mut meeting = Vec::new();
        let mut refused: FxHashSet<[i32; 2]> = FxHashSet::default();
        for _ in 0..(HIDDEN_M / CELL_M) as usize {
            let mut next = Vec::new();
            for cell in border {
                let owner = owners[&cell];
                for around in (0..9).map(|k| [cell[0] + k % 3 - 1, cell[1] + k / 3 - 1]) {
                    match owners.get(&around) {
                        Some(&other) if other != owner => meeting.push([owner.min(other), owner.max(other)]),
                        Some(_) => {}
                        None if refused.contains(&around) => {}
                        None if self.allows(around, unseen) => {
                            owners.insert(around, owner);
                            next.push(around);
                        }
                        None => {
                            refused.insert(around);
                        }
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

impl Surface {
    /// With the places on which things stand that hide its edge.
    pub(super) fn with_hidden(self, samples: &[Sample], seen: &Visibility) -> Surface {
        let plane = Plane { normal: self.up.into_inner(), offset: self.offset_m };
        let turn = level(&plane);
        let (outline, over) = (self.outline(), self.overhung());
        // What stands beside the outline, and what lies lower there.
        let (mut high, mut low) = (Vec::new(), Owners::default());
        for s in samples {
            let height_m = plane.distance(&s.point);
            let near = height_m > -BESIDE_M && height_m < TALLEST_M && height_m.abs() > Plane::band_m(s);
            if !near || outline.covers(&s.point, 0.0) || !outline.covers(&s.point, 2.0 * HIDDEN_M) {
                continue;
            }
            let cell = cell_of(&turn, &s.point);
            if height_m < 0.0 {
                low.insert(cell, 0);
            } else if !over(height_m, &s.point) {
                high.push((cell, s.point));
            }
        }
        if high.is_empty() {
            return self;
        }
        let border = along_edges(&self, &turn);
        let mut owners: Owners = border.iter().map(|cell| (*cell, 0)).collect();
        Hiding::of(&plane, seen).spread(&mut owners, border, true);
        let is_beside =
            |cell: &[i32; 2]| (0..9).any(|k| low.contains_key(&[cell[0] + k % 3 - 1, cell[1] + k / 3 - 1]));
        let mut things = parts(&high.iter().map(|(cell, _)| (*cell, 1)).collect());
        things.retain(|cells| !cells.iter().any(is_beside));
        let standing: Owners = things.into_iter().flatten().map(|cell| (cell, 0)).collect();
        high.retain(|(cell, _)| standing.contains_key(cell) && owners.contains_key(cell));
        self.widened(&turn, high.iter().map(|(_, p)| p))
    }

    /// With the hull around its own and some places.
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

/// The cells along the edges of a surface, in order around it.
fn along_edges(surface: &Surface, turn: &UnitQuaternion<f64>) -> Vec<[i32; 2]> {
    /// Of a longer edge not every cell is named.
    const MOST: f64 = 2000.0;
    let ends = surface.hull.iter().zip(surface.hull.iter().cycle().skip(1));
    let edge = |(a, b): (&Point3<f64>, &Point3<f64>)| {
        let (a, way) = (*a, b - a);
        let steps = (way.norm() / CELL_M).ceil().clamp(1.0, MOST) as usize;
        (0..steps).map(move |k| a + way * (k as f64 / steps as f64))
    };
    let mut cells: Vec<[i32; 2]> = ends.flat_map(edge).map(|p| cell_of(turn, &p)).collect();
    cells.dedup();
    cells
}
