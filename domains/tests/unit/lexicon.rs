//! Tests of `lexicon`.

use descry_domains::english::*;
use descry_domains::lexicon::*;

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
