//! Simulated frames, written in published layouts.

use descry_robots::image::{ImageBuffer, Luma};
use descry_robots::nalgebra::{Isometry3, Point3};
use descry_robots::perception::{Cloud, Intrinsics};
use descry_robots::recorded::CameraSettings;
use descry_robots::sim::{DepthNoise, SceneSpec, SimOptions, SimRobot, arrange};
use descry_robots::{Place, Pose2, Robot, Watch};
use std::fmt::Write as _;
use std::fs;
use std::path::Path;
use std::sync::OnceLock;

const SCENE: &str = crate::scenes::on_a_table!(
    r#"[start]
position_m = [-2.0, 0.0]
[[object]]
name = "cup"
shape.cup = { diameter_m = 0.08, height_m = 0.12 }
position_m = [0.1, 0.05]
[[object]]
name = "box"
shape.box = { size_m = [0.2, 0.2, 0.3] }
position_m = [-0.4, 0.1]
"#
);

/// Every so many pixels of the camera are written.
const EVERY: usize = 4;
const FROM: [[f64; 2]; 6] = [[-1.6, -0.9], [-1.9, -0.5], [-2.0, 0.0], [-1.9, 0.5], [-1.5, 0.9], [-1.1, 1.2]];

/// A frame with its true pose, and the pose and depth scale that a writer states.
#[derive(Clone)]
pub struct Shot {
    pub world_from_camera: Isometry3<f64>,
    pub stated: Isometry3<f64>,
    pub depth_m: Vec<f32>,
    pub size: (usize, usize),
    pub camera: CameraSettings,
    pub depth_scale: Option<f64>,
}

pub type Writer = fn(&Path, &[Shot]);

/// Writers of the layouts that state their camera.
pub const ALL: [(&str, Writer); 7] = [
    ("tum", tum),
    ("bop", bop),
    ("scannet", scannet),
    ("redwood", redwood),
    ("replica", replica),
    ("pcd", pcds),
    ("pcd", pcds_of_the_world),
];

/// Views of a table from a half circle around it.
pub fn shots() -> Vec<Shot> {
    static SHOTS: OnceLock<Vec<Shot>> = OnceLock::new();
    SHOTS.get_or_init(|| std::thread::spawn(taken).join().unwrap()).clone()
}

fn taken() -> Vec<Shot> {
    let mut options =
        SimOptions { noise: DepthNoise { scale: 0.0, ..DepthNoise::default() }, ..SimOptions::default() };
    (options.localisation.sigma_m, options.localisation.sigma_rad) = (0.0, 0.0);
    let robot = SimRobot::new(arrange(&SceneSpec::parse("scene.toml", SCENE).unwrap(), 1).unwrap(), options);
    let runtime = tokio::runtime::Builder::new_current_thread().enable_all().build().unwrap();
    let watch = Watch::default();
    let shot = |from: [f64; 2]| {
        let at = Point3::new(0.0, 0.0, 0.75);
        let sensed = runtime.block_on(async {
            let place = Place::Pose(Pose2::facing(from[0], from[1], &at.xy()));
            robot.drive_to(&place, &watch).await.unwrap();
            robot.look_at(&at, &watch).await.unwrap();
            robot.sense(&watch).await.unwrap()
        });
        let c = sensed.intrinsics;
        let rows = (0..c.height).step_by(EVERY);
        let pixels =
            rows.flat_map(|row| (0..c.width).step_by(EVERY).map(move |column| row * c.width + column));
        // As whole millimetres, which every layout can hold to its own unit.
        let depth_m = pixels.map(|pixel| (sensed.depth_m[pixel] * 1000.0).round() / 1000.0).collect();
        let [fx, fy, cx, cy] = [c.fx, c.fy, c.cx, c.cy].map(|v| v / EVERY as f64);
        Shot {
            world_from_camera: sensed.map_from_camera,
            stated: sensed.map_from_camera,
            depth_m,
            size: (c.width / EVERY, c.height / EVERY),
            camera: CameraSettings { fx, fy, cx, cy },
            depth_scale: None,
        }
    };
    FROM.into_iter().map(shot).collect()
}

fn write(path: &Path, text: &str) {
    fs::create_dir_all(path.parent().unwrap()).unwrap();
    fs::write(path, text).unwrap();
}

/// Writes a depth image in units of the layout, or of the shot.
fn depth(path: &Path, shot: &Shot, scale: f64) {
    fs::create_dir_all(path.parent().unwrap()).unwrap();
    let scale = shot.depth_scale.unwrap_or(scale);
    let unit = |d: &f32| if d.is_finite() { (f64::from(*d) * scale).round() as u16 } else { 0 };
    let (width, height) = (shot.size.0 as u32, shot.size.1 as u32);
    let pixels = shot.depth_m.iter().map(unit).collect();
    ImageBuffer::<Luma<u16>, Vec<u16>>::from_raw(width, height, pixels).unwrap().save(path).unwrap();
}

fn rows(pose: &Isometry3<f64>) -> String {
    let mut text = String::new();
    for row in pose.to_homogeneous().row_iter() {
        writeln!(text, "{} {} {} {}", row[0], row[1], row[2], row[3]).unwrap();
    }
    text
}

/// TUM RGB-D, whose trajectory has stamps between those of the images.
pub fn tum(folder: &Path, shots: &[Shot]) {
    let (mut trajectory, mut list) = ("# timestamp tx ty tz qx qy qz qw\n".to_string(), String::new());
    for (i, shot) in shots.iter().enumerate() {
        let stamp_s = 1000.0 + i as f64;
        let (t, q) = (shot.stated.translation.vector, shot.stated.rotation.coords);
        for part_s in [-0.02, 0.02] {
            let stamp_s = stamp_s + part_s;
            writeln!(trajectory, "{stamp_s:.4} {} {} {} {} {} {} {}", t.x, t.y, t.z, q.x, q.y, q.z, q.w)
                .unwrap();
        }
        writeln!(list, "{stamp_s:.4} depth/{stamp_s:.4}.png").unwrap();
        depth(&folder.join(format!("depth/{stamp_s:.4}.png")), shot, 5000.0);
    }
    write(&folder.join("groundtruth.txt"), &trajectory);
    write(&folder.join("depth.txt"), &list);
    let CameraSettings { fx, fy, cx, cy } = shots[0].camera;
    write(&folder.join("calibration.txt"), &format!("{fx} {fy} {cx} {cy}\n"));
}

/// A scene of the BOP challenge, with a depth image in fifths of a millimetre.
pub fn bop(folder: &Path, shots: &[Shot]) {
    let mut entries = Vec::new();
    for (i, shot) in shots.iter().enumerate() {
        let inverse = shot.stated.inverse().to_homogeneous();
        let r: Vec<f64> = (0..9).map(|k| inverse[(k / 3, k % 3)]).collect();
        let t: Vec<f64> = (0..3).map(|k| inverse[(k, 3)] * 1000.0).collect();
        let CameraSettings { fx, fy, cx, cy } = shot.camera;
        entries.push(format!(
            "\"{i}\": {{\"cam_K\": [{fx}, 0, {cx}, 0, {fy}, {cy}, 0, 0, 1], \"cam_R_w2c\": {r:?}, \"cam_t_w2c\": {t:?}, \"depth_scale\": 0.2}}"
        ));
        depth(&folder.join(format!("depth/{i:06}.png")), shot, 5000.0);
    }
    write(&folder.join("scene_camera.json"), &format!("{{{}}}", entries.join(",\n")));
}

/// ScanNet as its exporter writes it.
pub fn scannet(folder: &Path, shots: &[Shot]) {
    for (i, shot) in shots.iter().enumerate() {
        depth(&folder.join(format!("depth/{i}.png")), shot, 1000.0);
        write(&folder.join(format!("pose/{i}.txt")), &rows(&shot.stated));
    }
    let CameraSettings { fx, fy, cx, cy } = shots[0].camera;
    let matrix = format!("{fx} 0 {cx} 0\n0 {fy} {cy} 0\n0 0 1 0\n0 0 0 1\n");
    write(&folder.join("intrinsic/intrinsic_depth.txt"), &matrix);
}

/// 7-Scenes, which states no camera.
pub fn seven_scenes(folder: &Path, shots: &[Shot]) {
    for (i, shot) in shots.iter().enumerate() {
        depth(&folder.join(format!("frame-{i:06}.depth.png")), shot, 1000.0);
        write(&folder.join(format!("frame-{i:06}.pose.txt")), &rows(&shot.stated));
    }
}

/// Redwood, with the camera in Open3D's JSON.
pub fn redwood(folder: &Path, shots: &[Shot]) {
    let mut log = String::new();
    for (i, shot) in shots.iter().enumerate() {
        depth(&folder.join(format!("depth/{i:06}.png")), shot, 1000.0);
        write!(log, "{i} {i} {}\n{}", i + 1, rows(&shot.stated)).unwrap();
    }
    write(&folder.join("trajectory.log"), &log);
    let ((width, height), CameraSettings { fx, fy, cx, cy }) = (shots[0].size, shots[0].camera);
    let camera = format!(
        "{{\"width\": {width}, \"height\": {height}, \"intrinsic_matrix\": [{fx}, 0, 0, 0, {fy}, 0, {cx}, {cy}, 1]}}"
    );
    write(&folder.join("camera_intrinsic.json"), &camera);
}

/// Replica as NICE-SLAM has it, with the camera in the folder above.
pub fn replica(folder: &Path, shots: &[Shot]) {
    let mut trajectory = String::new();
    for (i, shot) in shots.iter().enumerate() {
        depth(&folder.join(format!("results/depth{i:06}.png")), shot, 6553.5);
        writeln!(trajectory, "{}", rows(&shot.stated).replace('\n', " ")).unwrap();
    }
    write(&folder.join("traj.txt"), &trajectory);
    let ((w, h), CameraSettings { fx, fy, cx, cy }) = (shots[0].size, shots[0].camera);
    let camera = format!(
        "{{\"camera\": {{\"w\": {w}, \"h\": {h}, \"fx\": {fx}, \"fy\": {fy}, \"cx\": {cx}, \"cy\": {cy}, \"scale\": 6553.5}}}}"
    );
    write(&folder.join("cam_params.json"), &camera);
}

/// Files of points with the pose of their sensor; `points` changes each cloud before it is written.
fn write_pcds(folder: &Path, shots: &[Shot], points: impl Fn(&Shot, Cloud) -> Cloud) {
    fs::create_dir_all(folder).unwrap();
    for (i, shot) in shots.iter().enumerate() {
        let CameraSettings { fx, fy, cx, cy } = shot.camera;
        let camera = Intrinsics { width: shot.size.0, height: shot.size.1, fx, fy, cx, cy };
        let cloud = points(shot, camera.cloud_from_depth(&shot.depth_m).unwrap());
        let (width, height) = cloud.grid.map_or((cloud.len(), 1), |grid| (grid.width, grid.height));
        let (t, q) = (shot.stated.translation.vector, shot.stated.rotation.coords);
        let mut bytes = format!(
            "FIELDS x y z\nSIZE 4 4 4\nTYPE F F F\nCOUNT 1 1 1\nWIDTH {width}\nHEIGHT {height}\nVIEWPOINT {} {} {} {} {} {} {}\n\
             POINTS {}\nDATA binary\n",
            t.x, t.y, t.z, q.w, q.x, q.y, q.z, width * height
        )
        .into_bytes();
        bytes.extend(cloud.points.iter().flat_map(|p| [p.x, p.y, p.z]).flat_map(f32::to_le_bytes));
        fs::write(folder.join(format!("{i}.pcd")), bytes).unwrap();
    }
}

/// Organised clouds in the frame of their sensor.
pub fn pcds(folder: &Path, shots: &[Shot]) {
    write_pcds(folder, shots, |_, cloud| cloud);
}

/// Organised clouds in the world.
pub fn pcds_of_the_world(folder: &Path, shots: &[Shot]) {
    write_pcds(folder, shots, |shot, cloud| cloud.transformed(&shot.stated));
}

/// Points without pixels, in the world.
pub fn loose_pcds(folder: &Path, shots: &[Shot]) {
    write_pcds(folder, shots, |shot, cloud| cloud.transformed(&shot.stated).finite());
}

/// Points without pixels, in the frame of the sensor.
pub fn loose_pcds_of_the_sensor(folder: &Path, shots: &[Shot]) {
    write_pcds(folder, shots, |_, cloud| cloud.finite());
}
