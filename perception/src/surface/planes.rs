//! The large planes of a sample of points.

use super::sample::{SAMPLE, Sample};
use crate::draw::Draws;
use crate::pool;
use crate::scale::{self, floor};
use nalgebra::{Matrix3, Point3, Vector3};
use rustc_hash::FxHashMap;

/// Minimum number of points that make a surface. From: chosen.
pub(super) const FEWEST: usize = 50;
/// Number of planes proposed for each plane found. From: chosen.
const PROPOSALS: usize = 240;
/// Maximum number of planes found one after another. From: chosen.
pub(super) const ROUNDS: usize = 6;
/// Side of the cubes from which the points of a proposal are drawn, metres. From: chosen.
const REACH_M: f64 = 0.3;
/// Maximum number of points that score a proposed plane. From: chosen.
const JUDGES: usize = 2400;
/// Number of scoring points between tests whether a proposed plane can still win. From: work.
const BLOCK: usize = 128;
/// Number of points per thread. From: work.
const SOME: usize = 2048;

/// Maximum distance of a measurement from its plane: standard deviations, plus metres.
/// From: derived, as exactly as an edge is known.
pub(crate) const BAND: (f64, f64) = (scale::SPREADS, scale::EDGE_M);

#[derive(Clone, Copy)]
pub(super) struct Plane {
    pub normal: Vector3<f64>,
    pub offset: f64,
}

impl Plane {
    pub fn distance(&self, p: &Point3<f64>) -> f64 {
        self.normal.dot(&p.coords) - self.offset
    }

    /// True if a sample may be a measurement of the plane.
    pub fn holds(&self, sample: &Sample) -> bool {
        self.distance(&sample.point).abs() <= Plane::band_m(sample)
    }

    /// The maximum distance of a measurement of a plane from the plane, metres.
    pub fn band_m(sample: &Sample) -> f64 {
        Plane::band_of(sample.sigma_m)
    }

    /// Maximum distance of a measurement with the given standard deviation from its plane, metres.
    pub fn band_of(sigma_m: f64) -> f64 {
        BAND.0 * sigma_m + BAND.1
    }
}

/// Normals and offsets of planes that hold at least a share of all `total` points; each point has a
/// standard deviation, metres.
pub(crate) fn dominant_planes(
    places: impl Iterator<Item = (Point3<f64>, f64)>,
    total: usize,
    share: f64,
) -> Vec<(Vector3<f64>, f64)> {
    let stride = (total / (SAMPLE / 2)).max(1);
    let samples: Vec<Sample> =
        places.step_by(stride).map(|(point, sigma_m)| Sample { point, sigma_m }).collect();
    let holds = |plane: &Plane| {
        samples.iter().filter(|s| plane.holds(s)).count() as f64 >= share * samples.len() as f64
    };
    let mut planes = Vec::new();
    large_planes(&samples, (1, ROUNDS), |_| true, |plane| planes.push(plane));
    planes.into_iter().filter(holds).map(|p| (p.normal, p.offset)).collect()
}

/// Calls `found` for at most `rounds` large planes in turn, each fitted without the points of the
/// earlier ones.
pub(super) fn large_planes(
    samples: &[Sample],
    (seed, rounds): (u64, usize),
    plausible: impl Fn(&Plane) -> bool,
    mut found: impl FnMut(Plane),
) {
    let mut rng = Draws::new(seed);
    let mut left = samples.to_vec();
    let mut cubes = Cubes::of(samples);
    for _ in 0..rounds {
        if left.len() < FEWEST {
            break;
        }
        let Some(plane) = propose(&left, &cubes, &mut rng, &plausible) else { break };
        let Some(plane) = refine(plane, &left) else { break };
        let kept: Vec<bool> = pool::map(&left, SOME, |s| !plane.holds(s));
        if kept.iter().filter(|kept| !**kept).count() < FEWEST {
            break;
        }
        found(plane);
        cubes.keep(kept.iter().copied());
        let mut kept = kept.into_iter();
        left.retain(|_| kept.next().unwrap_or(false));
    }
}

/// Points grouped by the cube that they lie in.
struct Cubes {
    /// Number of the cube of each point.
    of: Vec<u32>,
    /// Start of each cube's points in `members`, and the total.
    starts: Vec<u32>,
    /// Numbers of points, cube by cube, ascending in each.
    members: Vec<u32>,
}

impl Cubes {
    fn of(samples: &[Sample]) -> Cubes {
        let (first, second) = samples.split_at(samples.len() / 2);
        let ((mut of, mut keys), (others, more)) = pool::join(|| numbered(first), || numbered(second));
        // What both have has one number.
        let numbers: FxHashMap<[i32; 3], u32> = keys.iter().copied().zip(0..).collect();
        let renumber = |key| {
            numbers.get(&key).copied().unwrap_or_else(|| {
                keys.push(key);
                keys.len() as u32 - 1
            })
        };
        let new: Vec<u32> = more.into_iter().map(renumber).collect();
        of.extend(others.into_iter().map(|cube| new[cube as usize]));
        let mut cubes = Cubes { of, starts: vec![0; keys.len() + 1], members: Vec::new() };
        cubes.sort();
        cubes
    }

    /// Keeps the points accepted by `kept`, in order.
    fn keep(&mut self, mut kept: impl Iterator<Item = bool>) {
        self.of.retain(|_| kept.next().unwrap_or(false));
        self.sort();
    }

    fn sort(&mut self) {
        self.starts.fill(0);
        self.of.iter().for_each(|&cube| self.starts[cube as usize + 1] += 1);
        let mut sum = 0;
        for start in &mut self.starts {
            sum += *start;
            *start = sum;
        }
        let mut next = self.starts.clone();
        self.members.resize(self.of.len(), 0);
        for (point, &cube) in (0..).zip(&self.of) {
            let at = &mut next[cube as usize];
            self.members[*at as usize] = point;
            *at += 1;
        }
    }

    /// Points in the cube of a point, itself included.
    fn around(&self, point: usize) -> &[u32] {
        let cube = self.of[point] as usize;
        &self.members[self.starts[cube] as usize..self.starts[cube + 1] as usize]
    }
}

/// Cube number of each point, and the cubes in order of appearance.
fn numbered(samples: &[Sample]) -> (Vec<u32>, Vec<[i32; 3]>) {
    /// Number of cubes per metre. From: derived, their side.
    const PER_M: f64 = 1.0 / REACH_M;
    let (mut numbers, mut keys): (FxHashMap<[i32; 3], u32>, Vec<[i32; 3]>) = Default::default();
    let mut last = ([i32::MIN; 3], 0);
    let number = |sample: &Sample| {
        let key = [0, 1, 2].map(|k| floor(sample.point[k] * PER_M));
        if key != last.0 {
            let number = *numbers.entry(key).or_insert_with(|| {
                keys.push(key);
                keys.len() as u32 - 1
            });
            last = (key, number);
        }
        last.1
    };
    (samples.iter().map(number).collect(), keys)
}

/// Points that score plane proposals, in structure-of-arrays form, relative to the first point in
/// single precision (accurate to a micrometre). Padded with NaN, which lies near no plane.
struct Judges {
    count: usize,
    origin: Vector3<f64>,
    coordinates: [Vec<f32>; 3],
    /// Inverse of the distance from a plane within which each judge supports the plane, per metre.
    per_band: Vec<f32>,
}

impl Judges {
    fn of(samples: &[Sample]) -> Judges {
        /// Distance from a plane within which a judge supports the plane: this many standard
        /// deviations plus `BAND.1` metres. From: chosen.
        const SPREADS: f64 = 2.0;
        let judges = || samples.iter().step_by(samples.len().div_ceil(JUDGES).max(1));
        let (count, origin) =
            (judges().count(), samples.first().map_or_else(Vector3::zeros, |s| s.point.coords));
        let column = |of: &dyn Fn(&Sample) -> f64| {
            let mut column: Vec<f32> = judges().map(|s| of(s) as f32).collect();
            column.resize(count.next_multiple_of(BLOCK), f32::NAN);
            column
        };
        let coordinates = [0, 1, 2].map(|k| column(&|s| s.point[k] - origin[k]));
        let per_band = column(&|s| 1.0 / (SPREADS * s.sigma_m + BAND.1));
        Judges { count, origin, coordinates, per_band }
    }

    /// Plane score: nearer judges add more (Torr and Zisserman 2000), so that a plane leaning
    /// through two steps scores less than the plane of one. `None` as soon as the score cannot
    /// exceed `beaten`.
    fn near(&self, plane: &Plane, beaten: f64) -> Option<f64> {
        /// Number of sums side by side (SIMD lanes). From: work.
        const LANES: usize = 8;
        let normal = plane.normal.cast::<f32>();
        let offset = (plane.offset - plane.normal.dot(&self.origin)) as f32;
        let columns = self.coordinates.each_ref().map(|axis| axis.as_chunks::<BLOCK>().0);
        let [x, y, z] = columns.map(|axis| axis.iter().map(|block| block.as_chunks::<LANES>().0));
        let bands = self.per_band.as_chunks::<BLOCK>().0.iter().map(|block| block.as_chunks::<LANES>().0);
        let (mut found, mut left) = (0.0, self.count);
        for (((x, y), z), per_band) in x.zip(y).zip(z).zip(bands) {
            if found + left as f64 <= beaten {
                return None;
            }
            let mut near = [0.0; LANES];
            for (((x, y), z), per_band) in x.iter().zip(y).zip(z).zip(per_band) {
                near = std::array::from_fn(|i| {
                    let along = normal.x * x[i] + normal.y * y[i] + normal.z * z[i];
                    let off = (along - offset) * per_band[i];
                    let speaks = 1.0 - off * off;
                    near[i] + if speaks > 0.0 { speaks } else { 0.0 }
                });
            }
            found += f64::from(near.iter().sum::<f32>());
            left = left.saturating_sub(BLOCK);
        }
        (found > beaten).then_some(found)
    }
}

/// Best of planes through three neighbouring points.
fn propose(
    left: &[Sample],
    cubes: &Cubes,
    rng: &mut Draws,
    plausible: &impl Fn(&Plane) -> bool,
) -> Option<Plane> {
    /// Minimum doubled area of three points that define a plane, square metres. From: chosen.
    const FLAT_M2: f64 = 1e-4;
    let judges = Judges::of(left);
    let drawn = (0..PROPOSALS).filter_map(|_| {
        let first = rng.below(left.len());
        let near = cubes.around(first);
        let mut pick = || left[near[rng.below(near.len())] as usize].point;
        let (a, b, c) = (left[first].point, pick(), pick());
        let normal = (b - a).cross(&(c - a)).try_normalize(FLAT_M2)?;
        let plane = Plane { normal, offset: normal.dot(&a.coords) };
        plausible(&plane).then_some(plane)
    });
    let drawn: Vec<Plane> = drawn.collect();
    let best_of = |planes: &[Plane]| {
        let mut best: Option<(f64, Plane)> = None;
        for plane in planes {
            let count = match best {
                Some((beaten, _)) => judges.near(plane, beaten),
                None => judges.near(plane, 0.0).or(Some(0.0)),
            };
            best = count.map(|count| (count, *plane)).or(best);
        }
        best
    };
    let (first, second) = drawn.split_at(drawn.len() / 2);
    let (one, other) = pool::join(|| best_of(first), || best_of(second));
    // Of equals the first.
    let best = match (one, other) {
        (Some(one), Some(other)) if other.0 > one.0 => Some(other),
        (one, other) => one.or(other),
    };
    best.map(|(_, plane)| plane)
}

/// Weighted least squares on the points near the plane, repeated with a narrowing band.
fn refine(mut plane: Plane, samples: &[Sample]) -> Option<Plane> {
    /// Inlier limits of the refinement steps: these standard deviations plus `BESIDE_M`.
    /// From: chosen.
    const BANDS: [f64; 4] = [4.0, 3.0, 2.5, 2.5];
    /// Part of the inlier limit that is the same for all samples, metres. From: chosen.
    const BESIDE_M: f64 = 0.003;
    /// Multiple of the first band beyond which a sample is never considered. From: chosen.
    const EVER: f64 = 3.0;
    let is_near = |plane: &Plane, s: &Sample, band: f64, times: f64| {
        plane.distance(&s.point).abs() < times * (band * s.sigma_m + BESIDE_M)
    };
    let some_around = |some: &[Sample]| -> Vec<(Sample, f64)> {
        let around = some.iter().filter(|s| is_near(&plane, s, BANDS[0], EVER));
        around.map(|s| (*s, weight(s))).collect()
    };
    let around: Vec<Vec<(Sample, f64)>> = {
        let some: Vec<&[Sample]> = samples.chunks(SOME).collect();
        pool::map(&some, 1, |some| some_around(some))
    };
    for band in BANDS {
        let sums_of = |some: &Vec<(Sample, f64)>| {
            let near = some.iter().filter(|(s, _)| is_near(&plane, s, band, 1.0));
            Sums::of(near.map(|(s, weight)| (&s.point, *weight)))
        };
        let sums: Vec<Sums> = pool::map(&around, 1, sums_of);
        plane = sums.into_iter().fold(Sums::default(), Sums::with).plane(&plane.normal)?;
    }
    Some(plane)
}

/// Least-squares plane through samples weighted by their inverse variances, with its normal on a
/// given side.
pub(super) fn least_squares<'a>(
    samples: impl Iterator<Item = &'a Sample>,
    side: &Vector3<f64>,
) -> Option<Plane> {
    Sums::of(samples.map(|s| (&s.point, weight(s)))).plane(side)
}

fn weight(sample: &Sample) -> f64 {
    1.0 / (sample.sigma_m * sample.sigma_m)
}

/// Sums over samples, weighted by their inverse variances.
#[derive(Default)]
struct Sums {
    weight: f64,
    sum: [f64; 3],
    /// Weighted sums of products of coordinates: xx, xy, xz, yy, yz, zz.
    products: [f64; 6],
}

impl Sums {
    fn of<'a>(weighed: impl Iterator<Item = (&'a Point3<f64>, f64)>) -> Sums {
        let mut all = Sums::default();
        for (p, w) in weighed {
            let [x, y, z] = [w * p.x, w * p.y, w * p.z];
            let products = [x * p.x, y * p.x, z * p.x, y * p.y, z * p.y, z * p.z];
            all = all.with(Sums { weight: w, sum: [x, y, z], products });
        }
        all
    }

    fn with(mut self, other: Sums) -> Sums {
        self.weight += other.weight;
        self.sum.iter_mut().zip(other.sum).for_each(|(sum, term)| *sum += term);
        self.products.iter_mut().zip(other.products).for_each(|(sum, term)| *sum += term);
        self
    }

    /// Least-squares plane, with its normal on a given side.
    fn plane(&self, side: &Vector3<f64>) -> Option<Plane> {
        if self.weight <= 0.0 {
            return None;
        }
        let mean = Vector3::from(self.sum) / self.weight;
        let [xx, xy, xz, yy, yz, zz] = self.products;
        let moments = Matrix3::new(xx, xy, xz, xy, yy, yz, xz, yz, zz);
        let eigen = (moments / self.weight - mean * mean.transpose()).symmetric_eigen();
        let least = eigen.eigenvalues.imin();
        let normal: Vector3<f64> = eigen.eigenvectors.column(least).into_owned();
        let normal = if normal.dot(side) < 0.0 { -normal } else { normal };
        let offset = normal.dot(&mean);
        normal.iter().all(|c| c.is_finite()).then_some(Plane { normal, offset })
    }
}

/// Plane with its normal up: along the hint, else towards the cameras.
pub(super) fn face_up(plane: &Plane, up: Option<&Vector3<f64>>, viewpoints: &[Point3<f64>]) -> Plane {
    let rise = match up {
        Some(up) => plane.normal.dot(up),
        None if viewpoints.is_empty() => plane.normal.z,
        None => viewpoints.iter().map(|v| plane.distance(v)).sum(),
    };
    if rise < 0.0 { Plane { normal: -plane.normal, offset: -plane.offset } } else { *plane }
}
