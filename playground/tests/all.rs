//! Tests, run natively, of the functions that the page calls.

use descry_playground::{checked, planned};

const DOMAIN: &str = include_str!("../../docs/cookbook/breakfast/domain.pddl");
const PROBLEM: &str = include_str!("../../docs/cookbook/breakfast/problem.pddl");

#[test]
fn a_plan_comes_with_its_times() {
    let answer = planned(DOMAIN, PROBLEM, &|| false);
    assert_eq!(answer["status"], "solved", "{answer}");
    let steps = answer["steps"].as_array().expect("steps");
    let names: Vec<&str> = steps.iter().filter_map(|step| step["name"].as_str()).collect();
    assert_eq!(names, ["boil", "toast rye", "brew assam"]);
    assert_eq!(steps[0]["duration_s"], 180.0);
}

#[test]
fn a_finding_has_its_place_in_the_text() {
    let wrong = DOMAIN.replace("(hot-water))\n", "(hot-watr))\n");
    let answer = checked(&wrong, PROBLEM);
    let finding = answer["findings"].as_array().and_then(|all| all.iter().find(|f| f["severity"] == "error"));
    let finding = finding.unwrap_or_else(|| panic!("{answer}"));
    let place = |key: &str| finding[key].as_u64().expect("a place") as usize;
    assert_eq!(&wrong[place("start")..place("end")], "hot-watr", "{answer}");
    assert_eq!((place("text"), &finding["code"]), (0, &"undeclared-predicate".into()));
}

#[test]
fn what_has_no_plan_has_a_reason() {
    let answer = planned(DOMAIN, &PROBLEM.replace("(hands-free)", ""), &|| false);
    assert_eq!(answer["status"], "unsolvable", "{answer}");
    assert!(answer["why"].as_str().is_some_and(|why| why.contains("hands-free")), "{answer}");
}
