//! The points that can lie on the side of a body, coordinate by coordinate, and sums over them.

use super::{OUTSIDE_M, Round, distance, side_band};
use nalgebra::{Matrix4, Point3, Vector4};

/// Points that are summed up side by side. From: work.
const LANES: usize = 4;

type Lanes = [f64; LANES];

/// Filled up with NaN, which is on no side.
pub(super) struct Side {
    x: Vec<f64>,
    y: Vec<f64>,
    z: Vec<f64>,
    len: usize,
}

/// What a step of a fit needs to know of the points near the side of a body.
pub(super) struct Sums {
    /// Of the products of what the distance of a point from the side grows with as axis, radius and slope fall.
    pub normal: Matrix4<f64>,
    /// Of the same times the distance.
    pub right: Vector4<f64>,
    /// Of the squared distances.
    pub squares: f64,
    pub count: f64,
    /// Of the squared distances of all points that are not inside, each at most [`OUTSIDE_M`].
    pub spread: f64,
    /// How many those are.
    pub outside: f64,
}

impl Side {
    /// The points between base and top that can lie on the side.
    pub fn between(points: &[Point3<f64>], base_m: f64, top_m: f64) -> Side {
        let band = side_band(base_m, top_m);
        let column = || Vec::with_capacity(points.len().next_multiple_of(LANES));
        let (mut x, mut y, mut z) = (column(), column(), column());
        for p in points.iter().filter(|p| band.contains(&p.z)) {
            x.push(p.x);
            y.push(p.y);
            z.push(p.z);
        }
        let len = x.len();
        for column in [&mut x, &mut y, &mut z] {
            column.resize(len.next_multiple_of(LANES), f64::NAN);
        }
        Side { x, y, z, len }
    }

    pub fn len(&self) -> usize {
        self.len
    }

    /// A point's place seen from above.
    pub fn place(&self, i: usize) -> [f64; 2] {
        [self.x[i], self.y[i]]
    }

    /// The same side with every so manieth point: so many, or less than twice as many.
    pub fn thinned(&self, to: usize) -> Side {
        let stride = (self.len / to).max(1);
        let len = self.len.div_ceil(stride);
        let pick = |column: &[f64]| {
            let mut few: Vec<f64> = Vec::with_capacity(len.next_multiple_of(LANES));
            few.extend(column[..self.len].iter().step_by(stride));
            few.resize(len.next_multiple_of(LANES), f64::NAN);
            few
        };
        Side { x: pick(&self.x), y: pick(&self.y), z: pick(&self.z), len }
    }

    /// How well a circle explains the points, seen from above; `None` if not better than `best`.
    pub fn score(&self, [x, y, r]: [f64; 3], tolerance: f64, best: f64) -> Option<f64> {
        /// What a point inside of the circle says against it: less than one outside, a half. From: chosen.
        const INSIDE: f64 = 0.15;
        /// Points after which a circle may be left. From: work.
        const BLOCK: usize = 16;
        /// A score that is no more than this below the best may be it. From: rounding.
        const ROUNDING: f64 = 1e-6;
        let mut score = 0.0;
        let mut left = self.len;
        for (xs, ys) in self.x[..self.len].chunks(BLOCK).zip(self.y[..self.len].chunks(BLOCK)) {
            if score + left as f64 + ROUNDING < best {
                return None;
            }
            let mut claims = [0.0; BLOCK];
            for ((claim, px), py) in claims.iter_mut().zip(xs).zip(ys) {
                let d = distance(px - x, py - y) - r;
                // Inside may be the inside of a vessel; outside can only be a handle or another body.
                let off = if d > 0.0 { -0.5 } else { -INSIDE };
                *claim = if d.abs() < tolerance { 1.0 - (d / tolerance).powi(2) } else { off };
            }
            claims.iter().for_each(|claim| score += claim);
            left -= xs.len();
        }
        (score > best).then_some(score)
    }

    /// Sums over the points within `gate` of the side of a body.
    pub fn sums(&self, round: &Round, gate: f64) -> Sums {
        let mut sums = [[0.0; LANES]; 17];
        let columns = [&self.x, &self.y, &self.z].map(|column| column.as_chunks::<LANES>().0);
        for ((x, y), z) in columns[0].iter().zip(columns[1]).zip(columns[2]) {
            for (sum, term) in sums.iter_mut().zip(terms(round, gate, [x, y, z])) {
                *sum = lanes(|i| sum[i] + term[i]);
            }
        }
        let [count, x, y, z, xx, xy, xz, yy, yz, zz, r, xr, yr, zr, squares, outside, spread] =
            sums.map(|lanes| lanes.iter().sum::<f64>());
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

#[inline(always)]
fn lanes(of: impl Fn(usize) -> f64) -> Lanes {
    std::array::from_fn(of)
}

/// What each point adds to the sums: the products of the outward normal, the rise above the middle and the distance from the side, if it is
/// near, and its square if it is not inside.
#[inline(always)]
fn terms(round: &Round, gate: f64, [x, y, z]: [&Lanes; 3]) -> [Lanes; 17] {
    /// Nearer to the axis there is no direction away from it, metres. From: rounding.
    const AT_AXIS_M: f64 = 1e-9;
    let (dx, dy) = (lanes(|i| x[i] - round.x), lanes(|i| y[i] - round.y));
    let d = lanes(|i| distance(dx[i], dy[i]));
    let d = lanes(|i| if d[i] > AT_AXIS_M { d[i] } else { AT_AXIS_M });
    let rise = lanes(|i| z[i] - round.middle_m);
    let residual = lanes(|i| d[i] - round.radius_m - round.slope * rise[i]);
    let near = |value: Lanes| lanes(|i| if residual[i].abs() <= gate { value[i] } else { 0.0 });
    let count = near([1.0; LANES]);
    let (nx, ny) = (near(lanes(|i| dx[i] / d[i])), near(lanes(|i| dy[i] / d[i])));
    let (nz, r) = (near(rise), near(residual));
    let times = |a: &Lanes, b: &Lanes| lanes(|i| a[i] * b[i]);
    let beside = |value: Lanes| lanes(|i| if residual[i] > -gate { value[i] } else { 0.0 });
    let miss = lanes(|i| if residual[i] < OUTSIDE_M { residual[i] } else { OUTSIDE_M });
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
