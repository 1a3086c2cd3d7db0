//! Tests of `sim::composed`.

use descry_robots::sim::composed::*;
use nalgebra::{Point3, Vector3};

#[test]
fn a_household_has_ten_things_and_more_and_each_stands_on_its_base() {
    assert!(HOUSEHOLD.len() >= 10, "{:?}", household().collect::<Vec<_>>());
    for (name, thing) in HOUSEHOLD.iter() {
        let (low, high) = thing.bounds();
        assert!(low.z.abs() < 0.004, "{name} stands at {low}");
        let size = high - low;
        assert!(size.iter().all(|s| (0.05..0.45).contains(s)), "{name}: {size}");
        assert!(thing.parts.len() > 1, "{name} is one solid");
        // Straight from above a ray meets something, and no higher than its box.
        let parts = thing.painted([0; 3]);
        let middle = nalgebra::center(&low, &high);
        let eye = Point3::new(middle.x, middle.y, 1.0);
        let nearest = parts
            .iter()
            .filter_map(|(part, _)| part.hit(&eye, &-Vector3::z(), f64::INFINITY))
            .map(|hit| 1.0 - hit.t)
            .fold(0.0, f64::max);
        assert!(nearest > 0.01 && nearest <= high.z + 1e-6, "{name}: {nearest} of {}", high.z);
    }
    assert!(HOUSEHOLD.values().any(|t| t.parts.iter().all(|p| p.pattern.is_none())));
}

#[test]
fn a_pattern_is_the_same_at_the_same_place_and_differs_by_its_seed() {
    let paint =
        |seed| Paint { colour: [120; 3], pattern: Some(Pattern { size_m: 0.03, spread: 100.0, seed }) };
    let places: Vec<Point3<f64>> = (0..50).map(|k| Point3::new(0.02 * f64::from(k), 0.01, 0.05)).collect();
    let of = |seed| places.iter().map(|p| paint(seed).at(p)).collect::<Vec<_>>();
    assert_eq!(of(1), of(1));
    assert_ne!(of(1), of(2));
    let plain = Paint { colour: [1, 2, 3], pattern: None };
    assert_eq!(plain.at(&places[7]), [1, 2, 3]);
}
