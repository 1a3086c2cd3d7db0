//! Ideal depth camera: analytic ray casting of every pixel against all relevant solids.
//!
//! A ray has depth 1 along z, so that its parameter *is* the depth. Each solid is tested only within the
//! pixel rectangle of its projected bounding box. Rows are rendered in parallel; pixels are independent.

use crate::body::Stamp;
use crate::sim::frame::Frame;
use crate::sim::scene::RoomSpec;
use crate::sim::world::{LABEL_NOTHING, LABEL_ROOM, Scene, Solid, WALL_COLOUR};
use descry_perception::Intrinsics;
use nalgebra::{Isometry3, Point3, Rotation3, Vector3};
use rayon::prelude::*;

/// A solid, the camera's pose in the solid's frame, and the pixel rectangle that the solid may cover.
struct Placed<'a> {
    solid: &'a Solid,
    origin: Point3<f64>,
    solid_from_camera: Rotation3<f64>,
    columns: (usize, usize),
    rows: (usize, usize),
    /// Lower bound on the depth of the solid, metres.
    near_m: f64,
}

/// Slack in comparing depths with the near side of a bounding box, for rounding, metres.
const SLACK_M: f64 = 1e-6;
/// Distance to the camera's plane below which a bounding box counts as covering the whole image, metres.
const NEAR_M: f64 = 0.02;
const FLOOR_COLOUR: [u8; 3] = [120, 115, 110];
/// Direction to the lamp, map frame, nearly a unit vector.
const LIGHT: Vector3<f64> = Vector3::new(0.32, -0.24, 0.917);

impl<'a> Placed<'a> {
    fn new(solid: &'a Solid, map_from_camera: &Isometry3<f64>, camera: &Intrinsics) -> Option<Self> {
        let solid_from_camera = solid.map_from_solid.inv_mul(map_from_camera);
        let camera_from_solid = solid_from_camera.inverse();
        let (low, high) = solid.bounds;
        let mut box_ = [f64::INFINITY, f64::INFINITY, f64::NEG_INFINITY, f64::NEG_INFINITY];
        let (mut behind, mut before) = (false, false);
        let mut near_m = f64::INFINITY;
        for corner in 0..8 {
            let pick = |bit: usize, axis: usize| if corner & bit == 0 { low[axis] } else { high[axis] };
            let p = camera_from_solid * Point3::new(pick(1, 0), pick(2, 1), pick(4, 2));
            near_m = near_m.min(p.z - SLACK_M);
            if p.z < NEAR_M {
                behind = true;
                continue;
            }
            before = true;
            let (u, v) = (camera.fx * p.x / p.z + camera.cx, camera.fy * p.y / p.z + camera.cy);
            box_ = [box_[0].min(u), box_[1].min(v), box_[2].max(u), box_[3].max(v)];
        }
        if !before {
            return None;
        }
        if behind {
            box_ = [0.0, 0.0, camera.width as f64, camera.height as f64];
        }
        let span = |from: f64, to: f64, size: usize| {
            (from.floor().max(0.0) as usize, ((to.ceil() + 1.0).max(0.0) as usize).min(size))
        };
        let columns = span(box_[0], box_[2], camera.width);
        let rows = span(box_[1], box_[3], camera.height);
        (columns.0 < columns.1 && rows.0 < rows.1).then(|| Placed {
            solid,
            origin: Point3::from(solid_from_camera.translation.vector),
            solid_from_camera: solid_from_camera.rotation.to_rotation_matrix(),
            columns,
            rows,
            near_m,
        })
    }
}

/// Ray through a pixel in the optical frame, scaled to depth 1.
#[inline]
fn ray(camera: &Intrinsics, column: usize, row: usize) -> Vector3<f64> {
    Vector3::new((column as f64 - camera.cx) / camera.fx, (row as f64 - camera.cy) / camera.fy, 1.0)
}

/// Renders the room and its solids.
pub fn render(
    room: &RoomSpec,
    solids: &[Solid],
    map_from_camera: &Isometry3<f64>,
    camera: &Intrinsics,
    stamp_ns: Stamp,
) -> Frame {
    let mut placed: Vec<Placed> =
        solids.iter().filter_map(|s| Placed::new(s, map_from_camera, camera)).collect();
    // The nearest walls first: they hide most of the rest of a flat.
    placed.sort_by(|a, b| {
        let wall = |p: &Placed| p.solid.label == LABEL_ROOM;
        wall(b).cmp(&wall(a)).then_with(|| match wall(a) && wall(b) {
            true => a.near_m.total_cmp(&b.near_m),
            false => std::cmp::Ordering::Equal,
        })
    });
    let pixels = camera.width * camera.height;
    let mut frame = Frame {
        intrinsics: *camera,
        stamp_ns,
        depth_m: vec![f32::INFINITY; pixels],
        cosine: vec![0.0; pixels],
        label: vec![LABEL_NOTHING; pixels],
        colour: vec![[0; 3]; pixels],
    };
    let width = camera.width.max(1);
    let rows = frame
        .depth_m
        .par_chunks_mut(width)
        .zip(frame.cosine.par_chunks_mut(width))
        .zip(frame.label.par_chunks_mut(width))
        .zip(frame.colour.par_chunks_mut(width));
    rows.enumerate().with_min_len(8).for_each_init(
        || vec![f64::INFINITY; width],
        |exact, (row, (((depth, cosine), label), colour))| {
            exact.fill(f64::INFINITY);
            let mut line = Line { depth: exact, cosine, label, colour };
            draw_room(room, map_from_camera, camera, row, &mut line);
            for p in placed.iter().filter(|p| (p.rows.0..p.rows.1).contains(&row)) {
                draw_solid(p, camera, row, &mut line);
            }
            for (out, exact) in depth.iter_mut().zip(exact.iter()) {
                *out = *exact as f32;
            }
        },
    );
    frame
}

/// A row of the frame during rendering.
struct Line<'a> {
    depth: &'a mut [f64],
    cosine: &'a mut [f32],
    label: &'a mut [u16],
    colour: &'a mut [[u8; 3]],
}

/// Draws the floor and the outer walls: the inside of a box without a lid.
fn draw_room(
    room: &RoomSpec,
    map_from_camera: &Isometry3<f64>,
    camera: &Intrinsics,
    row: usize,
    line: &mut Line,
) {
    let rotation = map_from_camera.rotation.to_rotation_matrix();
    let o = map_from_camera.translation.vector;
    let (low, high) = (room.low(), room.high());
    for column in 0..camera.width {
        let in_camera = ray(camera, column, row);
        let d = rotation * in_camera;
        let mut nearest = (f64::INFINITY, Vector3::z(), FLOOR_COLOUR);
        if d.z < 0.0 {
            nearest.0 = -o.z / d.z;
        }
        for axis in 0..2 {
            let wall = if d[axis] > 0.0 { high[axis] } else { low[axis] };
            let t = (wall - o[axis]) / d[axis];
            if t > 0.0 && t < nearest.0 {
                let mut normal = Vector3::zeros();
                normal[axis] = -d[axis].signum();
                nearest = (t, normal, WALL_COLOUR);
            }
        }
        let (t, normal, colour) = nearest;
        let height = o.z + t * d.z;
        if t.is_finite() && t > 0.0 && height <= room.wall_height_m {
            line.depth[column] = t;
            line.cosine[column] = (d.dot(&normal).abs() / in_camera.norm()) as f32;
            line.label[column] = LABEL_ROOM;
            line.colour[column] = shade(colour, &normal);
        }
    }
}

fn draw_solid(p: &Placed, camera: &Intrinsics, row: usize, line: &mut Line) {
    let rotation = p.solid.map_from_solid.rotation;
    for column in p.columns.0..p.columns.1 {
        if line.depth[column] <= p.near_m {
            continue;
        }
        let in_camera = ray(camera, column, row);
        let d = p.solid_from_camera * in_camera;
        if let Some((hit, part)) = p.solid.meet(&p.origin, &d, line.depth[column]) {
            // Seen from inside a cup the surface faces the other way.
            let facing = if d.dot(&hit.normal) > 0.0 { -hit.normal } else { hit.normal };
            line.depth[column] = hit.t;
            line.cosine[column] = (-d.dot(&facing) / in_camera.norm()) as f32;
            line.label[column] = p.solid.label;
            let colour = p.solid.colour_at(part, &(p.origin + d * hit.t));
            line.colour[column] = shade(colour, &(rotation * facing));
        }
    }
}

fn shade(colour: [u8; 3], normal: &Vector3<f64>) -> [u8; 3] {
    let light = 0.45 + 0.55 * normal.dot(&LIGHT).max(0.0);
    colour.map(|c| (f64::from(c) * light).min(255.0) as u8)
}

/// Visible share of a solid, 0 to 1: pixels that show it over pixels that would show it without other solids,
/// at every `stride`-th column and row. `None` if the solid covers no pixel.
pub fn visible_share(
    scene: &Scene,
    label: u16,
    map_from_camera: &Isometry3<f64>,
    camera: &Intrinsics,
    stride: usize,
) -> Option<f64> {
    let solids = scene.solids();
    let target = solids.iter().find(|s| s.label == label)?;
    let target = Placed::new(target, map_from_camera, camera)?;
    let others: Vec<Placed> = solids
        .iter()
        .filter(|s| s.label != label)
        .filter_map(|s| Placed::new(s, map_from_camera, camera))
        .collect();
    let (mut alone, mut seen) = (0usize, 0usize);
    for row in (target.rows.0..target.rows.1).step_by(stride.max(1)) {
        for column in (target.columns.0..target.columns.1).step_by(stride.max(1)) {
            let in_camera = ray(camera, column, row);
            let Some(hit) =
                target.solid.hit(&target.origin, &(target.solid_from_camera * in_camera), f64::INFINITY)
            else {
                continue;
            };
            alone += 1;
            let hidden = others
                .iter()
                .filter(|o| (o.rows.0..o.rows.1).contains(&row))
                .filter(|o| (o.columns.0..o.columns.1).contains(&column) && o.near_m < hit.t)
                .any(|o| o.solid.hit(&o.origin, &(o.solid_from_camera * in_camera), hit.t).is_some());
            seen += usize::from(!hidden);
        }
    }
    (alone > 0).then(|| seen as f64 / alone as f64)
}
