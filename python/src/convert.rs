//! Conversion of values between Rust and Python through JSON.

use pyo3::prelude::*;
use pyo3::types::PyString;
use serde::Serialize;
use serde_json::Value;

use crate::failure;

/// Converts a serialisable value to the objects of Python's `json` module.
pub fn to_python<'py>(py: Python<'py>, value: &impl Serialize) -> PyResult<Bound<'py, PyAny>> {
    let text = serde_json::to_string(value).map_err(|e| failure::bug(py, &e.to_string()))?;
    py.import("json")?.call_method1("loads", (text,))
}

/// Converts a value that Python's `json` module can write.
pub fn from_python(value: &Bound<'_, PyAny>) -> PyResult<Value> {
    let py = value.py();
    let text = py.import("json")?.call_method1("dumps", (value,))?;
    let text: Bound<'_, PyString> = text.cast_into()?;
    serde_json::from_str(text.to_str()?).map_err(|e| failure::input(py, &e.to_string()))
}
