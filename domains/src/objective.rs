//! A goal and its subjects.

use crate::config::Answers;

/// A goal that a person gave, with what it means in the planner's language.
#[derive(Debug, Clone, PartialEq)]
pub struct Goal {
    /// The words as they were given.
    pub said: String,
    /// The phrase of `domain.toml` that they matched.
    pub phrase: String,
    /// The goal condition in PDDL.
    pub pddl: String,
    /// Subjects of the condition.
    pub asked: Asked,
    /// Values of the slots.
    pub slots: Vec<Filled>,
    /// True if the answer is yes or no.
    pub question: bool,
    /// Answers of the phrase.
    pub answer: Answers,
    /// The confidence that ends the search, 0 to 1.
    pub threshold: f64,
    /// Seconds on the body's clock after which it must be over.
    pub deadline_s: Option<f64>,
}

/// A slot of a phrase and what fills it.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Filled {
    /// As it stands in the phrase: `thing`, or `first:thing`.
    pub slot: String,
    /// Index among several slots of the same name, from 0.
    pub number: usize,
    /// The PDDL symbol.
    pub symbol: String,
    /// The usual name.
    pub name: String,
}

/// The objects that a goal's condition speaks of.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Asked {
    /// Things that are looked for, each with the surfaces, or rooms, on which it is asked about; none: wherever it is.
    pub things: Vec<(String, Option<Vec<String>>)>,
    /// Kinds of which all are asked for, each with the rooms in which it is asked about; none: wherever they are.
    pub kinds: Vec<(String, Option<Vec<String>>)>,
    /// Surfaces of which it is asked what stands there.
    pub surfaces: Vec<String>,
    /// True if the condition wants something of seen objects to be false, or a certainty about them to be
    /// small.
    pub denies: bool,
    /// True if it asks for more than looking can tell.
    pub more: bool,
    /// Words of the condition with their objects, in its order; those behind derived words too. Variables are left as `?`.
    pub words: Vec<(String, Vec<String>)>,
}

impl Asked {
    /// The objects of a word, each time that the condition has it.
    pub fn of_word<'a>(&'a self, word: &'a str) -> impl Iterator<Item = &'a [String]> {
        self.words.iter().filter(move |(name, _)| name == word).map(|(_, objects)| objects.as_slice())
    }
}
