//! Visibility of points: free, on a surface, hidden, or never observed.
//!
//! A recogniser may count something as absent (a handle, a lid) only where a camera looked *through* its place.

use crate::camera::Intrinsics;
use crate::cloud::{Cloud, is_finite};
use crate::quantile::quantile;
use crate::spread::tangents;
use crate::view::View;
use nalgebra::{Isometry3, Matrix3, Point3, Rotation3, UnitQuaternion, Vector3};
use std::sync::Arc;

/// State of a point in one camera's view, or the best state in several views.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Seen {
    /// Outside all views, or at a pixel without a return.
    Never,
    /// Behind a measured surface.
    Hidden,
    /// On a measured surface.
    Surface,
    /// In free space that a camera looked through.
    Free,
}

/// Depth image of one view with the (corrected) camera pose.
#[derive(Clone, Debug)]
pub struct DepthMap {
    /// Camera intrinsics; the image has their size.
    pub intrinsics: Intrinsics,
    /// Transformation from the world frame to the camera's optical frame.
    pub camera_from_world: Isometry3<f64>,
    /// Depths along the optical axis, metres, row by row; NaN for missing returns.
    pub depths_m: Arc<[f32]>,
    /// Red, green and blue of the same pixels; `None` without colours.
    pub colours: Option<Arc<[[u8; 3]]>>,
}

/// Depth maps of all views of a scene.
#[derive(Clone, Debug, Default)]
pub struct Visibility {
    /// One depth map per view.
    pub maps: Vec<DepthMap>,
    /// True if the maps are original camera images, so that their rows show how the cameras are held.
    pub held: bool,
}

impl DepthMap {
    /// Creates the depth map of a view; `None` if its cloud has neither a grid nor a known camera.
    ///
    /// An organised cloud without intrinsics gets them by least squares from its own pixels.
    pub fn from_view(view: &View, world_from_camera: &Isometry3<f64>) -> Option<DepthMap> {
        let intrinsics = match (view.cloud.grid, view.intrinsics) {
            (Some(grid), Some(known)) if (known.width, known.height) == (grid.width, grid.height) => known,
            (Some(_), _) => estimate_intrinsics(&view.cloud)?,
            (None, Some(known)) => {
                return Some(Self::project(&view.cloud, &Isometry3::identity(), known, world_from_camera));
            }
            (None, None) => return None,
        };
        let depths_m = view.cloud.points.iter().map(|p| if is_finite(p) { p.z } else { f32::NAN }).collect();
        let colours = view.cloud.colours.as_deref().map(Arc::from);
        Some(DepthMap { intrinsics, camera_from_world: world_from_camera.inverse(), depths_m, colours })
    }

    /// Creates a depth map by projecting a cloud (minimum depth per pixel); pixels without points are missing returns.
    fn project(
        cloud: &Cloud,
        camera_from_cloud: &Isometry3<f64>,
        intrinsics: Intrinsics,
        world_from_camera: &Isometry3<f64>,
    ) -> DepthMap {
        let mut depths_m = vec![f32::NAN; intrinsics.width * intrinsics.height];
        let mut colours = cloud.colours.as_ref().map(|_| vec![[0; 3]; depths_m.len()]);
        for (n, p) in cloud.points.iter().enumerate().filter(|(_, p)| is_finite(p)) {
            let q = camera_from_cloud * p.cast::<f64>();
            let Some(pixel) = intrinsics.project(&q).and_then(|(u, v)| intrinsics.pixel(u, v)) else {
                continue;
            };
            let depth = &mut depths_m[pixel];
            if depth.is_nan() || *depth > q.z as f32 {
                *depth = q.z as f32;
                if let Some((shown, all)) = colours.as_mut().zip(cloud.colours.as_ref()) {
                    shown[pixel] = all[n];
                }
            }
        }
        let (camera_from_world, depths_m) = (world_from_camera.inverse(), depths_m.into());
        DepthMap { intrinsics, camera_from_world, depths_m, colours: colours.map(Arc::from) }
    }

    /// Position of the camera in the world, metres.
    pub fn viewpoint(&self) -> Point3<f64> {
        Point3::from(self.camera_from_world.inverse().translation.vector)
    }

    /// State of a world point in this camera's view. A point within `tolerance_m` of the measured surface counts as on
    /// the surface.
    ///
    /// A point is free only if every return in the 3×3 pixels around lies beyond it: a depth edge is no proof.
    pub fn look(&self, p: &Point3<f64>, tolerance_m: f64) -> Seen {
        self.look_from(&(self.camera_from_world * p), tolerance_m)
    }

    /// State of a point in the camera's optical frame, as of [`DepthMap::look`].
    pub(crate) fn look_from(&self, q: &Point3<f64>, tolerance_m: f64) -> Seen {
        let Some((u, v)) = self.intrinsics.project(q) else { return Seen::Never };
        let Some(middle) = self.intrinsics.pixel(u, v) else { return Seen::Never };
        let nearest = f64::from(self.nearest_around(middle));
        if nearest == f64::INFINITY {
            return Seen::Never;
        }
        if nearest > q.z + tolerance_m {
            return Seen::Free;
        }
        let here = f64::from(self.depths_m[middle]);
        match (here - q.z).abs() <= tolerance_m || (nearest - q.z).abs() <= tolerance_m {
            true => Seen::Surface,
            false => Seen::Hidden,
        }
    }

    /// Minimum depth in the 3×3 pixels around a pixel, metres; infinite without returns.
    pub(crate) fn nearest_around(&self, pixel: usize) -> f32 {
        let (width, height) = (self.intrinsics.width, self.intrinsics.height);
        let (column, row) = (pixel % width, pixel / width);
        let columns = column.saturating_sub(1)..(column + 2).min(width);
        let mut nearest = f32::INFINITY;
        for row in row.saturating_sub(1)..(row + 2).min(height) {
            for &depth in &self.depths_m[row * width + columns.start..row * width + columns.end] {
                nearest = if depth < nearest { depth } else { nearest };
            }
        }
        nearest
    }
}

/// Depth map prepared for queries about many points.
pub struct Gaze<'a> {
    map: &'a DepthMap,
    turn: Matrix3<f32>,
    shift: Vector3<f32>,
    focal: [f32; 2],
    centre: [f32; 2],
}

impl Gaze<'_> {
    fn of(map: &DepthMap) -> Gaze<'_> {
        let Intrinsics { fx, fy, cx, cy, .. } = map.intrinsics;
        Gaze {
            map,
            turn: map.camera_from_world.rotation.to_rotation_matrix().into_inner().cast(),
            shift: map.camera_from_world.translation.vector.cast(),
            focal: [fx, fy].map(|f| f as f32),
            centre: [cx, cy].map(|c| c as f32 + 0.5),
        }
    }

    /// Sets `through` for each world point that the camera looked through: [`DepthMap::look`] gives [`Seen::Free`], and
    /// the point's own pixel has a return. Fast if most points are not.
    pub fn pass(&self, points: &[Point3<f32>], tolerance_m: f64, through: &mut [bool]) {
        const LANES: usize = 16;
        /// Column mark of a point outside the image. From: mark.
        const NONE: f32 = -1.0;
        let Intrinsics { width, height, .. } = self.map.intrinsics;
        let (right, bottom) = (width as f32, height as f32);
        for (points, through) in points.chunks(LANES).zip(through.chunks_mut(LANES)) {
            let mut places = [[NONE, 0.0]; LANES];
            let mut depths_m = [0.0; LANES];
            for ((p, place), depth_m) in points.iter().zip(&mut places).zip(&mut depths_m) {
                let q = self.turn * p.coords + self.shift;
                let per = 1.0 / q.z;
                let (u, v) =
                    (self.focal[0] * q.x * per + self.centre[0], self.focal[1] * q.y * per + self.centre[1]);
                let inside = q.z > 0.0 && u >= 0.0 && v >= 0.0 && u < right && v < bottom;
                *place = [if inside { u } else { NONE }, v];
                *depth_m = q.z + tolerance_m as f32;
            }
            for (((p, through), [u, v]), depth_m) in points.iter().zip(through).zip(places).zip(depths_m) {
                if u < 0.0 {
                    continue;
                }
                let pixel = v as u32 as usize * width + u as u32 as usize;
                // The very pixel that the point falls on may show already that it was not.
                let beyond = self.map.depths_m.get(pixel).is_some_and(|seen| *seen > depth_m);
                *through |= beyond && self.map.look(&p.cast(), tolerance_m) == Seen::Free;
            }
        }
    }
}

impl Visibility {
    /// Depth maps of views at their stated poses; views with neither camera nor grid are left out.
    pub fn from_views(views: &[View]) -> Visibility {
        let map = |v: &View| DepthMap::from_view(v, &v.world_from_camera);
        Visibility { maps: views.iter().filter_map(map).collect(), held: true }
    }

    /// Depth maps of a bare cloud (world frame) seen from `viewpoints`, by projection onto a virtual camera at each;
    /// how real cameras were held is unknown.
    pub fn from_viewpoints(cloud: &Cloud, viewpoints: &[Point3<f64>]) -> Visibility {
        Visibility { maps: viewpoints.iter().filter_map(|v| virtual_map(cloud, v)).collect(), held: false }
    }

    /// Best state of a world point in all views: free outweighs surface, surface hidden, and hidden never observed.
    pub fn look(&self, p: &Point3<f64>, tolerance_m: f64) -> Seen {
        let mut best = Seen::Never;
        for map in &self.maps {
            best = best.max(map.look(p, tolerance_m));
            if best == Seen::Free {
                break;
            }
        }
        best
    }

    /// Depth maps, each prepared for queries about many points.
    pub fn gazes(&self) -> Vec<Gaze<'_>> {
        self.maps.iter().map(Gaze::of).collect()
    }

    /// Positions of the cameras in the world, metres.
    pub fn viewpoints(&self) -> Vec<Point3<f64>> {
        self.maps.iter().map(DepthMap::viewpoint).collect()
    }
}

/// Depth map of a virtual camera at `viewpoint`, centred on the median of the cloud and wide enough for nearly all of
/// it, so that stray returns have no effect. The camera's axes depend on the cloud alone, not on the frame. `None`
/// without points in front of it.
fn virtual_map(cloud: &Cloud, viewpoint: &Point3<f64>) -> Option<DepthMap> {
    const SIDE: usize = 320;
    /// Share of the points that lie in view.
    const IN_VIEW: f64 = 0.998;
    /// Maximum half opening angle, as a tangent.
    const WIDEST: f64 = 2.0;
    let finite = || cloud.points.iter().filter(|p| is_finite(p)).map(|p| p.cast::<f64>() - viewpoint);
    let rays: Vec<Vector3<f64>> = finite().filter_map(|ray| ray.try_normalize(1e-9)).collect();
    let median = |k: usize| quantile(&mut rays.iter().map(|ray| ray[k]).collect::<Vec<f64>>(), 0.5);
    let forward =
        (!rays.is_empty()).then(|| Vector3::new(median(0), median(1), median(2)))?.try_normalize(1e-9)?;
    let (across, along) = tangents(&forward);
    let slopes = |right: &Vector3<f64>, down: &Vector3<f64>| -> Vec<[f64; 2]> {
        let before = rays.iter().map(|ray| (ray, ray.dot(&forward))).filter(|(_, z)| *z > 0.05);
        before.map(|(ray, z)| [ray.dot(right) / z, ray.dot(down) / z]).collect()
    };
    let [xx, xy, yy] = slopes(&across, &along)
        .iter()
        .map(|s| s.map(|c| c.clamp(-WIDEST, WIDEST)))
        .fold([0.0; 3], |m, [x, y]| [m[0] + x * x, m[1] + x * y, m[2] + y * y]);
    let turn = 0.5 * (2.0 * xy).atan2(xx - yy);
    let right = across * turn.cos() + along * turn.sin();
    let down = forward.cross(&right);
    let mut reaches: Vec<f64> = slopes(&right, &down).iter().map(|[x, y]| x.abs().max(y.abs())).collect();
    if reaches.is_empty() {
        return None;
    }
    let reach = quantile(&mut reaches, IN_VIEW);
    let world_from_camera = Isometry3::from_parts(
        viewpoint.coords.into(),
        UnitQuaternion::from_rotation_matrix(&Rotation3::from_basis_unchecked(&[right, down, forward])),
    );
    let middle = 0.5 * (SIDE - 1) as f64;
    let focal = middle / reach.clamp(0.05, WIDEST);
    let intrinsics = Intrinsics { width: SIDE, height: SIDE, fx: focal, fy: focal, cx: middle, cy: middle };
    Some(DepthMap::project(cloud, &world_from_camera.inverse(), intrinsics, &world_from_camera))
}

/// Estimates the pinhole camera of an organised cloud in its optical frame: least squares of `u·z = f·x + c·z` over the
/// pixels.
///
/// `None` if there is no grid or the pixels do not determine a camera.
pub fn estimate_intrinsics(cloud: &Cloud) -> Option<Intrinsics> {
    let grid = cloud.grid?;
    let mut x = Matrix3::<f64>::zeros();
    let mut y = Matrix3::<f64>::zeros();
    for (i, p) in cloud.points.iter().enumerate().step_by(7) {
        if is_finite(p) && p.z > 0.0 {
            let (u, v) = ((i % grid.width) as f64, (i / grid.width) as f64);
            let row = |a: f32, pixel: f64| Vector3::new(f64::from(a / p.z), 1.0, pixel);
            let (rx, ry) = (row(p.x, u), row(p.y, v));
            x += rx * rx.transpose();
            y += ry * ry.transpose();
        }
    }
    let line = |m: &Matrix3<f64>| {
        let solved = m.fixed_view::<2, 2>(0, 0).into_owned().try_inverse()?;
        let answer = solved * m.fixed_view::<2, 1>(0, 2);
        (answer[0] > 1.0 && answer[0].is_finite()).then_some((answer[0], answer[1]))
    };
    let ((fx, cx), (fy, cy)) = (line(&x)?, line(&y)?);
    Some(Intrinsics { width: grid.width, height: grid.height, fx, fy, cx, cy })
}
