//! Bodies split by an occluder: two ends of one face, with the gap hidden in all views.

use super::patches::{SIDE_VOXELS, Voxels, is_upright, members};
use crate::pool;
use crate::quantile::{VOXEL_ENDS, quantile};
use crate::scale::PLACE_M;
use crate::surface::Surface;
use crate::visibility::{Seen, Visibility};
use nalgebra::{Point3, Vector2, Vector3};
use std::collections::BTreeMap;

/// Maximum number of visible upright faces of a box. From: derived, one of two that are across from
/// each other is turned away.
const FACES: usize = 2;
/// Minimum cosine between the normals of one upright face, and between the normals of two ends of
/// one face (15°). From: chosen.
const FLAT: f64 = 0.966;
/// Maximum width of a hidden part of a face, metres. From: chosen.
const WIDEST_M: f64 = 0.25;
/// Step along a gap at which visibility is tested, metres. From: work.
const STEP_M: f64 = 0.01;
/// Heights at which the visibility of a gap is tested, as shares of the face's height. From: work.
const SHARES: [f64; 3] = [0.3, 0.5, 0.7];

/// Upright face of a part, surface frame.
struct Face {
    /// Horizontal unit normal.
    normal: Vector2<f64>,
    /// Distance of the face's plane from the origin along the normal, metres.
    offset_m: f64,
    /// Start and end of the face along its horizontal direction, metres.
    span_m: (f64, f64),
}

/// Part of the segmentation with its upright faces.
struct Body {
    /// Number of the part: one of its voxels.
    name: u32,
    top_m: f64,
    faces: Vec<Face>,
}

/// Merges parts of one body split by an occluder, under the lower part number.
pub(super) fn join(voxels: &Voxels, part_of_voxel: &mut [u32], seen: &Visibility, surface: &Surface) {
    let body = |(name, of): &(u32, Vec<usize>)| Body::of(*name, voxels, of);
    let bodies = pool::heaviest_first(&members(part_of_voxel), |(_, of)| of.len(), body);
    let mut names: BTreeMap<u32, u32> = bodies.iter().map(|body| (body.name, body.name)).collect();
    for (i, one) in bodies.iter().enumerate() {
        for other in &bodies[i + 1..] {
            if one.goes_on_in(other, seen, surface) {
                let (kept, gone) = (names[&one.name], names[&other.name]);
                let (kept, gone) = (kept.min(gone), kept.max(gone));
                names.values_mut().filter(|name| **name == gone).for_each(|name| *name = kept);
            }
        }
    }
    part_of_voxel.iter_mut().for_each(|part| *part = names[part]);
}

impl Body {
    fn of(name: u32, voxels: &Voxels, of: &[usize]) -> Body {
        let mut heights: Vec<f64> = of.iter().map(|&v| voxels.centres[v].z).collect();
        Body { name, top_m: quantile(&mut heights, VOXEL_ENDS.1), faces: faces(voxels, of) }
    }

    /// True if both bodies have coplanar, equally high faces, and the gap between two such faces is
    /// hidden.
    fn goes_on_in(&self, other: &Body, seen: &Visibility, surface: &Surface) -> bool {
        (self.top_m - other.top_m).abs() < PLACE_M
            && self.faces.iter().any(|a| {
                let top_m = self.top_m.min(other.top_m);
                other.faces.iter().any(|b| a.gap_to(b).is_some_and(|gap| gap.is_hidden(top_m, seen, surface)))
            })
    }
}

/// Visible upright faces of a part, widest first: repeatedly the direction that most remaining side
/// points agree on.
fn faces(voxels: &Voxels, of: &[usize]) -> Vec<Face> {
    let mut side: Vec<(Point3<f64>, Vector2<f64>)> = of
        .iter()
        .filter(|&&v| is_upright(&voxels.normals[v]))
        .map(|&v| (voxels.centres[v], voxels.normals[v].xy().normalize()))
        .collect();
    /// Approximate number of directions that are tried. From: work.
    const TRIED: usize = 25;
    let mut faces = Vec::new();
    while side.len() >= SIDE_VOXELS && faces.len() < FACES {
        let like = |to: &Vector2<f64>| side.iter().filter(|(_, n)| n.dot(to) > FLAT).count();
        // Every few are enough to try.
        let tried = side.iter().step_by(side.len().div_ceil(TRIED));
        let Some((_, first)) = tried.max_by_key(|(_, n)| like(n)).copied() else { break };
        let (face, rest): (Vec<_>, Vec<_>) = side.into_iter().partition(|(_, n)| n.dot(&first) > FLAT);
        faces.extend(Face::through(&face));
        side = rest;
    }
    faces
}

impl Face {
    /// Face through points with normals; `None` if too few of the points lie in one plane.
    fn through(of: &[(Point3<f64>, Vector2<f64>)]) -> Option<Face> {
        let normal = of.iter().map(|(_, n)| n).sum::<Vector2<f64>>().try_normalize(0.0)?;
        let mut offsets: Vec<f64> = of.iter().map(|(p, _)| normal.dot(&p.xy().coords)).collect();
        let offset_m = quantile(&mut offsets, 0.5);
        let on: Vec<&Point3<f64>> = of
            .iter()
            .map(|(p, _)| p)
            .filter(|p| (normal.dot(&p.xy().coords) - offset_m).abs() < PLACE_M)
            .collect();
        let mut along: Vec<f64> = on.iter().map(|p| p.x * -normal.y + p.y * normal.x).collect();
        let span_m = (quantile(&mut along, VOXEL_ENDS.0), quantile(&mut along, VOXEL_ENDS.1));
        (on.len() >= SIDE_VOXELS && on.len() * 10 >= of.len() * 7).then_some(Face {
            normal,
            offset_m,
            span_m,
        })
    }

    /// Point of the face's plane at a distance along the face and a height, metres.
    fn at(&self, along_m: f64, height_m: f64) -> Point3<f64> {
        let flat = self.normal * self.offset_m + Vector2::new(-self.normal.y, self.normal.x) * along_m;
        Point3::new(flat.x, flat.y, height_m)
    }

    /// Gap between this face and `other` if they may be ends of one face; `None` otherwise.
    fn gap_to<'a>(&'a self, other: &'a Face) -> Option<Gap<'a>> {
        if self.normal.dot(&other.normal) < FLAT {
            return None;
        }
        let (left, right) = if self.span_m.0 < other.span_m.0 { (self, other) } else { (other, self) };
        let (from, to) = (left.at(left.span_m.1, 0.0), right.at(right.span_m.0, 0.0));
        let wide_m = (to - from).dot(&Vector3::new(-left.normal.y, left.normal.x, 0.0));
        let off = |face: &Face, p: &Point3<f64>| (face.normal.dot(&p.xy().coords) - face.offset_m).abs();
        let middle = from + (to - from) / 2.0;
        ((STEP_M..WIDEST_M).contains(&wide_m)
            && off(left, &middle) < PLACE_M
            && off(right, &middle) < PLACE_M)
            .then_some(Gap { face: left, from_m: left.span_m.1, wide_m })
    }
}

/// Unseen part of a face between two of its ends.
struct Gap<'a> {
    face: &'a Face,
    from_m: f64,
    wide_m: f64,
}

impl Gap<'_> {
    fn is_hidden(&self, top_m: f64, seen: &Visibility, surface: &Surface) -> bool {
        let world_from_surface = surface.surface_from_world.inverse();
        let steps = (self.wide_m / STEP_M).ceil().max(2.0) as usize;
        let (mut hidden, mut all) = (0, 0);
        for k in 1..steps {
            let along_m = self.from_m + self.wide_m * k as f64 / steps as f64;
            for share in SHARES {
                let place = world_from_surface * self.face.at(along_m, share * top_m);
                match seen.look(&place, PLACE_M) {
                    Seen::Free => return false,
                    Seen::Hidden => hidden += 1,
                    Seen::Surface | Seen::Never => {}
                }
                all += 1;
            }
        }
        // All views miss most of it.
        2 * hidden > all
    }
}
