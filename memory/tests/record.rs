//! Recording and reading through [`Record`].

use descry_memory::perception::{Cloud, Grid, Intrinsics};
use descry_memory::transforms::TransformError;
use descry_memory::viewer::{self, Labelled};
use descry_memory::{
    Blob, Draft, Error, Form, Image, LogLevel, Meta, Options, Query, Record, Retention, Sensing, kind,
};
use nalgebra::{Isometry3, Point3, Translation3, UnitQuaternion, Vector3};
use serde_json::json;
use std::path::Path;
use std::process::Command;

const S: i64 = 1_000_000_000;

fn cloud(seed: f32) -> Cloud {
    let nan = f32::NAN;
    let points = vec![
        Point3::new(seed, 0.1, 1.0),
        Point3::new(nan, nan, nan),
        Point3::new(0.0, -seed, 2.5),
        Point3::new(seed, seed, seed),
    ];
    Cloud { points, grid: Some(Grid { width: 2, height: 2 }), ..Cloud::default() }
}

fn bits(cloud: &Cloud) -> Vec<[u32; 3]> {
    cloud.points.iter().map(|p| [p.x.to_bits(), p.y.to_bits(), p.z.to_bits()]).collect()
}

fn turn(x: f64, yaw: f64) -> Isometry3<f64> {
    Isometry3::from_parts(
        Translation3::new(x, 0.0, 0.5),
        UnitQuaternion::from_scaled_axis(Vector3::z() * yaw),
    )
}

/// A robot that drives and turns for six seconds with its pose ten times a second and a cloud every half.
fn drive(record: &Record) {
    let camera = Intrinsics { width: 2, height: 2, fx: 1.0, fy: 1.0, cx: 0.5, cy: 0.5 };
    let sensing = Sensing { intrinsics: Some(camera), pose_sigma_m: 0.03, pose_sigma_rad: 0.035 };
    record.put_static_transform("base", "camera", &turn(0.2, 0.0)).unwrap();
    for i in 0..=60 {
        let stamp_ns = i * S / 10;
        record.put_transform(stamp_ns, "map", "base", &turn(i as f64 * 0.1, i as f64 * 0.02)).unwrap();
        if i % 5 == 2 {
            let meta = Meta { body: json!({ "pose": i }), ..Meta::default() };
            // Clouds come between two poses.
            record.put_cloud(stamp_ns + S / 20, "camera", &cloud(i as f32), &sensing, meta).unwrap();
        }
    }
}

fn check_view(record: &Record, stamp_ns: i64, expected: i64) {
    let view = record.view_at(stamp_ns, "map").unwrap();
    assert_eq!(view.stamp_ns, expected * S / 10 + S / 20);
    assert_eq!(bits(&view.cloud), bits(&cloud(expected as f32)));
    assert_eq!((view.cloud.grid, view.pose_sigma_rad), (Some(Grid { width: 2, height: 2 }), 0.035));
    assert_eq!(view.intrinsics.unwrap().width, 2);
    let between = (expected as f64 + 0.5) * 0.1;
    let pose = turn(between, between * 0.2) * turn(0.2, 0.0);
    assert!((view.world_from_camera.to_homogeneous() - pose.to_homogeneous()).norm() < 1e-12, "{expected}");
}

#[test]
fn views_come_back_with_the_transforms_of_their_time() {
    let dir = tempfile::tempdir().unwrap();
    let place = dir.path().join("record");
    let record = Record::create(&place, Options::default()).unwrap();
    drive(&record);
    // Before anything is synced, afterwards, and from the disk alone.
    for (stamp_ns, expected) in [(S / 5, 2), (3 * S, 27), (59 * S / 10, 57)] {
        check_view(&record, stamp_ns, expected);
    }
    record.sync().unwrap();
    check_view(&record, 3 * S + S / 3, 32);
    drop(record);
    let record = Record::open(&place, Options::default()).unwrap();
    check_view(&record, S / 5, 2);
    check_view(&record, 3 * S + S / 3, 32);
    assert!(matches!(record.view_at(10 * S, "map"), Err(Error::NotNear { nearest_ns: Some(_), .. })));
    let off = record.view_at(S, "odom").unwrap_err();
    assert!(matches!(off, Error::Transform(TransformError::UnknownFrame { .. })), "{off}");
    let late = record.transform("map", "base", 9 * S).unwrap_err().to_string();
    assert!(late.contains("the last is 3.000 s earlier"), "{late}");
    let newest = record.newest(kind::CLOUD).unwrap().unwrap();
    assert_eq!(newest.body, json!({ "pose": 57 }));
    // Two seconds of one child make one document.
    let groups = record.find(&Query::of_kind(kind::TRANSFORMS)).unwrap();
    let spans: Vec<_> = groups.iter().map(|d| (d.stamp_ns * 10 / S, d.end_ns.unwrap() * 10 / S)).collect();
    assert_eq!(spans, [(0, 19), (20, 39), (40, 59), (60, 60)]);
}

#[test]
fn transforms_in_any_order_and_from_several_sources() {
    let dir = tempfile::tempdir().unwrap();
    let record = Record::create(&dir.path().join("record"), Options::default()).unwrap();
    // The wheel is told late, in blocks, and against the order of time.
    for block in [3, 1, 2, 0] {
        for i in (0..10).rev() {
            let stamp_ns = (block * 10 + i) * S / 5;
            record.put_transform(stamp_ns, "base", "wheel", &turn(stamp_ns as f64 * 1e-9, 0.0)).unwrap();
        }
    }
    for stamp_ns in [0, S / 10, 3 * S + S / 7, 39 * S / 5] {
        let x = record.transform("base", "wheel", stamp_ns).unwrap().translation.x;
        assert!((x - stamp_ns as f64 * 1e-9).abs() < 1e-9, "{stamp_ns}: {x}");
    }
    let nonsense = record.put_transform(-1, "base", "wheel", &turn(0.0, 0.0));
    assert!(matches!(nonsense, Err(Error::Input { .. })));
}

#[test]
fn a_transform_is_recalled_bit_for_bit() {
    let dir = tempfile::tempdir().unwrap();
    let place = dir.path().join("record");
    let pose = turn(1.0 / 3.0, 2.0 / 7.0) * turn(-0.0, 1e-300);
    let record = Record::create(&place, Options::default()).unwrap();
    record.put_transform(S, "map", "base", &pose).unwrap();
    drop(record);
    let back = Record::open(&place, Options::default()).unwrap().transform("map", "base", S).unwrap();
    let numbers = |p: &Isometry3<f64>| -> Vec<u64> {
        p.translation.vector.iter().chain(p.rotation.coords.iter()).map(|v| v.to_bits()).collect()
    };
    assert_eq!(numbers(&back), numbers(&pose));
}

/// One record of every form.
fn one_of_each(place: &Path) -> Record {
    let record = Record::create(place, Options { segment_bytes: 64 << 10, ..Options::default() }).unwrap();
    drive(&record);
    let png = [0x89, b'P', b'N', b'G'];
    record.put_image(S, "eye", Image::Compressed { format: "png", data: &png }, Meta::default()).unwrap();
    let raw = Image::Raw { width: 3, height: 2, encoding: "16UC1", data: &[7; 12] };
    record.put_image(2 * S, "eye", raw, Meta::default()).unwrap();
    record
        .put_log(3 * S, LogLevel::Warning, "agent", "cup A is hidden: \u{201c}behind\u{201d} the box")
        .unwrap();
    record.put_document("plan", 4 * S, json!({ "steps": ["(move a b)", null, 0.1] }), vec![]).unwrap();
    let cup = Labelled {
        id: "7".into(),
        text: "cup A 0.98".into(),
        frame_from_box: Isometry3::translation(1.0, 2.0, 0.77),
        size_m: Vector3::new(0.07, 0.08, 0.104),
        colour: [0.2, 0.8, 0.3, 0.5],
    };
    let blobs = vec![
        viewer::boxes(5 * S, "map", "objects", &[cup]),
        viewer::grid(5 * S, "map", [-2.5, -1.0], 0.05, 3, &[0, 1, 0, 0, 0, 1]),
    ];
    record.put(Draft { blobs, frame: "map".into(), ..Draft::new("belief", 5 * S) }).unwrap();
    let merged = Cloud { colours: Some(vec![[9, 8, 7]; 4]), ..cloud(0.25) };
    let blobs = vec![viewer::cloud("merged", &merged)];
    record.put(Draft { blobs, frame: "map".into(), ..Draft::new("percepts", 5 * S) }).unwrap();
    let blobs = vec![viewer::plan(5 * S, "0.000: (move a b) [3.200]\n3.201: (observe b table) [9.000]")];
    record.put(Draft { blobs, ..Draft::new("event", 5 * S) }).unwrap();
    let camera = Intrinsics { width: 640, height: 480, fx: 525.0, fy: 526.0, cx: 319.5, cy: 239.5 };
    let sensing = Sensing { intrinsics: Some(camera), ..Sensing::default() };
    record.put_cloud(5 * S, "left", &cloud(0.0), &sensing, Meta::default()).unwrap();
    for i in 0..200 {
        let points = (0..100).map(|k| Point3::new(k as f32, i as f32, 0.0)).collect();
        let coloured = Cloud { colours: Some(vec![[1, 2, 3]; 100]), ..Cloud::from_points(points) };
        record.put_cloud(6 * S + i, "side", &coloured, &Sensing::default(), Meta::default()).unwrap();
    }
    record.sync().unwrap();
    record
}

#[test]
fn segments_are_mcap_to_another_reader() {
    let dir = tempfile::tempdir().unwrap();
    drop(one_of_each(dir.path()));
    let mut topics = std::collections::BTreeMap::new();
    for entry in std::fs::read_dir(dir.path().join("segments")).unwrap() {
        let bytes = std::fs::read(entry.unwrap().path()).unwrap();
        let summary = mcap::Summary::read(&bytes).unwrap().expect("a summary");
        let stats = summary.stats.as_ref().expect("statistics");
        let mut messages = 0;
        for message in mcap::MessageStream::new(&bytes).unwrap() {
            let message = message.unwrap();
            let schema = message.channel.schema.as_ref().expect("a schema");
            topics.insert(message.channel.topic.clone(), (schema.name.clone(), schema.encoding.clone()));
            messages += 1;
        }
        assert_eq!(messages, stats.message_count);
        // The same messages by way of the indexes.
        let mut indexed = 0;
        for chunk in &summary.chunk_indexes {
            for (channel, entries) in summary.read_message_indexes(&bytes, chunk).unwrap() {
                for entry in entries {
                    let message = summary.seek_message(&bytes, chunk, &entry).unwrap();
                    assert_eq!(
                        (message.channel.topic.as_str(), message.log_time),
                        (channel.topic.as_str(), entry.log_time)
                    );
                    indexed += 1;
                }
            }
        }
        assert_eq!(indexed, messages);
    }
    let expected = [
        ("/cloud/camera", "foxglove.PointCloud"),
        ("/cloud/side", "foxglove.PointCloud"),
        ("/cloud/map/merged", "foxglove.PointCloud"),
        ("/calibration/left", "foxglove.CameraCalibration"),
        ("/document/plan", "descry.Document"),
        ("/grid/map", "foxglove.Grid"),
        ("/image/eye", "foxglove.RawImage"),
        ("/log", "foxglove.Log"),
        ("/objects", "foxglove.SceneUpdate"),
        ("/plan", "foxglove.Log"),
        ("/tf", "foxglove.FrameTransforms"),
    ];
    for (topic, schema) in expected {
        let encoding = if schema.starts_with("foxglove") { "protobuf" } else { "jsonschema" };
        assert_eq!(topics.get(topic), Some(&(schema.into(), encoding.into())), "{topic} in {topics:?}");
    }
}

#[test]
fn everything_goes_into_one_file_in_the_order_of_time() {
    let dir = tempfile::tempdir().unwrap();
    let record = one_of_each(&dir.path().join("record"));
    let all = dir.path().join("all.mcap");
    let exported = record.export(&Query::default(), &all).unwrap();
    assert_eq!(exported.records, record.stats().unwrap().records);
    let bytes = std::fs::read(&all).unwrap();
    assert_eq!(exported.bytes, bytes.len() as u64);
    let summary = mcap::Summary::read(&bytes).unwrap().expect("a summary");
    let times: Vec<u64> = mcap::MessageStream::new(&bytes).unwrap().map(|m| m.unwrap().log_time).collect();
    assert!(times.is_sorted());
    assert_eq!(summary.stats.unwrap().message_count, times.len() as u64);
    // Clouds are the same bytes as in the record.
    let clouds: Vec<Vec<u8>> = mcap::MessageStream::new(&bytes)
        .unwrap()
        .map(Result::unwrap)
        .filter(|m| m.channel.topic == "/cloud/side")
        .map(|m| m.data.into_owned())
        .collect();
    let side = Query { frame: Some("side".into()), ..Query::of_kind(kind::CLOUD) };
    for (message, document) in clouds.iter().zip(record.find(&side).unwrap()) {
        assert!(message.ends_with(&record.store().blob(document.id, "cloud").unwrap()));
    }
    assert_eq!(clouds.len(), 200);
    let few = Query { limit: Some(3), ..side };
    assert_eq!(record.export(&few, &dir.path().join("few.mcap")).unwrap().records, 3);
    assert!(record.export(&few, &all).is_err(), "what is there is not written over");
}

#[test]
fn what_is_held_follows_what_is_cited() {
    let dir = tempfile::tempdir().unwrap();
    let record = Record::create(dir.path(), Options::default()).unwrap();
    let ids: Vec<_> = (0..3).map(|i| record.put(Draft::new("scan", i)).unwrap()).collect();
    record.hold(&ids[..2], "belief").unwrap();
    record.hold(&ids[1..], "belief").unwrap();
    assert!(record.hold(&[ids[0], descry_memory::RecordId(1 << 40)], "belief").is_err());
    let held: Vec<_> = record.store().pins().unwrap().into_keys().filter(|id| ids.contains(id)).collect();
    assert_eq!(held, ids[1..]);
}

/// A pinned cloud can still be placed after a size limit has pruned everything else.
#[test]
fn a_cloud_that_is_held_keeps_its_place() {
    let dir = tempfile::tempdir().unwrap();
    let retention = Retention { max_bytes: Some(1 << 20), ..Retention::default() };
    let record = Record::create(dir.path(), Options { retention, ..Options::default() }).unwrap();
    record.put_static_transform("base", "camera", &turn(0.2, 0.0)).unwrap();
    let clouds: Vec<_> = (1..=2)
        .map(|i| {
            record.put_transform(i * 10 * S, "map", "base", &turn(i as f64, 0.1)).unwrap();
            record.sync().unwrap();
            record
                .put_cloud(i * 10 * S, "camera", &cloud(i as f32), &Sensing::default(), Meta::default())
                .unwrap()
        })
        .collect();
    record.hold(&clouds[1..], "belief").unwrap();
    let data = vec![7_u8; 64 << 10];
    for i in 0..100 {
        let ballast =
            Blob { name: "b".into(), form: Form::Bytes, layout: json!(null), data: data.as_slice().into() };
        record.put_document("ballast", 30 * S + i, json!(i), vec![ballast]).unwrap();
    }
    assert!(record.view_at(10 * S, "map").is_err(), "what nobody holds goes");
    let view = record.view_at(20 * S, "map").unwrap();
    assert_eq!(bits(&view.cloud), bits(&cloud(2.0)));
    assert!(
        (view.world_from_camera.inverse() * turn(2.0, 0.1) * turn(0.2, 0.0)).translation.vector.norm()
            < 1e-12
    );
}

/// Reads every message with the packages `mcap` and `mcap-protobuf-support`, if `python3`, or the Python in
/// `DESCRY_MCAP_PYTHON`, has them.
#[test]
fn segments_are_mcap_to_python() {
    let python = std::env::var("DESCRY_MCAP_PYTHON").unwrap_or_else(|_| "python3".into());
    let has = Command::new(&python).args(["-c", "import mcap, mcap_protobuf"]).output();
    if !has.is_ok_and(|o| o.status.success()) {
        println!(
            "skipped: {python} has no packages mcap and mcap-protobuf-support; DESCRY_MCAP_PYTHON names another"
        );
        return;
    }
    let dir = tempfile::tempdir().unwrap();
    let record = one_of_each(dir.path());
    let records = record.stats().unwrap().records;
    drop(record);
    let script = include_str!("python/read_all.py");
    let out = Command::new(&python).args(["-c", script]).arg(dir.path()).output().unwrap();
    let (said, errors) = (String::from_utf8_lossy(&out.stdout), String::from_utf8_lossy(&out.stderr));
    assert!(out.status.success(), "{errors}");
    assert_eq!(said.trim(), format!("{records} (0.0, 199.0, 0.0)"));
}

#[test]
fn a_view_is_in_the_record_with_its_place_or_not_at_all() {
    let folder = tempfile::tempdir().unwrap();
    let record = Record::create(folder.path(), Options::default()).unwrap();
    let count = || Record::open_shared(folder.path()).unwrap().stats().unwrap().records;
    record.put_document("note", 0, json!({}), Vec::new()).unwrap();
    record.put_soon(Draft::new("answer", S)).unwrap();
    record.put_transform_soon(S, "map", "camera", &turn(1.0, 0.1)).unwrap();
    let image = Image::Compressed { format: "png", data: b"no png" };
    record.put_image_soon(S, "camera", image, Meta::default()).unwrap();
    // Whoever pulls the plug now takes all of the view along.
    assert_eq!(count(), 1);
    record.put_cloud(S, "camera", &cloud(1.0), &Sensing::default(), Meta::default()).unwrap();
    assert_eq!(count(), 5);
    assert_eq!(record.view_at(S, "map").unwrap().world_from_camera, turn(1.0, 0.1));
}

#[test]
fn what_stood_elsewhere_does_not_place_what_is_recorded_later() {
    let folder = tempfile::tempdir().unwrap();
    let record = Record::create(folder.path(), Options::default()).unwrap();
    record.put_transform(S, "map", "camera", &turn(1.0, 0.1)).unwrap();
    record.sync().unwrap();
    drop(record);
    let record = Record::resume(folder.path(), Options::default()).unwrap();
    record.put_transform_soon(S, "map", "camera", &turn(1.0, 0.1)).unwrap();
    for other in [turn(1.0, 0.2), turn(1.1, 0.1)] {
        let refused = record.put_transform_soon(S, "map", "camera", &other).unwrap_err();
        assert!(refused.to_string().contains("camera stood elsewhere in map"), "{refused}");
    }
}

#[test]
fn what_cannot_be_an_image_or_a_cloud_is_refused() {
    let dir = tempfile::tempdir().unwrap();
    let record = Record::create(dir.path(), Options::default()).unwrap();
    for (width, height, bytes) in [(3, 2, 11), (0, 2, 12), (3, 0, 12), (3, 2, 0), (5, 2, 12)] {
        let image = Image::Raw { width, height, encoding: "mono8", data: &vec![0; bytes] };
        assert!(
            matches!(record.put_image(0, "eye", image, Meta::default()), Err(Error::Input { .. })),
            "{width} {height} {bytes}"
        );
    }
    let odd = Cloud { colours: Some(vec![]), ..cloud(1.0) };
    assert!(matches!(
        record.put_cloud(0, "eye", &odd, &Sensing::default(), Meta::default()),
        Err(Error::Input { .. })
    ));
    let id = record.put(Draft::new("note", 5)).unwrap();
    let document = record.store().get(id).unwrap();
    assert!(matches!(record.cloud(&document), Err(Error::NoBlob { .. })));
    assert!(matches!(record.view(&document, "map"), Err(Error::NoBlob { .. })));
}
