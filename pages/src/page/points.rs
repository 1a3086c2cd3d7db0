//! Thinned and packed point clouds, small enough to send and to draw.

use std::collections::HashSet;

use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use descry_perception::Cloud;
use descry_perception::nalgebra::{Isometry3, Point3};
use serde::Serialize;

/// Maximum number of points of one observation.
const MOST_OF_A_LOOK: usize = 50_000;
/// Maximum number of points of all observations together.
const MOST_OF_ALL: usize = 1_000_000;
/// Initial side of a thinning cell near surfaces, metres; each cell keeps one point.
const CELL_M: f64 = 0.008;
/// Factor on the side of a cell away from surfaces.
const COARSER: f64 = 5.0;
/// Factor by which cells grow until the points are few enough.
const GROWTH: f64 = 1.3;
/// Maximum distance of drawn points from the camera, metres.
const FAR_M: f64 = 6.0;

/// Axis-aligned box in which points are kept densely, map frame, metres.
pub struct Near {
    /// Minimum corner.
    pub min_m: Point3<f64>,
    /// Maximum corner.
    pub max_m: Point3<f64>,
}

/// Points with colours, packed for JSON.
#[derive(Debug, Serialize)]
pub struct Packed {
    /// Minimum corner of the bounding box, map frame, metres.
    min_m: [f64; 3],
    /// Size of the bounding box, metres.
    size_m: [f64; 3],
    /// Positions as fractions of the bounding box: three `u16` per point, little-endian, in base64.
    pub places: String,
    /// Colours: red, green and blue, one byte each per point, in base64.
    pub colours: String,
}

/// Maximum number of points of each observation, given the number of observations.
pub fn most(looks: usize) -> usize {
    MOST_OF_A_LOOK.min(MOST_OF_ALL / looks.max(1))
}

/// Thins a cloud (camera frame) to at most `most` points, denser in the boxes `near`, and packs it in the map frame.
pub fn pack(cloud: &Cloud, map_from_camera: &Isometry3<f64>, near: &[Near], most: usize) -> Packed {
    let mut cell_m = CELL_M;
    let mut kept = thinned(cloud, map_from_camera, near, cell_m);
    while kept.len() > most {
        cell_m *= GROWTH;
        kept = thinned(cloud, map_from_camera, near, cell_m);
    }
    let kept = mixed(kept);
    let least = |axis: usize| kept.iter().map(|(p, _)| p[axis]).fold(f64::INFINITY, f64::min);
    let greatest = |axis: usize| kept.iter().map(|(p, _)| p[axis]).fold(f64::NEG_INFINITY, f64::max);
    let min_m: [f64; 3] = if kept.is_empty() { [0.0; 3] } else { std::array::from_fn(least) };
    let size_m: [f64; 3] =
        std::array::from_fn(|n| if kept.is_empty() { 1.0 } else { (greatest(n) - min_m[n]).max(1e-3) });
    let part = |p: &Point3<f64>, axis: usize| {
        let share = (p[axis] - min_m[axis]) / size_m[axis];
        ((share * f64::from(u16::MAX)).round() as u16).to_le_bytes()
    };
    let places: Vec<u8> =
        kept.iter().flat_map(|(p, _)| [part(p, 0), part(p, 1), part(p, 2)]).flatten().collect();
    let colours: Vec<u8> = kept.iter().flat_map(|(_, colour)| *colour).collect();
    Packed { min_m, size_m, places: STANDARD.encode(places), colours: STANDARD.encode(colours) }
}

/// Permutes points such that every prefix is spread over the whole: a prefix can be drawn while the user turns the
/// view.
pub fn mixed<T: Copy>(points: Vec<T>) -> Vec<T> {
    const STRIDE: usize = 7919;
    let count = points.len();
    if count.is_multiple_of(STRIDE) {
        points
    } else {
        (0..count).map(|n| points[n * STRIDE % count]).collect()
    }
}

/// First point of each cell, in the map frame, with its colour; far points are left out.
fn thinned(
    cloud: &Cloud,
    map_from_camera: &Isometry3<f64>,
    near: &[Near],
    cell_m: f64,
) -> Vec<(Point3<f64>, [u8; 3])> {
    let mut taken = HashSet::new();
    let mut kept = Vec::new();
    for (n, point) in cloud.points.iter().enumerate() {
        let point = point.cast::<f64>();
        let range_m = point.coords.norm();
        if range_m.is_nan() || range_m >= FAR_M {
            continue;
        }
        let place = map_from_camera * point;
        let is_near =
            near.iter().any(|near| (0..3).all(|k| near.min_m[k] <= place[k] && place[k] <= near.max_m[k]));
        let side_m = if is_near { cell_m } else { cell_m * COARSER };
        let cell: [i32; 3] = std::array::from_fn(|k| (place[k] / side_m).floor() as i32);
        if taken.insert((is_near, cell)) {
            let colour = cloud.colours.as_ref().map_or([170; 3], |colours| colours[n]);
            kept.push((place, colour));
        }
    }
    kept
}
