//! Explanation of an action's absence from a plan.

use std::collections::BTreeMap;
use std::sync::Arc;
use std::time::Duration;

use descry_agent::why_not::{self as asked_about, Answer};
use descry_planner::Options;
use pyo3::prelude::*;

use crate::attachment;
use crate::convert::to_python;
use crate::failure;
use crate::task::{Plan, Task};
use crate::watch::Watch;

/// Answer to a why-not question about an action.
#[pyclass(frozen, module = "descry")]
pub struct WhyNot {
    inner: Answer,
    said: String,
}

#[pymethods]
impl WhyNot {
    #[getter]
    fn action(&self) -> &str {
        &self.inner.action
    }

    #[getter]
    fn in_plan(&self) -> bool {
        self.inner.in_plan
    }

    #[getter]
    fn unmet(&self) -> Vec<&str> {
        self.inner.unmet.iter().map(String::as_str).collect()
    }

    #[getter]
    fn data<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        to_python(py, &self.inner)
    }

    fn __str__(&self) -> &str {
        &self.said
    }

    fn __repr__(&self) -> String {
        format!("<WhyNot {}>", self.inner.action)
    }
}

/// Explains the absence of an action from the plan of a task.
#[pyfunction]
#[pyo3(signature = (task, action, *, plan=None, time_limit_s=None, memory_limit_mb=None, seed=0, attachments=None))]
#[expect(clippy::too_many_arguments, reason = "Python names them")]
pub fn why_not(
    py: Python<'_>,
    task: &Task,
    action: &str,
    plan: Option<&Plan>,
    time_limit_s: Option<f64>,
    memory_limit_mb: Option<u64>,
    seed: u64,
    attachments: Option<BTreeMap<String, Py<PyAny>>>,
) -> PyResult<WhyNot> {
    let limit = time_limit_s.map(Duration::try_from_secs_f64).transpose();
    let limit = limit.map_err(|e| failure::input(py, &format!("time_limit_s: {e}\n  expected seconds")))?;
    let watch = Arc::new(Watch::new(limit, None));
    let attachments = attachment::bind(py, attachments, &watch);
    let memory_limit_bytes = memory_limit_mb.map(|mb| mb.saturating_mul(1 << 20));
    let options = Options { seed, memory_limit_bytes, ..Options::default() };
    let over = || watch.is_over();
    let found = match plan {
        Some(plan) => Some(plan.inner.clone()),
        None => {
            let planned =
                py.detach(|| descry_planner::plan(&task.inner, &attachments, &options, &over, &mut |_| {}));
            let planned = planned
                .map_err(|error| watch.end(py).err().unwrap_or_else(|| failure::planning(py, &error)))?;
            planned.plan().cloned()
        }
    };
    let answered =
        py.detach(|| asked_about::answer(&task.inner, &attachments, found.as_ref(), action, &options, &over));
    watch.end(py)?;
    let inner = answered.map_err(|error| failure::command(py, &error))?;
    let said = inner.said(found.as_ref());
    Ok(WhyNot { inner, said })
}
