//! Tests of `asked`.

use descry_domains::asked::parsed;
use descry_domains::lexicon::{Lexicon, Places};
use descry_domains::load::Domain;
use descry_domains::objective::Asked;
use descry_domains::vocabulary::Vocabulary;

/// Subjects of a condition over the words of a domain and a few derived ones.
fn asked(domain: &Domain, condition: &str) -> Asked {
    let lexicon = Lexicon::new(domain, &Places::of_scene(domain));
    let task = parsed(condition, domain, &lexicon).unwrap_or_else(|e| panic!("{condition}: {e}"));
    Asked::of(&task, &domain.vocabulary)
}

#[test]
fn what_is_asked_is_read_off_the_condition() {
    let domain = Domain::load("tabletop").unwrap();
    let check = |condition: &str, things: &[(&str, Option<&[&str]>)], kinds: &[&str], surfaces: &[&str]| {
        let own = |list: &[&str]| list.iter().map(|s| s.to_string()).collect::<Vec<_>>();
        let expected = Asked {
            things: things.iter().map(|(t, on)| (t.to_string(), on.map(own))).collect(),
            kinds: own(kinds).into_iter().map(|kind| (kind, None)).collect(),
            surfaces: own(surfaces),
            denies: false,
            clears: Vec::new(),
            more: condition.contains("observed"),
            plain: condition.matches('(').count() < 3,
            words: Vec::new(),
        };
        let found = Asked { words: Vec::new(), ..asked(&domain, condition) };
        assert_eq!(found, expected, "{condition}");
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
    let mut domain = Domain::load("home").unwrap();
    let text = domain.pddl.text.replace(
        "(:durative-action move",
        "(:derived (absent ?w - thing ?o - surface) (not (on ?w ?o)))\n(:durative-action move",
    );
    let text = text
        .replace("(:predicates", "(:predicates (absent ?w - thing ?o - surface)")
        .replace(":modules)", ":modules :derived-predicates)");
    domain.pddl = descry_planner::Source::new("domain.pddl", text);
    domain.vocabulary = Vocabulary::read(&domain.pddl).unwrap_or_else(|e| panic!("{e}"));
    let check = |condition: &str, denies: bool, things: &[(&str, &[&str])], surfaces: &[&str]| {
        let found = asked(&domain, condition);
        assert_eq!(found.denies, denies, "{condition}");
        let own = |(thing, places): &(&str, &[&str])| {
            let places: Vec<String> = places.iter().map(|s| s.to_string()).collect();
            (thing.to_string(), Some(places).filter(|places| !places.is_empty()))
        };
        assert_eq!(found.things, things.iter().map(own).collect::<Vec<_>>(), "{condition}");
        assert_eq!(found.surfaces, surfaces, "{condition}");
    };
    let desk: &[(&str, &[&str])] = &[("cup-a", &["desk"])];
    let anywhere: &[(&str, &[&str])] = &[("cup-a", &[])];
    check("(on cup-a desk)", false, anywhere, &[]);
    check("(not (on cup-a desk))", true, desk, &[]);
    check("(not (not (on cup-a desk)))", false, anywhere, &[]);
    check("(absent cup-a desk)", true, desk, &[]);
    check("(not (absent cup-a desk))", false, anywhere, &[]);
    check("(>= (presence cup-a desk) 0.8)", false, desk, &[]);
    check("(<= (presence cup-a desk) 0.1)", true, desk, &[]);
    check("(> 0.1 (presence cup-a desk))", true, desk, &[]);
    check("(= (presence cup-a desk) 0)", true, desk, &[]);
    check("(>= (- 1 (presence cup-a desk)) 0.9)", true, desk, &[]);
    check("(>= (- (presence cup-a desk) 1) 0.9)", false, desk, &[]);
    check("(>= (* (presence cup-a desk) -1) 0.9)", true, desk, &[]);
    check("(not (>= (confidence cup-a) 0.8))", true, anywhere, &[]);
    check(
        "(not (exists (?s - surface) (and (in ?s study) (on cup-a ?s))))",
        true,
        &[("cup-a", &["study"])],
        &[],
    );
    check(
        "(and (>= (completeness cup) 0.9) (forall (?t - thing) (imply (is ?t cup) (on ?t desk))))",
        true,
        &[],
        &[],
    );
    // Of whichever things there are it is asked on the surface, unless a kind says which.
    check("(not (exists (?t - thing) (and (is ?t mug) (on ?t desk))))", true, &[], &[]);
    check("(not (exists (?t - thing) (on ?t desk)))", true, &[], &["desk"]);
    // What is remembered of what was done is known.
    check("(not (slippery cup-a))", false, anywhere, &[]);
    check("(not (observed desk-1 desk))", false, &[], &[]);
}

#[test]
fn a_place_that_is_to_be_cleared_is_told_from_one_that_a_thing_is_to_leave() {
    let domain = Domain::load("home").unwrap();
    let check = |condition: &str, clears: &[&str]| {
        assert_eq!(asked(&domain, condition).clears, clears, "{condition}");
    };
    check("(forall (?t - thing) (not (on ?t desk)))", &["desk"]);
    check("(and (>= (clarity desk) 0.8) (not (exists (?t - thing) (on ?t desk))))", &["desk"]);
    check("(not (exists (?t - thing) (and (is ?t mug) (on ?t desk))))", &["desk"]);
    check("(forall (?t - thing ?s - surface) (not (on ?t ?s)))", &["?"]);
    check("(not (on cup-a desk))", &[]);
    check("(forall (?t - thing) (imply (is ?t cup) (on ?t desk)))", &[]);
    check("(exists (?t - thing) (on ?t desk))", &[]);
}

#[test]
fn a_thing_is_asked_about_in_the_room_that_is_said_beside_it() {
    let domain = Domain::load("home").unwrap();
    let check = |condition: &str, places: &[Option<&[&str]>]| {
        let own = |list: &&[&str]| list.iter().map(|s| s.to_string()).collect::<Vec<_>>();
        let found: Vec<_> = asked(&domain, condition).things.into_iter().map(|(_, places)| places).collect();
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
        assert_eq!(asked(&domain, condition).kinds, [("cup".to_string(), rooms)]);
    };
    let kitchen = "(>= (completeness-in cup kitchen) 0.9)";
    check(kitchen, Some(&["kitchen"]));
    check(&format!("(and {kitchen} (>= (completeness-in cup study) 0.9))"), Some(&["kitchen", "study"]));
    check(&format!("(and {kitchen} (>= (completeness cup) 0.9))"), None);
}
