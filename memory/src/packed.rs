//! Clouds as short text: whole numbers of a unit from the lowest corner, in base64. What is read back packs to the same text.

use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use descry_perception::Cloud;
use nalgebra::{Point3, Vector3};
use serde::de::Error;
use serde::{Deserialize, Deserializer, Serialize, Serializer};

/// A tenth of a millimetre for what is small, a millimetre for what is not, metres.
const UNITS_M: [f64; 2] = [1e-4, 1e-3];
/// What stands for a part of a normal that is not known.
const UNKNOWN: i8 = i8::MIN;

/// How a cloud is written.
#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct Packed {
    unit_m: f64,
    /// The lowest corner, in units.
    low: [i64; 3],
    /// Three numbers of two bytes a point, the lower first.
    points: String,
    /// Three numbers of a byte a point, in parts of 127.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    normals: Option<String>,
    /// Red, green, blue.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    colours: Option<String>,
}

/// Writes a cloud of finite points, without grid and labels. Points farther than 65 m from its lowest corner are left out.
///
/// # Errors
/// Those of the writer.
pub fn serialize<S: Serializer>(cloud: &Cloud, writer: S) -> Result<S::Ok, S::Error> {
    pack(&cloud.finite()).serialize(writer)
}

/// Reads it back.
///
/// # Errors
/// What is no such text.
pub fn deserialize<'de, D: Deserializer<'de>>(reader: D) -> Result<Cloud, D::Error> {
    unpack(&Packed::deserialize(reader)?).map_err(D::Error::custom)
}

fn pack(cloud: &Cloud) -> Packed {
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

fn unpack(packed: &Packed) -> Result<Cloud, String> {
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

#[cfg(test)]
mod tests {
    use super::*;

    fn check(cloud: &Cloud, off_m: f32) {
        let text = serde_json::to_string(&pack(cloud)).unwrap();
        let back = unpack(&serde_json::from_str(&text).unwrap()).unwrap();
        assert_eq!(back.len(), cloud.len());
        let far = |(a, b): (&Point3<f32>, &Point3<f32>)| (a - b).abs().max() > off_m;
        assert!(!back.points.iter().zip(&cloud.points).any(far));
        assert_eq!(back.colours, cloud.colours);
        assert_eq!(serde_json::to_string(&pack(&back)).unwrap(), text);
    }

    #[test]
    fn clouds_come_back_and_pack_to_the_same_text() {
        let places = |scale: f32| -> Vec<Point3<f32>> {
            (0..200).map(|k| Point3::new(-0.31 + 0.0137 * k as f32, 0.02 * k as f32, 0.7) * scale).collect()
        };
        check(&Cloud::from_points(places(0.1)), 6e-5);
        check(&Cloud::from_points(places(4.0)), 6e-4);
        check(&Cloud::default(), 0.0);
        let normals = (0..200).map(|k| match k {
            7 => Vector3::new(f32::NAN, f32::NAN, f32::NAN),
            _ => Vector3::new((k as f32).sin(), (k as f32).cos(), 0.0),
        });
        let coloured = Cloud {
            normals: Some(normals.collect()),
            colours: Some((0..200).map(|k| [k as u8, 7, 200 - k as u8]).collect()),
            ..Cloud::from_points(places(0.1))
        };
        check(&coloured, 6e-5);
    }

    #[test]
    fn what_is_no_packed_cloud_is_refused() {
        let good = pack(&Cloud::from_points(vec![Point3::new(0.1, 0.2, 0.3)]));
        let bad = |change: fn(&mut Packed)| {
            let mut packed = pack(&Cloud::from_points(vec![Point3::new(0.1, 0.2, 0.3)]));
            change(&mut packed);
            unpack(&packed).is_err()
        };
        assert!(unpack(&good).is_ok());
        assert!(bad(|p| p.points = "AAAA".into()));
        assert!(bad(|p| p.points = "!".into()));
        assert!(bad(|p| p.unit_m = f64::NAN));
        assert!(bad(|p| p.colours = Some("AAAAAAAA".into())));
    }
}
