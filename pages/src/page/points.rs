//! The points of a look, few enough to be drawn and small enough to be sent.

use std::collections::HashSet;

use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use descry_perception::Cloud;
use descry_perception::nalgebra::{Isometry3, Point3};
use serde::Serialize;

/// Most points of one look, and of all looks together.
const MOST_OF_A_LOOK: usize = 50_000;
const MOST_OF_ALL: usize = 1_000_000;
/// Side of the cells of which one point is kept: near surfaces to stand things on, metres; elsewhere so many times that.
const CELL_M: f64 = 0.008;
const COARSER: f64 = 5.0;
/// How much larger cells become until the points are few enough.
const GROWTH: f64 = 1.3;
/// Points farther from the camera than this are not drawn, metres.
const FAR_M: f64 = 6.0;

/// A cuboid in which points are kept more densely, in the map, metres.
pub struct Near {
    /// Its least corner.
    pub min_m: Point3<f64>,
    /// Its greatest.
    pub max_m: Point3<f64>,
}

/// Points with colours, packed.
#[derive(Debug, Serialize)]
pub struct Packed {
    /// Where the box of all points begins, in the map, metres.
    min_m: [f64; 3],
    /// How large it is, metres.
    size_m: [f64; 3],
    /// Three unsigned numbers of 16 bits a point, least byte first, in parts of that box; in base64.
    pub places: String,
    /// Three bytes a point: red, green, blue; in base64.
    pub colours: String,
}

/// Most points of each of so many looks.
pub fn most(looks: usize) -> usize {
    MOST_OF_A_LOOK.min(MOST_OF_ALL / looks.max(1))
}

/// The points of a cloud whose camera stood there.
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

/// The points in an order of which every beginning is spread over all of them: so few can stand for all while the picture turns.
pub fn mixed<T: Copy>(points: Vec<T>) -> Vec<T> {
    const STRIDE: usize = 7919;
    let count = points.len();
    if count.is_multiple_of(STRIDE) {
        points
    } else {
        (0..count).map(|n| points[n * STRIDE % count]).collect()
    }
}

/// One point of each cell, the first.
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
