//! Endings of a goal: "with confidence 0.9" and "within 60 seconds".

use super::GoalError;
use crate::english;

/// Confidence and deadline requested at the end of a goal.
#[derive(Clone, Copy)]
pub(super) struct Wanted {
    pub(super) confidence: Option<f64>,
    pub(super) deadline_s: Option<f64>,
}

/// Words that introduce the requested confidence.
pub(crate) const CONFIDENCE: [&str; 2] = ["with", "confidence"];
/// Word that introduces the deadline.
pub(crate) const DEADLINE: [&str; 1] = ["within"];

/// Splits "with confidence 0.9" and "within 60 seconds" off the end of a goal, in either order.
pub(super) fn conditions(said: &str) -> Result<(Vec<String>, Wanted), GoalError> {
    let mut words = usual(english::words(said));
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

/// Words in which every wording of a confidence, as "with 90% confidence" or "and be 90 % sure", has
/// become "with confidence 0.9".
fn usual(mut words: Vec<String>) -> Vec<String> {
    const AROUND: [(&str, &[&str]); 2] =
        [("with", &["confidence", "certainty"]), ("be", &["sure", "certain"])];
    for (first, lasts) in AROUND {
        let begins = words.iter().rposition(|word| word == first);
        let Some(from) = begins else { continue };
        let Some(to) = words[from..].iter().position(|word| lasts.contains(&word.as_str())) else { continue };
        let inner = &words[from + 1..from + to];
        let number = inner.strip_prefix(&["at".to_string(), "least".to_string()]).unwrap_or(inner).join(" ");
        if probability(&number).is_none() {
            continue;
        }
        let joined = from.checked_sub(1).filter(|&before| words[before] == "and").unwrap_or(from);
        let told = CONFIDENCE.map(str::to_string).into_iter().chain([number]);
        words.splice(joined..=from + to, told);
    }
    words
}

/// Parses a probability: "0.9", "90%", "90 percent"; `None` for other words.
fn probability(words: &str) -> Option<f64> {
    let percent = ["%", "percent", "per cent"].iter().find_map(|sign| words.strip_suffix(sign));
    let number: f64 = percent.unwrap_or(words).trim().parse().ok()?;
    Some(if percent.is_some() { number / 100.0 } else { number })
}

/// The words after a condition, without commas and courtesies.
fn ended(words: &[String]) -> String {
    english::unlisted(english::without_endings(words)).join(" ")
}

/// Checks that a condition was not given before (`other`).
fn once(other: Option<f64>, condition: &'static str, example: &'static str) -> Result<(), GoalError> {
    other.map_or(Ok(()), |_| Err(GoalError::SaidTwice { condition, example }))
}

/// Parses a confidence, "0.9" or "90%", which must be above one half and below 1.
fn confidence_of(found: String) -> Result<f64, GoalError> {
    match probability(&found) {
        Some(c) if c > 0.5 && c < 1.0 => Ok(c),
        Some(c) if c > 0.0 && c < 1.0 => Err(GoalError::LowConfidence { found }),
        _ => Err(GoalError::BadConfidence { found }),
    }
}

/// Numbers in words.
const NUMBERS: [(&str, f64); 13] = [
    ("half a", 0.5),
    ("half an", 0.5),
    ("a", 1.0),
    ("an", 1.0),
    ("one", 1.0),
    ("two", 2.0),
    ("three", 3.0),
    ("four", 4.0),
    ("five", 5.0),
    ("ten", 10.0),
    ("twenty", 20.0),
    ("thirty", 30.0),
    ("sixty", 60.0),
];

/// Parses a duration into seconds: "60 s", "60s", "60 seconds", "1.5 minutes", "half an hour". A number
/// alone is an error, as its unit is open.
fn seconds(found: String) -> Result<f64, GoalError> {
    let said = found.strip_prefix("the next ").unwrap_or(&found);
    let digits = said.find(|c: char| c.is_alphabetic()).unwrap_or(said.len());
    let (number, unit) = match said.rsplit_once(' ') {
        Some((number, unit)) if digits == 0 => {
            (NUMBERS.iter().find(|(word, _)| *word == number).map(|(_, n)| *n), unit)
        }
        _ => (said[..digits].trim().parse::<f64>().ok(), &said[digits..]),
    };
    let factor = match unit {
        "s" | "sec" | "second" | "seconds" => 1.0,
        "min" | "minute" | "minutes" => 60.0,
        "h" | "hour" | "hours" => 3600.0,
        "" if number.is_some_and(|n| n > 0.0) => return Err(GoalError::NoUnit { found }),
        _ => return Err(GoalError::BadDeadline { found }),
    };
    let wanted_s = number.map(|n| n * factor).filter(|s| *s > 0.0 && s.is_finite());
    wanted_s.ok_or(GoalError::BadDeadline { found })
}
