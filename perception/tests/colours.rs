//! Colours of bodies: what pixels say of a known object and of a name, and what stays in doubt.

use crate::recognising::{cup_a, options};
use crate::tabletop::{Draws, Thing, look, on_ring};
use descry_perception::recognise::{Colour, Descry, probability_of};
use descry_perception::segment::segment;
use descry_perception::{Percept, Recogniser, View, Visibility};

/// Height of the table's top in the views, with a margin, metres.
const ABOVE_M: f64 = 0.73;

/// The percept of a red cup A, seen from some sides, whose pixels have a colour by their number; without colours for none.
fn seen(views: usize, paint: Option<&dyn Fn(usize) -> [u8; 3]>) -> Percept {
    let cup = Thing::Cup { x: 0.05, y: 0.02, radius: 0.035, height: 0.104, handle_rad: None };
    let view = |n: usize| {
        let pose = on_ring(0.3 + 1.3 * n as f64, 1.2, 1.4);
        let mut view: View = look(&[cup], &pose, &pose, &mut Draws(11));
        let of = |(n, p): (usize, &descry_perception::nalgebra::Point3<f32>)| {
            let is_cup = (pose * p.cast::<f64>()).z > ABOVE_M;
            if is_cup { paint.map_or([0; 3], |paint| paint(n)) } else { [130, 110, 90] }
        };
        view.cloud.colours = paint.map(|_| view.cloud.points.iter().enumerate().map(of).collect());
        view
    };
    let views: Vec<View> = (0..views).map(view).collect();
    let seen = Visibility::from_views(&views);
    let cloud = views[0].cloud.transformed(&views[0].world_from_camera);
    let scene = segment(&cloud, &seen, &options()).expect("there is a table");
    let model = descry_perception::ObjectModel { colours: vec![Colour::Name("red")], ..cup_a() };
    let percepts = Descry::default().recognise(&scene, &seen, &[model]);
    assert_eq!(percepts.len(), 1, "{percepts:?}");
    percepts[0].clone()
}

#[test]
fn a_colour_tells_a_known_object_from_one_of_its_kind() {
    // (what, pixels, probability of the red cup A at least and at most, of any red cup at least and at most)
    let one = |rgb: [u8; 3]| move |_: usize| rgb;
    let check = |what: &str,
                 paint: Option<&dyn Fn(usize) -> [u8; 3]>,
                 own: std::ops::RangeInclusive<f64>,
                 red: std::ops::RangeInclusive<f64>| {
        let found = seen(2, paint);
        let [it, kind] = [found.probability_of("cup A"), found.probability_of("cup")];
        let any = found.probability_of("red cup");
        assert!(own.contains(&it) && red.contains(&any), "{what}: {it:.3} {any:.3} {found:?}");
        assert!(kind > 0.85, "{what} is a cup all the same: {kind:.3}");
    };
    check("a red cup", Some(&one([180, 35, 40])), 0.85..=1.0, 0.7..=1.0);
    check("the same in dim light", Some(&one([90, 16, 20])), 0.8..=1.0, 0.7..=1.0);
    check("the same in warm light", Some(&one([200, 40, 30])), 0.8..=1.0, 0.65..=1.0);
    let glossy = |n: usize| if n.is_multiple_of(10) { [250; 3] } else { [180, 35, 40] };
    check("a tenth of highlights", Some(&glossy), 0.8..=1.0, 0.6..=1.0);
    check("a green cup", Some(&one([30, 150, 50])), 0.0..=0.05, 0.0..=0.02);
    check("a blue cup", Some(&one([40, 70, 170])), 0.0..=0.1, 0.0..=0.02);
    check("an orange cup", Some(&one([240, 140, 30])), 0.0..=0.1, 0.0..=0.02);
    let half = |n: usize| if n.is_multiple_of(2) { [235; 3] } else { [180, 35, 40] };
    check("half red, half white", Some(&half), 0.0..=0.9, 0.0..=0.5);
    check("no colours", None, 0.4..=0.75, 0.4..=0.5);
}

#[test]
fn names_may_begin_with_a_colour() {
    let list = |all: &[(&str, f64)]| all.iter().map(|(name, p)| ((*name).into(), *p)).collect::<Vec<_>>();
    let (objects, kinds) = (list(&[("red box", 0.2), ("cup A", 0.6)]), list(&[("cup", 0.7)]));
    let check = |name: &str, colours: &[(&str, f64)], expected: f64| {
        let found = probability_of(name, [&objects, &kinds], &list(colours));
        assert!((found - expected).abs() < 1e-9, "{name}: {found}");
    };
    check("red cup", &[("red", 0.5), ("green", 0.5)], 0.35);
    check("red cup A", &[("red", 0.5)], 0.3);
    check("red cup", &[], 0.35);
    check("red box", &[("red", 0.0)], 0.2);
    check("red mug", &[("red", 1.0)], 0.0);
    check("cup", &[("red", 1.0)], 0.7);
}
