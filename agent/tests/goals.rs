//! Random goals over the words of a built-in domain, asked and pursued in a small simulated room:
//! no answer without a look at the subject of the goal, and no more false answers than the
//! confidence allows.

use descry_agent::body;
use descry_agent::keeping::Keeping;
use descry_agent::run::{self, Folder, Settings, Task, Watcher};
use descry_agent::stop::Stop;
use descry_domains::abilities::searching::policies;
use descry_domains::conclusion::Verdict;
use descry_domains::config::GoalPhrase;
use descry_domains::load::Domain;
use descry_domains::vocabulary::Vocabulary;
use descry_planner::Source;
use descry_robots::truth::Truth;

/// Objects with their kinds and their shapes in a scene.
const THINGS: [(&str, &str, &str); 3] = [
    ("cup-a", "cup", "name = \"cup A\"\nshape.cup = { diameter_m = 0.070, height_m = 0.104 }"),
    ("mug", "mug", "name = \"mug\"\nshape.mug = { diameter_m = 0.080, height_m = 0.095 }"),
    (
        "white-cylinder",
        "cylinder",
        "name = \"white cylinder\"\nkind = \"cylinder\"\nshape.cylinder = { diameter_m = 0.106, height_m = 0.277 }",
    ),
];
const SURFACES: [&str; 2] = ["desk", "counter"];
const ROOM: &str = "title = \"Two tables\"\ngap_m = 0.08\n[[room]]\nname = \"study\"\nsize_m = [6.0, 5.0]\n\
    [[surface]]\nname = \"desk\"\nposition_m = [-1.2, 0.0]\nsize_m = [1.1, 0.7]\nheight_m = 0.72\n\
    [[surface]]\nname = \"counter\"\nposition_m = [1.4, 0.0]\nsize_m = [1.1, 0.7]\nheight_m = 0.80\n\
    [start]\nposition_m = [0.0, -1.9]\nyaw_deg = 90.0\n";
const DERIVED: &str = "(:derived (absent ?w - thing ?o - surface) (not (on ?w ?o)))\n\
    (:derived (somewhere ?w - thing) (exists (?o - surface) (on ?w ?o)))\n(:durative-action move";

/// Draws numbers (splitmix64).
struct Draws(u64);

impl Draws {
    fn below(&mut self, n: usize) -> usize {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        ((z ^ (z >> 31)) % n as u64) as usize
    }
}

/// A condition that the truth of a scene decides.
enum Goal {
    /// An object stands on a surface, in one of several wordings.
    On {
        thing: usize,
        on: usize,
        wording: usize,
    },
    /// The object stands on neither surface, or anywhere.
    Nowhere {
        thing: usize,
        wording: usize,
    },
    Somewhere {
        thing: usize,
        wording: usize,
    },
    /// True if any of a kind, or anything, stands on a surface.
    Any {
        kind: Option<usize>,
        on: usize,
    },
    /// Each of a kind stands on a surface.
    Each {
        kind: usize,
        on: usize,
    },
    Not(Box<Goal>),
    And(Box<[Goal; 2]>),
    Or(Box<[Goal; 2]>),
}

impl Goal {
    fn drawn(draws: &mut Draws, depth: usize) -> Goal {
        let (thing, on) = (draws.below(THINGS.len()), draws.below(SURFACES.len()));
        match draws.below(if depth == 0 { 6 } else { 10 }) {
            0 | 1 => Goal::On { thing, on, wording: draws.below(5) },
            2 => Goal::Nowhere { thing, wording: draws.below(4) },
            3 => Goal::Somewhere { thing, wording: draws.below(3) },
            4 => Goal::Any { kind: [Some(thing), None][draws.below(2)], on },
            5 => Goal::Each { kind: thing, on },
            6 | 7 => Goal::Not(Box::new(Goal::drawn(draws, depth - 1))),
            8 => Goal::And(Box::new([Goal::drawn(draws, depth - 1), Goal::drawn(draws, depth - 1)])),
            _ => Goal::Or(Box::new([Goal::drawn(draws, depth - 1), Goal::drawn(draws, depth - 1)])),
        }
    }

    fn pddl(&self) -> String {
        match self {
            Goal::On { thing, on, wording } => {
                let (thing, on) = (THINGS[*thing].0, SURFACES[*on]);
                match wording {
                    0 => format!("(on {thing} {on})"),
                    1 => format!("(>= (presence {thing} {on}) 0.8)"),
                    2 => format!("(not (absent {thing} {on}))"),
                    3 => format!("(>= (+ (presence {thing} {on}) 0.1) 0.9)"),
                    _ => format!("(not (< (presence {thing} {on}) 0.8))"),
                }
            }
            Goal::Nowhere { thing, wording } => {
                let thing = THINGS[*thing].0;
                match wording {
                    0 => format!("(forall (?s - surface) (absent {thing} ?s))"),
                    1 => format!("(not (exists (?s - surface) (on {thing} ?s)))"),
                    2 => format!("(forall (?s - surface) (= (presence {thing} ?s) 0))"),
                    _ => format!("(<= (+ (presence {thing} desk) (presence {thing} counter)) 0.1)"),
                }
            }
            Goal::Somewhere { thing, wording } => {
                let thing = THINGS[*thing].0;
                match wording {
                    0 => format!("(somewhere {thing})"),
                    1 => format!("(exists (?s - surface) (>= (presence {thing} ?s) 0.8))"),
                    _ => format!("(not (forall (?s - surface) (absent {thing} ?s)))"),
                }
            }
            Goal::Any { kind: Some(kind), on } => {
                let (kind, on) = (THINGS[*kind].1, SURFACES[*on]);
                format!("(exists (?t - thing) (and (is ?t {kind}) (on ?t {on})))")
            }
            Goal::Any { kind: None, on } => format!("(exists (?t - thing) (on ?t {}))", SURFACES[*on]),
            Goal::Each { kind, on } => {
                let (kind, on) = (THINGS[*kind].1, SURFACES[*on]);
                format!("(forall (?t - thing) (imply (is ?t {kind}) (on ?t {on})))")
            }
            Goal::Not(goal) => format!("(not {})", goal.pddl()),
            Goal::And(goals) => format!("(and {} {})", goals[0].pddl(), goals[1].pddl()),
            Goal::Or(goals) => format!("(or {} {})", goals[0].pddl(), goals[1].pddl()),
        }
    }

    fn is_true(&self, truth: &Truth) -> bool {
        let stands = |kind: &str, on: Option<usize>| {
            let mut there = truth.objects.iter().filter(|o| o.present && o.surface.is_some());
            there.any(|o| {
                (kind.is_empty() || kind_of(&o.kind) == kind)
                    && on.is_none_or(|on| o.surface.as_deref() == Some(SURFACES[on]))
            })
        };
        match self {
            Goal::On { thing, on, .. } => stands(THINGS[*thing].1, Some(*on)),
            Goal::Nowhere { thing, .. } => !stands(THINGS[*thing].1, None),
            Goal::Somewhere { thing, .. } => stands(THINGS[*thing].1, None),
            Goal::Any { kind, on } => stands(kind.map_or("", |kind| THINGS[kind].1), Some(*on)),
            Goal::Each { kind, on } => {
                let mut of_kind =
                    truth.objects.iter().filter(|o| o.present && kind_of(&o.kind) == THINGS[*kind].1);
                of_kind.all(|o| o.surface.as_deref() == Some(SURFACES[*on]))
            }
            Goal::Not(goal) => !goal.is_true(truth),
            Goal::And(goals) => goals.iter().all(|goal| goal.is_true(truth)),
            Goal::Or(goals) => goals.iter().any(|goal| goal.is_true(truth)),
        }
    }
}

/// Kind of a true object; an object with a name of its own has this name as kind.
fn kind_of(kind: &str) -> &str {
    if kind == "cup A" { "cup" } else { kind }
}

/// Domain with derived words and one phrase, and a room with some of the objects.
fn home(goal: &Goal, is_question: bool, draws: &mut Draws) -> Domain {
    let mut domain = Domain::load("home").expect("a built-in domain");
    let text = domain.pddl.text.replacen("(:durative-action move", DERIVED, 1);
    let text = text.replacen(
        "(:predicates",
        "(:predicates (absent ?w - thing ?o - surface) (somewhere ?w - thing)",
        1,
    );
    let text = text.replacen(":modules)", ":modules :derived-predicates)", 1);
    domain.pddl = Source::new("domain.pddl", text);
    domain.vocabulary = Vocabulary::read(&domain.pddl).unwrap_or_else(|e| panic!("{e}"));
    domain.config.goal = vec![GoalPhrase {
        say: "check it".into(),
        also: Vec::new(),
        means: goal.pddl(),
        question: is_question,
        confidence: None,
        about: String::new(),
        answer: Default::default(),
    }];
    let mut room = ROOM.to_string();
    for (.., thing) in THINGS.iter().filter(|_| draws.below(4) > 0).collect::<Vec<_>>() {
        room += &format!("[[object]]\n{thing}\non = [\"desk\", \"counter\"]\n");
    }
    domain.scenes.insert("small".into(), room);
    domain
}

/// Result of pursuing a goal.
struct Fared {
    pddl: String,
    verdict: Verdict,
    views: usize,
    /// True if the goal held in the end.
    is_true: bool,
    why: String,
}

fn pursued(seed: u64, is_question: bool) -> Fared {
    let mut draws = Draws(seed);
    let goal = Goal::drawn(&mut draws, 2);
    let domain = home(&goal, is_question, &mut draws);
    let body = body::open("sim", Some("small"), seed, &domain).unwrap_or_else(|e| panic!("{seed}: {e}"));
    let understood = run::understood("check it", &domain, &*body.robot, None);
    let understood = understood.unwrap_or_else(|e| panic!("{seed}, {}: {e}", goal.pddl()));
    let settings = Settings {
        robot: "sim".into(),
        scene: Some("small".into()),
        seed,
        domain: "home".into(),
        policy: policies::PLAN.into(),
        keeping: Keeping::default(),
        remember: None,
    };
    let scratch = tempfile::TempDir::new().expect("a folder can be made");
    let folder = Folder::of_new_run(Some(&scratch.path().join("run")), &understood).expect("a run's folder");
    let watcher = Watcher { stop: &Stop::default(), tell: &mut |_| {} };
    let chooser = policies::named(policies::PLAN, seed, None).expect("the planner");
    let task = Task { domain: &domain, goal: &understood, past: None };
    let runtime = tokio::runtime::Builder::new_current_thread().enable_all().build().expect("a runtime");
    let report = runtime.block_on(run::pursue(task, &body, &folder, &settings, chooser, watcher));
    let report = report.unwrap_or_else(|e| panic!("{seed}, {}: {e}", goal.pddl()));
    let truth = body.truth().expect("the simulator's").expect("it knows");
    let is_true = goal.is_true(&truth);
    Fared { pddl: goal.pddl(), verdict: report.verdict, views: report.views, is_true, why: report.why }
}

/// Pursues goals by their seeds, each as a question or a task; returns the numbers of answers, of
/// wrong ones, and of undecided ones.
fn check(seeds: std::ops::Range<u64>) -> [usize; 3] {
    let [mut answered, mut wrong, mut open] = [0; 3];
    for seed in seeds {
        let is_question = seed % 2 == 0;
        let Fared { pddl, verdict, views, is_true, why } = pursued(seed, is_question);
        let told = format!(
            "{seed} {} {pddl}: {verdict:?}, in truth {is_true}: {why}",
            if is_question { "asks" } else { "does" }
        );
        let claims = match verdict {
            Verdict::Achieved => Some(true),
            Verdict::NotFound if is_question => Some(false),
            _ => None,
        };
        match claims {
            Some(claim) => {
                assert!(views > 0, "no look was taken: {told}");
                answered += 1;
                if claim != is_true {
                    wrong += 1;
                    println!("wrong: {told}");
                }
            }
            None => {
                open += 1;
                println!("open: {told}");
            }
        }
    }
    println!("answered {answered}, of which wrong {wrong}; not told {open}");
    [answered, wrong, open]
}

#[test]
fn random_goals_are_answered_by_looks_and_as_the_truth_says() {
    let [answered, wrong, _] = check(0..4);
    assert!(answered > 0 && wrong == 0, "{answered} answered, {wrong} wrong");
}

/// Requested confidence that allows one wrong answer in five; seeds by `GOALS=0..500`.
#[test]
#[ignore = "slow: 500 runs"]
fn five_hundred_random_goals_are_answered_by_looks_and_as_the_truth_says() {
    let range = std::env::var("GOALS").unwrap_or_else(|_| "0..500".into());
    let (from, to) = range.split_once("..").expect("FROM..TO");
    let [answered, wrong, _] = check(from.parse().expect("a seed")..to.parse().expect("a seed"));
    assert!(wrong * 5 <= answered, "{wrong} wrong of {answered}");
}
