//! Tests of `cluster`.

use descry_experiments::cluster::*;
use std::path::Path;

#[test]
fn names_and_words_are_what_schedulers_and_shells_take() {
    let cases =
        [("Two tables", "descry-two-tables"), ("a_b!", "descry-a-b"), ("", "descry"), ("ü", "descry")];
    for (said, expected) in cases {
        assert_eq!(name(said), expected);
    }
    assert_eq!(name(&"x".repeat(99)).len(), 63);
    assert_eq!(quoted(Path::new("it's $HOME")), r"'it'\''s $HOME'");
    assert_eq!(text("a: \"b\"\n"), r#""a: \"b\"\n""#);
}
