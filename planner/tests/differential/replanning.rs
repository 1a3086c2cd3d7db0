//! Problems that are planned for again from other states, beside planning anew.

use descry_planner::{Attachments, Options, Outcome, Problem, Source, State, Task, plan, validate};

use super::MOST_EVALUATED;
use super::generate::{self, Chance, Kind};

/// Counts of the results.
#[derive(Debug, Default)]
struct Tally {
    solved: u64,
    unsolvable: u64,
    undecided: u64,
    /// Rounds that were planned for without grounding anew.
    reused: u64,
}

/// Makes some facts of the state otherwise, and gives some numbers other values.
fn changed(task: &Task, chance: &mut Chance) -> State {
    let mut state = State::initial(task);
    for _ in 0..chance.below(3) {
        let predicates: Vec<_> = (0..).map(descry_planner::task::PredicateId).zip(&task.predicates).collect();
        let basic: Vec<_> = predicates.into_iter().filter(|(_, own)| own.stratum.is_none()).collect();
        let (id, own) = basic[chance.below(basic.len())];
        let objects: Option<Vec<_>> = own
            .parameters
            .iter()
            .map(|parameter| match parameter.objects.len() {
                0 => None,
                count => Some(parameter.objects[chance.below(count)]),
            })
            .collect();
        if let Some(objects) = objects {
            let holds = state.holds(id, &objects);
            state.set_fact(id, &objects, !holds);
        }
    }
    for (fluent, value) in &task.init.numbers {
        if chance.percent(20) {
            state.set_number(fluent.function, &fluent.arguments, Some(value + 1.0));
        }
    }
    state
}

fn check(seed: u64, tally: &mut Tally) {
    let mut chance = Chance(seed);
    let kind = chance.of(&[Kind::Classical, Kind::Numeric, Kind::Temporal, Kind::Mixed]);
    let made = generate::task(&mut chance, kind);
    let (domain, text) = (made.domain(), made.problem());
    let Ok(task) = Task::read(&Source::new("domain", &domain), &Source::new("problem", &text)) else {
        return;
    };
    let first = task.clone();
    // Half of the goals are one fact of the first state, made otherwise.
    let mut other = task.clone();
    if let Some(fact) = task.init.facts.first().filter(|_| seed.is_multiple_of(2)) {
        let terms = fact.arguments.iter().map(|&object| descry_planner::task::Term::Object(object)).collect();
        other.goal.body = descry_planner::task::Condition::Atom(descry_planner::task::Atom {
            predicate: fact.predicate,
            arguments: terms,
            span: task.goal_span,
        });
    }
    let mut problem = Problem::new(task);
    let options = Options { evaluation_limit: Some(MOST_EVALUATED), ..Options::default() };
    let calls = Attachments::new();
    for round in 0..4 {
        if round > 0 {
            problem.set_state(&changed(&first, &mut chance));
        }
        if round == 2 {
            problem.set_goal(other.goal.body.clone());
        }
        let told = |outcome: &Outcome| format!("{seed} round {round}: {outcome:?}\n{domain}\n{text}");
        let again = problem.plan(&calls, &options, &|| false, &mut |_| {});
        let anew = plan(problem.task(), &calls, &options, &|| false, &mut |_| {});
        let (Ok(again), Ok(anew)) = (again, anew) else { panic!("{seed}") };
        tally.reused += u64::from(problem.regrounded().is_none());
        if let Some(plan) = again.plan() {
            assert!(validate(problem.task(), &calls, plan).valid, "{}", told(&again));
        }
        match (&again, &anew) {
            (Outcome::Unsolvable { .. }, Outcome::Unsolvable { .. }) => tally.unsolvable += 1,
            (Outcome::Unsolvable { .. }, anew) => assert!(anew.plan().is_none(), "{}", told(anew)),
            (again, Outcome::Unsolvable { .. }) => assert!(again.plan().is_none(), "{}", told(again)),
            (again, _) if again.plan().is_some() => tally.solved += 1,
            _ => tally.undecided += 1,
        }
    }
}

#[test]
fn random_problems_are_planned_for_again_as_anew() {
    let mut tally = Tally::default();
    (0..25).for_each(|seed| check(seed, &mut tally));
    println!("{tally:?}");
    assert!(tally.reused > 5 && tally.solved > 20 && tally.unsolvable > 20, "{tally:?}");
}

#[test]
#[ignore = "long: ten thousand tasks: minutes"]
fn ten_thousand_random_problems_are_planned_for_again_as_anew() {
    let mut tally = Tally::default();
    super::seeds(1_000..11_000).for_each(|seed| check(seed, &mut tally));
    println!("{tally:?}");
}
