//! Tests of `toml_place`.

use descry_domains::toml_place::*;

#[test]
fn places_are_found() {
    let text =
        "a = 1\n[action.move] # move\ndoes = \"move ?x\"\n[[goal]]\nsay = \"x\"\n[[goal]]\nsay = \"y\"\n";
    let check = |path: &[&str], part: &str, expected: &str| {
        let span = TomlPlaces::of(text).within(path, part);
        assert_eq!(&text[span.start as usize..span.end as usize], expected, "{path:?}");
    };
    check(&["action", "move", "does"], "", "\"move ?x\"");
    check(&["action", "move", "does"], "?x", "?x");
    check(&["action", "move"], "", "move");
    check(&["action", "move", "limit_s"], "", "move");
    check(&["goal", "1", "say"], "", "\"y\"");
    check(&["nothing"], "", "a = 1");
}
