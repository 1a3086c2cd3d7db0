//! Step 5: one cloud, sharper than any view, of bounded size.
//!
//! Returns at depth edges that hang between two surfaces are dropped. The rest are averaged in voxels, each weighted by the spread of its
//! range; then every voxel is moved along its normal onto the weighted mean of the like-facing voxels beside it. What a single
//! view claims and another looked through is left out.

use super::MergeOptions;
use super::prepare::{coarser, keeps};
use crate::cloud::{Cloud, Grid, is_finite};
use crate::normals;
use crate::surface::range_sigma_m;
use crate::view::View;
use crate::visibility::{Seen, Visibility};
use nalgebra::{Isometry3, Point3, Vector3};
use rayon::prelude::*;
use rustc_hash::FxHashMap;

/// A return between two neighbours this far before and behind it belongs to neither, as a share of its depth.
const FLYING_SHARE: f32 = 0.02;
/// How far along its normal a voxel may be moved by its neighbours, in spreads of its own.
const TUBE_SPREADS: f64 = 2.5;
/// Looks through a place this far off the surface say that nothing is there, metres.
const CARVE_M: f64 = 0.03;

/// A voxel's running sums. 32-bit offsets from the voxel's first point keep them small and exact.
#[derive(Clone, Copy)]
struct Cell {
    weight: f64,
    sum: Vector3<f64>,
    normal: Vector3<f64>,
    colour: [f64; 3],
    views: u16,
    last_view: u32,
}

pub(super) struct Fused {
    pub cloud: Cloud,
    pub views_per_point: Vec<u16>,
    pub returns: usize,
    pub voxel_m: f64,
}

type Cells = FxHashMap<[i32; 3], Cell>;

/// Fuses the used views at their corrected poses.
pub(super) fn fuse(
    views: &[View],
    used: &[bool],
    poses: &[Isometry3<f64>],
    seen: &Visibility,
    options: &MergeOptions,
) -> Fused {
    let mut voxel_m = options.fuse_voxel_m;
    loop {
        let (order, cells, returns) = gather(views, used, poses, voxel_m, options);
        if order.len() > options.most_points {
            // Surfaces: points fall with the square of the side.
            voxel_m *= (order.len() as f64 / options.most_points as f64).sqrt().max(1.2);
            continue;
        }
        let coloured = views.iter().zip(used).all(|(v, u)| !u || v.cloud.colours.is_some());
        return settle(&order, &cells, seen, voxel_m, coloured, returns);
    }
}

fn gather(
    views: &[View],
    used: &[bool],
    poses: &[Isometry3<f64>],
    voxel_m: f64,
    options: &MergeOptions,
) -> (Vec<[i32; 3]>, Cells, usize) {
    let parts: Vec<(Vec<[i32; 3]>, Cells, usize)> = (0..views.len())
        .into_par_iter()
        .map(
            |i| if used[i] { of_view(&views[i], &poses[i], i, voxel_m, options) } else { Default::default() },
        )
        .collect();
    let mut parts = parts.into_iter();
    let Some((mut order, mut cells, mut returns)) = parts.next() else { return Default::default() };
    for (keys, theirs, count) in parts {
        returns += count;
        for key in keys {
            let cell = theirs[&key];
            match cells.get_mut(&key) {
                Some(own) => {
                    own.weight += cell.weight;
                    own.sum += cell.sum;
                    own.normal += cell.normal;
                    (0..3).for_each(|k| own.colour[k] += cell.colour[k]);
                    own.views += u16::from(own.last_view != cell.last_view);
                    own.last_view = cell.last_view;
                }
                None => {
                    cells.insert(key, cell);
                    order.push(key);
                }
            }
        }
    }
    (order, cells, returns)
}

fn of_view(
    view: &View,
    pose: &Isometry3<f64>,
    number: usize,
    voxel_m: f64,
    options: &MergeOptions,
) -> (Vec<[i32; 3]>, Cells, usize) {
    let facing = facing(view);
    let turn = pose.rotation.to_rotation_matrix();
    let shift = pose.translation.vector;
    let colours = view.cloud.colours.as_deref();
    let (mut order, mut cells, mut returns) = (Vec::new(), Cells::default(), 0);
    for (i, p) in view.cloud.points.iter().enumerate() {
        if !keeps(p, pose, options, 0.0) || is_flying(&view.cloud, i) {
            continue;
        }
        returns += 1;
        let at = turn * p.coords.cast::<f64>() + shift;
        let sigma = range_sigma_m(f64::from(p.z.abs().max(p.coords.norm() * 0.5)));
        let weight = 1.0 / (sigma * sigma);
        let normal = turn * facing.at(i).cast::<f64>();
        let key = [at.x, at.y, at.z].map(|c| (c / voxel_m).floor() as i32);
        let cell = cells.entry(key).or_insert_with(|| {
            order.push(key);
            Cell {
                weight: 0.0,
                sum: Vector3::zeros(),
                normal: Vector3::zeros(),
                colour: [0.0; 3],
                views: 1,
                last_view: number as u32,
            }
        });
        cell.weight += weight;
        cell.sum += at * weight;
        if normal.x.is_finite() {
            cell.normal += normal * weight;
        }
        if let Some(colour) = colours.and_then(|c| c.get(i)) {
            (0..3).for_each(|k| cell.colour[k] += weight * f64::from(colour[k]));
        }
    }
    (order, cells, returns)
}

/// Normals of a view's points by pixel, coarser than its pixels.
struct Facing {
    normals: Vec<Vector3<f32>>,
    width: usize,
    stride: usize,
    coarse: (usize, usize),
}

impl Facing {
    fn at(&self, i: usize) -> Vector3<f32> {
        let none = Vector3::repeat(f32::NAN);
        if self.coarse.0 == 0 {
            return self.normals.get(i).copied().unwrap_or(none);
        }
        let (row, column) = (i / self.width / self.stride, i % self.width / self.stride);
        let at = row.min(self.coarse.1 - 1) * self.coarse.0 + column.min(self.coarse.0 - 1);
        self.normals.get(at).copied().unwrap_or(none)
    }
}

fn facing(view: &View) -> Facing {
    let own = || view.cloud.normals.clone().unwrap_or_default();
    let Some((coarse, grid)) = coarser(&view.cloud).zip(view.cloud.grid) else {
        return Facing { normals: own(), width: 1, stride: 1, coarse: (0, 0) };
    };
    let wide = normals::OrganisedOptions { reach: 1, depth_step_share: 0.02, base_m: 0.006, least: 5 };
    let normals = normals::organised(&coarse, &wide).map_or_else(own, |n| n.normals);
    let size = coarse.grid.map_or((0, 0), |g: Grid| (g.width, g.height));
    Facing { normals, width: grid.width, stride: (grid.width / size.0.max(1)).max(1), coarse: size }
}

/// True if the pixel hangs in the air: before one neighbour and behind the opposite one.
fn is_flying(cloud: &Cloud, i: usize) -> bool {
    let Some(Grid { width, height }) = cloud.grid else { return false };
    let (row, column) = (i / width, i % width);
    let depth = cloud.points[i].z;
    let step = FLYING_SHARE * depth;
    let beyond = |j: usize| cloud.points[j].z - depth;
    let between = |a: f32, b: f32| (a > step && b < -step) || (a < -step && b > step);
    let across = column > 0 && column + 1 < width && between(beyond(i - 1), beyond(i + 1));
    let down = row > 0 && row + 1 < height && between(beyond(i - width), beyond(i + width));
    across || down
}

/// Position, normal, colour and number of views of a fused point.
type Settled = (Point3<f32>, Vector3<f32>, [u8; 3], u16);

/// Moves the voxels onto their common surface and drops what was looked through.
fn settle(
    order: &[[i32; 3]],
    cells: &Cells,
    seen: &Visibility,
    voxel_m: f64,
    coloured: bool,
    returns: usize,
) -> Fused {
    let points: Vec<Option<Settled>> = order
        .par_iter()
        .map(|key| {
            let cell = &cells[key];
            let (at, normal) = smoothed(key, cell, cells);
            // One view's word against another's look through the place.
            let through = cell.views < 2 && seen.maps.len() > 1 && seen.look(&at, CARVE_M) == Seen::Free;
            let colour = cell.colour.map(|c| (c / cell.weight).round().clamp(0.0, 255.0) as u8);
            (!through && is_finite(&at.cast())).then_some((at.cast(), normal.cast(), colour, cell.views))
        })
        .collect();
    let mut fused = Fused { cloud: Cloud::default(), views_per_point: Vec::new(), returns, voxel_m };
    let (mut normals, mut colours) = (Vec::new(), Vec::new());
    for (at, normal, colour, views) in points.into_iter().flatten() {
        fused.cloud.points.push(at);
        normals.push(normal);
        colours.push(colour);
        fused.views_per_point.push(views);
    }
    fused.cloud.normals = Some(normals);
    fused.cloud.colours = coloured.then_some(colours);
    fused
}

fn smoothed(key: &[i32; 3], cell: &Cell, cells: &Cells) -> (Point3<f64>, Vector3<f64>) {
    let own = cell.sum / cell.weight;
    let Some(normal) = cell.normal.try_normalize(1e-9) else {
        return (Point3::from(own), Vector3::repeat(f64::NAN));
    };
    // The mean weight of a point tells its spread; a voxel of many points is no narrower a tube.
    let tube = TUBE_SPREADS * 0.003;
    let (mut weight, mut offset) = (0.0, 0.0);
    for dx in -1..=1 {
        for dy in -1..=1 {
            for dz in -1..=1 {
                let Some(near) = cells.get(&[key[0] + dx, key[1] + dy, key[2] + dz]) else { continue };
                let gap = normal.dot(&(near.sum / near.weight - own));
                if gap.abs() < tube && near.normal.dot(&normal) > 0.7 * near.normal.norm() {
                    weight += near.weight;
                    offset += near.weight * gap;
                }
            }
        }
    }
    let moved = if weight > 0.0 { own + normal * (offset / weight) } else { own };
    (Point3::from(moved), normal)
}
