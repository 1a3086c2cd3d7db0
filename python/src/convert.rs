//! Values that go from one language to the other as JSON does.

use pyo3::prelude::*;
use pyo3::types::PyString;
use serde::Serialize;
use serde_json::Value;

use crate::failure;

/// Any value as Python's `json` module reads it.
pub fn to_python<'py>(py: Python<'py>, value: &impl Serialize) -> PyResult<Bound<'py, PyAny>> {
    let text = serde_json::to_string(value).map_err(|e| failure::bug(py, &e.to_string()))?;
    py.import("json")?.call_method1("loads", (text,))
}

/// Any value that Python's `json` module can write.
pub fn from_python(value: &Bound<'_, PyAny>) -> PyResult<Value> {
    let py = value.py();
    let text = py.import("json")?.call_method1("dumps", (value,))?;
    let text: Bound<'_, PyString> = text.cast_into()?;
    serde_json::from_str(text.to_str()?).map_err(|e| failure::input(py, &e.to_string()))
}
