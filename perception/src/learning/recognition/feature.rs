//! Local features: shape where the surface is curved (SHOT: Tombari, Salti, Di Stefano 2010), and printed pattern where
//! it is coloured.

use super::surfels::{Surfels, across};
use crate::pool;
use nalgebra::{Matrix3, Point3, SymmetricEigen, Vector3};

/// Keypoint at which a descriptor is computed.
#[derive(Clone, Copy, Debug)]
pub struct Feature {
    pub at: Point3<f32>,
    pub normal: Vector3<f32>,
}

/// Number of descriptor bytes compared at once.
const BLOCK: usize = 32;
/// Number of code bytes compared at once.
const CODE: usize = 16;
/// Divisor of a group's sum of descriptor bytes that gives a code byte.
const COARSE: u16 = 4;

/// Features of one kind, with their descriptors in contiguous bytes for fast distances.
#[derive(Clone, Debug)]
pub struct Descriptors {
    pub all: Vec<Feature>,
    kind: DescriptorKind,
    pub blocks: Vec<[u8; BLOCK]>,
    /// Codes: quantised sums of groups of descriptor bytes. Similar descriptors have similar codes, of a quarter of the
    /// size or less.
    pub codes: Vec<[u8; CODE]>,
}

/// Feature of one set, the most similar feature of another set (both by index), and their descriptor distance.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Alike {
    pub own: usize,
    pub other: usize,
    pub off: u32,
}

/// Kind of descriptor.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum DescriptorKind {
    /// Distribution of normals around a keypoint.
    Shape,
    /// Colours around a keypoint, in the tangent plane.
    Pattern,
}

impl DescriptorKind {
    /// Length of a descriptor and of its code, bytes.
    pub const fn lengths(self) -> (usize, usize) {
        match self {
            DescriptorKind::Shape => (SECTORS[0] * SECTORS[1] * SECTORS[2] * SECTORS[3], 32),
            DescriptorKind::Pattern => (3 * CELLS * CELLS, 48),
        }
    }

    /// Index of the code byte to which a descriptor byte contributes: by sector for shapes, by squares of four cells
    /// for patterns.
    const fn sum_of(self, byte: usize) -> usize {
        match self {
            DescriptorKind::Shape => byte / SECTORS[3],
            DescriptorKind::Pattern => {
                let (channel, row, column) = (byte / (CELLS * CELLS), byte / CELLS % CELLS, byte % CELLS);
                (channel * CELLS / 2 + row / 2) * (CELLS / 2) + column / 2
            }
        }
    }
}

impl Descriptors {
    /// Empty set of a kind.
    pub fn none(kind: DescriptorKind) -> Descriptors {
        Descriptors { all: Vec::new(), kind, blocks: Vec::new(), codes: Vec::new() }
    }

    /// Computes the features at keypoints, given as indices of surfels; keypoints without a distinctive descriptor are
    /// skipped.
    pub fn of(surfels: &Surfels, keypoints: &[u32], kind: DescriptorKind) -> Descriptors {
        let describe = |&i: &u32| {
            let descriptor = match kind {
                DescriptorKind::Shape => shape(surfels, i as usize),
                DescriptorKind::Pattern => pattern(surfels, i as usize),
            }?;
            Some((
                Feature { at: surfels.points[i as usize], normal: surfels.normals[i as usize] },
                descriptor,
            ))
        };
        let described: Vec<(Feature, Box<[u8]>)> =
            pool::filter(keypoints.len(), 1, |n| describe(&keypoints[n]));
        let mut features = Descriptors::none(kind);
        described.iter().for_each(|(feature, descriptor)| features.push(*feature, descriptor));
        features
    }

    pub fn push(&mut self, feature: Feature, descriptor: &[u8]) {
        self.all.push(feature);
        let block = |bytes: &[u8]| {
            let mut block = [0; BLOCK];
            block[..bytes.len()].copy_from_slice(bytes);
            block
        };
        self.blocks.extend(descriptor.chunks(BLOCK).map(block));
        let mut sums = vec![0_u16; self.kind.lengths().1];
        for (k, &byte) in descriptor.iter().enumerate() {
            sums[self.kind.sum_of(k)] += u16::from(byte);
        }
        let byte = |k: usize| (sums[k] / COARSE).min(255) as u8;
        self.codes.extend((0..sums.len() / CODE).map(|n| std::array::from_fn(|k| byte(n * CODE + k))));
    }

    /// Descriptor of a feature, in blocks.
    pub fn descriptor(&self, k: usize) -> &[[u8; BLOCK]] {
        let each = self.kind.lengths().0.div_ceil(BLOCK);
        &self.blocks[k * each..(k + 1) * each]
    }

    fn code(&self, k: usize) -> &[[u8; CODE]] {
        let each = self.kind.lengths().1 / CODE;
        &self.codes[k * each..(k + 1) * each]
    }

    /// Adds those features of another view of the same object that are new: at another place, or with another
    /// descriptor.
    pub fn add_new(&mut self, more: &Descriptors) {
        let before = self.all.len();
        for (k, feature) in more.all.iter().enumerate() {
            let descriptor = more.descriptor(k);
            let known = (0..before).any(|i| {
                (self.all[i].at - feature.at).norm() <= SAME_PLACE_M
                    && distance(self.descriptor(i), descriptor) <= SAME_OFF
            });
            if !known {
                self.all.push(*feature);
                self.blocks.extend_from_slice(descriptor);
                self.codes.extend_from_slice(more.code(k));
            }
        }
    }

    /// At most `most` features with their most similar partners in another set of the same kind, best first, and the
    /// estimated median distance of all features to their best partners. Codes preselect the compared pairs.
    pub fn most_alike(&self, others: &Descriptors, most: usize) -> (Vec<Alike>, u32) {
        /// Number of features whose full descriptors are compared, in multiples of `most`. In generated scenes
        /// recognition then equals that of full comparison; a factor of two gave more false answers.
        const LIKELY: usize = 6;
        /// Number of partners whose full descriptors are compared with each feature.
        const CLOSE: usize = 24;
        /// Number of features, around the median by their codes, that determine the median distance.
        const MIDDLE: usize = 15;
        let codes = |own: usize| {
            let code = self.code(own);
            others.codes.chunks_exact(code.len()).map(|other| distance(other, code)).zip(0..)
        };
        let nearest = |own: usize| Some((codes(own).min()?.0, own));
        let mut order: Vec<(u32, usize)> = pool::filter(self.all.len(), 1, nearest);
        order.sort_unstable();
        let compared = |close: &mut Vec<(u32, u32)>, &(_, own): &(u32, usize)| {
            close.clear();
            close.extend(codes(own));
            if close.len() > CLOSE {
                close.select_nth_unstable(CLOSE);
                close.truncate(CLOSE);
            }
            let off = |&(_, other): &(u32, u32)| {
                (distance(others.descriptor(other as usize), self.descriptor(own)), other as usize)
            };
            close.iter().map(off).min().map(|(off, other)| Alike { own, other, off })
        };
        let all = |of: &[(u32, usize)]| {
            let mut all: Vec<Alike> =
                pool::filter_with(of.len(), 1, Vec::new, |close, n| compared(close, &of[n]));
            all.sort_by_key(|alike| alike.off);
            all
        };
        let from = order.len().saturating_sub(MIDDLE) / 2;
        let middle = all(&order[from..order.len().min(from + MIDDLE)]);
        let mut best = all(&order[..order.len().min(LIKELY * most)]);
        best.truncate(most);
        (best, middle.get(middle.len() / 2).map_or(0, |alike| alike.off))
    }
}

/// Sum of absolute byte differences of two descriptors, or of two codes.
#[inline(always)]
pub fn distance<const N: usize>(a: &[[u8; N]], b: &[[u8; N]]) -> u32 {
    let of = |(a, b): (&[u8; N], &[u8; N])| -> u32 {
        let mut sum = 0;
        for i in 0..N {
            sum += u32::from(a[i].abs_diff(b[i]));
        }
        sum
    };
    a.iter().zip(b).map(of).sum()
}

/// Maximum distance between features of a model that count as one, metres.
const SAME_PLACE_M: f32 = 0.004;
/// Maximum descriptor distance between features of a model that count as one.
const SAME_OFF: u32 = 256;

/// Radius of the neighbourhood that a shape descriptor covers, metres.
const SHAPE_M: f32 = 0.04;
/// Number of sectors of azimuth, elevation and radius, and of bins of the cosine between normals.
const SECTORS: [usize; 4] = [8, 2, 2, 11];
/// Minimum curvature: one minus the length of the mean normal; flatter neighbourhoods have no distinctive shape.
const FLAT: f32 = 0.04;
const FEWEST: usize = 20;

fn shape(surfels: &Surfels, centre: usize) -> Option<Box<[u8]>> {
    let at = surfels.points[centre];
    let mut near: Vec<(usize, f32)> = Vec::new();
    surfels.tree.within(&at, SHAPE_M, |n| near.push((n.index as usize, n.distance_sq.sqrt())));
    let mean: Vector3<f32> = near.iter().map(|(k, _)| surfels.normals[*k]).sum();
    if near.len() < FEWEST || 1.0 - mean.norm() / (near.len() as f32) < FLAT {
        return None;
    }
    let axes = local_frame(surfels, &at, &surfels.normals[centre], &near)?;
    let mut bins = vec![0.0_f32; SECTORS.iter().product()];
    for &(k, distance) in near.iter().filter(|n| n.1 > 1e-6) {
        let local = axes * (surfels.points[k] - at);
        let cosine = axes.row(2).transpose().dot(&surfels.normals[k]);
        let azimuth = local.y.atan2(local.x) / std::f32::consts::TAU + 0.5;
        let places = [
            azimuth * SECTORS[0] as f32 - 0.5,
            0.5 * (local.z / distance + 1.0) * SECTORS[1] as f32 - 0.5,
            distance / SHAPE_M * SECTORS[2] as f32 - 0.5,
            0.5 * (cosine + 1.0) * SECTORS[3] as f32 - 0.5,
        ];
        spread(&mut bins, places);
    }
    let length = bins.iter().map(|b| b * b).sum::<f32>().sqrt();
    (length > 0.0).then(|| bins.iter().map(|b| (510.0 * b / length).min(255.0) as u8).collect())
}

/// Adds a total of one to the bins around a position, by linear interpolation; azimuth wraps around, the other axes are
/// clamped.
fn spread(bins: &mut [f32], places: [f32; 4]) {
    for corner in 0..16_usize {
        let (mut index, mut weight) = (0, 1.0);
        for (axis, (&place, &count)) in places.iter().zip(&SECTORS).enumerate() {
            let low = place.floor();
            let up = corner >> axis & 1;
            weight *= if up == 1 { place - low } else { 1.0 - (place - low) };
            let bin = low as i32 + up as i32;
            let last = count as i32 - 1;
            let bin = if axis == 0 { bin.rem_euclid(count as i32) } else { bin.clamp(0, last) };
            index = index * count + bin as usize;
        }
        bins[index] += weight;
    }
}

/// Local reference frame with its axes as rows, from the distance-weighted scatter of the neighbours: z towards the
/// normal, x towards the majority of the neighbours. `None` if degenerate.
fn local_frame(
    surfels: &Surfels,
    at: &Point3<f32>,
    normal: &Vector3<f32>,
    near: &[(usize, f32)],
) -> Option<Matrix3<f32>> {
    let mut scatter = Matrix3::zeros();
    for &(k, distance) in near {
        let d = surfels.points[k] - at;
        scatter += d * d.transpose() * (SHAPE_M - distance);
    }
    let eigen = SymmetricEigen::new(scatter);
    let mut order = [0, 1, 2];
    order.sort_by(|&a, &b| eigen.eigenvalues[a].total_cmp(&eigen.eigenvalues[b]));
    let column = |k: usize| eigen.eigenvectors.column(order[k]).into_owned();
    let (z, x) = (column(0), column(2));
    let z = if z.dot(normal) < 0.0 { -z } else { z };
    let before = near.iter().filter(|(k, _)| (surfels.points[*k] - at).dot(&x) >= 0.0).count();
    let x = if 2 * before < near.len() { -x } else { x };
    let y = z.cross(&x);
    let frame = Matrix3::from_rows(&[x.transpose(), y.transpose(), z.transpose()]);
    frame.iter().all(|v| v.is_finite()).then_some(frame)
}

/// Number of cells per side of the square on which a colour pattern is sampled.
const CELLS: usize = 8;
/// Side of a pattern cell, metres.
const CELL_M: f32 = 0.006;
/// Minimum lightness difference between centre and border of a pattern, in L* units; less does not define a direction.
const CONTRAST: f32 = 4.0;
/// Minimum share of a pattern's cells that hold surfels.
const COVERED: f32 = 0.75;
/// Descriptor bytes per unit: of normalised lightness, and of a* and b*.
const SCALES: [f32; 2] = [40.0, 2.0];

/// Pattern descriptor: contrast-normalised lightness and colour on a square of the tangent plane, oriented by the
/// lightness gradient, as in Brown, Szeliski and Winder (2005). `None` without colour or contrast.
fn pattern(surfels: &Surfels, centre: usize) -> Option<Box<[u8]>> {
    let lab = surfels.lab.as_ref()?;
    let (at, normal) = (surfels.points[centre], surfels.normals[centre]);
    let reach_m = 0.5 * CELLS as f32 * CELL_M;
    let right = across(&normal);
    let up = normal.cross(&right);
    let mut near: Vec<(f32, f32, [f32; 3])> = Vec::new();
    surfels.tree.within(&at, reach_m * 1.45, |n| {
        let k = n.index as usize;
        let d = surfels.points[k] - at;
        if surfels.normals[k].dot(&normal) > 0.7 && d.dot(&normal).abs() < 0.01 {
            near.push((d.dot(&right), d.dot(&up), lab[k]));
        }
    });
    let (dx, dy) = slope(near.iter().filter(|(x, y, _)| x.hypot(*y) <= reach_m))?;
    let steep = dx.hypot(dy);
    if steep * reach_m < CONTRAST {
        return None;
    }
    let (c, s) = (dx / steep, dy / steep);
    let mut cells = [([0.0_f32; 3], 0.0_f32); CELLS * CELLS];
    for (x, y, colour) in near {
        let cell = |t: f32| ((t + reach_m) / CELL_M).floor();
        let (i, j) = (cell(c * x + s * y), cell(c * y - s * x));
        if i >= 0.0 && j >= 0.0 && i < CELLS as f32 && j < CELLS as f32 {
            let (sum, n) = &mut cells[j as usize * CELLS + i as usize];
            (0..3).for_each(|k| sum[k] += colour[k]);
            *n += 1.0;
        }
    }
    described(&cells)
}

/// Gradient of lightness along both axes, L* units per metre, by least squares; `None` if not determined.
fn slope<'a>(points: impl Iterator<Item = &'a (f32, f32, [f32; 3])>) -> Option<(f32, f32)> {
    let mut normal = Matrix3::<f32>::zeros();
    let mut right = Vector3::zeros();
    for (x, y, lab) in points {
        let row = Vector3::new(100.0 * x, 100.0 * y, 1.0);
        normal += row * row.transpose();
        right += row * lab[0];
    }
    let solution = normal.try_inverse()? * right;
    solution.iter().all(|v| v.is_finite()).then(|| (100.0 * solution.x, 100.0 * solution.y))
}

fn described(cells: &[([f32; 3], f32)]) -> Option<Box<[u8]>> {
    let seen = || cells.iter().filter(|c| c.1 > 0.0);
    let count = seen().count() as f32;
    if count < COVERED * cells.len() as f32 {
        return None;
    }
    let value = |c: &([f32; 3], f32), k: usize| c.0[k] / c.1;
    let mean: [f32; 3] = std::array::from_fn(|k| seen().map(|c| value(c, k)).sum::<f32>() / count);
    let sigma = (seen().map(|c| (value(c, 0) - mean[0]).powi(2)).sum::<f32>() / count).sqrt().max(1.0);
    let byte = |v: f32| (128.0 + v).clamp(0.0, 255.0) as u8;
    let lightness =
        cells.iter().map(|c| byte(if c.1 > 0.0 { SCALES[0] * (value(c, 0) - mean[0]) / sigma } else { 0.0 }));
    let colour =
        |k: usize| cells.iter().map(move |c| byte(SCALES[1] * if c.1 > 0.0 { value(c, k) } else { mean[k] }));
    Some(lightness.chain(colour(1)).chain(colour(2)).collect())
}
