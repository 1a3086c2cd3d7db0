//! Causes for which a plan is invalid, with the values that decide them.

use serde::{Deserialize, Serialize};

use crate::diagnostic::Diagnostic;
use crate::semantics::{Compared, Why};

/// Cause of a plan's failure.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case", tag = "kind")]
pub enum Cause {
    /// The goal does not hold after the last step.
    Goal(Unmet),
    /// A condition of a step does not hold at the time required.
    Condition {
        /// Time at which the condition must hold.
        when: Moment,
        /// Part of the condition that does not hold.
        #[serde(flatten)]
        unmet: Unmet,
    },
    /// The duration of a step is outside its action's bounds.
    Duration {
        /// Duration in the plan, in seconds.
        planned_s: f64,
        /// Value of the violated bound, in seconds.
        asked_s: f64,
    },
    /// Any other cause.
    Other {
        /// Cause in one sentence, about the step at fault.
        reason: String,
    },
}

/// Time at which a condition of a step must hold.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Moment {
    /// Before an instantaneous action happens.
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
    /// Text of the part in PDDL, with objects for its variables.
    pub condition: String,
    /// Values of both sides; `None` unless the part is a numeric comparison.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub compared: Option<Compared>,
    /// Values that the part depends on: expression and value as text.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub values: Vec<(String, String)>,
}

impl Unmet {
    pub(super) fn of(why: &Why) -> Self {
        Unmet { condition: why.condition.clone(), compared: why.compared.clone(), values: why.values.clone() }
    }
}

impl Moment {
    /// Words for the moment, to follow "does not hold".
    pub(super) fn words(self) -> &'static str {
        match self {
            Moment::Before => "before it",
            Moment::Start => "at its start",
            Moment::OverAll => "all the time",
            Moment::End => "at its end",
        }
    }
}

/// Fault at which a replay stopped.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Fault {
    pub reason: String,
    pub step: Option<usize>,
    pub cause: Cause,
    pub finding: Diagnostic,
}
