//! Normal equations of one iteration, and the resulting motion.

use nalgebra::{
    Isometry3, Matrix3, Matrix6, Point3, Rotation3, SymmetricEigen, Translation3, UnitQuaternion, Vector3,
    Vector6,
};

/// Sums over correspondences for one step. A motion is a small rotation, then a shift, about a
/// centre in the target's frame.
#[derive(Clone, Copy)]
pub(crate) struct Sums {
    pub matched: usize,
    /// Sum of squared residuals, without weights, square metres.
    pub square: f64,
    /// Upper triangle of the normal matrix, row by row.
    h: [f64; 21],
    /// Weighted sum of the derivatives times the residuals.
    g: [f64; 6],
    /// Sum of weights; this and the following fields serve the closed form of point to point.
    weight: f64,
    /// Weighted sum of the source points, relative to the centre.
    source: [f64; 3],
    /// Weighted sum of the target points, relative to the centre.
    target: [f64; 3],
    /// Weighted sums of products of a target coordinate (row) and a source coordinate (column).
    cross: [[f64; 3]; 3],
    /// Weighted products of source points with themselves: xx xy xz yy yz zz.
    spread: [f64; 6],
}

impl Sums {
    pub(crate) const ZERO: Sums = Sums {
        matched: 0,
        square: 0.0,
        h: [0.0; 21],
        g: [0.0; 6],
        weight: 0.0,
        source: [0.0; 3],
        target: [0.0; 3],
        cross: [[0.0; 3]; 3],
        spread: [0.0; 6],
    };

    /// Adds a residual `r` with the derivative `j` by the motion (rotation, then shift).
    #[inline(always)]
    pub(crate) fn add_scalar(&mut self, j: [f64; 6], r: f64, weight: f64) {
        self.matched += 1;
        self.square += r * r;
        let mut at = 0;
        for row in 0..6 {
            let wj = weight * j[row];
            self.g[row] += wj * r;
            for &column in &j[row..] {
                self.h[at] += wj * column;
                at += 1;
            }
        }
    }

    /// Adds a source point `p` and its target point `t`, relative to the centre, for the closed
    /// form of point to point.
    #[inline(always)]
    pub(super) fn add_points(&mut self, p: [f64; 3], t: [f64; 3], weight: f64) {
        self.matched += 1;
        self.weight += weight;
        for k in 0..3 {
            self.square += (p[k] - t[k]) * (p[k] - t[k]);
            self.source[k] += weight * p[k];
            self.target[k] += weight * t[k];
            for (sum, source) in self.cross[k].iter_mut().zip(&p) {
                *sum += weight * t[k] * source;
            }
        }
        let products = [p[0] * p[0], p[0] * p[1], p[0] * p[2], p[1] * p[1], p[1] * p[2], p[2] * p[2]];
        for (sum, product) in self.spread.iter_mut().zip(&products) {
            *sum += weight * product;
        }
    }

    /// Normal matrix of point pairs, J = [−[p]×, I], from their sums.
    fn point_information(&self) -> Matrix6<f64> {
        let [xx, xy, xz, yy, yz, zz] = self.spread;
        let turn = Matrix3::new(yy + zz, -xy, -xz, -xy, xx + zz, -yz, -xz, -yz, xx + yy);
        let mixed = Vector3::from(self.source).cross_matrix();
        let mut full = Matrix6::from_diagonal_element(self.weight);
        full.fixed_view_mut::<3, 3>(0, 0).copy_from(&turn);
        full.fixed_view_mut::<3, 3>(0, 3).copy_from(&mixed);
        full.fixed_view_mut::<3, 3>(3, 0).copy_from(&mixed.transpose());
        full
    }

    /// Adds a difference `d` of two points relative to the centre (`p`: the moved one), weighted by
    /// the symmetric matrix `m` (xx xy xz yy yz zz).
    #[inline(always)]
    pub(super) fn add_weighted(&mut self, p: [f64; 3], d: [f64; 3], m: [f64; 6], weight: f64) {
        let [x, y, z] = p;
        let m = [m[0] * weight, m[1] * weight, m[2] * weight, m[3] * weight, m[4] * weight, m[5] * weight];
        let row = [[m[0], m[1], m[2]], [m[1], m[3], m[4]], [m[2], m[4], m[5]]];
        let dot = |a: [f64; 3], b: [f64; 3]| a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
        // With A = [p]x: H = [A M Aᵀ, A M; ·, M] and g = [A M d; M d].
        let md = [dot(row[0], d), dot(row[1], d), dot(row[2], d)];
        let left = |v: [f64; 3]| [y * v[2] - z * v[1], z * v[0] - x * v[2], x * v[1] - y * v[0]];
        // M is symmetric: its rows are its columns. am[r][k] = (A M)(r, k).
        let (a, b, c) = (left(row[0]), left(row[1]), left(row[2]));
        let am = [[a[0], b[0], c[0]], [a[1], b[1], c[1]], [a[2], b[2], c[2]]];
        let ama = [left(am[0]), left(am[1]), left(am[2])];
        let turn = left(md);
        let terms = [
            ama[0][0], ama[0][1], ama[0][2], am[0][0], am[0][1], am[0][2], //
            ama[1][1], ama[1][2], am[1][0], am[1][1], am[1][2], //
            ama[2][2], am[2][0], am[2][1], am[2][2], //
            m[0], m[1], m[2], m[3], m[4], m[5],
        ];
        for (sum, term) in self.h.iter_mut().zip(&terms) {
            *sum += term;
        }
        for k in 0..3 {
            self.g[k] += turn[k];
            self.g[k + 3] += md[k];
        }
    }

    /// Counts a correspondence and its squared residual, which [`Sums::add_weighted`] does not.
    #[inline(always)]
    pub(super) fn count(&mut self, square: f64) {
        self.matched += 1;
        self.square += square;
    }

    pub(super) fn join(mut self, other: &Sums) -> Sums {
        self.matched += other.matched;
        self.square += other.square;
        self.weight += other.weight;
        self.h.iter_mut().zip(other.h).for_each(|(a, b)| *a += b);
        self.g.iter_mut().zip(other.g).for_each(|(a, b)| *a += b);
        self.source.iter_mut().zip(other.source).for_each(|(a, b)| *a += b);
        self.target.iter_mut().zip(other.target).for_each(|(a, b)| *a += b);
        self.spread.iter_mut().zip(other.spread).for_each(|(a, b)| *a += b);
        self.cross.iter_mut().flatten().zip(other.cross.iter().flatten()).for_each(|(a, b)| *a += b);
        self
    }

    /// Right-hand side: weighted sum of the derivatives times the residuals.
    pub(crate) fn right(&self) -> Vector6<f64> {
        Vector6::from(self.g)
    }

    /// Normal matrix.
    pub(crate) fn information(&self) -> Matrix6<f64> {
        let mut full = Matrix6::zeros();
        let mut at = 0;
        for row in 0..6 {
            for column in row..6 {
                full[(row, column)] = self.h[at];
                full[(column, row)] = self.h[at];
                at += 1;
            }
        }
        full
    }

    /// Least-squares motion from the normal matrix, zero along unconstrained directions.
    pub(super) fn motion(&self, centre: &Point3<f64>) -> Motion {
        let information = self.information();
        let (inverse, free) = held_inverse(&information);
        let twist = inverse * self.right();
        let rotation = UnitQuaternion::from_scaled_axis(Vector3::new(twist[0], twist[1], twist[2]));
        Motion::about(centre, rotation, Vector3::new(twist[3], twist[4], twist[5]), free, information)
    }

    /// Least-squares rotation and shift between corresponding points (Arun, Huang, Blostein 1987;
    /// Umeyama 1991 for the sign).
    pub(super) fn closed_form(&self, centre: &Point3<f64>) -> Motion {
        let per = 1.0 / self.weight;
        let source = Vector3::from(self.source) * per;
        let target = Vector3::from(self.target) * per;
        let cross = Matrix3::from_fn(|r, c| self.cross[r][c] * per - target[r] * source[c]);
        let svd = cross.svd(true, true);
        let information = self.point_information();
        let (_, free) = held_inverse(&information);
        let rotation = match (svd.u, svd.v_t) {
            (Some(u), Some(v_t)) if free == 0 => {
                let sign = (u * v_t).determinant().signum();
                let flip = Matrix3::from_diagonal(&Vector3::new(1.0, 1.0, sign));
                let (u, v_t) = ordered(u, v_t, &svd.singular_values);
                UnitQuaternion::from_rotation_matrix(&Rotation3::from_matrix_unchecked(u * flip * v_t))
            }
            _ => UnitQuaternion::identity(),
        };
        let shift = target - rotation * source;
        Motion::about(centre, rotation, shift, free, information)
    }
}

/// Least-squares rigid motion from the first to the second point of each pair; `None` if the pairs
/// leave a direction free.
pub(crate) fn rigid(pairs: &[(Point3<f64>, Point3<f64>)]) -> Option<Isometry3<f64>> {
    let n = pairs.len() as f64;
    let centre = Point3::from(pairs.iter().map(|p| p.0.coords).sum::<Vector3<f64>>() / n);
    let mut sums = Sums::ZERO;
    for (from, to) in pairs {
        sums.add_points((from - centre).into(), (to - centre).into(), 1.0);
    }
    let motion = sums.closed_form(&centre);
    let finite = motion.step.to_homogeneous().iter().all(|v| v.is_finite());
    (motion.free == 0 && finite).then_some(motion.step)
}

/// Singular vectors sorted, with the least value last, where a reflection's sign is flipped.
fn ordered(u: Matrix3<f64>, v_t: Matrix3<f64>, values: &Vector3<f64>) -> (Matrix3<f64>, Matrix3<f64>) {
    let mut order = [0, 1, 2];
    order.sort_by(|&a, &b| values[b].total_cmp(&values[a]));
    let (u, v_t) =
        (Matrix3::from_columns(&order.map(|k| u.column(k))), Matrix3::from_rows(&order.map(|k| v_t.row(k))));
    (u, v_t)
}

/// Minimum information of a constrained direction, relative to the best-constrained one (rotations
/// scaled by the typical distance from the centre).
const FREE: f64 = 1e-5;

/// Inverse of a normal matrix on its constrained directions, and the number of unconstrained ones.
pub(super) fn held_inverse(information: &Matrix6<f64>) -> (Matrix6<f64>, usize) {
    let turn = (0..3).map(|k| information[(k, k)]).sum::<f64>();
    let shift = (3..6).map(|k| information[(k, k)]).sum::<f64>();
    if !(shift > 0.0 && turn.is_finite() && shift.is_finite()) {
        return (Matrix6::zeros(), 6);
    }
    // Rotations in units of the typical lever, so that both kinds compare.
    let lever = (turn / shift).sqrt();
    let unit = if lever > 0.0 { 1.0 / lever } else { 1.0 };
    let scale = Matrix6::from_diagonal(&Vector6::new(unit, unit, unit, 1.0, 1.0, 1.0));
    let eigen = SymmetricEigen::new(scale * information * scale);
    let largest = eigen.eigenvalues.amax();
    let free = eigen.eigenvalues.iter().filter(|&&v| v <= FREE * largest).count();
    let inverted = eigen.eigenvalues.map(|v| if v <= FREE * largest { 0.0 } else { 1.0 / v });
    let inverse = eigen.eigenvectors * Matrix6::from_diagonal(&inverted) * eigen.eigenvectors.transpose();
    (scale * inverse * scale, free)
}

/// Change of the pose found in one iteration.
pub(super) struct Motion {
    /// Rigid motion, applied on the left of the present pose.
    pub step: Isometry3<f64>,
    /// Shift of the centre, metres.
    pub shift_m: f64,
    /// Rotation, radians.
    pub turn_rad: f64,
    /// Number of unconstrained directions of motion, of six.
    pub free: usize,
    /// Normal matrix about the centre.
    pub information: Matrix6<f64>,
}

impl Motion {
    fn about(
        centre: &Point3<f64>,
        rotation: UnitQuaternion<f64>,
        shift: Vector3<f64>,
        free: usize,
        information: Matrix6<f64>,
    ) -> Motion {
        let translation = centre.coords - rotation * centre.coords + shift;
        let step = Isometry3::from_parts(Translation3::from(translation), rotation);
        Motion { step, shift_m: shift.norm(), turn_rad: rotation.angle(), free, information }
    }
}
