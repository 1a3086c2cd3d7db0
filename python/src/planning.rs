//! Planning and validation.

use std::collections::BTreeMap;
use std::num::NonZeroUsize;
use std::sync::Arc;
use std::time::Duration;

use descry_planner::{Options, Statistics};
use pyo3::prelude::*;

use crate::attachment;
use crate::convert::to_python;
use crate::failure::{self, Finding};
use crate::task::{Plan, Task};
use crate::watch::Watch;

/// Outcome of planning.
#[pyclass(frozen, module = "descry")]
pub struct Outcome {
    #[pyo3(get)]
    status: &'static str,
    #[pyo3(get)]
    plan: Option<Plan>,
    #[pyo3(get)]
    why: Option<String>,
    #[pyo3(get)]
    findings: Vec<Finding>,
    #[pyo3(get)]
    time_s: f64,
    statistics: Statistics,
}

#[pymethods]
impl Outcome {
    #[getter]
    fn is_optimal(&self) -> bool {
        self.statistics.optimal
    }

    #[getter]
    fn statistics<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        to_python(py, &self.statistics)
    }

    fn __repr__(&self) -> String {
        let plan = self.plan.as_ref().map_or(String::new(), |p| format!(", {} steps", p.inner.steps.len()));
        format!("<Outcome {}{plan}>", self.status)
    }
}

/// Plans a task.
#[pyfunction]
#[pyo3(signature = (task, *, time_limit_s=None, memory_limit_mb=None, anytime=false, seed=0, bound=None, threads=None, attachments=None, on_plan=None, stop=None))]
#[expect(clippy::too_many_arguments, reason = "Python names them")]
pub fn plan(
    py: Python<'_>,
    task: &Task,
    time_limit_s: Option<f64>,
    memory_limit_mb: Option<u64>,
    anytime: bool,
    seed: u64,
    bound: Option<f64>,
    threads: Option<NonZeroUsize>,
    attachments: Option<BTreeMap<String, Py<PyAny>>>,
    on_plan: Option<Py<PyAny>>,
    stop: Option<Py<PyAny>>,
) -> PyResult<Outcome> {
    let limit = time_limit_s.map(Duration::try_from_secs_f64).transpose();
    let limit = limit.map_err(|e| failure::input(py, &format!("time_limit_s: {e}\n  expected seconds")))?;
    let watch = Arc::new(Watch::new(limit, stop));
    let attachments = attachment::bind(py, attachments, &watch);
    let options = Options {
        anytime,
        seed,
        bound,
        threads,
        memory_limit_bytes: memory_limit_mb.map(|mb| mb.saturating_mul(1 << 20)),
        ..Options::default()
    };
    let mut hear = |plan: &descry_planner::Plan| {
        let Some(on_plan) = &on_plan else { return };
        let told = Python::attach(|py| on_plan.call1(py, (Plan { inner: plan.clone() },)).map(drop));
        told.unwrap_or_else(|error| watch.raise(error));
    };
    let planned = py
        .detach(|| descry_planner::plan(&task.inner, &attachments, &options, &|| watch.is_over(), &mut hear));
    let cut_short = watch.end(py)?;
    let outcome = planned.map_err(|error| failure::planning(py, &error))?;
    Ok(told(&outcome, cut_short, watch.elapsed_s()))
}

fn told(outcome: &descry_planner::Outcome, cut_short: bool, time_s: f64) -> Outcome {
    use descry_planner::Outcome as Planned;
    let why = match outcome {
        Planned::Unsolvable { why, .. } => Some(why),
        _ => None,
    };
    let status = match outcome {
        Planned::Unsolvable { .. } => "unsolvable",
        _ if outcome.plan().is_some() => "solved",
        Planned::OutOfMemory { .. } => "out_of_memory",
        _ if cut_short => "out_of_time",
        _ => "undecided",
    };
    Outcome {
        status,
        plan: outcome.plan().map(|plan| Plan { inner: plan.clone() }),
        why: why.map(ToString::to_string),
        findings: why.map(|why| Finding::all(&why.findings)).unwrap_or_default(),
        time_s,
        statistics: outcome.statistics().clone(),
    }
}

/// Verdict of the validator on a plan.
#[pyclass(frozen, get_all, module = "descry")]
pub struct Verdict {
    valid: bool,
    reason: Option<String>,
    step: Option<usize>,
    cost: Option<f64>,
    makespan_s: Option<f64>,
    metric: Option<f64>,
    findings: Vec<Finding>,
}

#[pymethods]
impl Verdict {
    fn __bool__(&self) -> bool {
        self.valid
    }

    fn __repr__(&self) -> String {
        match &self.reason {
            Some(reason) => format!("<Verdict not valid: {reason}>"),
            None => "<Verdict valid>".into(),
        }
    }
}

/// Checks whether a plan is valid and reaches the goal of its task.
#[pyfunction]
#[pyo3(signature = (task, plan, *, attachments=None))]
pub fn validate(
    py: Python<'_>,
    task: &Task,
    plan: &Plan,
    attachments: Option<BTreeMap<String, Py<PyAny>>>,
) -> PyResult<Verdict> {
    let watch = Arc::new(Watch::new(None, None));
    let attachments = attachment::bind(py, attachments, &watch);
    let verdict = py.detach(|| descry_planner::validate(&task.inner, &attachments, &plan.inner));
    watch.end(py)?;
    Ok(Verdict {
        valid: verdict.valid,
        reason: verdict.reason,
        step: verdict.step,
        cost: verdict.cost,
        makespan_s: verdict.makespan,
        metric: verdict.metric,
        findings: Finding::all(&verdict.findings),
    })
}
