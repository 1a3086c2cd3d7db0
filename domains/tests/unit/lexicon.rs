//! Tests of `lexicon`.

use descry_domains::abilities::learning::news::News;
use descry_domains::english::*;
use descry_domains::lexicon::*;
use descry_memory::learned::{LearnedThing, Place};
use descry_perception::Cloud;
use descry_perception::nalgebra::Point3;

#[test]
fn several_are_called_as_people_call_them() {
    let check = |name: &str, expected: &str| assert_eq!(plural(name), expected);
    check("cup", "cups");
    check("white cylinder", "white cylinders");
    check("box", "boxes");
    check("glass", "glasses");
    check("brush", "brushes");
    check("berry", "berries");
    check("tray", "trays");
    check("y", "ys");
}

#[test]
fn a_position_has_no_minus_before_nothing() {
    assert_eq!(position([-0.004, -0.0, 0.716]), "(0.00, 0.00, 0.72) m");
    assert_eq!(position([-0.006, 1.0, 10.0]), "(-0.01, 1.00, 10.00) m");
}

#[test]
fn places_have_names_of_their_own() {
    let check = |surfaces: &[&str], rooms: &[&str], expected: Option<&str>| {
        let own = |list: &[&str]| list.iter().map(|name| name.to_string()).collect();
        let places = Places { surfaces: own(surfaces), rooms: own(rooms), ..Places::default() };
        assert_eq!(places.unclear().as_deref(), expected, "{surfaces:?} {rooms:?}");
    };
    check(&["table", "table 2"], &["table"], None);
    check(&["table", "Table"], &[], Some("nothing tells the surface \"Table\" from the surface \"table\""));
    check(&["a b", "c", "a-b"], &[], Some("nothing tells the surface \"a-b\" from the surface \"a b\""));
    check(&["table"], &["--"], Some("\"--\" is no name of a room"));
}

#[test]
fn a_learned_thing_has_the_symbol_that_goals_give_its_name() {
    for name in ["kettle", "the thing from Tuesday", "a lunch box", "3rd cup"] {
        let mut lexicon = Lexicon::default();
        lexicon.learn("thing", name);
        let thing = LearnedThing {
            name: name.into(),
            learned_unix_s: 0.0,
            cloud: Cloud::default(),
            sides: 1.0,
            directions: 0,
            meetings: 1,
            seen: Place { unix_s: 0.0, at_m: Point3::origin(), on: "table".into() },
        };
        let news = News { things: vec![thing], ..News::default() };
        let symbol = &lexicon.of_type("thing")[0].symbol;
        assert_eq!(news.thing(symbol).map(|t| t.name.as_str()), Some(name), "{symbol}");
    }
}
