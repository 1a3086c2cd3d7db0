//! Semantic attachments: parts of a domain (conditions, effects, costs, parameters) that code
//! outside the planner computes.
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

/// Kind of a module (an external function that a domain declares in `:modules`), as written there.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum CallKind {
    /// A duration or cost; infinite means that the action cannot be applied.
    Cost,
    /// Truth of a condition.
    #[serde(rename = "conditionchecker")]
    Condition,
    /// New values for the terms that the module lists.
    Effect,
    /// Proposed values for a further parameter of an action.
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

/// Value of a predicate or function in a state.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(untagged)]
pub enum FactValue {
    /// Value of a predicate.
    Truth(bool),
    /// Value of a numeric fluent.
    Number(f64),
    /// Value of an object fluent: the object's name.
    Object(Arc<str>),
    /// Undefined value of a numeric or object fluent.
    Undefined,
}

/// Predicate or function instance that a call reads, with its value in the state of the call.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Reading {
    /// Name of the predicate or function, lower case.
    pub symbol: Arc<str>,
    /// Names of the argument objects.
    pub arguments: Arc<[Arc<str>]>,
    /// Value in the state of the call.
    pub value: FactValue,
}

/// A declared dependency of an attachment's answer on the state.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Read {
    /// Every ground instance of a predicate or function.
    All(String),
    /// Instances of a predicate or function. Each argument is an index into the call's arguments,
    /// whose object it must equal; `None` admits every object.
    At(String, Vec<Option<usize>>),
    /// Whole state; cached answers are then reused only in states that recur.
    Everything,
}

/// Question to an attachment: a module, argument objects, and the values that the attachment
/// declared to read.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Call {
    /// The module's PDDL name.
    pub module: Arc<str>,
    /// Kind of the module, and so of the expected answer.
    pub kind: CallKind,
    /// Names of the objects that the call is about; in an action with a `:grounding` call the proposed parameter
    /// comes last.
    pub arguments: Vec<Arc<str>>,
    /// Values of the declared facts: in the order of the declaration, and within one declared read
    /// in the order of the task's objects.
    pub readings: Vec<Reading>,
}

impl Call {
    /// Value of the numeric function `symbol` on `arguments`; [`CallError::NotRead`] if it was not
    /// declared to be read or is no number.
    pub fn number(&self, symbol: &str, arguments: &[&str]) -> Result<f64, CallError> {
        match self.reading(symbol, arguments) {
            Some(FactValue::Number(value)) => Ok(*value),
            _ => Err(CallError::NotRead { term: term_text(symbol, arguments), expected: "a number" }),
        }
    }

    /// Truth of the predicate `symbol` on `arguments`; [`CallError::NotRead`] if it was not
    /// declared to be read or is no truth value.
    pub fn truth(&self, symbol: &str, arguments: &[&str]) -> Result<bool, CallError> {
        match self.reading(symbol, arguments) {
            Some(FactValue::Truth(value)) => Ok(*value),
            _ => Err(CallError::NotRead { term: term_text(symbol, arguments), expected: "true or false" }),
        }
    }

    /// Value of `symbol` on `arguments`; `None` if it was not declared to be read.
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
    /// Answer of a cost module: a duration or cost; infinite means that the action is not
    /// applicable.
    Number(f64),
    /// Answer of an effect module: one value for each term that the module lists, in that order.
    Writes(Vec<FactValue>),
    /// Answer of a grounding module: all proposed values of the parameter; empty if the action is
    /// not applicable.
    Proposals(Vec<Arc<str>>),
}

impl Answer {
    /// Converts an answer read from JSON to the given kind: a list of object names is read as
    /// effect values, and becomes proposals for a grounding module.
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

/// Reason why an attachment gave no usable answer.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum CallError {
    /// Failure that the attachment itself reports, with its message.
    #[error("{0}")]
    Failed(String),
    /// The attachment read a fact that its `reads` does not declare, or whose value has another
    /// type.
    #[error("{term} is not among the facts that the attachment declares to read, or is not {expected}")]
    NotRead {
        /// The fact that was read, in PDDL.
        term: String,
        /// The type that was expected, in words.
        expected: &'static str,
    },
    /// Answer of the wrong kind, a negative or undefined cost, or a non-finite number.
    #[error("answered {got}, expected {expected}")]
    WrongAnswer {
        /// Expected answer, in words.
        expected: String,
        /// Answer that was given, as text.
        got: String,
    },
    /// The attachment did not answer within its time limit.
    #[error("no answer within {limit_s} s")]
    TimedOut {
        /// Time limit, seconds.
        limit_s: f64,
    },
    /// The process behind the attachment ended; the text says how.
    #[error("the attachment's program ended: {0}")]
    Crashed(String),
}

/// Failed call of an attachment: the call, the names involved, and the cause.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[error("module {call} (attachment `{attachment}`) failed: {cause}")]
pub struct AttachmentError {
    /// The call in PDDL, with its arguments: `[module a b]`.
    pub call: String,
    /// PDDL name of the module.
    pub module: String,
    /// Name of the attachment.
    pub attachment: String,
    /// Reason why the call failed.
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

/// Implementation of a module: a pure function of the call's arguments and of the facts that
/// [`Attachment::reads`] declares.
///
/// Any `Fn(&Call) -> Result<Answer, CallError>` that may be shared between threads is an attachment that reads nothing.
pub trait Attachment: Send + Sync {
    /// Facts that the answers depend on besides the arguments. Their values come with every call
    /// and are part of the cache key.
    fn reads(&self) -> Vec<Read> {
        Vec::new()
    }

    /// Answers a call exactly.
    fn evaluate(&self, call: &Call) -> Result<Answer, CallError>;

    /// Answers a call cheaply, for heuristics; `None` (the default) if [`Attachment::evaluate`] is
    /// to be used there too.
    ///
    /// The answer should be optimistic (a cost not above the exact one, false only where the exact
    /// answer is false); otherwise plans may be missed and *unsolvable* may be wrong.
    fn relaxed(&self, _call: &Call) -> Option<Result<Answer, CallError>> {
        None
    }

    /// Answers several calls exactly, in the order of the calls.
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
