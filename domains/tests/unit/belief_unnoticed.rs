//! Tests of `belief::unnoticed`.

use descry_domains::belief::unnoticed::*;
use descry_domains::surface::KnownSurface;
use descry_memory::RecordId;
use descry_memory::belief::Track;
use descry_memory::space::Space;
use descry_perception::Intrinsics;
use descry_perception::nalgebra::{Isometry3, Point3, Translation3, UnitQuaternion, Vector3};
use descry_perception::recognise::Evidence;
use descry_perception::visibility::DepthMap;

/// Space that a camera two metres above a table has seen of a disc of 7 cm at a height: everything below the
/// disc is unseen.
fn seen_from_above(disc_m: f64) -> Space {
    let intrinsics = Intrinsics { width: 320, height: 240, fx: 500.0, fy: 500.0, cx: 160.0, cy: 120.0 };
    let depth_m = |n: usize| {
        let (u, v) = ((n % 320) as f64 - 160.0, (n / 320) as f64 - 120.0);
        let above = 2.0 - disc_m;
        if (u * above / 500.0).hypot(v * above / 500.0) < 0.035 { above as f32 } else { 2.0 }
    };
    let down = UnitQuaternion::from_axis_angle(&Vector3::x_axis(), std::f64::consts::PI);
    let world_from_camera = Isometry3::from_parts(Translation3::new(0.0, 0.0, 2.0), down);
    let depths_m = (0..320 * 240).map(depth_m).collect();
    let mut space = Space::default();
    space.integrate(&DepthMap {
        intrinsics,
        camera_from_world: world_from_camera.inverse(),
        depths_m,
        colours: None,
    });
    space
}

/// Space that a camera one metre before a cup has seen of it from the side: a piece of its middle, of these
/// heights and half width.
fn seen_from_the_side(low_m: f64, high_m: f64, aside_m: f64) -> Space {
    let intrinsics = Intrinsics { width: 320, height: 240, fx: 500.0, fy: 500.0, cx: 160.0, cy: 120.0 };
    let depth_m = |n: usize| {
        let (u, v) = ((n % 320) as f64 - 160.0, (n / 320) as f64 - 120.0);
        let (aside, height) = (u / 500.0, 0.05 - v / 500.0);
        let is_seen = aside.abs() < aside_m && height > low_m && height < high_m;
        // From afar noise is as wide as the cup.
        let noise_m = 0.015 * ((n * 7919) % 5) as f64 - 0.03;
        let front_m = (0.035_f64.powi(2) - aside * aside).max(0.0).sqrt();
        if is_seen { (1.0 - front_m + noise_m) as f32 } else { 3.0 }
    };
    // Along +x, with the image's rows downwards.
    let ahead =
        UnitQuaternion::from_euler_angles(-std::f64::consts::FRAC_PI_2, 0.0, -std::f64::consts::FRAC_PI_2);
    let world_from_camera = Isometry3::from_parts(Translation3::new(-1.0, 0.0, 0.05), ahead);
    let depths_m = (0..320 * 240).map(depth_m).collect();
    let mut space = Space::default();
    space.integrate(&DepthMap {
        intrinsics,
        camera_from_world: world_from_camera.inverse(),
        depths_m,
        colours: None,
    });
    space
}

#[test]
fn what_is_left_of_a_thing_seen_from_afar_may_be_the_whole() {
    let left = |low_m: f64, high_m: f64, surface: &KnownSurface| {
        let space = seen_from_the_side(low_m, high_m, 0.03);
        unseen_volume(surface, &space, &[], &Point3::origin(), (0.104, 0.07)).map(|hidden| hidden.likely)
    };
    assert_eq!(left(0.0, 0.075, &table()), Some(true), "its rim was cut off");
    assert_eq!(left(0.0, 0.02, &table()), None, "too little is left of it");
    let boundless = KnownSurface { whole: false, ..table() };
    assert_eq!(left(0.0, 0.075, &boundless), None);
}

#[test]
fn what_was_measured_of_a_wall_is_no_thing() {
    let likely = |seen_up_to_m: f64, surface: &KnownSurface| {
        let space = seen_from_the_side(0.0, seen_up_to_m, 0.5);
        unseen_volume(surface, &space, &[], &Point3::origin(), (0.104, 0.07)).map(|hidden| hidden.likely)
    };
    let before_wall = |wall_m: f64| {
        let floor = [(-2.0, -2.0), (wall_m, -2.0), (wall_m, 2.0), (-2.0, 2.0)];
        let floor = floor.map(|(x, y)| Point3::new(x, y, -0.7)).to_vec();
        KnownSurface { floor, ..table() }
    };
    assert_eq!(likely(0.2, &table()), Some(true));
    assert_eq!(likely(0.2, &before_wall(0.01)), Some(false), "a wall stands there");
    assert_eq!(likely(0.11, &before_wall(0.01)), Some(false), "a wall of which little was seen");
    assert_eq!(likely(0.11, &before_wall(0.15)), Some(true), "the wall is too far behind it");
}

#[test]
fn nothing_is_looked_for_in_a_vessel() {
    let hidden = |standing: &[&Track]| {
        let at = Point3::origin();
        unseen_volume(&table(), &Space::default(), standing, &at, (0.104, 0.06)).is_some()
    };
    let known = Track {
        unknown: 0.05,
        kinds: vec![("cup".into(), 0.95)],
        probabilities: vec![("cup B".into(), 0.95)],
        ..disc()
    };
    assert!(hidden(&[]));
    assert!(hidden(&[&disc()]), "of what is not known it may be a part");
    assert!(!hidden(&[&known]));
}

fn table() -> KnownSurface {
    let corners = [(-0.5, -0.4), (0.5, -0.4), (0.5, 0.4), (-0.5, 0.4)];
    KnownSurface {
        symbol: "table".into(),
        name: "table".into(),
        room: None,
        floor: Vec::new(),
        outline: corners.map(|(x, y)| Point3::new(x, y, 0.0)).to_vec(),
        up: Vector3::z(),
        whole: true,
        doubtful: None,
        placed: None,
        displaced_m: 0.0,
        sensor_doubt: 0.0,
    }
}

/// An object of which the disc is the top.
fn disc() -> Track {
    let round = |k: usize| {
        let angle = std::f64::consts::TAU * k as f64 / 12.0;
        Point3::new(0.04 * angle.cos(), 0.04 * angle.sin(), 0.0)
    };
    Track {
        id: 0,
        on: "table".into(),
        position_m: Point3::origin(),
        position_sigma_m: 0.002,
        size_m: [0.07, 0.07, 0.1],
        footprint_m: (0..12).map(round).collect(),
        probabilities: vec![("cup A".into(), 0.01)],
        kinds: vec![("cup".into(), 0.01)],
        unknown: 0.99,
        colours: Vec::new(),
        seen_fraction: 0.5,
        viewpoints_m: vec![],
        evidence: Evidence::default(),
        cites: vec![RecordId(1)],
        first_ns: 0,
        last_ns: 0,
    }
}

#[test]
fn strips_between_others_may_be_of_one_thing() {
    let likely = |pieces: &[&Track]| {
        let space = seen_from_the_side(0.0, 0.075, 0.03);
        let hidden = unseen_volume(&table(), &space, pieces, &Point3::origin(), (0.104, 0.07));
        hidden.map(|hidden| hidden.likely)
    };
    let piece = |wide_m: f64| {
        let narrow = |p: Point3<f64>| Point3::new(p.x * wide_m / 0.08, p.y, 0.0);
        let footprint_m = disc().footprint_m.into_iter().map(narrow);
        Track { size_m: [0.07, wide_m, 0.1], footprint_m: footprint_m.collect(), ..disc() }
    };
    assert_eq!(likely(&[&piece(0.03)]), Some(true));
    assert_eq!(likely(&[&piece(0.06)]), None, "so much of it was seen that it is known not to be it");
    let known = Track {
        unknown: 0.05,
        kinds: vec![("box".into(), 0.95)],
        probabilities: vec![("box".into(), 0.95)],
        ..piece(0.03)
    };
    assert_eq!(likely(&[&known]), None);
    assert_eq!(likely(&[&Track { size_m: [0.07, 0.03, 0.16], ..piece(0.03) }]), None, "higher than it");
    assert_eq!(likely(&[&Track { size_m: [0.12, 0.03, 0.1], ..piece(0.03) }]), None, "longer");
}

/// Checks if a cup of 7 cm may stand unnoticed under the seen disc.
fn check(disc_m: f64, cup_m: f64, standing: &[&Track], expected: bool) {
    let hidden =
        unseen_volume(&table(), &seen_from_above(disc_m), standing, &Point3::origin(), (cup_m, 0.07));
    assert_eq!(hidden.is_some(), expected, "disc at {disc_m} m, {} objects", standing.len());
}

#[test]
fn what_was_measured_and_no_object_explains_is_likely_something() {
    let likely = |disc_m: f64, standing: &[&Track]| {
        let space = seen_from_above(disc_m);
        let hidden = unseen_volume(&table(), &space, standing, &Point3::origin(), (0.104, 0.07));
        hidden.map(|hidden| hidden.likely)
    };
    assert_eq!(likely(0.104, &[]), Some(true));
    assert_eq!(likely(0.20, &[]), Some(false), "it stands below what was measured");
    assert_eq!(likely(0.104, &[&disc()]), None);
}

#[test]
fn what_is_one_piece_with_something_larger_may_be_it() {
    let likely = |disc_m: f64, piece: &Track| {
        let space = seen_from_above(disc_m);
        let hidden = unseen_volume(&table(), &space, &[piece], &Point3::origin(), (0.104, 0.07));
        hidden.map(|hidden| hidden.likely)
    };
    let wide = |scale: f64| {
        let footprint_m = disc().footprint_m.iter().map(|p| p * scale).collect();
        Track { size_m: [0.07 * scale, 0.07, 0.3], footprint_m, ..disc() }
    };
    assert_eq!(likely(0.104, &wide(4.0)), Some(true), "a cup beside a box, both seen as one thing");
    assert_eq!(likely(0.20, &wide(4.0)), None, "the place is below the box");
    assert_eq!(likely(0.104, &wide(1.5)), None, "hardly larger than a cup");
    let known = Track {
        unknown: 0.05,
        kinds: vec![("tray".into(), 0.95)],
        probabilities: vec![("tray".into(), 0.95)],
        ..wide(4.0)
    };
    assert_eq!(likely(0.104, &known), None, "it is known what it is");
    let beside = |aside_m: f64| {
        let evidence = Evidence { radius_m: 0.05, ..Evidence::default() };
        Track { position_m: Point3::new(aside_m, 0.0, 0.0), evidence, ..known.clone() }
    };
    assert_eq!(likely(0.104, &beside(0.1)), Some(true), "a cup beside a known cylinder, seen as one thing");
    assert_eq!(likely(0.104, &beside(0.02)), None, "it is of the cylinder");
}

#[test]
fn a_rim_that_no_object_explains_may_be_its_own() {
    check(0.104, 0.104, &[], true);
    check(0.104, 0.104, &[&disc()], false);
    // What stands under a roof that is an object stands within a solid body.
    check(0.20, 0.104, &[&disc()], false);
    check(0.0, 0.104, &[], false);
}
