//! Existing runs: resume and replay.

use std::path::PathBuf;
use std::sync::{Arc, Mutex, PoisonError};

use descry_agent::exit::CommandError;
use descry_agent::replay::{self as played, Replayed};
use descry_agent::report::Event;
use descry_agent::run::{self, GoingOn, Watcher};
use descry_agent::stop::Stop;
use descry_domains::load::Domain;
use pyo3::prelude::*;

use crate::agent::{Report, carried_out, runtime};
use crate::convert::to_python;
use crate::function::{self, Given, Raised};

/// Resumes an interrupted run.
#[pyfunction]
#[pyo3(signature = (run, *, robot, allow_programs, attachments, facts, actions, on_event))]
#[expect(clippy::too_many_arguments, reason = "Python names them")]
pub fn resume(
    py: Python<'_>,
    run: PathBuf,
    robot: Option<String>,
    allow_programs: bool,
    attachments: Given,
    facts: Given,
    actions: Given,
    on_event: Option<Py<PyAny>>,
) -> PyResult<Report> {
    let raised = Arc::new(Raised::default());
    let given = Mutex::new([attachments, facts, actions]);
    let prepare = |domain: &mut Domain| -> Result<(), CommandError> {
        let given = std::mem::take(&mut *given.lock().unwrap_or_else(PoisonError::into_inner));
        Python::attach(|py| function::bind(py, domain, given, &raised))
            .map_err(|error| CommandError::BadInput(Python::attach(|py| error.value(py).to_string())))
    };
    let asked =
        GoingOn { folder: &run, said: None, robot: robot.as_deref(), allow_programs, prepare: &prepare };
    let resumed = |stop: &Stop, tell: &mut dyn FnMut(&Event)| {
        runtime()?.block_on(run::resume(&asked, &mut || Ok(()), Watcher { stop, tell }))
    };
    carried_out(py, &raised, on_event.as_ref(), resumed).map(|inner| Report { inner })
}

/// Result of a replay.
#[pyclass(frozen, module = "descry")]
pub struct Replay {
    inner: Replayed,
}

#[pymethods]
impl Replay {
    #[getter]
    fn same(&self) -> bool {
        self.inner.same
    }

    #[getter]
    fn verdict<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        to_python(py, &self.inner.verdict)
    }

    #[getter]
    fn cut_off(&self) -> Option<&str> {
        self.inner.cut_off.as_deref()
    }

    #[getter]
    fn differences(&self) -> Vec<&str> {
        self.inner.differences.iter().map(String::as_str).collect()
    }

    #[getter]
    fn damage(&self) -> Vec<String> {
        self.inner.damage.iter().map(ToString::to_string).collect()
    }

    #[getter]
    fn data<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        to_python(py, &self.inner)
    }

    fn __bool__(&self) -> bool {
        self.inner.same
    }

    fn __repr__(&self) -> String {
        let came = if self.inner.same { "the same" } else { "not the same" };
        format!("<Replay {}: {came}>", self.inner.run)
    }
}

/// Replays a run from its record.
#[pyfunction]
#[pyo3(signature = (run, *, speed, out, on_event))]
pub fn replay(
    py: Python<'_>,
    run: PathBuf,
    speed: Option<f64>,
    out: Option<PathBuf>,
    on_event: Option<Py<PyAny>>,
) -> PyResult<Replay> {
    let asked = played::Replay { run: &run, speed, out: out.as_deref() };
    let replayed = |stop: &Stop, tell: &mut dyn FnMut(&Event)| {
        runtime()?.block_on(played::replay(asked, Watcher { stop, tell }))
    };
    let raised = Raised::default();
    carried_out(py, &raised, on_event.as_ref(), replayed).map(|inner| Replay { inner })
}
