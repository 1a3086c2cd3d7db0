//! Tasks and plans.

use std::path::{Path, PathBuf};

use descry_planner::{Findings, Source};
use pyo3::prelude::*;

use crate::failure::{self, Finding};

/// PDDL domain and problem, parsed and checked.
#[pyclass(frozen, module = "descry")]
pub struct Task {
    pub inner: descry_planner::Task,
}

#[pymethods]
impl Task {
    #[new]
    fn new(py: Python<'_>, domain: &str, problem: &str) -> PyResult<Self> {
        Self::of(py, &Source::new("domain", domain), &Source::new("problem", problem))
    }

    #[staticmethod]
    fn read(py: Python<'_>, domain: PathBuf, problem: PathBuf) -> PyResult<Self> {
        Self::of(py, &source(py, &domain)?, &source(py, &problem)?)
    }

    #[getter]
    fn domain(&self) -> &str {
        &self.inner.domain
    }

    #[getter]
    fn problem(&self) -> &str {
        &self.inner.problem
    }

    #[getter]
    fn is_temporal(&self) -> bool {
        self.inner.is_temporal()
    }

    #[getter]
    fn actions(&self) -> Vec<&str> {
        self.inner.actions.iter().map(|action| action.name.as_str()).collect()
    }

    #[getter]
    fn objects(&self) -> Vec<&str> {
        self.inner.objects.iter().map(|object| object.name.as_str()).collect()
    }

    #[getter]
    fn modules(&self) -> Vec<&str> {
        self.inner.modules.iter().map(|module| module.name.as_str()).collect()
    }

    fn __repr__(&self) -> String {
        format!("<Task {} of domain {}>", self.inner.problem, self.inner.domain)
    }
}

impl Task {
    fn of(py: Python<'_>, domain: &Source, problem: &Source) -> PyResult<Self> {
        let read = py.detach(|| descry_planner::Task::read(domain, problem));
        read.map(|inner| Self { inner }).map_err(|found| failure::findings(py, &found))
    }
}

/// Reads a text file.
pub fn source(py: Python<'_>, path: &Path) -> PyResult<Source> {
    let text = std::fs::read_to_string(path).map_err(|e| {
        failure::input(py, &format!("{}: {e}\n  expected the path of a text file", path.display()))
    })?;
    Ok(Source::new(path.display().to_string(), text))
}

/// Checks a PDDL domain, and a problem of that domain if one is given; returns all findings.
#[pyfunction]
#[pyo3(signature = (domain, problem=None))]
pub fn check(domain: &str, problem: Option<&str>) -> Vec<Finding> {
    let problem = problem.map(|text| Source::new("problem", text));
    let found: Findings = descry_planner::check(&Source::new("domain", domain), problem.as_ref());
    Finding::all(&found)
}

/// One step of a plan.
#[pyclass(frozen, get_all, eq, module = "descry", skip_from_py_object)]
#[derive(Clone, PartialEq)]
pub struct Step {
    action: String,
    arguments: Vec<String>,
    start_s: Option<f64>,
    duration_s: f64,
}

#[pymethods]
impl Step {
    #[new]
    #[pyo3(signature = (action, arguments=Vec::new(), start_s=None, duration_s=0.0))]
    fn new(action: String, arguments: Vec<String>, start_s: Option<f64>, duration_s: f64) -> Self {
        Self { action, arguments, start_s, duration_s }
    }

    fn __str__(&self) -> String {
        let steps = vec![self.into()];
        descry_planner::Plan { steps, cost: None }.to_string().trim_end().into()
    }

    fn __repr__(&self) -> String {
        format!("<Step {}>", self.__str__())
    }
}

impl From<&descry_planner::Step> for Step {
    fn from(step: &descry_planner::Step) -> Self {
        let descry_planner::Step { start_s, action, arguments, duration_s } = step.clone();
        Self { action, arguments, start_s, duration_s }
    }
}

impl From<&Step> for descry_planner::Step {
    fn from(step: &Step) -> Self {
        let Step { action, arguments, start_s, duration_s } = step.clone();
        Self { start_s, action, arguments, duration_s }
    }
}

/// A plan: steps with their start times.
#[pyclass(frozen, eq, module = "descry", skip_from_py_object)]
#[derive(Clone, PartialEq)]
pub struct Plan {
    pub inner: descry_planner::Plan,
}

#[pymethods]
impl Plan {
    #[new]
    #[pyo3(signature = (steps, cost=None))]
    fn new(steps: Vec<PyRef<'_, Step>>, cost: Option<f64>) -> Self {
        let steps = steps.iter().map(|step| (&**step).into()).collect();
        Self { inner: descry_planner::Plan { steps, cost } }
    }

    #[staticmethod]
    fn parse(py: Python<'_>, text: &str) -> PyResult<Self> {
        Self::of(py, &Source::new("plan", text))
    }

    #[staticmethod]
    fn read(py: Python<'_>, path: PathBuf) -> PyResult<Self> {
        Self::of(py, &source(py, &path)?)
    }

    #[getter]
    fn steps(&self) -> Vec<Step> {
        self.inner.steps.iter().map(Step::from).collect()
    }

    #[getter]
    fn cost(&self) -> Option<f64> {
        self.inner.cost
    }

    #[getter]
    fn makespan_s(&self) -> Option<f64> {
        self.inner.makespan_s()
    }

    fn gantt(&self) -> String {
        descry_pages::gantt::svg(&self.inner)
    }

    fn __len__(&self) -> usize {
        self.inner.steps.len()
    }

    fn __str__(&self) -> String {
        self.inner.to_string()
    }

    fn __repr__(&self) -> String {
        let cost = self.inner.cost.map_or(String::new(), |cost| format!(", cost {cost}"));
        format!("<Plan of {} steps{cost}>", self.inner.steps.len())
    }
}

impl Plan {
    fn of(py: Python<'_>, source: &Source) -> PyResult<Self> {
        let read = descry_planner::Plan::read(source);
        read.map(|inner| Self { inner }).map_err(|found| failure::findings(py, &found))
    }
}
