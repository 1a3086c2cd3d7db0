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

#[test]
fn nothing_steers_the_terminal_but_colours() {
    let check = |text: &str, shown: &str| assert_eq!(harmless(text), shown);
    check("cup \u{1b}[2J\u{7}A\r\n", "cup \\u{1b}[2J\\u{7}A\\r\n");
    check("\u{1b}[1;31mred\u{1b}[0m\t\u{9b}31m", "\u{1b}[1;31mred\u{1b}[0m\t\\u{9b}31m");
    check("größer als 3 °, \u{1b}", "größer als 3 °, \\u{1b}");
}
