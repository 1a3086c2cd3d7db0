//! Surfels: a surface sampled at a fixed resolution, the form in which models and scenes are compared.

use crate::cloud::{Cloud, CloudError, is_finite};
use crate::neighbours::Neighbours;
use crate::normals;
use crate::voxel;
use nalgebra::{Point3, Vector3};
use rustc_hash::{FxHashMap, FxHashSet};

/// Spacing of the surfels, metres.
pub(super) const STEP_M: f32 = 0.004;
/// Cell size for occlusion tests, metres.
const CELL_M: f32 = 0.008;
/// Minimum distance behind the foremost point of a cell at which a point is occluded, metres.
const BEHIND_M: f32 = 0.012;
/// Minimum cosine between a normal and the direction to the viewer at which a point is visible.
const FACING: f32 = 0.2;

/// Unit vector perpendicular to another unit vector.
pub fn across(along: &Vector3<f32>) -> Vector3<f32> {
    let aside = if along.x.abs() < 0.7 { Vector3::x() } else { Vector3::y() };
    along.cross(&aside).normalize()
}

/// Surfels: points about `STEP_M` apart, with normals on the visible side.
pub struct Surfels {
    pub points: Vec<Point3<f32>>,
    pub normals: Vec<Vector3<f32>>,
    /// Colours as CIE L*, a*, b*; `None` without colours.
    pub lab: Option<Vec<[f32; 3]>>,
    pub tree: Neighbours,
}

impl Surfels {
    /// Samples a cloud with normals; points without a finite normal are left out.
    pub fn of(cloud: &Cloud) -> Result<Surfels, super::error::KnowError> {
        Ok(Surfels::gathered(&voxel::downsample(cloud, STEP_M)?)?)
    }

    fn gathered(cloud: &Cloud) -> Result<Surfels, CloudError> {
        let none = Vec::new();
        let normals = cloud.normals.as_ref().unwrap_or(&none);
        let kept: Vec<u32> = (0..normals.len())
            .filter(|&i| is_finite(&cloud.points[i]) && normals[i].x.is_finite())
            .map(|i| i as u32)
            .collect();
        let kept = cloud.select(&kept);
        let tree = Neighbours::new(&kept.points)?;
        let lab = kept.colours.map(|c| c.into_iter().map(lab).collect());
        Ok(Surfels { points: kept.points, normals: kept.normals.unwrap_or_default(), lab, tree })
    }

    /// Indices of the points visible to a distant viewer in direction `away` (unit length, from the object).
    pub fn seen_from(&self, away: &Vector3<f32>) -> Vec<u32> {
        let front = Front::of(self, away);
        let seen = |&i: &u32| {
            let (p, n) = (&self.points[i as usize], &self.normals[i as usize]);
            n.dot(away) > FACING && front.has(p)
        };
        (0..self.points.len() as u32).filter(seen).collect()
    }

    /// Indices of the foremost points that face away from a viewer in direction `away`, in cells without a point of
    /// `seen`: a solid body has an unknown side there that hides them.
    pub fn backs_from(&self, away: &Vector3<f32>, seen: &[u32]) -> Vec<u32> {
        let front = Front::of(self, away);
        let shown: FxHashSet<_> = seen.iter().map(|&i| front.cell(&self.points[i as usize])).collect();
        let back = |&i: &u32| {
            let (p, n) = (&self.points[i as usize], &self.normals[i as usize]);
            n.dot(away) < -FACING && front.has(p) && !shown.contains(&front.cell(p))
        };
        (0..self.points.len() as u32).filter(back).collect()
    }

    /// Surfels of the given points.
    pub fn part(&self, indices: &[u32]) -> Result<Surfels, CloudError> {
        let points: Vec<Point3<f32>> = indices.iter().map(|&i| self.points[i as usize]).collect();
        Ok(Surfels {
            tree: Neighbours::new(&points)?,
            points,
            normals: indices.iter().map(|&i| self.normals[i as usize]).collect(),
            lab: self.lab.as_ref().map(|lab| indices.iter().map(|&i| lab[i as usize]).collect()),
        })
    }

    /// One index per cube of `step_m` among the points accepted by `wanted`: the point nearest to
    /// the cube's mean.
    pub fn keypoints(&self, step_m: f32, wanted: impl Fn(usize) -> bool) -> Vec<u32> {
        let chosen: Vec<u32> = (0..self.points.len() as u32).filter(|&i| wanted(i as usize)).collect();
        let points: Vec<Point3<f32>> = chosen.iter().map(|&i| self.points[i as usize]).collect();
        let Ok(assigned) = voxel::assign(&points, step_m) else { return Vec::new() };
        let mut sums = vec![(Vector3::zeros(), 0.0_f32); assigned.voxels];
        for (p, &v) in points.iter().zip(&assigned.voxel).filter(|(_, v)| **v != voxel::NONE) {
            sums[v as usize].0 += p.coords;
            sums[v as usize].1 += 1.0;
        }
        let mut best = vec![(f32::INFINITY, 0_u32); assigned.voxels];
        for (k, &v) in assigned.voxel.iter().enumerate().filter(|(_, v)| **v != voxel::NONE) {
            let (sum, n) = sums[v as usize];
            let off = (points[k].coords - sum / n).norm_squared();
            if off < best[v as usize].0 {
                best[v as usize] = (off, chosen[k]);
            }
        }
        best.into_iter().map(|(_, i)| i).collect()
    }
}

/// Height of the foremost point in a direction, for each cell across the direction.
struct Front {
    away: Vector3<f32>,
    axes: [Vector3<f32>; 2],
    heights: FxHashMap<(i32, i32), f32>,
}

impl Front {
    fn of(surfels: &Surfels, away: &Vector3<f32>) -> Front {
        let right = across(away);
        let mut front =
            Front { away: *away, axes: [right, away.cross(&right)], heights: FxHashMap::default() };
        for p in &surfels.points {
            let height = away.dot(&p.coords);
            let best = front.heights.entry(front.cell(p)).or_insert(height);
            *best = height.max(*best);
        }
        front
    }

    fn cell(&self, p: &Point3<f32>) -> (i32, i32) {
        let at = |axis: &Vector3<f32>| (axis.dot(&p.coords) / CELL_M).floor() as i32;
        (at(&self.axes[0]), at(&self.axes[1]))
    }

    /// True if no surfel occludes the point.
    fn has(&self, p: &Point3<f32>) -> bool {
        self.away.dot(&p.coords) > self.heights[&self.cell(p)] - BEHIND_M
    }
}

/// Number of neighbours from which a normal is estimated.
const NEIGHBOURS: usize = 20;

/// Cloud with outward normals, pointing away from the centre of its bounds. Valid for a nearly convex body seen from
/// all around.
///
/// # Errors
/// If there are more points than 32-bit indices can name.
pub fn outward(cloud: &Cloud) -> Result<Cloud, CloudError> {
    let cloud = cloud.finite();
    let tree = Neighbours::new(&cloud.points)?;
    let middle = cloud.bounds().map_or(Point3::origin(), |(low, high)| nalgebra::center(&low, &high));
    let towards = normals::estimate(&tree, NEIGHBOURS, &middle).normals;
    Ok(Cloud { normals: Some(towards.into_iter().map(|n| -n).collect()), ..cloud })
}

/// CIE L*a*b* colour of an sRGB colour (white point D65).
pub fn lab(rgb: [u8; 3]) -> [f32; 3] {
    let linear = rgb.map(|c| {
        let c = f32::from(c) / 255.0;
        if c <= 0.04045 { c / 12.92 } else { ((c + 0.055) / 1.055).powf(2.4) }
    });
    let row = |m: [f32; 3]| m[0] * linear[0] + m[1] * linear[1] + m[2] * linear[2];
    let cube = |t: f32| if t > 0.008856 { t.cbrt() } else { 7.787 * t + 16.0 / 116.0 };
    let x = cube(row([0.4124, 0.3576, 0.1805]) / 0.9505);
    let y = cube(row([0.2126, 0.7152, 0.0722]));
    let z = cube(row([0.0193, 0.1192, 0.9505]) / 1.089);
    [116.0 * y - 16.0, 500.0 * (x - y), 200.0 * (y - z)]
}
