//! Tests of `looking::vanished`.

use descry_domains::looking::vanished::*;
use descry_domains::surface::KnownSurface;
use descry_memory::RecordId;
use descry_memory::belief::{Belief, Track};
use descry_perception::Intrinsics;
use descry_perception::nalgebra::{Isometry3, Point3, Translation3, UnitQuaternion, Vector3};
use descry_perception::recognise::Evidence;
use descry_perception::visibility::DepthMap;

/// A camera two metres above a table that sees something of a height everywhere.
fn seen_from_above(height_m: f64) -> DepthMap {
    let intrinsics = Intrinsics { width: 64, height: 48, fx: 100.0, fy: 100.0, cx: 32.0, cy: 24.0 };
    let down = UnitQuaternion::from_axis_angle(&Vector3::x_axis(), std::f64::consts::PI);
    let world_from_camera = Isometry3::from_parts(Translation3::new(0.0, 0.0, 2.0), down);
    let depths_m = vec![(2.0 - height_m) as f32; 64 * 48].into();
    DepthMap { intrinsics, camera_from_world: world_from_camera.inverse(), depths_m, colours: None }
}

fn track(id: u64, x: f64, cup: f64, side_m: f64) -> Track {
    Track {
        id,
        on: "table".into(),
        position_m: Point3::new(x, 0.0, 0.0),
        position_sigma_m: 0.002,
        size_m: [side_m, side_m, 0.12],
        footprint_m: vec![],
        probabilities: vec![("cup A".into(), cup)],
        kinds: vec![("cup".into(), cup)],
        unknown: 1.0 - cup,
        colours: Vec::new(),
        seen_fraction: 0.5,
        viewpoints_m: vec![],
        evidence: Evidence::default(),
        cites: vec![RecordId(1)],
        first_ns: 0,
        last_ns: 0,
    }
}

/// Checks if an object that no merge found again is still believed in: given its probability, the depth that
/// the newest view shows there, and the distance and width of another found object.
fn check(cup: f64, newest_m: Option<f64>, other: Option<(f64, f64)>, kept: bool) {
    let table = KnownSurface {
        symbol: "table".into(),
        name: "table".into(),
        room: None,
        floor: Vec::new(),
        outline: vec![],
        up: Vector3::z(),
        whole: true,
        doubtful: None,
        placed: None,
        displaced_m: 0.0,
        sensor_doubt: 0.0,
    };
    let mut belief = Belief::default();
    belief.gone = vec![track(0, 0.0, 1.0, 0.07), track(1, 0.0, cup, 0.07)];
    belief.tracks = other.map(|(x, side_m)| track(2, x, 0.1, side_m)).into_iter().collect();
    let newest = newest_m.map(seen_from_above);
    keep_unrefuted(&mut belief, 1, &table, newest.as_ref(), &["cup A", "cup"]);
    let still = belief.tracks.iter().any(|t| t.id == 1);
    let context = format!("cup {cup}, newest {newest_m:?}, other {other:?}");
    assert_eq!((still, belief.gone.len()), (kept, if kept { 1 } else { 2 }), "{context}");
    assert_eq!(belief.gone[0].id, 0, "what was gone before stays gone: {context}");
}

#[test]
fn what_no_view_refutes_is_still_believed_in() {
    check(0.4, None, None, true);
    check(0.4, Some(0.1), None, true);
    check(0.4, Some(0.0), None, false);
    check(0.01, None, None, false);
    check(0.4, None, Some((0.02, 0.07)), false);
    check(0.4, None, Some((0.09, 0.07)), true);
    check(0.4, None, Some((0.09, 0.25)), false);
    check(0.6, None, Some((0.09, 0.25)), true);
    check(0.6, None, Some((0.02, 0.07)), false);
}
