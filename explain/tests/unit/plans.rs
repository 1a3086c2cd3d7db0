//! Tests of `plans`.

use descry_agent::reason::{Break, Reason, Trigger};
use descry_agent::weigh::Expected;
use descry_agent::weigh::{Way, Weighed, Whole};
use descry_domains::saying::Saying;
use descry_explain::Asked;
use descry_explain::chapters::Chapter;
use descry_explain::plans::*;
use descry_planner::semantics::Compared;
use descry_planner::task::Comparison;
use descry_planner::{Cause, Moment, Step, Unmet};
use descry_skills::Call;

fn call(text: &str) -> Call {
    let mut words = text.split(' ').map(str::to_string);
    Call { action: words.next().unwrap_or_default(), arguments: words.collect() }
}

fn way(step: &str, takes_s: f64, gains: f64, reaches: Option<bool>) -> Way {
    Way { steps: vec![call(step)], each_s: vec![takes_s], takes_s, gains, reaches, ..Way::default() }
}

/// Checks the justification of a run's first plan, whose makespan is ten seconds.
fn check(chosen: Option<Way>, others: &[Way], cut: Option<u64>, words: &[&str]) {
    let numbers = vec![Expected { name: "(sure)".into(), now: 0.0, then: 1.25 }];
    let open = others.len() + 1;
    let weighed = Weighed { numbers, open, chosen, others: others.to_vec(), ..Weighed::default() };
    let reason = Reason { search_ended_after: cut, ..Reason::of(Trigger::Begin) };
    let far = call("go far");
    let step = Step {
        start_s: Some(0.0),
        action: far.action.clone(),
        arguments: far.arguments.clone(),
        duration_s: 8.0,
    };
    let chapter = Chapter {
        steps: vec![step],
        calls: vec![far],
        makespan_s: 10.0,
        weighed: Some(weighed),
        reason: Some(reason),
        ..Chapter::default()
    };
    let saying = Saying::default();
    let asked = Asked {
        goal: "(>= (sure) 0.8)".into(),
        policy: None,
        counts: &|_| None,
        saying: &saying,
        has_ended: true,
        counts_in_vain: false,
    };
    let told = tell(&chapter, None, None, &asked);
    let said = [told.intent, told.figures].concat().join(" ");
    words.iter().for_each(|word| assert!(said.contains(word), "{word:?} is not in {said}"));
}

#[test]
fn it_is_said_what_the_planner_missed_and_when_it_was_stopped() {
    let chosen = || Some(way("go far", 8.0, 0.9, Some(true)));
    check(
        chosen(),
        &[way("go near", 2.0, 0.85, Some(true))],
        None,
        &[
            "1 gains more a second: (go near)",
            "that one would be enough, and sooner: the planner did not come upon it",
            "(sure) from 0.00 to 1.00 (0.80 is wanted)",
        ],
    );
    check(
        chosen(),
        &[way("go near", 2.0, 0.85, Some(false))],
        None,
        &[
            "By what is hoped of it, that one would not be enough by itself",
            "(go near) is the quickest, but by what is hoped of it would not be enough",
        ],
    );
    // With the rest of the plan behind it, it may be longer, shorter, not enough, or not possible.
    let whole =
        |way: Way, takes_s, steps, reaches| Way { whole: Some(Whole { takes_s, steps, reaches }), ..way };
    let near = || way("go near", 2.0, 0.85, Some(false));
    let far = || Some(whole(way("go far", 8.0, 0.9, Some(false)), 10.0, 2, true));
    let compared = Compared {
        left: "(sure)".into(),
        left_value: Some(0.79),
        comparison: Comparison::GreaterOrEqual,
        right: "0.8".into(),
        right_value: Some(0.8),
    };
    let unmet = Unmet { condition: "(>= (sure) 0.8)".into(), compared: Some(compared), values: Vec::new() };
    let cause = Cause::Condition { when: Moment::Start, unmet };
    let blocked = Break { step: Some(call("take it")), is_expected: true, cause };
    let ends = [
        (whole(near(), 12.0, 2, true), "and is the quickest; to its end it takes 12.0 s, 2.0 s more."),
        (whole(near(), 10.0, 2, true), "to its end it takes 10.0 s, which is as long."),
        (whole(near(), 9.0, 1, true), "enough, in 9.0 s, 1.0 s less: the planner did not come upon that."),
        (whole(near(), 9.0, 2, false), "with the rest of the plan, it would not be enough."),
        (near(), "the rest of the plan could not follow it."),
        (
            Way { blocked: Some(blocked), ..near() },
            "could not follow it: (take it) needs (sure) to be at least 0.80, and it would be 0.79.",
        ),
    ];
    let first = "With the rest of the plan it takes 10.0 s, and the planner takes the quickest whole plan";
    for (other, said) in ends {
        check(far(), &[other], None, &[first, "(go near)", "gains most a second", said]);
    }
    let other = whole(way("go farther", 9.0, 1.0, Some(false)), 11.0, 2, true);
    let said = "gains about as much a second and gains most in all; to its end";
    check(far(), &[other], Some(9), &[said, "ended after 9 states: this is the best"]);
    // Of a record that does not say what would be enough, the numbers say it.
    check(
        Some(way("go far", 8.0, 0.9, None)),
        &[way("go near", 2.0, 0.5, None)],
        None,
        &["(go near) is the quickest, but by what is hoped of it would not be enough"],
    );
    check(
        chosen(),
        &[way("go near", 2.0, 0.85, Some(true))],
        Some(9),
        &[
            "search was ended after 9 states: this is the best that it had by then",
            "(go near) is the quickest, but gains less",
        ],
    );
    check(None, &[], Some(9), &["without a plan that it expected to reach the goal"]);
    check(None, &[], None, &["Nothing was compared"]);
}
