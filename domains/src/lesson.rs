//! Lessons from the failure of a step.

use descry_skills::Call;
use serde::{Deserialize, Serialize};

use crate::saying::Saying;

/// Lesson from the failure of a step.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case", tag = "kind")]
pub enum Lesson {
    /// Conclusion of an ability, in a sentence.
    Said {
        /// The sentence.
        text: String,
    },
    /// Facts that hold from then on, in PDDL.
    Facts {
        /// Facts in PDDL.
        facts: Vec<String>,
    },
    /// The step may be retried.
    Retry {
        /// Number of failed tries so far.
        tries: usize,
        /// Number of allowed tries in all.
        most: usize,
    },
    /// The step is given up, and these facts hold from then on.
    GivenUp {
        /// Facts in PDDL.
        facts: Vec<String>,
    },
}

impl Lesson {
    /// Lesson about a call as a sentence.
    pub fn told(&self, call: &Call, saying: &Saying) -> String {
        let said =
            |facts: &[String]| facts.iter().map(|fact| saying.say(fact)).collect::<Vec<_>>().join(", ");
        match self {
            Lesson::Said { text } => text.clone(),
            Lesson::Facts { facts } => said(facts),
            Lesson::Retry { tries, most } => format!("try {tries} of {most}"),
            Lesson::GivenUp { facts } => {
                let call = saying.say(&call.to_string());
                match facts.is_empty() {
                    true => format!("{call} is given up"),
                    false => format!("{call} is given up: {}", said(facts)),
                }
            }
        }
    }
}
