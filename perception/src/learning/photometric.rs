//! Photometric alignment of keyframes, where geometry alone lets them slide: a round table can
//! turn, a tin has no distinctive side.
//!
//! The paper refines its keyframes by image patches and adjusts all of them together in the end. Here both are one
//! least-squares problem over all poses, from blurred to sharp images: texture features of one image have the lightness
//! that the other shows there (as in Park, Zhou, Koltun 2017 for two clouds), and points keep to the planes that the
//! other measured.

use crate::cloud::{Grid, is_finite};
use crate::noise::frontal_sigma_m;
use crate::normals::{self, OrganisedOptions};
use crate::pool;
use crate::register::Sums;
use crate::view::View;
use crate::visibility::DepthMap;
use nalgebra::{DMatrix, DVector, Isometry3, Matrix6, Point3, Translation3, UnitQuaternion, Vector3};

/// Half sides of the squares over which images are averaged, pixels, coarse to fine.
const BLURS: [usize; 3] = [5, 2, 1];
/// Maximum number of Gauss-Newton steps at each blur.
const ROUNDS: usize = 5;
/// Side of the squares from which one texture feature and one surface point each are taken, pixels.
const CELL_PX: usize = 12;
/// Minimum lightness gradient at a texture feature, per pixel, where lightness ranges to 255.
const CONTRAST: f32 = 3.0;
/// Scale of lightness differences between views, of 255; larger ones get little weight.
const LIGHTNESS: f32 = 8.0;
/// Minimum tolerance between a feature's predicted depth and the depth measured in the other view, metres; a feature
/// beyond the tolerance is occluded or on another surface.
const NEAR_M: f32 = 0.015;
/// Minimum depth difference between neighbouring pixels of two surfaces, beyond the camera's error, metres.
const STEP_M: f32 = 0.01;
/// Number of correlated measurements (neighbouring pixels) that count as one independent one.
const SHARED: f32 = 12.0;
/// Number of views with the most similar directions that each view is compared with.
const PARTNERS: usize = 6;
/// Minimum number of shared features for a texture constraint between two views.
const FEWEST: usize = 40;
/// Maximum correction of a view, metres and radians; beyond it, the texture probably repeats and
/// the view is not moved.
const FARTHEST: (f64, f64) = (0.03, 0.03);

const WIDE: OrganisedOptions =
    OrganisedOptions { reach: 3, depth_step_share: 0.015, base_m: 0.006, least: 12 };

/// Poses after photometric alignment of the `used` views; unchanged if fewer than two of these have colours. The first
/// view with colours is fixed.
pub(super) fn refined(
    views: &[View],
    poses: &[Isometry3<f64>],
    used: &[bool],
    range_m: f64,
) -> Vec<Isometry3<f64>> {
    let _span = tracing::debug_span!("texture", views = views.len()).entered();
    let look = |n: usize| if used[n] { Look::of(&views[n], range_m as f32) } else { None };
    let looks: Vec<Option<Look>> = pool::each(views.len(), 1, look);
    let active: Vec<usize> = (0..views.len()).filter(|&i| looks[i].is_some()).collect();
    if active.len() < 2 {
        return poses.to_vec();
    }
    let pairs = pairs(&active, poses);
    let mut moved = poses.to_vec();
    for blur in BLURS {
        let images: Vec<Vec<f32>> =
            pool::map(&looks, 1, |l| l.as_ref().map_or(Vec::new(), |l| blurred(&l.light, l.grid, blur)));
        for _ in 0..ROUNDS {
            let links = pool::map(&pairs, 1, |&(i, j)| match (&looks[i], &looks[j]) {
                (Some(a), Some(b)) => link((a, &images[i]), (b, &images[j]), &moved[j].inv_mul(&moved[i])),
                _ => Sums::ZERO,
            });
            if !step(&active, &pairs, &links, &mut moved) {
                break;
            }
        }
    }
    let sound = |i: usize| {
        let by = poses[i].inverse() * moved[i];
        by.translation.vector.norm() < FARTHEST.0 && by.rotation.angle() < FARTHEST.1
    };
    (0..views.len()).map(|i| if sound(i) { moved[i] } else { poses[i] }).collect()
}

/// View prepared for texture comparison.
struct Look {
    map: DepthMap,
    grid: Grid,
    points: Vec<Point3<f32>>,
    normals: Vec<Vector3<f32>>,
    /// Lightness of each pixel, 0 to 255.
    light: Vec<f32>,
    /// True for pixels far enough inside a surface that blur from a depth edge does not reach them.
    inner: Vec<bool>,
    /// Pixels of texture features: the strongest gradient inside a surface in each square.
    marks: Vec<u32>,
    /// Pixels of evenly spread surface points.
    spread: Vec<u32>,
}

impl Look {
    fn of(view: &View, range_m: f32) -> Option<Look> {
        let (grid, colours) = (view.cloud.grid?, view.cloud.colours.as_ref()?);
        let map = DepthMap::from_view(view, &Isometry3::identity())?;
        let normals = normals::organised(&view.cloud, &WIDE)?.normals;
        let light: Vec<f32> = colours
            .iter()
            .map(|c| 0.3 * f32::from(c[0]) + 0.59 * f32::from(c[1]) + 0.11 * f32::from(c[2]))
            .collect();
        let smooth = blurred(&light, grid, 1);
        let inner = inner(&map.depths_m, grid);
        let points = view.cloud.points.clone();
        let usable = |i: usize| is_finite(&points[i]) && points[i].z <= range_m && normals[i].x.is_finite();
        let (mut marks, mut spread) = (Vec::new(), Vec::new());
        for row in (1..grid.height.saturating_sub(CELL_PX)).step_by(CELL_PX) {
            for column in (1..grid.width.saturating_sub(CELL_PX)).step_by(CELL_PX) {
                let mut best = (CONTRAST, None);
                for v in row..row + CELL_PX {
                    for i in v * grid.width + column..v * grid.width + column + CELL_PX {
                        let steep = (smooth[i + 1] - smooth[i - 1])
                            .hypot(smooth[i + grid.width] - smooth[i - grid.width]);
                        if 0.5 * steep > best.0 && inner[i] && usable(i) {
                            best = (0.5 * steep, Some(i as u32));
                        }
                    }
                }
                marks.extend(best.1);
                let middle = (row + CELL_PX / 2) * grid.width + column + CELL_PX / 2;
                spread.extend(usable(middle).then_some(middle as u32));
            }
        }
        Some(Look { map, grid, points, normals, light, inner, marks, spread })
    }

    /// Pixel coordinates (column, row) and pixel index of a camera-frame point; `None` unless the point lies on the
    /// measured surface.
    fn place(&self, q: &Point3<f32>) -> Option<(f32, f32, usize)> {
        let (u, v) = self.map.intrinsics.project(&q.cast())?;
        let at = self.map.intrinsics.pixel(u, v)?;
        let inside =
            u >= 1.0 && v >= 1.0 && u < (self.grid.width - 2) as f64 && v < (self.grid.height - 2) as f64;
        let on = (self.map.depths_m[at] - q.z).abs() < NEAR_M.max(3.0 * frontal_sigma_m(q.z));
        (inside && on).then_some((u as f32, v as f32, at))
    }
}

/// For each pixel, true if no depth edge is within the blur radius; the background at such an edge changes between
/// views.
fn inner(depths_m: &[f32], grid: Grid) -> Vec<bool> {
    let goes_on = |a: f32, b: f32| (a - b).abs() < STEP_M + 6.0 * frontal_sigma_m(a);
    let ends = |i: usize| {
        let beside = (i + 1 < depths_m.len()).then(|| i + 1);
        let below = (i + grid.width < depths_m.len()).then(|| i + grid.width);
        beside.into_iter().chain(below).any(|k| !goes_on(depths_m[i], depths_m[k]))
    };
    let steps: Vec<f32> = (0..depths_m.len()).map(|i| f32::from(u8::from(ends(i)))).collect();
    blurred(&steps, grid, BLURS[0]).into_iter().map(|near| near == 0.0).collect()
}

/// Image averaged over squares that reach `half` pixels to each side.
fn blurred(image: &[f32], grid: Grid, half: usize) -> Vec<f32> {
    let Grid { width, height } = grid;
    let mut rows = vec![0.0; image.len()];
    for v in 0..height {
        for u in 0..width {
            let (low, high) = (u.saturating_sub(half), (u + half + 1).min(width));
            let line = &image[v * width + low..v * width + high];
            rows[v * width + u] = line.iter().sum::<f32>() / line.len() as f32;
        }
    }
    let mut out = vec![0.0; image.len()];
    for v in 0..height {
        let (low, high) = (v.saturating_sub(half), (v + half + 1).min(height));
        for u in 0..width {
            out[v * width + u] = (low..high).map(|w| rows[w * width + u]).sum::<f32>() / (high - low) as f32;
        }
    }
    out
}

/// Bilinearly interpolated value at column `u` and row `v`, with its slopes along rows and along columns.
fn sampled(image: &[f32], width: usize, u: f32, v: f32) -> (f32, f32, f32) {
    let (i, j) = (u as usize, v as usize);
    let (a, b) = (u - i as f32, v - j as f32);
    let at = |di: usize, dj: usize| image[(j + dj) * width + i + di];
    let (p, q, r, s) = (at(0, 0), at(1, 0), at(0, 1), at(1, 1));
    let value = (1.0 - b) * ((1.0 - a) * p + a * q) + b * ((1.0 - a) * r + a * s);
    (value, (1.0 - b) * (q - p) + b * (s - r), (1.0 - a) * (r - p) + a * (s - q))
}

/// Constraints from texture and surface of view `a` on its pose in view `b`, as motions of `a` in the camera frame of
/// `b`.
fn link((a, of_a): (&Look, &[f32]), (b, of_b): (&Look, &[f32]), b_from_a: &Isometry3<f64>) -> Sums {
    let (turn, shift) =
        (b_from_a.rotation.to_rotation_matrix().cast::<f32>(), b_from_a.translation.vector.cast::<f32>());
    let moved = |i: u32| Point3::from(turn * a.points[i as usize].coords + shift);
    let camera = &b.map.intrinsics;
    let (fx, fy, width) = (camera.fx as f32, camera.fy as f32, b.grid.width);
    let mut met = Vec::new();
    for &i in &a.marks {
        let q = moved(i);
        let Some((u, v, at)) = b.place(&q) else { continue };
        // What is seen steeply in one of the looks is blurred otherwise.
        if b.inner[at] && (turn * a.normals[i as usize]).dot(&b.normals[at]) > 0.85 {
            met.push((i, q, sampled(of_b, width, u, v)));
        }
    }
    let mut sums = Sums::ZERO;
    if met.len() >= FEWEST {
        let mut ratios: Vec<f32> = met.iter().map(|(i, _, s)| s.0 / of_a[*i as usize].max(1.0)).collect();
        let middle = ratios.len() / 2;
        let gain = ratios.select_nth_unstable_by(middle, f32::total_cmp).1.clamp(0.6, 1.6);
        for (i, q, (light, du, dv)) in met {
            let residual = light - gain * of_a[i as usize];
            let slope =
                Vector3::new(du * fx / q.z, dv * fy / q.z, -(du * fx * q.x + dv * fy * q.y) / (q.z * q.z));
            add(&mut sums, &q, &slope, residual, LIGHTNESS);
        }
    }
    for &i in &a.spread {
        let q = moved(i);
        let Some((.., at)) = b.place(&q) else { continue };
        let normal = b.normals[at];
        if (turn * a.normals[i as usize]).dot(&normal) > 0.75 {
            let sigma_m = 1.5 * frontal_sigma_m(q.z);
            add(&mut sums, &q, &normal, normal.dot(&(q - b.points[at])), sigma_m);
        }
    }
    sums
}

/// Adds a residual with Cauchy weight; `slope` is its gradient with respect to the point `q`.
fn add(sums: &mut Sums, q: &Point3<f32>, slope: &Vector3<f32>, residual: f32, sigma: f32) {
    let along = q.coords.cross(slope);
    let derivative = [along.x, along.y, along.z, slope.x, slope.y, slope.z].map(f64::from);
    let weight = 1.0 / (SHARED * sigma * sigma * (1.0 + (residual / sigma).powi(2)));
    sums.add_scalar(derivative, f64::from(residual), f64::from(weight));
}

/// Pairs of each view with the [`PARTNERS`] views of most similar orientation.
fn pairs(active: &[usize], poses: &[Isometry3<f64>]) -> Vec<(usize, usize)> {
    let mut pairs = Vec::new();
    for &i in active {
        let mut others: Vec<usize> = active.iter().copied().filter(|&j| j != i).collect();
        let apart = |j: usize| poses[i].rotation.angle_to(&poses[j].rotation);
        others.sort_by(|&a, &b| apart(a).total_cmp(&apart(b)).then(a.cmp(&b)));
        pairs.extend(others.into_iter().take(PARTNERS).map(|j| (i, j)));
    }
    pairs
}

/// Applies a Gauss-Newton step to all poses but the first; false if no pose moved.
fn step(active: &[usize], pairs: &[(usize, usize)], links: &[Sums], poses: &mut [Isometry3<f64>]) -> bool {
    let mut slots = vec![None; poses.len()];
    active.iter().skip(1).enumerate().for_each(|(slot, &i)| slots[i] = Some(6 * slot));
    let n = 6 * (active.len() - 1);
    // A little pull keeps what nothing holds.
    let (mut normal, mut right) = (DMatrix::<f64>::identity(n, n) * 100.0, DVector::<f64>::zeros(n));
    for (&(i, j), sums) in pairs.iter().zip(links) {
        let by = poses[j].inv_mul(&poses[i]);
        let turn = by.rotation.to_rotation_matrix().into_inner();
        // A motion of the first camera in its own frame, seen in the second's.
        let mut carried = Matrix6::zeros();
        carried.fixed_view_mut::<3, 3>(0, 0).copy_from(&turn);
        carried.fixed_view_mut::<3, 3>(3, 3).copy_from(&turn);
        carried.fixed_view_mut::<3, 3>(3, 0).copy_from(&(by.translation.vector.cross_matrix() * turn));
        let (information, pull) = (sums.information(), sums.right());
        let from_first = carried.transpose() * information;
        let mut put = |a: Option<usize>, b: Option<usize>, block: Matrix6<f64>| {
            if let (Some(a), Some(b)) = (a, b) {
                let mut view = normal.fixed_view_mut::<6, 6>(a, b);
                view += block;
            }
        };
        put(slots[i], slots[i], from_first * carried);
        put(slots[i], slots[j], -from_first);
        put(slots[j], slots[i], -from_first.transpose());
        put(slots[j], slots[j], information);
        for (slot, pull) in [(slots[i], -(carried.transpose() * pull)), (slots[j], pull)] {
            if let Some(slot) = slot {
                let mut view = right.fixed_rows_mut::<6>(slot);
                view += pull;
            }
        }
    }
    let Some(solution) = normal.cholesky().map(|c| c.solve(&right)) else { return false };
    let mut most = 0.0_f64;
    for &i in active {
        let Some(slot) = slots[i] else { continue };
        let by = solution.fixed_rows::<6>(slot);
        let (turn, shift) = (Vector3::new(by[0], by[1], by[2]), Vector3::new(by[3], by[4], by[5]));
        if turn.norm() < 0.1 && shift.norm() < 0.1 {
            poses[i] *=
                Isometry3::from_parts(Translation3::from(shift), UnitQuaternion::from_scaled_axis(turn));
            most = most.max(turn.norm()).max(shift.norm());
        }
    }
    most > 5e-5
}
