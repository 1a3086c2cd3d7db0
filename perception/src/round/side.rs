//! Candidate side points of a body in structure-of-arrays form, and sums over them.

use super::{OUTSIDE_M, Round, side_band};
use nalgebra::{Matrix4, Point3, Vector4};

/// Number of points processed together (SIMD lanes). From: work.
const LANES: usize = 4;

type Lanes = [f32; LANES];

/// Sample of the side points that scores circles, seen from above, with the origin of
/// [`SidePoints`].
pub struct Judges {
    x: Vec<f32>,
    y: Vec<f32>,
}

/// Side points relative to the first one, metres, in single precision (a tenth of a micrometre);
/// padded with NaN, which is on no side.
pub struct SidePoints {
    /// Origin in the surface's frame, metres.
    pub origin: [f64; 3],
    x: Vec<f32>,
    y: Vec<f32>,
    z: Vec<f32>,
    len: usize,
}

/// Sums over the points near the side of a body, for one step of a fit.
pub struct Sums {
    /// Sum of products of the derivatives of a point's distance from the side by axis x, axis y,
    /// radius and slope (normal matrix).
    pub normal: Matrix4<f64>,
    /// Sum of the same derivatives, with reversed sign, times the distances (right-hand side).
    pub right: Vector4<f64>,
    /// Sum of the squared distances.
    pub squares: f64,
    /// Number of points near the side.
    pub count: f64,
    /// Sum of the squared distances of all points not inside, each limited to [`OUTSIDE_M`].
    pub spread: f64,
    /// Number of points that are not inside the body.
    pub outside: f64,
}

impl SidePoints {
    /// Points between base and top that can lie on the side.
    pub fn between(points: &[Point3<f64>], base_m: f64, top_m: f64) -> SidePoints {
        let band = side_band(base_m, top_m);
        let column = || Vec::with_capacity(points.len().next_multiple_of(LANES));
        let (mut x, mut y, mut z) = (column(), column(), column());
        let mut origin = [0.0; 3];
        for p in points.iter().filter(|p| band.contains(&p.z)) {
            if x.is_empty() {
                origin = [p.x, p.y, p.z];
            }
            x.push((p.x - origin[0]) as f32);
            y.push((p.y - origin[1]) as f32);
            z.push((p.z - origin[2]) as f32);
        }
        let len = x.len();
        for column in [&mut x, &mut y, &mut z] {
            column.resize(len.next_multiple_of(LANES), f32::NAN);
        }
        SidePoints { origin, x, y, z, len }
    }

    pub fn len(&self) -> usize {
        self.len
    }

    /// Horizontal position of a point relative to the first one.
    pub fn place(&self, i: usize) -> [f64; 2] {
        [self.x[i], self.y[i]].map(f64::from)
    }

    /// Side with every n-th point, at most `to` of them.
    pub fn thinned(&self, to: usize) -> SidePoints {
        let stride = self.len.div_ceil(to).max(1);
        let len = self.len.div_ceil(stride);
        let pick = |column: &[f32]| {
            let mut few: Vec<f32> = Vec::with_capacity(len.next_multiple_of(LANES));
            few.extend(column[..self.len].iter().step_by(stride));
            few.resize(len.next_multiple_of(LANES), f32::NAN);
            few
        };
        SidePoints { origin: self.origin, x: pick(&self.x), y: pick(&self.y), z: pick(&self.z), len }
    }

    /// Every n-th point, at most `count`, as the sample that scores circles.
    pub fn judges(&self, count: usize) -> Judges {
        let stride = self.len.div_ceil(count).max(1);
        let pick = |column: &[f32]| column[..self.len].iter().step_by(stride).copied().collect();
        Judges { x: pick(&self.x), y: pick(&self.y) }
    }

    /// Sums over the points within `gate` of the side of a body.
    pub fn sums(&self, round: &Round, gate: f64) -> Sums {
        /// Maximum number of lane groups summed in single precision. From: rounding.
        const BLOCK: usize = 64;
        let body = Seen::of(round, gate, self.origin);
        let mut all = [0.0; 17];
        let [x, y, z] = [&self.x, &self.y, &self.z].map(|column| column.as_chunks::<LANES>().0.chunks(BLOCK));
        for ((x, y), z) in x.zip(y).zip(z) {
            let mut sums = [[0.0; LANES]; 17];
            for ((x, y), z) in x.iter().zip(y).zip(z) {
                for (sum, term) in sums.iter_mut().zip(body.terms([x, y, z])) {
                    *sum = lanes(|i| sum[i] + term[i]);
                }
            }
            for (all, sum) in all.iter_mut().zip(sums) {
                *all += f64::from(sum.iter().sum::<f32>());
            }
        }
        let [count, x, y, z, xx, xy, xz, yy, yz, zz, r, xr, yr, zr, squares, outside, spread] = all;
        #[rustfmt::skip]
        let normal = Matrix4::new(
            xx, xy, x,     xz,
            xy, yy, y,     yz,
            x,  y,  count, z,
            xz, yz, z,     zz,
        );
        Sums { normal, right: Vector4::new(xr, yr, r, zr), squares, count, spread, outside }
    }
}

impl Judges {
    /// Score of a circle (centre and radius, metres) for the points seen from above; `None` if not
    /// better than `best`.
    pub fn score(&self, circle: [f64; 3], tolerance: f64, best: f32) -> Option<f32> {
        /// Penalty of a point inside the circle; a point outside costs a half. From: chosen.
        const INSIDE: f32 = 0.15;
        /// Number of points scored between tests whether the circle can still win. From: work.
        const BLOCK: usize = 16;
        /// Score difference within the rounding error. From: rounding.
        const ROUNDING: f32 = 1e-3;
        let ([x, y, r], per_m) = (circle.map(|c| c as f32), (1.0 / tolerance) as f32);
        let claim = |x_m: f32, y_m: f32| {
            let off = ((x_m * x_m + y_m * y_m).sqrt() - r) * per_m;
            // Inside may be the inside of a vessel; outside can only be a handle or another body.
            let beyond = if off > 0.0 { -0.5 } else { -INSIDE };
            if off.abs() < 1.0 { 1.0 - off * off } else { beyond }
        };
        let mut score = 0.0;
        let (xs, last_xs) = self.x.as_chunks::<BLOCK>();
        let (ys, last_ys) = self.y.as_chunks::<BLOCK>();
        let mut left = self.x.len();
        for (xs, ys) in xs.iter().zip(ys) {
            if score + left as f32 + ROUNDING < best {
                return None;
            }
            let claims: [f32; BLOCK] = std::array::from_fn(|i| claim(xs[i] - x, ys[i] - y));
            score += claims.iter().sum::<f32>();
            left -= BLOCK;
        }
        score += last_xs.iter().zip(last_ys).map(|(px, py)| claim(px - x, py - y)).sum::<f32>();
        (score > best).then_some(score)
    }
}

#[inline(always)]
fn lanes(of: impl Fn(usize) -> f32) -> Lanes {
    std::array::from_fn(of)
}

/// Round body relative to the first side point, metres, in single precision.
struct Seen {
    x: f32,
    y: f32,
    middle_m: f32,
    radius_m: f32,
    slope: f32,
    gate: f32,
}

impl Seen {
    fn of(round: &Round, gate: f64, origin: [f64; 3]) -> Seen {
        let [x, y, middle_m] = [round.x - origin[0], round.y - origin[1], round.middle_m - origin[2]];
        let [x, y, middle_m, radius_m, slope, gate] =
            [x, y, middle_m, round.radius_m, round.slope, gate].map(|value| value as f32);
        Seen { x, y, middle_m, radius_m, slope, gate }
    }

    /// Terms of each point for the sums: products of outward normal, height above the middle and
    /// distance from the side, if near; and the square of the distance if not inside.
    #[inline(always)]
    fn terms(&self, [x, y, z]: [&Lanes; 3]) -> [Lanes; 17] {
        /// Distance from the axis below which the direction away from it is undefined, metres.
        /// From: rounding.
        const AT_AXIS_M: f32 = 1e-9;
        /// [`OUTSIDE_M`] in single precision, metres. From: derived, the same.
        const FARTHEST_M: f32 = OUTSIDE_M as f32;
        let (dx, dy) = (lanes(|i| x[i] - self.x), lanes(|i| y[i] - self.y));
        let d = lanes(|i| (dx[i] * dx[i] + dy[i] * dy[i]).sqrt());
        let d = lanes(|i| if d[i] > AT_AXIS_M { d[i] } else { AT_AXIS_M });
        let rise = lanes(|i| z[i] - self.middle_m);
        let residual = lanes(|i| d[i] - self.radius_m - self.slope * rise[i]);
        let near = |value: Lanes| lanes(|i| if residual[i].abs() <= self.gate { value[i] } else { 0.0 });
        let count = near([1.0; LANES]);
        let (nx, ny) = (near(lanes(|i| dx[i] / d[i])), near(lanes(|i| dy[i] / d[i])));
        let (nz, r) = (near(rise), near(residual));
        let times = |a: &Lanes, b: &Lanes| lanes(|i| a[i] * b[i]);
        let beside = |value: Lanes| lanes(|i| if residual[i] > -self.gate { value[i] } else { 0.0 });
        let miss = lanes(|i| if residual[i] < FARTHEST_M { residual[i] } else { FARTHEST_M });
        [
            count,
            nx,
            ny,
            nz,
            times(&nx, &nx),
            times(&nx, &ny),
            times(&nx, &nz),
            times(&ny, &ny),
            times(&ny, &nz),
            times(&nz, &nz),
            r,
            times(&nx, &r),
            times(&ny, &r),
            times(&nz, &r),
            times(&r, &r),
            beside([1.0; LANES]),
            beside(times(&miss, &miss)),
        ]
    }
}
