//! Step 5: one cloud, sharper than any view, of bounded size.
//!
//! Returns at depth edges that hang between two surfaces are dropped. The rest are averaged in voxels, each weighted by the spread of its
//! range; then every voxel is moved along its normal onto the weighted mean of the like-facing voxels beside it. What a single
//! view claims and another looked through is left out.

use super::MergeOptions;
use super::prepare::{coarser, in_band, in_range};
use crate::cloud::{Cloud, Grid, is_finite};
use crate::lattice::{Around, Lattice};
use crate::normals;
use crate::surface::range_sigma_m;
use crate::view::View;
use crate::visibility::Visibility;
use nalgebra::{Isometry3, Point3, Vector3};
use rayon::prelude::*;

/// A return between two neighbours this far before and behind it belongs to neither, as a share of its depth.
const FLYING_SHARE: f32 = 0.02;
/// How far along its normal a voxel may be moved by its neighbours, in spreads of its own.
const TUBE_SPREADS: f32 = 2.5;
/// The spread of a voxel: that of a point at arm's length, metres. A voxel of many points is no narrower a tube.
const VOXEL_SPREAD_M: f32 = 0.003;
/// Looks through a place this far off the surface say that nothing is there, metres.
const CARVE_M: f64 = 0.03;

/// A voxel's running sums, weighted.
#[derive(Clone, Copy)]
struct Cell {
    weight: f32,
    /// From the voxel's low corner, metres.
    sum: Vector3<f32>,
    /// World frame.
    normal: Vector3<f32>,
    colour: Vector3<f32>,
    views: u16,
}

impl Cell {
    const EMPTY: Cell = Cell {
        weight: 0.0,
        sum: Vector3::new(0.0, 0.0, 0.0),
        normal: Vector3::new(0.0, 0.0, 0.0),
        colour: Vector3::new(0.0, 0.0, 0.0),
        views: 1,
    };
}

/// Occupied voxels by ascending key.
#[derive(Default)]
struct Cells {
    keys: Vec<u64>,
    cells: Vec<Cell>,
    returns: usize,
}

pub(super) struct Fused {
    pub cloud: Cloud,
    pub views_per_point: Vec<u16>,
    pub returns: usize,
    pub voxel_m: f64,
}

/// Fuses the used views at their corrected poses.
pub(super) fn fuse(
    views: &[View],
    used: &[bool],
    poses: &[Isometry3<f64>],
    seen: &Visibility,
    options: &MergeOptions,
) -> Fused {
    let _span = tracing::debug_span!("fuse", views = views.len()).entered();
    let of: Vec<(&View, &Isometry3<f64>)> =
        views.iter().zip(poses).zip(used).filter(|(_, used)| **used).map(|(of, _)| of).collect();
    let facings: Vec<Facing> = of.par_iter().map(|(view, pose)| facing(view, pose, options)).collect();
    let coloured = of.iter().all(|(view, _)| view.cloud.colours.is_some());
    let mut voxel_m = options.fuse_voxel_m;
    loop {
        let lattice = lattice(&of, voxel_m, options);
        let cells = gather(&of, &facings, &lattice, options);
        if cells.keys.len() > options.most_points {
            // Surfaces: points fall with the square of the side.
            voxel_m =
                lattice.voxel_m * (cells.keys.len() as f64 / options.most_points as f64).sqrt().max(1.2);
            continue;
        }
        return settle(&cells, &lattice, seen, coloured);
    }
}

/// The lattice over all that is in range of a camera.
fn lattice(of: &[(&View, &Isometry3<f64>)], voxel_m: f64, options: &MergeOptions) -> Lattice {
    let mut places = of.iter().map(|(_, pose)| Point3::from(pose.translation.vector));
    let first = places.next().unwrap_or_else(Point3::origin);
    let (low, high) = places.fold((first, first), |(low, high), p| (low.inf(&p), high.sup(&p)));
    let reach = Vector3::repeat(options.range_m + voxel_m);
    Lattice::over(&(low - reach), &(high + reach), voxel_m)
}

/// Views whose cells are gathered one after another; of more the halves are gathered apart.
const TOGETHER: usize = 2;

/// The cells of all views. Halves are gathered apart and united, so that few lists of cells are alive at a time.
fn gather(
    of: &[(&View, &Isometry3<f64>)],
    facings: &[Facing],
    lattice: &Lattice,
    options: &MergeOptions,
) -> Cells {
    if of.len() > TOGETHER {
        let middle = of.len() / 2;
        let (a, b) = rayon::join(
            || gather(&of[..middle], &facings[..middle], lattice, options),
            || gather(&of[middle..], &facings[middle..], lattice, options),
        );
        return unite(&a, &b);
    }
    let mut kept = Kept::default();
    let views = of.iter().zip(facings).map(|((view, pose), facing)| {
        kept.take(view, pose, facing, lattice, options);
        of_view(view, pose, facing, &kept)
    });
    views.reduce(|a, b| unite(&a, &b)).unwrap_or_default()
}

/// The cells of two sets of views together.
fn unite(a: &Cells, b: &Cells) -> Cells {
    let most = a.keys.len() + b.keys.len();
    let mut both = Cells {
        keys: Vec::with_capacity(most),
        cells: Vec::with_capacity(most),
        returns: a.returns + b.returns,
    };
    let (mut i, mut j) = (0, 0);
    while i < a.keys.len() && j < b.keys.len() {
        let (p, q) = (a.keys[i], b.keys[j]);
        both.keys.push(p.min(q));
        both.cells.push(match p.cmp(&q) {
            std::cmp::Ordering::Less => a.cells[i],
            std::cmp::Ordering::Greater => b.cells[j],
            std::cmp::Ordering::Equal => {
                let (c, d) = (&a.cells[i], &b.cells[j]);
                Cell {
                    weight: c.weight + d.weight,
                    sum: c.sum + d.sum,
                    normal: c.normal + d.normal,
                    colour: c.colour + d.colour,
                    views: c.views.saturating_add(d.views),
                }
            }
        });
        i += usize::from(p <= q);
        j += usize::from(q <= p);
    }
    both.keys.extend_from_slice(&a.keys[i..]);
    both.cells.extend_from_slice(&a.cells[i..]);
    both.keys.extend_from_slice(&b.keys[j..]);
    both.cells.extend_from_slice(&b.cells[j..]);
    both
}

/// A return that is kept.
struct Return {
    /// In its voxel, metres from the low corner.
    at: [f32; 3],
    weight: f32,
    pixel: u32,
    /// Where its normal stands.
    facing: u32,
}

/// The returns of a view that are kept, sorted by voxel. The room that one view took is used again by the next.
#[derive(Default)]
struct Kept {
    returns: Vec<Return>,
    /// Key of the voxel and number of each return.
    entries: Vec<(u64, u32)>,
    spare: Vec<(u64, u32)>,
}

/// The cells of one view.
fn of_view(view: &View, pose: &Isometry3<f64>, facing: &Facing, kept: &Kept) -> Cells {
    let turn = pose.rotation.to_rotation_matrix().cast::<f32>();
    let colours = view.cloud.colours.as_deref();
    let voxels = kept.entries.chunk_by(|a, b| a.0 == b.0).count();
    let mut cells = Cells {
        keys: Vec::with_capacity(voxels),
        cells: Vec::with_capacity(voxels),
        returns: kept.returns.len(),
    };
    for same in kept.entries.chunk_by(|a, b| a.0 == b.0) {
        let mut cell = Cell::EMPTY;
        for &(_, number) in same {
            let r = &kept.returns[number as usize];
            cell.weight += r.weight;
            cell.sum += Vector3::from(r.at) * r.weight;
            if let Some(n) = facing.normals.get(r.facing as usize).filter(|n| n.x.is_finite()) {
                cell.normal += n * r.weight;
            }
            if let Some(c) = colours.and_then(|c| c.get(r.pixel as usize)) {
                cell.colour += Vector3::from(c.map(f32::from)) * r.weight;
            }
        }
        cell.normal = turn * cell.normal;
        cells.keys.push(same[0].0);
        cells.cells.push(cell);
    }
    cells
}

impl Kept {
    /// Keeps the returns of a view that are in range and band and do not fly.
    fn take(
        &mut self,
        view: &View,
        pose: &Isometry3<f64>,
        facing: &Facing,
        lattice: &Lattice,
        options: &MergeOptions,
    ) {
        let turn = pose.rotation.to_rotation_matrix();
        let shift = pose.translation.vector;
        let points = &view.cloud.points;
        let width = view.cloud.grid.map_or(points.len(), |g| g.width).max(1);
        let Kept { returns, entries, spare } = self;
        returns.clear();
        entries.clear();
        returns.reserve(points.len());
        entries.reserve(points.len());
        for (row, line) in points.chunks(width).enumerate() {
            for (column, p) in line.iter().enumerate() {
                if !in_range(p, options) {
                    continue;
                }
                let at = turn * p.coords.cast::<f64>() + shift;
                if !in_band(&at, options, 0.0) || is_flying(&view.cloud, row, column) {
                    continue;
                }
                let sigma = range_sigma_m(f64::from(p.z.abs().max(p.coords.norm() * 0.5)));
                let (key, rest) = lattice.locate(&at);
                entries.push((key, returns.len() as u32));
                returns.push(Return {
                    at: rest,
                    weight: (1.0 / (sigma * sigma)) as f32,
                    pixel: (row * width + column) as u32,
                    facing: facing.index(row, column),
                });
            }
        }
        lattice.sort(entries, spare);
    }
}

/// Normals of a view's points, camera frame; of an organised cloud coarser than its pixels.
struct Facing {
    normals: Vec<Vector3<f32>>,
    stride: usize,
    /// Columns and rows of the normals; none if there is one a point.
    coarse: Option<Grid>,
}

impl Facing {
    #[inline(always)]
    fn index(&self, row: usize, column: usize) -> u32 {
        let at = match self.coarse {
            Some(Grid { width, height }) => {
                (row / self.stride).min(height.saturating_sub(1)) * width
                    + (column / self.stride).min(width.saturating_sub(1))
            }
            None => column,
        };
        at as u32
    }
}

fn facing(view: &View, pose: &Isometry3<f64>, options: &MergeOptions) -> Facing {
    let own = || view.cloud.normals.clone().unwrap_or_default();
    let Some((coarse, grid)) = coarser(view, pose, options, 0.05).zip(view.cloud.grid) else {
        return Facing { normals: own(), stride: 1, coarse: None };
    };
    let wide = normals::OrganisedOptions { reach: 1, depth_step_share: 0.02, base_m: 0.006, least: 5 };
    let size = coarse.grid.unwrap_or(grid);
    let stride = (grid.width / size.width.max(1)).max(1);
    match normals::organised(&coarse, &wide) {
        Some(found) => Facing { normals: found.normals, stride, coarse: Some(size) },
        None => Facing { normals: Vec::new(), stride, coarse: Some(size) },
    }
}

/// True if the pixel hangs in the air: before one neighbour and behind the opposite one.
#[inline(always)]
fn is_flying(cloud: &Cloud, row: usize, column: usize) -> bool {
    let Some(Grid { width, height }) = cloud.grid else { return false };
    let i = row * width + column;
    let depth = cloud.points[i].z;
    let step = FLYING_SHARE * depth;
    let beyond = |j: usize| cloud.points[j].z - depth;
    let between = |a: f32, b: f32| (a > step && b < -step) || (a < -step && b > step);
    let across = column > 0 && column + 1 < width && between(beyond(i - 1), beyond(i + 1));
    let down = row > 0 && row + 1 < height && between(beyond(i - width), beyond(i + width));
    across || down
}

/// A voxel as its neighbours see it.
#[derive(Clone, Copy)]
struct Mean {
    /// Metres from the lattice's lowest corner.
    at: Vector3<f32>,
    weight: f32,
    /// Unit normal, or zero if there is none.
    normal: Vector3<f32>,
}

/// Position, normal, colour and number of views of a fused point.
type Settled = (Point3<f32>, Vector3<f32>, [u8; 3], u16);

/// Moves the voxels onto their common surface and drops what was looked through.
fn settle(cells: &Cells, lattice: &Lattice, seen: &Visibility, coloured: bool) -> Fused {
    /// Voxels that one thread settles in a row, and such rows at a time: what they fill is used again.
    const ROW: usize = 1 << 12;
    const ROWS: usize = 32;
    let mean = |(&key, cell): (&u64, &Cell)| Mean {
        at: Vector3::from(lattice.corner_m(key)) + cell.sum / cell.weight,
        weight: cell.weight,
        normal: cell.normal.try_normalize(1e-6).unwrap_or_else(Vector3::zeros),
    };
    let means: Vec<Mean> = cells.keys.par_iter().zip(&cells.cells).map(mean).collect();
    let origin = lattice.origin_m();
    let settle_row = |row: usize, kept: &mut Vec<Settled>| {
        let first = row * ROW;
        let mut around = Around::from(lattice, &cells.keys, first);
        kept.clear();
        for (i, key) in (first..).zip(cells.keys[first..].iter().take(ROW)) {
            let cell = &cells.cells[i];
            let at = Point3::from(origin + smoothed(*key, &means[i], &means, &mut around).cast::<f64>());
            // One view's word against another's look through the place.
            let through = cell.views < 2 && seen.maps.len() > 1 && seen.looked_through(&at, CARVE_M);
            let (at, normal) = (at.cast::<f32>(), means[i].normal);
            if through || !is_finite(&at) {
                continue;
            }
            let normal = if normal == Vector3::zeros() { Vector3::repeat(f32::NAN) } else { normal };
            let colour = if coloured {
                (cell.colour / cell.weight).map(|c| c.round() as u8)
            } else {
                Vector3::zeros()
            };
            kept.push((at, normal, colour.into(), cell.views));
        }
    };
    let most = cells.keys.len();
    let mut fused = Fused {
        cloud: Cloud::from_points(Vec::with_capacity(most)),
        views_per_point: Vec::with_capacity(most),
        returns: cells.returns,
        voxel_m: lattice.voxel_m,
    };
    let mut normals = Vec::with_capacity(most);
    let mut colours = coloured.then(|| Vec::with_capacity(most));
    let mut rows: Vec<Vec<Settled>> = vec![Vec::new(); ROWS];
    for first in (0..most.div_ceil(ROW)).step_by(ROWS) {
        let rows = &mut rows[..ROWS.min(most.div_ceil(ROW) - first)];
        rows.par_iter_mut().enumerate().for_each(|(row, kept)| settle_row(first + row, kept));
        for row in rows.iter() {
            fused.cloud.points.extend(row.iter().map(|settled| settled.0));
            normals.extend(row.iter().map(|settled| settled.1));
            fused.views_per_point.extend(row.iter().map(|settled| settled.3));
            if let Some(colours) = &mut colours {
                colours.extend(row.iter().map(|settled| settled.2));
            }
        }
    }
    fused.cloud.normals = Some(normals);
    fused.cloud.colours = colours;
    fused
}

/// The voxel's mean, moved along its normal onto the mean of the like-facing voxels around it.
#[inline(always)]
fn smoothed(key: u64, own: &Mean, means: &[Mean], around: &mut Around) -> Vector3<f32> {
    let tube = TUBE_SPREADS * VOXEL_SPREAD_M;
    let (mut weight, mut offset) = (0.0, 0.0);
    around.visit(key, |i| {
        let near = &means[i];
        let gap = own.normal.dot(&(near.at - own.at));
        if gap.abs() < tube && near.normal.dot(&own.normal) > 0.7 {
            weight += near.weight;
            offset += near.weight * gap;
        }
    });
    if weight > 0.0 { own.at + own.normal * (offset / weight) } else { own.at }
}
