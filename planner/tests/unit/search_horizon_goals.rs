//! Tests of `search::horizon::goals`.

use descry_planner::search::horizon::goals::arranged;

#[test]
fn goals_that_would_be_cut_off_come_first() {
    for (ways, expected) in [
        (vec![vec![vec![]], vec![vec![]]], vec![0, 1]),
        // The first cannot be had once the second holds.
        (vec![vec![vec![1]], vec![vec![]]], vec![0, 1]),
        (vec![vec![vec![]], vec![vec![0]]], vec![1, 0]),
        // A row: from the far end, since the last has one way only, and each then cuts off another way of its neighbour.
        (vec![vec![vec![], vec![1]], vec![vec![0], vec![2]], vec![vec![1]]], vec![2, 1, 0]),
        // Each is in the other's way.
        (vec![vec![vec![1]], vec![vec![0]]], vec![0, 1]),
    ] {
        assert_eq!(arranged(&ways), expected, "{ways:?}");
    }
}
