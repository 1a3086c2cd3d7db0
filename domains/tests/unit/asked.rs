//! Tests of `asked`.

use descry_domains::asked::*;
use descry_domains::load::Domain;

#[test]
fn what_is_asked_is_read_off_the_condition() {
    let domain = Domain::load("tabletop").unwrap();
    let check = |condition: &str, things: &[(&str, Option<&[&str]>)], kinds: &[&str], surfaces: &[&str]| {
        let own = |list: &[&str]| list.iter().map(|s| s.to_string()).collect::<Vec<_>>();
        let expected = Asked {
            things: things.iter().map(|(t, on)| (t.to_string(), on.map(own))).collect(),
            kinds: own(kinds).into_iter().map(|kind| (kind, None)).collect(),
            surfaces: own(surfaces),
            denied: Vec::new(),
            more: condition.contains("observed"),
        };
        assert_eq!(Asked::of(condition, &domain.vocabulary), expected, "{condition}");
    };
    check("(>= (confidence cup-a) 0.8)", &[("cup-a", None)], &[], &[]);
    check("(>= (presence cup-a table) 0.8)", &[("cup-a", Some(&["table"]))], &[], &[]);
    check(
        "(and (>= (presence cup-a table) 0.8) (>= (presence mug shelf) 0.8))",
        &[("cup-a", Some(&["table"])), ("mug", Some(&["shelf"]))],
        &[],
        &[],
    );
    check("(and (>= (confidence cup-a) 0.8) (>= (presence cup-a table) 0.8))", &[("cup-a", None)], &[], &[]);
    check("(exists (?s - surface) (>= (presence cup-a ?s) 0.8))", &[("cup-a", None)], &[], &[]);
    check("(>= (completeness cup) 0.8)", &[], &["cup"], &[]);
    check("(>= (clarity table) 0.8)", &[], &[], &["table"]);
    check("(observed table-3 table)", &[], &[], &[]);
    check("(and (observed table-3 table) (on cup-a table))", &[("cup-a", None)], &[], &[]);
}

#[test]
fn what_must_not_be_so_is_told_from_what_must() {
    let domain = Domain::load("home").unwrap();
    let check = |condition: &str, expected: &[(&[&str], &[&str], &[&str])]| {
        let own = |list: &[&str]| list.iter().map(|s| s.to_string()).collect::<Vec<_>>();
        let denied = Asked::of(condition, &domain.vocabulary).denied;
        let denied: Vec<_> = denied.into_iter().map(|d| (d.things, d.kinds, d.surfaces)).collect();
        let expected: Vec<_> = expected.iter().map(|(t, k, s)| (own(t), own(k), own(s))).collect();
        assert_eq!(denied, expected, "{condition}");
    };
    check("(on cup-a desk)", &[]);
    check("(not (on cup-a desk))", &[(&["cup-a"], &[], &["desk"])]);
    check("(not (not (on cup-a desk)))", &[]);
    check("(>= (presence cup-a desk) 0.8)", &[]);
    check("(<= (presence cup-a desk) 0.1)", &[(&["cup-a"], &[], &["desk"])]);
    check("(> 0.1 (presence cup-a desk))", &[(&["cup-a"], &[], &["desk"])]);
    check("(not (>= (confidence cup-a) 0.8))", &[(&["cup-a"], &[], &[])]);
    check(
        "(and (>= (completeness cup) 0.9) (forall (?t - thing) (imply (is ?t cup) (on ?t desk))))",
        &[(&[], &["cup"], &[])],
    );
    check(
        "(not (exists (?t - thing) (and (is ?t mug) (on ?t desk))))",
        &[(&[], &["mug"], &[]), (&[], &[], &["desk"])],
    );
    check(
        "(not (exists (?s - surface) (and (in ?s study) (on cup-a ?s))))",
        &[(&["cup-a"], &[], &["study"])],
    );
    // What is remembered of what was done is known.
    check("(not (slippery cup-a))", &[]);
    check("(not (observed desk-1 desk))", &[]);
}

#[test]
fn a_thing_is_asked_about_in_the_room_that_is_said_beside_it() {
    let domain = Domain::load("home").unwrap();
    let check = |condition: &str, places: &[Option<&[&str]>]| {
        let own = |list: &&[&str]| list.iter().map(|s| s.to_string()).collect::<Vec<_>>();
        let found: Vec<_> =
            Asked::of(condition, &domain.vocabulary).things.into_iter().map(|(_, places)| places).collect();
        let expected: Vec<_> = places.iter().map(|places| places.as_ref().map(own)).collect();
        assert_eq!(found, expected, "{condition}");
    };
    let there = "(exists (?s - surface) (and (in ?s study) (>= (presence mug ?s) 0.8)))";
    let anywhere = "(exists (?s - surface) (>= (presence cup-a ?s) 0.8))";
    check(there, &[Some(&["study"])]);
    check(&format!("(and {there} {anywhere})"), &[Some(&["study"]), None]);
    check(&format!("(exists (?s - surface) (and (in ?s study) {anywhere}))"), &[None]);
    check("(exists (?s - surface) (or (in ?s study) (>= (presence mug ?s) 0.8)))", &[None]);
    // Where it is to be taken from does not matter.
    check("(exists (?s - surface) (and (in ?s study) (on mug ?s)))", &[None]);
}

#[test]
fn a_kind_is_asked_about_in_the_rooms_that_are_named() {
    let domain = Domain::load("home").unwrap();
    let check = |condition: &str, rooms: Option<&[&str]>| {
        let rooms = rooms.map(|rooms| rooms.iter().map(|r| r.to_string()).collect());
        assert_eq!(Asked::of(condition, &domain.vocabulary).kinds, [("cup".to_string(), rooms)]);
    };
    let kitchen = "(>= (completeness-in cup kitchen) 0.9)";
    check(kitchen, Some(&["kitchen"]));
    check(&format!("(and {kitchen} (>= (completeness-in cup study) 0.9))"), Some(&["kitchen", "study"]));
    check(&format!("(and {kitchen} (>= (completeness cup) 0.9))"), None);
}
