//! Read access to the records of runs.

use std::path::PathBuf;

use descry_agent::keeping;
use descry_agent::run;
use descry_memory::{Error, Near, Order, Query};
use numpy::{PyArray2, PyArrayDyn};
use pyo3::prelude::*;

use crate::arrays;
use crate::convert::to_python;
use crate::failure;

/// Record of a run: data, events and beliefs.
#[pyclass(frozen, module = "descry")]
pub struct Record {
    place: PathBuf,
    inner: descry_memory::Record,
}

fn broken(py: Python<'_>, error: &Error) -> PyErr {
    failure::broken(py, &error.to_string())
}

#[pymethods]
impl Record {
    #[new]
    fn new(py: Python<'_>, place: PathBuf) -> PyResult<Self> {
        let opened = py.detach(|| keeping::open(&place));
        let inner = opened.map_err(|error| failure::command(py, &error))?;
        Ok(Self { place, inner })
    }

    #[getter]
    fn lost(&self) -> Vec<String> {
        self.inner.recovery().faults.iter().map(ToString::to_string).collect()
    }

    #[getter]
    fn stats<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        let stats = py.detach(|| self.inner.stats()).map_err(|error| broken(py, &error))?;
        to_python(py, &stats)
    }

    #[pyo3(signature = (kind=None, *, frame=None, robot=None, from_s=None, to_s=None, seen_from_m=None, covers_m=None, radius_m=0.5, object=None, min_confidence=None, newest=false, limit=None))]
    #[expect(clippy::too_many_arguments, reason = "Python names them")]
    fn query(
        &self,
        py: Python<'_>,
        kind: Option<String>,
        frame: Option<String>,
        robot: Option<String>,
        from_s: Option<f64>,
        to_s: Option<f64>,
        seen_from_m: Option<[f64; 3]>,
        covers_m: Option<[f64; 3]>,
        radius_m: f64,
        object: Option<String>,
        min_confidence: Option<f64>,
        newest: bool,
        limit: Option<usize>,
    ) -> PyResult<Vec<Document>> {
        let near = |place: Option<[f64; 3]>| place.map(|place_m| Near { place_m, radius_m });
        let query = Query {
            kind,
            frame,
            robot,
            from_ns: from_s.map(nanoseconds),
            to_ns: to_s.map(nanoseconds),
            seen_from: near(seen_from_m),
            covers: near(covers_m),
            object,
            min_confidence,
            order: if newest { Order::Newest } else { Order::Oldest },
            limit,
            after: None,
        };
        let found = py.detach(|| self.inner.find(&query)).map_err(|error| broken(py, &error))?;
        Ok(found.into_iter().map(|inner| Document { inner }).collect())
    }

    fn events<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        let (events, lost) = run::events(&self.inner).map_err(|error| failure::command(py, &error))?;
        match lost.first() {
            Some(fault) => Err(failure::broken(py, &fault.to_string())),
            None => to_python(py, &events),
        }
    }

    fn cloud<'py>(&self, py: Python<'py>, document: &Document) -> PyResult<Bound<'py, PyArrayDyn<f32>>> {
        let read = py.detach(|| self.inner.cloud(&document.inner));
        let (cloud, _) = read.map_err(|error| broken(py, &error))?;
        arrays::points(py, &cloud)
    }

    fn colours<'py>(
        &self,
        py: Python<'py>,
        document: &Document,
    ) -> PyResult<Option<Bound<'py, PyArray2<u8>>>> {
        let read = py.detach(|| self.inner.cloud(&document.inner));
        let (cloud, _) = read.map_err(|error| broken(py, &error))?;
        cloud.colours.map(|colours| arrays::colours(py, &colours)).transpose()
    }

    #[pyo3(signature = (document, world="map"))]
    fn world_from_camera<'py>(
        &self,
        py: Python<'py>,
        document: &Document,
        world: &str,
    ) -> PyResult<Bound<'py, PyArray2<f64>>> {
        let pose = py.detach(|| self.inner.pose_of(&document.inner, world));
        arrays::matrix(py, &pose.map_err(|error| broken(py, &error))?)
    }

    fn report<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        to_python(py, &run::report(&self.place).map_err(|error| failure::command(py, &error))?)
    }

    #[pyo3(signature = (*, figures=false))]
    fn explain(&self, py: Python<'_>, figures: bool) -> PyResult<String> {
        let told = || {
            let header = run::header(&self.place)?;
            let report = run::report(&self.place)?;
            descry_explain::of(&self.inner, &header, report.as_ref())
        };
        let told = py.detach(told).map_err(|error| failure::command(py, &error))?;
        Ok(told.text(figures))
    }

    fn verify(&self, py: Python<'_>) -> PyResult<Vec<String>> {
        let report = py.detach(|| self.inner.verify()).map_err(|error| broken(py, &error))?;
        Ok(report.faults.iter().map(ToString::to_string).collect())
    }

    fn __repr__(&self) -> String {
        format!("<Record {}>", self.place.display())
    }
}

fn nanoseconds(seconds: f64) -> i64 {
    (seconds * 1e9).round() as i64
}

/// A document of a record.
#[pyclass(frozen, module = "descry")]
pub struct Document {
    inner: descry_memory::Document,
}

#[pymethods]
impl Document {
    #[getter]
    fn id(&self) -> u64 {
        self.inner.id.0
    }

    #[getter]
    fn kind(&self) -> &str {
        &self.inner.kind
    }

    #[getter]
    fn stamp_ns(&self) -> i64 {
        self.inner.stamp_ns
    }

    #[getter]
    fn frame(&self) -> &str {
        &self.inner.frame
    }

    #[getter]
    fn body<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        to_python(py, &self.inner.body)
    }

    #[getter]
    fn data<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        to_python(py, &self.inner)
    }

    fn __repr__(&self) -> String {
        let seconds = self.inner.stamp_ns as f64 * 1e-9;
        format!("<Document {} {} at {seconds:.3} s>", self.inner.id.0, self.inner.kind)
    }
}
