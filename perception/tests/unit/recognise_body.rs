//! Tests of `recognise::body`.

use descry_perception::recognise::body::*;

const CUP: Frustum =
    Frustum { x: 0.2, y: -0.1, base_m: 0.0, top_m: 0.1, foot_m: 0.03, rim_m: 0.04, wall_m: Some(0.003) };

/// Checks at which share of a ray between two points the ray hits the body.
fn check(body: &impl Body, from: [f64; 3], to: [f64; 3], share: f64) {
    let ray = Ray { from, along: [0, 1, 2].map(|k| to[k] - from[k]) };
    let met = body.depth_m(&ray);
    assert!((met - share).abs() < 1e-9 || met == share, "from {from:?} to {to:?}: {met}, not {share}");
}

#[test]
fn rays_meet_a_cup_outside_inside_and_at_its_floor() {
    // Its side at half its height, from +x; past it; over its rim onto the far wall, and straight down onto its floor.
    check(&CUP, [1.235, -0.1, 0.05], [0.2, -0.1, 0.05], 1.0 / 1.035);
    check(&CUP, [1.0, 0.0, 0.05], [0.2, 0.0, 0.05], f64::INFINITY);
    check(&CUP, [0.2 + 0.0365, -0.1, 0.2], [0.2 - 0.0365, -0.1, 0.05 + 0.045], 1.0);
    check(&CUP, [0.2, -0.1, 1.0], [0.2, -0.1, 0.0], 0.997);
    let tin = Frustum { wall_m: None, ..CUP };
    check(&tin, [0.2, -0.1, 1.0], [0.2, -0.1, 0.0], 0.9);
    // From below onto its foot.
    check(&CUP, [0.2, -0.1, -1.0], [0.2, -0.1, 0.0], 1.0);
}

#[test]
fn rays_meet_a_turned_box() {
    let (sin, cos) = 0.5_f64.sin_cos();
    let cuboid = Cuboid { x: 0.3, y: 0.1, turn: (sin, cos), low: [-0.1, -0.05, 0.0], high: [0.1, 0.05, 0.2] };
    let place = |u: f64, v: f64, z: f64| [0.3 + cos * u - sin * v, 0.1 + sin * u + cos * v, z];
    check(&cuboid, place(1.1, 0.02, 0.1), place(0.0, 0.02, 0.1), 1.0 / 1.1);
    check(&cuboid, place(0.03, 0.02, 1.0), place(0.03, 0.02, 0.0), 0.8);
    check(&cuboid, place(1.1, 0.06, 0.1), place(0.0, 0.06, 0.1), f64::INFINITY);
}
