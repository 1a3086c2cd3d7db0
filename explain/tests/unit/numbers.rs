//! Tests of `numbers`.

use descry_agent::standing::InDoubt;
use descry_agent::weigh::Expected;
use descry_explain::numbers::*;
use descry_explain::standings::Standing;

#[test]
fn how_sure_it_is_is_said_by_the_numbers_that_the_goal_compares() {
    let doubt = InDoubt { about: "a ring".into(), wanted: 0.8, ..InDoubt::default() };
    let standing = |numbers: &[(&str, f64)]| {
        let numbers = numbers.iter().map(|(name, value)| (format!("({name})"), *value)).collect();
        Standing { numbers, ..Standing::default() }
    };
    let hoped = |name: &str| vec![Expected { name: format!("({name})"), now: 0.0, then: 0.9 }];
    let check = |goal: &str, hoped: &[Expected], numbers: &[(&str, f64)], said: &[(&str, f64)]| {
        let sure = of(&doubt, None, &standing(numbers), goal, hoped);
        let sure: Vec<(&str, f64)> = sure.iter().map(|s| (s.name.trim_matches(['(', ')']), s.now)).collect();
        assert_eq!(sure, said, "{goal}");
    };
    let find = "(and (exists (?s - place) (>= (presence a-ring ?s) 0.8)) (>= (placed a-ring) 0.8))";
    let numbers = [("presence a-ring ledge", 0.0), ("presence a-ring shelf", 0.3), ("placed a-ring", 0.5)];
    let on_the_shelf = [("presence a-ring shelf", 0.3), ("placed a-ring", 0.5)];
    check(find, &hoped("presence a-ring ledge"), &numbers, &on_the_shelf);
    let nowhere = [("presence a-ring ledge", 0.0), ("presence a-ring shelf", 0.0)];
    check(find, &hoped("presence a-ring ledge"), &nowhere, &nowhere[..1]);
    let all = "(forall (?s - place) (>= (presence a-ring ?s) 0.8))";
    check(all, &[], &numbers, &numbers[..1]);
    check("(holding a-ring)", &hoped("presence a-ring shelf"), &numbers, &numbers[1..2]);
    let brought = [("presence a-ring ledge", 0.1), ("presence a-ring shelf", 0.9)];
    check("(on a-ring shelf)", &hoped("presence a-ring ledge"), &brought, &brought[1..]);
    check("(holding a-ring)", &[], &numbers, &[]);
    check("(>= (presence stone shelf) 0.8)", &[], &numbers, &[]);
}
