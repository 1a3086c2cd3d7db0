//! Serialised form of calls and steps: text as in PDDL plans, which the planner can parse.

use descry_planner::{Plan, Source, Step};
use descry_skills::Call;
use serde::de::Error;
use serde::{Deserialize, Deserializer, Serialize, Serializer};

/// Call that a step makes: action and arguments.
pub fn call_of(step: &Step) -> Call {
    Call { action: step.action.clone(), arguments: step.arguments.clone() }
}

/// Parses steps, one text each.
fn read(texts: &[String]) -> Result<Vec<Step>, String> {
    Plan::read(&Source::new("plan", texts.join("\n"))).map(|plan| plan.steps).map_err(|e| e.to_string())
}

/// Parses a call.
fn read_call(text: &str) -> Result<Call, String> {
    let steps = read(std::slice::from_ref(&text.to_string()))?;
    steps.first().map(call_of).ok_or_else(|| format!("\"{text}\" is no call"))
}

/// Serialises a call as text, such as `(move a b)`.
pub mod call {
    use super::*;

    /// Serialises a call.
    pub fn serialize<S: Serializer>(call: &Call, to: S) -> Result<S::Ok, S::Error> {
        call.to_string().serialize(to)
    }

    /// Deserialises a call.
    pub fn deserialize<'de, D: Deserializer<'de>>(from: D) -> Result<Call, D::Error> {
        read_call(&String::deserialize(from)?).map_err(D::Error::custom)
    }
}

/// Serialises an optional call as text.
pub mod maybe {
    use super::*;

    /// Serialises an optional call.
    pub fn serialize<S: Serializer>(call: &Option<Call>, to: S) -> Result<S::Ok, S::Error> {
        call.as_ref().map(Call::to_string).serialize(to)
    }

    /// Deserialises an optional call.
    pub fn deserialize<'de, D: Deserializer<'de>>(from: D) -> Result<Option<Call>, D::Error> {
        let text = Option::<String>::deserialize(from)?;
        text.map(|text| read_call(&text)).transpose().map_err(D::Error::custom)
    }
}

/// Serialises several calls as texts.
pub mod calls {
    use super::*;

    /// Serialises calls.
    pub fn serialize<S: Serializer>(calls: &[Call], to: S) -> Result<S::Ok, S::Error> {
        calls.iter().map(Call::to_string).collect::<Vec<_>>().serialize(to)
    }

    /// Deserialises calls.
    pub fn deserialize<'de, D: Deserializer<'de>>(from: D) -> Result<Vec<Call>, D::Error> {
        let texts = Vec::<String>::deserialize(from)?;
        texts.iter().map(|text| read_call(text)).collect::<Result<_, _>>().map_err(D::Error::custom)
    }
}

/// Serialises steps as texts, such as `0.000: (move a b) [3.200]`.
pub mod steps {
    use super::*;

    /// Steps as lines of a plan file.
    pub fn lines(steps: &[Step]) -> Vec<String> {
        let plan = Plan { steps: steps.to_vec(), cost: None };
        plan.to_string().lines().map(str::to_string).collect()
    }

    /// Serialises steps.
    pub fn serialize<S: Serializer>(steps: &[Step], to: S) -> Result<S::Ok, S::Error> {
        lines(steps).serialize(to)
    }

    /// Deserialises steps.
    pub fn deserialize<'de, D: Deserializer<'de>>(from: D) -> Result<Vec<Step>, D::Error> {
        read(&Vec::<String>::deserialize(from)?).map_err(D::Error::custom)
    }
}
