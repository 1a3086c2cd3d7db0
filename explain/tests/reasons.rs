//! Reasons as values: what the planner's monitor finds, what the record keeps of it, and the sentences made of it.

use descry_agent::reason::{Break, Reason, Trigger};
use descry_agent::report::Event;
use descry_domains::lesson::Lesson;
use descry_domains::saying::Saying;
use descry_planner::semantics::Compared;
use descry_planner::task::Comparison;
use descry_planner::{Cause, Moment, Unmet};
use descry_skills::Call;

fn call(text: &str) -> Call {
    let mut words = text.split(' ').map(str::to_string);
    Call { action: words.next().expect("a name"), arguments: words.collect() }
}

fn compared(left: &str, value: f64, comparison: Comparison, wanted: f64) -> Unmet {
    let compared = Compared {
        left: left.into(),
        left_value: Some(value),
        comparison,
        right: wanted.to_string(),
        right_value: Some(wanted),
    };
    Unmet { condition: format!("(>= {left} {wanted})"), compared: Some(compared), values: Vec::new() }
}

fn condition(text: &str) -> Unmet {
    Unmet { condition: text.into(), ..Unmet::default() }
}

#[test]
fn a_break_is_told_by_its_values_and_kept_as_them() {
    use Comparison::{GreaterOrEqual, Less, LessOrEqual};
    let check = |step: Option<&str>, is_expected: bool, cause: Cause, said: &str, would: &str| {
        let broken = Break { step: step.map(call), is_expected, cause };
        assert_eq!(broken.told(&Saying::default()), said);
        assert_eq!(broken.would_be(&Saying::default()), would);
        let kept = serde_json::to_string(&broken).expect("it is written");
        assert_eq!(serde_json::from_str::<Break>(&kept).expect("it is read"), broken, "{kept}");
    };
    let sure = || compared("(sure)", 0.899671, GreaterOrEqual, 0.9);
    check(
        None,
        true,
        Cause::Goal(sure()),
        "(sure) would be only 0.8996, and at least 0.90 is wanted",
        "(sure) would be 0.8996, and at least 0.90 is wanted",
    );
    check(
        None,
        false,
        Cause::Goal(sure()),
        "(sure) is 0.8996, and at least 0.90 is wanted",
        "(sure) would be 0.8996, and at least 0.90 is wanted",
    );
    check(
        None,
        false,
        Cause::Goal(compared("(unseen)", 0.25, LessOrEqual, 0.1)),
        "(unseen) is 0.25, and at most 0.10 is wanted",
        "(unseen) would be 0.25, and at most 0.10 is wanted",
    );
    check(
        None,
        false,
        Cause::Goal(condition("(on a b)")),
        "(on a b) does not hold",
        "(on a b) would not hold",
    );
    check(
        Some("pick-up a"),
        false,
        Cause::Condition { when: Moment::Start, unmet: compared("(presence a)", 8e-6, GreaterOrEqual, 0.8) },
        "(pick-up a) needs (presence a) to be at least 0.80, and it is 0.00",
        "(pick-up a) needs (presence a) to be at least 0.80, and it would be 0.00",
    );
    check(
        Some("merge a"),
        true,
        Cause::Condition { when: Moment::Start, unmet: compared("(open a)", 1.0, Less, 1.0) },
        "(merge a) needs (open a) to be less than 1, and it would be 1",
        "(merge a) needs (open a) to be less than 1, and it would be 1",
    );
    check(
        Some("go"),
        false,
        Cause::Condition { when: Moment::Start, unmet: condition("[worth x]") },
        "(go) asks that [worth x], which is not so",
        "(go) asks that [worth x], which would not be so",
    );
    check(
        Some("observe a b"),
        false,
        Cause::Condition { when: Moment::OverAll, unmet: condition("(time-left)") },
        "(observe a b) asks that (time-left) until it has ended, which would not be so",
        "(observe a b) asks that (time-left) until it has ended, which would not be so",
    );
    check(
        Some("observe a b"),
        false,
        Cause::Duration { planned_s: 2.0, asked_s: 12.911622 },
        "(observe a b) is now reckoned at 12.9 s instead of 2.0 s",
        "(observe a b) is now reckoned at 12.9 s instead of 2.0 s",
    );
}

#[test]
fn events_are_kept_as_values_and_those_of_earlier_versions_are_read() {
    let reason = Reason { search_ended_after: Some(9), ..Reason::of(Trigger::Failed { call: call("go a") }) };
    let planned = serde_json::json!({
        "event": "planned", "round": 2, "because": "(go a) failed; the search ended after 9 states",
        "reason": reason, "steps": ["0.000: (go b) [2.41342984]", "2.414: (look b) [2.000]"],
        "makespan_s": 4.414, "calls": [],
    });
    let event: Event = serde_json::from_value(planned.clone()).expect("it is read");
    let said = event.to_string();
    for line in [
        "plan 2    because (go a) failed; the search ended after 9 states",
        "            2.4 s  (look b), 2.0 s",
    ] {
        assert!(said.contains(line), "{line:?} is not in {said}");
    }
    assert_eq!(serde_json::to_value(&event).expect("it is written"), planned);
    // An earlier version kept the sentence alone.
    let earlier = serde_json::json!({
        "event": "planned", "round": 1, "because": "there is no plan yet", "steps": ["(go b)"],
        "makespan_s": 0.0, "calls": [["path-cost", 3]],
    });
    let event: Event = serde_json::from_value(earlier).expect("it is read");
    assert!(
        event.to_string().starts_with("plan 1    because there is no plan yet\n          (go b)"),
        "{event}"
    );
    let earlier = serde_json::json!({
        "event": "failed", "call": "(go b)", "because": "blocked", "therefore": "try 1 of 4",
    });
    let event: Event = serde_json::from_value(earlier).expect("it is read");
    assert_eq!(event.to_string(), "failed    (go b): blocked; try 1 of 4");
    let earlier = serde_json::json!({
        "event": "perceived", "on": "table", "merged": 1, "left_out": ["view 2 left out: it contradicts"],
        "points": 5, "residual_m": 0.001, "objects": [], "changed": ["confidence in mug: 0.00 -> 0.10"],
    });
    let event: Event = serde_json::from_value(earlier).expect("it is read");
    for line in ["          view 2 left out: it contradicts", "          confidence in mug: 0.00 -> 0.10"] {
        assert!(event.to_string().contains(line), "{event}");
    }
}

#[test]
fn what_follows_from_a_failure_is_told_with_the_words_of_the_domain() {
    let told = |lesson: Lesson| lesson.told(&call("go a"), &Saying::default());
    assert_eq!(told(Lesson::Retry { tries: 1, most: 4 }), "try 1 of 4");
    assert_eq!(told(Lesson::Facts { facts: vec!["(shut door)".into()] }), "(shut door)");
    assert_eq!(told(Lesson::GivenUp { facts: Vec::new() }), "(go a) is given up");
    assert_eq!(told(Lesson::GivenUp { facts: vec!["(far a)".into()] }), "(go a) is given up: (far a)");
}
