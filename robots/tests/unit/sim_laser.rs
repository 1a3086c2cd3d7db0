//! Tests of `sim::laser`.

use descry_perception::laser::Scan;
use descry_robots::body::Pose2;
use descry_robots::sim::laser::*;
use descry_robots::sim::world::Scene;
use descry_robots::sim::{SceneSpec, arrange};
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;

const LAB: &str = r#"
[room]
size_m = [6.0, 4.0]
wall_height_m = 2.0
[[surface]]
name = "table"
position_m = [0.0, -1.0]
size_m = [1.0, 0.6]
height_m = 0.72
[[obstacle]]
name = "box"
position_m = [1.5, 0.5]
size_m = [0.5, 0.5, 0.6]
[start]
position_m = [-1.0, 0.5]
[[object]]
name = "tin"
shape.cylinder = { diameter_m = 0.2, height_m = 0.2 }
position_m = [0.0, 0.0]
"#;

fn lab() -> Scene {
    arrange(&SceneSpec::parse("lab.toml", LAB).unwrap(), 1).unwrap()
}

fn look(laser: &LaserModel, pose: Pose2, seed: u64) -> Scan {
    sweep(&lab(), laser, &pose, &pose, &mut ChaCha8Rng::seed_from_u64(seed))
}

/// Checks the exact range straight ahead.
fn check(height_m: f64, pose: Pose2, expected_m: f64) {
    let laser = LaserModel { height_m, sigma_m: 0.0, precision_m: 0.0, ..LaserModel::default() };
    let ahead = look(&laser, pose, 1).ranges_m[90];
    assert!((ahead - expected_m).abs() < 1e-9 || ahead == expected_m, "{height_m} {pose:?}: {ahead} m");
}

#[test]
fn rays_end_where_things_are() {
    let half_turn = std::f64::consts::PI;
    check(0.4, Pose2::new(-1.0, 0.5, 0.0), 2.25);
    check(0.65, Pose2::new(-1.0, 0.5, 0.0), 4.0);
    check(0.4, Pose2::new(-1.0, 0.5, half_turn), 2.0);
    check(2.5, Pose2::new(-1.0, 0.5, half_turn), f64::INFINITY);
    check(0.4, Pose2::new(0.0, 1.0, -0.5 * half_turn), 3.0);
    check(0.71, Pose2::new(0.0, 1.0, -0.5 * half_turn), 1.7);
    check(0.8, Pose2::new(0.0, 1.0, -0.5 * half_turn), 1.9);
    check(0.4, Pose2::new(0.475, 1.0, -0.5 * half_turn), 1.7);
}

#[test]
fn noise_is_that_of_the_laser_and_of_the_seed() {
    let pose = Pose2::new(-1.0, 0.5, 0.0);
    let laser = LaserModel::default();
    let scan = look(&laser, pose, 1);
    assert_eq!(scan.check(), Ok(()));
    assert_eq!(scan, look(&laser, pose, 1));
    assert_ne!(scan, look(&laser, pose, 2));
    let exact = look(&LaserModel { sigma_m: 0.0, precision_m: 0.0, ..laser }, pose, 1);
    let off: Vec<f64> = scan.ranges_m.iter().zip(&exact.ranges_m).map(|(a, b)| a - b).collect();
    let spread = (off.iter().map(|d| d * d).sum::<f64>() / off.len() as f64).sqrt();
    // Noise and rounding together: 5 mm, and 1 cm over the square root of twelve.
    assert!((0.0048..0.0068).contains(&spread), "{spread} m");
    assert!(scan.ranges_m.iter().all(|r| (r * 100.0 - (r * 100.0).round()).abs() < 1e-6));
}

#[test]
fn nothing_returns_from_beyond_reach() {
    let laser = LaserModel { reach_m: 1.5, ..LaserModel::default() };
    let scan = look(&laser, Pose2::new(-1.0, 0.5, 0.0), 1);
    assert_eq!(scan.ranges_m[90], f64::INFINITY);
    assert!(scan.ranges_m.iter().all(|r| *r <= 1.55 || r.is_infinite()));
}

#[test]
fn the_pose_is_told_as_localisation_states_it() {
    let stated = Pose2::new(0.1, -0.2, 0.3);
    let mut rng = ChaCha8Rng::seed_from_u64(1);
    let scan = sweep(&lab(), &LaserModel::default(), &Pose2::new(-1.0, 0.5, 0.0), &stated, &mut rng);
    assert_eq!(scan.map_from_laser.translation.vector.y, -0.2);
    assert!((scan.map_from_laser.rotation.angle() - 0.3).abs() < 1e-12);
}
