//! Tests of `lsp::texts`.

use descry_cli::lsp::texts::*;
use lsp_types::Position;
use std::path::Path;

#[test]
fn positions_count_units_of_utf_16() {
    let text = "ab\n𝄞ü c\r\n\nlast";
    let check = |line: u32, character: u32, at: usize| {
        assert_eq!(offset(text, Position::new(line, character)), at, "{line}:{character}");
    };
    check(0, 0, 0);
    check(0, 9, 2);
    check(1, 0, 3);
    check(1, 2, 7);
    check(1, 3, 9);
    check(3, 4, text.len());
    check(9, 0, text.len());
    for at in text.char_indices().map(|(at, _)| at) {
        assert_eq!(offset(text, Lines::of(text).position(at)), at);
    }
}

#[test]
fn addresses_and_paths_are_the_same() {
    for path in ["/a/b.pddl", "/with blank/ü%20.pddl"] {
        let uri = uri_of(Path::new(path)).expect("an address");
        assert_eq!(path_of(&uri), Path::new(path), "{}", uri.as_str());
    }
}
