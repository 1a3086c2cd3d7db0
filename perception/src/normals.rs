//! Surface normals, pointing towards the sensor.

mod organised;

use crate::neighbours::{Nearby, Neighbours};
use crate::spread;
use nalgebra::{Point3, Vector3};

pub(crate) use organised::organised_where;
pub use organised::{OrganisedOptions, organised};

/// Normal and curvature of the surface at each point.
#[derive(Clone, Debug, PartialEq)]
pub struct Normals {
    /// Unit normals towards the viewpoint; NaN where the neighbourhood is no surface (collinear or coincident points,
    /// no return).
    pub normals: Vec<Vector3<f32>>,
    /// Surface variation (Pauly, Gross, Kobbelt 2002, eq. 3): least eigenvalue over the eigenvalues' sum, from 0 (flat)
    /// to 1/3 (round); NaN where the normal is NaN.
    pub variation: Vec<f32>,
}

/// Estimates normals from the `k` nearest points (itself included), towards `viewpoint` (metres, in the points' frame).
///
/// The normal is NaN where fewer than three neighbours exist or all lie on a line.
pub fn estimate(tree: &Neighbours, k: usize, viewpoint: &Point3<f32>) -> Normals {
    let _span = tracing::debug_span!("normals", points = tree.len(), k).entered();
    let none = [f32::NAN; 4];
    let found = tree.map_all(k, none, |slot, near| surface(tree, slot, near, viewpoint));
    Normals {
        normals: found.iter().map(|v| Vector3::new(v[0], v[1], v[2])).collect(),
        variation: found.iter().map(|v| v[3]).collect(),
    }
}

/// Normal (three numbers) and variation from the neighbours of a point; NaN if they form no surface. `slot`: position
/// of the point in the tree.
#[inline(always)]
fn surface(tree: &Neighbours, slot: usize, near: &Nearby, viewpoint: &Point3<f32>) -> [f32; 4] {
    let at = tree.at(slot);
    let mut sum = [0f32; 3];
    let mut products = [0f32; 6];
    for &slot in near.slots() {
        let p = tree.at(slot as usize);
        let [x, y, z] = [p[0] - at[0], p[1] - at[1], p[2] - at[2]];
        sum = [sum[0] + x, sum[1] + y, sum[2] + z];
        let terms = [x * x, x * y, x * z, y * y, y * z, z * z];
        (0..6).for_each(|i| products[i] += terms[i]);
    }
    let covariance = spread::covariance(near.len() as f64, sum.map(f64::from), products.map(f64::from));
    let Some(least) = spread::least(&covariance) else { return [f32::NAN; 4] };
    let n = least.normal.map(|v| v as f32);
    let away = (0..3).map(|i| n[i] * (viewpoint[i] - at[i])).sum::<f32>() < 0.0;
    let sign = if away { -1.0 } else { 1.0 };
    [sign * n[0], sign * n[1], sign * n[2], least.share as f32]
}
