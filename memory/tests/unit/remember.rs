//! Tests of `remember`.

use super::belief::percept;
use descry_memory::belief::Belief;
use descry_memory::belief::Sighted;
use descry_memory::remember::*;
use descry_perception::recognise::Percept;

fn believed(places: &[(&str, f64, f64)]) -> Belief {
    let mut belief = Belief::default();
    for surface in ["desk", "shelf"] {
        let percepts: Vec<Percept> =
            places.iter().filter(|(on, ..)| *on == surface).map(|&(_, x, p)| percept(x, p)).collect();
        let sighted: Vec<Sighted<'_>> =
            percepts.iter().map(|percept| Sighted { percept, viewpoints_m: &[], footprint_m: &[] }).collect();
        belief.update(surface, &sighted, 1, &[]);
    }
    belief
}

#[test]
fn what_was_not_looked_at_again_is_remembered_as_it_was() {
    let desk = ["desk".to_string()];
    let all = ["desk".to_string(), "shelf".to_string()];
    let first =
        Remembered::default().after(&believed(&[("desk", 0.0, 0.9), ("shelf", 1.0, 0.9)]), &all, 100.0);
    let later = first.after(&believed(&[]), &desk, 200.0);
    let there: Vec<(&str, f64)> =
        later.present.iter().map(|r| (r.track.on.as_str(), r.seen_unix_s)).collect();
    assert_eq!(there, [("shelf", 100.0)]);
    let (last, still) = later.last_seen("cup A").unwrap();
    assert_eq!((last.track.on.as_str(), still), ("shelf", true));
    let empty = later.after(&believed(&[]), &all, 300.0);
    let (last, still) = empty.last_seen("cup A").unwrap();
    assert_eq!((last.seen_unix_s, still), (100.0, false));
    assert_eq!(empty.last_seen("mug"), None);
}

#[test]
fn a_surface_of_which_nothing_is_known_was_not_looked_at() {
    let check = |kept: &Remembered, expected: [bool; 3]| {
        assert_eq!(["desk", "shelf", "table"].map(|on| kept.has_looked_at(on)), expected, "{kept:?}");
    };
    let own = |names: &[&str]| names.iter().map(|s| s.to_string()).collect::<Vec<_>>();
    let seen = believed(&[("desk", 0.0, 0.9)]);
    let first = Remembered::default().after(&seen, &own(&["desk", "shelf"]), 0.0);
    check(&Remembered::default(), [false; 3]);
    check(&first, [true, true, false]);
    // An older store does not say it: what stood or stands there does.
    let mut older = serde_json::to_value(&first).unwrap();
    older.as_object_mut().unwrap().remove("looked_at");
    let older: Remembered = serde_json::from_value(older).unwrap();
    check(&older, [true, false, false]);
    check(&older.after(&believed(&[]), &own(&["desk", "table"]), 1.0), [true, false, true]);
}

#[test]
fn time_wears_what_is_remembered_and_it_is_never_sure() {
    let desk = ["desk".to_string()];
    let kept = Remembered::default().after(&believed(&[("desk", 0.0, 0.96)]), &desk, 0.0);
    for (age_s, expected) in [(0.0, 0.7), (HALF_LIFE_S, 0.48), (4.0 * HALF_LIFE_S, 0.06)] {
        let p = kept.aged(age_s, 0.7)[0].probability_of("cup A");
        assert!((p - expected).abs() < 1e-9, "{age_s}: {p}");
    }
}
