//! Calls and steps in recorded form: PDDL text and plan text, readable by the planner.

use descry_planner::{Plan, Source, Step};
use descry_skills::Call;
use serde::de::Error;
use serde::{Deserialize, Deserializer, Serialize, Serializer};

/// The call that a step makes.
pub fn call_of(step: &Step) -> Call {
    Call { action: step.action.clone(), arguments: step.arguments.clone() }
}

/// Reads the steps of a plan, a text each.
fn read(texts: &[String]) -> Result<Vec<Step>, String> {
    Plan::read(&Source::new("plan", texts.join("\n"))).map(|plan| plan.steps).map_err(|e| e.to_string())
}

/// Reads a call.
fn read_call(text: &str) -> Result<Call, String> {
    let steps = read(std::slice::from_ref(&text.to_string()))?;
    steps.first().map(call_of).ok_or_else(|| format!("\"{text}\" is no call"))
}

/// A call as `(move a b)`.
pub mod call {
    use super::*;

    /// Writes a call.
    pub fn serialize<S: Serializer>(call: &Call, to: S) -> Result<S::Ok, S::Error> {
        call.to_string().serialize(to)
    }

    /// Reads a call.
    pub fn deserialize<'de, D: Deserializer<'de>>(from: D) -> Result<Call, D::Error> {
        read_call(&String::deserialize(from)?).map_err(D::Error::custom)
    }
}

/// Optional call.
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

/// Several calls.
pub mod calls {
    use super::*;

    /// Writes calls.
    pub fn serialize<S: Serializer>(calls: &[Call], to: S) -> Result<S::Ok, S::Error> {
        calls.iter().map(Call::to_string).collect::<Vec<_>>().serialize(to)
    }

    /// Reads calls.
    pub fn deserialize<'de, D: Deserializer<'de>>(from: D) -> Result<Vec<Call>, D::Error> {
        let texts = Vec::<String>::deserialize(from)?;
        texts.iter().map(|text| read_call(text)).collect::<Result<_, _>>().map_err(D::Error::custom)
    }
}

/// Steps as `0.000: (move a b) [3.200]`.
pub mod steps {
    use super::*;

    /// Steps in plan format, one per line.
    pub fn lines(steps: &[Step]) -> Vec<String> {
        let plan = Plan { steps: steps.to_vec(), cost: None };
        plan.to_string().lines().map(str::to_string).collect()
    }

    /// Writes steps.
    pub fn serialize<S: Serializer>(steps: &[Step], to: S) -> Result<S::Ok, S::Error> {
        lines(steps).serialize(to)
    }

    /// Reads steps.
    pub fn deserialize<'de, D: Deserializer<'de>>(from: D) -> Result<Vec<Step>, D::Error> {
        read(&Vec::<String>::deserialize(from)?).map_err(D::Error::custom)
    }
}
