//! Tests of `mapping::frontier`.

use descry_perception::mapping::frontier::*;
use descry_perception::occupancy::{Occupancy, Space};
use nalgebra::{Isometry2, Point2, Vector2};

/// `#` occupied, `.` open, blank unknown; the first row is the lowest.
fn grid(rows: &[&str]) -> Occupancy {
    let cells = rows.iter().flat_map(|row| {
        row.chars().map(|c| match c {
            '#' => Space::Occupied,
            '.' => Space::Free,
            _ => Space::Unknown,
        })
    });
    Occupancy { origin: Point2::origin(), cell_m: 0.5, width: rows[0].len(), cells: cells.collect() }
}

fn options() -> ExploreOptions {
    ExploreOptions { radius_m: 0.2, least_squares: 2, ..ExploreOptions::default() }
}

#[test]
fn the_open_end_is_the_frontier_and_the_next_pose_looks_there() {
    let open = grid(&[
        "############    ",
        "#..........     ",
        "#..........     ",
        "#..........     ",
        "############    ",
    ]);
    let found = frontiers(&open, &options());
    assert_eq!(found.len(), 1, "{found:?}");
    assert!((found[0].middle - Point2::new(5.25, 1.25)).norm() < 0.1);
    let next = next_poses(&open, &[Isometry2::new(Vector2::new(0.75, 1.25), 3.0)], &options());
    let first = &next[0];
    assert!(first.pose.rotation.angle().abs() < 0.6 && first.gain_m2 > 1.0, "{first:?}");
    assert!(next.iter().all(|n| n.cost_s > 0.0 && n.way_m.is_finite()));
}

#[test]
fn a_closed_room_has_none_and_what_cannot_be_reached_is_no_pose() {
    let closed = grid(&["######", "#....#", "#....#", "######"]);
    let from = Isometry2::new(Vector2::new(1.25, 0.75), 0.0);
    assert!(frontiers(&closed, &options()).is_empty() && next_poses(&closed, &[from], &options()).is_empty());
    let walled = grid(&["#######.... ", "#....##.... ", "#....##.... ", "#######.... "]);
    assert!(!frontiers(&walled, &options()).is_empty());
    let next = next_poses(&walled, &[from], &options());
    assert!(next.iter().all(|n| n.pose.translation.x < 3.0), "{next:?}");
    // Outside of the grid nothing is known: there is nowhere to go.
    let outside = Isometry2::new(Vector2::new(-5.0, 0.0), 0.0);
    assert!(next_poses(&closed, &[outside], &options()).iter().all(|n| n.way_m == 0.0));
    assert!(next_poses(&closed, &[], &options()).is_empty());
}

#[test]
fn what_looks_did_not_show_is_expected_less() {
    let open = grid(&["########    ", "#.......    ", "#.......    ", "########    "]);
    let from = Isometry2::new(Vector2::new(2.75, 1.0), 0.0);
    let best = |looks: usize| next_poses(&open, &vec![from; looks], &options())[0].gain_m2;
    assert!(best(2) < 0.6 * best(1), "{} {}", best(2), best(1));
}
