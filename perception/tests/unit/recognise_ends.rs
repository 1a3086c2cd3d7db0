//! Tests of `recognise::ends`.

use descry_perception::camera::Intrinsics;
use descry_perception::noise::KINECT;
use descry_perception::outline::Rectangle;
use descry_perception::recognise::asker::Asker;
use descry_perception::recognise::body::Ray;
use descry_perception::recognise::body::{Body, Cuboid};
use descry_perception::recognise::ends::*;
use descry_perception::recognise::rays::Rays;
use descry_perception::recognise::rays::{Around, EDGE_PIXELS};
use descry_perception::scale::APART_M;
use descry_perception::visibility::{DepthMap, Visibility};
use nalgebra::{Isometry3, Point3, Rotation3, Translation3, UnitQuaternion, Vector3};

/// A box of 20 by 9 by 12 cm that is turned.
fn there() -> Cuboid {
    let (sin, cos) = 0.3_f64.sin_cos();
    Cuboid { x: 0.02, y: -0.01, turn: (sin, cos), low: [-0.1, -0.045, 0.0], high: [0.1, 0.045, 0.12] }
}

/// Views of a box on a plane, each from a direction relative to its longer side and a height; each
/// is misaligned by `aside_m`.
fn seen_from(eyes: &[(f64, f64)], aside_m: f64) -> Visibility {
    let (width, height) = (320, 240);
    let intrinsics = Intrinsics { width, height, fx: 400.0, fy: 400.0, cx: 160.0, cy: 120.0 };
    let map = |(&(towards_rad, up_m), n): (&(f64, f64), i32)| {
        let eye = Point3::new((0.3 + towards_rad).cos(), (0.3 + towards_rad).sin(), up_m);
        let forward = (Point3::origin() - eye).normalize();
        let right = forward.cross(&Vector3::z()).normalize();
        let turn = Rotation3::from_basis_unchecked(&[right, forward.cross(&right), forward]);
        let depth_m = |n: usize| {
            let (u, v) = ((n % width) as f64 - 160.0, (n / width) as f64 - 120.0);
            let along: [f64; 3] = (turn * Vector3::new(u / 400.0, v / 400.0, 1.0)).into();
            let plane_m = if along[2] < 0.0 { -eye.z / along[2] } else { f64::INFINITY };
            let met_m = there().depth_m(&Ray { from: eye.into(), along }).min(plane_m);
            if met_m.is_finite() { met_m as f32 } else { f32::NAN }
        };
        let turn = UnitQuaternion::from_rotation_matrix(&turn);
        let world_from_camera = Isometry3::from_parts(Translation3::from(eye.coords), turn);
        let depths_m = (0..width * height).map(depth_m).collect();
        let aside = Translation3::new(aside_m * f64::from(n % 2), -aside_m * f64::from(n / 2), 0.0);
        DepthMap {
            intrinsics,
            camera_from_world: (aside * world_from_camera).inverse(),
            depths_m,
            colours: None,
        }
    };
    Visibility { maps: eyes.iter().zip(0..).map(map).collect(), held: true }
}

/// Likelihoods of both sides, from an initial footprint too short by `short_m` at one end of each.
fn told(eyes: &[(f64, f64)], aside_m: f64, short_m: f64) -> [Side; 2] {
    let seen = seen_from(eyes, aside_m);
    let asker = Asker::of(&seen, Isometry3::identity(), &[], APART_M);
    let around = Around { x: 0.02, y: -0.01, reach_m: 0.25, base_m: 0.0, top_m: 0.13, pixels: EDGE_PIXELS };
    let rays = Rays::of(&asker, &KINECT, &around, &[], std::iter::empty());
    let short = there().longer(1, -short_m).longer(3, -short_m);
    let [u, v] = [0, 1].map(|k| 0.5 * (short.low[k] + short.high[k]));
    let (sin, cos) = short.turn;
    let along_m = [short.length_m(0), short.length_m(2)];
    let (x, y) = (short.x + cos * u - sin * v, short.y + sin * u + cos * v);
    let about = Rectangle { x, y, sides_m: along_m, turn: short.turn, along_m, residual_m: 0.0 };
    sides(&rays, [&about; 2], (0.0, 0.12), 0.3)
}

#[test]
fn sides_are_as_long_as_rays_meet_them_however_short_a_footprint_is() {
    for (aside_m, short_m) in [(0.0, 0.0), (0.0, 0.012), (0.0, 0.03), (0.008, 0.0), (0.015, 0.0)] {
        let [long, short] = told(&[(0.4, 0.8), (2.0, 0.8), (4.2, 0.8)], aside_m, short_m);
        let off_m = [long.likeliest_m() - 0.2, short.likeliest_m() - 0.09];
        assert!(off_m.iter().all(|m| m.abs() < 0.007), "{off_m:?} m off, {aside_m} m aside, {short_m} m");
        for (side, other_m) in [(&long, 0.17), (&long, 0.23), (&short, 0.07), (&short, 0.11)] {
            let other = side.likelihood(other_m);
            assert!(other < 1e-3, "{other_m} m: {other}, {aside_m} m aside, {short_m} m");
        }
    }
}

#[test]
fn what_is_hidden_behind_a_front_may_be_any_length() {
    // Level with its top, along its longer side: nothing but its narrow front is seen.
    let [long, short] = told(&[(0.0, 0.12)], 0.0, 0.0);
    assert!(long.likelihood(0.28) > 0.5 && long.likelihood(0.1) > 0.5, "{long:?}");
    assert!(short.likelihood(0.07) < 0.1 && short.likelihood(0.11) < 0.1, "{short:?}");
    // As likely up to any length, it is as long as things are of which half are longer than 20 cm.
    let longer = long.sum(|at_m| if at_m > 0.2 { 2.5 } else { 0.0 }, 0.0);
    assert!((0.15..0.35).contains(&longer), "{longer}");
}
