//! The objects on a surface, each in one piece (paper 004, section V: plane away, clusters; here also touching and stacked objects).
//!
//! Points above the surface are gathered into voxels, voxels into small flat patches. Patches of one object meet convexly or
//! smoothly; where two objects touch, the surface has a concave crease. Vessels are the exception that is mended afterwards: what lies inside
//! the outline of a body and below its top, or within a round body that lies on its side, is the body's own inside.

mod hidden;
mod join;
mod mend;
mod patches;
#[doc(hidden)]
pub mod quantile;
mod rounds;
#[doc(hidden)]
pub mod stand;
#[doc(hidden)]
pub mod vessels;
#[doc(hidden)]
pub mod votes;

use crate::cloud::Cloud;
use crate::pool;
use crate::surface::{Rows, Surface, SurfaceError, SurfaceOptions, TALLEST_M, convex_hull, find_surface};
use crate::visibility::Visibility;
use nalgebra::{Point3, Vector3};
use patches::Voxels;
pub use quantile::{end, quantile};
use serde::{Deserialize, Serialize};
use std::ops::Range;

/// The options of the segmentation of a scene into objects.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct SceneOptions {
    /// The options of the search for the surface.
    pub surface: SurfaceOptions,
    /// Minimum height above the surface of an object's point, metres; rough surfaces raise it.
    /// From: chosen.
    pub clearance_m: f64,
    /// Greatest height above the surface of a point that belongs to an object, metres.
    pub tallest_m: f64,
    /// Side of the voxels, metres. Objects that stand twice as far apart are always separate. From: chosen.
    pub voxel_m: f64,
    /// Fewest points of an object. From: chosen.
    pub fewest_points: usize,
    /// Minimum height of an object's top above its support, metres. From: chosen.
    pub least_height_m: f64,
    /// True if touching objects are separated at concave creases.
    pub part_touching: bool,
}

impl Default for SceneOptions {
    fn default() -> Self {
        SceneOptions {
            surface: SurfaceOptions::default(),
            clearance_m: 0.008,
            tallest_m: TALLEST_M,
            voxel_m: 0.008,
            fewest_points: 60,
            least_height_m: 0.025,
            part_touching: true,
        }
    }
}

/// One object: points that belong together.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Segment {
    /// Indices into the cloud that was segmented, ascending.
    pub indices: Vec<u32>,
    /// Points in the surface's frame (z is the height above the surface), metres, in the order of `indices`.
    #[serde(skip)]
    pub points: Vec<Point3<f64>>,
    /// Height of the object's support above the surface, metres: 0 on the surface itself, more on
    /// another object.
    pub base_m: f64,
    /// Standard deviation of that height, metres; large for an object inside another, whose foot is
    /// invisible.
    #[serde(default)]
    pub base_sigma_m: f64,
}

impl Segment {
    /// Union with another segment, in order of the indices, on the support of the lower one.
    pub(crate) fn with(&self, other: &Segment) -> Segment {
        let count = self.indices.len() + other.indices.len();
        let lower = if other.base_m < self.base_m { other } else { self };
        let mut both = Segment {
            indices: Vec::with_capacity(count),
            points: Vec::with_capacity(count),
            base_m: lower.base_m,
            base_sigma_m: lower.base_sigma_m,
        };
        let (mut i, mut j) = (0, 0);
        while i < self.indices.len() || j < other.indices.len() {
            let is_own =
                other.indices.get(j).is_none_or(|next| self.indices.get(i).is_some_and(|own| own <= next));
            let (from, at) = if is_own { (self, &mut i) } else { (other, &mut j) };
            both.indices.push(from.indices[*at]);
            both.points.push(from.points[*at]);
            *at += 1;
        }
        both
    }
}

/// Surface with the objects on it.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Scene {
    /// The surface that the objects stand on.
    pub surface: Surface,
    /// The objects, most points first.
    pub segments: Vec<Segment>,
}

/// Finds the surface in a cloud (world frame) and segments the objects on it.
///
/// # Errors
/// If no surface is found.
pub fn segment(cloud: &Cloud, seen: &Visibility, options: &SceneOptions) -> Result<Scene, SurfaceError> {
    let surface = find_surface(cloud, seen, &options.surface)?;
    Ok(segment_on(cloud, seen, surface, options))
}

/// Segments the objects on a known surface.
pub fn segment_on(cloud: &Cloud, seen: &Visibility, surface: Surface, options: &SceneOptions) -> Scene {
    pool::within(tracing::debug_span!("segment", points = cloud.len()), || {
        let (indices, points) = above(cloud, &surface, options);
        let viewpoints: Vec<_> = seen.viewpoints().iter().map(|v| surface.surface_from_world * v).collect();
        let (voxels, sets) = patches::voxels(&points, options.voxel_m, &viewpoints, join::Sets::of);
        let mut part_of_voxel = join::parts(&voxels, &sets, options);
        if options.part_touching {
            rounds::part(&voxels, &points, &mut part_of_voxel, &viewpoints);
            hidden::join(&voxels, &mut part_of_voxel, seen, &surface);
        }
        let mut parts = gather(&indices, &points, &voxels, &part_of_voxel);
        if options.part_touching {
            parts = vessels::whole(parts, &viewpoints);
        }
        parts.retain(|s| s.indices.len() >= options.fewest_points);
        let mut tops = stand::on(&mut parts).into_iter();
        parts.retain(|s| tops.next().is_some_and(|top| top - s.base_m >= options.least_height_m));
        parts.sort_by(|a, b| b.indices.len().cmp(&a.indices.len()).then(a.indices.cmp(&b.indices)));
        Scene { surface, segments: parts }
    })
}

/// Quantiles of a segment's point heights that define its lower edge and its top, excluding noise.
/// From: chosen.
pub const POINT_ENDS: (f64, f64) = (0.01, 0.99);
/// Quantiles for the voxels of a part, and for protrusions of a body. From: chosen.
pub(crate) const VOXEL_ENDS: (f64, f64) = (0.03, 0.97);
/// Minimum number of voxels of an upright side. From: chosen.
const SIDE_VOXELS: usize = 25;
/// Maximum share, as a fraction, of places outside an enclosing outline. From: chosen.
pub const OUTSIDE: (usize, usize) = (3, 10);

/// Points of each part, in order of its first point.
fn gather(indices: &[u32], points: &[Point3<f64>], voxels: &Voxels, part_of_voxel: &[u32]) -> Vec<Segment> {
    let mut counts = vec![0; voxels.len()];
    for (&part, &count) in part_of_voxel.iter().zip(&voxels.counts) {
        counts[part as usize] += count as usize;
    }
    // Where each part is, by the voxel that names it, in each half of the points.
    let of = |runs: Range<usize>| {
        let mut parts: Vec<(u32, Segment)> = Vec::new();
        let mut slots: Vec<Option<usize>> = vec![None; voxels.len()];
        for (range, voxel) in voxels.runs(runs) {
            let part = part_of_voxel[voxel];
            let slot = *slots[part as usize].get_or_insert_with(|| {
                let count = counts[part as usize];
                let (indices, points) = (Vec::with_capacity(count), Vec::with_capacity(count));
                parts.push((part, Segment { indices, points, base_m: 0.0, base_sigma_m: 0.0 }));
                parts.len() - 1
            });
            // One or two most often: to copy them as a slice takes longer.
            for at in range {
                parts[slot].1.indices.push(indices[at]);
                parts[slot].1.points.push(points[at]);
            }
        }
        (parts, slots)
    };
    let half = voxels.count_runs() / 2;
    let ((mut parts, slots), (others, _)) = pool::join(|| of(0..half), || of(half..voxels.count_runs()));
    for (part, other) in others {
        match slots[part as usize] {
            Some(slot) => {
                parts[slot].1.indices.extend(other.indices);
                parts[slot].1.points.extend(other.points);
            }
            None => parts.push((part, other)),
        }
    }
    parts.into_iter().map(|(_, segment)| segment).collect()
}

/// Indices and positions (surface frame) of points.
type Placed = (Vec<u32>, Vec<Point3<f64>>);

/// Points above the surface and inside its outline.
fn above(cloud: &Cloud, surface: &Surface, options: &SceneOptions) -> Placed {
    let half = cloud.len() / 2;
    let rows = Rows::of(surface);
    let [first, second] = [0..half, half..cloud.len()].map(|range| (range.start, &cloud.points[range]));
    let of = |(from, points): (usize, &[Point3<f32>])| above_of(from as u32, points, surface, &rows, options);
    let ((mut indices, mut points), more) = pool::join(|| of(first), || of(second));
    indices.extend(more.0);
    points.extend(more.1);
    (indices, points)
}

/// Points above the surface among consecutive ones, numbered from `from`.
fn above_of(from: u32, of: &[Point3<f32>], surface: &Surface, rows: &Rows, options: &SceneOptions) -> Placed {
    /// Number of spreads of the surface within which a point belongs to the surface itself. From: chosen.
    const ROUGH: f64 = 2.5;
    /// Number of points whose heights are computed together. From: work.
    const BLOCK: usize = 16;
    let clearance_m = options.clearance_m.max(ROUGH * surface.residual_m);
    let up = surface.up.cast::<f32>();
    let offset = surface.offset_m as f32;
    let band = clearance_m as f32..options.tallest_m as f32;
    let is_over = surface.overhung();
    let (mut indices, mut points) = (Vec::new(), Vec::new());
    for (block, first) in of.chunks(BLOCK).zip((from..).step_by(BLOCK)) {
        // What is not finite is in no band.
        let mut heights = [f32::NAN; BLOCK];
        heights.iter_mut().zip(block).for_each(|(height, p)| *height = up.dot(&p.coords) - offset);
        if !heights.iter().fold(false, |any, height| any | band.contains(height)) {
            continue;
        }
        for ((i, p), height) in (first..).zip(block).zip(heights) {
            if band.contains(&height) {
                let world = p.cast::<f64>();
                let flat = surface.surface_from_world * world;
                if rows.covers(&flat, &world) && !is_over(f64::from(height), &world) {
                    indices.push(i);
                    points.push(flat);
                }
            }
        }
    }
    (indices, points)
}

/// Height of a segment's top above the surface, metres: high quantile that excludes noise.
pub fn top_m(segment: &Segment) -> f64 {
    let heights: Vec<f64> = segment.points.iter().map(|p| p.z).collect();
    end(&heights, POINT_ENDS.1)
}

/// Voxels of each part, ascending, by the part's name (one of its voxels).
fn members(part_of_voxel: &[u32]) -> Vec<(u32, Vec<usize>)> {
    let mut counts = vec![0; part_of_voxel.len()];
    part_of_voxel.iter().for_each(|part| counts[*part as usize] += 1);
    let named = (0..).zip(&counts).filter(|(_, count)| **count > 0);
    let mut members: Vec<(u32, Vec<usize>)> =
        named.map(|(name, count)| (name, Vec::with_capacity(*count))).collect();
    let mut places = counts;
    members.iter().enumerate().for_each(|(place, (name, _))| places[*name as usize] = place);
    let all = part_of_voxel.iter().enumerate();
    all.for_each(|(voxel, part)| members[places[*part as usize]].1.push(voxel));
    members
}

/// True of the normal of something upright.
fn is_upright(normal: &Vector3<f64>) -> bool {
    normal.z.abs() < 0.5 && normal.xy().norm() > 0.5
}

#[doc(hidden)]
pub fn middle(points: &[Point3<f64>]) -> [f64; 2] {
    let n = points.len().max(1) as f64;
    let (x, y) = points.iter().fold((0.0, 0.0), |(x, y), p| (x + p.x, y + p.y));
    [x / n, y / n]
}

/// Removes from a sorted list the elements of another sorted list.
fn take_away(from: &mut Vec<usize>, others: &[usize]) {
    let mut others = others.iter().peekable();
    from.retain(|own| {
        while others.next_if(|other| *other < own).is_some() {}
        others.peek() != Some(&own)
    });
}

/// Lowest and highest corner of the box around points.
pub fn bounds(points: &[Point3<f64>]) -> (Point3<f64>, Point3<f64>) {
    let first = points.first().copied().unwrap_or_else(Point3::origin);
    let (mut low, mut high) = (first, first);
    for p in points {
        for k in 0..3 {
            low[k] = if p[k] < low[k] { p[k] } else { low[k] };
            high[k] = if p[k] > high[k] { p[k] } else { high[k] };
        }
    }
    (low, high)
}

/// The convex outline of points.
pub fn hull_from_above(points: &[Point3<f64>]) -> Vec<[f64; 2]> {
    convex_hull(points.iter().map(|p| [p.x, p.y]).collect())
}

/// True if a convex anticlockwise outline holds most of the places: all but [`OUTSIDE`].
pub fn most_within<T>(hull: &[[f64; 2]], of: &[T], place: impl Fn(&T) -> [f64; 2]) -> bool {
    let outside = of.iter().filter(|p| !holds(hull, place(p)));
    // The first that is too many settles it.
    outside.take(of.len() * OUTSIDE.0 / OUTSIDE.1 + 1).count() * OUTSIDE.1 <= of.len() * OUTSIDE.0
}

/// True if a convex anticlockwise outline holds the place.
fn holds(hull: &[[f64; 2]], p: [f64; 2]) -> bool {
    let n = hull.len();
    n >= 3
        && (0..n).all(|i| {
            let (a, b) = (hull[i], hull[(i + 1) % n]);
            let (x, y) = (b[0] - a[0], b[1] - a[1]);
            x * (p[1] - a[1]) - y * (p[0] - a[0]) >= 0.0
        })
}
