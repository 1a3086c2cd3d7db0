//! Tests of `packed`.

use descry_memory::packed::*;
use descry_perception::Cloud;
use nalgebra::{Point3, Vector3};

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
