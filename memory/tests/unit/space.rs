//! Tests of `space`.

use descry_memory::space::*;
use descry_perception::Intrinsics;
use descry_perception::nalgebra::{Isometry3, Point3};
use descry_perception::visibility::DepthMap;

/// Space after a view from the origin along z, of a wall at 1 m on the left and at 2 m on the right.
fn seen() -> Space {
    let intrinsics = Intrinsics { width: 160, height: 120, fx: 130.0, fy: 130.0, cx: 80.0, cy: 60.0 };
    let depths_m = (0..160 * 120).map(|i| if i % 160 < 80 { 1.0 } else { 2.0 }).collect();
    let mut space = Space::default();
    space.integrate(&DepthMap {
        intrinsics,
        camera_from_world: Isometry3::identity(),
        depths_m,
        colours: None,
    });
    space
}

#[test]
fn what_is_before_is_free_what_is_on_is_occupied_what_is_behind_is_unseen() {
    let space = seen();
    for (x, z, expected) in [
        (-0.2, 0.5, Cell::Free),
        (-0.2, 1.0, Cell::Occupied),
        (-0.2, 1.5, Cell::Unseen),
        (0.2, 1.5, Cell::Free),
        (0.2, 2.0, Cell::Occupied),
        (0.2, 2.5, Cell::Unseen),
        (-3.0, 1.0, Cell::Unseen),
        (0.2, -1.0, Cell::Unseen),
    ] {
        assert_eq!(space.cell(&Point3::new(x, 0.0, z)), expected, "x {x}, z {z}");
    }
}

#[test]
fn sight_ends_at_what_was_seen() {
    let space = seen();
    let sight = |from: [f64; 3], to: [f64; 3]| {
        space.line_of_sight(&Point3::from(from), &Point3::from(to), &|_| false)
    };
    assert!(sight([0.0; 3], [-0.2, 0.0, 0.9]));
    assert!(sight([0.0; 3], [-0.2, 0.0, 1.0]), "a surface does not hide itself");
    assert!(!sight([0.0; 3], [-0.2, 0.0, 1.3]));
    assert!(sight([0.5, 0.0, 1.6], [-0.2, 0.0, 1.5]), "from the side, what is behind the wall can be seen");
}

#[test]
fn a_surface_seen_at_a_grazing_angle_is_no_free_space() {
    let intrinsics = Intrinsics { width: 64, height: 480, fx: 525.0, fy: 525.0, cx: 32.0, cy: 240.0 };
    // A level top 14 cm below a camera that looks along it; y is down.
    for below_m in (0..10).map(|mm| 0.141 + 0.002 * f64::from(mm)) {
        let depth = |row: usize| if row > 280 { below_m * 525.0 / (row as f64 - 240.0) } else { f64::NAN };
        let depths_m = (0..64 * 480).map(|at| depth(at / 64) as f32).collect();
        let map = DepthMap { intrinsics, camera_from_world: Isometry3::identity(), depths_m, colours: None };
        let mut space = Space::default();
        space.integrate(&map);
        for z in [0.6, 0.7, 0.8] {
            let cell = space.cell(&Point3::new(0.0, below_m, z));
            assert_eq!(cell, Cell::Occupied, "{below_m} m below, {z} m ahead");
        }
    }
}

#[test]
fn the_unseen_end_of_a_way_is_measured() {
    let space = seen();
    for (to, last_m, least, most) in [
        ([-0.2, 0.0, 0.9], 0.4, 0.0, 0.001),
        ([-0.2, 0.0, 1.4], 0.3, 0.25, 0.301),
        ([-0.2, 0.0, 1.4], 9.0, 0.4, 0.5),
    ] {
        let unseen_m = space.unseen_m(&Point3::origin(), &Point3::from(to), last_m);
        assert!((least..=most).contains(&unseen_m), "{unseen_m} m before {to:?}");
    }
}

#[test]
fn skipping_what_is_empty_changes_no_line_of_sight() {
    let space = seen();
    let at = |n: i32, side: i32| f64::from(n % side) / f64::from(side) - 0.5;
    let sample_by_sample = |from: &Point3<f64>, to: &Point3<f64>| {
        let steps = ((to - from).norm() / space.voxel_m - 2.0) as i64;
        let step = (to - from).normalize() * space.voxel_m;
        (0..=steps).all(|k| space.cell(&(from + step * k as f64)) != Cell::Occupied)
    };
    let (mut open, mut closed) = (0, 0);
    for n in 0..2000 {
        let from = Point3::new(at(n, 7), at(n, 11), at(n, 13));
        let to = Point3::new(1.5 * at(n, 17), 1.2 * at(n, 19), 2.5 + at(n, 23));
        let sight = space.line_of_sight(&from, &to, &|_| false);
        assert_eq!(sight, sample_by_sample(&from, &to), "from {from} to {to}");
        if sight { open += 1 } else { closed += 1 }
    }
    assert!(open > 100 && closed > 100, "{open} open, {closed} closed");
}

#[test]
fn later_looks_outweigh_earlier_ones() {
    let mut space = seen();
    let intrinsics = Intrinsics { width: 160, height: 120, fx: 130.0, fy: 130.0, cx: 80.0, cy: 60.0 };
    let away = DepthMap {
        intrinsics,
        camera_from_world: Isometry3::identity(),
        depths_m: vec![3.0; 160 * 120].into(),
        colours: None,
    };
    (0..4).for_each(|_| space.integrate(&away));
    assert_eq!(space.cell(&Point3::new(-0.2, 0.0, 1.0)), Cell::Free, "it was taken away");
}

#[test]
fn the_same_views_give_the_same_map() {
    assert_eq!(seen().extent(), seen().extent());
    let empty = Space::default();
    assert_eq!(empty.cell(&Point3::new(f64::NAN, f64::INFINITY, 0.0)), Cell::Unseen);
    assert_eq!(empty.unseen_share(&Point3::origin(), &Point3::new(0.1, 0.1, 0.1)), 1.0);
}
