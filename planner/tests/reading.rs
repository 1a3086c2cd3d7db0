//! Old habits of competition files, and files that nobody should write.

use std::path::{Path, PathBuf};

use descry_planner::{Severity, Source, Task, check};
use proptest::prelude::*;

const DOMAIN: &str = include_str!("data/habits-domain.pddl");
const PROBLEM: &str = include_str!("data/habits-problem.pddl");

#[test]
fn old_habits_are_read() {
    let (domain, problem) = (Source::new("domain", DOMAIN), Source::new("problem", PROBLEM));
    let findings = check(&domain, Some(&problem));
    assert!(findings.is_empty(), "{findings}");
    let task = Task::read(&domain, &problem).expect("it has no finding");
    let names: Vec<&str> = task.objects.iter().map(|object| object.name.as_str()).collect();
    assert_eq!(names, ["depot", "t1", "t2", "5", "/map"]);
    assert_eq!(task.types.len(), 5);
    assert_eq!(task.actions.len(), 3);
    assert_eq!(task.init.facts.len(), 3, "doubled facts are held once");
    assert_eq!(task.init.timed.len(), 2);
    assert_eq!(task.modules[0].function, "pathCost@libNav.so", "tokens of modules keep their case");
    assert_eq!(task.module_options[0].arguments, ["-Scene", "Table.xml"]);
}

/// Folder of the published tasks.
fn published() -> PathBuf {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../shared/pddl");
    assert!(path.is_dir(), "{} is not there", path.display());
    path
}

fn folders(path: &Path) -> Vec<PathBuf> {
    let mut all: Vec<PathBuf> = std::fs::read_dir(path)
        .map(|entries| entries.filter_map(|entry| entry.ok().map(|entry| entry.path())).collect())
        .unwrap_or_default();
    all.sort();
    all
}

/// Domain files that a problem file belongs to.
fn domains_of(problem: &Path, files: &[PathBuf]) -> Vec<PathBuf> {
    let stem =
        |path: &Path| path.file_stem().map(|stem| stem.to_string_lossy().into_owned()).unwrap_or_default();
    let own = format!("domain-{}", stem(problem));
    if let Some(own) = files.iter().find(|file| stem(file) == own) {
        return vec![own.clone()];
    }
    let belongs = |file: &&PathBuf| {
        let stem = stem(file);
        stem.starts_with("domain") && !["S", "M", "L"].iter().any(|size| stem == format!("domain-{size}"))
    };
    files.iter().filter(belongs).cloned().collect()
}

#[test]
#[ignore = "data: the published tasks of ../shared/pddl"]
fn published_tasks_have_no_false_finding() {
    let path = published();
    let load = |path: &Path| {
        Source::new(path.display().to_string(), std::fs::read_to_string(path).unwrap_or_default())
    };
    let mut count = 0;
    for folder in folders(&path).iter().filter(|path| path.is_dir()).flat_map(|path| folders(path)) {
        let files: Vec<PathBuf> = folders(&folder)
            .into_iter()
            .filter(|file| file.extension().is_some_and(|end| end == "pddl"))
            .collect();
        for problem in files.iter().filter(|file| !file.to_string_lossy().contains("domain")) {
            for domain in domains_of(problem, &files) {
                let (domain, problem) = (load(&domain), load(problem));
                assert!(Task::read(&domain, &problem).is_ok(), "{}", check(&domain, Some(&problem)));
                let findings = check(&domain, Some(&problem));
                // One set asks for facts that no action of its domain adds: that finding is true.
                let faults = findings.list.iter().filter(|finding| finding.severity == Severity::Error);
                for fault in faults {
                    assert!(
                        fault.code == "unreachable-goal" && folder.ends_with("AllenAlgebra"),
                        "{findings}"
                    );
                }
                count += 1;
            }
        }
    }
    assert!(count > 90, "only {count} tasks found");
}

/// A domain and problem with everything in it that the parser knows.
fn mutated() -> impl Strategy<Value = (String, String)> {
    let edit = prop_oneof![
        any::<prop::sample::Index>().prop_map(|at| (at, None)),
        (any::<prop::sample::Index>(), "[()\\[\\]?;:# a-z\\-=<0-9.é]{0,6}")
            .prop_map(|(at, text)| (at, Some(text))),
    ];
    (prop::collection::vec(edit, 1..6), any::<bool>()).prop_map(|(edits, first)| {
        let mut texts = [DOMAIN.to_string(), PROBLEM.to_string()];
        let text = &mut texts[usize::from(!first)];
        for (at, insert) in edits {
            let mut at = at.index(text.len().max(1)).min(text.len());
            while !text.is_char_boundary(at) {
                at -= 1;
            }
            match insert {
                Some(insert) => text.insert_str(at, &insert),
                None if at < text.len() => {
                    text.remove(at);
                }
                None => {}
            }
        }
        let [domain, problem] = texts;
        (domain, problem)
    })
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 400, ..ProptestConfig::default() })]

    #[test]
    fn no_mutation_makes_the_reader_panic((domain, problem) in mutated()) {
        let findings = check(&Source::new("d", domain), Some(&Source::new("p", problem)));
        let drawn = findings.render(false);
        prop_assert_eq!(drawn.is_empty(), findings.is_empty());
    }

    #[test]
    fn no_text_makes_the_reader_panic(text in "[()\\[\\]?;: a-z\\-=\\n\\t0-9.é#@]{0,200}") {
        let _ = check(&Source::new("d", text.clone()), Some(&Source::new("p", text))).render(false);
    }
}

#[test]
fn deep_nesting_is_a_finding_and_no_overflow() {
    for (open, close) in [("(and ", ")"), ("(not ", ")"), ("(forall (?x) ", ")"), ("(", ")"), ("[", "]")] {
        let deep = format!("{}(p){}", open.repeat(100_000), close.repeat(100_000));
        let text =
            format!("(define (domain d) (:predicates (p)) (:action a :precondition {deep} :effect {deep}))");
        let findings = check(&Source::new("deep", text), None);
        assert!(findings.list.iter().any(|finding| finding.code == "too-deep"), "{open}");
    }
}

#[test]
fn what_is_nested_too_deep_is_reported_as_that_alone() {
    for deep in [200, 300, 5_000] {
        let formula = format!("{}(p){}", "(not ".repeat(deep), ")".repeat(deep));
        let text = format!(
            "(define (domain d) (:requirements :adl) (:predicates (p)) (:action a :precondition {formula} :effect (p)))"
        );
        let findings = check(&Source::new("deep", text), None);
        let codes: Vec<&str> = findings.list.iter().map(|finding| finding.code).collect();
        assert_eq!(codes, ["too-deep"], "{deep}");
    }
}

#[test]
fn words_of_old_module_domains_are_read() {
    let domain = "(define (domain d) (:requirements :modules :fluents :object-fluents :durative-actions)
      (:oplinit setUp@libRobot.so (more@libRobot.so -scene Table.xml))
      (:types pose - object) (:predicates (change ?p ?q - pose) (there)) (:functions (at) - pose (level))
      (:durative-action go :parameters (?p ?q - pose) :duration (= ?duration 1) :condition (at start (= (at) ?p))
        :effect (and (at end (change (at) ?q)) (at end (change (level) 2)) (at end (change ?p ?q))
                     (at end (there)))))";
    let problem = "(define (problem p) (:domain d) (:objects a b - pose)
      (:init (= (at) a) (= (level) 0) (at 5 (= (level) 7)) (at 6 (= (at) b))) (:goal (there)))";
    let (domain, problem) = (Source::new("domain", domain), Source::new("problem", problem));
    let task = Task::read(&domain, &problem).unwrap_or_else(|findings| panic!("{findings}"));
    let options: Vec<&str> = task.module_options.iter().map(|option| option.function.as_str()).collect();
    assert_eq!(options, ["setUp@libRobot.so", "more@libRobot.so"]);
    assert_eq!(task.module_options[1].arguments, ["-scene", "Table.xml"]);
    assert_eq!((task.actions[0].effects.end.len(), task.init.timed.len()), (4, 2));
}

#[test]
fn nesting_as_deep_as_allowed_is_read() {
    let deep = format!("{}(p){}", "(or (p) ".repeat(190), ")".repeat(190));
    let text = format!(
        "(define (domain d) (:requirements :adl) (:predicates (p)) (:action a :precondition {deep} :effect (not (p))))"
    );
    let findings = check(&Source::new("deep", text), None);
    assert!(findings.is_empty(), "{findings}");
}
