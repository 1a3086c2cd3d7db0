//! Tests of `gantt`.

use descry_pages::gantt::*;
use descry_planner::{Plan, Step};

fn step(start_s: Option<f64>, action: &str, duration_s: f64) -> Step {
    Step { start_s, action: action.into(), arguments: vec!["a".into(), "<b>".into()], duration_s }
}

/// Checks that the chart of a plan has these parts in their order.
fn check(steps: Vec<Step>, parts: &[&str]) {
    let drawn = svg(&Plan { steps, ..Plan::default() });
    let mut rest = drawn.as_str();
    for part in parts {
        let (_, after) = rest.split_once(part).unwrap_or_else(|| panic!("no {part} in\n{drawn}"));
        rest = after;
    }
}

#[test]
fn steps_stand_in_the_order_in_which_they_begin() {
    let timed = vec![step(Some(4.0), "second", 6.0), step(Some(0.0), "first", 4.0)];
    check(timed, &["(first a &lt;b&gt;)", "width=\"272.0\"", "(second a", "width=\"408.0\"", ">10.0</text>"]);
    check(
        vec![step(None, "one", 0.0), step(None, "two", 0.0)],
        &["(one", "width=\"340.0\"", "(two", ">2</text>"],
    );
    check(Vec::new(), &["<svg", "</svg>"]);
}
