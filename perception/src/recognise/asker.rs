//! Visibility around one body, per camera, with each camera registered at the body.

use crate::round::Round;
use crate::scale::APART_M;
use crate::surface::range_sigma_m;
use crate::visibility::{DepthMap, Seen, Visibility};
use nalgebra::{Isometry3, Matrix3, Point3, Translation3, Vector2, Vector3};

/// Minimum cosine between viewing directions of cameras that see the same side of an object.
/// From: chosen.
const SAME_SIDE: f64 = 0.9;
/// Number of a body's points at which each camera's alignment with the body is tested. From: chosen.
const WITNESSES: usize = 160;
/// Share of a body's points seen through by a camera above which the camera counts as misregistered
/// there, if better cameras see the body. From: chosen.
const ASTRAY: f64 = 0.5;

/// Tolerance on the distance to a measured surface when testing whether a body is in view, metres.
/// From: chosen.
pub(super) const IN_VIEW_M: f64 = 0.06;

/// Visibility queries at points of the surface's frame, over all cameras.
#[derive(Clone)]
pub struct Asker<'a> {
    pub views: Vec<Lying<'a>>,
    pub tolerance_m: f64,
}

/// Camera with its pose as registered at one body, in the surface's frame.
#[derive(Clone, Copy)]
pub struct Lying<'a> {
    pub map: &'a DepthMap,
    pub surface_from_camera: Isometry3<f64>,
    pub viewpoint: Point3<f64>,
    /// Rotation from the surface's to the camera's frame.
    turn: Matrix3<f64>,
    /// Translation from the surface's to the camera's frame, metres.
    shift: Vector3<f64>,
}

impl<'a> Lying<'a> {
    fn of(map: &'a DepthMap, surface_from_camera: Isometry3<f64>) -> Lying<'a> {
        let camera_from_surface = surface_from_camera.inverse();
        Lying {
            map,
            surface_from_camera,
            viewpoint: surface_from_camera.translation.vector.into(),
            turn: camera_from_surface.rotation.to_rotation_matrix().into_inner(),
            shift: camera_from_surface.translation.vector,
        }
    }

    /// Camera shifted by −`x` and −`y` along the axes of the surface, metres, with all points that
    /// it measured.
    pub fn moved(&self, [x, y]: [f64; 2]) -> Lying<'a> {
        Lying::of(self.map, Translation3::new(-x, -y, 0.0) * self.surface_from_camera)
    }

    /// Transforms a point from the surface's frame to the camera's.
    fn seen_at(&self, place: &Point3<f64>) -> Point3<f64> {
        (self.turn * place.coords + self.shift).into()
    }

    /// State of a point of the surface's frame in this view, as [`DepthMap::look`].
    pub fn look(&self, place: &Point3<f64>, tolerance_m: f64) -> Seen {
        self.map.look_from(&self.seen_at(place), tolerance_m)
    }
}

impl<'a> Asker<'a> {
    /// Cameras used for a body (points in the surface's frame), without misregistered ones: those
    /// that see through the body while equally accurate cameras see it.
    pub fn of(
        seen: &'a Visibility,
        world_from_surface: Isometry3<f64>,
        points: &[Point3<f64>],
        tolerance_m: f64,
    ) -> Asker<'a> {
        let surface_from_world = world_from_surface.inverse();
        let lying = |map: &'a DepthMap| Lying::of(map, surface_from_world * map.camera_from_world.inverse());
        let all: Vec<Lying<'a>> = seen.maps.iter().map(lying).collect();
        let views = match all.len() {
            0 | 1 => all,
            _ => without_astray(all, points),
        };
        Asker { views, tolerance_m }
    }

    /// State of a point (surface frame) over all views: free in any view outweighs surface, hidden
    /// and never.
    pub fn look(&self, x: f64, y: f64, z: f64) -> Seen {
        let place = Point3::new(x, y, z);
        let mut best = Seen::Never;
        for view in &self.views {
            best = best.max(view.look(&place, self.tolerance_m));
            if best == Seen::Free {
                break;
            }
        }
        best
    }

    /// Mean horizontal direction (unit length) from a body to the cameras that have it in view;
    /// `None` if the cameras are above it or see different sides.
    pub fn only_from(&self, round: &Round) -> Option<[f64; 2]> {
        /// Horizontal distance from the axis below which a camera counts as above the body, metres.
        /// From: chosen.
        const ABOVE_M: f64 = 0.1;
        /// Minimum length of the sum of the directions; below it, they cancel out. From: rounding.
        const CANCELLED: f64 = 1e-9;
        let place = Point3::new(round.x, round.y, round.middle_m);
        let saw = self.views.iter().filter(|view| view.look(&place, IN_VIEW_M) > Seen::Never);
        let eyes = saw.map(|view| view.viewpoint);
        let each: Vec<Vector2<f64>> = eyes
            .filter_map(|eye| Vector2::new(eye.x - round.x, eye.y - round.y).try_normalize(ABOVE_M))
            .collect();
        let mean = each.iter().sum::<Vector2<f64>>().try_normalize(CANCELLED)?;
        each.iter().all(|eye| eye.dot(&mean) > SAME_SIDE).then_some(mean.into())
    }

    /// Standard deviation of the best measurement of a surface point, metres, 0 if no camera
    /// measures it; `None` if more accurate cameras look through it, so that it is noise or a mixed
    /// pixel.
    pub fn support(&self, p: &Point3<f64>) -> Option<f64> {
        let (mut through, mut here) = (0.0, 0.0);
        let mut best_m = f64::INFINITY;
        for view in &self.views {
            let at = view.seen_at(p);
            let sigma_m = range_sigma_m(at.coords.norm());
            match view.map.look_from(&at, self.tolerance_m) {
                Seen::Free => through += sigma_m.powi(-2),
                Seen::Surface => {
                    here += sigma_m.powi(-2);
                    best_m = best_m.min(sigma_m);
                }
                Seen::Hidden | Seen::Never => {}
            }
        }
        (through <= here).then_some(if here > 0.0 { best_m } else { 0.0 })
    }
}

/// Removes the cameras that look through a body which better cameras see.
fn without_astray<'a>(all: Vec<Lying<'a>>, points: &[Point3<f64>]) -> Vec<Lying<'a>> {
    /// Number of sampled points per point that a camera must at least measure or see through to be
    /// judged. From: chosen.
    const EDGE: usize = 8;
    let step = points.len().div_ceil(WITNESSES).max(1);
    let witnesses: Vec<Point3<f64>> = points.iter().step_by(step).copied().collect();
    let through = |view: &Lying<'_>| {
        let looks = witnesses.iter().map(|p| view.look(p, APART_M));
        let (free, here) = looks.fold((0, 0), |(free, here), seen| match seen {
            Seen::Free => (free + 1, here),
            Seen::Surface => (free, here + 1),
            Seen::Hidden | Seen::Never => (free, here),
        });
        // A few points of its edge are no view of it.
        (EDGE * (free + here) > witnesses.len()).then(|| free as f64 / (free + here) as f64)
    };
    let shares: Vec<Option<f64>> = all.iter().map(through).collect();
    let weight = |view: &Lying<'_>| {
        let middle = witnesses.get(witnesses.len() / 2).map_or(1.0, |p| (p - view.viewpoint).norm());
        range_sigma_m(middle).powi(-2)
    };
    let [mut for_it, mut against] = [0.0, 0.0];
    for (view, share) in all.iter().zip(&shares) {
        match share {
            Some(share) if *share > ASTRAY => against += weight(view),
            Some(_) => for_it += weight(view),
            None => {}
        }
    }
    if against == 0.0 || against >= for_it {
        return all;
    }
    all.into_iter()
        .zip(shares)
        .filter(|(_, share)| share.is_none_or(|s| s <= ASTRAY))
        .map(|(v, _)| v)
        .collect()
}
