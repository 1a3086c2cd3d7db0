//! Python functions in place of a domain's programs.

use std::collections::BTreeMap;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use descry_domains::function::{Function, Functions, NamedFunctions};
use descry_domains::load::Domain;
use pyo3::exceptions::PyException;
use pyo3::prelude::*;
use pyo3::types::PyTuple;
use serde_json::{Map, Value};

use crate::convert::{from_python, to_python};
use crate::failure;

/// Exceptions raised by Python functions during a run.
#[derive(Default)]
pub struct Raised {
    /// The exception that ends the run, such as `KeyboardInterrupt`, if there is one; ordinary failures of a
    /// function do not end it.
    ends: Mutex<Option<PyErr>>,
    /// The last exception of a function that does not end the run, with its message.
    failed: Mutex<Option<(String, PyErr)>>,
}

impl Raised {
    /// Ends the run with an exception; the first one counts.
    pub fn end(&self, error: PyErr) {
        locked(&self.ends).get_or_insert(error);
    }

    /// True if the run is to end.
    pub fn is_end(&self) -> bool {
        locked(&self.ends).is_some()
    }

    /// Takes the exception that ended the run; `None` if there is none, or if it was taken before.
    pub fn ended(&self) -> Option<PyErr> {
        locked(&self.ends).take()
    }

    /// Returns the error of a run, with the failure of a function as its cause if the message of the error
    /// quotes that failure.
    pub fn behind(&self, py: Python<'_>, error: PyErr) -> PyErr {
        if let Some((words, failed)) = locked(&self.failed).take()
            && error.to_string().contains(&words)
        {
            error.set_cause(py, Some(failed));
        }
        error
    }

    fn hear(&self, py: Python<'_>, error: PyErr) -> String {
        let words = error.to_string();
        if error.is_instance_of::<PyException>(py) {
            *locked(&self.failed) = Some((words.clone(), error));
        } else {
            self.end(error);
        }
        words
    }
}

fn locked<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

/// Adapter that calls a Python function in place of a program; `hear` takes the arguments from the question
/// to the program.
struct Called {
    function: Py<PyAny>,
    hear: fn(&Map<String, Value>) -> Vec<Value>,
    raised: Arc<Raised>,
}

impl std::fmt::Debug for Called {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str("a function of Python")
    }
}

impl Function for Called {
    fn answer(&self, question: &Value) -> Result<Value, String> {
        let parts = question.as_object().map(self.hear).unwrap_or_default();
        Python::attach(|py| {
            let called = || -> PyResult<Value> {
                let parts: Vec<_> = parts.iter().map(|part| to_python(py, part)).collect::<PyResult<_>>()?;
                let answer = self.function.bind(py).call1(PyTuple::new(py, parts)?)?;
                from_python(&answer)
            };
            called().map_err(|error| self.raised.hear(py, error))
        })
    }
}

/// Arguments in the question about a call or an action.
fn arguments(question: &Map<String, Value>) -> Vec<Value> {
    question.get("arguments").and_then(Value::as_array).cloned().unwrap_or_default()
}

/// Objects that a fact may mention, in the question about that fact; passed as one list.
fn objects(question: &Map<String, Value>) -> Vec<Value> {
    question.get("objects").cloned().into_iter().collect()
}

/// Python functions by name; `None` for no functions.
pub type Given = Option<BTreeMap<String, Py<PyAny>>>;

/// Replaces programs of a domain by the given Python functions for calls, facts and actions.
///
/// # Errors
/// `InputError` for a name without a program in `domain.toml`.
pub fn bind(
    py: Python<'_>,
    domain: &mut Domain,
    [calls, facts, actions]: [Given; 3],
    raised: &Arc<Raised>,
) -> PyResult<()> {
    let config = &domain.config;
    let known_calls: Vec<&str> = config.attachments.keys().map(String::as_str).collect();
    let known_facts = config.word.iter().filter(|(_, word)| word.program.is_some());
    let known_facts: Vec<&str> = known_facts.map(|(name, _)| name.as_str()).collect();
    let known_actions = config.action.iter().filter(|(_, action)| action.program.is_some());
    let known_actions: Vec<&str> = known_actions.map(|(name, _)| name.as_str()).collect();
    let functions = Functions {
        calls: named(py, "attachments", calls, &known_calls, arguments, raised)?,
        facts: named(py, "facts", facts, &known_facts, objects, raised)?,
        actions: named(py, "actions", actions, &known_actions, arguments, raised)?,
    };
    domain.functions = functions;
    Ok(())
}

fn named(
    py: Python<'_>,
    kind: &str,
    given: Given,
    known: &[&str],
    hear: fn(&Map<String, Value>) -> Vec<Value>,
    raised: &Arc<Raised>,
) -> PyResult<NamedFunctions> {
    let mut named = NamedFunctions::new();
    for (name, function) in given.into_iter().flatten() {
        if !known.contains(&name.as_str()) {
            let known = if known.is_empty() { "none".into() } else { known.join(", ") };
            let text = format!(
                "{kind}: domain.toml names no program for {name}\n  expected one of: {known}\n  \
                 write program = [\"function\"] where domain.toml speaks of {name}"
            );
            return Err(failure::input(py, &text));
        }
        named.insert(name, Arc::new(Called { function, hear, raised: Arc::clone(raised) }));
    }
    Ok(named)
}
