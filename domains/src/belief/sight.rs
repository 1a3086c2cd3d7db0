//! Visibility: which views show which surfaces, and how much of a hypothesis they settle.

use descry_perception::nalgebra::{Isometry3, Point2, Point3, Vector3};
use descry_perception::noise::axial_sigma_m;

use crate::belief::hypothesis::Hypothesis;
use crate::belief::obstacle::Obstacle;
use crate::situation::Situation;

/// Distance before a hypothesis's centre at which its line of sight ends, metres.
const BEFORE_M: f64 = 0.05;
/// Distance before a hypothesis within which unseen space may hide an occluder, metres.
const UNSEEN_WITHIN_M: f64 = 0.4;
/// Mean free path of a line of sight through unseen space, metres.
const FREE_PATH_M: f64 = 0.5;
/// Minimum clearness of a useful view of a known surface; reached up to about three metres with a
/// Kinect.
const CLEAR_ENOUGH: f64 = 0.1;
/// Size of the smallest distinguishing feature, the wall of a cup's handle, metres.
const SMALLEST_M: f64 = 0.01;
/// Cosine of the widest angle between the normal of a sector and the line of sight at which the sector
/// still counts as seen.
const SECTOR_COSINE: f64 = 0.5;

impl Situation {
    /// Pose of the camera in the map if the body stood at a candidate and looked at a surface; `None` if
    /// it cannot.
    pub fn camera(&self, from: usize, on: usize) -> Option<Isometry3<f64>> {
        *self.geometry.sight(on).cameras[from].get_or_init(|| {
            let centre = self.surfaces[on].centre();
            self.robot.camera_at(&self.candidates[from].place, centre.as_ref()).ok()
        })
    }

    /// True if a view from a candidate shows any part of a surface, or may while the surface is unknown.
    pub fn sees(&self, from: usize, on: usize) -> bool {
        self.viewers(on).binary_search(&from).is_ok()
    }

    /// Indices of the candidates from which a view shows any part of a surface, in order.
    pub fn viewers(&self, on: usize) -> &[usize] {
        let all = || (0..self.candidates.len()).filter(|&from| self.shows(from, on)).collect();
        self.geometry.sight(on).viewers.get_or_init(all)
    }

    /// Views that show anything, each a candidate index and a surface index, in order.
    pub fn all_looks(&self) -> Vec<(usize, usize)> {
        let surfaces = 0..self.surfaces.len();
        let mut looks: Vec<(usize, usize)> =
            surfaces.flat_map(|on| self.viewers(on).iter().map(move |&from| (from, on))).collect();
        looks.sort_unstable();
        looks
    }

    fn shows(&self, from: usize, on: usize) -> bool {
        let surface = &self.surfaces[on];
        let Some(centre) = surface.centre() else { return true };
        let Some(camera) = self.camera(from, on) else { return false };
        let is_charted = self.own_map.has(&surface.symbol);
        if (surface.whole || is_charted) && self.clearness(from, on) < CLEAR_ENOUGH {
            return false;
        }
        let eye = Point3::from(camera.translation.vector).xy();
        if is_charted && self.own_map.hides(&eye, &centre.xy()) {
            return false;
        }
        let between = surface.outline.iter().map(|p| halfway(p, &centre));
        std::iter::once(centre)
            .chain(surface.outline.iter().copied())
            .chain(between)
            .any(|p| self.in_view(&camera, &p) && !self.is_walled_off(&eye, &p.xy()))
    }

    /// Clearness of a view of objects on a surface, 0 to 1: weight of a depth measurement (a Kalman
    /// gain) for resolving half of the smallest distinguishing feature.
    pub(crate) fn clearness(&self, from: usize, on: usize) -> f64 {
        let middle = self.camera(from, on).zip(self.surfaces[on].centre());
        let Some((camera, centre)) = middle else { return 1.0 };
        let distance_m = (centre - Point3::from(camera.translation.vector)).norm();
        let sigma_m = axial_sigma_m(distance_m, 0.0).unwrap_or_default();
        1.0 / (1.0 + (sigma_m / (SMALLEST_M / 2.0)).powi(2))
    }

    /// True if a point is in the camera's field of view and range.
    pub(crate) fn in_view(&self, map_from_camera: &Isometry3<f64>, point: &Point3<f64>) -> bool {
        let camera = self.robot.description().camera.as_ref();
        camera.is_some_and(|camera| camera.shows(&map_from_camera.inverse_transform_point(point)))
    }

    /// Share of a hypothesis that a view from a candidate would settle, 0 to 1: zero unless most of its
    /// points are in view and unoccluded (apart from the obstacle `moved`); else the view's clearness
    /// times the probability that unseen space in front is empty.
    pub(crate) fn would_settle(
        &self,
        from: usize,
        on: usize,
        hypothesis: &Hypothesis,
        moved: Option<&Obstacle>,
    ) -> f64 {
        let Some(camera) = self.camera(from, on) else { return 0.0 };
        let eye = Point3::from(camera.translation.vector);
        if let Some(facing) = &hypothesis.facing {
            let towards = (eye - hypothesis.centre).normalize();
            if facing.dot(&towards) < SECTOR_COSINE {
                return 0.0;
            }
        }
        let gone = |p: &Point3<f64>| moved.is_some_and(|o| o.covers(p));
        let space = &self.spaces[on];
        let visible = |p: &&Point3<f64>| {
            self.in_view(&camera, p)
                && space.line_of_sight(&eye, p, &gone)
                && !self.is_walled_off(&eye.xy(), &p.xy())
        };
        if hypothesis.points.iter().filter(visible).count() * 2 <= hypothesis.points.len() {
            return 0.0;
        }
        let sum = hypothesis.points.iter().fold(Vector3::zeros(), |sum, p| sum + p.coords);
        let middle = Point3::from(sum / hypothesis.points.len() as f64);
        let before = middle + (eye - middle).normalize() * BEFORE_M;
        let unseen_m = space.unseen_m(&eye, &before, UNSEEN_WITHIN_M);
        self.clearness(from, on) * (-unseen_m / FREE_PATH_M).exp()
    }
}

fn halfway(a: &Point3<f64>, b: &Point3<f64>) -> Point3<f64> {
    Point3::from((a.coords + b.coords) / 2.0)
}

impl Situation {
    /// True if a wall of the map, or a door believed shut, stands between two points.
    pub(crate) fn is_walled_off(&self, from: &Point2<f64>, to: &Point2<f64>) -> bool {
        self.geometry.walls().stand_between(&self.shut, from, to)
    }
}
