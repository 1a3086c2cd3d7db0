//! Five real views of a room, their poses disturbed by 5 cm and 3 degrees, brought back pair by pair.

use descry_perception::nalgebra::{Isometry3, Point3, Quaternion, Translation3, UnitQuaternion, Vector3};
use descry_perception::register::{Fit, Method, Prepared, RegisterOptions, align};
use descry_perception::{Intrinsics, files, voxel};
use std::path::PathBuf;

fn folder() -> Option<PathBuf> {
    let folder = PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("../../shared/data/dining_room");
    folder.is_dir().then_some(folder)
}

/// Every view, voxelled at 2 cm, with its recorded pose.
fn views(folder: &std::path::Path) -> Vec<(Prepared, Isometry3<f64>)> {
    let camera = Intrinsics { width: 640, height: 480, fx: 518.0, fy: 519.0, cx: 325.5, cy: 253.5 };
    let poses = std::fs::read_to_string(folder.join("pose.txt")).unwrap();
    let pose = |line: &str| {
        let v: Vec<f64> = line.split_whitespace().map(|w| w.parse().unwrap()).collect();
        let turn = UnitQuaternion::from_quaternion(Quaternion::new(v[6], v[3], v[4], v[5]));
        Isometry3::from_parts(Translation3::new(v[0], v[1], v[2]), turn)
    };
    let load = |(i, line): (usize, &str)| {
        let bytes = std::fs::read(folder.join(format!("depth/{}.pgm", i + 1))).unwrap();
        let depth = files::depth::read(&bytes, 0.001).unwrap();
        let near = camera.cloud_from_depth(&depth.depths_m).unwrap().filter(|p| p.z < 4.0);
        let small = voxel::downsample(&near, 0.02).unwrap();
        (Prepared::with_normals(&small.points, 20).unwrap(), pose(line))
    };
    poses.lines().filter(|l| !l.trim().is_empty()).enumerate().map(load).collect()
}

/// 5 cm and 3 degrees in directions that the number picks.
fn disturbance(number: usize) -> Isometry3<f64> {
    let turn = number as f64 * 2.399_963;
    let direction = Vector3::new(turn.cos(), turn.sin(), (3.0 * turn).cos()).normalize();
    let axis = Vector3::new((2.0 * turn).sin(), turn.cos(), turn.sin()).normalize();
    let angle = 3f64.to_radians();
    Isometry3::from_parts(
        Translation3::from(direction * 0.05),
        UnitQuaternion::from_scaled_axis(axis * angle),
    )
}

/// Mean distance between where two poses put the points, metres.
fn apart_m(points: &[Point3<f32>], a: &Isometry3<f64>, b: &Isometry3<f64>) -> f64 {
    let put = |pose: &Isometry3<f64>, p: &Point3<f32>| pose * p.cast::<f64>();
    points.iter().map(|p| (put(a, p) - put(b, p)).norm()).sum::<f64>() / points.len() as f64
}

fn refine(source: &Prepared, target: &Prepared, start: Isometry3<f64>) -> Fit {
    let mut options = RegisterOptions {
        method: Method::Generalised,
        start_target_from_source: start,
        within_m: 0.2,
        robust_m: Some(0.02),
        ..RegisterOptions::default()
    };
    options.start_target_from_source = align(source, target, &options).unwrap().target_from_source;
    options.within_m = 0.06;
    align(source, target, &options).unwrap()
}

#[test]
fn disturbed_poses_come_back() {
    let Some(folder) = folder() else {
        println!("skipped: no ../shared/data/dining_room beside the workspace");
        return;
    };
    let views = views(&folder);
    assert_eq!(views.len(), 5);
    for i in 1..views.len() {
        let ((target, world_from_target), (source, world_from_source)) = (&views[i - 1], &views[i]);
        let recorded = world_from_target.inverse() * world_from_source;
        // The recorded poses are good to about a centimetre themselves: what counts is where registration leads from there.
        let best = refine(source, target, recorded).target_from_source;
        let start = recorded * disturbance(i);
        let fit = refine(source, target, start);
        let before_mm = 1e3 * apart_m(source.points(), &start, &best);
        let after_mm = 1e3 * apart_m(source.points(), &fit.target_from_source, &best);
        let recorded_mm = 1e3 * apart_m(source.points(), &recorded, &best);
        println!(
            "view {} on {i}: {before_mm:.1} mm before, {after_mm:.2} mm after, recorded pose {recorded_mm:.1} mm; {} of {} matched, residual {:.1} mm, {} rounds, {}",
            i + 1,
            fit.matched,
            fit.of,
            1e3 * fit.residual_m,
            fit.rounds,
            fit.ending
        );
        assert!(before_mm > 40.0 && after_mm < 5.0 && recorded_mm < 60.0);
    }
}
