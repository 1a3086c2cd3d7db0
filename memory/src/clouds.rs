//! Lossless encoding of clouds as bytes.

use crate::document::{Blob, BlobInfo, Form};
use descry_perception::nalgebra::{Point3, Vector3};
use descry_perception::{Cloud, Grid, Intrinsics};
use serde::{Deserialize, Serialize};
use serde_json::json;
use std::borrow::Cow;

/// Name of a cloud's blob.
pub(crate) const CLOUD: &str = "cloud";

/// Camera behind a cloud, and the uncertainty of its pose.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Sensing {
    /// Intrinsics of the camera, if known.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub intrinsics: Option<Intrinsics>,
    /// Standard deviation of the camera position along each axis, metres.
    #[serde(default)]
    pub pose_sigma_m: f64,
    /// Standard deviation of the camera orientation about each axis, radians.
    #[serde(default)]
    pub pose_sigma_rad: f64,
}

/// Byte layout of the points of a cloud.
#[derive(Serialize, Deserialize)]
pub struct Layout {
    points: usize,
    stride: usize,
    fields: Vec<LayoutField>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    grid: Option<Grid>,
    #[serde(default)]
    sensing: Sensing,
}

#[derive(Serialize, Deserialize, PartialEq)]
struct LayoutField {
    name: String,
    offset: usize,
    #[serde(rename = "type")]
    kind: String,
}

/// Position of a point: names, type and size in bytes of its fields.
const POSITION: (&[&str], &str, usize) = (&["x", "y", "z"], "f32", 4);
/// Colour of a point: names, type and size in bytes of its fields; alpha is always 255.
const COLOUR: (&[&str], &str, usize) = (&["red", "green", "blue", "alpha"], "u8", 1);
/// Normal of a point: names, type and size in bytes of its fields.
const NORMAL: (&[&str], &str, usize) = (&["normal_x", "normal_y", "normal_z"], "f32", 4);
/// Label of a point: name, type and size in bytes of its field.
const LABEL: (&[&str], &str, usize) = (&["label"], "u32", 4);

pub fn layout(cloud: &Cloud, sensing: &Sensing) -> Layout {
    let parts = [
        (true, POSITION),
        (cloud.colours.is_some(), COLOUR),
        (cloud.normals.is_some(), NORMAL),
        (cloud.labels.is_some(), LABEL),
    ];
    let mut fields = Vec::new();
    let mut stride = 0;
    for (_, (names, kind, bytes)) in parts.into_iter().filter(|(there, _)| *there) {
        for name in names {
            fields.push(LayoutField { name: (*name).into(), offset: stride, kind: kind.into() });
            stride += bytes;
        }
    }
    Layout { points: cloud.len(), stride, fields, grid: cloud.grid, sensing: *sensing }
}

/// Encodes a cloud as a blob; a cloud with positions alone is not copied.
pub fn encode<'a>(cloud: &'a Cloud, sensing: &Sensing) -> Blob<'a> {
    let layout = layout(cloud, sensing);
    let bare = layout.fields.len() == 3 && cfg!(target_endian = "little");
    let data = if bare {
        Cow::Borrowed(bytemuck::cast_slice(&cloud.points))
    } else {
        Cow::Owned(pack(cloud, layout.stride))
    };
    Blob { name: CLOUD.into(), form: Form::PointCloud, layout: json!(layout), data }
}

pub fn pack(cloud: &Cloud, stride: usize) -> Vec<u8> {
    let mut out = Vec::with_capacity(cloud.len() * stride);
    for (i, p) in cloud.points.iter().enumerate() {
        p.iter().for_each(|v| out.extend_from_slice(&v.to_le_bytes()));
        if let Some([r, g, b]) = cloud.colours.as_ref().map(|c| c[i]) {
            out.extend_from_slice(&[r, g, b, 255]);
        }
        if let Some(n) = cloud.normals.as_ref().map(|n| n[i]) {
            n.iter().for_each(|v| out.extend_from_slice(&v.to_le_bytes()));
        }
        if let Some(label) = cloud.labels.as_ref().map(|l| l[i]) {
            out.extend_from_slice(&label.to_le_bytes());
        }
    }
    out
}

/// Decodes the camera behind a cloud.
///
/// # Errors
/// Reason for which the layout cannot be read.
pub fn sensing(info: &BlobInfo) -> Result<Sensing, String> {
    let layout = Layout::deserialize(&info.layout);
    layout.map(|l| l.sensing).map_err(|e| format!("its layout cannot be read: {e}"))
}

/// Decodes a cloud and the camera behind it from a blob.
///
/// # Errors
/// Reason for which the layout cannot be read, or does not match the data.
pub fn decode(info: &BlobInfo, data: &[u8]) -> Result<(Cloud, Sensing), String> {
    let layout: Layout =
        Layout::deserialize(&info.layout).map_err(|e| format!("its layout cannot be read: {e}"))?;
    if layout.stride == 0 || layout.points.checked_mul(layout.stride) != Some(data.len()) {
        return Err(format!(
            "{} points of {} bytes do not make {} bytes",
            layout.points,
            layout.stride,
            data.len()
        ));
    }
    let at = |(names, kind, bytes): (&[&str], &str, usize)| {
        let first = layout.fields.iter().find(|f| f.name == names[0] && f.kind == kind)?.offset;
        let whole = names.iter().enumerate().all(|(i, name)| {
            layout.fields.iter().any(|f| f.name == *name && f.kind == kind && f.offset == first + i * bytes)
        });
        (whole && first + names.len() * bytes <= layout.stride).then_some(first)
    };
    let position = at(POSITION).ok_or("it has no x, y, z of f32 side by side")?;
    let rows = || data.chunks_exact(layout.stride);
    let cloud = Cloud {
        points: rows().map(|row| Point3::from(three(row, position))).collect(),
        grid: layout.grid,
        colours: at(COLOUR).map(|from| rows().map(|row| [row[from], row[from + 1], row[from + 2]]).collect()),
        normals: at(NORMAL).map(|from| rows().map(|row| Vector3::from(three(row, from))).collect()),
        labels: at(LABEL).map(|from| rows().map(|row| u32::from_le_bytes(words(row, from)[0])).collect()),
    };
    cloud.check().map_err(|e| e.to_string())?;
    Ok((cloud, layout.sensing))
}

fn words(row: &[u8], from: usize) -> &[[u8; 4]] {
    row[from..].as_chunks().0
}

fn three(row: &[u8], from: usize) -> [f32; 3] {
    // Word by word: a closure over an array of places is not unrolled.
    let words = words(row, from);
    [f32::from_le_bytes(words[0]), f32::from_le_bytes(words[1]), f32::from_le_bytes(words[2])]
}
