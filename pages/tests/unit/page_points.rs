//! Tests of `page::points`.

use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use descry_pages::page::points::*;
use descry_perception::Cloud;
use descry_perception::nalgebra::{Isometry3, Point3};

#[test]
fn mixing_keeps_every_point() {
    for count in [0, 1, 2, 7918, 7919, 7920, 2 * 7919] {
        let mut mixed = mixed((0..count).collect());
        mixed.sort_unstable();
        assert_eq!(mixed, (0..count).collect::<Vec<usize>>());
    }
}

/// Checks how many points of a wall are kept, of at most `most`.
fn check(side: u16, near: bool, most: usize, expected: std::ops::RangeInclusive<usize>) {
    let points = (0..side).flat_map(|i| (0..side).map(move |j| (i, j)));
    let points = points.map(|(i, j)| Point3::new(f32::from(i) * 0.01, f32::from(j) * 0.01, 1.0)).collect();
    let cloud = Cloud { points, ..Cloud::default() };
    let everywhere = Near { min_m: Point3::new(-9.0, -9.0, -9.0), max_m: Point3::new(9.0, 9.0, 9.0) };
    let near = if near { vec![everywhere] } else { Vec::new() };
    let packed = pack(&cloud, &Isometry3::identity(), &near, most);
    let colours = STANDARD.decode(&packed.colours).unwrap();
    let places = STANDARD.decode(&packed.places).unwrap();
    assert_eq!(places.len(), 2 * colours.len());
    assert!(expected.contains(&(colours.len() / 3)), "{} points of {side}²", colours.len() / 3);
}

#[test]
fn points_are_thinned_to_what_can_be_sent() {
    check(50, true, 10_000, 2_400..=2_500);
    check(50, true, 1_000, 500..=1_000);
    check(50, false, 10_000, 150..=250);
    check(0, false, 10, 0..=0);
}
