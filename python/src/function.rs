//! Functions of Python that stand in for the programs of a domain.

use std::collections::BTreeMap;
use std::sync::{Arc, Mutex, PoisonError};

use descry_domains::function::{Function, Functions, Named};
use descry_domains::load::Domain;
use pyo3::prelude::*;
use serde_json::{Map, Value};

use crate::convert::{from_python, to_python};
use crate::failure;

/// The first exception that a function raised which ends the run: Ctrl-C, not a failure of the function.
pub type Raised = Arc<Mutex<Option<PyErr>>>;

/// A function that is called with the parts of a question.
struct Called {
    function: Py<PyAny>,
    hear: fn(&Map<String, Value>) -> Vec<Value>,
    raised: Raised,
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
                let answer = self.function.bind(py).call1(pyo3::types::PyTuple::new(py, parts)?)?;
                from_python(&answer)
            };
            called().map_err(|error| {
                let text = error.to_string();
                if !error.is_instance_of::<pyo3::exceptions::PyException>(py) {
                    self.raised.lock().unwrap_or_else(PoisonError::into_inner).get_or_insert(error);
                }
                text
            })
        })
    }
}

/// The arguments of a call or an action, one by one.
fn arguments(question: &Map<String, Value>) -> Vec<Value> {
    question.get("arguments").and_then(Value::as_array).cloned().unwrap_or_default()
}

/// The objects that a fact may speak of, as one list.
fn objects(question: &Map<String, Value>) -> Vec<Value> {
    question.get("objects").cloned().into_iter().collect()
}

/// Functions by name, as they are given.
pub type Given = Option<BTreeMap<String, Py<PyAny>>>;

/// Puts functions in the places of the programs that a domain names.
///
/// # Errors
/// A name for which `domain.toml` names no program.
pub fn bind(
    py: Python<'_>,
    domain: &mut Domain,
    [calls, facts, actions]: [Given; 3],
    raised: &Raised,
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
    raised: &Raised,
) -> PyResult<Named> {
    let mut named = Named::new();
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
