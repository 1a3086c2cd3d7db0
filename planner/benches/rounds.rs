//! Benchmark of planning in the rounds of two recorded runs, from their PDDL texts and again with
//! one [`Problem`]: `cargo bench -p descry-planner --bench rounds`.
//!
//! Modules answer at once, with the same answers in every round, so only the planner is measured.

use descry_planner::{
    Answer, Attachment, Attachments, Call, CallError, Options, Outcome, Problem, Source, State, Task, plan,
};
use divan::Bencher;

const TABLETOP: (&str, [&str; 2]) = (
    include_str!("../../domains/tabletop/domain.pddl"),
    [include_str!("rounds/tabletop-1.pddl"), include_str!("rounds/tabletop-2.pddl")],
);
const HOME: (&str, [&str; 5]) = (
    include_str!("../../domains/home/domain.pddl"),
    [
        include_str!("rounds/home-1.pddl"),
        include_str!("rounds/home-2.pddl"),
        include_str!("rounds/home-3.pddl"),
        include_str!("rounds/home-4.pddl"),
        include_str!("rounds/home-5.pddl"),
    ],
);

fn main() {
    divan::main();
}

/// Module whose answers are the same in every state.
struct Geometry(fn(&[&str]) -> Answer);

impl Attachment for Geometry {
    fn evaluate(&self, call: &Call) -> Result<Answer, CallError> {
        let arguments: Vec<&str> = call.arguments.iter().map(|own| &**own).collect();
        Ok((self.0)(&arguments))
    }
}

/// True if the pose (first argument) was sampled for the surface (last argument): its name begins
/// with the surface's.
fn belongs(arguments: &[&str]) -> bool {
    arguments[0].starts_with(arguments[arguments.len() - 1])
}

fn geometry() -> Attachments {
    let mut calls = Attachments::new();
    // As far as the letters of the names are apart.
    calls.insert(
        "path-cost",
        Geometry(|poses| {
            let sum = |name: &str| name.bytes().map(f64::from).sum::<f64>();
            Answer::Number(2.0 + (sum(poses[0]) - sum(poses[1])).abs() / 20.0)
        }),
    );
    for name in ["can-see", "can-grasp", "can-put"] {
        calls.insert(name, Geometry(|arguments| Answer::Truth(belongs(arguments))));
    }
    for name in ["worth-a-look", "worth-a-push"] {
        calls.insert(name, Geometry(|_| Answer::Truth(true)));
    }
    calls.insert("search-cost", Geometry(|_| Answer::Number(5.0)));
    for name in [
        "expected-gain",
        "expected-presence",
        "expected-placing",
        "expected-clarity",
        "expected-completeness",
    ] {
        calls.insert(name, Geometry(|_| Answer::Number(0.5)));
    }
    calls
}

fn read(domain: &Source, round: &str) -> Task {
    Task::read(domain, &Source::new("round", round)).unwrap_or_else(|findings| panic!("{findings}"))
}

fn solved(outcome: Result<Outcome, descry_planner::PlanError>) {
    assert!(matches!(outcome, Ok(Outcome::Solved { .. })), "{outcome:?}");
}

fn anew(bencher: Bencher, (domain, rounds): (&str, &[&str])) {
    let (domain, options) = (Source::new("domain", domain), Options::default());
    bencher.bench_local(|| {
        let calls = geometry();
        for round in rounds {
            solved(plan(&read(&domain, round), &calls, &options, &|| false, &mut |_| {}));
        }
    });
}

fn again(bencher: Bencher, (domain, rounds): (&str, &[&str])) {
    let (domain, options) = (Source::new("domain", domain), Options::default());
    let tasks: Vec<Task> = rounds.iter().map(|round| read(&domain, round)).collect();
    let states: Vec<State> = tasks.iter().map(State::initial).collect();
    let mut problem = Problem::new(tasks[0].clone());
    let calls = geometry();
    solved(problem.plan(&calls, &options, &|| false, &mut |_| {}));
    bencher.bench_local(|| {
        for state in &states {
            problem.set_state(state);
            solved(problem.plan(&calls, &options, &|| false, &mut |_| {}));
            assert_eq!(problem.regrounded(), None);
        }
    });
}

#[divan::bench]
fn tabletop_anew(bencher: Bencher) {
    anew(bencher, (TABLETOP.0, &TABLETOP.1));
}

#[divan::bench]
fn tabletop_again(bencher: Bencher) {
    again(bencher, (TABLETOP.0, &TABLETOP.1));
}

#[divan::bench(sample_count = 20)]
fn home_anew(bencher: Bencher) {
    anew(bencher, (HOME.0, &HOME.1));
}

#[divan::bench(sample_count = 20)]
fn home_again(bencher: Bencher) {
    again(bencher, (HOME.0, &HOME.1));
}
