//! Segmentation of the objects on a surface (paper 004, section V: plane removal and clustering;
//! here also touching and stacked objects).
//!
//! Points above the surface are gathered into voxels, voxels into small flat patches. Patches of one object meet convexly or
//! smoothly; where two objects touch, the surface has a concave crease. Vessels are the exception that is mended afterwards: what lies inside
//! the outline of a body and below its top, or within a round body that lies on its side, is the body's own inside.

mod footprint;
mod hidden;
mod join;
mod mend;
mod patches;
mod rounds;
mod scene;
#[doc(hidden)]
pub mod stand;
#[doc(hidden)]
pub mod vessels;
#[doc(hidden)]
pub mod votes;

use crate::cloud::Cloud;
use crate::pool;
pub(crate) use crate::quantile::VOXEL_ENDS;
pub use crate::quantile::{POINT_ENDS, end, quantile};
use crate::surface::{Rows, Surface, SurfaceError, find_surface};
use crate::visibility::Visibility;
pub use footprint::{OUTSIDE, bounds, hull_from_above, middle, most_within};
use nalgebra::Point3;
use patches::Voxels;
pub use scene::{Scene, SceneOptions, Segment, top_m};
use std::ops::Range;

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

/// Groups the points by part, in order of each part's first point.
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

/// Points above the surface in a chunk of a cloud; `from`: index of the chunk's first point.
fn above_of(from: u32, of: &[Point3<f32>], surface: &Surface, rows: &Rows, options: &SceneOptions) -> Placed {
    /// Multiple of the surface's standard deviation within which points belong to the surface.
    /// From: chosen.
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
