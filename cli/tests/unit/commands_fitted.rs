//! Tests of `commands::fitted`.

use descry_cli::commands::fitted::*;

#[test]
fn long_lines_are_folded_under_their_second_column() {
    let check = |line: &str, width: usize, folded: &str| {
        let found = fitted(line, Some(width));
        assert_eq!(found, folded);
        assert_eq!(fitted(line, None), line);
    };
    check("short", 10, "short");
    check("do        drive there and look", 20, "do        drive\n          there and\n          look");
    check("  2 views, 1 replan, 3 m", 15, "  2 views, 1\n    replan, 3 m");
    check("  [a]     one two\nb", 14, "  [a]     one\n    two\nb");
    check("averyveryverylongword and more", 10, "averyveryverylongword\n  and more");
    check("", 10, "");
    check("a    bb ccc dddd", 14, "a    bb ccc\n     dddd");
    check("1 │ find me in the text", 10, "1 │ find me in the text");
}
