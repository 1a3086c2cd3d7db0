//! Content for robotics viewers besides sensor data: labelled boxes, merged clouds, map, camera projection,
//! plan, log. Each is a blob of the record whose content it shows.

use crate::clouds::{self, Sensing};
use crate::document::{Blob, Form};
use crate::foxglove::wire::Wire;
use crate::foxglove::{LogLevel, log as line};
use descry_perception::{Cloud, Intrinsics};
use nalgebra::{Isometry3, Vector3};
use serde_json::Value;

/// A labelled box around an object.
#[derive(Clone, Debug, PartialEq)]
pub struct Labelled {
    /// Identifier of the object, the same in every set of boxes.
    pub id: String,
    /// Label above the box.
    pub text: String,
    /// Pose of the box's centre in the common frame of the boxes.
    pub frame_from_box: Isometry3<f64>,
    /// Sides, metres.
    pub size_m: Vector3<f64>,
    /// Red, green, blue and opacity, 0 to 1.
    pub colour: [f64; 4],
}

fn blob(name: &str, form: Form, data: Vec<u8>) -> Blob<'static> {
    Blob { name: name.into(), form, layout: Value::Null, data: data.into() }
}

fn pose(out: &mut Wire, number: u32, of: &Isometry3<f64>) {
    out.message(number, |pose| {
        pose.message(1, |v| (1..).zip(of.translation.vector.iter()).for_each(|(n, x)| v.double(n, *x)));
        pose.message(2, |v| (1..).zip(of.rotation.coords.iter()).for_each(|(n, x)| v.double(n, *x)));
    });
}

fn colour(out: &mut Wire, number: u32, of: &[f64; 4]) {
    out.message(number, |c| (1..).zip(of).for_each(|(n, x)| c.double(n, *x)));
}

/// Encodes a line of the log from the source `name`.
pub fn log(stamp_ns: i64, level: LogLevel, name: &str, message: &str) -> Blob<'static> {
    blob("log", Form::Log, line(stamp_ns, level, name, message))
}

/// Encodes the steps of a plan as a line of a log of its own.
pub fn plan(stamp_ns: i64, steps: &str) -> Blob<'static> {
    blob("plan", Form::Log, line(stamp_ns, LogLevel::Info, "plan", steps))
}

/// Encodes a derived cloud, such as `merged`, in the frame of its document.
pub fn cloud<'a>(name: &str, cloud: &'a Cloud) -> Blob<'a> {
    Blob { name: name.into(), ..clouds::encode(cloud, &Sensing::default()) }
}

/// Encodes a set of boxes in a frame, which replaces the previous set in viewers.
pub fn boxes(stamp_ns: i64, frame: &str, name: &str, boxes: &[Labelled]) -> Blob<'static> {
    const ALL: u64 = 1;
    let mut out = Wire::default();
    out.message(1, |deletion| {
        deletion.timestamp(1, stamp_ns);
        deletion.varint(2, ALL);
    });
    for one in boxes {
        out.message(2, |entity| {
            entity.timestamp(1, stamp_ns);
            entity.text(2, frame);
            entity.text(3, &one.id);
            entity.message(8, |cube| {
                pose(cube, 1, &one.frame_from_box);
                cube.message(2, |v| (1..).zip(one.size_m.iter()).for_each(|(n, x)| v.double(n, *x)));
                colour(cube, 3, &one.colour);
            });
            entity.message(13, |text| {
                let mut over = one.frame_from_box;
                over.translation.vector +=
                    one.frame_from_box.rotation * Vector3::z() * (one.size_m.z / 2.0 + 0.03);
                pose(text, 1, &over);
                text.varint(2, 1);
                text.double(3, 0.03);
                colour(text, 5, &[1.0; 4]);
                text.text(6, &one.text);
            });
        });
    }
    blob(name, Form::SceneUpdate, out.0)
}

/// Encodes the projection of a camera without distortion.
pub fn calibration(stamp_ns: i64, frame: &str, camera: &Intrinsics) -> Blob<'static> {
    let Intrinsics { width, height, fx, fy, cx, cy } = *camera;
    let mut out = Wire::default();
    out.timestamp(1, stamp_ns);
    out.fixed32(2, width as u32);
    out.fixed32(3, height as u32);
    out.doubles(6, &[fx, 0.0, cx, 0.0, fy, cy, 0.0, 0.0, 1.0]);
    out.doubles(7, &[1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0]);
    out.doubles(8, &[fx, 0.0, cx, 0.0, 0.0, fy, cy, 0.0, 0.0, 0.0, 1.0, 0.0]);
    out.text(9, frame);
    blob("calibration", Form::CameraCalibration, out.0)
}

/// Encodes the cells of a map, row by row (x fastest), one byte each; `origin_m` is the outer corner of the
/// first cell in the frame, metres.
pub fn grid(
    stamp_ns: i64,
    frame: &str,
    origin_m: [f64; 2],
    cell_m: f64,
    columns: usize,
    cells: &[u8],
) -> Blob<'static> {
    const UINT8: u64 = 1;
    let mut out = Wire::default();
    out.timestamp(1, stamp_ns);
    out.text(2, frame);
    pose(&mut out, 3, &Isometry3::translation(origin_m[0], origin_m[1], 0.0));
    out.fixed32(4, columns as u32);
    out.message(5, |size| {
        size.double(1, cell_m);
        size.double(2, cell_m);
    });
    out.fixed32(6, columns as u32);
    out.fixed32(7, 1);
    out.message(8, |field| {
        field.text(1, "occupied");
        field.fixed32(2, 0);
        field.varint(3, UINT8);
    });
    out.bytes(9, cells);
    blob("grid", Form::Grid, out.0)
}
