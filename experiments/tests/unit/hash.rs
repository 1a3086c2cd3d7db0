//! Tests of `hash`.

use descry_experiments::hash::fnv1a;

#[test]
fn published_values() {
    let one = |text: &'static str| fnv1a(std::iter::once(text.as_bytes()));
    assert_eq!(one(""), "fnv1a:cbf29ce484222325");
    assert_eq!(one("a"), "fnv1a:af63dc4c8601ec8c");
    assert_eq!(one("foobar"), "fnv1a:85944171f73967e8");
    let two = |a: &'static str, b: &'static str| fnv1a([a.as_bytes(), b.as_bytes()].into_iter());
    assert_ne!(two("a", "bc"), two("ab", "c"));
}
