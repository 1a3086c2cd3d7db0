//! Point clouds and poses as NumPy arrays.

use descry_perception::nalgebra::{Isometry3, Point3, Vector3};
use descry_perception::{Cloud, Grid};
use numpy::{PyArray1, PyArray2, PyArrayDyn, PyArrayMethods, PyReadonlyArrayDyn, PyUntypedArrayMethods};
use pyo3::prelude::*;

use crate::failure;

/// Converts an array to a cloud: N x 3, or height x width x 3 for the pixels of an image, metres, NaN without
/// a return.
pub fn cloud(py: Python<'_>, points: &Bound<'_, PyAny>) -> PyResult<Cloud> {
    let wrong = |found: String| {
        let text = format!(
            "points: {found}\n  expected an array of floats, N x 3, or height x width x 3 for an image"
        );
        failure::input(py, &text)
    };
    let numpy = py.import("numpy")?;
    let array = numpy.call_method1("ascontiguousarray", (points, numpy.getattr("float32")?));
    let array = array.map_err(|e| wrong(e.to_string()))?;
    let array: PyReadonlyArrayDyn<'_, f32> = array.extract()?;
    let shape = array.shape().to_vec();
    let grid = match shape[..] {
        [_, 3] => None,
        [height, width, 3] => Some(Grid { width, height }),
        _ => return Err(wrong(format!("the shape is {shape:?}"))),
    };
    let values = array.as_slice().map_err(|e| wrong(e.to_string()))?;
    let points: Vec<Point3<f32>> = values.chunks_exact(3).map(|p| Point3::new(p[0], p[1], p[2])).collect();
    let is_measured = |p: &Point3<f32>| p.iter().all(|x| x.is_finite());
    if grid.is_none() && !points.iter().all(is_measured) {
        let text = "points: some are not finite\n  expected finite numbers: NaN stands for a pixel without a \
                    return in arrays of height x width x 3 alone";
        return Err(failure::input(py, text));
    }
    Ok(Cloud { points, grid, ..Cloud::default() })
}

/// Converts the points of a cloud to an array, N x 3 or height x width x 3, metres.
pub fn points<'py>(py: Python<'py>, cloud: &Cloud) -> PyResult<Bound<'py, PyArrayDyn<f32>>> {
    let values: Vec<f32> = cloud.points.iter().flat_map(|p| [p.x, p.y, p.z]).collect();
    let shape = match cloud.grid {
        Some(Grid { width, height }) => vec![height, width, 3],
        None => vec![cloud.points.len(), 3],
    };
    PyArray1::from_vec(py, values).reshape(shape)
}

/// Converts colours to an array, N x 3: red, green, blue.
pub fn colours<'py>(py: Python<'py>, colours: &[[u8; 3]]) -> PyResult<Bound<'py, PyArray2<u8>>> {
    PyArray1::from_vec(py, colours.concat()).reshape([colours.len(), 3])
}

/// Converts a transform to a homogeneous matrix, 4 x 4.
pub fn matrix<'py>(py: Python<'py>, transform: &Isometry3<f64>) -> PyResult<Bound<'py, PyArray2<f64>>> {
    // nalgebra keeps columns together, NumPy rows.
    let rows: Vec<f64> = transform.to_homogeneous().transpose().iter().copied().collect();
    PyArray1::from_vec(py, rows).reshape([4, 4])
}

/// Converts a point or a direction to an array of 3.
pub fn vector<'py>(py: Python<'py>, vector: &Vector3<f64>) -> Bound<'py, PyArray1<f64>> {
    PyArray1::from_slice(py, vector.as_slice())
}
