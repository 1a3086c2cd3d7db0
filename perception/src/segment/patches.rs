//! Points in voxels, with normals and neighbours.

use nalgebra::{Matrix3, Point3, Vector3};
use rustc_hash::FxHashMap;

/// Occupied voxels of a set of points, in order of their first point.
pub(super) struct Voxels {
    /// Mean of the voxel's points, metres.
    pub centres: Vec<Point3<f64>>,
    /// Unit normal, towards the nearest viewpoint; zero if unknown.
    pub normals: Vec<Vector3<f64>>,
    /// How flat the neighbourhood is: 0 for a plane, 1/3 for a ball.
    pub curvatures: Vec<f64>,
    /// Number of points.
    pub counts: Vec<u32>,
    /// Occupied voxels among the 26 around.
    pub neighbours: Vec<Vec<u32>>,
    /// The voxel of each point.
    pub of_point: Vec<u32>,
}

impl Voxels {
    pub fn len(&self) -> usize {
        self.centres.len()
    }
}

#[derive(Clone, Copy)]
struct Moments {
    count: f64,
    sum: Vector3<f64>,
    squares: Matrix3<f64>,
}

/// Gathers points into voxels of a side and estimates a normal for each from its surroundings.
pub(super) fn voxels(points: &[Point3<f64>], side_m: f64, viewpoints: &[Point3<f64>]) -> Voxels {
    let mut index: FxHashMap<[i32; 3], u32> = FxHashMap::default();
    let mut keys: Vec<[i32; 3]> = Vec::new();
    let mut moments: Vec<Moments> = Vec::new();
    let mut of_point = Vec::with_capacity(points.len());
    let mut last = ([i32::MIN; 3], 0);
    for p in points {
        let key = [p.x, p.y, p.z].map(|c| (c / side_m).floor() as i32);
        if key != last.0 {
            let slot = *index.entry(key).or_insert_with(|| {
                keys.push(key);
                moments.push(Moments { count: 0.0, sum: Vector3::zeros(), squares: Matrix3::zeros() });
                keys.len() as u32 - 1
            });
            last = (key, slot);
        }
        of_point.push(last.1);
        let m = &mut moments[last.1 as usize];
        // Moments about a near corner keep the digits that moments about a far origin lose.
        let v = p.coords;
        m.count += 1.0;
        m.sum += v;
        m.squares += v * v.transpose();
    }
    let neighbours: Vec<Vec<u32>> = keys.iter().map(|key| around(key, &index)).collect();
    let centres: Vec<Point3<f64>> = moments.iter().map(|m| Point3::from(m.sum / m.count)).collect();
    let (normals, curvatures) = normals(&moments, &neighbours, &centres, viewpoints);
    Voxels {
        centres,
        normals,
        curvatures,
        counts: moments.iter().map(|m| m.count as u32).collect(),
        neighbours,
        of_point,
    }
}

fn around(key: &[i32; 3], index: &FxHashMap<[i32; 3], u32>) -> Vec<u32> {
    let mut found = Vec::with_capacity(12);
    for dz in -1..=1 {
        for dy in -1..=1 {
            for dx in -1..=1 {
                if (dx, dy, dz) != (0, 0, 0)
                    && let Some(&i) = index.get(&[key[0] + dx, key[1] + dy, key[2] + dz])
                {
                    found.push(i);
                }
            }
        }
    }
    found
}

fn normals(
    moments: &[Moments],
    neighbours: &[Vec<u32>],
    centres: &[Point3<f64>],
    viewpoints: &[Point3<f64>],
) -> (Vec<Vector3<f64>>, Vec<f64>) {
    let mut normals = Vec::with_capacity(moments.len());
    let mut curvatures = Vec::with_capacity(moments.len());
    for (i, own) in moments.iter().enumerate() {
        let mut total = *own;
        for &n in &neighbours[i] {
            let m = &moments[n as usize];
            total.count += m.count;
            total.sum += m.sum;
            total.squares += m.squares;
        }
        let mean = total.sum / total.count;
        let spread = total.squares / total.count - mean * mean.transpose();
        let eigen = spread.symmetric_eigen();
        let least = eigen.eigenvalues.imin();
        let trace = eigen.eigenvalues.sum();
        let known = total.count >= 5.0 && trace > 0.0 && eigen.eigenvalues.iter().all(|e| e.is_finite());
        let mut normal: Vector3<f64> =
            if known { eigen.eigenvectors.column(least).into_owned() } else { Vector3::zeros() };
        let nearest = viewpoints
            .iter()
            .map(|v| v - centres[i])
            .min_by(|a, b| a.norm_squared().total_cmp(&b.norm_squared()))
            .unwrap_or_else(Vector3::z);
        if normal.dot(&nearest) < 0.0 {
            normal = -normal;
        }
        normals.push(normal);
        curvatures.push(if known { eigen.eigenvalues[least].max(0.0) / trace } else { 1.0 });
    }
    (normals, curvatures)
}
