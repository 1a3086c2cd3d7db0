//! Tests of `sim::stereo`.

use descry_robots::sim::arrange;
use descry_robots::sim::body::intrinsics;
use descry_robots::sim::frame::Frame;
use descry_robots::sim::render::render;
use descry_robots::sim::scene::SceneSpec;
use descry_robots::sim::stereo::*;
use descry_robots::sim::world::LABEL_ROOM;
use nalgebra::{Isometry3, Point3};
use nalgebra::{UnitQuaternion, Vector3};

/// Frames of a bare room wall at a distance, by a horizontal camera.
fn facing_wall(distance_m: f64, aside_m: f64, seed: u64) -> (Frame, Vec<f32>, Isometry3<f64>) {
    let spec = SceneSpec::parse("room", "[start]\nposition_m = [0.0, 0.0]\n").unwrap();
    let scene = arrange(&spec, 1).unwrap();
    let turn = UnitQuaternion::face_towards(&Vector3::x(), &-Vector3::z());
    let map_from_camera = Isometry3::from_parts(Vector3::new(3.0 - distance_m, aside_m, 1.2).into(), turn);
    let frame = render(&scene.room, &scene.solids(), &map_from_camera, &intrinsics(), 0);
    let stereo = Stereo { baseline_m: 0.1, disparity_sigma_px: 0.3, textured: 0.5, range_m: (0.4, 8.0) };
    let depth_m = stereo.observe(&frame, &map_from_camera, |label| label == LABEL_ROOM, seed, 1);
    (frame, depth_m, map_from_camera)
}

#[test]
fn depth_is_off_by_its_square_and_half_of_a_wall_is_bare() {
    for distance_m in [1.0, 2.0, 4.0] {
        let (frame, depth_m, _) = facing_wall(distance_m, 0.0, 7);
        let of_wall = |i: &usize| (f64::from(frame.depth_m[*i]) - distance_m).abs() < 1e-3;
        let wall: Vec<usize> = (0..depth_m.len()).filter(of_wall).collect();
        let off: Vec<f64> =
            wall.iter().map(|&i| f64::from(depth_m[i]) - distance_m).filter(|off| off.is_finite()).collect();
        let spread_m = (off.iter().map(|o| o * o).sum::<f64>() / off.len() as f64).sqrt();
        let expected_m = distance_m * distance_m * 0.3 / (frame.intrinsics.fx * 0.1);
        assert!((spread_m / expected_m - 1.0).abs() < 0.05, "{distance_m}: {spread_m}, {expected_m}");
        let share = off.len() as f64 / wall.len() as f64;
        assert!((share - 0.5).abs() < 0.15, "{distance_m}: {share}");
    }
}

#[test]
fn a_bare_spot_is_bare_from_every_side() {
    let (frame, depth_m, map_from_camera) = facing_wall(2.0, 0.0, 1);
    let (_, other_m, other) = facing_wall(1.6, 0.4, 2);
    let c = &frame.intrinsics;
    let (mut same, mut all) = (0, 0);
    for (here, depth) in depth_m.iter().enumerate().step_by(97) {
        let z = f64::from(frame.depth_m[here]);
        let (u, v) = ((here % c.width) as f64, (here / c.width) as f64);
        let ray = Point3::new((u - c.cx) / c.fx, (v - c.cy) / c.fy, 1.0);
        let seen = other.inverse_transform_point(&(map_from_camera * (ray * z)));
        let (u, v) = (c.fx * seen.x / seen.z + c.cx, c.fy * seen.y / seen.z + c.cy);
        let inside = u >= 0.0 && v >= 0.0 && u < (c.width - 1) as f64 && v < (c.height - 1) as f64;
        if inside && (z - 2.0).abs() < 1e-3 {
            all += 1;
            let there = v.round() as usize * c.width + u.round() as usize;
            same += usize::from(other_m[there].is_nan() == depth.is_nan());
        }
    }
    assert!(all > 500 && same as f64 > 0.95 * f64::from(all), "{same} of {all}");
}
