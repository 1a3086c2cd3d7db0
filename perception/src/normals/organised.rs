//! Normals of organised clouds from the pixels around each point: no tree.

use super::Normals;
use crate::cloud::{Cloud, Grid, is_finite};
use crate::spread;
use nalgebra::{Point3, Vector3};
use rayon::prelude::*;

/// How far to look around a pixel.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct OrganisedOptions {
    /// Pixels to each side: 2 looks at 5 x 5.
    pub reach: usize,
    /// A neighbour counts if its depth differs by no more than this part of the depth (and `base_m`): beyond is another surface.
    pub depth_step_share: f32,
    /// Least depth difference that separates surfaces, metres.
    pub base_m: f32,
    /// Fewest neighbours for a normal.
    pub least: usize,
}

impl Default for OrganisedOptions {
    fn default() -> Self {
        OrganisedOptions { reach: 2, depth_step_share: 0.02, base_m: 0.005, least: 6 }
    }
}

/// Pixels whose windows are summed up together.
const LANES: usize = 16;

/// Normals from the window around each pixel, turned towards the camera; `None` if the cloud has no grid that fits its points.
/// Expects the camera's optical frame (depth along z).
pub fn organised(cloud: &Cloud, options: &OrganisedOptions) -> Option<Normals> {
    let Grid { width, height } = cloud.grid.filter(|_| cloud.check().is_ok())?;
    let _span = tracing::debug_span!("organised normals", points = cloud.len()).entered();
    let image = Image::of(&cloud.points, width, height, options.reach);
    let mut found = vec![[f32::NAN; 4]; cloud.len()];
    found.par_chunks_mut(width.max(1)).enumerate().for_each(|(row, out)| {
        for (group, out) in out.chunks_mut(LANES).enumerate() {
            let sums = image.sums(row, group * LANES, options);
            for (lane, out) in out.iter_mut().enumerate() {
                *out = surface(&cloud.points[row * width + group * LANES + lane], &sums, lane, options);
            }
        }
    });
    Some(Normals {
        normals: found.iter().map(|v| Vector3::new(v[0], v[1], v[2])).collect(),
        variation: found.iter().map(|v| v[3]).collect(),
    })
}

/// The coordinates of an image, each by itself, with a frame of pixels without a return around it.
struct Image {
    planes: [Vec<f32>; 3],
    /// Pixels from row to row.
    pitch: usize,
    reach: usize,
}

/// Which coordinates each product is of: xx xy xz yy yz zz.
const FACTORS: [(usize, usize); 6] = [(0, 0), (0, 1), (0, 2), (1, 1), (1, 2), (2, 2)];

/// Sums over the windows of some pixels beside each other, about the pixels themselves.
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

    /// The sums of the windows around `LANES` pixels from a column on.
    #[inline(always)]
    fn sums(&self, row: usize, column: usize, options: &OrganisedOptions) -> WindowSums {
        let at = self.some((row + self.reach) * self.pitch + column + self.reach);
        let step = at[2].map(|z| options.base_m.max(options.depth_step_share * z.abs()));
        let mut all = WindowSums { count: [0; LANES], sum: [[0.0; LANES]; 3], products: [[0.0; LANES]; 6] };
        for v in row..=row + 2 * self.reach {
            for u in column..=column + 2 * self.reach {
                all.add(&self.some(v * self.pitch + u), &at, &step);
            }
        }
        all
    }
}

impl WindowSums {
    /// Adds a neighbour of each pixel, where its depth is near enough. Lane by lane without a branch.
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
}

fn surface(at: &Point3<f32>, sums: &WindowSums, lane: usize, options: &OrganisedOptions) -> [f32; 4] {
    let none = [f32::NAN; 4];
    if !is_finite(at) || (sums.count[lane] as usize) < options.least.max(3) {
        return none;
    }
    let sum = sums.sum.map(|sum| f64::from(sum[lane]));
    let products = sums.products.map(|sum| f64::from(sum[lane]));
    let covariance = spread::covariance(f64::from(sums.count[lane]), sum, products);
    let Some(least) = spread::least(&covariance) else { return none };
    let n = least.normal.map(|v| v as f32);
    let sign = if n[0] * at.x + n[1] * at.y + n[2] * at.z > 0.0 { -1.0 } else { 1.0 };
    [sign * n[0], sign * n[1], sign * n[2], least.share as f32]
}
