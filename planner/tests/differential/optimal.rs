//! Optimal plans beside uniform-cost search over everything that can be reached.

use descry_planner::{Attachments, Options, Outcome, Source, Task, plan_optimally, validate};

use super::exhaust::Cheapest;
use super::generate::{self, Chance, Kind};
use super::oracle::Oracle;
use super::task::{Change, Effect, Named, Number};
use super::{MOST_EVALUATED, MOST_STATES, task};

/// Counts of the results.
#[derive(Debug, Default)]
struct Tally {
    optimal: u64,
    unsolvable: u64,
    undecided: u64,
}

/// Gives every action a price in halves, some of them none.
fn priced(task: &mut task::Task, chance: &mut Chance) {
    let total = Named { index: task.functions.len(), terms: Vec::new() };
    task.numbers.push((total.index, Vec::new(), 0.0));
    task.functions.push(Vec::new());
    task.metric = Some(Number::Fluent(total.clone()));
    for action in &mut task.actions {
        let price = Number::Constant(chance.below(6) as f64 / 2.0);
        let change = Change::Number("increase", total.clone(), price);
        action.effects.push(Effect { forall: None, when: [const { None }; 3], at_end: false, change });
    }
}

fn check(seed: u64, tally: &mut Tally) {
    let mut chance = Chance(seed);
    let kind = chance.of(&[Kind::Classical, Kind::Classical, Kind::Numeric]);
    let mut made = generate::task(&mut chance, kind);
    made.metric = None;
    if kind == Kind::Classical && chance.percent(70) {
        priced(&mut made, &mut chance);
    }
    let (domain, problem) = (made.domain(), made.problem());
    let read = Task::read(&Source::new("domain", &domain), &Source::new("problem", &problem));
    let read = read.unwrap_or_else(|findings| panic!("{seed}: {findings}"));
    let options = Options { evaluation_limit: Some(MOST_EVALUATED), ..Options::default() };
    let mut bounds = Vec::new();
    let outcome =
        plan_optimally(&read, &Attachments::new(), &options, &|| false, &mut |bound| bounds.push(bound))
            .unwrap_or_else(|error| panic!("{seed}: {error}\n{domain}\n{problem}"));
    assert!(bounds.is_sorted(), "{seed}: {bounds:?}");
    let expected = Oracle::new(&made).cheapest(MOST_STATES);
    let told = format!("{seed}: {expected:?} {bounds:?} {outcome:?}\n{domain}\n{problem}");
    match (&outcome, expected) {
        (Outcome::Solved { plan, statistics }, Cheapest::Cost(cost)) => {
            assert!(statistics.optimal && statistics.lower_bound == plan.cost, "{told}");
            assert!(validate(&read, &Attachments::new(), plan).valid, "{told}");
            assert_eq!(plan.cost, Some(cost), "{told}");
            tally.optimal += 1;
        }
        (Outcome::Unsolvable { .. }, Cheapest::Nothing) => tally.unsolvable += 1,
        (Outcome::OutOfTime { best: None, statistics }, Cheapest::Cost(cost)) => {
            assert!(statistics.lower_bound.is_some_and(|bound| bound <= cost), "{told}");
            tally.undecided += 1;
        }
        (_, Cheapest::Unknown) | (Outcome::OutOfTime { .. }, Cheapest::Nothing) => tally.undecided += 1,
        _ => panic!("{told}"),
    }
}

/// Tasks that showed a fault once.
const FOUND: [u64; 1] = [4433];

fn check_all(seeds: impl Iterator<Item = u64>) -> Tally {
    let mut tally = Tally::default();
    seeds.for_each(|seed| check(seed, &mut tally));
    println!("{tally:?}");
    tally
}

#[test]
fn random_tasks_are_planned_optimally() {
    let tally = check_all((0..400).chain(FOUND));
    assert!(tally.optimal > 150 && tally.unsolvable > 100, "{tally:?}");
}

#[test]
#[ignore = "long: thirty thousand tasks: minutes"]
fn thirty_thousand_random_tasks_are_planned_optimally() {
    let tally = check_all(1_000..31_000);
    assert!(3 * tally.optimal > 30_000, "{tally:?}");
}
