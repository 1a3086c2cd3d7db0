//! RANSAC on two points with their normals, then Gauss-Newton on what was found.

use super::{Cylinder, CylinderError, CylinderFit, CylinderOptions};
use crate::cloud::is_finite;
use crate::draw::Draws;
use crate::spread::tangents;
use nalgebra::{Matrix5, Point3, Unit, Vector3, Vector5};

/// Rounds of least squares and collecting anew, and steps of each.
const REFITS: usize = 3;
const STEPS: usize = 8;
/// Parts of the circle by which the covered arc is told.
const PARTS: usize = 24;

/// The cylinder with most points within the tolerances. The same points, options and seed give the same cylinder.
///
/// # Errors
/// If normals and points differ in number, if fewer than five are usable, or if no cylinder is as asked.
pub fn find(
    points: &[Point3<f32>],
    normals: &[Vector3<f32>],
    options: &CylinderOptions,
) -> Result<CylinderFit, CylinderError> {
    let _span = tracing::debug_span!("cylinder", points = points.len()).entered();
    if points.len() != normals.len() {
        return Err(CylinderError::Normals { points: points.len(), normals: normals.len() });
    }
    if !(options.tolerance_m > 0.0 && options.tolerance_m.is_finite()) {
        return Err(CylinderError::Tolerance { tolerance_m: options.tolerance_m });
    }
    let usable: Vec<Sample> = (0u32..)
        .zip(points.iter().zip(normals))
        .filter(|(_, (p, n))| is_finite(p) && n.iter().all(|c| c.is_finite()))
        .map(|(index, (p, n))| Sample { index, at: *p, normal: *n })
        .collect();
    if usable.len() < 5 {
        return Err(CylinderError::TooFew { found: usable.len() });
    }
    let (best, rounds_used) = sample(&usable, options);
    let best = best.ok_or(CylinderError::None { rounds: options.rounds })?;
    Ok(polish(&usable, best, rounds_used, options))
}

#[derive(Clone, Copy)]
struct Sample {
    index: u32,
    at: Point3<f32>,
    normal: Vector3<f32>,
}

fn sample(usable: &[Sample], options: &CylinderOptions) -> (Option<Cylinder>, usize) {
    let mut draws = Draws::new(options.seed);
    let mut best: Option<(Cylinder, usize)> = None;
    let mut used = 0;
    for _ in 0..options.rounds {
        let Some([a, b]) = draws.distinct::<2>(usable.len()) else { break };
        let Some(candidate) = through(&usable[a], &usable[b], options) else { continue };
        used += 1;
        let beaten = best.map_or(0, |(_, most)| most);
        if let Some(count) = count(usable, &candidate, options, beaten) {
            best = Some((candidate, count));
        }
    }
    (best.map(|(cylinder, _)| cylinder), used)
}

/// The cylinder on which two points lie with these normals, if there is one that was asked for.
fn through(a: &Sample, b: &Sample, options: &CylinderOptions) -> Option<Cylinder> {
    let (na, nb) = (a.normal.cast::<f64>(), b.normal.cast::<f64>());
    let (pa, pb) = (a.at.cast::<f64>(), b.at.cast::<f64>());
    let axis = match options.axis {
        Some((direction, within_rad)) if within_rad <= 0.0 => direction,
        asked => {
            let across = na.cross(&nb);
            // Normals that differ by less than some three degrees do not tell the axis.
            let axis = Unit::try_new(across, 0.05)?;
            let (direction, within_rad) = asked.unwrap_or((axis, 0.0));
            let along = axis.dot(&direction);
            if along.abs() < within_rad.cos() {
                return None;
            }
            if along < 0.0 { -axis } else { axis }
        }
    };
    // Across the axis, the centre is where the lines along both normals meet.
    let flat = |v: Vector3<f64>| v - axis.into_inner() * v.dot(&axis);
    let (ua, ub, between) = (flat(na), flat(nb), flat(pb - pa));
    let turn = axis.dot(&ua.cross(&ub));
    if turn.abs() < 0.05 {
        return None;
    }
    let centre = pa + ua * (axis.dot(&between.cross(&ub)) / turn);
    let cylinder = Cylinder { at: centre, axis, radius_m: 0.0 };
    let (ra, rb) = (cylinder.from_axis_m(&pa), cylinder.from_axis_m(&pb));
    let radius_m = (ra + rb) / 2.0;
    let fits = (ra - rb).abs() <= 2.0 * options.tolerance_m && options.radius_m.contains(&radius_m);
    fits.then_some(Cylinder { radius_m, ..cylinder })
}

/// Single-precision form of a cylinder, for looking at many points.
struct Gauge {
    at: Vector3<f32>,
    axis: Vector3<f32>,
    near_sq: f32,
    far_sq: f32,
    cos_sq: f32,
}

impl Gauge {
    fn of(cylinder: &Cylinder, options: &CylinderOptions) -> Gauge {
        let near = (cylinder.radius_m - options.tolerance_m).max(0.0);
        let far = cylinder.radius_m + options.tolerance_m;
        Gauge {
            at: cylinder.at.coords.cast(),
            axis: cylinder.axis.into_inner().cast(),
            near_sq: (near * near) as f32,
            far_sq: (far * far) as f32,
            cos_sq: options.normal_rad.clamp(0.0, std::f64::consts::FRAC_PI_2).cos().powi(2) as f32,
        }
    }

    #[inline(always)]
    fn holds(&self, s: &Sample) -> bool {
        let d = s.at.coords - self.at;
        let radial = d - self.axis * d.dot(&self.axis);
        let square = radial.norm_squared();
        let along = radial.dot(&s.normal);
        (square >= self.near_sq) & (square <= self.far_sq) & (along * along >= self.cos_sq * square)
    }
}

/// How many points the cylinder holds; `None` as soon as it cannot beat `beaten`.
fn count(usable: &[Sample], cylinder: &Cylinder, options: &CylinderOptions, beaten: usize) -> Option<usize> {
    const BLOCK: usize = 256;
    let gauge = Gauge::of(cylinder, options);
    let (mut found, mut left) = (0, usable.len());
    for block in usable.chunks(BLOCK) {
        if found + left <= beaten {
            return None;
        }
        found += block.iter().filter(|s| gauge.holds(s)).count();
        left -= block.len();
    }
    (found > beaten).then_some(found)
}

fn polish(
    usable: &[Sample],
    mut cylinder: Cylinder,
    rounds_used: usize,
    options: &CylinderOptions,
) -> CylinderFit {
    let collect = |c: &Cylinder| -> Vec<Sample> {
        let gauge = Gauge::of(c, options);
        usable.iter().filter(|s| gauge.holds(s)).copied().collect()
    };
    let mut inliers = collect(&cylinder);
    for _ in 0..REFITS {
        let Some(better) = least_squares(&inliers, &cylinder, options) else { break };
        let kept = collect(&better);
        if kept.len() < inliers.len() {
            break;
        }
        (cylinder, inliers) = (better, kept);
    }
    describe(cylinder, &inliers, usable.len(), rounds_used)
}

/// Gauss-Newton on the distances from the surface: place and tilt across the axis, and radius. `None` if the result is none that was asked for.
fn least_squares(inliers: &[Sample], start: &Cylinder, options: &CylinderOptions) -> Option<Cylinder> {
    let fixed = options.axis.is_some_and(|(_, within_rad)| within_rad <= 0.0);
    let mut cylinder = centred(start, inliers);
    for _ in 0..STEPS {
        let (u, v) = tangents(&cylinder.axis);
        let (mut h, mut g) = (Matrix5::zeros(), Vector5::zeros());
        for s in inliers {
            let d = s.at.cast::<f64>() - cylinder.at;
            let along = d.dot(&cylinder.axis);
            let radial = d - cylinder.axis.into_inner() * along;
            let length = radial.norm();
            if length <= 0.0 {
                continue;
            }
            let (nu, nv) = (radial.dot(&u) / length, radial.dot(&v) / length);
            let tilt = if fixed { 0.0 } else { -along };
            let j = Vector5::new(-nu, -nv, tilt * nu, tilt * nv, -1.0);
            h += j * j.transpose();
            g -= j * (length - cylinder.radius_m);
        }
        if fixed {
            h[(2, 2)] = 1.0;
            h[(3, 3)] = 1.0;
        }
        let step = h.cholesky()?.solve(&g);
        let axis = Unit::try_new(cylinder.axis.into_inner() + u * step[2] + v * step[3], 1e-9)?;
        let at = cylinder.at + u * step[0] + v * step[1];
        cylinder = Cylinder { at, axis, radius_m: cylinder.radius_m + step[4] };
        if step.amax() < 1e-9 {
            break;
        }
    }
    let upright = options
        .axis
        .is_none_or(|(direction, within_rad)| fixed || cylinder.axis.dot(&direction) >= within_rad.cos());
    (upright && options.radius_m.contains(&cylinder.radius_m)).then_some(cylinder)
}

/// The same cylinder with `at` beside the middle of the inliers.
fn centred(cylinder: &Cylinder, inliers: &[Sample]) -> Cylinder {
    let along = |s: &Sample| (s.at.cast::<f64>() - cylinder.at).dot(&cylinder.axis);
    let mean = inliers.iter().map(along).sum::<f64>() / inliers.len().max(1) as f64;
    Cylinder { at: cylinder.at + cylinder.axis.into_inner() * mean, ..*cylinder }
}

fn describe(cylinder: Cylinder, inliers: &[Sample], of: usize, rounds_used: usize) -> CylinderFit {
    let cylinder = centred(&cylinder, inliers);
    let (u, v) = tangents(&cylinder.axis);
    let mut square = 0.0;
    let mut extent_m = (f64::INFINITY, f64::NEG_INFINITY);
    let mut seen = [false; PARTS];
    for s in inliers {
        let p = s.at.cast::<f64>();
        let along = (p - cylinder.at).dot(&cylinder.axis);
        extent_m = (extent_m.0.min(along), extent_m.1.max(along));
        let radial = cylinder.radial(&p);
        square += (radial.norm() - cylinder.radius_m).powi(2);
        let turn = radial.dot(&v).atan2(radial.dot(&u)) / std::f64::consts::TAU + 0.5;
        seen[((turn * PARTS as f64) as usize).min(PARTS - 1)] = true;
    }
    let covered = seen.iter().filter(|s| **s).count();
    CylinderFit {
        cylinder,
        inliers: inliers.iter().map(|s| s.index).collect(),
        of,
        rms_m: (square / inliers.len().max(1) as f64).sqrt(),
        extent_m,
        arc_rad: covered as f64 / PARTS as f64 * std::f64::consts::TAU,
        rounds_used,
    }
}
