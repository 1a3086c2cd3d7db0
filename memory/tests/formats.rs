//! Records of earlier formats stay readable.

use descry_memory::{Meta, Options, Query, Record, Sensing, perception::Cloud};
use nalgebra::{Isometry3, Point3};
use serde_json::json;
use std::path::Path;

/// Writes a record in the current format, as a sample for later versions.
#[test]
#[ignore = "makes the file of a new format: name its folder in DESCRY_FORMAT_DIR"]
fn make() {
    let dir = std::env::var("DESCRY_FORMAT_DIR").unwrap();
    let record =
        Record::create(Path::new(&dir), Options { robot: "r1".into(), ..Options::default() }).unwrap();
    record.put_transform(1000, "map", "camera", &Isometry3::translation(1.0 / 3.0, 0.0, 1.5)).unwrap();
    record.sync().unwrap();
    let cloud = Cloud::from_points(vec![Point3::new(0.1, 0.2, f32::NAN), Point3::new(-0.0, 1.0, 2.0)]);
    let seen = Meta { seen_from_m: Some([1.0, 2.0, 3.0]), body: json!({ "pose": "p3" }), ..Meta::default() };
    let id = record.put_cloud(1000, "camera", &cloud, &Sensing::default(), seen).unwrap();
    record.put_document("belief", 2000, json!({ "cup A": 0.97 }), vec![]).unwrap();
    record.pin(&[id], "belief").unwrap();
}

/// Opens a record of an earlier version, of which only the segment is left, and continues it.
#[test]
fn format_1_is_read_and_continued() {
    let dir = tempfile::tempdir().unwrap();
    let segments = dir.path().join("segments");
    std::fs::create_dir(&segments).unwrap();
    std::fs::write(segments.join("00000001.mcap"), include_bytes!("formats/1.mcap")).unwrap();
    let record = Record::open(dir.path(), Options::default()).unwrap();
    assert!(record.verify().unwrap().is_whole());
    let view = record.view_at(1000, "map").unwrap();
    let bits: Vec<u32> = view.cloud.points.iter().flat_map(|p| [p.x, p.y, p.z]).map(f32::to_bits).collect();
    let expected = [0.1, 0.2, f32::NAN, -0.0, 1.0, 2.0].map(f32::to_bits);
    assert_eq!(bits, expected);
    assert_eq!(view.world_from_camera, Isometry3::translation(1.0 / 3.0, 0.0, 1.5));
    let belief = record.newest("belief").unwrap().unwrap();
    assert_eq!((belief.body, belief.stamp_ns, belief.robot.as_str()), (json!({ "cup A": 0.97 }), 2000, "r1"));
    let near = descry_memory::Near { place_m: [1.0, 2.0, 3.1], radius_m: 0.2 };
    let seen = record.find(&Query { seen_from: Some(near), ..Query::default() }).unwrap();
    assert_eq!((seen.len(), &seen[0].body), (1, &json!({ "pose": "p3" })));
    assert!(record.store().pins().unwrap()[&seen[0].id].contains("belief"));
    let next = record.put_document("belief", 3000, json!({ "cup A": 0.99 }), vec![]).unwrap();
    assert!(next > belief.id);
}
