//! Tests of `answer`.

use descry_domains::answer::*;
use descry_memory::belief::Belief;
use descry_memory::remember::Remembered;

#[test]
fn changes_are_told_of_what_was_looked_at() {
    let check = |looked_at: &[&str], surface: &str, expected: &str| {
        let looked_at: Vec<String> = looked_at.iter().map(|s| s.to_string()).collect();
        let past = Remembered::default().after(&Belief::default(), &looked_at, 0.0);
        assert_eq!(changes(&past, &[], surface, "lower board"), expected, "{looked_at:?}");
    };
    let never = "nothing is remembered of the lower board: no earlier run looked at it";
    check(&[], "lower-board", never);
    check(&["desk"], "lower-board", never);
    check(&["desk", "lower-board"], "lower-board", "nothing has changed");
}
