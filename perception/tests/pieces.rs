//! Number of pieces into which objects on a table are segmented in one view.

use crate::tabletop::{Draws, Thing, look, on_ring};
use descry_perception::Visibility;
use descry_perception::nalgebra::{Unit, Vector3};
use descry_perception::segment::{SceneOptions, segment};
use descry_perception::surface::SurfaceOptions;

/// Number of pieces seen from +x at a distance and height.
fn pieces(things: &[Thing], (away_m, high_m): (f64, f64), seed: u64) -> usize {
    let pose = on_ring(0.0, away_m, high_m);
    let view = look(things, &pose, &pose, &mut Draws(seed));
    let (cloud, seen) = (view.cloud.transformed(&pose), Visibility::from_views(&[view]));
    let surface = SurfaceOptions { up: Some(Unit::new_normalize(Vector3::z())), ..SurfaceOptions::default() };
    let scene = segment(&cloud, &seen, &SceneOptions { surface, ..SceneOptions::default() });
    scene.expect("there is a table").segments.len()
}

/// Counts the pieces in four random views from each of two places; at least `least` must be right.
fn check(what: &str, things: &[Thing], expected: usize, least: usize) {
    let views = [(1.1, 1.3), (1.5, 1.15)];
    let counts = views.map(|from| [1, 2, 3, 4].map(|seed| pieces(things, from, seed)));
    let right = counts.iter().flatten().filter(|count| **count == expected).count();
    assert!(right >= least, "{what}: {expected} expected, {counts:?}");
}

const BOTTLE: Thing = Thing::Tin { x: 0.2, y: 0.0, radius: 0.035, height: 0.25 };

fn block(x: f64, y: f64, half: [f64; 2], height: f64) -> Thing {
    Thing::Block { x, y, half, height, turn_rad: 0.0 }
}

#[test]
fn what_something_before_it_parts_is_one() {
    check("a box behind a bottle", &[BOTTLE, block(0.0, 0.0, [0.04, 0.13], 0.12)], 2, 8);
    let pair = |gap_m: f64, back_m: f64, height_m: f64| {
        let y = (0.07 + gap_m) / 2.0;
        [BOTTLE, block(0.0, -y, [0.04, 0.035], 0.12), block(-back_m, y, [0.04, 0.035], height_m)]
    };
    check("two boxes behind it, one further back", &pair(0.05, 0.025, 0.12), 3, 8);
    check("two boxes behind it, one higher", &pair(0.05, 0.0, 0.15), 3, 8);
    check("two like boxes, and what is between them is seen", &pair(0.18, 0.0, 0.12), 3, 8);
}

#[test]
fn what_is_open_at_the_top_is_one() {
    let turned = |knots, scale, handle_rad| Thing::Turned {
        x: 0.0,
        y: 0.0,
        knots,
        scale,
        open: true,
        handle_rad,
        spout: false,
    };
    let bowl = &[[0.0, 0.035], [0.015, 0.06], [0.04, 0.078], [0.065, 0.085]];
    for scale in [0.9, 1.0, 1.2] {
        check(&format!("a bowl, {scale}"), &[turned(bowl, scale, None)], 1, 8);
    }
    let pot = &[[0.0, 0.085], [0.02, 0.09], [0.1, 0.09]];
    check("a pot", &[turned(pot, 1.0, None)], 1, 8);
    check("a pot with a handle", &[turned(pot, 1.0, Some(1.2))], 1, 6);
    let beside = Thing::Cup { x: 0.0, y: 0.14, radius: 0.04, height: 0.065, handle_rad: None };
    check("a cup beside a bowl of its height", &[turned(bowl, 1.0, None), beside], 2, 8);
}
