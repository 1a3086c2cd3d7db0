//! Faulty domains and problems, and what a reader is told: each message alone should be enough to mend the fault.

use std::path::Path;

use descry_planner::{Findings, Source, check};

fn source(name: &str) -> Source {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/broken").join(name);
    let text = std::fs::read_to_string(&path).unwrap_or_else(|error| panic!("{}: {error}", path.display()));
    Source::new(name, text)
}

fn findings(domain: &str, problem: Option<&str>) -> Findings {
    check(&source(domain), problem.map(source).as_ref())
}

#[test]
fn the_sound_one_has_no_finding() {
    assert_eq!(findings("base-domain.pddl", Some("base-problem.pddl")).render(false), "");
}

#[test]
fn each_fault_is_drawn_where_it_is() {
    for (name, domain, problem) in [
        ("predicate-typo", "predicate-typo.pddl", None),
        ("wrong-arity", "wrong-arity.pddl", None),
        ("undeclared-type", "undeclared-type.pddl", None),
        ("goal-nobody-achieves", "goal-domain.pddl", Some("goal-nobody-achieves.pddl")),
        ("goal-of-wrong-type", "base-domain.pddl", Some("goal-of-wrong-type.pddl")),
        ("missing-parenthesis", "missing-parenthesis.pddl", None),
        ("missing-inner-parenthesis", "missing-inner-parenthesis.pddl", None),
        ("missing-hanging-parenthesis", "missing-hanging-parenthesis.pddl", None),
        ("missing-last-parenthesis", "missing-last-parenthesis.pddl", None),
        ("surplus-parenthesis", "surplus-parenthesis.pddl", None),
        ("wrong-argument-type", "wrong-argument-type.pddl", None),
        ("duplicate-action", "duplicate-action.pddl", None),
        ("durations", "durations.pddl", None),
        ("unsteady-rate", "unsteady-rate.pddl", None),
        ("between-happenings", "between-happenings.pddl", None),
        ("missing-attachment", "missing-attachment.pddl", None),
        ("cyclic-types", "cyclic-types.pddl", None),
        ("wrong-kind", "wrong-kind.pddl", None),
        ("swapped-files", "base-problem.pddl", Some("base-domain.pddl")),
        ("goal-about-nothing", "base-domain.pddl", Some("goal-about-nothing.pddl")),
        ("faulty-problem", "base-domain.pddl", Some("faulty-problem.pddl")),
        ("contradiction", "base-domain.pddl", Some("contradiction.pddl")),
        ("domain-said-twice", "twice-domain.pddl", None),
        ("problem-said-twice", "base-domain.pddl", Some("twice-problem.pddl")),
        ("guessed-name", "guessed-name.pddl", None),
    ] {
        let findings = findings(domain, problem);
        assert!(findings.has_errors(), "{name} should have a fault");
        insta::assert_snapshot!(name, findings.render(false));
    }
}

#[test]
fn what_deserves_a_look_is_drawn_where_it_is() {
    for (name, domain, problem) in [
        ("gaps", "gaps-domain.pddl", Some("gaps-problem.pddl")),
        ("no-domain", "base-domain.pddl", Some("no-domain.pddl")),
        ("division-by-zero", "division-by-zero.pddl", None),
        ("contradicting-effects", "contradicting-effects.pddl", None),
    ] {
        let findings = findings(domain, problem);
        assert!(!findings.has_errors(), "{findings}");
        insta::assert_snapshot!(name, findings.render(false));
    }
}

#[test]
fn of_a_long_line_what_is_near_the_place_is_drawn() {
    let facts = " (on mug table)".repeat(100_000);
    let text = format!(
        "(define (problem p) (:domain kitchen) (:objects mug - cup table - place)\n (:init{facts} (on mug tabel){facts})\n (:goal (on mug table)))"
    );
    let drawn = check(&source("base-domain.pddl"), Some(&Source::new("long", text))).render(false);
    insta::assert_snapshot!("long-line", drawn);
}

#[test]
fn findings_are_plain_data_too() {
    let findings = findings("predicate-typo.pddl", None);
    insta::assert_json_snapshot!("predicate-typo-data", findings);
}

/// A slip of the pen in the first action of the sound domain, and what helps.
const PLACES: [(&str, &str, &str); 8] = [
    ("(on ?d ?p) (hand-free))", "(on ?d ?p), (hand-free))", "it is read as a blank"),
    ("?d - dish", "\"?d - dish", "it is read as a blank"),
    ("(on ?d ?p) (hand-free))", "(on ?d ?p) (!= ?d ?p) (hand-free))", "is written `(not (= ?d ?p))`"),
    ("(on ?d ?p) (hand-free))", "(on d ?p) (hand-free))", "did you mean `?d`?"),
    ("(on ?d ?p) (hand-free))", "[on ?d ?p] (hand-free))", "is written `(on …)`"),
    ("(on ?d ?p) (hand-free))", "(at start (on ?d ?p)) (hand-free))", "stands in a `:durative-action` alone"),
    ("?d - dish", "?d \u{2013} dish", "it is read as `-`; type one here"),
    ("(and (on ?d ?p)", "(and\u{a0}(on ?d ?p)", "it is read as a plain blank; type one here"),
];

#[test]
fn what_is_meant_is_offered() {
    let text = source("base-domain.pddl").text;
    let first = text.find("(:action").expect("an action");
    for (from, to, help) in PLACES {
        assert!(text[first..].contains(from), "{from}");
        let faulty = format!("{}{}", &text[..first], text[first..].replacen(from, to, 1));
        let found = check(&Source::new("domain", faulty), None);
        // One slip, one finding.
        let [finding] = &found.list[..] else { panic!("{from} {to}: {}", found.render(false)) };
        assert!(finding.help.as_deref().is_some_and(|said| said.contains(help)), "{from} {to}: {finding:?}");
    }
}

#[test]
fn one_misspelt_keyword_is_one_finding() {
    let [domain, problem] = ["base-domain.pddl", "base-problem.pddl"].map(|name| source(name).text);
    for (from, to) in [
        ("(define", "(defin"),
        ("define", "to-define"),
        ("(domain ", "(domian "),
        ("(problem ", "(probelm "),
        ("(:types", "(:tpyes"),
        ("(:types", "(:kinds"),
        ("(:predicates", "(:predicate"),
        ("(:predicates", "(predicates"),
        ("(:predicates", "(:facts"),
        ("(:action", "(:acton"),
        ("(:objects", "(:object"),
        ("(:objects", "(:things"),
        ("(:init", "(:int"),
        ("(:goal", "(:gaol"),
        ("(:goal", "(goal"),
        ("(:goal", "(:wanted"),
        ("(:domain", "(:doman"),
    ] {
        let faulty = |text: &str| text.replacen(from, to, 1);
        for (faulty_domain, faulty_problem) in
            [(faulty(&domain), problem.clone()), (domain.clone(), faulty(&problem))]
        {
            let expected = usize::from(faulty_domain != domain || faulty_problem != problem);
            let (one, other) = (Source::new("domain", faulty_domain), Source::new("problem", faulty_problem));
            let found = check(&one, Some(&other));
            assert_eq!(found.list.len(), expected, "{to}: {}", found.render(false));
        }
    }
}

#[test]
fn a_carriage_return_alone_ends_a_line() {
    let text = source("predicate-typo.pddl").text.replace("(define", "; a comment\n(define");
    for line_end in ["\r", "\r\n"] {
        let found = check(&Source::new("domain", text.replace('\n', line_end)), None);
        let expected = check(&Source::new("domain", text.as_str()), None);
        let places = |findings: &descry_planner::Findings| -> Vec<(usize, usize)> {
            let labels = findings.list.iter().flat_map(|finding| &finding.labels);
            labels.map(|label| findings.place(label.span)).map(|(_, line, column)| (line, column)).collect()
        };
        assert_eq!(places(&found), places(&expected), "{line_end:?}");
        assert_eq!(found.render(false), expected.render(false), "{line_end:?}");
    }
}

/// A whole domain and what is found in it, as code, text and help.
fn check_domain(text: &str, expected: &[(&str, &str)]) {
    let found = check(&Source::new("domain", format!("(define (domain d) {text})")), None);
    let told: Vec<(&str, &str)> =
        found.list.iter().map(|finding| (finding.code, finding.message.as_str())).collect();
    assert_eq!(told, expected, "{text}\n{}", found.render(false));
}

#[test]
fn what_other_planners_refuse_is_told() {
    check_domain(
        "(:requirements :strips) (:types room, item - object) (:predicates (at ?r - room) (in ?i - item))
         (:action go :parameters (?r - room ?i - item) :precondition (in ?i) :effect (at ?r))",
        &[
            ("missing-requirement", "`:types` is used without its requirement"),
            ("odd-sign", "`,` is no sign of PDDL"),
        ],
    );
    check_domain(
        "(:requirements :durative-actions) (:predicates (free) (done))
         (:durative-action go :parameters () :duration (= ?duration 1) :precondition (at start (free)) :effect (at end (done)))",
        &[("odd-keyword", "a durative action has a `:condition`, not a `:precondition`")],
    );
}

#[test]
fn an_action_that_defeats_itself_is_told() {
    let action = |over_all: &str, start: &str| {
        format!(
            "(:requirements :durative-actions) (:predicates (free ?r) (at ?r))
             (:durative-action move :parameters (?r ?s) :duration (= ?duration 5)
               :condition (and {over_all} (at start (at ?r))) :effect (and {start} (at end (free ?r)) (at end (at ?s))))"
        )
    };
    let told = [(
        "self-defeating",
        "`move` can never be taken: its start takes away `free`, which it needs over all",
    )];
    check_domain(&action("(over all (free ?r))", "(at start (not (free ?r)))"), &told);
    check_domain(&action("(over all (free ?s))", "(at start (not (free ?r)))"), &[]);
    check_domain(&action("(over all (free ?r))", "(at start (not (free ?r))) (at start (free ?r))"), &[]);
    check_domain(&action("(at start (free ?r))", "(at start (not (free ?r)))"), &[]);
}

#[test]
fn what_bounds_itself_or_follows_from_rules_is_refused_with_a_mend() {
    let domain = |bound: &str| {
        let text = format!(
            "(define (domain d) (:requirements :durative-actions :duration-inequalities :derived-predicates
               :timed-initial-literals) (:predicates (open) (lit) (done)) (:derived (open) (lit))
               (:durative-action go :parameters () :duration {bound} :condition (at start (open)) :effect (at end (done))))"
        );
        Source::new("domain", text)
    };
    let problem = |given: &str| {
        let text = format!("(define (problem p) (:domain d) (:init {given}) (:goal (done)))");
        Source::new("problem", text)
    };
    for (bound, given, said, mend) in [
        ("(= ?duration 1)", "(at 3 (lit))", "", ""),
        (
            "(= ?duration 1)",
            "(at 3 (open))",
            "derived predicate `open` in a timed literal",
            "what its rules depend on",
        ),
        (
            "(= ?duration 1)",
            "(at 3 (not (open)))",
            "derived predicate `open` in a timed literal",
            "what its rules",
        ),
        ("(<= (* ?duration ?duration) 9)", "(lit)", "expected `?duration`", "stands alone on one side"),
        (
            "(<= ?duration (/ 9 ?duration))",
            "(lit)",
            "cannot depend on `?duration`",
            "bound it by other numbers",
        ),
    ] {
        let findings = check(&domain(bound), Some(&problem(given)));
        assert_eq!(findings.has_errors(), !said.is_empty(), "{findings}");
        let drawn = findings.render(false);
        assert!(drawn.contains(said) && drawn.contains(mend), "{drawn}");
    }
}
