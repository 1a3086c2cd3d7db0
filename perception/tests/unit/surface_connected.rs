//! Tests of `surface::connected`.

use descry_perception::surface::connected::*;

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
