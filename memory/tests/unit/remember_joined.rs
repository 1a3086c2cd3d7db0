//! Tests of `remember::joined`.

use super::belief::percept;
use descry_memory::belief::{Belief, Sighted};
use descry_memory::learned::LearnedThing;
use descry_memory::learned::Place;
use descry_memory::remember::{Recollection, Remembered};
use descry_perception::Cloud;
use descry_perception::nalgebra::Point3;
use descry_perception::recognise::Percept;

fn named(name: &str, learned_unix_s: f64, seen_unix_s: f64) -> LearnedThing {
    LearnedThing {
        name: name.into(),
        learned_unix_s,
        cloud: Cloud::from_points(vec![Point3::new(0.0, 0.0, 0.1)]),
        sides: 0.5,
        directions: 1,
        meetings: 1,
        seen: Place { unix_s: seen_unix_s, at_m: Point3::origin(), on: "desk".into() },
    }
}

/// Memory after a run that began at `unix_s` with `before`, looked at these surfaces, and saw these objects.
fn looked(before: &Remembered, unix_s: f64, looked_at: &[&str], things: &[(&str, f64, &str)]) -> Remembered {
    let mut belief = Belief::default();
    for surface in looked_at {
        let there = things.iter().filter(|(on, ..)| on == surface);
        let percepts: Vec<Percept> = there.map(|(_, x, name)| called(*x, name)).collect();
        let sighted: Vec<Sighted<'_>> =
            percepts.iter().map(|percept| Sighted { percept, viewpoints_m: &[], footprint_m: &[] }).collect();
        belief.update(surface, &sighted, 1, &[]);
    }
    let looked_at: Vec<String> = looked_at.iter().map(|s| s.to_string()).collect();
    before.clone().after(&belief, &looked_at, unix_s)
}

/// A percept that is most likely this object.
fn called(x: f64, name: &str) -> Percept {
    let likely = vec![(name.into(), 0.9)];
    Percept { probabilities: likely.clone(), kinds: likely, ..percept(x, 0.9) }
}

fn places(all: &[Recollection]) -> Vec<(&str, f64, &str, f64)> {
    let of = |r: &'_ Recollection| (r.track.position_m.x, r.seen_unix_s);
    all.iter().map(|r| (r.track.on.as_str(), of(r).0, r.track.probabilities[0].0.as_str(), of(r).1)).collect()
}

#[test]
fn where_nobody_else_has_kept_anything_it_is_what_the_run_leaves() {
    let mut before = looked(
        &Remembered::default(),
        1.0,
        &["desk", "shelf"],
        &[("desk", 0.0, "cup"), ("shelf", 1.0, "mug")],
    );
    before.things = vec![named("thing 1", 1.0, 1.0)];
    let mut after = looked(&before, 5.0, &["desk"], &[("desk", 2.0, "cup")]);
    after.things = vec![named("thing 1", 1.0, 5.0), named("thing 2", 5.0, 5.0)];
    assert_eq!(before.joined(&before, after.clone(), 5.0), after);
    // A run that was cut off while it kept this does so again.
    assert_eq!(after.joined(&before, after.clone(), 5.0), after);
}

#[test]
fn a_surface_is_remembered_as_it_was_looked_at_last() {
    let before = looked(
        &Remembered::default(),
        1.0,
        &["desk", "shelf"],
        &[("desk", 0.0, "cup"), ("shelf", 1.0, "mug")],
    );
    /// The looks of other runs: their time, the surfaces, and the objects seen there.
    type Looks<'a> = (f64, &'a [&'a str], &'a [(&'a str, f64, &'a str)]);
    let check = |others: Looks, present: &[(&str, f64, &str, f64)], gone: &[(&str, f64, &str, f64)]| {
        let here = looked(&before, others.0, others.1, others.2);
        let after = looked(&before, 5.0, &["desk"], &[("desk", 2.0, "cup")]);
        let joined = here.joined(&before, after, 5.0);
        assert_eq!(
            (places(&joined.present), places(&joined.gone)),
            (present.to_vec(), gone.to_vec()),
            "{others:?}"
        );
    };
    // Others looked elsewhere.
    check(
        (9.0, &["shelf"], &[("shelf", 3.0, "mug")]),
        &[("shelf", 3.0, "mug", 9.0), ("desk", 2.0, "cup", 5.0)],
        &[("shelf", 1.0, "mug", 1.0), ("desk", 0.0, "cup", 1.0)],
    );
    // Others looked there later, and earlier.
    check(
        (9.0, &["desk"], &[("desk", 4.0, "cup")]),
        &[("desk", 4.0, "cup", 9.0), ("shelf", 1.0, "mug", 1.0)],
        &[("desk", 0.0, "cup", 1.0), ("desk", 2.0, "cup", 5.0)],
    );
    check(
        (3.0, &["desk"], &[("desk", 4.0, "cup")]),
        &[("shelf", 1.0, "mug", 1.0), ("desk", 2.0, "cup", 5.0)],
        &[("desk", 0.0, "cup", 1.0), ("desk", 4.0, "cup", 3.0)],
    );
}

#[test]
fn nothing_that_was_learned_is_lost_and_each_thing_has_a_name_of_its_own() {
    let before = Remembered { things: vec![named("thing 1", 1.0, 1.0)], ..Remembered::default() };
    let mut here =
        Remembered { things: vec![named("thing 1", 1.0, 1.0), named("thing 2", 3.0, 3.0)], ..before.clone() };
    here.rename("thing 1", "kettle");
    let mut after = looked(&before, 5.0, &["desk"], &[("desk", 0.0, "thing 1"), ("desk", 1.0, "thing 2")]);
    after.things = vec![named("thing 1", 1.0, 5.0), named("thing 2", 5.0, 5.0)];
    let joined = here.joined(&before, after, 5.0);
    let known: Vec<(&str, f64, f64)> =
        joined.things.iter().map(|t| (t.name.as_str(), t.learned_unix_s, t.seen.unix_s)).collect();
    assert_eq!(known, [("kettle", 1.0, 5.0), ("thing 2", 3.0, 3.0), ("thing 3", 5.0, 5.0)]);
    assert_eq!(places(&joined.present), [("desk", 0.0, "kettle", 5.0), ("desk", 1.0, "thing 3", 5.0)]);
}

#[test]
fn what_an_ability_remembers_besides_is_that_of_the_run_that_changed_it() {
    let besides = |all: &[(&str, u64)]| Remembered {
        besides: all.iter().map(|(name, kept)| (name.to_string(), (*kept).into())).collect(),
        ..Remembered::default()
    };
    let (before, others) = (besides(&[("one", 1), ("two", 1)]), besides(&[("one", 1), ("two", 2)]));
    let joined = others.joined(&before, besides(&[("one", 3), ("two", 1), ("three", 1)]), 0.0);
    assert_eq!(joined.besides, besides(&[("one", 3), ("two", 2), ("three", 1)]).besides);
    assert_eq!(joined.besides::<u64>("one"), Some(3));
    assert_eq!(joined.besides::<String>("one"), None);
}
