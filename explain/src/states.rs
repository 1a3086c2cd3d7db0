//! Initial states of a run's planning problems, and differences between them.

use std::collections::{BTreeMap, BTreeSet};

use descry_domains::saying::Saying;
use descry_memory::{Query, Record, RecordId};

use super::wording::{listed, share};
use descry_agent::exit::CommandError;

/// Maximum number of changed numbers listed by name; the rest are counted.
const MOST_NAMED: usize = 4;
/// Maximum number of changed facts listed by name; the rest are counted. A changed surface has one fact for
/// each view of it.
const MOST_FACTS: usize = 8;
/// Difference up to which two numbers count as equal.
const SAME: f64 = 5e-3;

/// Initial state of a planning problem.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct State {
    pub facts: BTreeSet<String>,
    numbers: BTreeMap<String, f64>,
    /// Time until the first timed initial literal, seconds; `None` without one.
    pub comes_s: Option<f64>,
}

impl State {
    /// Parses the `:init` section of a PDDL problem.
    pub fn read(pddl: &str) -> Self {
        let mut state = State::default();
        let Some((_, init)) = pddl.split_once("(:init") else { return state };
        let (mut depth, mut from) = (0_usize, 0);
        for (at, sign) in init.char_indices() {
            match sign {
                '(' if depth == 0 => (from, depth) = (at, 1),
                '(' => depth += 1,
                ')' if depth == 0 => break,
                ')' => {
                    depth -= 1;
                    if depth == 0 {
                        state.take(&init[from..=at]);
                    }
                }
                _ => {}
            }
        }
        state
    }

    fn take(&mut self, stated: &str) {
        let timed = stated.strip_prefix("(at ").and_then(|rest| rest.split_once(" ("));
        if let Some(at_s) = timed.and_then(|(at, _)| at.trim().parse::<f64>().ok()) {
            self.comes_s = Some(self.comes_s.map_or(at_s, |first| first.min(at_s)));
            return;
        }
        let number = stated.strip_prefix("(= (").and_then(|rest| rest.split_once(')'));
        match number.and_then(|(name, value)| Some((name, value.trim_end_matches(')').trim().parse().ok()?)))
        {
            Some((name, value)) => drop(self.numbers.insert(format!("({name})"), value)),
            None => drop(self.facts.insert(stated.to_string())),
        }
    }
}

/// Difference between two states: facts that became true or false, and numbers with their earlier
/// and later value.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Difference {
    came: Vec<String>,
    went: Vec<String>,
    numbers: Vec<(String, f64, f64)>,
}

impl Difference {
    pub fn between(before: &State, after: &State) -> Self {
        let number = |(name, now): (&String, &f64)| {
            let was = before.numbers.get(name)?;
            ((now - was).abs() > SAME).then(|| (name.clone(), *was, *now))
        };
        let mut numbers: Vec<_> = after.numbers.iter().filter_map(number).collect();
        numbers.sort_by(|a, b| (b.2 - b.1).abs().total_cmp(&(a.2 - a.1).abs()));
        let only = |a: &State, b: &State| a.facts.difference(&b.facts).cloned().collect();
        Difference { came: only(after, before), went: only(before, after), numbers }
    }

    /// True if there is no difference.
    pub fn is_empty(&self) -> bool {
        self.came.is_empty() && self.went.is_empty() && self.numbers.is_empty()
    }

    /// Difference as a clause.
    pub fn told(&self, saying: &Saying) -> String {
        let facts =
            |all: &[String]| listed(&all.iter().map(|fact| saying.say(fact)).collect::<Vec<_>>(), MOST_FACTS);
        let number = |(name, was, now): &(String, f64, f64)| {
            format!("{} is {} instead of {}", saying.say(name), share(*now), share(*was))
        };
        let numbers: Vec<String> = self.numbers.iter().map(number).collect();
        let came = (!self.came.is_empty()).then(|| facts(&self.came));
        let went = (!self.went.is_empty()).then(|| format!("no longer: {}", facts(&self.went)));
        let numbers = (!numbers.is_empty()).then(|| listed(&numbers, MOST_NAMED));
        let all: Vec<String> = [came, went, numbers].into_iter().flatten().collect();
        all.join("; ")
    }
}

/// Initial states of a run's planning problems in order, with their record IDs.
#[derive(Debug)]
pub struct States(Vec<(RecordId, State)>);

impl States {
    /// Reads the states from a record, as far as it has them.
    ///
    /// # Errors
    /// [`CommandError::Broken`] if the record cannot be read.
    pub fn of(record: &Record) -> Result<Self, CommandError> {
        let (problems, _) = record.find_whole(&Query::of_kind("problem")).map_err(CommandError::broken)?;
        let of = |d: &descry_memory::Document| Some((d.id, State::read(d.body["pddl"].as_str()?)));
        Ok(States(problems.iter().filter_map(of).collect()))
    }

    /// Numbers in the last planning problem recorded before a document; `None` if there is none.
    pub fn numbers(&self, id: RecordId) -> Option<&BTreeMap<String, f64>> {
        self.0.iter().rev().find(|(round, _)| *round < id).map(|(_, state)| &state.numbers)
    }

    /// Time until the first timed initial literal, such as a deadline, in the first planning
    /// problem, seconds; `None` without one.
    pub fn given_s(&self) -> Option<f64> {
        self.0.first()?.1.comes_s
    }

    /// Time until the first timed initial literal, such as a deadline, in the last planning
    /// problem, seconds; 0 once it has passed, `None` if the run has none.
    pub fn left_s(&self) -> Option<f64> {
        let was_to_come = self.0.iter().any(|(_, state)| state.comes_s.is_some());
        was_to_come.then(|| self.0.last().and_then(|(_, state)| state.comes_s).unwrap_or(0.0))
    }

    /// Greatest number whose name begins with `begins`, in the last planning problem before a
    /// document; `None` if there is none.
    pub fn most(&self, id: RecordId, begins: &str) -> Option<(String, f64)> {
        let numbers = self.numbers(id)?.iter().filter(|(name, _)| name.starts_with(begins));
        let most = numbers.max_by(|a, b| a.1.total_cmp(b.1))?;
        Some((most.0.clone(), *most.1))
    }

    /// Difference between the planning problems before and after a document; `None` if one of them
    /// is missing.
    pub fn across(&self, id: RecordId) -> Option<Difference> {
        let next = self.0.iter().position(|(round, _)| *round > id)?;
        Some(Difference::between(&self.0[next.checked_sub(1)?].1, &self.0[next].1))
    }

    /// Difference between the first planning problem after a document and the last one; `None` if
    /// there is none after it.
    pub fn since(&self, id: RecordId) -> Option<Difference> {
        let next = self.0.iter().find(|(round, _)| *round > id)?;
        Some(Difference::between(&next.1, &self.0.last()?.1))
    }
}
