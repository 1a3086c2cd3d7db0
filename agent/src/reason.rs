//! Reasons why plans are made, with the values that decide them. Records hold the values; sentences
//! are made from these for readers.

use std::fmt;

use descry_domains::saying::Saying;
use descry_planner::semantics::Compared;
use descry_planner::task::Comparison;
use descry_planner::{Broken, Cause, Moment, Plan, Unmet};
use descry_skills::Call;
use serde::{Deserialize, Serialize};

use crate::numbers::{is_share, number, share_of};
use crate::written;

/// Reason why a plan was made.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Reason {
    /// Event that made a new plan necessary.
    pub trigger: Trigger,
    /// Number of states at which the planner's search was ended without a proof; `None` if the
    /// search ended by itself.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub search_ended_after: Option<u64>,
    /// True if no plan reaches the goal in the time left.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub is_late: bool,
}

/// Event that makes a new plan necessary.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case", tag = "because")]
pub enum Trigger {
    /// The run begins.
    Begin,
    /// A step failed.
    Failed {
        /// The failed step.
        #[serde(with = "written::call")]
        call: Call,
    },
    /// The remaining plan no longer reaches the goal.
    Broken(Break),
    /// The goal denies that something is there and holds, but on too few observations.
    NotDenied,
}

/// First obstacle in a sequence of steps towards the goal.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Break {
    /// Step that cannot be executed; `None` if all can and the goal is missed.
    #[serde(default, skip_serializing_if = "Option::is_none", with = "written::maybe")]
    pub step: Option<Call>,
    /// True if other steps come before the obstacle; the values in `cause` are then those expected
    /// after these steps.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub is_expected: bool,
    /// Unmet condition, missed goal or changed duration, with the values that decide it.
    pub cause: Cause,
}

impl Reason {
    /// Reason with this trigger, for a plan limited neither in time nor in search.
    pub fn of(trigger: Trigger) -> Self {
        Reason { trigger, search_ended_after: None, is_late: false }
    }

    /// The reason as a sentence; `saying` words the domain.
    pub fn told(&self, saying: &Saying) -> String {
        let mut said = match &self.trigger {
            Trigger::Begin => "there is no plan yet".to_string(),
            Trigger::Failed { call } => format!("{} failed", saying.say(&call.to_string())),
            Trigger::Broken(broken) => broken.told(saying),
            Trigger::NotDenied => "nothing that was seen speaks against it, and not enough was seen".into(),
        };
        if let Some(states) = self.search_ended_after {
            said += &format!("; the search ended after {states} states");
        }
        if self.is_late {
            said += "; no plan would do in the time that is left";
        }
        said
    }
}

impl Break {
    /// Converts an obstacle that the planner's monitor found in `steps`.
    pub fn of(broken: &Broken, steps: &Plan) -> Self {
        let step = broken.step.and_then(|at| steps.steps.get(at));
        Break {
            step: step.map(written::call_of),
            is_expected: broken.step.unwrap_or(steps.steps.len()) > 0,
            cause: broken.cause.clone(),
        }
    }

    /// Step whose duration has changed, with the planned and the present duration, seconds; `None`
    /// if the obstacle is another.
    pub fn reckoned(&self) -> Option<(&Call, f64, f64)> {
        match (&self.step, &self.cause) {
            (Some(call), Cause::Duration { planned_s, asked_s }) => Some((call, *planned_s, *asked_s)),
            _ => None,
        }
    }

    /// Part of the goal that is missed; `None` if the obstacle is another.
    pub fn missed_goal(&self) -> Option<&Unmet> {
        match &self.cause {
            Cause::Goal(unmet) => Some(unmet),
            _ => None,
        }
    }

    /// True if a number is smaller than a condition or the goal requires (`>=`).
    pub(crate) fn is_of_too_little(&self) -> bool {
        let (Cause::Goal(unmet) | Cause::Condition { unmet, .. }) = &self.cause else { return false };
        unmet.compared.as_ref().is_some_and(|compared| compared.comparison == Comparison::GreaterOrEqual)
    }

    /// The obstacle as a sentence.
    pub fn told(&self, saying: &Saying) -> String {
        self.sentence(if self.is_expected { "would be only" } else { "is" }, saying)
    }

    /// The obstacle as a sentence, for steps that were only considered.
    pub fn would_be(&self, saying: &Saying) -> String {
        self.sentence("would be", saying)
    }

    /// The obstacle as a sentence; `is` is the verb between a number and its value ("is", "would
    /// be").
    fn sentence(&self, is: &str, saying: &Saying) -> String {
        let call = self.step.as_ref().map(|call| saying.say(&call.to_string()));
        match (&self.cause, call) {
            (Cause::Goal(unmet), _) | (Cause::Condition { unmet, .. }, None) => missed(unmet, is, saying),
            (Cause::Condition { when, unmet }, Some(call)) => {
                needs(&call, *when, unmet, if is == "is" { is } else { "would be" }, saying)
            }
            (Cause::Duration { planned_s, asked_s }, Some(call)) => {
                format!("{call} is now reckoned at {asked_s:.1} s instead of {planned_s:.1} s")
            }
            (Cause::Duration { planned_s, asked_s }, None) => {
                format!("{asked_s:.1} s are reckoned instead of {planned_s:.1} s")
            }
            (Cause::Other { reason }, Some(call)) => format!("{call}: {reason}"),
            (Cause::Other { reason }, None) => reason.clone(),
        }
    }
}

impl fmt::Display for Break {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.told(&Saying::default()))
    }
}

/// Sentence about a missed goal, with the number that is too small or too large if there is one.
fn missed(unmet: &Unmet, is: &str, saying: &Saying) -> String {
    match &unmet.compared {
        Some(compared) => {
            let (number, found) = found(compared, saying);
            format!("{number} {is} {found}, and {} is wanted", wanted(compared, saying))
        }
        None if is == "is" => saying.deny(&unmet.condition),
        None => saying.would_deny(&unmet.condition),
    }
}

/// Sentence about an unmet condition of a step.
fn needs(call: &str, when: Moment, unmet: &Unmet, is: &str, saying: &Saying) -> String {
    if let (Some(compared), false) = (&unmet.compared, when == Moment::OverAll) {
        let (number, found) = found(compared, saying);
        return format!("{call} needs {number} to be {}, and it {is} {found}", wanted(compared, saying));
    }
    let condition = saying.say(&unmet.condition);
    match when {
        Moment::OverAll => format!("{call} asks that {condition} until it has ended, which would not be so"),
        _ if is == "is" => format!("{call} asks that {condition}, which is not so"),
        _ => format!("{call} asks that {condition}, which would not be so"),
    }
}

/// Number of a comparison in words, and its value as text that differs from the bound's.
fn found(compared: &Compared, saying: &Saying) -> (String, String) {
    let value = match (compared.left_value, compared.right_value) {
        (None, _) => "unknown".to_string(),
        (Some(value), Some(wanted)) if is_share(value) => share_of(value, wanted),
        (Some(value), _) => number(value),
    };
    (saying.say(&compared.left), value)
}

/// Bound of a comparison in words, such as `at least 0.80`.
fn wanted(compared: &Compared, saying: &Saying) -> String {
    let sign = match compared.comparison {
        Comparison::Less => "less than ",
        Comparison::LessOrEqual => "at most ",
        Comparison::Equal => "",
        Comparison::GreaterOrEqual => "at least ",
        Comparison::Greater => "more than ",
    };
    let bound = match compared.right_value {
        Some(wanted) => number(wanted),
        None => saying.say(&compared.right),
    };
    format!("{sign}{bound}")
}
