//! Known bodies on, in or under other objects, and bodies made of parts.

use crate::recognising::{cup_a, options};
use crate::tabletop::{Draws, Thing, disturbed, look, on_ring};
use descry_perception::merge::{MergeOptions, merge};
use descry_perception::nalgebra::{Unit, Vector3};
use descry_perception::recognise::{Descry, Handle, Range, Top};
use descry_perception::segment::segment;
use descry_perception::{ObjectModel, Percept, Recogniser};

fn range(low: f64, high: f64) -> Range {
    Range { low, high }
}

/// The known objects of the tabletop domain, and a bottle.
fn models() -> Vec<ObjectModel> {
    let named = |name: &str, kind: &str, height_m: Range, diameter_m: Range| ObjectModel {
        name: name.into(),
        kind: kind.into(),
        height_m,
        diameter_m: Some(diameter_m),
        taper: range(0.7, 1.05),
        ..cup_a()
    };
    vec![
        ObjectModel { taper: range(0.7, 1.05), ..cup_a() },
        named("cup B", "cup", range(0.155, 0.155), range(0.088, 0.088)),
        ObjectModel {
            handle: Handle::One,
            taper: range(0.8, 1.15),
            ..named("mug", "mug", range(0.08, 0.12), range(0.07, 0.10))
        },
        named("other cup", "cup", range(0.07, 0.14), range(0.06, 0.10)),
        ObjectModel {
            top: Top::Closed,
            taper: range(1.0, 1.0),
            ..named("white cylinder", "cylinder", range(0.277, 0.277), range(0.106, 0.106))
        },
        ObjectModel {
            top: Top::Closed,
            taper: range(2.0, 3.0),
            ..named("bottle", "bottle", range(0.24, 0.26), range(0.065, 0.075))
        },
    ]
}

const SAUCER: &[[f64; 2]] = &[[0.0, 0.05], [0.02, 0.075]];
const BOWL: &[[f64; 2]] = &[[0.0, 0.05], [0.052, 0.072]];
const OPEN_TIN: &[[f64; 2]] = &[[0.0, 0.0585], [0.0665, 0.0585]];
const BOTTLE: &[[f64; 2]] = &[[0.0, 0.035], [0.16, 0.035], [0.2, 0.014], [0.25, 0.014]];
const JAR: &[[f64; 2]] = &[[0.0, 0.0425], [0.125, 0.0425], [0.127, 0.025], [0.16, 0.025]];

fn turned(knots: &'static [[f64; 2]], open: bool) -> Thing {
    Thing::Turned { x: 0.05, y: 0.02, knots, scale: 1.0, open, handle_rad: None, spout: false }
}

fn tin(radius: f64, height: f64) -> Thing {
    Thing::Tin { x: 0.05, y: 0.02, radius, height }
}

fn cup_at(base: f64) -> Thing {
    Thing::Raised { x: 0.052, y: 0.016, radius: 0.035, height: 0.104, base }
}

fn larger_cup_at(base: f64) -> Thing {
    Thing::Raised { x: 0.052, y: 0.016, radius: 0.041, height: 0.12, base }
}

/// Percepts from several views of some objects.
fn percepts(things: &[Thing], views: usize, seed: u64) -> Vec<Percept> {
    let mut draws = Draws(seed);
    let views: Vec<_> = (0..views)
        .map(|n| {
            let angle = std::f64::consts::TAU * (n as f64 + 0.3 * draws.next()) / views as f64;
            let truth = on_ring(angle + seed as f64, 1.3, 1.4);
            let stated = disturbed(&truth, 0.01, 0.012, &mut draws);
            look(things, &truth, &stated, &mut draws)
        })
        .collect();
    let up = Some(Unit::new_normalize(Vector3::z()));
    let merged = merge(&views, &MergeOptions { up, ..MergeOptions::default() }).expect("views that merge");
    let scene = segment(&merged.cloud, &merged.visibility, &options()).expect("there is a table");
    Descry::default().recognise(&scene, &merged.visibility, &models())
}

/// Case: name, objects, and minimum and maximum probability that a known object is present.
type Case = (&'static str, Vec<Thing>, &'static str, [f64; 2]);

fn check(cases: Vec<Case>, seed: u64) {
    for (name, mut things, asked, [least, most]) in cases {
        things.push(Thing::Block { x: -0.3, y: 0.1, half: [0.05, 0.03], height: 0.2, turn_rad: 0.3 });
        let found = percepts(&things, 4, seed);
        let p = found.iter().map(|percept| percept.probability_of(asked)).fold(0.0, f64::max);
        let said: Vec<_> = found.iter().map(|p| (&p.label, p.size_m, &p.probabilities)).collect();
        assert!((least..=most).contains(&p), "{name}, seed {seed}: {asked} {p:.3}, {said:.3?}");
        for percept in &found {
            let sum = percept.probabilities.iter().map(|(_, p)| p).sum::<f64>() + percept.unknown;
            assert!((sum - 1.0).abs() < 1e-9, "{name}: probabilities sum to {sum}");
        }
    }
}

#[test]
fn a_cup_on_another_thing_is_found_in_merged_views() {
    check(
        vec![
            ("on a saucer", vec![turned(SAUCER, false), cup_at(0.02)], "cup A", [0.5, 1.0]),
            ("on a tin", vec![tin(0.045, 0.13), cup_at(0.13)], "cup A", [0.5, 1.0]),
        ],
        1,
    );
}

#[test]
fn a_cup_on_a_tin_that_is_hardly_wider_is_not_denied() {
    check(vec![("on a narrow tin", vec![tin(0.0405, 0.1235), cup_at(0.1235)], "cup A", [0.2, 1.0])], 3);
}

#[test]
fn a_cup_in_a_vessel_stands_on_its_bottom_and_not_on_its_rim() {
    check(
        vec![
            ("in a bowl", vec![turned(BOWL, true), cup_at(0.004)], "cup A", [0.5, 1.0]),
            ("in an open tin", vec![turned(OPEN_TIN, true), cup_at(0.004)], "cup A", [0.5, 1.0]),
            ("a larger cup", vec![turned(OPEN_TIN, true), larger_cup_at(0.004)], "cup A", [0.0, 0.05]),
        ],
        1,
    );
}

#[test]
fn no_other_body_is_taken_for_one_on_another() {
    let long = Thing::Block { x: 0.1, y: 0.05, half: [0.17, 0.08], height: 0.28, turn_rad: 0.4 };
    check(
        vec![
            ("a larger cup on a tin", vec![tin(0.045, 0.13), larger_cup_at(0.13)], "cup A", [0.0, 0.05]),
            ("a long box", vec![long], "white cylinder", [0.0, 0.05]),
        ],
        1,
    );
}

#[test]
fn a_bottle_of_body_shoulder_and_neck_is_one_body() {
    check(
        vec![
            ("a bottle", vec![turned(BOTTLE, false)], "bottle", [0.5, 1.0]),
            ("a jar with a lid", vec![turned(JAR, false)], "bottle", [0.0, 0.05]),
        ],
        1,
    );
}
