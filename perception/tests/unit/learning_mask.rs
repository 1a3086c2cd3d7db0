//! Tests of `learning::mask`.

use descry_perception::cloud::Grid;
use descry_perception::learning::mask::*;

/// `#` is set.
fn mask(rows: &[&str]) -> Mask {
    let grid = Grid { width: rows[0].len(), height: rows.len() };
    Mask { grid, set: rows.iter().flat_map(|r| r.chars()).map(|c| c == '#').collect() }
}

#[test]
fn squares_grow_shrink_fill_and_drop() {
    let dot = mask(&[".....", ".....", "..#..", ".....", "....."]);
    let square = mask(&[".....", ".###.", ".###.", ".###.", "....."]);
    let holed = mask(&[".....", ".###.", ".#.#.", ".###.", "....."]);
    let cases = [
        ("grow", dot.dilated(1), &square),
        ("shrink", square.eroded(1), &dot),
        ("fill", holed.closed(1), &square),
        ("drop", dot.opened(1), &Mask::none(dot.grid)),
        ("keep", square.opened(1), &square),
    ];
    for (name, found, expected) in cases {
        assert_eq!(&found, expected, "{name}");
    }
    assert!(!square.touches_border() && square.dilated(1).touches_border());
}
