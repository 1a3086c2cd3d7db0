//! Ends of a surface in a camera's view, each between two rays of which one hits the surface and the other passes it.
//!
//! Depth noise moves a point along its ray; the point where the ray meets the plane of the surface is free of this
//! noise.

use crate::surface::Surface;
use crate::visibility::{DepthMap, Visibility};
use nalgebra::{Point3, Vector3};

/// Maximum height above the surface's plane of points on the surface, metres.
const ON_M: f64 = 0.012;
/// Depth below the plane from which points belong to a board's side, or are mixed pixels at a depth edge, metres.
const BELOW_M: f64 = 0.004;
/// Depth below the plane from which points belong to something behind or beneath the surface, metres.
const PAST_M: f64 = 0.02;
/// Maximum distance of an end beyond the hull of the observed surface, metres.
const HULL_MARGIN_M: f64 = 0.04;
/// Number of pixels to either side of an end that are checked.
const AROUND: usize = 4;
/// Minimum number of these pixels that must agree, as single pixels are noisy.
const CERTAIN: usize = 3;
/// Minimum extent of a surface before its end, metres; less is an intersection with something upright.
const DEEP_M: f64 = 0.04;
/// Minimum number of pixels that show a board's side at an end.
const SIDE: usize = 2;
/// Maximum number of pixels without a return that count as the end's own gap; a longer gap is the shadow of the
/// projector.
const LOST: usize = 3;
/// Minimum length of a gap without returns after the surface's last point that proves empty space, metres.
const NOTHING_M: f64 = 0.09;

/// End of a surface on a row or column of pixels.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Ending {
    /// Point where the last ray hits the surface, world frame, metres.
    pub on: Point3<f64>,
    /// Point where the first passing ray crosses the surface's plane, world frame, metres.
    pub past: Point3<f64>,
    /// Mean of the points observed on a board's side at the end, world frame, metres; `None` if there are too few.
    pub side: Option<Point3<f64>>,
    /// Position of the camera, world frame, metres.
    pub eye: Point3<f64>,
}

/// Ends of a surface in all views; occlusions and image borders are no ends.
pub fn endings(visibility: &Visibility, surface: &Surface) -> Vec<Ending> {
    let outline = surface.outline();
    let is_near = |ending: &Ending| outline.covers(&ending.on, HULL_MARGIN_M);
    visibility.maps.iter().flat_map(|map| Rays::of(map, surface).endings()).filter(is_near).collect()
}

/// Content of a pixel.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Shown {
    /// No return.
    Nothing,
    /// Point on the surface.
    On,
    /// Point just below the surface's plane.
    Low,
    /// Point farther below the surface's plane.
    Past,
    /// Any other point.
    Other,
}

/// Rays of a camera and plane of a surface, in the optical frame.
struct Rays<'a> {
    map: &'a DepthMap,
    world_from_camera: nalgebra::Isometry3<f64>,
    up: Vector3<f64>,
    /// Height of the camera above the plane, metres.
    eye_m: f64,
    shown: Vec<Shown>,
}

impl<'a> Rays<'a> {
    fn of(map: &'a DepthMap, surface: &Surface) -> Rays<'a> {
        let world_from_camera = map.camera_from_world.inverse();
        let up = map.camera_from_world.rotation * surface.up.into_inner();
        let eye_m = surface.height_m(&map.viewpoint());
        let mut rays = Rays { map, world_from_camera, up, eye_m, shown: Vec::new() };
        if eye_m > 0.0 {
            rays.shown = (0..map.depths_m.len()).map(|pixel| rays.shown(pixel)).collect();
        }
        rays
    }

    /// Ray of a pixel, as the point at unit depth.
    fn ray(&self, pixel: usize) -> Vector3<f64> {
        let width = self.map.intrinsics.width;
        self.map.intrinsics.unproject((pixel % width) as f64, (pixel / width) as f64, 1.0).coords
    }

    fn shown(&self, pixel: usize) -> Shown {
        let depth_m = f64::from(self.map.depths_m[pixel]);
        if depth_m.is_nan() {
            return Shown::Nothing;
        }
        let fall = self.up.dot(&self.ray(pixel));
        let height_m = self.eye_m + fall * depth_m;
        match height_m {
            _ if fall >= 0.0 || height_m > ON_M => Shown::Other,
            _ if height_m > -BELOW_M => Shown::On,
            _ if height_m > -PAST_M => Shown::Low,
            _ => Shown::Past,
        }
    }

    /// Point where a pixel's ray crosses the surface's plane, world frame, metres; `None` if the ray rises.
    fn through(&self, pixel: usize) -> Option<Point3<f64>> {
        let ray = self.ray(pixel);
        let fall = self.up.dot(&ray);
        (fall < 0.0).then(|| self.world_from_camera * Point3::from(ray * (-self.eye_m / fall)))
    }

    fn endings(&self) -> Vec<Ending> {
        let (width, height) = (self.map.intrinsics.width, self.map.intrinsics.height);
        let mut endings = Vec::new();
        if self.shown.is_empty() {
            return endings;
        }
        let mut both_ways = |line: &[usize]| {
            self.along(line, &mut endings);
            self.along(&line.iter().rev().copied().collect::<Vec<_>>(), &mut endings);
        };
        for row in 0..height {
            both_ways(&(row * width..(row + 1) * width).collect::<Vec<_>>());
        }
        for column in 0..width {
            both_ways(&(0..height).map(|row| row * width + column).collect::<Vec<_>>());
        }
        endings
    }

    /// Appends the ends of the surface along a line of pixels, in the direction of the line.
    fn along(&self, line: &[usize], endings: &mut Vec<Ending>) {
        let shown = |at: usize| self.shown[line[at]];
        let most = |what: Shown, range: std::ops::Range<usize>| {
            range.filter(|&at| shown(at) == what).count() >= CERTAIN
        };
        for last in AROUND - 1..line.len() {
            let next = (last + 1).min(line.len() - 1);
            if shown(last) != Shown::On || matches!(shown(next), Shown::On | Shown::Other) {
                continue;
            }
            if !most(Shown::On, last + 1 - AROUND..last + 1) || !self.is_deep(&line[..=last]) {
                continue;
            }
            let is_gap = |&at: &usize| matches!(shown(at), Shown::Nothing | Shown::Low);
            let gap = last + 1..(next..line.len()).find(|at| !is_gap(at)).unwrap_or(line.len());
            let is_past = match gap.end {
                end if end == line.len() => self.is_nothing(&line[gap.clone()]),
                end => shown(end) == Shown::Past && most(Shown::Past, end..(end + AROUND).min(line.len())),
            };
            if !is_past {
                continue;
            }
            let past = gap.end.min(last + LOST);
            let ends = self.through(line[last]).zip(self.through(line[past]));
            let Some((on, past)) = ends else { continue };
            let side = self.side(gap.filter(|&at| shown(at) == Shown::Low).map(|at| line[at]));
            let eye = Point3::from(self.world_from_camera.translation.vector);
            endings.push(Ending { on, past, side, eye });
        }
    }

    /// True if most pixels over the last [`DEEP_M`] of a line show the surface.
    fn is_deep(&self, line: &[usize]) -> bool {
        let Some(end) = line.last().and_then(|&pixel| self.through(pixel)) else { return false };
        let is_far = |&&pixel: &&usize| self.through(pixel).is_none_or(|p| (p - end).norm() > DEEP_M);
        let near = line.iter().rev().position(|pixel| is_far(&pixel));
        let on =
            |near: usize| line[line.len() - near..].iter().filter(|&&p| self.shown[p] == Shown::On).count();
        near.is_some_and(|near| AROUND * on(near) >= CERTAIN * near)
    }

    /// True if no pixel of a gap has a return, and the gap is long enough.
    fn is_nothing(&self, gap: &[usize]) -> bool {
        let ends =
            || Some((self.through(*gap.first()?)?, gap.iter().rev().find_map(|&pixel| self.through(pixel))?));
        gap.len() >= LOST
            && gap.iter().all(|&pixel| self.shown[pixel] == Shown::Nothing)
            && ends().is_some_and(|(from, to)| (to - from).norm() > NOTHING_M)
    }

    /// Mean point of some pixels, world frame, metres; `None` if they are fewer than [`SIDE`].
    fn side(&self, pixels: impl Iterator<Item = usize>) -> Option<Point3<f64>> {
        let at = |pixel: usize| self.ray(pixel) * f64::from(self.map.depths_m[pixel]);
        let (sum, count) = pixels.fold((Vector3::zeros(), 0), |(sum, n), pixel| (sum + at(pixel), n + 1));
        (count >= SIDE).then(|| self.world_from_camera * Point3::from(sum / count as f64))
    }
}
