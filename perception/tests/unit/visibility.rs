//! Tests of `visibility`.

use descry_perception::camera::Intrinsics;
use descry_perception::view::View;
use descry_perception::visibility::*;
use nalgebra::{Isometry3, Point3};

const CAMERA: Intrinsics = Intrinsics { width: 64, height: 48, fx: 60.0, fy: 60.0, cx: 31.5, cy: 23.5 };

fn wall_at(depth_m: f32) -> View {
    let cloud = CAMERA.cloud_from_depth(&vec![depth_m; 64 * 48]).unwrap_or_default();
    View {
        stamp_ns: 0,
        cloud,
        intrinsics: None,
        world_from_camera: Isometry3::translation(0.0, 0.0, 1.0),
        pose_sigma_m: 0.0,
        pose_sigma_rad: 0.0,
    }
}

#[test]
fn a_wall_parts_the_world_into_free_surface_hidden_and_never() {
    let visibility = Visibility::from_views(&[wall_at(2.0)]);
    let cases = [
        ((0.0, 0.0, 2.5), Seen::Free),
        ((0.0, 0.0, 3.0), Seen::Surface),
        ((0.0, 0.0, 3.5), Seen::Hidden),
        ((0.0, 0.0, 0.5), Seen::Never),
        ((9.0, 0.0, 2.0), Seen::Never),
    ];
    for ((x, y, z), expected) in cases {
        assert_eq!(visibility.look(&Point3::new(x, y, z), 0.01), expected, "at {x} {y} {z}");
    }
}

#[test]
fn many_points_are_judged_as_each_by_itself() {
    // A near half, a far half, and a column without a return.
    let depths: Vec<f32> = (0..64 * 48)
        .map(|pixel| match pixel % 64 {
            10 => f32::NAN,
            0..32 => 1.5,
            _ => 3.0,
        })
        .collect();
    let cloud = CAMERA.cloud_from_depth(&depths).unwrap_or_default();
    let visibility = Visibility::from_views(&[View { cloud, ..wall_at(1.0) }]);
    let step = |k: i32| k as f32 * 0.0713;
    let places = (-40..40).flat_map(|x| (-8..8).map(move |y| (x, y)));
    let points: Vec<Point3<f32>> = places
        .flat_map(|(x, y)| [0.2, 1.7, 2.2, 2.6, 4.2].map(|z| Point3::new(step(x), step(y) * 2.0, z)))
        .collect();
    let mut through = vec![false; points.len()];
    visibility.gazes()[0].pass(&points, 0.03, &mut through);
    let map = &visibility.maps[0];
    let free = |p: &Point3<f32>| {
        let pixel = CAMERA.project(&(map.camera_from_world * p.cast())).and_then(|(u, v)| CAMERA.pixel(u, v));
        let returned = pixel.is_some_and(|pixel| map.depths_m[pixel].is_finite());
        returned && map.look(&p.cast(), 0.03) == Seen::Free
    };
    let expected: Vec<bool> = points.iter().map(free).collect();
    assert_eq!(through, expected);
    let count = through.iter().filter(|through| **through).count();
    assert!(count > 100 && count < points.len() - 100, "{count} of {}", points.len());
}

#[test]
fn a_camera_is_recovered_from_its_organised_cloud() {
    let found = estimate_intrinsics(&wall_at(2.0).cloud);
    let close = found.is_some_and(|f| {
        (f.fx - 60.0).abs() < 1e-3 && (f.cx - 31.5).abs() < 1e-3 && (f.cy - 23.5).abs() < 1e-3
    });
    assert!(close, "{found:?}");
}

#[test]
fn nothing_is_known_without_a_view() {
    assert_eq!(Visibility::default().look(&Point3::origin(), 0.01), Seen::Never);
}
