//! Points in voxels, with normals and neighbours.

use super::footprint::bounds;
use crate::lattice::{Lattice, NeighbourSweep};
use crate::pool;
use crate::spread;
use nalgebra::{Point3, Vector3};
use std::ops::Range;

/// Minimum number of voxels of an upright side. From: chosen.
pub(super) const SIDE_VOXELS: usize = 25;

/// Occupied voxels of a set of points, sorted by position.
pub(super) struct Voxels {
    /// Mean of the voxel's points, metres.
    pub centres: Vec<Point3<f64>>,
    /// Unit normal, towards the nearest viewpoint; zero if unknown.
    pub normals: Vec<Vector3<f64>>,
    /// Curvature of each neighbourhood: 0 for a plane, 1/3 for a ball, 1 if unknown.
    pub curvatures: Vec<f64>,
    /// Number of points of each voxel.
    pub counts: Vec<u32>,
    /// Start of each voxel's neighbours in `near`, and the total.
    starts: Vec<u32>,
    /// Neighbours of all voxels in a row.
    near: Vec<u32>,
    /// Start of each run of consecutive points in one voxel, and the total.
    run_starts: Vec<u32>,
    /// Voxel of each run.
    of_run: Vec<u32>,
    /// First and end point of each run, grouped by voxel.
    runs: Vec<(u32, u32)>,
    /// End of each voxel's group in `runs`.
    run_ends: Vec<u32>,
}

impl Voxels {
    pub fn len(&self) -> usize {
        self.centres.len()
    }

    /// Occupied voxels among the 26 around, in order.
    pub fn neighbours(&self, voxel: usize) -> &[u32] {
        &self.near[self.starts[voxel] as usize..self.starts[voxel + 1] as usize]
    }

    /// Splits some voxels into connected sets, each ascending.
    pub fn together(&self, of: &[usize]) -> Vec<Vec<usize>> {
        let mut open = vec![false; self.len()];
        of.iter().for_each(|&v| open[v] = true);
        let mut sets = Vec::new();
        for &first in of {
            if !std::mem::take(&mut open[first]) {
                continue;
            }
            let mut set = vec![first];
            let mut next = 0;
            while let Some(&voxel) = set.get(next) {
                let near = self.neighbours(voxel).iter().map(|&n| n as usize);
                set.extend(near.filter(|&n| std::mem::take(&mut open[n])));
                next += 1;
            }
            set.sort_unstable();
            sets.push(set);
        }
        sets
    }

    /// Number of runs of consecutive points in one voxel.
    pub fn count_runs(&self) -> usize {
        self.of_run.len()
    }

    /// Some of the runs of consecutive points in one voxel, in point order: range of points, and
    /// voxel.
    pub fn runs(&self, of: Range<usize>) -> impl Iterator<Item = (Range<usize>, usize)> {
        let ends =
            self.run_starts[of.start..=of.end].windows(2).map(|ends| ends[0] as usize..ends[1] as usize);
        ends.zip(self.of_run[of].iter().map(|&voxel| voxel as usize))
    }

    /// Points of some voxels, voxel by voxel; `all`: points that the voxels were made from.
    pub fn points_of(&self, of: &[usize], all: &[Point3<f64>]) -> Vec<Point3<f64>> {
        let count: u32 = of.iter().map(|&v| self.counts[v]).sum();
        let mut points = Vec::with_capacity(count as usize);
        for &voxel in of {
            let first = if voxel == 0 { 0 } else { self.run_ends[voxel - 1] };
            for &(from, to) in &self.runs[first as usize..self.run_ends[voxel] as usize] {
                // One or two most often: to copy them as a slice takes longer.
                all[from as usize..to as usize].iter().for_each(|p| points.push(*p));
            }
        }
        points
    }
}

/// Sums over the points of a voxel, about the surface frame's origin.
#[derive(Clone, Copy)]
struct Moments {
    count: f64,
    sum: Vector3<f64>,
    /// Sums of products of coordinates: xx, xy, xz, yy, yz, zz; square metres.
    products: [f64; 6],
}

impl Moments {
    /// Moments of no points. From: mark.
    const NONE: Moments = Moments { count: 0.0, sum: Vector3::new(0.0, 0.0, 0.0), products: [0.0; 6] };

    fn add(&mut self, p: &Point3<f64>) {
        self.count += 1.0;
        self.sum += p.coords;
        let terms = [p.x * p.x, p.x * p.y, p.x * p.z, p.y * p.y, p.y * p.z, p.z * p.z];
        self.products.iter_mut().zip(terms).for_each(|(sum, term)| *sum += term);
    }

    fn join(&mut self, other: &Moments) {
        self.count += other.count;
        self.sum += other.sum;
        self.products.iter_mut().zip(other.products).for_each(|(sum, term)| *sum += term);
    }
}

/// Number of voxels whose normals are computed together. From: work.
const LANES: usize = 4;
/// Number of voxels per thread. From: work.
pub(super) const SOME: usize = 256;

/// Groups points into voxels of the given side, and estimates each voxel's normal from its
/// surroundings; meanwhile computes a value that needs no normals.
pub(super) fn voxels<T: Send>(
    points: &[Point3<f64>],
    side_m: f64,
    viewpoints: &[Point3<f64>],
    meanwhile: impl FnOnce(&Voxels) -> T + Send,
) -> (Voxels, T) {
    let (low, high) = bounds(points);
    let lattice = Lattice::over(&low, &high, side_m);
    let (mut entries, run_starts) = runs(&lattice, points);
    lattice.sort(&mut entries, &mut Vec::new());
    let range = |run: usize| (run_starts[run], run_starts[run + 1]);
    let voxels = || entries.chunk_by(|a, b| a.0 == b.0);
    let keys: Vec<u64> = voxels().map(|same| same[0].0).collect();
    let gathered = || {
        let runs: Vec<(u32, u32)> = entries.iter().map(|(_, run)| range(*run as usize)).collect();
        let (mut of_run, mut run_ends) = (vec![0; entries.len()], Vec::with_capacity(keys.len()));
        for (voxel, same) in (0..).zip(voxels()) {
            same.iter().for_each(|(_, run)| of_run[*run as usize] = voxel);
            run_ends.push(run_ends.last().copied().unwrap_or(0) + same.len() as u32);
        }
        let moments_of = |voxel: usize| {
            let mut own = Moments::NONE;
            let first = if voxel == 0 { 0 } else { run_ends[voxel - 1] };
            for &(from, to) in &runs[first as usize..run_ends[voxel] as usize] {
                points[from as usize..to as usize].iter().for_each(|p| own.add(p));
            }
            own
        };
        (pool::each(keys.len(), SOME, moments_of), runs, of_run, run_ends)
    };
    let ((moments, runs, of_run, run_ends), (starts, near)) =
        pool::join(gathered, || neighbours(&lattice, &keys));
    let mut voxels = Voxels {
        centres: moments.iter().map(|m| Point3::from(m.sum / m.count)).collect(),
        normals: Vec::new(),
        curvatures: Vec::new(),
        counts: moments.iter().map(|m| m.count as u32).collect(),
        starts,
        near,
        run_starts,
        of_run,
        runs,
        run_ends,
    };
    let facing = || {
        let (mut normals, mut curvatures) = (vec![Vector3::zeros(); keys.len()], vec![1.0; keys.len()]);
        let mut some: Vec<_> = normals.chunks_mut(LANES).zip(curvatures.chunks_mut(LANES)).collect();
        pool::for_each(
            &mut some,
            SOME / LANES,
            || (),
            |(), k, (normals, curvatures)| {
                let found = surfaces(&voxels, &moments, k * LANES, viewpoints);
                let told = normals.iter_mut().zip(curvatures.iter_mut()).zip(found);
                told.for_each(|((normal, curvature), found)| {
                    (*normal, *curvature) = found.unwrap_or((Vector3::zeros(), 1.0));
                });
            },
        );
        (normals, curvatures)
    };
    let (told, (normals, curvatures)) = pool::join(|| meanwhile(&voxels), facing);
    (voxels.normals, voxels.curvatures) = (normals, curvatures);
    (voxels, told)
}

/// Runs of consecutive points in one voxel, as neighbouring pixels form: voxel key and number of
/// each run; and run starts with the total.
fn runs(lattice: &Lattice, points: &[Point3<f64>]) -> (Vec<(u64, u32)>, Vec<u32>) {
    let of = |range: Range<usize>| {
        let mut runs: Vec<(u64, u32)> = Vec::with_capacity(range.len() / 2);
        for (i, p) in (range.start as u32..).zip(&points[range]) {
            let key = lattice.key(&p.coords);
            if runs.last().is_none_or(|(last, _)| *last != key) {
                runs.push((key, i));
            }
        }
        runs
    };
    let half = points.len() / 2;
    let (mut all, more) = pool::join(|| of(0..half), || of(half..points.len()));
    let goes_on = all.last().zip(more.first()).is_some_and(|(last, first)| last.0 == first.0);
    all.extend(&more[usize::from(goes_on)..]);
    let starts = all.iter().map(|(_, first)| *first).chain([points.len() as u32]).collect();
    (all.iter().zip(0..).map(|((key, _), run)| (*key, run)).collect(), starts)
}

/// Start of each voxel's neighbours in the second list, and the neighbours of all voxels in a row.
fn neighbours(lattice: &Lattice, keys: &[u64]) -> (Vec<u32>, Vec<u32>) {
    /// Maximum number of chunks for the neighbour search. From: work.
    const SHARES: usize = 8;
    let of = |range: Range<usize>| {
        let (mut starts, mut near) = (Vec::with_capacity(range.len() + 1), Vec::new());
        let mut around = NeighbourSweep::from(lattice, keys, range.start);
        for i in range {
            starts.push(near.len() as u32);
            around.visit(keys[i], |j| {
                if j != i {
                    near.push(j as u32);
                }
            });
        }
        (starts, near)
    };
    let some = keys.len().div_ceil(SHARES).max(SOME);
    let from: Vec<usize> = (0..keys.len()).step_by(some).collect();
    let shares: Vec<(Vec<u32>, Vec<u32>)> =
        pool::map(&from, 1, |&from| of(from..(from + some).min(keys.len())));
    let (mut starts, mut near) = (Vec::with_capacity(keys.len() + 1), Vec::new());
    for (more_starts, more) in shares {
        starts.extend(more_starts.into_iter().map(|start| start + near.len() as u32));
        near.extend(more);
    }
    starts.push(near.len() as u32);
    (starts, near)
}

/// Normals and curvatures of consecutive voxels from their own and neighbouring points; `None` with
/// too few points.
fn surfaces(
    voxels: &Voxels,
    moments: &[Moments],
    first: usize,
    viewpoints: &[Point3<f64>],
) -> [Option<(Vector3<f64>, f64)>; LANES] {
    /// Minimum number of points for a normal. From: chosen.
    const FEWEST: f64 = 5.0;
    let mut covariances = [[0.0; LANES]; 6];
    for (lane, voxel) in (first..voxels.len()).take(LANES).enumerate() {
        let mut total = moments[voxel];
        voxels.neighbours(voxel).iter().for_each(|&n| total.join(&moments[n as usize]));
        if total.count >= FEWEST {
            let covariance = spread::covariance(total.count, total.sum.into(), total.products);
            covariances.iter_mut().zip(covariance).for_each(|(lanes, value)| lanes[lane] = value);
        }
    }
    let found = spread::least_of(&covariances);
    std::array::from_fn(|lane| {
        let least = found[lane]?;
        let nearest = viewpoints
            .iter()
            .map(|v| v - voxels.centres[first + lane])
            .min_by(|a, b| a.norm_squared().total_cmp(&b.norm_squared()))
            .unwrap_or_else(Vector3::z);
        let normal = Vector3::from(least.normal);
        Some((if normal.dot(&nearest) < 0.0 { -normal } else { normal }, least.share))
    })
}

/// Voxels of each part, ascending, by part number.
pub(super) fn members(part_of_voxel: &[u32]) -> Vec<(u32, Vec<usize>)> {
    let mut counts = vec![0; part_of_voxel.len()];
    part_of_voxel.iter().for_each(|part| counts[*part as usize] += 1);
    let named = (0..).zip(&counts).filter(|(_, count)| **count > 0);
    let mut members: Vec<(u32, Vec<usize>)> =
        named.map(|(name, count)| (name, Vec::with_capacity(*count))).collect();
    let mut places = counts;
    members.iter().enumerate().for_each(|(place, (name, _))| places[*name as usize] = place);
    let all = part_of_voxel.iter().enumerate();
    all.for_each(|(voxel, part)| members[places[*part as usize]].1.push(voxel));
    members
}

/// True if a surface with this normal is upright within 30°.
pub(super) fn is_upright(normal: &Vector3<f64>) -> bool {
    normal.z.abs() < 0.5 && normal.xy().norm() > 0.5
}

/// Removes from a sorted list the elements of another sorted list.
pub(super) fn take_away(from: &mut Vec<usize>, others: &[usize]) {
    let mut others = others.iter().peekable();
    from.retain(|own| {
        while others.next_if(|other| *other < own).is_some() {}
        others.peek() != Some(&own)
    });
}
