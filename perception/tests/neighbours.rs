//! The tree against looking at every point.

use descry_perception::nalgebra::Point3;
use descry_perception::{Neighbours, normals, outliers};
use proptest::prelude::*;

fn squared(a: &Point3<f32>, b: &Point3<f32>) -> f32 {
    let (x, y, z) = (a.x - b.x, a.y - b.y, a.z - b.z);
    x * x + y * y + z * z
}

fn all_distances(points: &[Point3<f32>], q: &Point3<f32>) -> Vec<f32> {
    let finite = points.iter().filter(|p| p.iter().all(|c| c.is_finite()));
    let mut distances: Vec<f32> = finite.map(|p| squared(p, q)).collect();
    distances.sort_by(f32::total_cmp);
    distances
}

fn check(points: &[Point3<f32>], k: usize, radius_m: f32) {
    let tree = Neighbours::new(points).unwrap();
    for q in points.iter().filter(|p| p.iter().all(|c| c.is_finite())).take(50) {
        let expected = all_distances(points, q);
        let found = tree.k_nearest(q, k);
        let distances: Vec<f32> = found.iter().map(|n| n.distance_sq).collect();
        assert_eq!(distances, expected[..k.min(expected.len())]);
        for n in &found {
            assert_eq!(squared(&points[n.index as usize], q), n.distance_sq);
        }
        let mut within = Vec::new();
        tree.within(q, radius_m, |n| within.push(n.distance_sq));
        within.sort_by(f32::total_cmp);
        let limit = radius_m * radius_m;
        assert_eq!(within, expected.iter().copied().filter(|d| *d <= limit).collect::<Vec<_>>());
        assert_eq!(tree.nearest(q, radius_m).map(|n| n.distance_sq), Some(0.0));
    }
    check_bulk(points, &tree, k);
}

/// Checks the bulk search through outlier removal by mean neighbour distances.
fn check_bulk(points: &[Point3<f32>], tree: &Neighbours, k: usize) {
    let mut means = Vec::new();
    for q in points.iter().filter(|p| p.iter().all(|c| c.is_finite())) {
        let distances = all_distances(points, q);
        let near = &distances[..k.min(distances.len())];
        means.push(near.iter().map(|d| f64::from(d.sqrt())).sum::<f64>() / near.len() as f64);
    }
    let mean = means.iter().sum::<f64>() / means.len().max(1) as f64;
    let kept = outliers::statistical(tree, k, 1.0);
    assert!((kept.mean_m - mean).abs() <= 1e-5 * mean.max(1e-6), "{} {mean}", kept.mean_m);
}

proptest! {
    #[test]
    fn as_by_looking_at_every_point(
        raw in proptest::collection::vec(proptest::array::uniform3(0u8..40), 1..400),
        noise in 0.0f32..0.1, k in 1usize..50, radius_m in 0.01f32..0.5,
    ) {
        // Coarse coordinates make many ties and coinciding points.
        let points: Vec<Point3<f32>> = raw.iter().enumerate().map(|(i, c)| {
            let shift = noise * (i % 7) as f32;
            Point3::new(f32::from(c[0]) * 0.05 + shift, f32::from(c[1]) * 0.05, f32::from(c[2]) * 0.01)
        }).collect();
        check(&points, k, radius_m);
    }
}

#[test]
fn a_plane_of_points_and_holes() {
    let mut points: Vec<Point3<f32>> = (0..3000)
        .map(|i| Point3::new((i % 60) as f32 * 0.013, (i / 60) as f32 * 0.007, (i % 11) as f32 * 0.001))
        .collect();
    for i in (0..3000).step_by(17) {
        points[i] = Point3::new(f32::NAN, 0.0, 0.0);
    }
    check(&points, 20, 0.03);
}

#[test]
fn few_none_and_equal_points() {
    let origin = Point3::origin();
    let empty = Neighbours::new(&[]).unwrap();
    assert!(empty.nearest(&origin, 1.0).is_none() && empty.k_nearest(&origin, 3).is_empty());
    assert!(normals::estimate(&empty, 20, &origin).normals.is_empty());
    let one = Neighbours::new(&[origin]).unwrap();
    assert_eq!(one.k_nearest(&origin, 3).len(), 1);
    assert!(normals::estimate(&one, 20, &origin).normals[0].x.is_nan());
    check(&vec![Point3::new(1.0, 2.0, 3.0); 1000], 20, 0.1);
    let nan = Point3::new(f32::NAN, 0.0, 0.0);
    assert!(one.nearest(&nan, 1.0).is_none() && one.k_nearest(&nan, 1).is_empty());
}

#[test]
fn a_hundred_thousand_points_in_one_place_take_no_square_of_time() {
    let points = vec![Point3::new(1.0f32, 2.0, 3.0); 100_000];
    let tree = Neighbours::new(&points).unwrap();
    let found = normals::estimate(&tree, 20, &Point3::origin());
    assert!(found.normals.iter().all(|n| n.x.is_nan()));
}

#[test]
fn normals_of_a_sphere_point_to_the_viewpoint() {
    let points: Vec<Point3<f32>> = (0..4000)
        .map(|i| {
            let (turn, z) = (i as f32 * 2.399_963, 1.0 - (i as f32 + 0.5) / 2000.0);
            let r = (1.0 - z * z).sqrt();
            Point3::new(r * turn.cos(), r * turn.sin(), z)
        })
        .collect();
    let found = normals::estimate(&Neighbours::new(&points).unwrap(), 20, &Point3::origin());
    for (p, n) in points.iter().zip(&found.normals) {
        assert!(n.dot(&p.coords) < -0.995, "{p} {n}");
    }
    assert!(found.variation.iter().all(|v| *v < 0.02));
}
