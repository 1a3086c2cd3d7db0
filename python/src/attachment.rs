//! Semantic attachments in Python.

use std::collections::BTreeMap;
use std::sync::Arc;

use descry_planner::{Answer, Attachments, CallError, CallKind, FactValue, Read};
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyTuple};

use crate::watch::Watch;

/// Function that answers the calls of a semantic attachment, with the symbols of the facts that its answer
/// depends on, and a cheap estimate for heuristics.
#[pyclass(frozen, module = "descry")]
pub struct Attachment {
    function: Py<PyAny>,
    reads: Vec<String>,
    relaxed: Option<Py<PyAny>>,
}

#[pymethods]
impl Attachment {
    #[new]
    #[pyo3(signature = (function, *, reads=Vec::new(), relaxed=None))]
    fn new(function: Py<PyAny>, reads: Vec<String>, relaxed: Option<Py<PyAny>>) -> Self {
        Self { function, reads, relaxed }
    }

    #[pyo3(signature = (*arguments, **named))]
    fn __call__<'py>(
        &self,
        py: Python<'py>,
        arguments: &Bound<'py, PyTuple>,
        named: Option<&Bound<'py, PyDict>>,
    ) -> PyResult<Bound<'py, PyAny>> {
        self.function.bind(py).call(arguments, named)
    }
}

/// A call to a semantic attachment: its module, kind and arguments.
#[pyclass(frozen, module = "descry")]
pub struct Call {
    inner: descry_planner::Call,
}

#[pymethods]
impl Call {
    #[getter]
    fn module(&self) -> &str {
        &self.inner.module
    }

    #[getter]
    fn kind(&self) -> String {
        self.inner.kind.to_string()
    }

    #[getter]
    fn arguments(&self) -> Vec<&str> {
        self.inner.arguments.iter().map(|name| &**name).collect()
    }

    #[pyo3(signature = (symbol, *arguments))]
    fn value<'py>(
        &self,
        py: Python<'py>,
        symbol: &str,
        arguments: Vec<String>,
    ) -> PyResult<Bound<'py, PyAny>> {
        let arguments: Vec<&str> = arguments.iter().map(String::as_str).collect();
        match self.inner.reading(symbol, &arguments) {
            Some(value) => written(py, value),
            None => {
                let error =
                    CallError::NotRead { term: term(symbol, &arguments), expected: "a fact of the task" };
                Err(pyo3::exceptions::PyKeyError::new_err(error.to_string()))
            }
        }
    }

    #[getter]
    fn readings<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let all = PyDict::new(py);
        for reading in &self.inner.readings {
            let names = std::iter::once(&reading.symbol).chain(reading.arguments.iter()).map(|name| &**name);
            all.set_item(PyTuple::new(py, names.collect::<Vec<_>>())?, written(py, &reading.value)?)?;
        }
        Ok(all)
    }

    fn __repr__(&self) -> String {
        format!("<Call {}>", self.inner)
    }
}

fn term(symbol: &str, arguments: &[&str]) -> String {
    format!("({})", [&[symbol], arguments].concat().join(" "))
}

fn written<'py>(py: Python<'py>, value: &FactValue) -> PyResult<Bound<'py, PyAny>> {
    Ok(match value {
        FactValue::Truth(truth) => truth.into_pyobject(py)?.to_owned().into_any(),
        FactValue::Number(number) => number.into_pyobject(py)?.into_any(),
        FactValue::Object(name) => name.into_pyobject(py)?.into_any(),
        FactValue::Undefined => py.None().into_bound(py),
    })
}

/// Adapter of a Python function to the planner's trait for semantic attachments.
struct Asked {
    function: Py<PyAny>,
    reads: Vec<String>,
    relaxed: Option<Py<PyAny>>,
    watch: Arc<Watch>,
}

impl Asked {
    fn ask(&self, function: &Py<PyAny>, call: &descry_planner::Call) -> Result<Answer, CallError> {
        Python::attach(|py| {
            let asked = Call { inner: call.clone() };
            let answer = function.bind(py).call1((asked,)).map_err(|error| {
                let text = error.to_string();
                self.watch.raise(error);
                CallError::Failed(text)
            })?;
            read(&answer, call.kind).map_err(|_| CallError::WrongAnswer {
                expected: expected(call.kind).into(),
                got: answer.repr().map_or_else(|e| e.to_string(), |text| text.to_string()),
            })
        })
    }
}

impl descry_planner::Attachment for Asked {
    fn reads(&self) -> Vec<Read> {
        self.reads.iter().map(|symbol| Read::All(symbol.to_lowercase())).collect()
    }

    fn evaluate(&self, call: &descry_planner::Call) -> Result<Answer, CallError> {
        self.ask(&self.function, call)
    }

    fn relaxed(&self, call: &descry_planner::Call) -> Option<Result<Answer, CallError>> {
        self.relaxed.as_ref().map(|function| self.ask(function, call))
    }
}

fn expected(kind: CallKind) -> &'static str {
    match kind {
        CallKind::Cost => "a number, 0 or more",
        CallKind::Condition => "True or False",
        CallKind::Effect => "a list of values, one for each term that the module writes",
        CallKind::Grounding => "a list of names",
    }
}

fn read(answer: &Bound<'_, PyAny>, kind: CallKind) -> PyResult<Answer> {
    Ok(match kind {
        CallKind::Cost => Answer::Number(answer.extract()?),
        CallKind::Condition => Answer::Truth(answer.extract()?),
        CallKind::Grounding => {
            let names: Vec<String> = answer.extract()?;
            Answer::Proposals(names.into_iter().map(Into::into).collect())
        }
        CallKind::Effect => {
            let values: Vec<Bound<'_, PyAny>> = answer.extract()?;
            Answer::Writes(values.iter().map(value).collect::<PyResult<_>>()?)
        }
    })
}

fn value(value: &Bound<'_, PyAny>) -> PyResult<FactValue> {
    if value.is_none() {
        return Ok(FactValue::Undefined);
    }
    if let Ok(truth) = value.extract::<bool>() {
        return Ok(FactValue::Truth(truth));
    }
    if let Ok(number) = value.extract::<f64>() {
        return Ok(FactValue::Number(number));
    }
    Ok(FactValue::Object(value.extract::<String>()?.into()))
}

/// Binds Python functions to the semantic attachments of their names; `watch` gives the time and receives
/// exceptions.
pub fn bind(py: Python<'_>, given: Option<BTreeMap<String, Py<PyAny>>>, watch: &Arc<Watch>) -> Attachments {
    let clock = Arc::clone(watch);
    let mut attachments = Attachments::new().with_clock(move || clock.elapsed_s());
    for (name, function) in given.into_iter().flatten() {
        let asked = match function.bind(py).cast::<Attachment>() {
            Ok(attachment) => {
                let Attachment { function, reads, relaxed } = attachment.get();
                Asked {
                    function: function.clone_ref(py),
                    reads: reads.clone(),
                    relaxed: relaxed.as_ref().map(|f| f.clone_ref(py)),
                    watch: Arc::clone(watch),
                }
            }
            Err(_) => Asked { function, reads: Vec::new(), relaxed: None, watch: Arc::clone(watch) },
        };
        attachments.insert(name, asked);
    }
    attachments
}
