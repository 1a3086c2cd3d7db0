//! Invariance of perception to the form of its input: in rows or as bare points, in any frame and order.

use crate::tabletop::{Draws, Thing, look, on_ring};
use descry_perception::cloud::is_finite;
use descry_perception::nalgebra::{Isometry3, Point3, UnitQuaternion, Vector3};
use descry_perception::recognise::{Descry, Handle, Range, Top};
use descry_perception::segment::{SceneOptions, segment};
use descry_perception::{Cloud, ObjectModel, Percept, Recogniser, View, Visibility};
use std::sync::LazyLock;

fn models() -> Vec<ObjectModel> {
    let cup = |name: &str, diameter_m, height_m| ObjectModel {
        name: name.into(),
        kind: "cup".into(),
        phrases: Vec::new(),
        shape: Default::default(),
        height_m: Range { low: height_m, high: height_m },
        diameter_m: Some(Range { low: diameter_m, high: diameter_m }),
        width_m: None,
        depth_m: None,
        taper: Range { low: 0.95, high: 1.05 },
        top: Top::Open,
        handle: Handle::None,
        colours: Vec::new(),
    };
    vec![cup("cup A", 0.070, 0.104), cup("cup B", 0.088, 0.155)]
}

/// Two cups, a mug and a box on a table.
static VIEW: LazyLock<View> = LazyLock::new(|| {
    let cup = |x, y, radius, height, handle_rad| Thing::Cup { x, y, radius, height, handle_rad };
    let things = [
        cup(0.10, 0.02, 0.035, 0.104, None),
        cup(-0.15, 0.10, 0.044, 0.155, None),
        cup(0.02, -0.18, 0.040, 0.095, Some(1.4)),
        Thing::Block { x: -0.3, y: -0.1, half: [0.05, 0.03], height: 0.12, turn_rad: 0.4 },
    ];
    let pose = on_ring(0.3, 1.2, 1.4);
    look(&things, &pose, &pose, &mut Draws(11))
});

fn found(cloud: &Cloud, seen: &Visibility) -> Vec<Percept> {
    let scene = segment(cloud, seen, &SceneOptions::default()).expect("there is a table");
    Descry::default().recognise(&scene, seen, &models())
}

/// Percepts of the original view with its camera at a pose.
fn in_rows(pose: &Isometry3<f64>) -> Vec<Percept> {
    let view = View { world_from_camera: *pose, ..VIEW.clone() };
    found(&view.cloud.transformed(pose), &Visibility::from_views(std::slice::from_ref(&view)))
}

/// The percepts of bare points, seen from a pose.
fn loose(points: Vec<Point3<f32>>, pose: &Isometry3<f64>) -> Vec<Percept> {
    let cloud = Cloud::from_points(points).transformed(pose);
    let seen = Visibility::from_viewpoints(&cloud, &[Point3::from(pose.translation.vector)]);
    found(&cloud, &seen)
}

fn bare() -> Vec<Point3<f32>> {
    VIEW.cloud.points.iter().copied().filter(is_finite).collect()
}

/// Checks that percepts have the same names and places with nearly the same probabilities.
fn check(what: &str, pose: &Isometry3<f64>, percepts: &[Percept], off: f64) {
    static AS_IT_IS: LazyLock<Vec<Percept>> = LazyLock::new(|| in_rows(&Isometry3::identity()));
    assert_eq!(AS_IT_IS.len(), 4);
    for wanted in &*AS_IT_IS {
        let place = pose * wanted.position_m;
        let near = |p: &&Percept| (p.position_m - place).norm() < 0.02;
        let same = percepts.iter().find(near).unwrap_or_else(|| panic!("{what}: nothing at {place}"));
        assert_eq!(same.label, wanted.label, "{what} at {place}");
        for ((name, p), (_, expected)) in same.probabilities.iter().zip(&wanted.probabilities) {
            assert!((p - expected).abs() <= off, "{what} at {place}: {name} {p} and not {expected}");
        }
    }
    assert_eq!(percepts.len(), AS_IT_IS.len(), "{what}");
}

#[test]
fn the_same_points_in_any_frame_and_order_are_the_same_things() {
    let mut draws = Draws(17);
    for _ in 0..12 {
        let mut anywhere = || Vector3::from_fn(|_, _| 6.0 * draws.next() - 3.0);
        let (shift, turn) = (anywhere(), UnitQuaternion::from_scaled_axis(anywhere()));
        let pose = Isometry3::from_parts(shift.into(), turn);
        check("in rows, turned", &pose, &in_rows(&pose), 0.01);
        check("loose", &pose, &loose(bare(), &pose), 0.1);
        let mut points = bare();
        for k in (1..points.len()).rev() {
            points.swap(k, (draws.next() * (k + 1) as f64) as usize);
        }
        check("loose, in another order", &pose, &loose(points, &pose), 0.1);
    }
}

#[test]
fn a_stray_return_changes_nothing() {
    let home = Isometry3::identity();
    for at in [[0.1, 0.2, 2.0], [2.0, 0.2, 1.0], [0.2, 0.2, -2.0], [-9.0, 4.0, 11.0]] {
        let points = bare().into_iter().chain([Point3::from(at)]).collect();
        check(&format!("a return at {at:?}"), &home, &loose(points, &home), 0.1);
    }
}
