//! Tests of `saying`.

use descry_domains::lexicon::Places;
use descry_domains::load::Domain;
use descry_domains::saying::*;

#[test]
fn what_is_written_in_pddl_is_said() {
    let domain = Domain::load("home").expect("a built-in domain");
    let saying = Saying::of(&domain, &Places::of_scene(&domain));
    let check = |text: &str, said: &str| assert_eq!(saying.say(text), said, "{text}");
    check("(move start desk-1)", "driving to desk-1");
    check("(observe desk-1 kitchen-table)", "looking at the kitchen table from desk-1");
    check("(open-door side-door-side-1 side-door)", "opening the side door");
    check("(presence cup-a desk)", "the certainty that cup A stands on the desk");
    let somewhere = "(exists (?s) (>= (presence cup-a ?s) 0.8))";
    assert_eq!(
        saying.deny(somewhere),
        "there is no surface for which the certainty that cup A stands on it is at least 0.8"
    );
    assert_eq!(
        saying.would_deny(somewhere),
        "there would be no surface for which the certainty that cup A stands on it is at least 0.8"
    );
    assert_eq!(saying.deny("(fly a b)"), "(fly a b) does not hold");
    check(
        "(and (>= (completeness cup) 0.8) (forall (?t - thing) (imply (is ?t cup) (on ?t kitchen-table))))",
        "the certainty that all cups are found is at least 0.8, and for every thing: if it is surely one of the cups, it \
         stands on the kitchen table",
    );
    check("(holding object-3)", "object 3 is in the hand");
    check("(not (shut side-door))", "it is not so that the side door is shut");
    // What the domain has no line for, and what is no PDDL.
    for same in
        ["(fly a b) 3", "it (which is (0.80 is wanted)", "[+0.88 in 1.2 s]", "(move start)", "a) b", "("]
    {
        check(same, same);
    }
    check("(that is, (at start))", "(that is, the robot stands at start)");
    assert_eq!(Saying::default().say("(at start)"), "(at start)");
    assert_eq!(saying.in_general("shut"), "the door is shut");
    assert_eq!(saying.in_general("fly"), "fly");
}
