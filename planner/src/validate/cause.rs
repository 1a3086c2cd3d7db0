//! Causes of an invalid plan, with the deciding values.

use serde::{Deserialize, Serialize};

use crate::diagnostic::Diagnostic;
use crate::semantics::{Compared, Why};

/// The cause of a plan's failure.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case", tag = "kind")]
pub enum Cause {
    /// The goal does not hold after the last step.
    Goal(Unmet),
    /// A condition of a step does not hold when required.
    Condition {
        /// Required time.
        when: Moment,
        /// The part that does not hold.
        #[serde(flatten)]
        unmet: Unmet,
    },
    /// The duration of a step violates its action's bounds.
    Duration {
        /// Duration in the plan, seconds.
        planned_s: f64,
        /// Duration that the action asks for, seconds.
        asked_s: f64,
    },
    /// Other cause, in one sentence.
    Other {
        /// The sentence, about the step at fault.
        reason: String,
    },
}

/// Time at which a condition of a step must hold.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Moment {
    /// Before an instantaneous action.
    Before,
    /// At the start of a durative action.
    Start,
    /// Between start and end of a durative action.
    OverAll,
    /// At the end of a durative action.
    End,
}

/// Part of a condition that does not hold.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub struct Unmet {
    /// Condition part in PDDL, with objects for its variables.
    pub condition: String,
    /// Both sides, if the part compares two numbers.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub compared: Option<Compared>,
    /// Values that the part depends on, by expression.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub values: Vec<(String, String)>,
}

impl Unmet {
    pub(super) fn of(why: &Why) -> Self {
        Unmet { condition: why.condition.clone(), compared: why.compared.clone(), values: why.values.clone() }
    }
}

impl Moment {
    /// The moment in words, behind "does not hold".
    pub(super) fn words(self) -> &'static str {
        match self {
            Moment::Before => "before it",
            Moment::Start => "at its start",
            Moment::OverAll => "all the time",
            Moment::End => "at its end",
        }
    }
}

/// Reason a replay stopped.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Fault {
    pub reason: String,
    pub step: Option<usize>,
    pub cause: Cause,
    pub finding: Diagnostic,
}
