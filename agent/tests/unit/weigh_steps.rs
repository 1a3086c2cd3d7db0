//! Tests of `weigh::steps`.

use descry_agent::weigh::steps::*;
use descry_planner::Step;

#[test]
fn drives_that_lead_on_from_each_other_could_be_one() {
    let read = |text: &str| {
        let step = |call: &str| {
            let mut words = call.split(' ').map(str::to_string);
            let action = words.next().expect("an action");
            Step { start_s: None, action, arguments: words.collect(), duration_s: 1.0 }
        };
        text.split(", ").filter(|call| !call.is_empty()).map(step).collect::<Vec<_>>()
    };
    let check = |steps: &str, expected: Option<&str>| {
        assert_eq!(joined(&read(steps)), expected.map(read), "{steps}");
    };
    check("move a b, look b t", None);
    check("move a b, look b t, move b c", None);
    check("move a b, move b c, look c t", Some("move a c, look c t"));
    check("move a b, move b a, look a t", Some("look a t"));
    check("move a b, open b d, move b c", None);
}
