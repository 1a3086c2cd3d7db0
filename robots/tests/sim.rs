//! The simulated body: driving and its errors, faults, pushing, and determinism for a seed.

use crate::scenes::on_a_table;
use descry_robots::nalgebra::{Isometry3, Point3, Vector2};
use descry_robots::sim::{DepthNoise, FaultPlan, SceneSpec, SimOptions, SimRobot, arrange};
use descry_robots::{CancellationToken, Failure, Place, Pose2, Progress, Push, Robot, Watch};

const SCENE: &str = on_a_table!(
    r#"[start]
position_m = [-2.0, 0.0]
[[object]]
name = "cup"
shape.cup = { diameter_m = 0.08, height_m = 0.12 }
position_m = [0.1, 0.05]
[[object]]
name = "box"
shape.box = { size_m = [0.1, 0.1, 0.1] }
position_m = [-0.4, 0.1]
"#
);

fn robot_in(text: &str, seed: u64, faults: &str) -> SimRobot {
    let spec = SceneSpec::parse("scene.toml", text).unwrap_or_else(|e| panic!("{e}"));
    let faults = FaultPlan::parse("faults.toml", faults).unwrap_or_else(|e| panic!("{e}"));
    SimRobot::new(arrange(&spec, seed).unwrap(), SimOptions { seed, faults, ..SimOptions::default() })
}

fn at(x_m: f64, y_m: f64) -> Place {
    Place::Pose(Pose2::facing(x_m, y_m, &[0.0, 0.0].into()))
}

async fn drive(robot: &SimRobot, place: &Place) -> Result<f64, Failure> {
    robot.drive_to(place, &Watch::default()).await.map(|d| d.distance_m)
}

/// Error of the estimated pose, in the body's own frame.
async fn error_of(robot: &SimRobot) -> Isometry3<f64> {
    robot.truth().base.isometry().inv_mul(&robot.pose().await.unwrap().map_from_base)
}

#[tokio::test]
async fn localisation_is_off_by_what_is_described() {
    let robot = robot_in(SCENE, 5, "");
    let (mut sum_m2, mut sum_rad2, mut mean_m) = (0.0, 0.0, 0.0);
    let drives = 600;
    for k in 0..drives {
        drive(&robot, &at(-2.0, if k % 2 == 0 { 0.4 } else { 0.8 })).await.unwrap();
        let error = error_of(&robot).await;
        assert_eq!(error, error_of(&robot).await, "asking again averages nothing out");
        sum_m2 += error.translation.vector.norm_squared();
        mean_m += error.translation.vector.x / f64::from(drives);
        sum_rad2 += error.rotation.angle().powi(2);
    }
    let sigma_m = (sum_m2 / (2.0 * f64::from(drives))).sqrt();
    let sigma_rad = (sum_rad2 / f64::from(drives)).sqrt();
    let d = robot.description();
    assert!((sigma_m / d.pose_sigma_m - 1.0).abs() < 0.1, "{sigma_m} m");
    assert!((sigma_rad / d.pose_sigma_rad - 1.0).abs() < 0.1, "{sigma_rad} rad");
    assert!((d.pose_sigma_m - 0.03).abs() < 1e-12 && (d.pose_sigma_rad - 2f64.to_radians()).abs() < 1e-12);
    assert!(mean_m.abs() < 0.005, "{mean_m} m on average");
}

/// A frame shows the true scene, while its transforms give the estimated pose.
#[tokio::test]
async fn frames_show_the_truth_from_a_believed_pose() {
    let mut robot = robot_in(SCENE, 2, "");
    for seed in 2..5 {
        robot = robot_in(SCENE, seed, "");
        drive(&robot, &at(0.0, 1.3)).await.unwrap();
        let look_at = Point3::new(0.1, 0.05, 0.75);
        robot.look_at(&look_at, &Watch::default()).await.unwrap();
        let label = descry_robots::sim::world::LABEL_OBJECT;
        let frame = robot.true_frame();
        let sensed = robot.sense(&Watch::default()).await.unwrap();
        let believed = robot.pose().await.unwrap().map_from_base;
        let mount = believed.inv_mul(&sensed.map_from_camera);
        let really = robot.truth().base.isometry() * mount;
        let seen: Vec<Point3<f64>> = (0..frame.label.len())
            .filter(|&i| frame.label[i] == label && sensed.depth_m[i].is_finite())
            .map(|i| sensed.cloud.points[i].cast())
            .collect();
        assert!(seen.len() > 300, "{} pixels of the cup", seen.len());
        let near_cup = |camera: &Isometry3<f64>| {
            let inside = seen
                .iter()
                .map(|p| camera * p)
                .filter(|p| (p.x - 0.1).hypot(p.y - 0.05) < 0.055 && p.z > 0.70 && p.z < 0.86);
            inside.count() as f64 / seen.len() as f64
        };
        assert!(near_cup(&really) > 0.95, "{} by the true pose", near_cup(&really));
        let off = (sensed.map_from_camera.inv_mul(&really)).translation.vector.norm();
        assert!(off > 1e-4, "the believed pose is never exact");
    }
    assert_eq!(robot.truth().objects[0].name, "cup");
}

#[tokio::test]
async fn a_seed_fixes_a_run_to_the_bit() {
    async fn run(seed: u64) -> (String, Vec<u32>, i64) {
        let faults = "[[fault]]\nkind = \"object_moved\"\nchance = 0.5\n[[fault]]\nkind = \"blocked_path\"\nchance = 0.3\n";
        let robot = robot_in(SCENE, seed, faults);
        let mut depth = Vec::new();
        for place in [at(0.0, 1.3), at(1.4, 0.0), at(0.0, -1.3)] {
            let _ = drive(&robot, &place).await;
            robot.look_at(&Point3::new(0.0, 0.0, 0.7), &Watch::default()).await.unwrap();
            let sensed = robot.sense(&Watch::default()).await.unwrap();
            depth.extend(sensed.depth_m.iter().map(|z| z.to_bits()));
        }
        (format!("{:?}", robot.truth()), depth, robot.now_ns())
    }
    assert!(run(3).await == run(3).await);
    assert!(run(3).await != run(4).await);
}

/// Effect of a fault on two drives with a frame after each: `ok` or the kind of failure.
#[tokio::test]
async fn mishaps_happen_as_declared() {
    for (fault, expected) in [
        ("", ["ok", "ok", "ok", "ok"]),
        ("kind = \"blocked_path\"\nat = 1", ["blocked", "ok", "ok", "ok"]),
        ("kind = \"unreachable_pose\"\nat = 2", ["ok", "ok", "unreachable", "ok"]),
        ("kind = \"timed_out_drive\"\nat = 2", ["ok", "ok", "timed_out", "ok"]),
        ("kind = \"dropped_frame\"\nat = 2", ["ok", "ok", "ok", "sensor_dropped"]),
        ("kind = \"dropped_frame\"\nchance = 1.0", ["ok", "sensor_dropped", "ok", "sensor_dropped"]),
        ("kind = \"bad_localisation\"\nat = 1", ["ok", "ok", "ok", "ok"]),
        ("kind = \"object_taken\"\nat = 1\nobject = \"cup\"", ["ok", "ok", "ok", "ok"]),
        ("kind = \"object_moved\"\nat = 2\nobject = \"cup\"\nby_m = 0.25", ["ok", "ok", "ok", "ok"]),
    ] {
        let plan = if fault.is_empty() { String::new() } else { format!("[[fault]]\n{fault}\n") };
        let robot = robot_in(SCENE, 7, &plan);
        let mut found = Vec::new();
        let mut word = |failure: Option<&Failure>| found.push(failure.map_or("ok", |f| f.kind()));
        let cup = |robot: &SimRobot| robot.truth().objects[0].clone();
        let before = cup(&robot);
        word(drive(&robot, &at(0.0, 1.3)).await.err().as_ref());
        let error = error_of(&robot).await;
        word(robot.sense(&Watch::default()).await.err().as_ref());
        word(drive(&robot, &at(1.4, 0.2)).await.err().as_ref());
        word(robot.sense(&Watch::default()).await.err().as_ref());
        assert_eq!(found, expected, "{fault}");
        let after = cup(&robot);
        let moved_m = (after.centre_m - before.centre_m).norm();
        let changed = !robot.truth().events.is_empty();
        assert_eq!(changed, !fault.is_empty(), "{fault}: an event in the truth");
        assert_eq!(after.present, !fault.contains("taken"), "{fault}");
        assert!(
            (moved_m - if fault.contains("moved") { 0.25 } else { 0.0 }).abs() < 1e-9,
            "{fault}: {moved_m}"
        );
        if fault.contains("bad_localisation") {
            assert!((error.translation.vector.norm() - 0.1).abs() < 1e-9);
            assert!((error.rotation.angle() - 6f64.to_radians()).abs() < 1e-9);
        }
    }
}

#[tokio::test]
async fn what_was_tried_in_vain_stays_unreachable() {
    let robot = robot_in(SCENE, 1, "[[fault]]\nkind = \"unreachable_pose\"\nat = 1\n");
    let (goal, other) = (at(0.0, 1.3), at(1.4, 0.0));
    let here = robot.pose().await.unwrap().place();
    assert!(
        robot.travel(&here, std::slice::from_ref(&goal), &[])[0].is_ok(),
        "nobody knows before it is tried"
    );
    for _ in 0..2 {
        assert!(matches!(drive(&robot, &goal).await, Err(Failure::Unreachable { .. })));
    }
    let answers = robot.travel(&here, &[goal, other.clone()], &[]);
    assert!(answers[0].is_err() && answers[1].is_ok());
    drive(&robot, &other).await.unwrap();
}

#[test]
fn mistaken_mishaps_are_drawn() {
    for (text, line, word) in [
        ("[[fault]]\nkind = \"earthquake\"\nat = 1\n", 2, "earthquake"),
        ("[[fault]]\nkind = \"dropped_frame\"\n", 2, "not said when"),
        ("[[fault]]\nkind = \"dropped_frame\"\nat = 0\n", 3, "count from 1"),
        ("[[fault]]\nkind = \"dropped_frame\"\nchance = 2.0\n", 3, "between 0 and 1"),
        ("[[fault]]\nkind = \"dropped_frame\"\nat = 1\nchance = 0.5\n", 4, "keep one"),
        ("[[fault]]\nkind = \"object_moved\"\nat = 1\nby_m = -1.0\n", 4, "no distance"),
    ] {
        let error = FaultPlan::parse("faults.toml", text).unwrap_err();
        assert_eq!(error.line, line, "{error}");
        assert!(error.to_string().contains(word), "{error}");
    }
}

#[tokio::test]
async fn an_unknown_obstacle_stops_the_base_and_is_driven_around_then() {
    let bench = "[[obstacle]]\nname = \"bench\"\nposition_m = [-1.0, 1.6]\nsize_m = [0.3, 0.6, 0.5]\non_map = false\n";
    let robot = robot_in(&format!("{SCENE}{bench}"), 3, "");
    drive(&robot, &at(-2.0, 1.6)).await.unwrap();
    let goal = at(0.3, 1.6);
    let blocked = drive(&robot, &goal).await;
    assert!(matches!(blocked, Err(Failure::Blocked { .. })), "{blocked:?}");
    let here = robot.truth().base;
    assert!(here.x_m < -1.3 && here.x_m > -1.7, "it stops before the bench: {here:?}");
    let mut tries = 0;
    while let Err(failure) = drive(&robot, &goal).await {
        assert!(matches!(failure, Failure::Blocked { .. }), "{failure}");
        tries += 1;
        assert!(tries < 4, "it never learns");
    }
    assert!((robot.truth().base.point() - nalgebra_point(0.3, 1.6)).norm() < 0.2);
}

/// An obstacle that the base touches stops only motion towards it: the base turns on the spot and drives
/// away.
#[tokio::test]
async fn a_base_that_touches_an_obstacle_gets_away() {
    for seed in 0..20 {
        let crate_m = [-1.62, 0.1];
        let text = format!(
            "{SCENE}[[obstacle]]\nname = \"crate\"\nposition_m = {crate_m:?}\nsize_m = [0.3, 0.3, 0.5]\nyaw_deg = 20\non_map = false\n"
        );
        let robot = robot_in(&text, seed, "");
        let goal = at(-1.0, 1.6);
        let mut tries = 0;
        while let Err(failure) = drive(&robot, &goal).await {
            assert!(matches!(failure, Failure::Blocked { .. }), "seed {seed}: {failure}");
            tries += 1;
            assert!(tries < 8, "seed {seed}: it never gets away, and stands at {:?}", robot.truth().base);
        }
    }
}

fn nalgebra_point(x: f64, y: f64) -> descry_robots::nalgebra::Point2<f64> {
    descry_robots::nalgebra::Point2::new(x, y)
}

#[tokio::test]
async fn a_drive_can_be_stopped_half_way() {
    let robot = robot_in(SCENE, 3, "");
    let goal = at(1.4, 0.0);
    let cancel = CancellationToken::new();
    let stop = |p: &Progress| {
        if p.fraction > 0.5 {
            cancel.cancel();
        }
    };
    let watch = Watch { cancel: cancel.clone(), progress: &stop, ..Watch::default() };
    let answer = robot.drive_to(&goal, &watch).await;
    assert!(matches!(answer, Err(Failure::Cancelled { .. })), "{answer:?}");
    let half = robot.truth().base.point();
    assert!(
        (half - nalgebra_point(-2.0, 0.0)).norm() > 0.8 && (half - nalgebra_point(1.4, 0.0)).norm() > 0.8
    );
    let believed = Pose2::from_isometry(&robot.pose().await.unwrap().map_from_base).point();
    assert!((believed - half).norm() < 0.15, "it knows how far it got");
    let limit = Watch { time_limit_s: 1.5, ..Watch::default() };
    let before_ns = robot.now_ns();
    assert!(matches!(robot.drive_to(&goal, &limit).await, Err(Failure::TimedOut { .. })));
    assert!(((robot.now_ns() - before_ns) as f64 * 1e-9 - 1.5).abs() < 1e-6, "a limit is kept to");
    drive(&robot, &goal).await.unwrap();
}

#[tokio::test]
async fn a_dropped_drive_leaves_the_base_where_it_got_to() {
    let robot = robot_in(SCENE, 3, "");
    let goal = at(1.4, 0.0);
    let watch = Watch::default();
    let half = async {
        for _ in 0..40 {
            tokio::task::yield_now().await;
        }
    };
    tokio::select! {
        biased;
        _ = half => {}
        _ = robot.drive_to(&goal, &watch) => panic!("it cannot be there already"),
    }
    let estimate = robot.pose().await.unwrap();
    let moved_m = (estimate.map_from_base.translation.vector.x + 2.0).abs();
    assert!(moved_m > 0.2 && robot.now_ns() > 0, "{moved_m} m");
    assert!(
        (Pose2::from_isometry(&estimate.map_from_base).point() - robot.truth().base.point()).norm() < 0.15
    );
}

fn push(x: f64, y: f64, direction: [f64; 2], distance_m: f64) -> Push {
    Push { object: Point3::new(x, y, 0.78), direction: Vector2::from(direction), distance_m }
}

#[tokio::test]
async fn pushing_moves_things_roughly_as_asked() {
    let (mut moved, mut slipped) = (Vec::new(), 0);
    for seed in 0..60 {
        let robot = robot_in(SCENE, seed, "");
        drive(&robot, &at(0.1, 1.0)).await.unwrap();
        let before = robot.truth().objects[0].centre_m;
        let answer = robot.push_aside(&push(0.1, 0.05, [2.0, 0.0], 0.2), &Watch::default()).await;
        let step = robot.truth().objects[0].centre_m - before;
        match answer {
            Ok(pushed) => {
                assert!((pushed.moved_m - step.norm()).abs() < 1e-9 && pushed.duration_s > 8.0);
                moved.push(step);
            }
            Err(Failure::Slipped { .. }) => slipped += 1,
            Err(other) => panic!("{other}"),
        }
        assert!(step.norm() < 0.3 && step.z.abs() < 1e-12);
    }
    let n = moved.len() as f64;
    let mean: f64 = moved.iter().map(|s| s.x).sum::<f64>() / n;
    assert!((mean - 0.2).abs() < 0.01, "{mean} m on average");
    let spread = (moved.iter().map(|s| (s.x - mean).powi(2)).sum::<f64>() / n).sqrt();
    assert!(spread > 0.005 && spread < 0.04, "{spread} m of noise");
    assert!((1..15).contains(&slipped), "{slipped} of 60 slipped");
}

#[tokio::test]
async fn pushing_has_limits() {
    let robot = robot_in(SCENE, 2, "");
    let far = robot.push_aside(&push(0.1, 0.05, [1.0, 0.0], 0.2), &Watch::default()).await;
    assert!(matches!(far, Err(Failure::Unreachable { .. })), "{far:?}");
    drive(&robot, &at(0.1, 1.0)).await.unwrap();
    let nothing = robot.push_aside(&push(0.5, 0.3, [1.0, 0.0], 0.2), &Watch::default()).await;
    assert!(matches!(nothing, Err(Failure::Slipped { .. })), "{nothing:?}");
    let hurried = Watch { time_limit_s: 1.0, ..Watch::default() };
    let late = robot.push_aside(&push(0.1, 0.05, [1.0, 0.0], 0.2), &hurried).await;
    assert!(matches!(late, Err(Failure::TimedOut { .. })), "{late:?}");
    let no_way = robot.push_aside(&push(0.1, 0.05, [0.0, 0.0], 0.2), &Watch::default()).await;
    assert!(matches!(no_way, Err(Failure::Unreachable { .. })), "{no_way:?}");
    // Over the edge is no way: the cup stays on its table whatever is asked.
    for _ in 0..6 {
        let cup = robot.truth().objects[0].centre_m;
        let _ = robot.push_aside(&push(cup.x, cup.y, [0.0, 1.0], 0.5), &Watch::default()).await;
    }
    let cup = robot.truth().objects[0].centre_m;
    assert!(cup.y < 0.4 - 0.039 && cup.y > 0.25, "{cup}");
}

#[tokio::test]
async fn a_ring_of_boxes_opens_when_one_is_pushed() {
    let path = concat!(env!("CARGO_MANIFEST_DIR"), "/../domains/tabletop/scenes/ring-of-boxes.toml");
    let text = std::fs::read_to_string(path).unwrap();
    let mut opened = 0;
    for seed in 1..=5 {
        let robot = robot_in(&text, seed, "");
        let ring = || {
            (0..32).map(|k| f64::from(k) * std::f64::consts::TAU / 32.0).map(|a| {
                robot.true_visible_share(
                    "cup A",
                    &Pose2::facing(1.3 * a.cos(), 1.3 * a.sin(), &[0.0, 0.0].into()),
                )
            })
        };
        assert_eq!(ring().fold(0.0, f64::max), 0.0, "seed {seed}: it can be seen from the start");
        drive(&robot, &at(1.2, 0.2)).await.unwrap();
        let pushed = robot.push_aside(&push(0.095, 0.0, [1.0, 0.0], 0.35), &Watch::default()).await;
        if pushed.is_ok() && ring().fold(0.0, f64::max) > 0.4 {
            opened += 1;
        }
    }
    assert!(opened >= 3, "opened in {opened} of 5");
}

#[test]
fn noise_can_be_turned_down() {
    let options =
        SimOptions { noise: DepthNoise { scale: 0.0, ..DepthNoise::default() }, ..SimOptions::default() };
    let scene = arrange(&SceneSpec::parse("scene.toml", SCENE).unwrap(), 1).unwrap();
    let robot = SimRobot::new(scene, options);
    let runtime = tokio::runtime::Builder::new_current_thread().build().unwrap();
    let sensed = runtime.block_on(robot.sense(&Watch::default())).unwrap();
    let frame = robot.true_frame();
    let worst = sensed
        .depth_m
        .iter()
        .zip(&frame.depth_m)
        .filter(|(z, _)| z.is_finite())
        .map(|(z, ideal)| (z - ideal).abs() / (ideal * ideal))
        .fold(0.0, f32::max);
    // Half a step of disparity is z²/(2·f·b·8).
    assert!(worst < 0.5 / (589.0 * 0.075 * 8.0) * 1.05, "{worst}");
}
