//! Tests of `abilities::shapes::unseen`.

use descry_domains::abilities::shapes::unseen::*;
use descry_perception::laser::Scan;
use descry_perception::nalgebra::Isometry2;
use descry_perception::nalgebra::{Point2, Vector2};
use descry_robots::OccupancyGrid;

#[test]
fn what_a_sweep_passes_over_is_known() {
    let map = OccupancyGrid::covering(Point2::new(-2.0, -2.0), Point2::new(2.0, 2.0), 0.05);
    let mut unseen = UnseenFloor::of(&map);
    let count = |u: &UnseenFloor| u.room_for(0.15).len();
    let all = count(&unseen);
    let angles_rad: Vec<f64> = (-90..=90).map(|d| f64::from(d).to_radians()).collect();
    // A wall a metre ahead over the left half, nothing within reach on the right, no reading straight ahead.
    let range = |a: &f64| {
        if a.abs() < 1e-9 {
            f64::NAN
        } else if *a > 0.0 {
            1.0
        } else {
            f64::INFINITY
        }
    };
    let scan = Scan {
        ranges_m: angles_rad.iter().map(range).collect(),
        angles_rad,
        map_from_laser: Isometry2::identity(),
    };
    unseen.pass(&scan, 8.0);
    let left = unseen.room_for(0.15);
    assert!(left.len() < all && left.iter().any(|p| p.x < -0.5));
    assert!(left.iter().all(|p| p.x < 0.2 || p.y > 0.0 && p.coords.norm() > 0.9), "{left:?}");
    let behind =
        |u: &UnseenFloor| u.would_pass(&Point2::new(0.0, 0.0), &-Vector2::x(), 8.0, &u.room_for(0.15), &[]);
    assert!(behind(&unseen));
    unseen.know(&Point2::new(0.0, 0.0), 4.0);
    assert_eq!(count(&unseen), 0);
    assert!(!behind(&unseen));
}
