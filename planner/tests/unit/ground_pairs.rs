//! Tests of `ground::pairs`.

use super::small;
use descry_planner::ground::pairs::*;
use descry_planner::ground::task::GroundFact;

fn check(domain: &str, problem: &str, expected: &[&str]) {
    let (task, grounded) = small::read(domain, problem);
    let said = |group: &Vec<GroundFact>| {
        let facts = group.iter().map(|&fact| small::fact(&task, &grounded, fact));
        facts.collect::<Vec<_>>().join(" ")
    };
    let groups: Vec<String> = exclusive(&grounded).iter().map(said).collect();
    assert_eq!(groups, expected, "{domain}");
}

#[test]
fn what_is_never_reached_together_is_grouped() {
    check(small::SHUTTLE, small::ROW, &["(lies x a) NoneOfThose (lies x b) (lies x c)", "(in x) (free)"]);
    // Conditional effects are not followed.
    let slips = small::SHUTTLE.replace("(free) (lies ?b ?p)", "(when (at ?p) (free)) (lies ?b ?p)");
    check(&slips, small::ROW, &[]);
}
