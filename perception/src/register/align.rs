//! ICP iterations: match, accumulate, move, until convergence.

use super::equations::{Motion, Sums};
use super::pairs::{Partner, Place};
use super::{Fit, Method, Prepared, RegisterError, RegisterOptions, Termination};
use crate::pool;
use nalgebra::{Isometry3, Matrix6, Point3, Vector3};

/// Number of points per partial sum, fixed so that results do not depend on the number of threads.
const CHUNK: usize = 1024;

/// Variance of a surface along its normal relative to that along itself in [`Method::Generalised`]
/// (Segal et al. 2009, section III.B).
const FLAT: f64 = 1e-3;

/// Minimum number of points in the sample of early iterations, where fewer points give the motion
/// nearly as well.
const SAMPLE: usize = 2000;
/// Maximum stride through the points in early iterations.
const WIDEST_STRIDE: usize = 16;
/// Multiple of the convergence threshold below which all points replace the sample in
/// [`Method::PointToPoint`], whose many small steps are worth taking on the sample.
const NEARLY: f64 = 10.0;
/// Multiple of the convergence threshold below which all points replace the sample in the other
/// methods, whose few large steps would end in a local minimum of the sample.
const NEARLY_BY_PLANES: f64 = 100.0;

/// Aligns the source with the target.
///
/// # Errors
/// If a cloud is empty or lacks the normals that the method needs, or if an option is invalid.
/// Clouds that do not overlap are no error: see [`Fit::ending`].
pub fn align(source: &Prepared, target: &Prepared, options: &RegisterOptions) -> Result<Fit, RegisterError> {
    let _span = tracing::debug_span!("register", points = source.points.len()).entered();
    check(source, target, options)?;
    let start = options.start_target_from_source;
    let before = middle(&source.points, &start);
    let mut run = Run::new(source, target, options);
    let mut at = Progress { pose: start, centre: before, rounds: 0, last: None };
    let stride = (source.points.len() / SAMPLE).clamp(1, WIDEST_STRIDE);
    if stride > 1 {
        run.look_at_every(stride);
        let ease = if options.method == Method::PointToPoint { NEARLY } else { NEARLY_BY_PLANES };
        run.rounds(&mut at, options.rounds / 2, options.least.max(SAMPLE / 10), ease);
        run.look_at_every(1);
    }
    let ending = run.rounds(&mut at, options.rounds, options.least.max(1), 1.0);
    let (matched, residual_m) = run.quality();
    let from_start = at.pose * start.inverse();
    Ok(Fit {
        target_from_source: at.pose,
        matched,
        of: source.points.len(),
        residual_m,
        rounds: at.rounds,
        ending,
        moved_m: (from_start * before - before).norm(),
        moved_rad: from_start.rotation.angle(),
        free: at.last.as_ref().map_or(6, |m| m.free),
        information: at.last.as_ref().map_or(Matrix6::zeros(), |m| m.information),
        centre: at.centre,
    })
}

/// State of the iterations.
struct Progress {
    pose: Isometry3<f64>,
    centre: Point3<f64>,
    rounds: usize,
    last: Option<Motion>,
}

fn check(source: &Prepared, target: &Prepared, options: &RegisterOptions) -> Result<(), RegisterError> {
    for (which, cloud) in [("source", source), ("target", target)] {
        if cloud.points.is_empty() {
            return Err(RegisterError::Empty { which });
        }
    }
    let method = options.method;
    if method != Method::PointToPoint && target.normals.is_none() {
        return Err(RegisterError::NoNormals { which: "target", method });
    }
    if method == Method::Generalised && source.normals.is_none() {
        return Err(RegisterError::NoNormals { which: "source", method });
    }
    let lengths = [("within_m", f64::from(options.within_m)), ("robust_m", options.robust_m.unwrap_or(1.0))];
    for (name, value_m) in lengths {
        if !(value_m > 0.0 && value_m.is_finite()) {
            return Err(RegisterError::Length { name, value_m });
        }
    }
    let pose = options.start_target_from_source;
    let finite = pose.translation.vector.iter().chain(pose.rotation.coords.iter()).all(|v| v.is_finite());
    if finite { Ok(()) } else { Err(RegisterError::Start) }
}

/// Mean of the source's points under a pose.
fn middle(points: &[Point3<f32>], pose: &Isometry3<f64>) -> Point3<f64> {
    let sum = points.iter().fold(Vector3::zeros(), |sum, p| sum + p.coords.cast::<f64>());
    pose * Point3::from(sum / points.len().max(1) as f64)
}

struct Run<'a> {
    target: &'a Prepared,
    options: &'a RegisterOptions,
    /// Source points in tree order, so that consecutive searches are close.
    points: Vec<Point3<f32>>,
    source: &'a Prepared,
    /// Stride through the points: every `stride`-th is sampled.
    stride: usize,
    /// Correspondence of each sampled point.
    partners: Vec<Partner>,
    /// Number of correspondences at the last pose.
    matched: usize,
    /// Sum of the squared residuals at the last pose, square metres.
    square: f64,
}

impl<'a> Run<'a> {
    fn new(source: &'a Prepared, target: &'a Prepared, options: &'a RegisterOptions) -> Run<'a> {
        let points: Vec<Point3<f32>> =
            source.tree.indices().iter().map(|&i| source.points[i as usize]).collect();
        Run {
            target,
            options,
            stride: 1,
            partners: vec![Partner::UNKNOWN; points.len()],
            points,
            source,
            matched: 0,
            square: 0.0,
        }
    }

    /// Changes the sample stride; earlier correspondences seed the searches of neighbouring points.
    fn look_at_every(&mut self, stride: usize) {
        let guess = |i: usize| self.partners[(i / self.stride).min(self.partners.len() - 1)].guess();
        self.partners = (0..self.points.len()).step_by(stride).map(guess).collect();
        self.stride = stride;
    }

    /// Iterates until `most` iterations in all, fewer than `least` correspondences, or a motion
    /// below `ease` times the convergence threshold.
    fn rounds(&mut self, at: &mut Progress, most: usize, least: usize, ease: f64) -> Termination {
        let options = self.options;
        let mut first = true;
        loop {
            let sums = self.sums(&at.pose, &at.centre);
            if sums.matched < least {
                return Termination::TooFewPartners;
            }
            let (settle_m, settle_rad) = (ease * options.settle_m, ease * options.settle_rad);
            let settled = |m: &Motion| m.shift_m < settle_m && m.turn_rad < settle_rad;
            if !first && at.last.as_ref().is_some_and(settled) {
                return Termination::Settled;
            }
            if at.rounds >= most {
                return Termination::OutOfRounds;
            }
            let motion = match options.method {
                Method::PointToPoint => sums.closed_form(&at.centre),
                _ => sums.motion(&at.centre),
            };
            at.pose = motion.step * at.pose;
            at.pose.rotation.renormalize_fast();
            at.centre = motion.step * at.centre;
            at.rounds += 1;
            at.last = Some(motion);
            first = false;
        }
    }

    /// Finds the correspondences at a pose, and sums their normal equations about `centre`.
    fn sums(&mut self, pose: &Isometry3<f64>, centre: &Point3<f64>) -> Sums {
        let place = Place::of(pose);
        let centre = [centre.x, centre.y, centre.z];
        let mut partners = std::mem::take(&mut self.partners);
        let mut parts: Vec<(&mut [Partner], Sums)> =
            partners.chunks_mut(CHUNK).map(|partners| (partners, Sums::ZERO)).collect();
        pool::for_each(
            &mut parts,
            1,
            || (),
            |(), chunk, (partners, sums)| {
                *sums = self.part(chunk * CHUNK, partners, &place, centre);
            },
        );
        let parts: Vec<Sums> = parts.into_iter().map(|(_, sums)| sums).collect();
        self.partners = partners;
        let sums = parts.iter().fold(Sums::ZERO, Sums::join);
        (self.matched, self.square) = (sums.matched, sums.square);
        sums
    }

    fn quality(&self) -> (usize, f64) {
        (self.matched, (self.square / self.matched.max(1) as f64).sqrt())
    }

    fn part(&self, from: usize, partners: &mut [Partner], place: &Place, centre: [f64; 3]) -> Sums {
        let tree = &self.target.tree;
        let mut sums = Sums::ZERO;
        for (offset, partner) in partners.iter_mut().enumerate() {
            let i = (from + offset) * self.stride;
            let at = place.apply(&self.points[i]);
            let Some(slot) = partner.update(tree, at, self.options.within_m, 0.0) else { continue };
            let target = tree.at(slot);
            let about = |p: [f32; 3]| {
                [f64::from(p[0]) - centre[0], f64::from(p[1]) - centre[1], f64::from(p[2]) - centre[2]]
            };
            let (p, t) = (about(at), about(target));
            match self.options.method {
                Method::PointToPoint => {
                    sums.add_points(p, t, self.weight(f64::from(partner.distance_sq)));
                }
                Method::PointToPlane => self.to_plane(&mut sums, p, t, self.target.by_slot[slot]),
                Method::Generalised => {
                    let turned = place.turn(self.source.by_slot[i]);
                    self.generalised(&mut sums, p, t, turned, self.target.by_slot[slot]);
                }
            }
        }
        sums
    }

    fn weight(&self, square: f64) -> f64 {
        self.options.robust_m.map_or(1.0, |scale| 1.0 / (1.0 + square / (scale * scale)))
    }

    #[inline(always)]
    fn to_plane(&self, sums: &mut Sums, p: [f64; 3], t: [f64; 3], n: [f64; 3]) {
        if n[0].is_nan() {
            return;
        }
        let r = n[0] * (t[0] - p[0]) + n[1] * (t[1] - p[1]) + n[2] * (t[2] - p[2]);
        let j = [
            p[1] * n[2] - p[2] * n[1],
            p[2] * n[0] - p[0] * n[2],
            p[0] * n[1] - p[1] * n[0],
            n[0],
            n[1],
            n[2],
        ];
        sums.add_scalar(j, r, self.weight(r * r));
    }

    /// Generalised-ICP term: the covariance of a surface with normal n is I − (1 − ε) n nᵀ, and I
    /// without a surface.
    #[inline(always)]
    fn generalised(&self, sums: &mut Sums, p: [f64; 3], t: [f64; 3], ns: [f64; 3], nt: [f64; 3]) {
        let clean = |n: [f64; 3]| if n[0].is_nan() { [0.0; 3] } else { n };
        let (a, b) = (clean(ns), clean(nt));
        let flat = 1.0 - FLAT;
        let term = |i: usize, j: usize| -flat * (a[i] * a[j] + b[i] * b[j]);
        let c = [2.0 + term(0, 0), term(0, 1), term(0, 2), 2.0 + term(1, 1), term(1, 2), 2.0 + term(2, 2)];
        let m = inverse(c);
        let d = [t[0] - p[0], t[1] - p[1], t[2] - p[2]];
        let md = [
            m[0] * d[0] + m[1] * d[1] + m[2] * d[2],
            m[1] * d[0] + m[3] * d[1] + m[4] * d[2],
            m[2] * d[0] + m[4] * d[1] + m[5] * d[2],
        ];
        // Scaled so that two parallel planes at a distance r count r².
        let square = 2.0 * FLAT * (md[0] * d[0] + md[1] * d[1] + md[2] * d[2]);
        sums.count(square);
        sums.add_weighted(p, d, m, self.weight(square));
    }
}

/// Inverse of a symmetric, positive definite matrix (xx xy xz yy yz zz).
#[inline(always)]
fn inverse(c: [f64; 6]) -> [f64; 6] {
    let [xx, xy, xz, yy, yz, zz] = c;
    let (a, b, d) = (yy * zz - yz * yz, xz * yz - xy * zz, xy * yz - yy * xz);
    let per = 1.0 / (xx * a + xy * b + xz * d);
    [
        a * per,
        b * per,
        d * per,
        (xx * zz - xz * xz) * per,
        (xy * xz - xx * yz) * per,
        (xx * yy - xy * xy) * per,
    ]
}
