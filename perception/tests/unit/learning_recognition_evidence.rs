//! Tests of `learning::recognition::evidence`.

use descry_perception::camera::Intrinsics;
use descry_perception::cloud::Cloud;
use descry_perception::learning::recognition::KnowOptions;
use descry_perception::learning::recognition::evidence::*;
use descry_perception::learning::recognition::scene::SceneView;
use descry_perception::learning::recognition::surfels::Surfels;
use descry_perception::view::View;
use nalgebra::{Isometry3, Point3, Vector3};

const CAMERA: Intrinsics = Intrinsics { width: 320, height: 240, fx: 262.5, fy: 262.5, cx: 159.5, cy: 119.5 };
const PLATE_M: f32 = 0.1;

/// A camera's view of a wall a metre away, with a square plate before the wall or none.
fn wall(plate_before_m: f32) -> SceneView {
    let depth = |i: usize| {
        let (u, v) = ((i % 320) as f32 - 159.5, (i / 320) as f32 - 119.5);
        let near = 1.0 - plate_before_m;
        let half_px = 0.5 * PLATE_M * 262.5 / near;
        if u.abs().max(v.abs()) < half_px { near } else { 1.0 }
    };
    let depths: Vec<f32> = (0..320 * 240).map(depth).collect();
    let cloud = CAMERA.cloud_from_depth(&depths).expect("the camera is sound");
    SceneView::new(&View { intrinsics: Some(CAMERA), ..View::alone(cloud) }, 2.5, 0.05)
        .expect("a depth image")
}

/// A square plate that faces the camera.
fn plate() -> Surfels {
    let at = |k: usize| (k as f32 / 24.0 - 0.5) * PLATE_M;
    let points: Vec<Point3<f32>> = (0..25 * 25).map(|k| Point3::new(at(k % 25), at(k / 25), 0.0)).collect();
    let normals = Some(vec![-Vector3::z(); points.len()]);
    Surfels::of(&Cloud { points, normals, ..Cloud::default() }).expect("few points")
}

#[test]
fn what_lies_inside_a_wide_plane_is_no_object_of_its_size() {
    let judged = |before_m: f32| {
        let pose = Isometry3::translation(0.0, 0.0, f64::from(1.0 - before_m));
        let evidence = verify(&plate(), &pose, &wall(before_m), 10).evidence;
        assert!(evidence.explained_share() > 0.9, "{evidence:?}");
        (evidence.beyond, Judge::default().confidence(&evidence))
    };
    let (inside, before) = (judged(0.0), judged(0.1));
    assert!(inside.0 > 0.8 && inside.1 < 0.2, "{inside:?}");
    assert!(before.0 < 0.05 && before.1 > 0.8, "{before:?}");
}

#[test]
fn what_lies_beyond_the_image_is_not_known() {
    let at = |x: f64| verify(&plate(), &Isometry3::translation(x, 0.0, 1.0), &wall(0.0), 10).evidence;
    // The image ends .61 m beside its middle.
    let (whole, cut) = (at(0.0), at(0.6));
    assert_eq!((whole.facing, whole.hidden), (cut.facing, 0));
    assert!(cut.hidden * 3 > cut.facing && cut.explained_share() > 0.9, "{cut:?}");
    assert!(Judge::default().confidence(&cut) < Judge::default().confidence(&whole));
}

#[test]
fn a_side_of_which_nothing_was_learned_is_not_known() {
    // Of a box of 3 cm a strip of the front was learned, and the back from inside.
    let strip = plate();
    let few: Vec<u32> =
        (0..strip.points.len() as u32).filter(|&i| strip.points[i as usize].x > 0.03).collect();
    let strip = strip.part(&few).expect("few points");
    let mut points = strip.points.clone();
    let mut normals = strip.normals.clone();
    points.extend(plate().points.iter().map(|p| p + Vector3::z() * 0.03));
    normals.resize(points.len(), Vector3::z());
    let shell =
        Surfels::of(&Cloud { points, normals: Some(normals), ..Cloud::default() }).expect("few points");
    let at = |surfels: &Surfels, z: f64| {
        verify(surfels, &Isometry3::translation(0.0, 0.0, z), &wall(0.1), 10).evidence
    };
    let (alone, shell_there) = (at(&strip, 0.9), at(&shell, 0.9));
    assert_eq!((alone.explained, alone.hidden), (shell_there.explained, 0));
    assert!(shell_there.hidden > 2 * alone.facing, "{shell_there:?}");
    assert!(Judge::default().confidence(&shell_there) < Judge::default().confidence(&alone));
    // And where the camera looks past it, it is not there.
    let before = at(&shell, 0.8);
    assert!(before.through > 3 * alone.facing && before.hidden == 0, "{before:?}");
}

#[test]
fn what_is_turned_otherwise_or_seen_through_is_less_sure() {
    // Of a mug and what is none, as it was recorded.
    let other = PoseEvidence {
        facing: 1035,
        explained: 570,
        through: 106,
        hidden: 173,
        colour: Some(0.60),
        off_sigmas: 1.17,
        turned_rad: 0.33,
        beyond: 0.06,
        votes: 4,
    };
    let sure = |e: &PoseEvidence| Judge::default().confidence(e);
    assert!(sure(&other) < KnowOptions::default().least_confidence, "{}", sure(&other));
    assert!(sure(&other) < sure(&PoseEvidence { turned_rad: 0.2, ..other }));
    assert!(sure(&other) < sure(&PoseEvidence { through: 0, ..other }));
}
