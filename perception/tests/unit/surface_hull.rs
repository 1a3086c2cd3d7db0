//! Tests of `surface::hull`.

use descry_perception::surface::hull::*;

/// A corner between every two neighbours and nothing outside.
fn check(points: Vec<[f64; 2]>, corners: usize) {
    let hull = convex_hull(points.clone());
    assert_eq!(hull.len(), corners, "{hull:?}");
    for i in 0..hull.len() {
        let (a, b) = (hull[i], hull[(i + 1) % hull.len()]);
        let left = |p: &[f64; 2]| (b[0] - a[0]) * (p[1] - a[1]) - (b[1] - a[1]) * (p[0] - a[0]);
        assert!(points.iter().all(|p| left(p) >= -1e-9), "{a:?} to {b:?}");
    }
}

#[test]
fn cells_up_to_two_apart_hang_together() {
    // Each cell and whether it is of the first part, in a plan of rows: a letter for each part, dots for none.
    let check = |plan: &[&str]| {
        let all =
            plan.iter().zip(0..).flat_map(|(row, y)| row.chars().zip(0..).map(move |(c, x)| (c, [x, y])));
        let named: Vec<(char, [i32; 2])> = all.filter(|(c, _)| *c != '.').collect();
        let mut found = parts(named.iter().map(|(_, cell)| (*cell, 1)).collect());
        let mut names: Vec<char> = named.iter().map(|(c, _)| *c).collect();
        names.sort_unstable();
        names.dedup();
        let of =
            |name: &char| named.iter().filter(|(c, _)| c == name).map(|(_, cell)| *cell).collect::<Vec<_>>();
        let mut expected: Vec<Vec<[i32; 2]>> = names.iter().map(of).collect();
        expected.iter_mut().chain(&mut found).for_each(|part| part.sort_unstable());
        expected.sort_unstable();
        found.sort_unstable();
        assert_eq!(found, expected, "{plan:#?}");
    };
    check(&["aa.a..bb", "a......b", "..a...b."]);
    check(&["a..b", "....", "...b", "c..b", "c..."]);
    check(&["a.a.a.a", ".......", ".......", ".b.b.b."]);
    check(&[
        "aaaaaaa", "......a", "......a", "bbb...a", "..b...a", "bbb...a", "......a", "......a", "aaaaaaa",
    ]);
}

#[test]
fn hulls_of_many_points_of_one_place_and_of_a_line() {
    let circle = |i: i32| [(f64::from(i) * 0.1).cos(), (f64::from(i) * 0.1).sin()];
    let inside = (0..1000).map(|i| circle(i).map(|c| c * f64::from(i % 97) / 100.0));
    check((0..62).map(circle).chain(inside).collect(), 62);
    check((0..400).map(|i| [f64::from(i % 20), f64::from(i / 20)]).collect(), 4);
    check(vec![[0.3, 0.4]; 100], 1);
    check((0..100).map(|i| [f64::from(i), 2.0 * f64::from(i)]).collect(), 2);
}
