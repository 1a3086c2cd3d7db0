//! How points spread: running second moments and the direction in which they spread least.

use nalgebra::{Point3, Vector3};

/// Sums from which mean and covariance follow, taken about a reference point so that nothing cancels.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Moments {
    about: [f64; 3],
    count: f64,
    sum: [f64; 3],
    /// xx xy xz yy yz zz.
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

    /// xx xy xz yy yz zz about the mean.
    pub(crate) fn covariance(&self) -> [f64; 6] {
        covariance(self.count, self.sum, self.products)
    }
}

/// Covariance (xx xy xz yy yz zz) from a count, the sum and the sums of products about any one reference.
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

/// The direction of least spread.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Least {
    pub normal: [f64; 3],
    /// Least eigenvalue as a part of all three: 0 flat, 1/3 round.
    pub share: f64,
}

/// Spread across a line below this part of the spread along it is rounding of coordinates, not a surface.
const COLLINEAR: f64 = 1e-9;

/// Newton's steps towards the least eigenvalue; from a few on they change nothing, but where two of them are nearly the same.
const MOST_STEPS: usize = 40;
/// What is left after so small a step is its square: nothing.
const LAST_STEP: f64 = 1e-8;

/// Direction of least spread of a covariance (xx xy xz yy yz zz); `None` if the points lie on a line or in one place.
///
/// The characteristic polynomial falls and is convex from 0 to its least root: Newton's method rises to it and does not pass it.
#[inline(always)]
pub(crate) fn least(c: &[f64; 6]) -> Option<Least> {
    let scale = c[0].max(c[3]).max(c[5]);
    if !(scale > 0.0 && scale.is_finite()) {
        return None;
    }
    let per = 1.0 / scale;
    let [xx, xy, xz, yy, yz, zz] = [c[0] * per, c[1] * per, c[2] * per, c[3] * per, c[4] * per, c[5] * per];
    let trace = xx + yy + zz;
    // The sum of products of two eigenvalues each: next to nothing if only one differs from zero.
    let pairs = xx * yy + xx * zz + yy * zz - xy * xy - xz * xz - yz * yz;
    if pairs.is_nan() || pairs <= COLLINEAR / 9.0 * trace * trace {
        return None;
    }
    let determinant = xx * (yy * zz - yz * yz) - xy * (xy * zz - yz * xz) + xz * (xy * yz - yy * xz);
    let mut smallest = 0.0;
    for _ in 0..MOST_STEPS {
        let value = ((trace - smallest) * smallest - pairs) * smallest + determinant;
        let step = value / (pairs - (2.0 * trace - 3.0 * smallest) * smallest);
        smallest += if step > 0.0 { step } else { 0.0 };
        if step.is_nan() || step <= LAST_STEP {
            break;
        }
    }
    let rows = [[xx - smallest, xy, xz], [xy, yy - smallest, yz], [xz, yz, zz - smallest]];
    let square = |v: [f64; 3]| v[0] * v[0] + v[1] * v[1] + v[2] * v[2];
    let longer = |a: [f64; 3], b: [f64; 3]| if square(b) > square(a) { b } else { a };
    let best = longer(longer(cross(rows[0], rows[1]), cross(rows[0], rows[2])), cross(rows[1], rows[2]));
    let length = square(best).sqrt();
    let per = 1.0 / length;
    let normal = [best[0] * per, best[1] * per, best[2] * per];
    (length > 0.0).then_some(Least { normal, share: smallest / trace })
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

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::Matrix3;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn agrees_with_an_iterative_solver(v in proptest::array::uniform9(-1.0f64..1.0)) {
            let a = Matrix3::from_row_slice(&v);
            let m = a.transpose() * a;
            let c = [m[(0, 0)], m[(0, 1)], m[(0, 2)], m[(1, 1)], m[(1, 2)], m[(2, 2)]];
            let values = m.symmetric_eigenvalues();
            let mut sorted = [values[0], values[1], values[2]];
            sorted.sort_by(f64::total_cmp);
            prop_assume!(sorted[1] > 1e-3 && sorted[1] - sorted[0] > 1e-3);
            let found = least(&c).unwrap();
            let n = Vector3::from(found.normal);
            prop_assert!((m * n - n * sorted[0]).norm() < 1e-6);
        }
    }

    #[test]
    fn no_direction_for_a_line_or_a_place() {
        assert!(least(&[1.0, 0.0, 0.0, 0.0, 0.0, 0.0]).is_none());
        assert!(least(&[0.0; 6]).is_none());
        assert!(least(&[f64::NAN; 6]).is_none());
        assert!(least(&[1.0, 0.0, 0.0, 1.0, 0.0, 0.0]).is_some_and(|l| l.normal[2].abs() == 1.0));
    }
}
