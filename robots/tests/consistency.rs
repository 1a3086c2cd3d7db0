//! Views of wrong cameras and bodies compared with the map, and of correct ones.

use crate::scenes::on_a_table;
use descry_perception::consistency::{Consistency, Fault, Inconsistency, MapSurface, judge};
use descry_perception::{Intrinsics, View};
use descry_robots::nalgebra::{
    Isometry3, Matrix3, Point3, Rotation3, Translation3, UnitQuaternion, Vector2, Vector3,
};
use descry_robots::sim::render::render;
use descry_robots::sim::{DepthNoise, Scene, SceneSpec, arrange, noise};

const CAMERA: Intrinsics = Intrinsics { width: 320, height: 240, fx: 285.0, fy: 285.0, cx: 159.5, cy: 119.5 };
const LOOKS: usize = 6;
const SCENE: &str = on_a_table!(
    r#"[start]
position_m = [-2.0, 0.3]
[[object]]
name = "cup"
shape.cup = { diameter_m = 0.07, height_m = 0.1 }
[[object]]
name = "carton"
shape.box = { size_m = [0.09, 0.16, 0.22] }
"#
);

fn table() -> (Scene, MapSurface) {
    let scene = arrange(&SceneSpec::parse("scene.toml", SCENE).unwrap(), 1).unwrap();
    let map = MapSurface { outline_m: scene.surfaces[0].outline_m(), height_m: scene.surfaces[0].height_m };
    (scene, map)
}

/// A camera pose at one point, looking at another.
fn towards(eye: Point3<f64>, at: Point3<f64>) -> Isometry3<f64> {
    let forward = (at - eye).normalize();
    let right = forward.cross(&Vector3::z()).normalize();
    let axes = Matrix3::from_columns(&[right, forward.cross(&right), forward]);
    let turn = UnitQuaternion::from_rotation_matrix(&Rotation3::from_matrix_unchecked(axes));
    Isometry3::from_parts(Translation3::from(eye.coords), turn)
}

/// Depths and true poses of cameras all around the table.
fn looks(scene: &Scene, middle: Point3<f64>) -> Vec<(Vec<f32>, Isometry3<f64>)> {
    let look = |n: usize| {
        let angle = std::f64::consts::TAU * (n as f64 + 0.3) / LOOKS as f64;
        let pose = towards(middle + Vector3::new(1.35 * angle.cos(), 1.35 * angle.sin(), 0.75), middle);
        let frame = render(&scene.room, &scene.solids(), &pose, &CAMERA, 0);
        (noise::observe(&frame, &DepthNoise::default(), (0.4, 6.0), 1, n as u64), pose)
    };
    (0..LOOKS).map(look).collect()
}

/// Claims of a camera and a body about themselves.
#[derive(Clone, Copy)]
struct Claims {
    depth: f32,
    camera: Intrinsics,
    mirrored: bool,
    late: usize,
    off: [f64; 3],
    /// Number of looks that are taken.
    taken: usize,
}

const HONEST: Claims =
    Claims { depth: 1.0, camera: CAMERA, mirrored: false, late: 0, off: [0.0; 3], taken: LOOKS };

fn judged(claims: Claims) -> Option<Inconsistency> {
    evidence(claims).inconsistency
}

fn evidence(claims: Claims) -> Consistency {
    let (scene, map) = table();
    let looks = looks(&scene, Point3::new(0.0, 0.0, map.height_m));
    let pixel = |n: usize| match claims.mirrored {
        true => n - n % CAMERA.width + CAMERA.width - 1 - n % CAMERA.width,
        false => n,
    };
    let off = Translation3::from(Vector3::from(claims.off));
    let view = |n: usize| {
        let depths: Vec<f32> = (0..looks[n].0.len()).map(|k| looks[n].0[pixel(k)] * claims.depth).collect();
        let world_from_camera = off * looks[(n + LOOKS - claims.late) % LOOKS].1;
        View {
            intrinsics: Some(claims.camera),
            world_from_camera,
            pose_sigma_m: 0.03,
            pose_sigma_rad: 0.0175,
            ..View::alone(claims.camera.cloud_from_depth(&depths).unwrap())
        }
    };
    let views: Vec<View> = (0..claims.taken).map(view).collect();
    let stated: Vec<(&View, Isometry3<f64>)> = views.iter().map(|v| (v, v.world_from_camera)).collect();
    // Of the frame before the first and after the last nothing is known.
    let shifted = |by: isize| {
        let pose = |n: usize| stated.get(n.checked_add_signed(by)?).map(|(_, pose)| *pose);
        (0..claims.taken).map(pose).collect()
    };
    judge(&stated, &[map], 0, &[(1, shifted(1)), (-1, shifted(-1))])
}

#[test]
fn honest_looks_agree_with_the_map() {
    assert_eq!(judged(HONEST), None);
    assert_eq!(judged(Claims { off: [0.02, -0.02, 0.01], ..HONEST }), None, "within what localisation errs");
}

#[test]
fn a_depth_scale_is_told() {
    for depth in [0.93, 1.05, 1.1] {
        let found = judged(Claims { depth, ..HONEST });
        let told = found.map(|found| found.fault);
        let near = |times: f64| (times - f64::from(depth)).abs() < 0.015;
        assert!(matches!(told, Some(Fault::DepthScale(times)) if near(times)), "{depth}: {told:?}");
    }
}

#[test]
fn mirrored_images_and_late_poses_are_told() {
    let fault = |claims| judged(claims).map(|found: Inconsistency| found.fault);
    assert_eq!(fault(Claims { mirrored: true, ..HONEST }), Some(Fault::Mirrored));
    assert_eq!(fault(Claims { late: 1, ..HONEST }), Some(Fault::Late(1)));
    assert_eq!(fault(Claims { late: LOOKS - 1, ..HONEST }), Some(Fault::Late(-1)));
}

#[test]
fn poses_that_are_all_off_are_told_with_how_far() {
    let found = judged(Claims { off: [0.16, 0.12, 0.0], ..HONEST });
    let Some(Inconsistency { fault: Fault::Displaced(shift, _), spread_m, .. }) = found else {
        panic!("{found:?}");
    };
    assert!((shift - Vector2::new(0.16, 0.12)).norm() < 0.05 && (0.1..0.35).contains(&spread_m), "{found:?}");
}

#[test]
fn a_wrong_focal_length_is_no_place() {
    let camera = Intrinsics { fx: 1.1 * CAMERA.fx, fy: 1.1 * CAMERA.fy, ..CAMERA };
    let found = judged(Claims { camera, ..HONEST });
    assert!(found.is_some_and(|found| found.spread_m > 0.03), "{found:?}");
}

#[test]
fn two_looks_tell_a_depth_scale() {
    for depth in [0.95, 1.05] {
        let told = judged(Claims { depth, taken: 2, ..HONEST }).map(|found| found.fault);
        assert!(matches!(told, Some(Fault::DepthScale(_))), "{depth}: {told:?}");
    }
}

#[test]
fn a_confused_unit_of_length_is_told() {
    for depth in [10.0, 0.1, 1000.0, 1.0 / 0.0254] {
        let told = judged(Claims { depth, ..HONEST }).map(|found| found.fault);
        let near = |times: f64| (times / f64::from(depth) - 1.0).abs() < 1e-3;
        assert!(matches!(told, Some(Fault::DepthScale(times)) if near(times)), "{depth}: {told:?}");
    }
}

#[test]
fn what_looks_allow_of_calibration_errors_widens_places() {
    let honest = evidence(HONEST);
    assert!(honest.doubt < 0.05 && (0.001..0.015).contains(&honest.spread_m), "{honest:?}");
    let alone = evidence(Claims { taken: 1, ..HONEST });
    assert!(alone.inconsistency.is_none() && alone.spread_m > honest.spread_m, "{alone:?}");
    // Half a table's corner is 45 cm away, and its top 75 cm below: 3 % of it are 2.6 cm.
    let off = evidence(Claims { depth: 1.03, taken: 1, ..HONEST });
    assert!(off.spread_m > 0.026 / 3.0, "{off:?}");
}
