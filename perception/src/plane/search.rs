//! Plane search: RANSAC (Fischler and Bolles 1981) with preliminary scores on a random subset, then least squares on
//! the inliers.

use super::{Plane, PlaneError, PlaneFit, PlaneOptions};
use crate::cloud::is_finite;
use crate::draw::Draws;
use crate::spread::{self, Moments};
use nalgebra::{Point3, Vector3};

/// Number of points for the preliminary score; only candidates that may beat the best are scored on all points.
const FIRST: usize = 1024;
/// Number of points scored between two comparisons with the best score.
const BLOCK: usize = 4096;
/// Number of standard deviations below the best preliminary score within which a candidate is still scored in full; one
/// in 30,000 would be lost.
const DEVIATIONS: f64 = 4.0;
/// Maximum number of least-squares refits.
const REFITS: usize = 3;

/// Finds the plane with the most inliers; deterministic for points, options and seed.
///
/// # Errors
/// If the tolerance is not positive, fewer than three points are finite, or no sample gives a plane as required.
pub fn find(points: &[Point3<f32>], options: &PlaneOptions) -> Result<PlaneFit, PlaneError> {
    let _span = tracing::debug_span!("plane", points = points.len()).entered();
    if !(options.tolerance_m > 0.0 && options.tolerance_m.is_finite()) {
        return Err(PlaneError::Tolerance { tolerance_m: options.tolerance_m });
    }
    let finite: Vec<u32> = (0u32..).zip(points).filter(|(_, p)| is_finite(p)).map(|(i, _)| i).collect();
    if finite.len() < 3 {
        return Err(PlaneError::TooFew { found: finite.len() });
    }
    let mut draws = Draws::new(options.seed);
    let shuffled = Shuffled::new(points, &finite, &mut draws);
    let (best, rounds_used) = sample(points, &finite, &shuffled, options, &mut draws);
    let best = best.ok_or(PlaneError::None { rounds: options.rounds })?;
    Ok(polish(points, best, finite.len(), rounds_used, options))
}

/// Least-squares plane of the finite points, with its normal towards the origin; `None` if they are collinear or
/// coincident.
pub fn refit<'a>(points: impl IntoIterator<Item = &'a Point3<f32>>) -> Option<Plane> {
    let mut points = points.into_iter().filter(|p| is_finite(p)).peekable();
    let mut moments = Moments::about(points.peek()?);
    points.for_each(|p| moments.add(p));
    let least = spread::least(&moments.covariance())?;
    Some(Plane::through(&moments.mean(), Vector3::from(least.normal)).facing(&Point3::origin()))
}

/// Finite points in random order, with one array per coordinate.
struct Shuffled {
    x: Vec<f32>,
    y: Vec<f32>,
    z: Vec<f32>,
}

impl Shuffled {
    fn new(points: &[Point3<f32>], finite: &[u32], draws: &mut Draws) -> Shuffled {
        let order = draws.order(finite.len());
        let column = |axis: usize| order.iter().map(|&i| points[finite[i as usize] as usize][axis]).collect();
        Shuffled { x: column(0), y: column(1), z: column(2) }
    }

    /// Number of points among `from..to` within the tolerance of a plane.
    fn count(&self, from: usize, to: usize, plane: &Plane, tolerance_m: f32) -> u32 {
        let n = plane.normal.cast::<f32>();
        let offset = plane.offset_m as f32;
        let (x, y, z) = (&self.x[from..to], &self.y[from..to], &self.z[from..to]);
        x.iter()
            .zip(y)
            .zip(z)
            .map(|((x, y), z)| u32::from((n.x * x + n.y * y + n.z * z - offset).abs() <= tolerance_m))
            .sum()
    }
}

fn sample(
    points: &[Point3<f32>],
    finite: &[u32],
    shuffled: &Shuffled,
    options: &PlaneOptions,
    draws: &mut Draws,
) -> (Option<Plane>, usize) {
    let all = finite.len();
    let first = FIRST.min(all);
    let mut best: Option<(Plane, u32, u32)> = None;
    let mut used = 0;
    for _ in 0..options.rounds {
        let Some(drawn) = draws.distinct::<3>(all) else { break };
        let corner = drawn.map(|i| points[finite[i] as usize].cast::<f64>());
        let Some(plane) = through(corner).and_then(|p| oriented(p, options)) else { continue };
        used += 1;
        let early = shuffled.count(0, first, &plane, options.tolerance_m);
        let (best_early, best_total) = best.map_or((0, 0), |(_, early, total)| (early, total));
        let share = f64::from(best_early) / first as f64;
        let slack = DEVIATIONS * (2.0 * share * (1.0 - share) * first as f64).sqrt();
        if f64::from(early) + slack < f64::from(best_early) {
            continue;
        }
        let mut total = early;
        let mut at = first;
        while at < all && total as usize + (all - at) > best_total as usize {
            let end = (at + BLOCK).min(all);
            total += shuffled.count(at, end, &plane, options.tolerance_m);
            at = end;
        }
        if at == all && total > best_total {
            best = Some((plane, early, total));
        }
    }
    (best.map(|(plane, _, _)| plane), used)
}

/// Plane through three points; `None` if they are (nearly) collinear.
fn through([a, b, c]: [Point3<f64>; 3]) -> Option<Plane> {
    let (ab, ac) = (b - a, c - a);
    let normal = ab.cross(&ac);
    let length = normal.norm();
    let flat = length > 1e-6 * ab.norm() * ac.norm() && length > 0.0;
    flat.then(|| Plane::through(&a, normal / length))
}

/// Plane with its normal oriented as required; `None` if the plane violates the options.
fn oriented(plane: Plane, options: &PlaneOptions) -> Option<Plane> {
    let Some((direction, within_rad)) = options.tilt else {
        return Some(plane.facing(&Point3::origin()));
    };
    let plane = if plane.normal.dot(&direction) < 0.0 { plane.flipped() } else { plane };
    let upright = plane.normal.dot(&direction) >= within_rad.cos();
    let placed = options.offset_m.as_ref().is_none_or(|range| range.contains(&plane.offset_m));
    (upright && placed).then_some(plane)
}

/// Refits the plane to its inliers by least squares, repeatedly while the number of inliers does not fall.
fn polish(
    points: &[Point3<f32>],
    mut plane: Plane,
    of: usize,
    rounds_used: usize,
    options: &PlaneOptions,
) -> PlaneFit {
    let tolerance_m = f64::from(options.tolerance_m);
    let collect = |plane: &Plane| -> Vec<u32> {
        let within = |p: &Point3<f32>| plane.height_m(&p.cast()).abs() <= tolerance_m;
        (0u32..).zip(points).filter(|(_, p)| within(p)).map(|(i, _)| i).collect()
    };
    let mut inliers = collect(&plane);
    for _ in 0..REFITS {
        let Some(better) =
            refit(inliers.iter().map(|&i| &points[i as usize])).and_then(|p| oriented(p, options))
        else {
            break;
        };
        let kept = collect(&better);
        if kept.len() < inliers.len() {
            break;
        }
        let same = kept == inliers;
        (plane, inliers) = (better, kept);
        if same {
            break;
        }
    }
    let square: f64 = inliers.iter().map(|&i| plane.height_m(&points[i as usize].cast()).powi(2)).sum();
    let rms_m = (square / inliers.len().max(1) as f64).sqrt();
    PlaneFit { plane, inliers, of, rms_m, rounds_used }
}
