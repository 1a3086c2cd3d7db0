//! Tasks that are in order and have no plan: what a reader is told, and that nothing is called proven that is not.

use descry_planner::{Answer, Attachments, Call, Options, Outcome, PlanError, Source, Task, plan};

fn read(domain: &str, problem: &str) -> Task {
    let domain = Source::new("domain.pddl", format!("(define (domain d)\n{domain})"));
    let problem = Source::new("problem.pddl", format!("(define (problem p) (:domain d)\n{problem})"));
    Task::read(&domain, &problem).unwrap_or_else(|findings| panic!("{}", findings.render(false)))
}

fn solve(domain: &str, problem: &str) -> Result<Outcome, PlanError> {
    let mut attachments = Attachments::new();
    attachments.insert("fits", |call: &Call| Ok(Answer::Truth(&*call.arguments[0] == "cup")));
    attachments.insert("drive", |call: &Call| {
        Ok(Answer::Number(if &*call.arguments[1] == "attic" { f64::INFINITY } else { 3.0 }))
    });
    attachments.insert("broken", |_: &Call| {
        Err(descry_planner::CallError::Failed("the map is not there".to_string()))
    });
    let options = Options { evaluation_limit: Some(20_000), ..Options::default() };
    plan(&read(domain, problem), &attachments, &options, &|| false, &mut |_| {})
}

/// The findings of a task that is proven to have no plan, as they are drawn.
fn why(domain: &str, problem: &str) -> String {
    match solve(domain, problem) {
        Ok(Outcome::Unsolvable { why, .. }) => why.findings.render(false),
        other => panic!("{other:?}"),
    }
}

const HOUSE: &str = "  (:requirements :typing :negative-preconditions)
  (:types thing room)
  (:predicates (in ?t - thing ?r - room) (door ?a ?b - room) (carried ?t - thing) (robot-in ?r - room)
    (clean ?t - thing) (brush ?t - thing))
  (:action go :parameters (?a ?b - room) :precondition (and (robot-in ?a) (door ?a ?b))
    :effect (and (not (robot-in ?a)) (robot-in ?b)))
  (:action take :parameters (?t - thing ?r - room) :precondition (and (robot-in ?r) (in ?t ?r))
    :effect (and (not (in ?t ?r)) (carried ?t)))
  (:action put :parameters (?t - thing ?r - room) :precondition (and (robot-in ?r) (carried ?t))
    :effect (and (in ?t ?r) (not (carried ?t))))
  (:action scrub :parameters (?t ?b - thing) :precondition (and (carried ?t) (brush ?b) (carried ?b))
    :effect (clean ?t))
";

const HOUSE_PROBLEM: &str = "  (:objects cup - thing hall kitchen attic - room) (:init (robot-in hall) (door hall kitchen) (in cup kitchen))\n";

const LIGHT: &str = "  (:requirements :durative-actions)
  (:predicates (match) (light) (mended))
  (:durative-action strike :parameters () :duration (= ?duration 5) :condition (at start (match))
    :effect (and (at start (not (match))) (at start (light)) (at end (not (light)))))
  (:durative-action mend :parameters () :duration (= ?duration 6) :condition (over all (light))
    :effect (at end (mended)))
";

const SHOP: &str = "  (:requirements :durative-actions :timed-initial-literals)
  (:predicates (open) (there) (home) (bought))
  (:durative-action go :parameters () :duration (= ?duration 4) :condition (at start (home))
    :effect (and (at start (not (home))) (at end (there))))
  (:durative-action back :parameters () :duration (= ?duration 4) :condition (at start (there))
    :effect (and (at start (not (there))) (at end (home))))
  (:durative-action buy :parameters () :duration (= ?duration 3)
    :condition (and (at start (there)) (over all (open))) :effect (at end (bought)))
";

const MODULES: &str = "  (:requirements :typing :durative-actions :modules)
  (:types thing room)
  (:modules (fits ?t - thing ?r - room conditionchecker fits@house) (drive ?a ?b - room cost drive@house))
  (:predicates (at ?r - room) (stored ?t - thing))
  (:durative-action move :parameters (?a ?b - room) :duration (= ?duration [drive ?a ?b])
    :condition (at start (at ?a)) :effect (and (at start (not (at ?a))) (at end (at ?b))))
  (:durative-action store :parameters (?t - thing ?r - room) :duration (= ?duration 1)
    :condition (and (at start (at ?r)) (over all ([fits ?t ?r]))) :effect (at end (stored ?t)))
";

const GAUGE: &str = "  (:requirements :durative-actions :numeric-fluents)
  (:predicates (valve)) (:functions (level) (room))
  (:durative-action fill :parameters () :duration (= ?duration 1) :condition (over all (valve))
    :effect (at end (increase (level) 1)))
";

const TANK: &str = "  (:requirements :numeric-fluents)
  (:predicates (lit)) (:functions (fuel) (cap))
  (:action fill :parameters () :precondition (< (fuel) (cap)) :effect (increase (fuel) 1))
  (:action light :parameters () :precondition (> (fuel) 1) :effect (and (lit) (decrease (fuel) 1)))
";

const FAILING: &str = "  (:requirements :typing :durative-actions :modules)
  (:types thing)
  (:modules (broken ?t - thing conditionchecker broken@house))
  (:predicates (seen ?t - thing))
  (:durative-action look :parameters (?t - thing) :duration (= ?duration 1)
    :condition (at start ([broken ?t])) :effect (at end (seen ?t)))
";

#[test]
fn each_reason_is_drawn_where_it_stands() {
    for (name, domain, problem) in [
        ("no-door", HOUSE, format!("{HOUSE_PROBLEM}  (:goal (in cup attic))")),
        ("nothing-to-scrub-with", HOUSE, format!("{HOUSE_PROBLEM}  (:goal (clean cup))")),
        ("a-way-back-that-is-not-there", HOUSE, format!("{HOUSE_PROBLEM}  (:goal (and (carried cup) (in cup hall)))")),
        (
            "excluding-each-other",
            HOUSE,
            "  (:objects cup - thing hall kitchen - room) (:init (robot-in hall) (door hall kitchen) (in cup hall))
  (:goal (and (carried cup) (robot-in kitchen) (in cup kitchen)))"
                .to_string(),
        ),
        ("too-short-a-light", LIGHT, "  (:init (match)) (:goal (mended))".to_string()),
        ("too-early-a-deadline", SHOP, "  (:init (home) (open) (at 6 (not (open)))) (:goal (bought))".to_string()),
        (
            "a-condition-said-no",
            MODULES,
            "  (:objects cup bowl - thing hall - room) (:init (at hall)) (:goal (and (stored cup) (stored bowl)))"
                .to_string(),
        ),
        (
            "a-cost-said-never",
            MODULES,
            "  (:objects hall attic - room) (:init (at hall)) (:goal (at attic))".to_string(),
        ),
        (
            "a-number-that-stays",
            GAUGE,
            "  (:init (= (level) 0) (= (room) 9)) (:goal (and (>= (level) 3) (>= (room) 1)))".to_string(),
        ),
        (
            "a-number-out-of-reach",
            TANK,
            "  (:init (= (fuel) 3) (= (cap) 5))
  (:goal (and (lit) (> (fuel) 8) (< (fuel) 100)))".to_string(),
        ),
        ("nothing-will-do", TANK, "  (:init (= (fuel) 3) (= (cap) 5)) (:goal (or))".to_string()),
        ("needed-by-a-rule-of-some", HOUSE, format!("{HOUSE_PROBLEM}  (:goal (exists (?t - thing) (and (clean ?t) (brush ?t))))")),
    ] {
        insta::assert_snapshot!(name, why(domain, &problem));
    }
}

#[test]
fn with_nothing_taken_away_a_goal_is_to_be_had_only_where_it_surely_is() {
    let both = "(:requirements :durative-actions :numeric-fluents) (:predicates (key) (in) (out) (lit)) (:functions (fuel) (left))
      (:action enter :parameters () :precondition (key) :effect (and (in) (not (key)) (decrease (left) 1)))
      (:action leave :parameters () :precondition (key) :effect (and (out) (not (key))))";
    let start = "(:init (key) (= (fuel) 0) (= (left) 0))";
    for (more, goal, surely) in [
        ("", "(and (in) (out))", true),
        // It would be divided by nothing, take less than no time, or ask for a number.
        ("(:action light :parameters () :precondition (key) :effect (and (lit) (increase (fuel) (/ 1 (left)))))", "(and (out) (lit) (in))", false),
        ("(:durative-action light :parameters () :duration (= ?duration (- (left) 5)) :condition (at start (in)) :effect (at end (lit)))", "(lit)", false),
        ("(:action light :parameters () :precondition (and (in) (> (left) 0)) :effect (lit))", "(lit)", false),
        // Or give a number two values.
        ("(:action light :parameters () :precondition (in) :effect (and (lit) (assign (fuel) 1) (assign (fuel) 2)))", "(lit)", false),
        // What a start gives is of no use where its end cannot come.
        ("(:durative-action light :parameters () :duration (= ?duration 5) :condition (and (at start (in)) (at end (< (left) -9)))
            :effect (at start (lit)))", "(lit)", false),
    ] {
        let why = why(&format!("{both} {more}"), &format!("{start} (:goal {goal})"));
        assert_eq!(why.contains("it could be had"), surely, "{why}");
    }
}

#[test]
fn a_failing_attachment_is_drawn_where_it_is_asked() {
    let problem = "  (:objects cup - thing) (:init) (:goal (seen cup))";
    let Err(PlanError::Attachment { findings, .. }) = solve(FAILING, problem) else { panic!("it fails") };
    insta::assert_snapshot!("a-failing-attachment", findings.render(false));
}

#[test]
fn deadlines_are_met_where_they_can_be_and_else_proven_too_early() {
    for (init, goal, solvable) in [
        ("(open) (at 8 (not (open)))", "(bought)", true),
        ("(open) (at 6 (not (open)))", "(bought)", false),
        // Going back and forth first never helps.
        ("(at 9 (open)) (at 11 (not (open)))", "(bought)", false),
        ("(at 9 (open)) (at 13 (not (open)))", "(and (bought) (home))", true),
        ("(open) (at 3 (not (open))) (at 20 (open)) (at 22 (not (open)))", "(bought)", false),
        ("(open) (at 3 (not (open))) (at 20 (open)) (at 24 (not (open)))", "(bought)", true),
    ] {
        let outcome = solve(SHOP, &format!("(:init (home) {init}) (:goal {goal})"));
        match outcome {
            Ok(Outcome::Solved { .. }) => assert!(solvable, "{init}"),
            Ok(Outcome::Unsolvable { .. }) => assert!(!solvable, "{init}"),
            other => panic!("{init}: {other:?}"),
        }
    }
}

const ROUND: &str = "  (:requirements :typing :durative-actions :constraints :timed-initial-literals)
  (:types place pack)
  (:predicates (at ?p - place) (road ?a ?b - place) (in ?x - pack) (lies ?x - pack ?p - place) (lit) (told))
  (:durative-action go :parameters (?a ?b - place) :duration (= ?duration 4)
    :condition (and (at start (at ?a)) (at start (road ?a ?b))) :effect (and (at start (not (at ?a))) (at end (at ?b))))
  (:durative-action load :parameters (?x - pack ?p - place) :duration (= ?duration 1)
    :condition (and (at start (lies ?x ?p)) (over all (at ?p))) :effect (and (at start (not (lies ?x ?p))) (at end (in ?x))))
  (:durative-action drop :parameters (?x - pack ?p - place) :duration (= ?duration 1)
    :condition (and (at start (in ?x)) (over all (at ?p))) :effect (and (at start (not (in ?x))) (at end (lies ?x ?p))))
  (:durative-action tell :parameters () :duration (= ?duration 1) :condition (at start (lit)) :effect (at end (told)))
";

#[test]
fn what_comes_too_late_whatever_is_done_is_proven_at_once() {
    // Many packs leave much to look at; a place is twenty seconds away, and to put a pack there takes one more.
    let places: String = (0..6).map(|at| format!(" p{at}")).collect();
    let packs: String = (0..6).map(|pack| format!(" x{pack}")).collect();
    let lie: String = (0..6).map(|pack| format!(" (lies x{pack} p0)")).collect();
    let roads: String =
        (0..5).map(|at| format!(" (road p{at} p{}) (road p{} p{at})", at + 1, at + 1)).collect();
    for (more, goal, expected) in [
        ("", "(and)) (:constraints (within 20 (lies x0 p5)))", Some("within 20 s: it takes 21 s at least")),
        ("", "(and)) (:constraints (within 23 (lies x0 p5)))", None),
        ("", "(and)) (:constraints (forall (?p - place) (within 19.5 (at ?p))))", Some("within 19.5 s")),
        (
            "",
            "(and)) (:constraints (and (within 30 (at p5)) (within 3 (or (at p1) (at p2)))))",
            Some("within 3 s"),
        ),
        // It is light at first and again later: not for ever too late.
        ("(lit) (at 9 (not (lit)))", "(and (lies x0 p5) (told)))", None),
        ("(at 3 (lit)) (at 9 (not (lit))) (at 40 (lit))", "(told))", None),
    ] {
        let problem = format!(
            "(:objects{places} - place{packs} - pack) (:init (at p0){lie}{roads} {more}) (:goal {goal}"
        );
        let outcome = solve(ROUND, &problem).expect("no attachment");
        match (&outcome, expected) {
            (Outcome::Unsolvable { why, statistics }, Some(said)) => {
                assert!(why.to_string().contains(said), "{goal}: {why}");
                assert_eq!(statistics.evaluated, 0, "{goal}");
            }
            (Outcome::Solved { .. }, None) => {}
            _ => panic!("{more} {goal}: {outcome:?}"),
        }
    }
}

#[test]
fn what_only_chosen_durations_could_reach_is_not_called_impossible() {
    // The level rises with the duration chosen; the search takes the shortest, so it finds no plan, and proves nothing.
    let domain = "(:requirements :durative-actions :numeric-fluents :duration-inequalities)
      (:predicates (idle)) (:functions (level))
      (:durative-action fill :parameters () :duration (and (>= ?duration 1) (<= ?duration 9))
        :condition (at start (idle)) :effect (and (at start (not (idle))) (at end (increase (level) ?duration))))";
    let outcome = solve(domain, "(:init (idle) (= (level) 0)) (:goal (>= (level) 5))");
    assert!(
        matches!(outcome, Ok(Outcome::OutOfTime { best: None, .. } | Outcome::Solved { .. })),
        "{outcome:?}"
    );
}

#[test]
fn numbers_that_pass_a_point_by_may_come_back_to_it() {
    // 3 + 8 - 3 - 3 = 5: the first step leads away from the goal.
    let domain = "(:requirements :numeric-fluents :durative-actions) (:functions (x))
      (:durative-action up :parameters () :duration (= ?duration 1) :effect (at end (increase (x) 8)))
      (:durative-action down :parameters () :duration (= ?duration 1) :effect (at end (decrease (x) 3)))";
    let outcome = solve(domain, "(:init (= (x) 3)) (:goal (= (x) 5))");
    assert!(matches!(outcome, Ok(Outcome::Solved { .. })), "{outcome:?}");
}

#[test]
fn the_reason_goes_on_to_what_nobody_brings_about() {
    // From the kitchen leads a door to the hall and one back, and from the hall one to the office: none from there.
    let problem = "(:objects cup - thing kitchen hall office - room)
      (:init (robot-in office) (in cup kitchen) (door kitchen hall) (door hall kitchen) (door hall office))
      (:goal (in cup office))";
    let told = why(HOUSE, problem);
    for said in [
        "`(carried cup)` never holds",
        "lacks `(robot-in kitchen)`",
        "lacks `(robot-in hall)`",
        "`(door office hall)` never holds",
    ] {
        assert!(told.contains(said), "{said}:\n{told}");
    }
}

#[test]
fn what_never_works_out_is_the_reason() {
    let roads = "(:requirements :durative-actions :numeric-fluents) (:predicates (at ?r)) (:functions (dist ?a ?b))
      (:durative-action go :parameters (?a ?b) :duration (= ?duration (dist ?a ?b)) :condition (at start (at ?a))
        :effect (and (at start (not (at ?a))) (at end (at ?b))))";
    let told = why(roads, "(:objects a b) (:init (at a)) (:goal (at b))");
    assert!(told.contains("function `dist` never has a value"), "{told}");
    let factory = "(:requirements :durative-actions) (:predicates (free ?r) (at ?r))
      (:durative-action move :parameters (?r ?a ?b) :duration (= ?duration 5)
        :condition (and (over all (free ?r)) (at start (at ?a)))
        :effect (and (at start (not (at ?a))) (at start (not (free ?r))) (at end (at ?b)) (at end (free ?r))))";
    let told = why(factory, "(:objects r a b) (:init (free r) (at a)) (:goal (at b))");
    assert!(told.contains("`move` can never be taken"), "{told}");
}

#[test]
fn what_is_asked_is_told_to_who_takes_it_for_proven() {
    let roads = "(:requirements :modules) (:predicates (at ?r)) (:modules (fits ?a conditionchecker fits@l))
      (:action go :parameters (?a ?b) :precondition (and (at ?a) ([fits ?b])) :effect (at ?b))";
    match solve(roads, "(:objects a b) (:init (at a)) (:goal (at b))") {
        Ok(Outcome::Unsolvable { statistics, .. }) => assert!(statistics.attachments.contains_key("fits")),
        other => panic!("{other:?}"),
    }
}

#[test]
fn durations_that_are_never_allowed_are_the_reason() {
    for (bounds, said) in [
        ("(= ?duration (- (t) 5))", "`go` can never be taken: its duration comes to -3 s, which is below 0"),
        (
            "(and (>= ?duration (+ (t) 5)) (<= ?duration (t)))",
            "`go` can never be taken: it must last at least 7 s and at most 2 s",
        ),
    ] {
        let domain = format!(
            "(:requirements :durative-actions :duration-inequalities :numeric-fluents) (:predicates (done))
             (:functions (t)) (:durative-action go :parameters () :duration {bounds} :effect (at end (done)))"
        );
        let told = why(&domain, "(:init (= (t) 2)) (:goal (done))");
        assert!(told.contains(said) && told.contains("no duration is allowed"), "{told}");
    }
}
