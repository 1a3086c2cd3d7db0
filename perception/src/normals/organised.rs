//! Normals of organised clouds from pixel neighbourhoods, without a search tree.

use super::Normals;
use crate::cloud::{Cloud, Grid};
use crate::pool;
use nalgebra::{Point3, Vector3};

/// Neighbourhood of a pixel that determines its normal.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct OrganisedOptions {
    /// Number of pixels to each side: 2 gives a window of 5 x 5.
    pub reach: usize,
    /// Maximum depth difference between a pixel and a neighbour on the same surface, as a share of the depth, but at
    /// least `base_m`.
    pub depth_step_share: f32,
    /// Depth difference up to which neighbours are on the same surface at any depth, metres.
    pub base_m: f32,
    /// Minimum number of pixels of the window on the same surface for a normal.
    pub least: usize,
}

impl Default for OrganisedOptions {
    fn default() -> Self {
        OrganisedOptions { reach: 2, depth_step_share: 0.02, base_m: 0.005, least: 6 }
    }
}

/// Number of pixels whose windows are summed up together.
const LANES: usize = 16;

/// Normals from the window around each pixel, towards the camera; `None` without a grid that fits
/// the points. Expects the optical frame (depth along z).
pub fn organised(cloud: &Cloud, options: &OrganisedOptions) -> Option<Normals> {
    organised_where(cloud, options, |_| true)
}

/// Normals of the wanted pixels as of [`organised`]; those of others may be missing (NaN).
pub(crate) fn organised_where(
    cloud: &Cloud,
    options: &OrganisedOptions,
    wanted: impl Fn(usize) -> bool + Sync,
) -> Option<Normals> {
    let Grid { width, height } = cloud.grid.filter(|_| cloud.check().is_ok())?;
    let _span = tracing::debug_span!("organised normals", points = cloud.len()).entered();
    let image = Image::of(&cloud.points, width, height, options.reach);
    let mut found = Normals {
        normals: vec![Vector3::repeat(f32::NAN); cloud.len()],
        variation: vec![f32::NAN; cloud.len()],
    };
    let mut rows: Vec<_> =
        found.normals.chunks_mut(width.max(1)).zip(found.variation.chunks_mut(width.max(1))).collect();
    pool::for_each(
        &mut rows,
        1,
        || (),
        |(), row, (normals, variation)| {
            for column in (0..width).step_by(LANES) {
                let pixels = column..width.min(column + LANES);
                if !pixels.clone().any(|column| wanted(row * width + column)) {
                    continue;
                }
                let Some((at, sums)) = image.sums(row, column, options) else { continue };
                let [x, y, z, share] = sums.surfaces(&at, options);
                for (lane, pixel) in pixels.enumerate() {
                    normals[pixel] = Vector3::new(x[lane], y[lane], z[lane]);
                    variation[pixel] = share[lane];
                }
            }
        },
    );
    Some(found)
}

/// Image of points with one array per coordinate, and a border of missing returns.
struct Image {
    planes: [Vec<f32>; 3],
    /// Number of entries from row to row.
    pitch: usize,
    reach: usize,
}

/// Axes of each product: xx xy xz yy yz zz.
const FACTORS: [(usize, usize); 6] = [(0, 0), (0, 1), (0, 2), (1, 1), (1, 2), (2, 2)];

/// Window sums of `LANES` adjacent pixels, relative to the pixels themselves.
struct WindowSums {
    count: [u32; LANES],
    sum: [[f32; LANES]; 3],
    products: [[f32; LANES]; 6],
}

impl Image {
    fn of(points: &[Point3<f32>], width: usize, height: usize, reach: usize) -> Image {
        let pitch = width + 2 * reach + LANES;
        let plane = |axis: usize| {
            let mut plane = vec![f32::NAN; pitch * (height + 2 * reach)];
            for (row, line) in points.chunks_exact(width.max(1)).enumerate() {
                let from = (row + reach) * pitch + reach;
                plane[from..from + width].iter_mut().zip(line).for_each(|(c, p)| *c = p[axis]);
            }
            plane
        };
        Image { planes: [plane(0), plane(1), plane(2)], pitch, reach }
    }

    #[inline(always)]
    fn some(&self, at: usize) -> [[f32; LANES]; 3] {
        self.planes.each_ref().map(|plane| plane[at..].first_chunk().copied().unwrap_or([f32::NAN; LANES]))
    }

    /// Coordinates of `LANES` pixels from a column on, with their window sums; `None` if none has a return.
    #[inline(always)]
    fn sums(
        &self,
        row: usize,
        column: usize,
        options: &OrganisedOptions,
    ) -> Option<([[f32; LANES]; 3], WindowSums)> {
        let at = self.some((row + self.reach) * self.pitch + column + self.reach);
        if at[2].iter().all(|z| z.is_nan()) {
            return None;
        }
        let step = at[2].map(|z| options.base_m.max(options.depth_step_share * z.abs()));
        let mut all = WindowSums { count: [0; LANES], sum: [[0.0; LANES]; 3], products: [[0.0; LANES]; 6] };
        for v in row..=row + 2 * self.reach {
            for u in column..=column + 2 * self.reach {
                all.add(&self.some(v * self.pitch + u), &at, &step);
            }
        }
        Some((at, all))
    }
}

impl WindowSums {
    /// Adds a neighbour of each pixel where its depth is within `step`; branch-free per lane.
    #[inline(always)]
    fn add(&mut self, p: &[[f32; LANES]; 3], at: &[[f32; LANES]; 3], step: &[f32; LANES]) {
        let mut near = [0_u32; LANES];
        for i in 0..LANES {
            near[i] = if (p[2][i] - at[2][i]).abs() <= step[i] { u32::MAX } else { 0 };
        }
        let mut apart = [[0.0; LANES]; 3];
        for axis in 0..3 {
            for i in 0..LANES {
                apart[axis][i] = f32::from_bits((p[axis][i] - at[axis][i]).to_bits() & near[i]);
            }
            self.sum[axis].iter_mut().zip(&apart[axis]).for_each(|(sum, d)| *sum += d);
        }
        self.count.iter_mut().zip(&near).for_each(|(count, near)| *count += near & 1);
        for (sum, (a, b)) in self.products.iter_mut().zip(FACTORS) {
            for i in 0..LANES {
                sum[i] += apart[a][i] * apart[b][i];
            }
        }
    }

    /// Normals towards the camera (three numbers), and the share of the spread along each; NaN if undefined. Equivalent
    /// to [`spread::least`], branch-free per lane.
    #[inline(always)]
    fn surfaces(&self, at: &[[f32; LANES]; 3], options: &OrganisedOptions) -> [[f32; LANES]; 4] {
        /// Number of Newton iterations; enough in single precision, unless two eigenvalues nearly coincide.
        const STEPS: usize = 6;
        /// Minimum sum of products of two eigenvalues, of which all three sum to 1; less is rounding at collinear
        /// points.
        const COLLINEAR: f32 = 1e-6;
        let least_count = options.least.max(3) as f32;
        let mut all = [[f32::NAN; LANES]; 4];
        for i in 0..LANES {
            let count = self.count[i] as f32;
            let per = 1.0 / count;
            let [x, y, z] = [self.sum[0][i] * per, self.sum[1][i] * per, self.sum[2][i] * per];
            let [xx, xy, xz] = [
                self.products[0][i] * per - x * x,
                self.products[1][i] * per - x * y,
                self.products[2][i] * per - x * z,
            ];
            let [yy, yz, zz] = [
                self.products[3][i] * per - y * y,
                self.products[4][i] * per - y * z,
                self.products[5][i] * per - z * z,
            ];
            let per = 1.0 / (xx + yy + zz);
            let [xx, xy, xz, yy, yz, zz] = [xx * per, xy * per, xz * per, yy * per, yz * per, zz * per];
            let pairs = xx * yy + xx * zz + yy * zz - xy * xy - xz * xz - yz * yz;
            let determinant = xx * (yy * zz - yz * yz) - xy * (xy * zz - yz * xz) + xz * (xy * yz - yy * xz);
            let mut smallest = 0.0_f32;
            for _ in 0..STEPS {
                let value = ((1.0 - smallest) * smallest - pairs) * smallest + determinant;
                let step = value / (pairs - (2.0 - 3.0 * smallest) * smallest);
                smallest += if step > 0.0 { step } else { 0.0 };
            }
            let (rx, ry, rz) = (xx - smallest, yy - smallest, zz - smallest);
            // Products of two rows of what is left each; the longest is the surest.
            let a = [xy * yz - xz * ry, xz * xy - rx * yz, rx * ry - xy * xy];
            let b = [xy * rz - xz * yz, xz * xz - rx * rz, rx * yz - xy * xz];
            let c = [ry * rz - yz * yz, yz * xz - xy * rz, xy * yz - ry * xz];
            let square = |v: [f32; 3]| v[0] * v[0] + v[1] * v[1] + v[2] * v[2];
            let longer = |a: [f32; 3], b: [f32; 3]| {
                let second = square(b) > square(a);
                [0, 1, 2].map(|k| if second { b[k] } else { a[k] })
            };
            let [nx, ny, nz] = longer(longer(a, b), c);
            let towards = nx * at[0][i] + ny * at[1][i] + nz * at[2][i];
            let length = (nx * nx + ny * ny + nz * nz).sqrt();
            let is_one = count >= least_count && pairs > COLLINEAR && length > 0.0;
            let per = if is_one { -1_f32.copysign(towards) / length } else { f32::NAN };
            all[0][i] = per * nx;
            all[1][i] = per * ny;
            all[2][i] = per * nz;
            all[3][i] = if is_one { smallest } else { f32::NAN };
        }
        all
    }
}
