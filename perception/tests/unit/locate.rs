//! Tests of `locate`.

use descry_perception::camera::Intrinsics;
use descry_perception::locate::endings::endings;
use descry_perception::locate::*;
use descry_perception::merge::{MergeOptions, merge};
use descry_perception::surface::{Region, SurfaceOptions, find_surface};
use descry_perception::view::View;
use nalgebra::{Isometry3, Matrix3, Point3, Translation3, UnitQuaternion, Vector3};

const CAMERA: Intrinsics = Intrinsics { width: 320, height: 240, fx: 262.0, fy: 262.0, cx: 159.5, cy: 119.5 };
/// Box by minimum and maximum corner.
type Block = [[f64; 3]; 2];
const BOARD: Block = [[-0.8, -0.4, 0.695], [0.8, 0.4, 0.72]];
const FLOOR: Block = [[-9.0, -9.0, -0.1], [9.0, 9.0, 0.0]];

/// The faults of the camera.
#[derive(Clone, Copy, Default)]
struct Faults {
    /// Maximum depth error, as a share of the squared depth.
    noise: f64,
    /// Pixels lost on either side of a depth edge; further field: lost pixels to the right of a
    /// falling edge.
    lost: usize,
    shadow: usize,
}

fn outline() -> Vec<Point3<f64>> {
    let [low, high] = BOARD;
    let corners = [[low[0], low[1]], [high[0], low[1]], [high[0], high[1]], [low[0], high[1]]];
    corners.iter().map(|c| Point3::new(c[0], c[1], high[2])).collect()
}

/// Distance along a ray to the first block; infinite without a hit.
fn hit(blocks: &[Block], eye: &Point3<f64>, ray: &Vector3<f64>) -> f64 {
    let each = blocks.iter().map(|[low, high]| {
        let (mut near, mut far) = (0.0_f64, f64::INFINITY);
        for i in 0..3 {
            let (a, b) = ((low[i] - eye[i]) / ray[i], (high[i] - eye[i]) / ray[i]);
            (near, far) = (near.max(a.min(b)), far.min(a.max(b)));
        }
        if near <= far { near } else { f64::INFINITY }
    });
    each.fold(f64::INFINITY, f64::min)
}

/// View of a camera at one point that looks at another.
fn view(blocks: &[Block], eye: [f64; 3], at: [f64; 3], faults: Faults) -> View {
    let (eye, at) = (Point3::from(eye), Point3::from(at));
    let forward = (at - eye).normalize();
    let right = forward.cross(&Vector3::z()).normalize();
    let axes = Matrix3::from_columns(&[right, forward.cross(&right), forward]);
    let turn = UnitQuaternion::from_matrix(&axes);
    let world_from_camera = Isometry3::from_parts(Translation3::from(eye.coords), turn);
    let (width, count) = (CAMERA.width, CAMERA.width * CAMERA.height);
    let ray =
        |pixel: usize| turn * CAMERA.unproject((pixel % width) as f64, (pixel / width) as f64, 1.0).coords;
    let exact: Vec<f64> = (0..count).map(|pixel| hit(blocks, &eye, &ray(pixel))).collect();
    let noise = |pixel: usize| (pixel * 7919 % 8191) as f64 / 4095.0 - 1.0;
    let depths: Vec<f32> = (0..count)
        .map(|pixel| {
            let z = exact[pixel];
            let far = |steps: isize, step: usize| exact.get(pixel.wrapping_add_signed(steps * step as isize));
            let jumps = |steps: isize, step: usize| far(steps, step).is_some_and(|f| (f - z).abs() > 0.1);
            let n = faults.lost as isize;
            let is_lost = (-n..=n).any(|k| jumps(k, 1) || jumps(k, width));
            let in_shadow = (1..=faults.shadow as isize).any(|k| far(-k, 1).is_some_and(|f| f + 0.1 < z));
            let noisy = z + faults.noise * z * z * noise(pixel);
            if is_lost && pixel % 2 == 0 || in_shadow { f32::NAN } else { noisy as f32 }
        })
        .collect();
    View {
        stamp_ns: 0,
        cloud: CAMERA.cloud_from_depth(&depths).unwrap_or_default(),
        intrinsics: Some(CAMERA),
        world_from_camera,
        pose_sigma_m: 0.03,
        pose_sigma_rad: 0.03,
    }
}

/// Aligns a misplaced view of some blocks with the board's outline; returns the remaining error of
/// the board's centre, metres.
fn laid(view: &View, told_from_true: &Isometry3<f64>) -> (Vector3<f64>, Located) {
    let told = View { world_from_camera: told_from_true * view.world_from_camera, ..view.clone() };
    let up = Some(Vector3::z_axis());
    let found = merge(&[told], &MergeOptions { up, ..MergeOptions::default() }).unwrap();
    let region = Some(Region { corners: outline(), margin_m: 0.25 });
    let options = SurfaceOptions { up, region, height_band_m: Some((0.6, 0.8)), ..SurfaceOptions::default() };
    let surface = find_surface(&found.cloud, &found.visibility, &options).unwrap();
    let located =
        locate(&endings(&found.visibility, &surface), &surface.hull, &surface.up, &outline(), 0.05, 0.05);
    let middle = Point3::new(0.0, 0.0, BOARD[1][2]);
    (located.map_from_world * (told_from_true * middle) - middle, located)
}

/// Checks that a misplaced view of the board with other blocks is aligned to within a distance.
fn check(others: &[Block], eye: [f64; 3], faults: Faults, within_m: f64) {
    let blocks = [others, &[BOARD, FLOOR]].concat();
    for (x_m, y_m, yaw_deg) in [(0.0, 0.0, 0.0), (0.04, -0.03, 2.0), (-0.06, 0.05, -4.0)] {
        let told = Isometry3::new(Vector3::new(x_m, y_m, 0.0), Vector3::z() * f64::to_radians(yaw_deg));
        let (off, located) = laid(&view(&blocks, eye, [0.0, 0.0, 0.72], faults), &told);
        let case = format!("from {eye:?}, told {x_m}, {y_m}, {yaw_deg}");
        assert!(off.xy().norm() < within_m, "{case}: {off:?} off, {located:?}");
    }
}

const BEFORE: [f64; 3] = [0.2, -1.6, 1.5];
const BESIDE: [f64; 3] = [1.9, 0.5, 1.4];

#[test]
fn a_table_comes_back_to_its_place() {
    check(&[], BEFORE, Faults::default(), 0.006);
    check(&[], BESIDE, Faults::default(), 0.006);
    let on_a_corner = [[0.5, 0.1, 0.72], [0.9, 0.5, 1.0]];
    check(&[on_a_corner], BEFORE, Faults::default(), 0.006);
    let in_front = [[-0.3, -0.39, 0.72], [0.2, -0.2, 0.95]];
    check(&[in_front], BEFORE, Faults::default(), 0.006);
}

#[test]
fn noise_and_what_an_edge_loses_do_not_move_an_end() {
    let faults = Faults { noise: 0.006, lost: 1, shadow: 0 };
    check(&[], BEFORE, faults, 0.006);
    check(&[], BESIDE, faults, 0.006);
    check(&[], BEFORE, Faults { shadow: 20, ..faults }, 0.01);
    check(&[], BESIDE, Faults { shadow: 20, ..faults }, 0.01);
}

#[test]
fn the_border_of_a_shadow_is_no_end() {
    let hides_the_left_end = [[-0.78, -0.38, 0.72], [-0.5, -0.1, 1.2]];
    check(&[hides_the_left_end], [0.9, -1.2, 1.3], Faults { lost: 1, ..Faults::default() }, 0.006);
}

#[test]
fn where_something_upright_stands_against_it_the_surface_does_not_end() {
    // Against the right end, and farther than the board is deep.
    let cupboard = [[0.8, -0.6, 0.0], [1.2, 0.6, 1.1]];
    check(&[cupboard], [-0.9, -1.4, 1.5], Faults { noise: 0.003, lost: 1, shadow: 0 }, 0.006);
}

#[test]
fn a_board_between_uprights_lies_between_them() {
    let uprights = [[[-0.83, -0.4, 0.0], [-0.8, 0.4, 1.6]], [[0.8, -0.4, 0.0], [0.83, 0.4, 1.6]]];
    check(&uprights, [0.1, -1.6, 1.3], Faults { noise: 0.003, lost: 1, shadow: 0 }, 0.012);
    let box_at_an_end = [[-0.79, -0.39, 0.72], [-0.74, 0.39, 0.9]];
    let others = [uprights[0], uprights[1], box_at_an_end];
    check(&others, [0.1, -1.6, 1.3], Faults { noise: 0.003, lost: 1, shadow: 0 }, 0.04);
}

#[test]
fn how_well_it_lies_is_known() {
    let along_m = |others: &[Block], eye, at| {
        let blocks = [others, &[BOARD, FLOOR]].concat();
        let (_, located) = laid(&view(&blocks, eye, at, Faults::default()), &Isometry3::identity());
        let (way, sigma_m) = located.certainty.unwrap().worst(&Point3::new(0.3, 0.0, 0.72));
        (way.x.abs(), sigma_m)
    };
    let (_, whole_m) = along_m(&[], BEFORE, [0.0, 0.0, 0.72]);
    assert!(whole_m < 0.01, "{whole_m}");
    // Of the right half no end is seen, and the left end is out of the picture.
    let cupboard = [[0.8, -0.6, 0.0], [1.2, 0.6, 1.1]];
    let (way, half_m) = along_m(&[cupboard], [0.4, -1.2, 1.2], [0.5, 0.0, 0.72]);
    assert!(way > 0.99 && (0.04..0.051).contains(&half_m), "{way} {half_m}");
}

#[test]
fn what_no_end_tells_stays() {
    let near = view(&[BOARD, FLOOR], [0.0, -0.1, 1.3], [0.0, 0.0, 0.72], Faults::default());
    let (off, located) = laid(&near, &Isometry3::translation(0.03, 0.02, 0.0));
    let stays = (off - Vector3::new(0.03, 0.02, 0.0)).norm() < 1e-9;
    assert!(stays && located.matched == 0, "{off:?}, {located:?}");
    let none = locate(&[], &[], &Vector3::z_axis(), &outline(), 0.05, 0.05);
    assert_eq!((none.map_from_world, none.matched), (Isometry3::identity(), 0));
}
