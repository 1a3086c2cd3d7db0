//! Tests of `search::horizon::order`.

use descry_planner::search::horizon::order::components;

#[test]
fn circles_are_found_and_what_they_lead_to_comes_first() {
    for (edges, expected) in [
        (vec![vec![], vec![]], vec![0, 1]),
        (vec![vec![1], vec![]], vec![1, 0]),
        (vec![vec![1], vec![0]], vec![0, 0]),
        (vec![vec![1], vec![2], vec![1, 3], vec![]], vec![2, 1, 1, 0]),
        (vec![vec![1, 2], vec![3], vec![3], vec![0, 4], vec![4]], vec![1, 1, 1, 1, 0]),
    ] {
        assert_eq!(components(&edges), expected, "{edges:?}");
    }
}
