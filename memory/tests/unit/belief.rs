//! Tests of `belief`.

use descry_memory::belief::*;
use descry_memory::document::RecordId;
use descry_perception::nalgebra::Point3;
use descry_perception::recognise::{Evidence, Percept};

/// A percept at `x` metres that is cup A with probability `cup`.
pub fn percept(x: f64, cup: f64) -> Percept {
    Percept {
        label: None,
        kind: None,
        probabilities: vec![("cup A".into(), cup)],
        kinds: vec![("cup".into(), cup)],
        unknown: 1.0 - cup,
        colours: Vec::new(),
        position_m: Point3::new(x, 0.0, 0.0),
        position_sigma_m: 0.002,
        size_m: [0.07, 0.07, 0.1],
        stance: Default::default(),
        points: 100,
        seen_fraction: 0.5,
        evidence: Evidence::default(),
        indices: vec![],
    }
}

/// Checks the numbers of the tracks after merges with percepts at the given places.
fn check(merges: &[&[f64]], expected: &[u64], gone: &[u64]) {
    let mut belief = Belief::default();
    for (places, stamp_ns) in merges.iter().zip(1..) {
        let percepts: Vec<Percept> = places.iter().map(|&x| percept(x, 0.5)).collect();
        let sighted: Vec<Sighted<'_>> =
            percepts.iter().map(|percept| Sighted { percept, viewpoints_m: &[], footprint_m: &[] }).collect();
        belief.update("table", &sighted, stamp_ns, &[]);
    }
    let ids = |tracks: &[Track]| tracks.iter().map(|t| t.id).collect::<Vec<_>>();
    assert_eq!((ids(&belief.tracks), ids(&belief.gone)), (expected.to_vec(), gone.to_vec()), "{merges:?}");
}

#[test]
fn objects_keep_their_numbers() {
    check(&[&[0.0, 1.0], &[1.01, 0.02]], &[0, 1], &[]);
    check(&[&[0.0], &[0.0, 0.5]], &[0, 1], &[]);
    check(&[&[0.0, 0.5], &[0.52]], &[1], &[0]);
    check(&[&[0.0], &[0.2]], &[1], &[0]);
    check(&[&[0.0, 0.08], &[0.06, 0.14]], &[0, 1], &[]);
    check(&[&[], &[0.0], &[]], &[], &[0]);
}

#[test]
fn what_was_touched_is_itself_when_it_is_seen_again() {
    let check = |again: f64, sure: f64, expected: &[u64]| {
        let mut belief = Belief::default();
        let see = |belief: &mut Belief, places: &[(f64, f64)], stamp_ns: i64| {
            let percepts: Vec<Percept> = places.iter().map(|&(x, cup)| percept(x, cup)).collect();
            let sighted: Vec<Sighted<'_>> = percepts
                .iter()
                .map(|percept| Sighted { percept, viewpoints_m: &[], footprint_m: &[] })
                .collect();
            belief.update("table", &sighted, stamp_ns, &[]);
        };
        see(&mut belief, &[(0.0, 0.9), (1.0, 0.9)], 1);
        belief.mislay(0);
        assert_eq!(belief.tracks.len(), 1, "where it is has to be seen");
        see(&mut belief, &[(again, sure), (1.0, 0.9)], 2);
        let ids: Vec<u64> = belief.tracks.iter().map(|t| t.id).collect();
        assert_eq!((ids.as_slice(), belief.gone.len()), (expected, 0), "{again} {sure}");
    };
    check(0.0, 0.9, &[0, 1]);
    check(0.2, 0.9, &[0, 1]);
    check(0.5, 0.9, &[1, 2]);
    check(0.1, 0.1, &[1, 2]);
}

#[test]
fn what_stands_elsewhere_is_not_asked_about() {
    let mut belief = Belief::default();
    for (on, places, stamp_ns) in
        [("table", &[0.0, 1.0][..], 1), ("shelf", &[0.0], 2), ("shelf", &[], 3), ("table", &[0.0], 4)]
    {
        let percepts: Vec<Percept> = places.iter().map(|&x| percept(x, 0.5)).collect();
        let sighted: Vec<Sighted<'_>> =
            percepts.iter().map(|percept| Sighted { percept, viewpoints_m: &[], footprint_m: &[] }).collect();
        belief.update(on, &sighted, stamp_ns, &[]);
    }
    let there: Vec<(u64, &str)> = belief.tracks.iter().map(|t| (t.id, t.on.as_str())).collect();
    assert_eq!(there, [(0, "table")]);
    assert_eq!(belief.gone.iter().map(|t| t.id).collect::<Vec<_>>(), [2, 1]);
}

#[test]
fn a_known_object_outlives_the_blur_that_swallows_it() {
    let mut belief = Belief::default();
    let cup = percept(0.0, 0.7);
    let mut blur = percept(0.03, 0.0);
    blur.size_m = [0.2, 0.15, 0.34];
    for (seen, stamp_ns) in [&cup, &blur, &cup].into_iter().zip(1..) {
        belief.update(
            "table",
            &[Sighted { percept: seen, viewpoints_m: &[], footprint_m: &[] }],
            stamp_ns,
            &[],
        );
        let best = belief.tracks.iter().map(|t| t.probability_of("cup A")).fold(0.0, f64::max);
        assert_eq!((best, belief.tracks[0].id), (0.7, 0), "after merge {stamp_ns}");
    }
    assert_eq!((belief.tracks.len(), belief.gone.len()), (1, 1), "the blur is gone again");
}

#[test]
fn the_last_merge_decides_what_it_is() {
    let mut belief = Belief::default();
    for (cup, stamp_ns) in [(0.4, 1), (0.9, 2)] {
        let p = percept(0.0, cup);
        belief.update(
            "table",
            &[Sighted { percept: &p, viewpoints_m: &[Point3::origin()], footprint_m: &[] }],
            stamp_ns,
            &[RecordId(7)],
        );
    }
    let track = &belief.tracks[0];
    assert_eq!((track.first_ns, track.last_ns, track.label()), (1, 2, Some("cup A")));
    assert!(
        (track.certainty() - 0.9).abs() < 1e-12
            && track.probability_of("cup") == track.probability_of("cup A")
    );
}
