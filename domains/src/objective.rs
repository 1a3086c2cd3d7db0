//! Goal and its subjects.

use crate::config::Answers;

/// Placeholder of a variable among the objects of a word.
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
    /// Subjects of the condition.
    pub asked: Asked,
    /// Values of the slots.
    pub slots: Vec<Filled>,
    /// True for a yes-no question.
    pub question: bool,
    /// Answers of the phrase.
    pub answer: Answers,
    /// Confidence that ends the search, 0 to 1.
    pub threshold: f64,
    /// Deadline, seconds on the body's clock.
    pub deadline_s: Option<f64>,
}

/// Slot of a phrase with its value.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Filled {
    /// Slot as written in the phrase: `thing`, or `first:thing`.
    pub slot: String,
    /// Index among slots of the same name, from 0.
    pub number: usize,
    /// The PDDL symbol.
    pub symbol: String,
    /// The usual name.
    pub name: String,
}

/// Objects that a goal's condition speaks of.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Asked {
    /// Requested things, each with the surfaces or rooms it is asked about; `None`: anywhere.
    pub things: Vec<(String, Option<Vec<String>>)>,
    /// Kinds requested completely, each with its rooms; `None`: anywhere.
    pub kinds: Vec<(String, Option<Vec<String>>)>,
    /// Surfaces whose objects are requested.
    pub surfaces: Vec<String>,
    /// True if the condition wants a fact about seen objects to be false, or a certainty to be
    /// small.
    pub denies: bool,
    /// True if the goal needs more than looking.
    pub more: bool,
    /// True if the condition is a single word that must hold or reach a number.
    pub plain: bool,
    /// Words of the condition with their objects, in order, including those behind derived words;
    /// variables are [`VARIABLE`].
    pub words: Vec<(String, Vec<String>)>,
}

impl Asked {
    /// Objects of each occurrence of a word in the condition.
    pub fn of_word<'a>(&'a self, word: &'a str) -> impl Iterator<Item = &'a [String]> {
        self.words.iter().filter(move |(name, _)| name == word).map(|(_, objects)| objects.as_slice())
    }
}
