//! Plans replayed: what is valid, what is not, and why.

use descry_planner::{
    Answer, Attachments, Call, CallError, Cause, FactValue, Plan, Read, Semantics, Source, State, Task,
    Verdict, endless, monitor, validate,
};

const KITCHEN: &str = include_str!("data/kitchen-domain.pddl");
const WORKSHOP: &str = include_str!("data/workshop-domain.pddl");

fn task(domain: &str, problem: &str) -> Task {
    Task::read(&Source::new("domain", domain), &Source::new("problem", problem))
        .unwrap_or_else(|all| panic!("{all}"))
}

fn plan(text: &str) -> Plan {
    Plan::read(&Source::new("plan", text)).unwrap_or_else(|all| panic!("{all}"))
}

fn verdict(domain: &str, problem: &str, steps: &str) -> Verdict {
    validate(&task(domain, problem), &attachments(), &plan(steps))
}

struct Nearby;

impl descry_planner::Attachment for Nearby {
    fn reads(&self) -> Vec<Read> {
        vec![Read::At("height".to_string(), vec![Some(0)])]
    }

    fn evaluate(&self, call: &Call) -> Result<Answer, CallError> {
        Ok(Answer::Truth(call.number("height", &[&call.arguments[0]])? < 2.0))
    }
}

fn attachments() -> Attachments {
    let mut attachments = Attachments::new();
    attachments.insert("reachable", Nearby);
    attachments.insert("walk-time", |call: &Call| {
        let same = call.arguments[0] == call.arguments[1];
        Ok(Answer::Number(if same { f64::INFINITY } else { 3.0 }))
    });
    attachments
        .insert("weigh", |_: &Call| Ok(Answer::Writes(vec![FactValue::Number(1.5), FactValue::Truth(true)])));
    attachments.insert("broken", |_: &Call| Err(CallError::Failed("no scale".to_string())));
    attachments
}

/// Checks a list of plans: its text, and a part of the reason why it is invalid (empty where it is valid).
fn check(domain: &str, problem: &str, cases: &[(&str, &str)]) {
    for (steps, reason) in cases {
        let verdict = verdict(domain, problem, steps);
        let said = verdict.reason.clone().unwrap_or_default();
        assert_eq!(verdict.valid, reason.is_empty(), "{steps}\n{said}");
        assert!(said.contains(reason), "{steps}\nexpected: {reason}\nsaid: {said}");
        assert_eq!(verdict.findings.is_empty(), verdict.valid, "an invalid plan is drawn");
    }
}

const KITCHEN_PROBLEM: &str = "(define (problem p) (:domain kitchen)
  (:objects mug jug - dish  table shelf - place)
  (:init (on mug table) (on jug table) (= (height shelf) 1) (= (height table) 1) (= (load) 0) (= (weight mug) 2)
         (= (weight jug) 5) (= (owner mug) ann))
  (:goal (and (on mug shelf) (tidy))) (:metric minimize (+ (* 2 (load)) (total-cost))))";

#[test]
fn classical_plans() {
    check(
        KITCHEN,
        KITCHEN_PROBLEM,
        &[
            ("(take mug table)\n(put mug shelf)\n(take jug table)\n(put jug shelf)", ""),
            ("(take mug table)\n(put mug shelf)", "the goal (tidy) is not reached"),
            ("(take mug shelf)", "(on mug shelf) does not hold"),
            ("(take mug table)\n(take jug table)", "(not (held mug)) does not hold"),
            ("(grab mug table)", "no action is called `grab`"),
            ("(take mug)", "takes 2 arguments, found 1"),
            ("(take mug mug)", "`mug` is no place"),
            ("(take mug attic)", "no object is called `attic`"),
            (
                "(give mug bob)\n(give mug bob)",
                "(not (= (owner mug) bob)) does not hold before it: (owner mug) is bob",
            ),
            (
                "(lift jug)\n(lift jug)",
                "(<= (+ (load) (weight jug)) 8) does not hold before it: (+ (load) (weight jug)) is 10",
            ),
            ("(wobble shelf)\n(take mug table)\n(put mug shelf)", "[reachable shelf] does not hold"),
            ("(ask)", "has no value"),
        ],
    );
}

#[test]
fn cost_and_metric_come_from_the_last_state() {
    let steps = "(lift mug)\n(take mug table)\n(put mug shelf)\n(take jug table)\n(put jug shelf)";
    let verdict = verdict(KITCHEN, KITCHEN_PROBLEM, steps);
    assert_eq!((verdict.valid, verdict.metric, verdict.makespan), (true, Some(8.0), None));
    let data = serde_json::to_value(&verdict).expect("a verdict is data");
    for key in ["valid", "reason", "step", "cost", "makespan", "metric"] {
        assert!(data.get(key).is_some(), "{key}");
    }
}

#[test]
fn a_conditional_effect_reads_the_state_before() {
    // `swap` exchanges two facts at once: each condition sees the old one.
    let problem = "(define (problem p) (:domain kitchen) (:objects mug - dish  table - place)
        (:init (on mug table) (left)) (:goal (and (right) (not (left)))))";
    check(
        KITCHEN,
        problem,
        &[("(swap)", ""), ("(swap)\n(swap)", "is not reached"), ("(swap)\n(swap)\n(swap)", "")],
    );
}

const WORKSHOP_PROBLEM: &str = "(define (problem p) (:domain workshop)
  (:objects a b - part  here there - spot)
  (:init (raw a) (raw b) (at here) (= (heat) 20) (free) (at 10 (closed)) (at 30 (not (closed))))
  (:goal (and (done a))))";

#[test]
fn changes_of_one_number_at_once_must_have_a_result() {
    let domain = "(define (domain d) (:requirements :fluents :conditional-effects) (:predicates (high) (wet)) (:functions (level))
      (:action fill :parameters () :effect (and (when (high) (assign (level) 5)) (when (wet) (increase (level) 2))))
      (:action rain :parameters () :effect (and (wet) (increase (level) 1) (decrease (level) 3)))
      (:action rise :parameters () :effect (and (high) (assign (level) 1) (assign (level) 1))))";
    let problem = "(define (problem p) (:domain d) (:init (= (level) 0)) (:goal (>= (level) 0)))";
    check(
        domain,
        problem,
        &[
            ("(rain)\n(fill)", ""),
            ("(rise)\n(fill)", ""),
            ("(rain)\n(rise)\n(fill)", "step 3 (fill): two changes of (level) at once contradict each other"),
        ],
    );
}

#[test]
fn an_object_gets_one_value_at_once() {
    let domain = "(define (domain d) (:requirements :adl :object-fluents) (:types place) (:constants a b - place)
      (:predicates (high) (wet)) (:functions (at) - place (home) - place)
      (:action go :parameters () :effect (and (when (high) (assign (at) a)) (when (wet) (assign (at) (home)))))
      (:action rain :parameters () :effect (wet))
      (:action lose :parameters () :effect (and (wet) (assign (at) undefined) (assign (at) a)))
      (:action rise :parameters () :effect (and (high) (assign (at) b) (assign (at) (home)))))";
    let problem =
        "(define (problem p) (:domain d) (:init (= (at) a) (= (home) b)) (:goal (or (high) (wet))))";
    let clash = "two changes of (at) at once contradict each other";
    check(
        domain,
        problem,
        &[
            ("(rain)\n(go)", ""),
            ("(rise)\n(go)", ""),
            ("(rain)\n(rise)\n(go)", &format!("step 3 (go): {clash}")),
            ("(rain)\n(lose)", &format!("step 2 (lose): {clash}")),
        ],
    );
}

#[test]
fn plans_with_times() {
    check(
        WORKSHOP,
        WORKSHOP_PROBLEM,
        &[
            ("0: (light) [5]\n1: (join a) [2]", ""),
            ("0: (light) [5]\n1: (join a) [2.5]", "takes 2.5, 2 is asked for"),
            ("0: (join a) [2]", "(lit) does not hold at its start"),
            ("0: (light) [5]\n4: (join a) [2]", "(lit) does not hold all the time"),
            ("0: (light) [5]\n3: (join a) [2]", "both touch (lit)"),
            ("0: (light) [5]\n0: (join a) [2]", "(lit) does not hold at its start"),
            ("0: (light) [5]\n0.001: (join a) [2]", ""),
            ("0: (light) [5]\n1: (join a) [2]\n1: (join b) [2]", "both touch (free)"),
            ("9: (light) [5]\n10: (join a) [2]", "both touch (closed)"),
            ("10.5: (light) [5]\n11: (join a) [2]", "(not (closed)) does not hold at its start"),
            ("30.5: (light) [5]\n31: (join a) [2]", ""),
            ("0: (wait) [1]\n2: (light) [5]\n3: (join a) [2]", ""),
            ("0: (wait) [0.5]", "takes 0.5, 1 is asked for"),
            ("0: (wait) [4.5]", "takes 4.5, 4 is asked for"),
            (
                "0: (walk here there) [3]\n4: (walk there here) [3]\n8: (light) [5]\n8.5: (join a) [1]",
                "takes 1, 2 is",
            ),
            ("0: (walk here here) [3]", "says that it cannot be done"),
            ("(join a)", "takes time, but the plan has no times"),
        ],
    );
}

/// A basin that fills up while it is watched, in a condition over all; and what else happens to it.
fn basin(over_all: &str, more: &str) -> String {
    format!(
        "(define (domain basin) (:requirements :adl :durative-actions :numeric-fluents :continuous-effects :derived-predicates)
          (:predicates (dry) (odd)) (:functions (level) (room))
          (:derived (odd) (and (> (level) 2) (< (level) 8)))
          (:durative-action fill :parameters () :duration (= ?duration 10) :condition (over all {over_all})
            :effect (and (increase (level) (* #t 1)) {more})))"
    )
}

#[test]
fn what_holds_over_all_holds_between_two_happenings() {
    let problem = "(define (problem p) (:domain basin) (:init (= (level) 0) (= (room) 10)) (:goal (and)))";
    for (over_all, more, reason) in [
        ("(<= (level) 10)", "", ""),
        ("(<= (level) 9)", "", "(<= (level) 9) does not hold all the time"),
        // It holds at both ends, and not on the way.
        ("(or (<= (level) 2) (>= (level) 8))", "", "does not hold all the time"),
        ("(not (= (level) 5))", "", "does not hold all the time"),
        ("(not (odd))", "", "does not hold all the time"),
        ("(< (* (level) (room)) 25)", "(decrease (room) (* #t 1))", "does not hold all the time"),
        ("(<= (* (level) (room)) 25)", "(decrease (room) (* #t 1))", ""),
        // The ends themselves are not part of it.
        ("(< (level) 10)", "", ""),
        ("(> (level) 0)", "", ""),
        ("(and (> (level) 0) (< (level) 10) (not (= (level) 10)))", "", ""),
        ("(> (level) 1)", "", "(> (level) 1) does not hold all the time"),
    ] {
        check(&basin(over_all, more), problem, &[("0: (fill) [10]", reason)]);
    }
    let twice = "0: (fill) [10]\n2: (fill) [10]";
    check(&basin("(< (level) 18)", ""), problem, &[(twice, "step 2 (fill) at 2: (< (level) 18)")]);
    check(&basin("(< (level) 20)", ""), problem, &[(twice, "")]);
}

#[test]
fn what_happens_at_a_time_asks_for_a_plan_with_times() {
    let domain = "(define (domain d) (:requirements :timed-initial-literals) (:predicates (p) (q))
      (:action a :parameters () :precondition (p) :effect (q)))";
    let problem = "(define (problem p) (:domain d) (:init (p) (at 0.5 (not (p)))) (:goal (q)))";
    check(
        domain,
        problem,
        &[
            ("(a)", "the task has timed literals, but step 1 (a) has no time"),
            ("0: (a)", ""),
            ("0.6: (a)", "(p) does not hold"),
        ],
    );
    let verdict = verdict(domain, problem, "0: (a) [3]");
    assert_eq!((verdict.valid, verdict.makespan), (true, Some(0.0)), "what takes no time ends at once");
}

#[test]
fn effects_at_the_end_remember_the_start() {
    // What `heat-up` leaves behind depends on whether the door was closed when it began.
    let problem = |goal: &str| {
        format!(
            "(define (problem p) (:domain workshop) (:objects a - part  here - spot)
               (:init (raw a) (at here) (= (heat) 20) (free) (at 5 (closed))) (:goal {goal}))"
        )
    };
    let early = "1: (heat-up) [8]";
    let late = "6: (heat-up) [8]";
    check(WORKSHOP, &problem("(aired)"), &[(early, ""), (late, "(aired) is not reached")]);
    check(
        WORKSHOP,
        &problem("(= (heat) 36)"),
        &[(early, ""), ("1: (heat-up) [4]", "is not reached: (heat) is 28")],
    );
    check(
        WORKSHOP,
        &problem("(> (heat) 100)"),
        &[("0: (heat-up) [50]", "(<= (heat) 90) does not hold all the time")],
    );
}

#[test]
fn modules_are_asked_exactly() {
    let problem = "(define (problem p) (:domain workshop) (:objects a b - part  here - spot)
        (:init (raw a) (raw b) (at here) (= (heat) 20) (free)) (:goal (and (known a) (= (mass a) 1.5))))";
    check(WORKSHOP, problem, &[("0: (weigh-it a) [1]", ""), ("0: (weigh-it b) [1]", "the goal (known a)")]);
    let attachments = Attachments::new();
    let verdict = validate(&task(WORKSHOP, problem), &attachments, &plan("0: (weigh-it a) [1]"));
    assert!(!verdict.valid);
    let reason = verdict.reason.unwrap_or_default();
    assert!(reason.contains("[weigh a]") && reason.contains("no attachment of this name"), "{reason}");
    assert!(verdict.findings.render(false).contains("([weigh ?p])"), "{}", verdict.findings);
}

#[test]
fn derived_facts_follow_through_recursion_and_negation() {
    let domain = "(define (domain net) (:types node)
        (:predicates (link ?a ?b - node) (cut ?a - node) (reach ?a ?b - node) (isolated ?a - node) (goal-met))
        (:derived (reach ?a ?b) (or (link ?a ?b) (exists (?c - node) (and (link ?a ?c) (not (cut ?c)) (reach ?c ?b)))))
        (:derived (isolated ?a - node) (forall (?b - node) (imply (not (= ?a ?b)) (not (reach ?b ?a)))))
        (:action sever :parameters (?a - node) :precondition (not (isolated ?a)) :effect (cut ?a))
        (:action finish :parameters () :precondition (reach n0 n29) :effect (goal-met)) )";
    let nodes: String = (0..30).map(|node| format!(" n{node}")).collect();
    let links: String = (0..29).map(|node| format!("(link n{node} n{})", node + 1)).collect();
    let domain = domain.replace("(:types node)", &format!("(:types node) (:constants{nodes} - node)"));
    let problem = format!("(define (problem p) (:domain net) (:init {links}) (:goal (goal-met)))");
    check(
        &domain,
        &problem,
        &[
            ("(finish)", ""),
            ("(sever n7)\n(finish)", "(reach n0 n29) does not hold"),
            ("(sever n29)\n(finish)", ""),
            ("(sever n0)", "(not (isolated n0)) does not hold"),
        ],
    );
}

#[test]
fn preferences_and_constraints_count() {
    let problem = |constraints: &str| {
        format!(
            "(define (problem p) (:domain kitchen) (:objects mug jug - dish  table shelf - place)
               (:init (on mug table) (on jug table) (= (height shelf) 1) (= (height table) 1))
               (:goal (and (on mug shelf) (preference both (on jug shelf)) (forall (?d - dish) (preference up (on ?d shelf)))))
               {constraints}
               (:metric minimize (+ (* 10 (is-violated both)) (is-violated up))))"
        )
    };
    let steps = "(take mug table)\n(put mug shelf)";
    let free = verdict(KITCHEN, &problem(""), steps);
    assert_eq!((free.valid, free.metric), (true, Some(11.0)));
    for (constraint, holds) in [
        ("(always (on jug table))", true),
        ("(always (on mug table))", false),
        ("(sometime (held mug))", true),
        ("(at-most-once (held mug))", true),
        ("(sometime-before (on mug shelf) (held mug))", true),
        ("(sometime-before (held mug) (on mug shelf))", false),
        ("(sometime-after (held mug) (on mug shelf))", true),
        ("(forall (?d - dish) (sometime (held ?d)))", false),
        ("(at end (on mug shelf))", true),
        ("(within 1 (held mug))", true),
        ("(within 1 (on mug shelf))", false),
        ("(always-within 1 (held mug) (on mug shelf))", true),
        ("(hold-after 2 (on mug shelf))", true),
        ("(hold-during 0 1 (on mug table))", true),
        ("(hold-during 0 2 (on mug table))", false),
    ] {
        let verdict = verdict(KITCHEN, &problem(&format!("(:constraints {constraint})")), steps);
        assert_eq!(verdict.valid, holds, "{constraint}: {:?}", verdict.reason);
    }
}

/// The condition that a cause is about.
fn unmet(cause: &Cause) -> Option<&str> {
    match cause {
        Cause::Goal(unmet) | Cause::Condition { unmet, .. } => Some(&unmet.condition),
        _ => None,
    }
}

#[test]
fn the_monitor_says_what_broke() {
    let task = task(KITCHEN, KITCHEN_PROBLEM);
    let attachments = attachments();
    let rest = plan("(put mug shelf)\n(take jug table)\n(put jug shelf)");
    let semantics = Semantics::new(&task, &attachments);
    let mut state = semantics.initial().expect("no call fails");
    let (action, mut binding) = semantics.bind(&plan("(take mug table)").steps[0]).expect("the step fits");
    let applied = semantics.apply_action(&mut state, action, &mut binding).expect("no call fails");
    assert_eq!(applied, Ok(()));
    assert_eq!(monitor(&task.with_state(&state), &attachments, &rest), Ok(()));

    // Somebody put the jug away, and the shelf is out of reach now.
    let id = |name: &str| task.find_object(name).expect("declared");
    let on = task.find_predicate("on").expect("declared");
    let mut moved: State = state.clone();
    moved.set_fact(on, &[id("jug"), id("table")], false);
    let broken = monitor(&task.with_state(&moved), &attachments, &rest).expect_err("the jug is gone");
    assert_eq!((broken.step, unmet(&broken.cause)), (Some(1), Some("(on jug table)")));

    let height = task.find_function("height").expect("declared");
    state.set_number(height, &[id("shelf")], Some(5.0));
    let broken = monitor(&task.with_state(&state), &attachments, &rest).expect_err("the shelf is too high");
    assert_eq!((broken.step, unmet(&broken.cause)), (Some(0), Some("[reachable shelf]")));
    let place = &KITCHEN[broken.span.start as usize..broken.span.end as usize];
    assert_eq!(place, "[reachable ?p]");
    assert!(broken.to_string().starts_with("step 1 (put mug shelf)"), "{broken}");
}

#[test]
fn an_invalid_step_is_drawn_in_the_domain() {
    let verdict = verdict(WORKSHOP, WORKSHOP_PROBLEM, "0: (light) [5]\n4: (join a) [2]");
    insta::assert_snapshot!("invalid-step", verdict.findings.render(false));
}

#[test]
fn what_takes_no_time_starts_and_ends_at_once() {
    let domain = "(define (domain d) (:requirements :adl :durative-actions :numeric-fluents) (:predicates (dry) (wet) (known) (odd))
      (:functions (level) (long))
      (:durative-action look :parameters () :duration (= ?duration (long)) :condition (over all (< (level) 5))
        :effect (and (at end (known)) (when (at start (dry)) (at end (odd)))))
      (:durative-action flash :parameters () :duration (= ?duration (long)) :effect (and (at start (wet)) (at end (not (wet)))))
      (:action fill :parameters () :effect (increase (level) 9)))";
    let problem = "(define (problem p) (:domain d) (:init (dry) (= (level) 0) (= (long) 0)) (:goal (and (known) (odd))))";
    check(
        domain,
        problem,
        &[
            ("1: (look) [0]", ""),
            // Its condition over all is nobody's any more.
            ("1: (look) [0]\n2: (fill)", ""),
            ("1: (flash) [0]", "both touch (wet)"),
        ],
    );
}

#[test]
fn a_metric_that_a_step_makes_ever_better_is_told_from_one_with_an_end() {
    let (down, up) = ("(decrease (cost) 2)", "(increase (cost) 2)");
    let domain = |earn: &str| {
        format!(
            "(define (domain d) (:requirements :durative-actions :numeric-fluents) (:predicates (p) (q)) (:functions (cost) (left))
              (:action earn :parameters () :precondition (p) :effect {earn})
              (:durative-action sell :parameters () :duration (= ?duration 2) :condition (at start (p)) :effect (at end {down}))
              (:action go :parameters () :precondition (p) :effect (and (q) (increase (cost) 5))))"
        )
    };
    for (earn, metric, steps, expected) in [
        (down, "minimize (cost)", "0: (earn)\n1: (go)", Some(("earn", 2.0))),
        (down, "minimize (cost)", "0: (sell) [2]\n1: (go)", Some(("sell", 2.0))),
        (down, "minimize (* 3 (cost))", "(earn)\n(go)", Some(("earn", 6.0))),
        (down, "minimize (+ (cost) (* 5 (total-time)))", "0: (sell) [2]\n1: (go)", None),
        (down, "minimize (cost)", "(go)", None),
        (up, "minimize (- 9 (cost))", "(earn)\n(go)", Some(("earn", 2.0))),
        (up, "maximize (cost)", "(earn)\n(go)", Some(("earn", 2.0))),
        (up, "minimize (cost)", "(earn)\n(go)", None),
        ("(and (decrease (cost) (left)) (decrease (left) 1))", "minimize (cost)", "(earn)\n(go)", None),
        ("(scale-down (cost) 2)", "minimize (cost)", "(go)\n(earn)", None),
    ] {
        let problem = format!(
            "(define (problem p) (:domain d) (:init (p) (= (cost) 0) (= (left) 9)) (:goal (q)) (:metric {metric}))"
        );
        let domain = Source::new("domain", domain(earn).as_str());
        let task = Task::read(&domain, &Source::new("problem", problem.as_str()));
        let task = task.unwrap_or_else(|findings| panic!("{}", findings.render(false)));
        let plan = Plan::read(&Source::new("plan", steps)).expect("it is read");
        let found = endless(&task, &Attachments::new(), &plan);
        let found = found.map(|(step, gain)| (step.action, gain));
        assert_eq!(found, expected.map(|(name, gain)| (name.to_string(), gain)), "{earn} {metric} {steps}");
    }
}
