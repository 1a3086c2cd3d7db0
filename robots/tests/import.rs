//! Recordings in published layouts: read as what they are, and wrong units and conventions named.

mod bags;
mod writers;

use descry_robots::Robot;
use descry_robots::input::InputError;
use descry_robots::nalgebra::{Isometry3, Matrix3, Rotation3, Translation3, UnitQuaternion, Vector3};
use descry_robots::recorded::CameraSettings;
use descry_robots::recorded::import::{Imported, Options};
use descry_robots::recorded::layouts::Asked;
use descry_robots::recorded::reading::{Axes, Given, Poses};
use descry_robots::recorded::{Footage, RecordedRobot, Recording};
use std::fs;
use std::path::Path;
use tempfile::TempDir;
use writers::{Shot, Writer, shots};

/// Every frame, however close.
fn all() -> Options {
    Options { spacing_m: Some(0.0), ..Options::default() }
}

fn imported(write: Writer, shots: &[Shot], options: &Options) -> Result<Imported, InputError> {
    let folder = TempDir::new().unwrap();
    write(folder.path(), shots);
    let imported = Imported::open(folder.path(), options)?;
    imported.write(&folder.path().join("own"), &mut |_, _| {})?;
    check_same(&imported, &folder.path().join("own"), shots);
    Ok(imported)
}

/// Frames as a body sees them, and as they are written in our own layout, are the shots.
fn check_same(imported: &Imported, own: &Path, shots: &[Shot]) {
    let written = Recording::open(own).unwrap();
    assert_eq!(
        (imported.frames.len(), written.frames.len()),
        (shots.len(), shots.len()),
        "{:?}",
        imported.notes
    );
    let to_first = |pose: &Isometry3<f64>, first: &Isometry3<f64>| first.inverse() * pose;
    for (i, shot) in shots.iter().enumerate() {
        let expected = to_first(&shot.world_from_camera, &shots[0].world_from_camera);
        let found = [
            to_first(&imported.frames[i].world_from_camera, &imported.frames[0].world_from_camera),
            to_first(&written.frames[i].world_from_camera, &written.frames[0].world_from_camera),
        ];
        for found in found {
            let off = found.inverse() * expected;
            assert!(off.translation.vector.norm() < 1e-3 && off.rotation.angle() < 1e-3, "frame {i}: {off}");
        }
        let depth_m = written.depth_m(&written.frames[i]).unwrap();
        let seen = imported.pixels(i).unwrap().cloud;
        let off = |(a, b): (&f32, &f32)| !(a.is_nan() && b.is_nan() || (a - b).abs() < 2e-3);
        let stored = depth_m.iter().zip(&shot.depth_m).filter(|pair| off(*pair)).count();
        let z: Vec<f32> = seen.points.iter().map(|p| p.z).collect();
        let looked = z.iter().zip(&shot.depth_m).filter(|pair| off(*pair)).count();
        assert_eq!((stored, looked), (0, 0), "frame {i} of {}", imported.layout.name);
    }
}

#[test]
fn every_layout_is_read_as_what_it_is() {
    let shots = shots();
    let bags: [(&str, Writer); 2] = [("rosbag", bags::mcap), ("rosbag", bags::sqlite)];
    for (name, write) in writers::ALL.into_iter().chain(bags) {
        let read = imported(write, &shots, &all()).unwrap_or_else(|e| panic!("{name}: {e}"));
        assert_eq!(read.layout.name, name);
        assert!(read.notes.iter().any(|n| n.contains("the views agree")), "{name}: {:?}", read.notes);
        let folder = TempDir::new().unwrap();
        write(folder.path(), &shots);
        let (_, notes) = RecordedRobot::open(folder.path()).unwrap_or_else(|e| panic!("{name}: {e}"));
        assert!(notes[0].contains(name), "{notes:?}");
    }
}

fn scaled(shots: &[Shot], factor: f64) -> Vec<Shot> {
    let mut shots = shots.to_vec();
    shots.iter_mut().for_each(|s| s.stated.translation.vector *= factor);
    shots
}

fn restated(shots: &[Shot], change: impl Fn(&Isometry3<f64>) -> Isometry3<f64>) -> Vec<Shot> {
    let mut shots = shots.to_vec();
    shots.iter_mut().for_each(|s| s.stated = change(&s.stated));
    shots
}

fn turned(rows: Matrix3<f64>) -> Isometry3<f64> {
    let rotation = UnitQuaternion::from_rotation_matrix(&Rotation3::from_matrix_unchecked(rows));
    Isometry3::from_parts(Translation3::identity(), rotation)
}

/// A mistake of whoever wrote the recording is found from how the views agree, mended, and said.
fn check_mended(shots: &[Shot], words: &[&str]) -> Imported {
    let read = imported(writers::tum, shots, &all()).unwrap_or_else(|e| panic!("{words:?}: {e}"));
    let said = read.notes.join("\n");
    assert!(words.iter().all(|w| said.contains(w)), "{words:?}: {said}");
    read
}

#[test]
fn wrong_units_and_conventions_are_told_from_the_views() {
    let right = shots();
    let read = check_mended(
        &restated(&right, Isometry3::inverse),
        &["--poses camera-from-world", "as the layout defines"],
    );
    assert_eq!((read.reading.poses, read.reading.axes), (Poses::CameraFromWorld, Axes::Optical));

    let opengl = turned(Matrix3::new(1.0, 0.0, 0.0, 0.0, -1.0, 0.0, 0.0, 0.0, -1.0));
    check_mended(&restated(&right, |pose| pose * opengl.inverse()), &["--axes opengl"]);

    let body = turned(Matrix3::new(0.0, -1.0, 0.0, 0.0, 0.0, -1.0, 1.0, 0.0, 0.0));
    check_mended(&restated(&right, |pose| pose * body), &["--axes body"]);

    check_mended(&scaled(&right, 1000.0), &["--pose-unit 0.001"]);
    check_mended(&scaled(&right, 1.0 / 0.0254), &["--pose-unit 0.0254"]);

    let mut millimetres = right.clone();
    millimetres.iter_mut().for_each(|s| s.depth_scale = Some(1000.0));
    check_mended(&millimetres, &["--depth-scale 1000"]);
}

#[test]
fn views_that_agree_in_no_way_are_refused_with_a_question() {
    let mut others = shots();
    let count = others.len();
    let poses: Vec<_> = others.iter().map(|s| s.stated).collect();
    others.iter_mut().enumerate().for_each(|(i, s)| s.stated = poses[(i * 3 + 1) % count]);
    let error =
        imported(writers::tum, &others, &all()).err().expect("they do not belong together").to_string();
    assert!(error.contains("do not agree") && error.contains("--poses"), "{error}");
    // Who knows better is believed, and told.
    let given = Given {
        poses: Some(Poses::WorldFromCamera),
        axes: Some(Axes::Optical),
        pose_unit_m: Some(1.0),
        depth_scale: Some(5000.0),
    };
    let folder = TempDir::new().unwrap();
    writers::tum(folder.path(), &others);
    let read = Imported::open(folder.path(), &Options { given, ..all() }).unwrap();
    assert!(read.notes.iter().any(|n| n.contains("read as you say")), "{:?}", read.notes);
}

#[test]
fn what_views_cannot_tell_is_said() {
    let still = vec![shots()[0].clone(); 2];
    let read = imported(writers::replica, &still, &all()).unwrap();
    assert!(read.notes.iter().any(|n| n.contains("could not be checked")), "{:?}", read.notes);
    let read = imported(writers::replica, &still[..1], &Options::default()).unwrap();
    assert_eq!(read.frames.len(), 1);
}

#[test]
fn positions_far_from_the_origin_are_recentred() {
    let far = restated(&shots(), |pose| Translation3::new(691_234.5, 5_334_567.25, 520.0) * pose);
    let read = imported(writers::tum, &far, &all()).unwrap();
    assert!(read.notes.iter().any(|n| n.contains("recentred")), "{:?}", read.notes);
    assert!(read.frames[0].world_from_camera.translation.vector.norm() < 1.0);
}

#[test]
fn frames_that_show_nothing_new_are_left_out() {
    let doubled: Vec<Shot> = shots().into_iter().flat_map(|s| [s.clone(), s]).collect();
    let folder = TempDir::new().unwrap();
    writers::scannet(folder.path(), &doubled);
    let read = Imported::open(folder.path(), &Options::default()).unwrap();
    assert_eq!(read.frames.len(), doubled.len() / 2, "{:?}", read.notes);
    assert!(read.notes.iter().any(|n| n.contains("are kept")), "{:?}", read.notes);
}

#[test]
fn a_body_from_a_bag_knows_what_is_up() {
    let folder = TempDir::new().unwrap();
    bags::mcap(folder.path(), &shots());
    let (robot, _) = RecordedRobot::open(&folder.path().join("drive_0.mcap")).unwrap();
    assert_eq!(robot.description().up, Some(Vector3::z()));
    // In the frame of the first camera z is forward, whatever the frame is called.
    let folder = TempDir::new().unwrap();
    let first = shots()[0].stated;
    bags::mcap(folder.path(), &restated(&shots(), |pose| first.inverse() * pose));
    let (robot, notes) = RecordedRobot::open(&folder.path().join("drive_0.mcap")).unwrap();
    assert_eq!(robot.description().up, None);
    assert!(notes.iter().any(|note| note.contains("up is told from the views")), "{notes:?}");
}

/// Points without pixels: told in which frame they are, and found where they are.
fn check_loose(write: Writer, words: &str) {
    let folder = TempDir::new().unwrap();
    write(folder.path(), &shots());
    let read = Imported::open(folder.path(), &all()).unwrap();
    let said = read.notes.join("\n");
    assert!(said.contains(words) && said.contains("the views agree"), "{said}");
    let table_m = |i: usize| {
        let cloud = read.pixels(i).unwrap().cloud.transformed(&read.frames[i].world_from_camera);
        let near = cloud.points.iter().filter(|p| (p.z - 0.72).abs() < 0.02).count();
        near as f64 / cloud.count_finite() as f64
    };
    assert!((0..read.frames.len()).all(|i| table_m(i) > 0.05), "the top of the table is where it is");
}

#[test]
fn the_frame_of_points_is_told_from_the_views() {
    check_loose(writers::loose_pcds, "points in the world");
    check_loose(writers::loose_pcds_of_the_sensor, "points in the frame of the sensor");
    let folder = TempDir::new().unwrap();
    let same = restated(&shots(), |_| Isometry3::identity());
    writers::pcds(folder.path(), &same);
    let error = Imported::open(folder.path(), &all()).err().unwrap().to_string();
    assert!(error.contains("same VIEWPOINT"), "{error}");
}

/// A merged cloud has no viewpoint: nothing is known of the space between its points.
#[test]
fn a_merged_cloud_is_no_body() {
    let folder = TempDir::new().unwrap();
    let merged = restated(&shots()[..1], |_| Isometry3::identity());
    writers::loose_pcds_of_the_sensor(folder.path(), &merged);
    let error = Imported::open(folder.path(), &all()).err().unwrap().to_string();
    assert!(
        error.contains("from where its points were seen") && error.contains("descry recognise"),
        "{error}"
    );
}

/// Checks the message for a bag with some messages changed.
fn check_bag(change: impl Fn(&mut Vec<bags::Message>), options: &Options, words: &[&str]) {
    let folder = TempDir::new().unwrap();
    let file = folder.path().join("a.mcap");
    let mut messages = bags::messages(&shots(), false);
    change(&mut messages);
    bags::write_mcap(&file, &messages);
    let text = match Imported::open(&file, options) {
        Ok(read) => read.notes.join("\n"),
        Err(error) => error.to_string(),
    };
    assert!(words.iter().all(|word| text.contains(word)), "{words:?} in: {text}");
}

#[test]
fn what_a_bag_lacks_is_named() {
    let without = |topic: &'static str| move |all: &mut Vec<bags::Message>| all.retain(|m| m.topic != topic);
    check_bag(
        without("/tf_static"),
        &all(),
        &["from the camera's frame camera_optical", "base_link", "record /tf"],
    );
    check_bag(without("/camera/depth/image_raw"), &all(), &["no depth images", "16UC1"]);
    check_bag(
        without("/camera/depth/camera_info"),
        &all(),
        &["no camera_info", "record /camera/depth/camera_info"],
    );
    let late = |all: &mut Vec<bags::Message>| {
        let last = all.iter().rposition(|m| m.topic == "/tf").unwrap();
        all.remove(last);
    };
    check_bag(late, &all(), &["1 frames are left out", "camera_optical to map"]);
    let cut = |all: &mut Vec<bags::Message>| all.iter_mut().for_each(|m| m.data.truncate(m.data.len() - 9));
    check_bag(cut, &all(), &["a.mcap, a message of /tf_static", "damaged"]);
    let twice = |all: &mut Vec<bags::Message>| {
        let more = bags::messages(&shots(), true).into_iter().filter(|m| m.topic.ends_with("image_raw"));
        all.extend(more.map(|m| bags::Message { topic: "/other/image", ..m }));
    };
    check_bag(twice, &all(), &["several topics", "/other/image", "--topic"]);
    let asked = Asked { topic: Some("/camera/depth/image_raw".into()), ..Asked::default() };
    check_bag(twice, &Options { asked, ..all() }, &["the views agree"]);
}

#[test]
fn a_cut_or_lying_bag_is_refused() {
    let folder = TempDir::new().unwrap();
    bags::mcap(folder.path(), &shots());
    let file = folder.path().join("drive_0.mcap");
    let bytes = fs::read(&file).unwrap();
    let refused = |bytes: &[u8]| {
        fs::write(&file, bytes).unwrap();
        Imported::open(&file, &all()).err().unwrap().to_string()
    };
    assert!(refused(&bytes[..bytes.len() / 2]).contains("beyond the end of the file"));
    assert!(refused(b"no bag at all").contains("not those of MCAP"));
    let mut lying = bytes.clone();
    lying[9..17].copy_from_slice(&u64::MAX.to_le_bytes());
    assert!(refused(&lying).contains("byte 8"), "{}", refused(&lying));
    fs::write(folder.path().join("a.db3"), b"no database").unwrap();
    let error = Imported::open(&folder.path().join("a.db3"), &all()).err().unwrap().to_string();
    assert!(error.contains("cannot be read as a bag"), "{error}");
}

/// Checks the message for one fault in a folder.
fn check_mistake(write: Writer, spoil: &dyn Fn(&Path), line: usize, words: &[&str]) {
    let folder = TempDir::new().unwrap();
    write(folder.path(), &shots());
    spoil(folder.path());
    let error =
        Imported::open(folder.path(), &all()).err().unwrap_or_else(|| panic!("nothing was said: {words:?}"));
    let text = error.to_string();
    assert_eq!(error.line, line, "{text}");
    assert!(words.iter().all(|word| text.contains(word)), "{words:?} in: {text}");
}

fn put(name: &'static str, text: &'static str) -> impl Fn(&Path) {
    move |folder: &Path| fs::write(folder.join(name), text).unwrap()
}

fn gone(name: &'static str) -> impl Fn(&Path) {
    move |folder: &Path| fs::remove_file(folder.join(name)).unwrap()
}

#[test]
fn mistakes_are_named() {
    use writers::{bop, redwood, replica, scannet, seven_scenes, tum};
    check_mistake(
        tum,
        &put("groundtruth.txt", "# stamp\n1 0 0 0 0 0 1\n"),
        2,
        &["groundtruth.txt:2", "7 numbers", "expected 8"],
    );
    check_mistake(
        tum,
        &put("groundtruth.txt", "900 0 0 0 0 0 0 1\n901 0 0 0 0 0 0 1\n"),
        0,
        &["from 900 to 901", "one clock"],
    );
    check_mistake(tum, &put("depth.txt", "1.5\n"), 1, &["depth.txt:1", "the file of an image"]);
    check_mistake(tum, &gone("calibration.txt"), 0, &["which camera", "--camera FX,FY,CX,CY"]);
    check_mistake(tum, &put("calibration.txt", "525 525 319"), 0, &["fx fy cx cy"]);
    check_mistake(
        bop,
        &put("scene_camera.json", "{\"0\":\n {\"cam_K\": [1, 2]}}"),
        2,
        &["scene_camera.json:2", "length"],
    );
    let no_pose = "{\"0\": {\"cam_K\": [50, 0, 20, 0, 50, 15, 0, 0, 1], \"depth_scale\": 1}}";
    check_mistake(bop, &put("scene_camera.json", no_pose), 0, &["image 000000", "cam_R_w2c", "missing"]);
    check_mistake(scannet, &put("pose/1.txt", "1 0 0 0\n0 1 0\n"), 2, &["pose/1.txt:2", "3 numbers"]);
    check_mistake(scannet, &put("intrinsic/intrinsic_depth.txt", "50 0\n"), 1, &["fx 0 cx"]);
    check_mistake(seven_scenes, &|_| (), 0, &["which camera", "--camera"]);
    check_mistake(redwood, &put("trajectory.log", "0 0 1\n1 0 0 0\n"), 2, &["four lines of a matrix"]);
    check_mistake(redwood, &put("trajectory.log", "0 0\n1 0 0 0\n"), 1, &["2 numbers", "three whole ones"]);
    check_mistake(replica, &put("traj.txt", "1 0 0 0 0 1 0 0 0 0 1 0 0 0 0 1\n"), 1, &["1 poses for 6"]);
    check_mistake(
        replica,
        &put("results/depth000002.png", "no picture"),
        0,
        &["depth000002.png", "is no image"],
    );
}

#[test]
fn a_recording_is_asked_for_by_its_folder() {
    let folder = TempDir::new().unwrap();
    let error = |path: &Path, options: &Options| Imported::open(path, options).err().unwrap().to_string();
    assert!(error(folder.path(), &all()).contains("7-scenes"), "all layouts are listed");
    fs::create_dir(folder.path().join("scene")).unwrap();
    writers::replica(&folder.path().join("scene"), &shots());
    assert!(error(folder.path(), &all()).contains("give one of them"));
    assert!(error(&folder.path().join("nowhere"), &all()).contains("no such"));
    let layout = Asked { layout: Some("kitti".into()), ..Asked::default() };
    assert!(error(folder.path(), &Options { asked: layout, ..all() }).contains("no layout is called kitti"));
    // A camera that is given stands for the one that is missing.
    let plain = TempDir::new().unwrap();
    writers::seven_scenes(plain.path(), &shots());
    let camera = CameraSettings { ..shots()[0].camera };
    let asked = Asked { camera: Some(camera), ..Asked::default() };
    assert_eq!(
        Imported::open(plain.path(), &Options { asked, ..all() }).unwrap().settings.camera,
        Some(camera)
    );
    // What is there is not overwritten.
    let own = TempDir::new().unwrap();
    fs::write(own.path().join("mine"), "").unwrap();
    let read = Imported::open(&folder.path().join("scene"), &all()).unwrap();
    assert!(read.write(own.path(), &mut |_, _| {}).unwrap_err().to_string().contains("not empty"));
}
