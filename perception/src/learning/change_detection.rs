//! Change detection against the static structure of a place (section III; Ambruş et al.,
//! *Meta-Rooms*, 2014).

use super::error::LearningError;
use super::mask::Mask;
use crate::cloud::{Cloud, Grid, is_finite};
use crate::cluster;
use crate::neighbours::Neighbours;
use crate::noise::frontal_sigma_m;
use crate::pool;
use crate::register::{Method, Prepared, RegisterOptions, align};
use crate::view::View;
use crate::visibility::{DepthMap, Seen};
use crate::voxel;
use nalgebra::{Isometry3, Point3, Vector3};
use serde::{Deserialize, Serialize};

/// Options of change detection.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct NoticeOptions {
    /// Minimum distance from all points of the other cloud at which a point counts as changed, metres (δ of Eq. 1;
    /// paper: 1 cm). Three standard deviations of the camera are used instead where they are larger.
    pub delta_m: f64,
    /// Maximum range of changes, metres; farther points are background.
    pub range_m: f64,
    /// Voxel size of the static structure, metres.
    pub voxel_m: f64,
    /// Maximum distance between neighbouring points of one dynamic cluster, metres.
    pub cluster_step_m: f32,
    /// Minimum number of pixels of a dynamic cluster in its best view.
    pub least_pixels: usize,
    /// Maximum localisation error between two visits, metres.
    pub search_m: f32,
}

impl Default for NoticeOptions {
    fn default() -> Self {
        NoticeOptions {
            delta_m: 0.01,
            range_m: 3.0,
            voxel_m: 0.006,
            cluster_step_m: 0.02,
            least_pixels: 150,
            search_m: 0.1,
        }
    }
}

/// Static structure of a place, refined by each visit.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct MetaRoom {
    /// Points in the world frame, metres, one per voxel.
    pub cloud: Cloud,
    /// Number of visits so far.
    pub visits: usize,
    /// Options of change detection.
    pub options: NoticeOptions,
}

/// Object that appeared: a cluster of points in front of the former structure.
#[derive(Clone, Debug, PartialEq)]
pub struct Appeared {
    /// Points of the object, world frame, from all views of the visit.
    pub cloud: Cloud,
    /// Index of the view that shows most of the object, preferably not cut off by the image border; learning starts
    /// from it.
    pub view: usize,
    /// Pixels of the object in that view, row by row (O_0).
    pub mask: Vec<bool>,
    /// True if most of the object lies well in front of the former structure, even if the camera were rotated by its
    /// heading error; otherwise it may be an edge of static structure.
    pub apart: bool,
}

impl Appeared {
    /// Centre of the bounding box, world frame, metres.
    pub fn centre(&self) -> Point3<f64> {
        self.cloud.bounds().map_or(Point3::origin(), |(low, high)| nalgebra::center(&low, &high).cast())
    }
}

/// Result of comparing a visit with the static structure.
#[derive(Clone, Debug, PartialEq)]
pub struct Visit {
    /// Objects that appeared, the largest first.
    pub appeared: Vec<Appeared>,
    /// Objects that disappeared, the largest first, world frame.
    pub gone: Vec<Cloud>,
    /// Camera poses after the visit's views were aligned, as one rigid body, with the static structure.
    pub poses: Vec<Isometry3<f64>>,
    /// Number of points added to the static structure, formerly hidden or unseen.
    pub added: usize,
    /// Number of points removed from the static structure, which this visit looked through.
    pub removed: usize,
}

/// Half the side of the square that a static point covers when rendered, in voxels.
const COVER: f64 = 0.75;
/// Multiple of the tolerance beyond which a point is certainly seen through: two measurements of
/// one surface differ by less even at twice the stated noise.
const FAR: f64 = 2.5;
/// Factor on the heading error of localisation within which the camera may be rotated.
const TURNED: f64 = 2.0;
/// Maximum range of background points kept, metres; observing them proves that the space before them is free.
const BACKGROUND_M: f32 = 8.0;

impl MetaRoom {
    /// Creates the model from the first visit: everything is static until it changes. The views must be mutually
    /// consistent.
    ///
    /// # Errors
    /// If there is no view, one is no depth image, or an option is not positive.
    pub fn new(views: &[View], options: NoticeOptions) -> Result<MetaRoom, LearningError> {
        for (field, value) in [
            ("delta_m", options.delta_m),
            ("range_m", options.range_m),
            ("voxel_m", options.voxel_m),
            ("cluster_step_m", f64::from(options.cluster_step_m)),
            ("search_m", f64::from(options.search_m)),
        ] {
            LearningError::positive(field, value)?;
        }
        let poses: Vec<Isometry3<f64>> = views.iter().map(|v| v.world_from_camera).collect();
        maps(views, &poses)?;
        let cloud = voxel::downsample(&together(views, &poses), options.voxel_m as f32)?;
        Ok(MetaRoom { cloud, visits: 1, options })
    }

    /// Compares a visit with the static structure in both directions (Eq. 2) and updates the
    /// structure.
    ///
    /// # Errors
    /// As [`MetaRoom::new`].
    pub fn visit(&mut self, views: &[View]) -> Result<Visit, LearningError> {
        let _span = tracing::debug_span!("visit", views = views.len(), points = self.cloud.len()).entered();
        let poses = self.localised(views)?;
        let maps = maps(views, &poses)?;
        let tree = Neighbours::new(&self.cloud.points)?;
        let changes = pool::each(views.len(), 1, |n| self.compare(&views[n], &maps[n], &tree));
        let appeared = self.clusters(views, &poses, &changes)?;
        let (gone, removed) = self.remove(views, &maps)?;
        let added = self.add(views, &poses, &changes, &appeared)?;
        self.visits += 1;
        Ok(Visit { appeared, gone, poses, added, removed })
    }

    /// Poses of the views after rigid alignment with the static structure; the stated poses if that does not converge.
    /// Points beyond `range_m` are excluded: a distant wall, measured to decimetres, fits anywhere and outvotes points
    /// known to millimetres.
    fn localised(&self, views: &[View]) -> Result<Vec<Isometry3<f64>>, LearningError> {
        /// Pixel stride that thins views for alignment. Voxel grids are unsuitable: their points are attracted to those
        /// of another grid, which shifts views aligned by edges alone by centimetres.
        const EVERY: usize = 6;
        const ROOM_M: f32 = 0.01;
        const NEIGHBOURS: usize = 12;
        let stated: Vec<Isometry3<f64>> = views.iter().map(|v| v.world_from_camera).collect();
        let thinned: Vec<View> = views
            .iter()
            .map(|v| View { cloud: near(&every(&v.cloud, EVERY), self.options.range_m), ..v.clone() })
            .collect();
        let source = Prepared::with_normals(&together(&thinned, &stated).points, NEIGHBOURS)?;
        let target = Prepared::with_normals(&voxel::downsample(&self.cloud, ROOM_M)?.points, NEIGHBOURS)?;
        let (far_m, delta_m) = (self.options.search_m, self.options.delta_m);
        let mut by_world = Isometry3::identity();
        // From far to near, so that what has moved since has no say in the end.
        for (within_m, robust_m) in
            [(far_m, 5.0 * delta_m), (0.4 * far_m, 2.0 * delta_m), (3.0 * delta_m as f32, delta_m)]
        {
            let options = RegisterOptions {
                method: Method::Generalised,
                start_target_from_source: by_world,
                within_m,
                settle_m: 1e-4,
                settle_rad: 1e-4,
                robust_m: Some(robust_m),
                ..RegisterOptions::default()
            };
            let fit = align(&source, &target, &options)?;
            if !fit.converged() {
                return Ok(stated);
            }
            by_world = fit.target_from_source;
        }
        Ok(stated.iter().map(|pose| by_world * pose).collect())
    }

    /// Static structure rendered from a camera: minimum depth of each pixel, metres; infinite where there is none.
    fn seen_by(&self, map: &DepthMap) -> Vec<f32> {
        let camera = map.intrinsics;
        let mut depths_m = vec![f32::INFINITY; camera.width * camera.height];
        for p in &self.cloud.points {
            let q = map.camera_from_world * p.cast::<f64>();
            let Some((u, v)) = camera.project(&q) else { continue };
            let half = (COVER * self.options.voxel_m * camera.fx / q.z).min(20.0);
            let span = |at: f64, end: usize| {
                let clamp = |c: f64| c.round().clamp(0.0, end as f64) as usize;
                clamp(at - half)..clamp(at + half + 1.0)
            };
            for row in span(v, camera.height) {
                for column in span(u, camera.width) {
                    let depth = &mut depths_m[row * camera.width + column];
                    *depth = depth.min(q.z as f32);
                }
            }
        }
        depths_m
    }

    /// Differences of a view from the static structure.
    fn compare(&self, view: &View, map: &DepthMap, tree: &Neighbours) -> Change {
        let known = self.seen_by(map);
        let grid = Grid { width: map.intrinsics.width, height: map.intrinsics.height };
        let world_from_camera = map.camera_from_world.inverse();
        let (mut before, mut revealed, mut unknown) = (Mask::none(grid), Vec::new(), Vec::new());
        for (i, p) in view.cloud.points.iter().enumerate().take(known.len()) {
            if !is_finite(p) || p.z > BACKGROUND_M {
                continue;
            }
            let apart_m = self.tolerance_m(p.z);
            if (p.z - known[i]).abs() <= apart_m {
                continue;
            }
            let world: Point3<f32> = (world_from_camera * p.cast::<f64>()).cast();
            if tree.nearest(&world, apart_m).is_some() {
                continue;
            }
            if !known[i].is_finite() {
                unknown.push(i as u32);
            } else if p.z > known[i] {
                revealed.push(i as u32);
            } else if f64::from(p.z) <= self.options.range_m {
                before.set[i] = true;
            }
        }
        let before = before.opened(1);
        let depth_m = |i: usize| view.cloud.points[i].z;
        let reach = (TURNED * view.pose_sigma_rad * map.intrinsics.fx).ceil() as usize;
        // Before what is known by far, to either side as well.
        let is_apart = |i: &usize| {
            let (first, column) = (i - i % grid.width, i % grid.width);
            let far_m = FAR as f32 * self.tolerance_m(depth_m(*i));
            let beside = column.saturating_sub(reach)..(column + reach + 1).min(grid.width);
            beside.into_iter().all(|column| known[first + column] - depth_m(*i) > far_m)
        };
        let apart = Mask::of(grid, before.pixels().filter(is_apart));
        Change { before, apart, revealed, unknown }
    }

    fn tolerance_m(&self, z_m: f32) -> f32 {
        (self.options.delta_m as f32).max(3.0 * frontal_sigma_m(z_m))
    }

    /// Clusters of the appeared points of all views, each with its best view.
    fn clusters(
        &self,
        views: &[View],
        poses: &[Isometry3<f64>],
        changes: &[Change],
    ) -> Result<Vec<Appeared>, LearningError> {
        let mut origin: Vec<(usize, usize)> = Vec::new();
        let mut all = Cloud::default();
        for (k, ((view, pose), change)) in views.iter().zip(poses).zip(changes).enumerate() {
            let pixels: Vec<u32> = change.before.pixels().map(|i| i as u32).collect();
            origin.extend(pixels.iter().map(|&i| (k, i as usize)));
            all.append(&view.cloud.select(&pixels).transformed(pose));
        }
        let clusters =
            cluster::euclidean(&all.points, self.options.cluster_step_m, self.options.least_pixels)?;
        let is_apart = |point: &&u32| {
            let (k, pixel) = origin[**point as usize];
            changes[k].apart.set[pixel]
        };
        let of_cluster = |cluster: &Vec<u32>| {
            let mask_in = |k: usize| {
                let here = cluster.iter().map(|&i| origin[i as usize]).filter(|o| o.0 == k).map(|o| o.1);
                Mask::of(changes[k].before.grid, here)
            };
            let masks: Vec<Mask> = (0..views.len()).map(mask_in).collect();
            let score = |k: &usize| (!masks[*k].touches_border(), masks[*k].count(), usize::MAX - k);
            let view = (0..views.len()).max_by_key(score)?;
            let mask = &masks[view];
            (mask.count() >= self.options.least_pixels).then(|| Appeared {
                cloud: all.select(cluster),
                view,
                mask: mask.set.clone(),
                apart: 2 * cluster.iter().filter(is_apart).count() > cluster.len(),
            })
        };
        Ok(clusters.iter().filter_map(of_cluster).collect())
    }

    /// Removes the points that the visit looked through (D_2 without hidden ones); returns the vanished clusters and
    /// the number of removed points. A cluster vanished if the views look through most of it by a wide margin, even if
    /// the camera were rotated by its heading error, so that doubly measured walls and edges of standing objects do not
    /// count.
    fn remove(&mut self, views: &[View], maps: &[DepthMap]) -> Result<(Vec<Cloud>, usize), LearningError> {
        let through = |p: &Point3<f32>, times: f64, turned: f64| {
            maps.iter().zip(views).any(|(map, view)| {
                let q = map.camera_from_world * p.cast::<f64>();
                let near = q.z > 0.0 && q.z <= self.options.range_m;
                let tolerance_m = times * f64::from(self.tolerance_m(q.z as f32));
                let aside = Vector3::x() * (turned * view.pose_sigma_rad * q.z);
                let is_free = |way: f64| map.look_from(&(q + aside * way), tolerance_m) == Seen::Free;
                near && [0.0, -1.0, 1.0].into_iter().all(is_free)
            })
        };
        let gone: Vec<bool> = pool::map(&self.cloud.points, 1, |p| through(p, 1.0, 0.0));
        let pick = |wanted: bool| -> Vec<u32> {
            (0u32..).zip(&gone).filter(|(_, g)| **g == wanted).map(|(i, _)| i).collect()
        };
        let lost = self.cloud.select(&pick(true));
        let by_far: Vec<bool> = pool::map(&lost.points, 1, |p| through(p, FAR, TURNED));
        self.cloud = self.cloud.select(&pick(false));
        // Thinned to voxels, a cluster of so many pixels is about so many points.
        let least = self.options.least_pixels / 4;
        let clusters = cluster::euclidean(&lost.points, self.options.cluster_step_m, least)?;
        let went = |c: &&Vec<u32>| 2 * c.iter().filter(|&&i| by_far[i as usize]).count() > c.len();
        Ok((clusters.iter().filter(went).map(|c| lost.select(c)).collect(), lost.len()))
    }

    /// Adds formerly hidden and unseen points; returns their number. Unseen points connected with an appeared cluster
    /// are not added, as they may belong to it.
    fn add(
        &mut self,
        views: &[View],
        poses: &[Isometry3<f64>],
        changes: &[Change],
        appeared: &[Appeared],
    ) -> Result<usize, LearningError> {
        let (mut new, mut unknown) = (Cloud::default(), Cloud::default());
        for ((view, pose), change) in views.iter().zip(poses).zip(changes) {
            let of = |pixels: &[u32]| bare(&view.cloud.select(pixels)).transformed(pose);
            new.append(&of(&change.revealed));
            unknown.append(&of(&change.unknown));
        }
        let voxel_m = self.options.voxel_m as f32;
        let mut both = voxel::downsample(&unknown, voxel_m)?;
        let first_new = both.len();
        appeared.iter().for_each(|a| both.append(&bare(&a.cloud)));
        for cluster in cluster::euclidean(&both.points, self.options.cluster_step_m, 1)? {
            if cluster.last().is_none_or(|&last| (last as usize) < first_new) {
                new.append(&both.select(&cluster));
            }
        }
        let new = voxel::downsample(&new, voxel_m)?;
        self.cloud.append(&new);
        Ok(new.len())
    }
}

/// Differences of a view from the static structure.
struct Change {
    /// Pixels in front of the static structure.
    before: Mask,
    /// Pixels far in front of the static structure, even if the camera were rotated by its heading error.
    apart: Mask,
    /// Pixels behind the static structure, which may always have been there.
    revealed: Vec<u32>,
    /// Pixels where the static structure has no points.
    unknown: Vec<u32>,
}

fn maps(views: &[View], poses: &[Isometry3<f64>]) -> Result<Vec<DepthMap>, LearningError> {
    if views.is_empty() {
        return Err(LearningError::NoViews);
    }
    let map = |(k, (view, pose)): (usize, (&View, &Isometry3<f64>))| {
        let organised = view.cloud.grid.and_then(|_| DepthMap::from_view(view, pose));
        organised.ok_or(LearningError::NotOrganised { view: k })
    };
    views.iter().zip(poses).enumerate().map(map).collect()
}

/// Cloud of every `step`th pixel along rows and columns.
fn every(cloud: &Cloud, step: usize) -> Cloud {
    let width = cloud.grid.map_or(1, |grid| grid.width.max(1));
    let kept =
        (0..cloud.len()).filter(|i| (i % width).is_multiple_of(step) && (i / width).is_multiple_of(step));
    cloud.select(&kept.map(|i| i as u32).collect::<Vec<_>>())
}

/// Points within `range_m` of the camera.
fn near(cloud: &Cloud, range_m: f64) -> Cloud {
    cloud.filter(|p| is_finite(p) && f64::from(p.z) <= range_m)
}

/// Cloud of the points alone; the static structure has no colours and labels.
fn bare(cloud: &Cloud) -> Cloud {
    Cloud::from_points(cloud.points.clone())
}

/// Points of several views together, world frame, up to [`BACKGROUND_M`] from the camera.
fn together(views: &[View], poses: &[Isometry3<f64>]) -> Cloud {
    let mut all = Cloud::default();
    for (view, pose) in views.iter().zip(poses) {
        all.append(&bare(&near(&view.cloud, f64::from(BACKGROUND_M))).transformed(pose));
    }
    all
}
