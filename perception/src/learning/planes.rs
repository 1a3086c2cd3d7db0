//! Planes outside the object: its support, walls, other furniture (section V-A, c; Eq. 3 and 4).

use super::frame::Frame;
use super::mask::Mask;
use crate::draw::Draws;
use crate::noise::frontal_sigma_m;
use crate::plane::{self, Plane, PlaneOptions};
use crate::visibility::{DepthMap, Seen};
use nalgebra::Point3;

/// Rules for keeping planes as part of the object.
#[derive(Clone, Debug)]
pub(super) struct PlaneRules {
    /// Minimum share of a plane's pixels in the object for the plane to stay (ϑ_obj).
    pub object_share: f64,
    /// Minimum share of a plane's pixels that were invisible in the first view for the plane to stay (ϑ_vis).
    pub hidden_share: f64,
}

/// Maximum number of planes detected in a frame.
const MOST: usize = 8;
/// Minimum number of pixels of a plane, as a share of the nearby pixels, and as an absolute number.
const LEAST: (f64, usize) = (0.015, 200);
/// Maximum number of pixels used for detecting a plane.
const SAMPLE: usize = 20_000;
/// Maximum angle between a pixel's normal and its plane's, radians.
const TILT_RAD: f64 = 0.5;
/// Maximum angle between planes that count as one, radians.
const GROUP_RAD: f64 = 0.12;
/// Maximum distance between planes that count as one, metres.
const GROUP_M: f64 = 0.01;

/// Planes removed so far, each with the centroid of its pixels, world frame.
#[derive(Default)]
pub(super) struct Removed {
    planes: Vec<(Plane, Point3<f64>)>,
}

impl Removed {
    /// Pixels near the object on no removed plane (S_t^f); detects and removes the frame's planes first.
    pub fn filtered(&mut self, frame: &Frame, object: &Mask, first: &DepthMap, rules: &PlaneRules) -> Mask {
        let mut left = Mask::of(frame.grid, frame.near.iter().map(|&i| i as usize));
        let mut open = left.clone();
        let mut draws = Draws::new(0);
        for _ in 0..MOST {
            let Some(found) = find(frame, &open, &mut draws) else { break };
            found.pixels.iter().for_each(|&i| open.set[i] = false);
            if self.removes(frame, &found, object, first, rules) {
                found.pixels.iter().for_each(|&i| left.set[i] = false);
                self.planes.push((found.plane, found.middle));
            }
        }
        // What is left of planes taken out before, however small: a bit of table behind the object.
        for (plane, _) in &self.planes {
            for pixel in pixels_of(frame, &left, plane) {
                if !object.set[pixel] {
                    left.set[pixel] = false;
                }
            }
        }
        left
    }

    fn removes(
        &self,
        frame: &Frame,
        found: &Found,
        object: &Mask,
        first: &DepthMap,
        rules: &PlaneRules,
    ) -> bool {
        let all = found.pixels.len() as f64;
        let of_object = found.pixels.iter().filter(|&&i| object.set[i]).count() as f64;
        if of_object >= rules.object_share * all {
            return false;
        }
        let same = |(plane, middle): &(Plane, Point3<f64>)| {
            plane.normal.angle(&found.plane.normal) < GROUP_RAD
                && plane.height_m(&found.middle).abs() < GROUP_M
                && found.plane.height_m(middle).abs() < 3.0 * GROUP_M
        };
        if self.planes.iter().any(same) {
            return true;
        }
        let invisible = |&&i: &&usize| {
            let p = frame.points[i].cast::<f64>();
            let tolerance_m = 3.0 * f64::from(frontal_sigma_m((first.camera_from_world * p).z as f32));
            matches!(first.look(&p, tolerance_m.max(0.01)), Seen::Never | Seen::Hidden)
        };
        let hidden = found.pixels.iter().filter(invisible).count() as f64;
        hidden < rules.hidden_share * all
    }
}

struct Found {
    plane: Plane,
    middle: Point3<f64>,
    pixels: Vec<usize>,
}

/// Plane with the most pixels of a mask; `None` if it has too few.
fn find(frame: &Frame, open: &Mask, draws: &mut Draws) -> Option<Found> {
    let pixels: Vec<usize> = open.pixels().collect();
    let least = LEAST.1.max((LEAST.0 * frame.near.len() as f64) as usize);
    if pixels.len() < least {
        return None;
    }
    let stride = pixels.len().div_ceil(SAMPLE);
    let sample: Vec<Point3<f32>> = pixels.iter().step_by(stride).map(|&i| frame.points[i]).collect();
    let options = PlaneOptions {
        tolerance_m: tolerance_m(frame, &pixels) as f32,
        rounds: 300,
        seed: draws.next(),
        ..PlaneOptions::default()
    };
    let fit = plane::find(&sample, &options).ok()?;
    let plane = fit.plane.facing(&frame.map.viewpoint());
    let pixels = pixels_of(frame, open, &plane);
    if pixels.len() < least {
        return None;
    }
    let sum = pixels.iter().map(|&i| frame.points[i].coords.cast::<f64>()).sum::<nalgebra::Vector3<f64>>();
    let middle = Point3::from(sum / pixels.len() as f64);
    Some(Found { plane, middle, pixels })
}

/// Maximum distance of a pixel from its plane, metres: 2.5 standard deviations of the camera at the depth of the middle
/// one of the pixels, at least 6 mm.
fn tolerance_m(frame: &Frame, pixels: &[usize]) -> f64 {
    let depth_m = frame.depth_m(pixels[pixels.len() / 2]);
    (2.5 * f64::from(frontal_sigma_m(depth_m as f32))).max(0.006)
}

/// Pixels of a mask on a plane: near the plane with a similar normal, or very near.
fn pixels_of(frame: &Frame, mask: &Mask, plane: &Plane) -> Vec<usize> {
    let pixels: Vec<usize> = mask.pixels().collect();
    if pixels.is_empty() {
        return pixels;
    }
    let tolerance_m = tolerance_m(frame, &pixels);
    let normal = plane.normal.cast::<f32>();
    let along = TILT_RAD.cos() as f32;
    let on = |&i: &usize| {
        let height_m = plane.height_m(&frame.points[i].cast()).abs();
        height_m < tolerance_m && (frame.normals[i].dot(&normal) > along || height_m < 0.3 * tolerance_m)
    };
    pixels.into_iter().filter(on).collect()
}
