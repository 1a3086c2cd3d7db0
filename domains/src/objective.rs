//! Goal of a run, and the objects that it asks about.

use crate::config::Answers;

/// Placeholder for a variable among the objects of a predicate or function.
pub const VARIABLE: &str = "?";

/// Goal as given by a person, with its PDDL meaning.
#[derive(Debug, Clone, PartialEq)]
pub struct Goal {
    /// Words as given.
    pub said: String,
    /// Matched phrase of `domain.toml`.
    pub phrase: String,
    /// Goal condition in PDDL.
    pub pddl: String,
    /// Objects that the condition asks about.
    pub asked: Asked,
    /// Slots of the phrase with their values.
    pub slots: Vec<Filled>,
    /// True for a yes-no question.
    pub question: bool,
    /// Answers of the phrase.
    pub answer: Answers,
    /// Confidence that ends the search, 0 to 1.
    pub threshold: f64,
    /// Time from the start of the run to the deadline, seconds on the body's clock; `None` without a
    /// deadline.
    pub deadline_s: Option<f64>,
}

/// Slot of a phrase with its value.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Filled {
    /// Slot as written in the phrase: `thing`, or `first:thing`.
    pub slot: String,
    /// Index among slots of the same name, from 0.
    pub number: usize,
    /// PDDL symbol of the value.
    pub symbol: String,
    /// Usual spoken name of the value.
    pub name: String,
}

/// Objects that a goal's condition speaks of.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Asked {
    /// Requested things, each with the surfaces or rooms that the goal restricts it to; `None`:
    /// anywhere.
    pub things: Vec<(String, Option<Vec<String>>)>,
    /// Kinds requested completely, each with its rooms; `None`: anywhere.
    pub kinds: Vec<(String, Option<Vec<String>>)>,
    /// Surfaces whose objects are requested.
    pub surfaces: Vec<String>,
    /// True if the condition wants a fact about seen objects to be false, or a certainty to be
    /// small.
    pub denies: bool,
    /// Surfaces that the condition wants every thing off; [`VARIABLE`]: any.
    pub clears: Vec<String>,
    /// True if the condition has a fact that looking cannot establish.
    pub more: bool,
    /// True if the condition is a single predicate that must hold, or a single function that must reach
    /// a number.
    pub plain: bool,
    /// Predicates and functions of the condition with their objects, in order, including those in rules
    /// of derived predicates; variables are [`VARIABLE`].
    pub words: Vec<(String, Vec<String>)>,
}

impl Asked {
    /// Objects of each occurrence of a predicate or function in the condition.
    pub fn of_word<'a>(&'a self, word: &'a str) -> impl Iterator<Item = &'a [String]> {
        self.words.iter().filter(move |(name, _)| name == word).map(|(_, objects)| objects.as_slice())
    }
}
