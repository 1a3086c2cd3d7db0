//! "with confidence 0.9" and "within 60 seconds" at the end of a goal.

use super::GoalError;
use crate::english;

/// Confidence and deadline requested at the end of a goal.
#[derive(Clone, Copy)]
pub(super) struct Wanted {
    pub(super) confidence: Option<f64>,
    pub(super) deadline_s: Option<f64>,
}

/// Behind these words a goal says how sure it must be.
pub(crate) const CONFIDENCE: [&str; 2] = ["with", "confidence"];
/// Behind this word a goal says how soon it must be.
pub(crate) const DEADLINE: [&str; 1] = ["within"];

/// Takes "with confidence 0.9" and "within 60 seconds" off the end of a goal, in either order.
pub(super) fn conditions(said: &str) -> Result<(Vec<String>, Wanted), GoalError> {
    let mut words = english::words(said);
    let mut wanted = Wanted { confidence: None, deadline_s: None };
    loop {
        let confidence = words.windows(2).rposition(|w| w == CONFIDENCE);
        let within = words.windows(1).rposition(|w| w == DEADLINE);
        match (confidence, within) {
            (Some(at), within) if within.is_none_or(|w| w < at) => {
                let found = ended(&words.split_off(at)[2..]);
                let other = wanted.confidence.replace(confidence_of(found)?);
                once(other, "with confidence", "0.9")?;
            }
            (_, Some(at)) => {
                let found = ended(&words.split_off(at)[1..]);
                let other = wanted.deadline_s.replace(seconds(found)?);
                once(other, "within", "60 seconds")?;
            }
            _ => return Ok((words, wanted)),
        }
    }
}

/// The words after a condition, without commas and courtesies.
fn ended(words: &[String]) -> String {
    english::unlisted(english::without_endings(words)).join(" ")
}

/// Checks that a condition is given only once.
fn once(other: Option<f64>, condition: &'static str, example: &'static str) -> Result<(), GoalError> {
    other.map_or(Ok(()), |_| Err(GoalError::SaidTwice { condition, example }))
}

/// "0.9": a yes must be likelier than a no.
fn confidence_of(found: String) -> Result<f64, GoalError> {
    match found.parse::<f64>() {
        Ok(c) if c > 0.5 && c < 1.0 => Ok(c),
        Ok(c) if c > 0.0 && c < 1.0 => Err(GoalError::LowConfidence { found }),
        _ => Err(GoalError::BadConfidence { found }),
    }
}

/// "60 s", "60s", "60 seconds", "1.5 minutes"; a number alone may be meant as either.
fn seconds(found: String) -> Result<f64, GoalError> {
    let end = found.find(|c: char| c.is_alphabetic()).unwrap_or(found.len());
    let (number, unit) = (found[..end].trim().parse::<f64>().ok(), &found[end..]);
    let factor = match unit {
        "s" | "second" | "seconds" => 1.0,
        "min" | "minute" | "minutes" => 60.0,
        "" if number.is_some_and(|n| n > 0.0) => return Err(GoalError::NoUnit { found }),
        _ => return Err(GoalError::BadDeadline { found }),
    };
    let wanted_s = number.map(|n| n * factor).filter(|s| *s > 0.0 && s.is_finite());
    wanted_s.ok_or(GoalError::BadDeadline { found })
}
