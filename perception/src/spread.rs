//! Second moments of points, and the direction of their least spread.

use nalgebra::{Point3, Vector3};

/// Sums for mean and covariance of points, relative to a reference point, which avoids cancellation.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Moments {
    about: [f64; 3],
    count: f64,
    sum: [f64; 3],
    /// Sums of products: xx xy xz yy yz zz.
    products: [f64; 6],
}

impl Moments {
    pub(crate) fn about(reference: &Point3<f32>) -> Moments {
        let about = [reference.x, reference.y, reference.z].map(f64::from);
        Moments { about, count: 0.0, sum: [0.0; 3], products: [0.0; 6] }
    }

    pub(crate) fn add(&mut self, p: &Point3<f32>) {
        let [x, y, z] = [0, 1, 2].map(|k| f64::from(p[k]) - self.about[k]);
        self.count += 1.0;
        self.sum = [self.sum[0] + x, self.sum[1] + y, self.sum[2] + z];
        for (sum, product) in self.products.iter_mut().zip([x * x, x * y, x * z, y * y, y * z, z * z]) {
            *sum += product;
        }
    }

    pub(crate) fn mean(&self) -> Point3<f64> {
        let [x, y, z] = [0, 1, 2].map(|k| self.about[k] + self.sum[k] / self.count);
        Point3::new(x, y, z)
    }

    /// Covariance of the points: xx xy xz yy yz zz.
    pub(crate) fn covariance(&self) -> [f64; 6] {
        covariance(self.count, self.sum, self.products)
    }
}

/// Covariance (xx xy xz yy yz zz) from the count, sum and sums of products relative to a reference point.
#[inline(always)]
pub(crate) fn covariance(count: f64, sum: [f64; 3], products: [f64; 6]) -> [f64; 6] {
    let per = 1.0 / count;
    let [x, y, z] = [sum[0] * per, sum[1] * per, sum[2] * per];
    [
        products[0] * per - x * x,
        products[1] * per - x * y,
        products[2] * per - x * z,
        products[3] * per - y * y,
        products[4] * per - y * z,
        products[5] * per - z * z,
    ]
}

/// Direction of least spread of points, a unit vector.
#[derive(Clone, Copy, Debug)]
pub struct Least {
    pub normal: [f64; 3],
    /// Least eigenvalue as a share of the eigenvalues' sum: 0 is flat, 1/3 isotropic.
    pub share: f64,
}

/// Minimum ratio of the eigenvalues across and along a line; below it, the spread across is rounding of coordinates.
const COLLINEAR: f64 = 1e-9;

/// Maximum number of Newton steps towards the least eigenvalue; fewer suffice, unless two eigenvalues nearly coincide.
const MOST_STEPS: usize = 40;
/// Step at which the iteration ends; the remaining error is about its square and negligible.
const LAST_STEP: f64 = 1e-8;

/// Direction of least spread of a covariance (xx xy xz yy yz zz); `None` for collinear or
/// coincident points.
#[inline(always)]
pub fn least(c: &[f64; 6]) -> Option<Least> {
    let [least] = least_of(&c.map(|value| [value]));
    least
}

/// Directions of least spread of several covariances, computed side by side; `None` for collinear or coincident points.
///
/// The characteristic polynomial falls and is convex from 0 to its least root, so that Newton's method rises to the
/// root and does not pass it.
#[inline(always)]
pub fn least_of<const N: usize>(c: &[[f64; N]; 6]) -> [Option<Least>; N] {
    let scale = lanes::<N>(|i| c[0][i].max(c[3][i]).max(c[5][i]));
    let per = lanes::<N>(|i| 1.0 / scale[i]);
    let [xx, xy, xz, yy, yz, zz] = c.each_ref().map(|c| lanes::<N>(|i| c[i] * per[i]));
    let trace = lanes::<N>(|i| xx[i] + yy[i] + zz[i]);
    // The sum of products of two eigenvalues each: next to nothing if only one differs from zero.
    let pairs = lanes::<N>(|i| {
        xx[i] * yy[i] + xx[i] * zz[i] + yy[i] * zz[i] - xy[i] * xy[i] - xz[i] * xz[i] - yz[i] * yz[i]
    });
    let determinant = lanes::<N>(|i| {
        xx[i] * (yy[i] * zz[i] - yz[i] * yz[i]) - xy[i] * (xy[i] * zz[i] - yz[i] * xz[i])
            + xz[i] * (xy[i] * yz[i] - yy[i] * xz[i])
    });
    let (mut smallest, mut is_open) = ([0.0; N], [true; N]);
    for _ in 0..MOST_STEPS {
        let step = lanes::<N>(|i| {
            let value = ((trace[i] - smallest[i]) * smallest[i] - pairs[i]) * smallest[i] + determinant[i];
            value / (pairs[i] - (2.0 * trace[i] - 3.0 * smallest[i]) * smallest[i])
        });
        for i in 0..N {
            smallest[i] += if is_open[i] & (step[i] > 0.0) { step[i] } else { 0.0 };
            is_open[i] &= step[i] > LAST_STEP;
        }
        if !is_open.iter().fold(false, |any, open| any | open) {
            break;
        }
    }
    std::array::from_fn(|i| {
        let (x, y, z) = (xx[i] - smallest[i], yy[i] - smallest[i], zz[i] - smallest[i]);
        let rows = [[x, xy[i], xz[i]], [xy[i], y, yz[i]], [xz[i], yz[i], z]];
        let square = |v: [f64; 3]| v[0] * v[0] + v[1] * v[1] + v[2] * v[2];
        let longer = |a: [f64; 3], b: [f64; 3]| if square(b) > square(a) { b } else { a };
        let best = longer(longer(cross(rows[0], rows[1]), cross(rows[0], rows[2])), cross(rows[1], rows[2]));
        let length = square(best).sqrt();
        let per = 1.0 / length;
        let is_told = scale[i] > 0.0
            && scale[i].is_finite()
            && pairs[i] > COLLINEAR / 9.0 * trace[i] * trace[i]
            && length > 0.0;
        let normal = [best[0] * per, best[1] * per, best[2] * per];
        is_told.then_some(Least { normal, share: smallest[i] / trace[i] })
    })
}

#[inline(always)]
fn lanes<const N: usize>(of: impl Fn(usize) -> f64) -> [f64; N] {
    std::array::from_fn(of)
}

#[inline(always)]
fn cross(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}

/// Two unit vectors that make a right-handed frame with a unit normal (Duff et al. 2017).
pub(crate) fn tangents(n: &Vector3<f64>) -> (Vector3<f64>, Vector3<f64>) {
    let sign = 1f64.copysign(n.z);
    let a = -1.0 / (sign + n.z);
    let b = n.x * n.y * a;
    (
        Vector3::new(1.0 + sign * n.x * n.x * a, sign * b, -sign * n.x),
        Vector3::new(b, sign + n.y * n.y * a, -n.y),
    )
}
