//! Tests of `compared`.

use descry_agent::compared::*;

#[test]
fn what_is_wanted_stands_in_the_goal() {
    let check = |goal: &str, number: &str, expected: Option<f64>| {
        assert_eq!(wanted(goal, number), expected, "{goal}: {number}");
    };
    check("(>= (confidence a-ring) 0.8)", "(confidence a-ring)", Some(0.8));
    check("(exists (?s - place) (>= (presence a-ring ?s) 0.9))", "(presence a-ring shelf)", Some(0.9));
    check("(exists (?s - place) (>= (presence a-ring ?s) 0.9))", "(presence stone shelf)", None);
    check("(and (a) (<= (unseen) 0.5))", "(unseen)", Some(0.5));
    check("(>= (presence a-ring) (sure))", "(presence a-ring)", None);
    check("(on a-ring shelf)", "(clarity shelf)", None);
    check("(>= (unseen-part) 0.5)", "(unseen)", None);
    check("(>= (found red-stone) 0.9)", "(found red-stone)", Some(0.9));
    check("(>= (found red-stone) 0.9)", "(found big-stone)", None);
}
