//! Plans for domains whose actions call attachments.

use descry_planner::{
    Answer, Attachment, Attachments, Call, CallError, FactValue, Options, Outcome, Plan, PlanError, Read,
    Source, Task, plan,
};

/// Halves the doubt about the thing, which it reads from the state.
struct Expected;

impl Attachment for Expected {
    fn reads(&self) -> Vec<Read> {
        vec![Read::At("confidence".to_string(), vec![Some(1)])]
    }

    fn evaluate(&self, call: &Call) -> Result<Answer, CallError> {
        let confidence = call.number("confidence", &[&call.arguments[1]])?;
        Ok(Answer::Writes(vec![FactValue::Number(1.0 - 0.5 * (1.0 - confidence))]))
    }
}

/// Place of pose `pN` on a line: N metres from the start, every other one behind it.
fn place_m(name: &str) -> f64 {
    let number: f64 = name.trim_start_matches('p').parse().unwrap_or(0.0);
    if number % 2.0 == 0.0 { number } else { -number }
}

fn attachments() -> Attachments {
    let mut attachments = Attachments::new();
    attachments.insert("path_cost", |call: &Call| {
        Ok(Answer::Number((place_m(&call.arguments[0]) - place_m(&call.arguments[1])).abs()))
    });
    // From the start and from poses nearer than 3 m nothing is seen.
    attachments.insert("can_see", |call: &Call| Ok(Answer::Truth(place_m(&call.arguments[0]).abs() >= 3.0)));
    attachments.insert("expected_confidence", Expected);
    attachments
}

fn look(poses: usize, threshold: f64) -> Task {
    let names: Vec<String> = (1..=poses).map(|number| format!("p{number}")).collect();
    let problem = format!(
        "(define (problem look-{poses}) (:domain look) (:objects start {} - pose table - surface cup - thing)
           (:init (at-pose start) (on cup table) (= (confidence cup) 0)) (:goal (>= (confidence cup) {threshold})))",
        names.join(" ")
    );
    let domain = Source::new("look.pddl", include_str!("data/look.pddl"));
    match Task::read(&domain, &Source::new("problem.pddl", problem)) {
        Ok(task) => task,
        Err(findings) => panic!("{}", findings.render(false)),
    }
}

fn solve(task: &Task, attachments: &Attachments) -> Outcome {
    match plan(task, attachments, &Options::default(), &|| false, &mut |_| {}) {
        Ok(outcome) => outcome,
        Err(error) => panic!("{error}"),
    }
}

fn solved(task: &Task, attachments: &Attachments) -> Plan {
    match solve(task, attachments) {
        Outcome::Solved { plan, .. } => plan,
        other => panic!("not solved: {other:?}"),
    }
}

fn end_s(plan: &Plan) -> f64 {
    plan.steps.iter().map(|step| step.start_s.unwrap_or(0.0) + step.duration_s).fold(0.0, f64::max)
}

fn names(plan: &Plan) -> Vec<String> {
    plan.steps.iter().map(|step| format!("{} {}", step.action, step.arguments.join(" "))).collect()
}

#[test]
fn the_shortest_tour_of_views_is_found() {
    // One view suffices at 0.5: the nearest pose that sees is 3 m behind. Two views, at 0.7: 3 m behind, then 2 m further.
    for (poses, threshold, expected_s, moves) in
        [(5, 0.5, 3.0 + 2.0, 1), (5, 0.7, 5.0 + 4.0, 2), (20, 0.7, 9.0, 2)]
    {
        let plan = solved(&look(poses, threshold), &attachments());
        let moved = plan.steps.iter().filter(|step| step.action == "move").count();
        assert_eq!(moved, moves, "{:?}", names(&plan));
        assert!((end_s(&plan) - expected_s).abs() < 0.01, "{:?} ends at {}", names(&plan), end_s(&plan));
    }
}

#[test]
fn ways_that_come_too_late_for_the_goal_are_not_asked_for() {
    let attachments = attachments();
    let plan = solved(&look(30, 0.5), &attachments);
    assert_eq!(names(&plan), ["move start p3", "observe p3 table cup"]);
    let asked = attachments.statistics()["path_cost"].calls;
    assert!(asked < 31 * 30 / 5, "{asked} of {} ways", 31 * 30);
}

#[test]
fn the_same_seed_gives_the_same_plan_and_counts() {
    let task = look(12, 0.9);
    let first = solve(&task, &attachments());
    let second = solve(&task, &attachments());
    assert_eq!(first.plan(), second.plan());
    assert_eq!(first.statistics(), second.statistics());
}

#[test]
fn what_no_pose_can_see_is_unsolvable_and_not_out_of_time() {
    let mut blind = attachments();
    blind.insert("can_see", |_: &Call| Ok(Answer::Truth(false)));
    let outcome = solve(&look(3, 0.5), &blind);
    assert!(matches!(outcome, Outcome::Unsolvable { .. }), "{outcome:?}");
}

#[test]
fn an_infinite_cost_means_that_the_way_is_closed() {
    let mut walled = attachments();
    walled.insert("path_cost", |call: &Call| {
        let behind = call.arguments.iter().any(|name| place_m(name) < 0.0);
        Ok(Answer::Number(if behind { f64::INFINITY } else { place_m(&call.arguments[1]).abs() }))
    });
    let plan = solved(&look(5, 0.5), &walled);
    assert_eq!(names(&plan), ["move start p4", "observe p4 table cup"]);
}

/// Seconds to a pose on a line; nothing leads into the pit, as far as the gate that is read tells.
struct PastTheGate;

impl Attachment for PastTheGate {
    fn reads(&self) -> Vec<Read> {
        vec![Read::At("shut".to_string(), Vec::new())]
    }

    fn evaluate(&self, call: &Call) -> Result<Answer, CallError> {
        let at = |n: usize| call.arguments[n].trim_start_matches('p').parse::<f64>().unwrap_or(12.0);
        let leads = &*call.arguments[1] != "pit";
        Ok(Answer::Number(if leads { 3.0 + 2.0 * (at(0) - at(1)).abs() } else { f64::INFINITY }))
    }
}

#[test]
fn a_way_that_is_closed_now_is_no_short_cut_for_the_heuristic() {
    let poses: Vec<String> = (0..24).map(|n| format!("p{n}")).collect();
    let problem = format!(
        "(define (problem three) (:domain carry) (:objects {} pit - pose a b c - thing)
           (:init (at p0) (free) (shut) (on a p5) (on b p17) (on c p20))
           (:goal (and (on a p11) (on b p11) (on c p11))) (:metric minimize (total-time)))",
        poses.join(" ")
    );
    let domain = Source::new("carry.pddl", include_str!("data/carry.pddl"));
    let task = Task::read(&domain, &Source::new("problem.pddl", problem)).expect("the task can be read");
    let mut attachments = Attachments::new();
    attachments.insert("path_cost", PastTheGate);
    let options = Options { evaluation_limit: Some(2_500), ..Options::default() };
    let outcome = plan(&task, &attachments, &options, &|| false, &mut |_| {}).expect("it is planned");
    let found = outcome.plan().unwrap_or_else(|| panic!("no plan: {:?}", outcome.statistics()));
    assert_eq!(found.steps.len(), 12, "{:?}", names(found));
    assert!(end_s(found) < 160.0, "{:?} ends at {}", names(found), end_s(found));
}

#[test]
fn missing_and_failing_attachments_are_errors_at_their_place() {
    let task = look(3, 0.5);
    let run =
        |attachments: &Attachments| plan(&task, attachments, &Options::default(), &|| false, &mut |_| {});
    let missing = run(&Attachments::new());
    let Err(PlanError::Refused(findings)) = missing else { panic!("{missing:?}") };
    assert_eq!(findings.list.len(), 3, "every module without an attachment is named");
    assert!(findings.render(false).contains("look.pddl:5"), "{}", findings.render(false));

    let mut failing = attachments();
    failing.insert("path_cost", |_: &Call| Err(CallError::Failed("the map is not there yet".to_string())));
    let failed = run(&failing);
    let Err(error @ PlanError::Attachment { .. }) = failed else { panic!("{failed:?}") };
    assert!(error.to_string().contains("the map is not there yet"), "{error}");
    // Drawn where it is asked, and where it is declared.
    let drawn = error.findings().map(|findings| findings.render(false)).unwrap_or_default();
    assert!(drawn.contains("asked here, by `move`") && drawn.contains("(path-cost ?from ?to"), "{drawn}");
}

#[test]
fn names_that_came_as_a_list_of_texts_are_proposals() {
    let domain =
        "(define (domain shelf) (:requirements :typing :negative-preconditions :modules :grounding-modules)
      (:types book) (:modules (free-slot ?b - book grounding free_slot@x)) (:predicates (placed ?b - book))
      (:action place :parameters (?b - book) :grounding ([free-slot ?b])
        :precondition (not (placed ?b)) :effect (placed ?b)))";
    let problem =
        "(define (problem one) (:domain shelf) (:objects atlas - book) (:init) (:goal (placed atlas)))";
    let task = Task::read(&Source::new("d", domain), &Source::new("p", problem)).expect("it is a task");
    let mut attachments = Attachments::new();
    // As any JSON list of texts is read.
    attachments.insert("free_slot", |_: &Call| Ok(Answer::Writes(vec![FactValue::Object("left".into())])));
    assert_eq!(names(&solved(&task, &attachments)), ["place atlas left"]);
}
