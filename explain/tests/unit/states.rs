//! Tests of `states`.

use descry_domains::saying::Saying;
use descry_explain::states::*;

const BEFORE: &str = "(define (problem a) (:init (at start) (hand-free) (= (sure) 0.8)\n    (= (presence cup-a desk) 0.850000)) (:goal (at end)))";

#[test]
fn what_changed_is_told() {
    let check = |after: &str, told: &str| {
        let [before, after] = [BEFORE, after].map(State::read);
        assert_eq!(Difference::between(&before, &after).told(&Saying::default()), told);
    };
    check(BEFORE, "");
    check(
        "(:init (at start) (shut door) (= (sure) 0.8) (= (presence cup-a desk) 0.400000))",
        "(shut door); no longer: (hand-free); (presence cup-a desk) is 0.40 instead of 0.85",
    );
    check("(:init (at start) (hand-free) (= (sure) 0.8) (= (presence cup-a desk) 0.851))", "");
    // That time passes is no change.
    check("(:init (at start) (hand-free) (at 5.5 (not (time-left))) (= (presence cup-a desk) 0.85))", "");
    check(
        "(:init (a) (b) (c) (d) (e) (f) (g) (h) (i) (j) (at start) (hand-free) (= (sure) 0.8))",
        "(a), (b), (c), (d), (e), (f), (g), (h) and 2 more",
    );
    assert!(State::read("nothing").facts.is_empty());
    let timed = State::read("(:init (at start) (at 60.5 (not (a))) (at 9.25 (b)))");
    assert_eq!((timed.comes_s, timed.facts.len()), (Some(9.25), 1));
}
