//! Compact text encoding of clouds: integer multiples of a unit from the minimum corner, in base64. A decoded
//! cloud encodes to the same text.

use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use descry_perception::Cloud;
use nalgebra::{Point3, Vector3};
use serde::de::Error;
use serde::{Deserialize, Deserializer, Serialize, Serializer};

/// Candidate units, metres: a tenth of a millimetre for small clouds, a millimetre for large ones.
const UNITS_M: [f64; 2] = [1e-4, 1e-3];
/// Mark of an unknown component of a normal.
const UNKNOWN: i8 = i8::MIN;

/// Text encoding of a cloud.
#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Packed {
    /// Unit of the coordinates, metres.
    pub unit_m: f64,
    /// Minimum corner of the cloud, in units.
    low: [i64; 3],
    /// Coordinates of each point, in units from `low`: three little-endian `u16`, as base64.
    pub points: String,
    /// Normal of each point: three `i8` in units of 1/127, as base64.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    normals: Option<String>,
    /// Red, green and blue of each point: three bytes, as base64.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub colours: Option<String>,
}

/// Serialises the finite points of a cloud, without grid and labels. Points farther than 65 m from its
/// minimum corner are left out.
///
/// # Errors
/// Those of the serialiser.
pub fn serialize<S: Serializer>(cloud: &Cloud, writer: S) -> Result<S::Ok, S::Error> {
    pack(&cloud.finite()).serialize(writer)
}

/// Deserialises a cloud.
///
/// # Errors
/// Malformed text.
pub fn deserialize<'de, D: Deserializer<'de>>(reader: D) -> Result<Cloud, D::Error> {
    unpack(&Packed::deserialize(reader)?).map_err(D::Error::custom)
}

pub fn pack(cloud: &Cloud) -> Packed {
    let bounds = cloud.bounds().unwrap_or_default();
    let size_m = f64::from((bounds.1 - bounds.0).max());
    let unit_m = UNITS_M[usize::from(size_m / UNITS_M[0] >= f64::from(u16::MAX))];
    let steps =
        |p: &Point3<f32>| -> [i64; 3] { std::array::from_fn(|k| (f64::from(p[k]) / unit_m).round() as i64) };
    let low = steps(&bounds.0);
    let above = |p: &Point3<f32>| -> Option<[u16; 3]> {
        let at = steps(p);
        let parts: Vec<u16> = (0..3).map(|k| u16::try_from(at[k] - low[k]).ok()).collect::<Option<_>>()?;
        parts.try_into().ok()
    };
    let kept: Vec<u32> =
        (0..cloud.len()).filter(|&i| above(&cloud.points[i]).is_some()).map(|i| i as u32).collect();
    let cloud = cloud.select(&kept);
    let points = cloud.points.iter().filter_map(above).flatten().flat_map(u16::to_le_bytes);
    let part = |v: f32| if v.is_finite() { (127.0 * v).round().clamp(-127.0, 127.0) as i8 } else { UNKNOWN };
    let normal = |n: &Vector3<f32>| [n.x, n.y, n.z].map(|v| part(v) as u8);
    Packed {
        unit_m,
        low,
        points: STANDARD.encode(points.collect::<Vec<u8>>()),
        normals: cloud.normals.map(|n| STANDARD.encode(n.iter().flat_map(normal).collect::<Vec<u8>>())),
        colours: cloud.colours.map(|c| STANDARD.encode(c.concat())),
    }
}

pub fn unpack(packed: &Packed) -> Result<Cloud, String> {
    if !(packed.unit_m.is_finite() && packed.unit_m > 0.0) {
        return Err(format!("a unit of {} m", packed.unit_m));
    }
    let bytes = |text: &str| STANDARD.decode(text).map_err(|e| format!("no base64: {e}"));
    let raw = bytes(&packed.points)?;
    if raw.len() % 6 != 0 {
        return Err(format!("{} bytes are no points of six bytes each", raw.len()));
    }
    let coordinate = |k: usize, pair: &[u8]| {
        let steps = packed.low[k] + i64::from(u16::from_le_bytes([pair[0], pair[1]]));
        (steps as f64 * packed.unit_m) as f32
    };
    let point =
        |p: &[u8]| Point3::new(coordinate(0, &p[..2]), coordinate(1, &p[2..4]), coordinate(2, &p[4..6]));
    let points: Vec<Point3<f32>> = raw.chunks_exact(6).map(point).collect();
    let part = |byte: u8| match byte as i8 {
        UNKNOWN => f32::NAN,
        known => f32::from(known) / 127.0,
    };
    let normal = |n: &[u8]| Vector3::new(part(n[0]), part(n[1]), part(n[2]));
    let normals = packed.normals.as_deref().map(bytes).transpose()?;
    let colours = packed.colours.as_deref().map(bytes).transpose()?;
    let cloud = Cloud {
        points,
        normals: normals.map(|raw| raw.chunks_exact(3).map(normal).collect()),
        colours: colours.map(|raw| raw.chunks_exact(3).map(|c| [c[0], c[1], c[2]]).collect()),
        ..Cloud::default()
    };
    cloud.check().map_err(|e| e.to_string())?;
    Ok(cloud)
}
