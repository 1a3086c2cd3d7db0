//! Tests of `declared`.

use descry_domains::declared::*;
use descry_domains::vocabulary::Vocabulary;
use descry_planner::Source;

#[test]
fn what_has_one_symbol_is_one_object() {
    let pddl = "(define (domain d) (:requirements :typing)
        (:types pose thing kind - object cup - thing) (:constants sofa - thing) (:predicates (at ?p - pose)))";
    let vocabulary = Vocabulary::read(&Source::new("d.pddl", pddl)).unwrap();
    let check = |objects: &[(&str, &str)], expected: &[&str]| {
        assert_eq!(lines(objects.iter().copied(), &vocabulary).0, expected, "{objects:?}");
    };
    check(&[], &[]);
    check(&[("a", "pose"), ("b", "pose"), ("c", "thing")], &["a b - pose", "c - thing"]);
    check(&[("mug", "thing"), ("b", "pose"), ("mug", "kind")], &["mug - (either thing kind)", "b - pose"]);
    check(&[("a", "pose"), ("a", "pose")], &["a - pose"]);
    check(&[("a", "cup"), ("a", "thing")], &["a - cup"]);
    check(&[("a", "thing"), ("a", "pose"), ("a", "cup")], &["a - (either pose cup)"]);
    check(&[("a", "room"), ("sofa", "pose")], &[]);
}
