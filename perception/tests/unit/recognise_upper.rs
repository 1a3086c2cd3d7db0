//! Tests of `recognise::upper`.

use descry_perception::recognise::body::{Body, Frustum, Ray};
use descry_perception::recognise::rays::Pixel;
use descry_perception::recognise::rays::ViewRays;
use descry_perception::recognise::upper::*;

/// View of a body from a height and horizontal distance with a pixel per 0.01, in which every ray
/// hits the body; the given number of pixels shows another object.
fn view(body: &Frustum, high_m: f64, other: usize) -> ViewRays {
    let from = [0.8, 0.0, high_m];
    let falls = (0.1 - high_m) / 0.8;
    let steps = (-12..=12).flat_map(|i| (-12..=12).map(move |j| (f64::from(i), f64::from(j))));
    let pixels = steps.enumerate().filter_map(|(k, (i, j))| {
        let along = [-1.0, 0.01 * i, falls + 0.01 * j];
        let depth_m = body.depth_m(&Ray { from, along });
        depth_m.is_finite().then_some(Pixel {
            along,
            depth_m,
            sigma_m: 0.002,
            without: 1.0,
            other: k % 10 < other,
        })
    });
    let pixels = pixels.collect();
    ViewRays { from, wander: [[0.0; 3]; 3], pixels, looks: 0.04 }
}

#[test]
fn an_open_cup_a_tin_and_a_hidden_end_are_told_apart() {
    let cup =
        Frustum { x: 0.0, y: 0.0, base_m: 0.0, top_m: 0.1, foot_m: 0.035, rim_m: 0.04, wall_m: Some(0.003) };
    let tin = Frustum { wall_m: None, ..cup };
    let [open, closed] = [cup, tin].map(|body| Upper::of([&view(&body, 0.7, 0)], &body));
    assert!(open.open_log > 2.0 && open.open > 0.7 && open.lid < 0.2, "{open:?}");
    assert!(closed.open_log < -2.0 && closed.lid > 0.9 && closed.open == 0.0, "{closed:?}");
    let hidden = Upper::of([&view(&cup, 0.7, 10)], &cup);
    assert_eq!((hidden.open_log, hidden.open, hidden.lid), (0.0, 0.0, 0.0));
    // What looks in so flatly that it meets the far wall just below the rim has seen neither inside nor lid.
    let flat = Upper::of([&view(&cup, 0.22, 0)], &cup);
    assert!(flat.open_log >= 0.0 && (flat.open, flat.lid) == (0.0, 0.0), "{flat:?}");
}

#[test]
fn a_lid_that_noise_makes_higher_is_a_lid() {
    let tin = Frustum { x: 0.0, y: 0.0, base_m: 0.0, top_m: 0.1, foot_m: 0.035, rim_m: 0.035, wall_m: None };
    let mut seen = view(&tin, 0.7, 0);
    seen.pixels.iter_mut().for_each(|pixel| pixel.sigma_m = 0.006);
    let higher = |by_m: f64| Upper::of([&seen], &Frustum { top_m: tin.top_m + by_m, ..tin }).open_log;
    assert!(higher(0.0) < -1.0 && higher(0.009) < -0.5, "{} {}", higher(0.0), higher(0.009));
    // What is two centimetres below the rim is no lid.
    assert!(higher(0.03) > 2.0, "{}", higher(0.03));
}
