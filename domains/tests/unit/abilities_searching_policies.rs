//! Tests of `abilities::searching::policies`.

use descry_domains::abilities::searching::policies::*;

#[test]
fn names_and_errors() {
    for name in names() {
        let made = named(name, 1, Some(Box::new(|_, _| 0.0)));
        assert!(made.is_ok(), "{name}");
    }
    let error = |name: &str| named(name, 1, None).err().map(|e| e.to_string()).unwrap_or_default();
    assert_eq!(
        error("best"),
        "no policy is called \"best\"\n  expected one of: plan, sweep, nearest, nearest-surface, random, most-unknown, rear-side, gain-per-second, oracle"
    );
    assert!(error("oracle").contains("experiments"), "{}", error("oracle"));
}

#[test]
fn ties_go_to_the_nearest_then_the_first() {
    let look = |from, travel_s, gain| Look { from, on: 0, travel_s, gain };
    let looks = [look(0, 5.0, 0.4), look(1, 3.0, 0.4), look(2, 3.0, 0.4), look(3, 1.0, 0.2)];
    assert_eq!(best(&looks, |l| l.gain).map(|l| l.from), Some(1));
    assert_eq!(best(&looks, |_| 0.0).map(|l| l.from), Some(3));
    assert_eq!(best(&[], |_| 0.0), None);
}
