//! Tests of `explain::wording::reasons`.

use descry_agent::agent::AT_THE_END;
use descry_agent::explain::wording::reasons::*;
use descry_domains::world::NOT_AS_SAID;

#[test]
fn a_step_that_ended_too_late_is_told_so() {
    let broken = format!("{NOT_AS_SAID}step 1 (go a) at 0: (time-left) does not hold all the time");
    assert_eq!(failed(&broken), "it came to its end, but until then it was not always so that (time-left)");
    assert_eq!(failed("blocked: a door"), "blocked: a door");
}

#[test]
fn what_the_monitor_says_is_made_plain() {
    let cases = [
        (
            "the goal (>= (confidence cup-a) 0.8) is not reached: (confidence cup-a) is 0.628928",
            "(confidence cup-a) would be only 0.63, and at least 0.80 is wanted",
        ),
        (
            "the goal (>= (completeness cup) 0.9) is not reached: (completeness cup) is 0.899671",
            "(completeness cup) would be only 0.8996, and at least 0.90 is wanted",
        ),
        ("the goal (on a b) is not reached", "(on a b) does not hold"),
        (
            "step 2 (observe a b) at 28.464493 takes 2, 12.911622 is asked for",
            "(observe a b) is now reckoned at 12.9 s instead of 2.0 s; counted are the seconds in vain",
        ),
        (
            "step 1 (pick-up a) at 1.5: (>= (presence a) (sure)) does not hold at its start: (presence a) is 0.000008, (sure) is 0.8",
            "(pick-up a) needs (presence a) to be at least 0.80, and it is 0.00",
        ),
        (
            "step 1 (go) at 1: (>= (charge) 0.5) does not hold at its start: (charge) is 0.123456",
            "(go) needs (charge) to be at least 0.50, and it is 0.12",
        ),
        (
            "step 2 (merge a) at 5.1: (< (open a) 1) does not hold at its start: (open a) is 1",
            "(merge a) needs (open a) to be less than 1, and it would be 1",
        ),
        (
            "the goal (<= (unseen) 0.1) is not reached: (unseen) is 0.25",
            "(unseen) would be only 0.25, and at most 0.10 is wanted",
        ),
        (
            "step 2 (go) at 3: [worth x] does not hold at its start",
            "(go) asks that [worth x], which is not so",
        ),
        (
            "step 1 (observe a b) at 2.26: (time-left) does not hold all the time",
            "(observe a b) asks that (time-left) until it has ended, which would not be so",
        ),
        ("something else.", "something else"),
    ];
    let counts = |_: &str| Some("seconds in vain".to_string());
    cases.iter().for_each(|(said, plain)| assert_eq!(missed(said, "would be only", &counts), *plain));
    // What is told with the value of now tells what a plan ends with as that.
    let now = "the goal (>= (sure) 0.8) is not reached: (sure) is 0.5";
    let end = format!("{AT_THE_END}{now}");
    let told = |because: &str| missed(because, "is", &counts);
    assert_eq!(told(now), "(sure) is 0.50, and at least 0.80 is wanted");
    assert_eq!(told(&end), "(sure) would be only 0.50, and at least 0.80 is wanted");
}

#[test]
fn what_follows_from_a_failure_is_no_promise_to_do_it_again() {
    let plain = "1 of 4 tries of this very step is used, and the plan is made anew with what is known now";
    assert_eq!(follows("try 1 of 4"), plain);
    assert_eq!(follows("(shut study-door)"), "(shut study-door)");
}

#[test]
fn refused_calls_are_told_by_what_they_ask() {
    let about = |name: &str| (name == "w").then(|| "whether it is worth it".to_string());
    let cases = [
        (
            "the attachment of `w` said no to: [w a b], [w c d] and 5 more (with any of these answered otherwise there might be a plan)\nthe attachment of `v` said no to: [v x] (with any …)",
            "it was asked whether it is worth it, 7 times, and each time the answer was no; v is no for [v x]",
        ),
        (
            "it cannot be told, after 2 looks: the attachment of `w` said no to: [w x]",
            "it cannot be told, after 2 looks: asked whether it is worth it, the answer is no for [w x]",
        ),
        (
            "the attachment of `v` called impossible (an infinite cost): [v x], [v y]",
            "v is impossible in 2 cases",
        ),
        ("nothing.", "nothing"),
        (
            "every state that can be reached was seen, and none fulfils the whole goal (with nothing ever taken away …)",
            "whatever is done next, and in whatever order, the goal is not reached: what it needs excludes each other, or would end too late",
        ),
    ];
    cases.iter().for_each(|(said, plain)| assert_eq!(no_plan(said, &about, &|_| true), *plain));
    // What no plan has asked says nothing of why there is none, but where that is all that is known.
    let (of_hand, both) = (cases[2].0, format!("{}\n{}", cases[1].0, cases[2].0));
    let told = |said: &str| no_plan(said, &about, &|call| call == "w");
    assert_eq!(told(&both), cases[1].1);
    assert_eq!(told(of_hand), cases[2].1);
}
