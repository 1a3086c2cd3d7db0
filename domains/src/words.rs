//! Values of remembered and fixed predicates and functions.

use std::collections::{BTreeMap, BTreeSet};

use descry_planner::task::Task;
use descry_planner::{FactValue, Reading, Source};
use serde::{Deserialize, Serialize};

use crate::load::Domain;
use crate::vocabulary::{Vocabulary, Word};

/// Instances of remembered and fixed predicates and functions that hold or have a value, by name.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub struct Words {
    held: BTreeMap<String, BTreeMap<Vec<String>, f64>>,
    /// Predicates and functions that `init` mentions.
    begun: BTreeSet<String>,
    /// Instances that this run has set or unset.
    told: BTreeSet<(String, Vec<String>)>,
}

/// Value of an atom that holds.
const HOLDS: f64 = 1.0;

impl Words {
    /// Initial values of the domain.
    ///
    /// # Errors
    ///
    /// The first line of `init` that cannot be used, with the reason.
    pub fn begin(domain: &Domain, is_sensed: &dyn Fn(&Word) -> bool) -> Result<Self, String> {
        let mut words = Self::default();
        for line in &domain.config.init {
            for (name, arguments, value) in read(line).map_err(|e| format!("init: \"{line}\": {e}"))? {
                match domain.vocabulary.word(&name) {
                    None => return Err(format!("init: \"{line}\": no word is called {name}")),
                    Some(word) if is_sensed(&word) => {
                        return Err(format!(
                            "init: \"{line}\": {name} is sensed; only what is remembered or fixed can be said to begin so"
                        ));
                    }
                    Some(_) => {
                        words.begun.insert(name.clone());
                        words.set(&name, arguments, value);
                    }
                }
            }
        }
        words.told.clear();
        Ok(words)
    }

    /// Sets a predicate or function for some arguments; `None` makes it false, or takes its value away.
    pub fn set(&mut self, name: &str, arguments: Vec<String>, value: Option<f64>) {
        self.told.insert((name.into(), arguments.clone()));
        let instances = self.held.entry(name.into()).or_default();
        match value {
            Some(value) => instances.insert(arguments, value),
            None => instances.remove(&arguments),
        };
    }

    /// Notes that an action has revealed an atom whose truth a program states.
    pub fn reveal(&mut self, name: &str, arguments: Vec<String>) {
        self.told.insert((name.into(), arguments));
    }

    /// Sets an atom, a negated atom or a value that is written in PDDL.
    ///
    /// # Errors
    ///
    /// The reason why the text cannot be read.
    pub fn say(&mut self, atom: &str) -> Result<(), String> {
        for (name, arguments, value) in read(atom)? {
            self.set(&name, arguments, value);
        }
        Ok(())
    }

    /// Removes all values of a predicate or function.
    pub fn forget(&mut self, name: &str) {
        self.held.remove(name);
    }

    /// True if `init` mentions a predicate or function, so that its other atoms are initially false.
    pub fn is_spoken_of(&self, name: &str) -> bool {
        self.begun.contains(name)
    }

    /// True if an action, a view or a failure of this run has decided whether an atom holds.
    pub fn is_told(&self, name: &str, arguments: &[String]) -> bool {
        self.told.contains(&(name.to_string(), arguments.to_vec()))
    }

    /// Arguments for which a predicate holds or a function has a value.
    pub fn instances(&self, name: &str) -> impl Iterator<Item = &[String]> {
        self.held.get(name).into_iter().flat_map(|i| i.keys().map(Vec::as_slice))
    }

    /// True if an atom holds.
    pub fn holds(&self, name: &str, arguments: &[String]) -> bool {
        self.held.get(name).is_some_and(|i| i.contains_key(arguments))
    }

    /// Applies the changes of actions, as the difference of readings before and after by the task's
    /// semantics. Changes stated by skills meanwhile stay, as do instances with objects outside the
    /// task.
    pub fn take_over(&mut self, before: &[Reading], after: &[Reading]) {
        for gone in before.iter().filter(|r| !after.contains(r)) {
            self.set(&gone.symbol, names(gone), None);
        }
        for reading in after.iter().filter(|r| !before.contains(r)) {
            let value = match &reading.value {
                FactValue::Truth(true) => HOLDS,
                FactValue::Number(value) => *value,
                _ => continue,
            };
            self.set(&reading.symbol, names(reading), Some(value));
        }
    }

    /// PDDL lines that state all values whose objects are known.
    pub fn lines(&self, vocabulary: &Vocabulary, is_known: impl Fn(&str) -> bool) -> Vec<String> {
        let mut lines = Vec::new();
        for (name, instances) in &self.held {
            let Some(word) = vocabulary.word(name) else { continue };
            for (arguments, value) in instances.iter().filter(|(a, _)| a.iter().all(|a| is_known(a))) {
                let atom = std::iter::once(name).chain(arguments).cloned().collect::<Vec<_>>().join(" ");
                lines.push(if word.is_number {
                    format!("(= ({atom}) {value})")
                } else {
                    format!("({atom})")
                });
            }
        }
        lines
    }
}

fn names(reading: &Reading) -> Vec<String> {
    reading.arguments.iter().map(ToString::to_string).collect()
}

/// Value of a predicate or function: name, arguments, value (`None`: false).
type Instance = (String, Vec<String>, Option<f64>);

/// Parses one atom, negated atom, or value: `(a b)`, `(not (a b))`, `(= (f a) 3)`.
pub fn read(text: &str) -> Result<Vec<Instance>, String> {
    let spaced = text.to_lowercase().replace('(', " ( ").replace(')', " ) ");
    let tokens: Vec<&str> = spaced.split_whitespace().collect();
    let expected =
        || "expected (word arguments), (not (word arguments)) or (= (word arguments) 3)".to_string();
    let atom = |tokens: &[&str]| -> Option<(String, Vec<String>)> {
        let [open, name, arguments @ .., close] = tokens else { return None };
        let plain = |t: &&str| !"()=".contains(*t) && !t.starts_with('?');
        (*open == "(" && *close == ")" && plain(name) && arguments.iter().all(plain))
            .then(|| (name.to_string(), arguments.iter().map(ToString::to_string).collect()))
    };
    let found = match tokens.as_slice() {
        ["(", "not", inner @ .., ")"] => atom(inner).map(|(n, a)| (n, a, None)),
        ["(", "=", inner @ .., value, ")"] => {
            let value = value.parse::<f64>().ok().filter(|v| v.is_finite());
            atom(inner).zip(value).map(|((n, a), v)| (n, a, Some(v)))
        }
        all => atom(all).map(|(n, a)| (n, a, Some(HOLDS))),
    };
    found.map(|instance| vec![instance]).ok_or_else(expected)
}

/// True if every name in a condition is in a problem's text or declared by the domain.
pub(crate) fn are_known(condition: &str, problem: &str, domain: &Domain) -> bool {
    let split = |c: char| c.is_whitespace() || "()".contains(c);
    let objects: BTreeSet<&str> = problem.split(split).collect();
    let vocabulary = &domain.vocabulary;
    let is_name = |t: &&str| t.starts_with(char::is_alphabetic);
    let is_known = |t: &str| {
        let operator = ["and", "or", "not", "forall", "exists", "imply", "either"].contains(&t);
        let declared = vocabulary.word(t).is_some() || vocabulary.has_type(t);
        operator || declared || objects.contains(t) || vocabulary.task.find_object(t).is_some()
    };
    condition.to_lowercase().split(split).filter(is_name).all(is_known)
}

/// Task of a round with another goal, for testing whether a condition holds now.
///
/// # Errors
/// What is wrong with the condition, drawn under it.
pub(crate) fn with_goal(
    domain: &Domain,
    problem: &Source,
    goal: &str,
    condition: &str,
) -> Result<Task, String> {
    let text = problem.text.replacen(&format!("(:goal {goal})"), &format!("(:goal {condition})"), 1);
    Task::read(&domain.pddl, &Source::new(problem.name.clone(), text)).map_err(|f| f.render(false))
}
