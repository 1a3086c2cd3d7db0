//! Errors as the Python exceptions declared in `descry/errors.py`.

use descry_agent::exit::CommandError;
use descry_planner::{Diagnostic, Findings, PlanError, Severity};
use pyo3::exceptions::PyKeyboardInterrupt;
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyList};

/// A finding in a text, with its place and a suggested fix.
#[pyclass(frozen, get_all, module = "descry", skip_from_py_object)]
#[derive(Clone)]
pub struct Finding {
    severity: &'static str,
    code: &'static str,
    message: String,
    file: String,
    line: usize,
    column: usize,
    expected: Option<String>,
    mend: Option<String>,
}

#[pymethods]
impl Finding {
    fn __repr__(&self) -> String {
        let Self { severity, code, message, file, line, column, .. } = self;
        format!("<{severity} {code} at {file}:{line}:{column}: {message}>")
    }
}

impl Finding {
    fn of(findings: &Findings, finding: &Diagnostic) -> Self {
        let first = finding.labels.first();
        let (file, line, column) = findings.place(first.map(|label| label.span).unwrap_or_default());
        Self {
            severity: match finding.severity {
                Severity::Error => "error",
                Severity::Warning => "warning",
            },
            code: finding.code,
            message: finding.message.clone(),
            file: file.into(),
            line,
            column,
            expected: first.and_then(|label| label.text.strip_prefix("expected ")).map(str::to_string),
            mend: finding.help.clone(),
        }
    }

    /// All findings, in their order.
    pub fn all(findings: &Findings) -> Vec<Self> {
        findings.list.iter().map(|finding| Self::of(findings, finding)).collect()
    }
}

/// Creates an `InputError` with its findings.
pub fn findings(py: Python<'_>, findings: &Findings) -> PyErr {
    let all = Finding::all(findings);
    let fault = all.iter().find(|f| f.severity == "error").or(all.first()).cloned();
    let told = || -> PyResult<Bound<'_, PyDict>> {
        let told = PyDict::new(py);
        if let Some(fault) = fault {
            told.set_item("file", fault.file)?;
            told.set_item("line", fault.line)?;
            told.set_item("column", fault.column)?;
            told.set_item("expected", fault.expected)?;
            told.set_item("mend", fault.mend)?;
        }
        told.set_item("findings", PyList::new(py, all)?)?;
        Ok(told)
    };
    told().map_or_else(|e| e, |told| raised(py, "InputError", &findings.render(false), Some(&told)))
}

/// Creates an `InputError` from a text whose lines after the first give the expectation and the fix.
pub fn input(py: Python<'_>, text: &str) -> PyErr {
    let told = PyDict::new(py);
    let set = || -> PyResult<()> {
        for line in text.lines().skip(1).map(str::trim).filter(|line| !line.is_empty()) {
            match line.strip_prefix("expected") {
                Some(expected) => told.set_item("expected", expected.trim_start_matches([':', ' ']))?,
                None => told.set_item("mend", line)?,
            }
        }
        Ok(())
    };
    set().map_or_else(|e| e, |()| raised(py, "InputError", text, Some(&told)))
}

/// Creates a `BrokenError`: a body or a store failed permanently.
pub fn broken(py: Python<'_>, text: &str) -> PyErr {
    raised(py, "BrokenError", text, None)
}

/// Creates an `InternalError`: a bug of this package.
pub fn bug(py: Python<'_>, text: &str) -> PyErr {
    raised(py, "InternalError", text, None)
}

/// Creates the exception for a planning error.
pub fn planning(py: Python<'_>, error: &PlanError) -> PyErr {
    match error.findings() {
        Some(found) => findings(py, found),
        None => bug(py, &error.to_string()),
    }
}

/// Creates the exception for an error of a run.
pub fn command(py: Python<'_>, error: &CommandError) -> PyErr {
    match error {
        CommandError::BadInput(text) => input(py, text),
        CommandError::Broken(text) => broken(py, text),
        CommandError::Stopped { said, .. } => PyKeyboardInterrupt::new_err(said.clone()),
        CommandError::Bug(_) => bug(py, &error.to_string()),
    }
}

fn raised(py: Python<'_>, class: &str, text: &str, told: Option<&Bound<'_, PyDict>>) -> PyErr {
    let made = || py.import("descry.errors")?.getattr(class)?.call((text.trim_end(),), told);
    made().map_or_else(|e| e, PyErr::from_value)
}
