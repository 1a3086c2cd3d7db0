//! Semantic attachments: words of a domain whose meaning is computed outside the planner.
//!
//! A `[call]` in PDDL/M names a module; the module is bound to an [`Attachment`] by name. An attachment is a pure
//! function of the call's arguments and of the facts that it declares to read ([`Attachment::reads`]); the planner
//! hands over the values of exactly those facts with every call, so a call is plain data that can be cached, sent
//! to another process, batched, and answered on any thread.

#[doc(hidden)]
pub mod registry;

use std::fmt;
use std::sync::Arc;

use serde::{Deserialize, Serialize};

pub use self::registry::{Attachments, CallStatistics};

/// Kind of a module, as written in `:modules`.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum CallKind {
    /// A duration or cost; infinite means that the action cannot be applied.
    Cost,
    /// True or false.
    #[serde(rename = "conditionchecker")]
    Condition,
    /// New values for the terms that the module lists.
    Effect,
    /// Further parameters for an action.
    Grounding,
}

impl fmt::Display for CallKind {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            CallKind::Cost => "cost",
            CallKind::Condition => "conditionchecker",
            CallKind::Effect => "effect",
            CallKind::Grounding => "grounding",
        })
    }
}

/// Value of a fact or fluent.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(untagged)]
pub enum FactValue {
    /// Value of a predicate.
    Truth(bool),
    /// Value of a numeric fluent.
    Number(f64),
    /// Value of an object fluent: the object's name.
    Object(Arc<str>),
    /// Undefined fluent.
    Undefined,
}

/// A fact that a call may read, with its value in the state of the call.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Reading {
    /// Predicate or function, lower case.
    pub symbol: Arc<str>,
    /// Names of objects.
    pub arguments: Arc<[Arc<str>]>,
    /// Value in the state of the call.
    pub value: FactValue,
}

/// A declared dependency of an attachment's answer on the state.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Read {
    /// Every ground instance of a predicate or function.
    All(String),
    /// Instances whose arguments equal the call's arguments at the given positions; `None`: any
    /// object.
    At(String, Vec<Option<usize>>),
    /// Whole state; the cache then helps only for recurring states.
    Everything,
}

/// Question to an attachment.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Call {
    /// The module's PDDL name.
    pub module: Arc<str>,
    /// Kind of the module.
    pub kind: CallKind,
    /// Names of the objects that the call is about; in an action with a `:grounding` call the proposed parameter
    /// comes last.
    pub arguments: Vec<Arc<str>>,
    /// The declared facts, in the order of the declaration, instances in the order of the task's objects.
    pub readings: Vec<Reading>,
}

impl Call {
    /// The numeric reading of `symbol` on `arguments`, or a [`CallError::NotRead`].
    pub fn number(&self, symbol: &str, arguments: &[&str]) -> Result<f64, CallError> {
        match self.reading(symbol, arguments) {
            Some(FactValue::Number(value)) => Ok(*value),
            _ => Err(CallError::NotRead { term: term_text(symbol, arguments), expected: "a number" }),
        }
    }

    /// The truth of the predicate `symbol` on `arguments`, or a [`CallError::NotRead`].
    pub fn truth(&self, symbol: &str, arguments: &[&str]) -> Result<bool, CallError> {
        match self.reading(symbol, arguments) {
            Some(FactValue::Truth(value)) => Ok(*value),
            _ => Err(CallError::NotRead { term: term_text(symbol, arguments), expected: "true or false" }),
        }
    }

    /// The reading of `symbol` on `arguments`, if it was declared.
    pub fn reading(&self, symbol: &str, arguments: &[&str]) -> Option<&FactValue> {
        self.readings
            .iter()
            .find(|reading| {
                &*reading.symbol == symbol
                    && reading.arguments.len() == arguments.len()
                    && reading.arguments.iter().zip(arguments).all(|(own, asked)| &**own == *asked)
            })
            .map(|reading| &reading.value)
    }
}

impl fmt::Display for Call {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "[{}", self.module)?;
        for argument in &self.arguments {
            write!(f, " {argument}")?;
        }
        f.write_str("]")
    }
}

/// Answer of an attachment.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(untagged)]
pub enum Answer {
    /// Answer of a condition module.
    Truth(bool),
    /// Answer of a cost module; infinite means not applicable.
    Number(f64),
    /// Answer of an effect module: one value for each term that the module lists, in that order.
    Writes(Vec<FactValue>),
    /// Answer of a grounding module: all proposed values of the parameter; empty if the action is
    /// not applicable.
    Proposals(Vec<Arc<str>>),
}

impl Answer {
    /// Answer of the given kind: from JSON, object names and effect values both come as lists of
    /// texts.
    fn of_kind(self, kind: CallKind) -> Answer {
        let name = |value: &FactValue| match value {
            FactValue::Object(name) => Some(name.clone()),
            _ => None,
        };
        match (kind, &self) {
            (CallKind::Grounding, Answer::Writes(values)) => {
                values.iter().map(name).collect::<Option<_>>().map_or(self, Answer::Proposals)
            }
            _ => self,
        }
    }

    fn fits(&self, kind: CallKind) -> bool {
        match (kind, self) {
            (CallKind::Cost, Answer::Number(cost)) => *cost >= 0.0,
            (CallKind::Condition, Answer::Truth(_)) => true,
            (CallKind::Effect, Answer::Writes(values)) => {
                values.iter().all(|value| !matches!(value, FactValue::Number(number) if !number.is_finite()))
            }
            (CallKind::Grounding, Answer::Proposals(_)) => true,
            _ => false,
        }
    }
}

/// Error of an attachment without a usable answer.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum CallError {
    /// Failure reported by the attachment.
    #[error("{0}")]
    Failed(String),
    /// The attachment read a fact that is not declared in `reads`, or has another type.
    #[error("{term} is not among the facts that the attachment declares to read, or is not {expected}")]
    NotRead {
        /// The fact looked for.
        term: String,
        /// The type looked for.
        expected: &'static str,
    },
    /// Answer of the wrong kind, a negative or undefined cost, or a non-finite number.
    #[error("answered {got}, expected {expected}")]
    WrongAnswer {
        /// Expected answer.
        expected: String,
        /// Given answer.
        got: String,
    },
    /// No answer within the time limit.
    #[error("no answer within {limit_s} s")]
    TimedOut {
        /// Time limit.
        limit_s: f64,
    },
    /// The process behind the attachment ended.
    #[error("the attachment's program ended: {0}")]
    Crashed(String),
}

/// Failed call, with the call's module and arguments.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[error("module {call} (attachment `{attachment}`) failed: {cause}")]
pub struct AttachmentError {
    /// The call as in PDDL: `[module a b]`.
    pub call: String,
    /// Name of the module.
    pub module: String,
    /// Name of the attachment.
    pub attachment: String,
    /// Cause.
    pub cause: CallError,
}

/// Accuracy of an answer.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum Level {
    /// Exact answer, for plans.
    Exact,
    /// Optimistic, cheap answer, for heuristics.
    Relaxed,
}

/// The meaning of a module: a pure function of the arguments and the declared facts.
///
/// Any `Fn(&Call) -> Result<Answer, CallError>` that may be shared between threads is an attachment that reads nothing.
pub trait Attachment: Send + Sync {
    /// Read set besides the arguments: the cache key, and the readings that a call carries.
    fn reads(&self) -> Vec<Read> {
        Vec::new()
    }

    /// The exact answer.
    fn evaluate(&self, call: &Call) -> Result<Answer, CallError>;

    /// Cheap answer for heuristics; `None` (the default) if the exact one is as good.
    ///
    /// It should be optimistic (a cost not above the exact one, false only where the exact answer is false), or
    /// plans may be missed and *unsolvable* may be wrong.
    fn relaxed(&self, _call: &Call) -> Option<Result<Answer, CallError>> {
        None
    }

    /// Several calls at once, all exact; answers in the order of the calls.
    fn evaluate_all(&self, calls: &[Call]) -> Vec<Result<Answer, CallError>> {
        calls.iter().map(|call| self.evaluate(call)).collect()
    }

    /// Receives one entry of `:moduleoptions`: the arguments after this attachment's name.
    fn configure(&self, _options: &[String]) -> Result<(), CallError> {
        Ok(())
    }
}

impl<F> Attachment for F
where
    F: Fn(&Call) -> Result<Answer, CallError> + Send + Sync,
{
    fn evaluate(&self, call: &Call) -> Result<Answer, CallError> {
        self(call)
    }
}

fn term_text(symbol: &str, arguments: &[&str]) -> String {
    let mut text = format!("({symbol}");
    for argument in arguments {
        text.push(' ');
        text.push_str(argument);
    }
    text.push(')');
    text
}
