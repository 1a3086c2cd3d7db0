//! Step 5: fusion into one cloud, sharper than any view and of bounded size.
//!
//! Returns at depth edges that hang between two surfaces are dropped. The others are averaged in
//! voxels, weighted by their inverse variances. Returns on a level plane are averaged in columns
//! perpendicular to the plane instead, so that the table becomes one sheet.

use super::align::Aligned;
use super::depth_samples::{DepthSample, Looked};
use super::options::MergeOptions;
use super::parts::Plane;
use super::prepare::Prepared;
use super::settle::Before;
use super::voxel_blocks::{Grid, VoxelBlocks};
use crate::cloud::Cloud;
use crate::pool;
use crate::view::View;
use crate::visibility::Visibility;
use nalgebra::{Isometry3, Matrix3, Point3, UnitQuaternion, Vector3};
use std::sync::Arc;

/// State of a voxel: running weighted sums while gathering, then means.
#[derive(Clone, Copy)]
pub(super) struct Cell {
    /// Sum of the weights of the returns, per square metre.
    pub weight: f32,
    /// Position in voxels from the grid's lowest corner: weighted sum, or mean.
    pub at: Vector3<f32>,
    /// Normal: weighted sum, or mean of unit length, or zero.
    pub normal: Vector3<f32>,
    /// Number of views that measured the voxel.
    pub views: u16,
    /// Number of the last view that measured the voxel.
    last: u16,
}

impl Cell {
    /// Cell without a measurement. From: mark.
    const EMPTY: Cell = Cell {
        weight: 0.0,
        at: Vector3::new(0.0, 0.0, 0.0),
        normal: Vector3::new(0.0, 0.0, 0.0),
        views: 0,
        last: u16::MAX,
    };

    #[inline(always)]
    fn add(&mut self, at: Vector3<f32>, normal: Vector3<f32>, weight: f32, view: u16) {
        self.weight += weight;
        self.at += at * weight;
        self.normal += normal * weight;
        self.views += u16::from(self.last != view);
        self.last = view;
    }

    pub fn mean(&self) -> Cell {
        /// Minimum length of a sum of normals; below it, they cancel out. From: rounding.
        const CANCELLED: f32 = 1e-6;
        let normal = self.normal.try_normalize(CANCELLED).unwrap_or_else(Vector3::zeros);
        Cell { at: self.at / self.weight, normal, ..*self }
    }
}

/// Occupied voxels, or columns on a plane.
pub(super) struct Gathered {
    pub grid: Grid,
    /// Axes of the grid: those of the world, or z along a plane's normal.
    pub axes_from_world: UnitQuaternion<f64>,
    /// True if the voxels are columns along z.
    pub flat: bool,
    pub blocks: VoxelBlocks<Cell>,
    /// Weighted colour sums of each cell, if coloured.
    pub colours: Vec<Vector3<f32>>,
    /// Number of returns in all cells.
    pub returns: usize,
    /// Result of the last settling.
    pub before: Before,
}

pub(super) struct Fused {
    pub cloud: Cloud,
    pub views_per_point: Vec<u16>,
    pub returns: usize,
    pub voxel_m: f64,
}

/// Gathers and settles the used views at their corrected poses, with a height sheet for each level
/// plane. `known`: gathered returns of the first views, which are reused; those of the other views
/// are appended.
pub(super) fn gather(
    views: &[View],
    prepared: &[Prepared],
    Aligned { used, poses, planes, .. }: &Aligned,
    seen: &Visibility,
    options: &MergeOptions,
    mut known: Option<&mut Vec<Arc<Looked>>>,
) -> Vec<Gathered> {
    /// Minimum growth factor of the voxels if there are too many. From: chosen.
    const GROWTH: f64 = 1.2;
    let _span = tracing::debug_span!("fuse", views = views.len()).entered();
    let used: Vec<usize> = (0..views.len()).filter(|&i| used[i]).collect();
    let cameras: Vec<Isometry3<f64>> = used.iter().map(|&i| poses[i]).collect();
    let coloured = used.iter().all(|&i| views[i].cloud.colours.is_some());
    let gazes = seen.gazes();
    let of_view = |number: usize, looked: Arc<Looked>| {
        let colours = views[used[number]].cloud.colours.as_deref().filter(|_| coloured);
        Taken { number: number as u16, looked, world_from_camera: cameras[number], colours }
    };
    let look = |number: usize| {
        let i = used[number];
        of_view(number, Arc::new(Looked::at(&views[i], &prepared[i], &poses[i], planes, options)))
    };
    let mut voxel_m = options.fuse_voxel_m;
    loop {
        let things = Gathered::over(&cameras, None, voxel_m, options);
        let sheets = planes.iter().map(|plane| Gathered::over(&cameras, Some(plane), voxel_m, options));
        let mut all: Vec<Gathered> = std::iter::once(things).chain(sheets).collect();
        let before = known.iter().flat_map(|known| known.iter()).take_while(|looked| looked.is_with(planes));
        let mut taken: Vec<Taken> =
            before.enumerate().map(|(number, looked)| of_view(number, Arc::clone(looked))).collect();
        if let Some(known) = &mut known {
            known.truncate(taken.len());
        }
        for number in taken.len()..used.len() {
            // The next view is looked through while those before it are added.
            let next = pool::join(|| add(&mut all, &taken, |_| ()), || look(number)).1;
            if let Some(known) = &mut known {
                known.push(Arc::clone(&next.looked));
            }
            taken = vec![next];
        }
        add(&mut all, &taken, |gathered| {
            gathered.sort();
            gathered.settle(&gazes);
        });
        let cells: usize = all.iter().map(|gathered| gathered.blocks.occupied).sum();
        if cells <= options.most_points {
            return all;
        }
        // Surfaces: points fall with the square of the side.
        voxel_m = all[0].grid.voxel_m * (cells as f64 / options.most_points as f64).sqrt().max(GROWTH);
    }
}

/// Adds a further view, of the given number, to the voxels gathered with `planes`, and settles the
/// touched cells. False, without changes, if the view lies outside the grid, lacks colours the grid
/// has, or makes it too large.
pub(super) fn gather_further(
    all: &mut [Gathered],
    number: usize,
    (view, prepared): (&View, &Prepared),
    pose: &Isometry3<f64>,
    planes: &[Plane],
    seen: &Visibility,
    options: &MergeOptions,
) -> bool {
    let cells: usize = all.iter().map(|gathered| gathered.blocks.occupied).sum();
    let coloured = !all[0].colours.is_empty();
    let Ok(number) = u16::try_from(number) else { return false };
    if cells + view.cloud.len() > options.most_points || coloured != view.cloud.colours.is_some() {
        return false;
    }
    let looked = Arc::new(Looked::at(view, prepared, pose, planes, options));
    let holds = |(grid, gathered): (usize, &Gathered)| {
        let scale = Scale::of(pose, gathered);
        looked.of_grid(grid).all(|returns| scale.holds(returns))
    };
    if !all.iter().enumerate().all(holds) {
        return false;
    }
    let colours = view.cloud.colours.as_deref();
    let gazes = seen.gazes();
    let taken = Taken { number, looked, world_from_camera: *pose, colours };
    add(all, &[taken], |gathered| gathered.settle(&gazes));
    true
}

/// Fused returns of a view, with their pose.
struct Taken<'a> {
    number: u16,
    looked: Arc<Looked>,
    world_from_camera: Isometry3<f64>,
    colours: Option<&'a [[u8; 3]]>,
}

/// Sorts the fused returns of some views into voxels and sheets, and calls `then` on each as soon
/// as it is complete.
fn add(all: &mut [Gathered], some: &[Taken], then: impl Fn(&mut Gathered) + Sync) {
    pool::for_each(
        all,
        1,
        || (),
        |(), grid, gathered| {
            for Taken { number, looked, world_from_camera, colours } in some {
                let scale = Scale::of(world_from_camera, gathered);
                looked.of_grid(grid).for_each(|returns| gathered.add(returns, &scale, *number, *colours));
            }
            then(gathered);
        },
    );
}

/// Transform from a camera's frame to voxels of a grid.
struct Scale {
    /// Rotation into the grid's axes times the number of voxels per metre.
    turn: Matrix3<f32>,
    /// Position of the camera, voxels from the grid's lowest corner.
    shift: Vector3<f32>,
    /// Rotation into the grid's axes, for directions.
    axes: Matrix3<f32>,
}

impl Scale {
    fn of(world_from_camera: &Isometry3<f64>, gathered: &Gathered) -> Scale {
        let Gathered { grid, axes_from_world, .. } = gathered;
        let axes = (axes_from_world * world_from_camera.rotation).to_rotation_matrix().into_inner();
        let shift = axes_from_world * world_from_camera.translation.vector - grid.origin_m;
        Scale { turn: (axes / grid.voxel_m).cast(), shift: (shift / grid.voxel_m).cast(), axes: axes.cast() }
    }

    /// True if no return lies below the lowest voxel or beyond the resolvable range.
    fn holds(&self, returns: &[DepthSample]) -> bool {
        let most = (1 << 19) as f32;
        returns.iter().all(|r| {
            let at = self.at(r);
            (at.min() > 1.0) & (at.max() < most)
        })
    }

    /// Position of a return, voxels from the grid's lowest corner.
    #[inline(always)]
    fn at(&self, of: &DepthSample) -> Vector3<f32> {
        self.turn * of.at + self.shift
    }

    /// Normal of a return in the grid's axes; zero if unknown.
    #[inline(always)]
    fn normal(&self, of: &DepthSample) -> Vector3<f32> {
        if of.normal.x.is_finite() { self.axes * of.normal } else { Vector3::zeros() }
    }
}

impl Gathered {
    /// Sorts the cells by block, and the colours with them.
    fn sort(&mut self) {
        let Some(former) = self.blocks.sort() else { return };
        if !self.colours.is_empty() {
            self.colours = former.iter().map(|&number| self.colours[number as usize]).collect();
        }
    }

    /// Empty grid over the range of all cameras: voxels, or columns on the plane `on`.
    fn over(
        cameras: &[Isometry3<f64>],
        on: Option<&Plane>,
        voxel_m: f64,
        options: &MergeOptions,
    ) -> Gathered {
        let axes_from_world = on.map_or_else(UnitQuaternion::identity, |(normal, _)| {
            let turn = UnitQuaternion::rotation_between(normal, &Vector3::z());
            turn.unwrap_or_else(|| UnitQuaternion::from_axis_angle(&Vector3::x_axis(), std::f64::consts::PI))
        });
        let places = cameras.iter().map(|camera| Point3::from(axes_from_world * camera.translation.vector));
        let around = places.map(|p| (p, p)).reduce(|a, b| (a.0.inf(&b.0), a.1.sup(&b.1)));
        let (low, high) = around.unwrap_or_default();
        let reach = Vector3::repeat(options.range_m + voxel_m);
        let grid = Grid::over(&(low - reach), &(high + reach), voxel_m);
        let flat = on.is_some();
        let (blocks, before) = (VoxelBlocks::new(flat, Cell::EMPTY), Before::default());
        Gathered { grid, axes_from_world, flat, blocks, colours: Vec::new(), returns: 0, before }
    }

    /// Adds returns, in separate passes for each dependent memory access, so that cache misses
    /// overlap.
    fn add(&mut self, returns: &[DepthSample], scale: &Scale, view: u16, colours: Option<&[[u8; 3]]>) {
        /// Number of returns that are added together. From: work.
        const SOME: usize = 512;
        let mut places = [(0, Vector3::zeros()); SOME];
        for returns in returns.chunks(SOME) {
            for (place, r) in places.iter_mut().zip(returns) {
                let at = scale.at(r);
                *place = (self.blocks.cell(at.as_ref()), at);
            }
            for (&(cell, at), r) in places.iter().zip(returns) {
                self.blocks.cells[cell as usize].add(at, scale.normal(r), r.weight, view);
            }
            if let Some(colours) = colours {
                self.colours.resize(self.blocks.cells.len(), Vector3::zeros());
                for (&(cell, _), r) in places.iter().zip(returns) {
                    if let Some(colour) = colours.get(r.pixel as usize) {
                        self.colours[cell as usize] += Vector3::from(colour.map(f32::from)) * r.weight;
                    }
                }
            }
        }
        self.returns += returns.len();
    }
}
