//! Object recognition in point clouds, without the agent.

use std::path::PathBuf;

use descry_domains::load::{DEFAULT, Domain, objects};
use descry_perception::files::read_cloud as read;
use descry_perception::nalgebra::{Point3, Unit, Vector3};
use descry_perception::recognise::{self as perceived, Descry, ObjectModel, Published, Recogniser};
use descry_perception::segment::{Scene, SceneOptions, segment};
use descry_perception::{View, Visibility};
use numpy::{PyArray1, PyArray2, PyArrayDyn, PyArrayMethods};
use pyo3::prelude::*;

use crate::arrays;
use crate::convert::to_python;
use crate::failure;

/// Recognition result for a cloud.
#[pyclass(frozen, module = "descry")]
pub struct Recognition {
    scene: Option<Scene>,
    percepts: Vec<perceived::Percept>,
    #[pyo3(get)]
    why: Option<String>,
}

#[pymethods]
impl Recognition {
    #[getter]
    fn surface(&self) -> Option<Surface> {
        self.scene.as_ref().map(|scene| Surface { inner: scene.surface.clone() })
    }

    #[getter]
    fn objects(&self) -> Vec<Percept> {
        self.percepts.iter().map(|inner| Percept { inner: inner.clone() }).collect()
    }

    fn __repr__(&self) -> String {
        match &self.why {
            Some(why) => format!("<Recognition: {why}>"),
            None => format!("<Recognition of {} objects on a surface>", self.percepts.len()),
        }
    }
}

/// The surface that supports the objects.
#[pyclass(frozen, module = "descry")]
pub struct Surface {
    inner: descry_perception::surface::Surface,
}

#[pymethods]
impl Surface {
    #[getter]
    fn up<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        arrays::vector(py, &self.inner.up)
    }

    #[getter]
    fn offset_m(&self) -> f64 {
        self.inner.offset_m
    }

    #[getter]
    fn hull_m<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f64>>> {
        let corners: Vec<f64> = self.inner.hull.iter().flat_map(|p| [p.x, p.y, p.z]).collect();
        PyArray1::from_vec(py, corners).reshape([self.inner.hull.len(), 3])
    }

    #[getter]
    fn area_m2(&self) -> f64 {
        self.inner.area_m2
    }

    #[getter]
    fn residual_m(&self) -> f64 {
        self.inner.residual_m
    }

    #[getter]
    fn surface_from_world<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f64>>> {
        arrays::matrix(py, &self.inner.surface_from_world)
    }
}

/// An object on a surface.
#[pyclass(frozen, module = "descry")]
pub struct Percept {
    inner: perceived::Percept,
}

#[pymethods]
impl Percept {
    #[getter]
    fn label(&self) -> Option<&str> {
        self.inner.label.as_deref()
    }

    #[getter]
    fn kind(&self) -> Option<&str> {
        self.inner.kind.as_deref()
    }

    fn probability_of(&self, name: &str) -> f64 {
        self.inner.probability_of(name)
    }

    #[getter]
    fn unknown(&self) -> f64 {
        self.inner.unknown
    }

    #[getter]
    fn position_m<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        arrays::vector(py, &self.inner.position_m.coords)
    }

    #[getter]
    fn position_sigma_m(&self) -> f64 {
        self.inner.position_sigma_m
    }

    #[getter]
    fn size_m<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        arrays::vector(py, &Vector3::from(self.inner.size_m))
    }

    #[getter]
    fn seen_fraction(&self) -> f64 {
        self.inner.seen_fraction
    }

    #[getter]
    fn indices<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<u32>> {
        PyArray1::from_slice(py, &self.inner.indices)
    }

    #[getter]
    fn data<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        to_python(py, &self.inner)
    }

    fn __repr__(&self) -> String {
        let name = self.inner.label.as_deref().unwrap_or("unknown");
        let [x, y, z]: [f64; 3] = self.inner.position_m.coords.into();
        format!("<Percept {name} at ({x:.3}, {y:.3}, {z:.3}) m>")
    }
}

/// Finds the surface in a cloud and recognises the objects on it.
#[pyfunction]
#[pyo3(signature = (points, *, viewpoint_m=[0.0; 3], up=None, objects=None, recogniser="descry", seed=1))]
pub fn recognise(
    py: Python<'_>,
    points: &Bound<'_, PyAny>,
    viewpoint_m: [f64; 3],
    up: Option<[f64; 3]>,
    objects: Option<PathBuf>,
    recogniser: &str,
    seed: u64,
) -> PyResult<Recognition> {
    let cloud = arrays::cloud(py, points)?;
    let models = models(py, objects)?;
    let recogniser: Box<dyn Recogniser + Send + Sync> = match recogniser {
        "descry" => Box::new(Descry::default()),
        "published" => Box::new(Published::default()),
        other => {
            let text = format!("recogniser: there is no {other}\n  expected descry or published");
            return Err(failure::input(py, &text));
        }
    };
    let mut options = SceneOptions::default();
    options.surface.seed = seed;
    options.surface.up = up.map(|up| Unit::new_normalize(Vector3::from(up)));
    if viewpoint_m.iter().chain(up.iter().flatten()).any(|x| !x.is_finite()) || up == Some([0.0; 3]) {
        return Err(failure::input(py, "viewpoint_m, up: not finite\n  expected metres, and a direction"));
    }
    Ok(py.detach(|| {
        // The pixels of an image tell by themselves what was looked through; their camera stands at the origin.
        let view = View::alone(cloud);
        let organised = Visibility::from_views(std::slice::from_ref(&view));
        let eye = Point3::from(viewpoint_m);
        let visibility = match organised.maps.is_empty() {
            false => organised,
            true => Visibility::from_viewpoints(&view.cloud, &[eye]),
        };
        match segment(&view.cloud, &visibility, &options) {
            Ok(scene) => {
                let percepts = recogniser.recognise(&scene, &visibility, &models);
                Recognition { scene: Some(scene), percepts, why: None }
            }
            Err(why) => Recognition { scene: None, percepts: Vec::new(), why: Some(why.to_string()) },
        }
    }))
}

fn models(py: Python<'_>, folder: Option<PathBuf>) -> PyResult<Vec<ObjectModel>> {
    let loaded = match &folder {
        Some(folder) => objects(folder),
        None => Domain::load(DEFAULT).map(|domain| domain.objects),
    };
    loaded.map_err(|error| failure::input(py, &error.to_string()))
}

/// Points of a file, metres, and the position of the sensor.
type Loaded<'py> = (Bound<'py, PyArrayDyn<f32>>, Bound<'py, PyArray1<f64>>);

/// Reads a point cloud file (PCD, PLY, NPY, LAS, XYZ, CSV, PTS); returns the points and the position of the
/// sensor, metres.
#[pyfunction]
pub fn read_cloud<'py>(py: Python<'py>, path: PathBuf) -> PyResult<Loaded<'py>> {
    let shown = path.display();
    let refused = |error: String| {
        failure::input(
            py,
            &format!("{shown}: {error}\n  expected a point cloud: PCD, PLY, NPY, LAS, XYZ, CSV or PTS"),
        )
    };
    let bytes = std::fs::read(&path).map_err(|e| refused(e.to_string()))?;
    let loaded = py.detach(|| read(&bytes)).map_err(|e| refused(e.to_string()))?;
    let viewpoint = arrays::vector(py, &loaded.viewpoint.translation.vector);
    Ok((arrays::points(py, &loaded.cloud)?, viewpoint))
}
