//! Steps 3 and 4: joint alignment of all views.
//!
//! One least-squares problem over all poses: point-to-plane distances between every two views that
//! overlap, and each pose's distance from its localised pose. The latter fix the common frame as
//! the robust average of the localised poses.

use super::parts::Part;
use super::prepare::{Prepared, Surfel, departure};
use crate::pool;
use crate::register::{Partner, Sums};
use crate::scale::SHAPE_M;
use nalgebra::{
    DMatrix, DVector, Isometry3, Matrix3, Matrix3x6, Matrix6, Translation3, UnitQuaternion, Vector3, Vector6,
};

/// Parameters of one alignment round.
#[derive(Clone, Copy, Debug)]
pub(super) struct Round {
    /// Maximum correspondence distance at the first iteration, metres.
    pub from_m: f64,
    /// Maximum correspondence distance at the last iteration, metres.
    pub to_m: f64,
    /// Maximum number of iterations.
    pub passes: usize,
    /// Maximum number of query points of each part per view, over all its partner views.
    pub asked: usize,
    /// Weight of points on planes, and of points on no surface, relative to object points.
    pub rest_weight: f32,
}

/// Result of an alignment round for one view.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Found {
    /// Number of correspondences with other views.
    pub matched: usize,
    /// Root mean square point-to-plane distance of the correspondences, metres.
    pub residual_m: f64,
    /// True if the cameras hardly moved in the last iteration.
    pub converged: bool,
}

/// Normal equations of the correspondences between two views.
struct Link {
    from: usize,
    to: usize,
    /// Blocks of the normal matrix: first view, both views, second view.
    blocks: [Matrix6<f64>; 3],
    /// Right-hand sides of the first and the second view.
    rights: [Vector6<f64>; 2],
    /// Number of correspondences.
    matched: usize,
    /// Sum of the squared point-to-plane distances, square metres.
    squares: f64,
}

/// Minimum standard deviation of corresponding points, metres, which are seldom the same surface
/// point. From: derived, within the limits of the shape model.
const LEAST_SIGMA_M: f32 = SHAPE_M as f32;
/// Number of nearest views that constrain a view. From: chosen.
pub(super) const PARTNERS: usize = 5;
/// Minimum cosine between the normals of corresponding points. From: chosen, about 41°.
const SAME_SIDE: f32 = 0.75;
/// Allowed excess of a correspondence's distance over that of the nearest point, as a share of the
/// maximum distance; the surface is much the same there. From: chosen.
const SLACK: f32 = 0.1;
/// Motion of all cameras below which a round ends, metres and radians. From: chosen.
const SETTLED: (f64, f64) = (2e-4, 2e-4);
/// Multiple of the convergence limit at which views still count as settled after the last
/// iteration. From: chosen.
const NEARLY: f64 = 5.0;
/// Multiple of the final correspondence distance up to which a round may end early. From: chosen.
const LATE: f64 = 1.5;

/// Aligns the views marked `used` jointly. `loose`: factor on each view's stated localisation error
/// (0: fixed). `parts`: partition of each view's points.
pub(super) fn align(
    views: &[Prepared],
    used: &[bool],
    loose: &[f64],
    parts: &[Vec<Part>],
    poses: &mut [Isometry3<f64>],
    round: &Round,
) -> Vec<Found> {
    let _span = tracing::debug_span!("align", views = views.len(), passes = round.passes).entered();
    let asks = |(parts, used): (&Vec<Part>, &bool)| Askers::of(if *used { parts } else { &[] });
    let askers: Vec<Askers> = parts.iter().zip(used).map(asks).collect();
    let pairs = pairs(views, used, poses);
    let of_view = |i: usize| pairs.iter().filter(|pair| pair.0 == i).count();
    let ask = |&(i, j): &(usize, usize)| {
        Asked::of(&views[i].points, &askers[i], (i, j), round.asked / of_view(i), round)
    };
    let of_moving = pairs.iter().filter(|&&(i, j)| loose[i].max(loose[j]) > 0.0);
    let mut asked: Vec<Asked> = of_moving.map(ask).collect();
    let mut found = vec![Found::default(); views.len()];
    for pass in 0..round.passes {
        let share = pass as f64 / (round.passes.max(2) - 1) as f64;
        let radius = round.from_m * (round.to_m / round.from_m).powf(share);
        let mut linked: Vec<(&mut Asked, Option<Link>)> =
            asked.iter_mut().map(|asked| (asked, None)).collect();
        pool::for_each(
            &mut linked,
            1,
            || (),
            |(), _, (asked, of)| *of = Some(link(views, asked, poses, radius)),
        );
        let links: Vec<Link> = linked.into_iter().filter_map(|(_, link)| link).collect();
        let moved = step(views, used, loose, poses, &links);
        for (i, f) in found.iter_mut().enumerate() {
            let own = links.iter().filter(|l| l.from == i || l.to == i);
            let (n, squares) = own.fold((0, 0.0), |(n, s), l| (n + l.matched, s + l.squares));
            *f = Found {
                matched: n,
                residual_m: (squares / n.max(1) as f64).sqrt(),
                converged: moved.0 < NEARLY * SETTLED.0 && moved.1 < NEARLY * SETTLED.1,
            };
        }
        if share >= 0.5 && moved.0 < SETTLED.0 && moved.1 < SETTLED.1 && radius <= LATE * round.to_m {
            break;
        }
    }
    found
}

/// Indices of a view's points, by part: planes, objects, others.
struct Askers([Vec<u32>; 3]);

impl Askers {
    fn of(parts: &[Part]) -> Askers {
        let of = |part| (0..parts.len() as u32).filter(|&k| parts[k as usize] == part).collect();
        Askers([Part::Plane, Part::Standing, Part::Around].map(of))
    }

    /// At most about `asked` points per part with their weights, evenly spread and different for
    /// each partner view.
    fn some(&self, asked: usize, round: &Round, partner: usize) -> impl Iterator<Item = (usize, f32)> {
        let spread = move |of: &'_ [u32]| {
            let stride = (of.len() / asked.max(1)).max(1);
            (partner % stride..of.len()).step_by(stride)
        };
        let weights = [round.rest_weight, 1.0, round.rest_weight];
        let sorts = self.0.iter().zip(weights);
        sorts.flat_map(move |(sort, weight)| spread(sort).map(move |at| (sort[at] as usize, weight)))
    }
}

/// Correspondences of one view with another over a round.
struct Asked {
    from: usize,
    to: usize,
    /// Query points of the first view, with weights.
    points: Vec<(Surfel, f32)>,
    /// Current correspondence of each query point.
    partners: Vec<Partner>,
}

impl Asked {
    fn of(
        view: &[Surfel],
        askers: &Askers,
        (from, to): (usize, usize),
        asked: usize,
        round: &Round,
    ) -> Asked {
        let some = askers.some(asked, round, to);
        let points: Vec<(Surfel, f32)> = some.map(|(k, weight)| (view[k], weight)).collect();
        Asked { from, to, partners: vec![Partner::UNKNOWN; points.len()], points }
    }
}

/// Pairs of views to match: all if few, else each view with those of the nearest cameras.
fn pairs(views: &[Prepared], used: &[bool], poses: &[Isometry3<f64>]) -> Vec<(usize, usize)> {
    /// Number of views from which only nearest pairs are matched. From: chosen.
    const ALL_BELOW: usize = 7;
    let active: Vec<usize> = (0..views.len()).filter(|&i| used[i] && !views[i].points.is_empty()).collect();
    let mut pairs = Vec::new();
    for &i in &active {
        let mut others: Vec<usize> = active.iter().copied().filter(|&j| j != i).collect();
        if active.len() >= ALL_BELOW {
            let apart = |j: usize| {
                let turn = poses[i].rotation.angle_to(&poses[j].rotation);
                (poses[i].translation.vector - poses[j].translation.vector).norm() + turn
            };
            others.sort_by(|&a, &b| apart(a).total_cmp(&apart(b)).then(a.cmp(&b)));
            // Near neighbours hold the chain, a few far ones close the ring.
            let far: Vec<usize> =
                others.iter().copied().skip(PARTNERS).step_by(others.len() / 2 + 1).collect();
            others.truncate(PARTNERS);
            others.extend(far);
        }
        pairs.extend(others.into_iter().map(|j| (i, j)));
    }
    pairs
}

/// Correspondences of one view's query points in the other view, and their normal equations for
/// both poses.
fn link(views: &[Prepared], asked: &mut Asked, poses: &[Isometry3<f64>], radius: f64) -> Link {
    /// Squared distance at which a correspondence has a quarter of its weight, as a share of the
    /// squared radius. From: chosen.
    const HALF_SQ: f32 = 0.25;
    /// Minimum squared distance at which a correspondence has a quarter of its weight, in variances
    /// of the correspondence. From: chosen.
    const SPREADS_SQ: f32 = 4.0;
    let (i, j) = (asked.from, asked.to);
    let mut sums = Sums::ZERO;
    let Some(tree) = &views[j].tree else { return Link::of(i, j, &sums, poses) };
    let j_from_i = poses[j].inv_mul(&poses[i]);
    let turn: Matrix3<f32> = j_from_i.rotation.to_rotation_matrix().into_inner().cast();
    let (shift, radius) = (j_from_i.translation.vector.cast::<f32>(), radius as f32);
    let mut last = Partner::UNKNOWN;
    for ((point, part_weight), partner) in asked.points.iter().zip(&mut asked.partners) {
        // From the first camera, and from the second, along the axes of the second.
        let arm = turn * point.at.coords;
        let in_j = arm + shift;
        if partner.is_unknown() {
            // Points that are asked for one after another are near each other.
            *partner = last.guess();
        }
        let found = partner.update(tree, in_j.into(), radius, SLACK * radius);
        last = *partner;
        let Some(slot) = found else { continue };
        let Surfel { at, normal, sigma_m } = &views[j].points[slot];
        if (turn * point.normal).dot(normal) < SAME_SIDE {
            continue;
        }
        let residual = normal.dot(&(in_j - at.coords));
        let variance = point.sigma_m * point.sigma_m + sigma_m * sigma_m + LEAST_SIGMA_M * LEAST_SIGMA_M;
        // Geman-McClure: what does not fit within the radius loses its say smoothly.
        let scale_sq = (HALF_SQ * radius * radius).max(SPREADS_SQ * variance);
        let robust = scale_sq / (scale_sq + residual * residual);
        let along = arm.cross(normal);
        let derivative = [along.x, along.y, along.z, normal.x, normal.y, normal.z].map(f64::from);
        sums.add_scalar(derivative, f64::from(residual), f64::from(part_weight * robust * robust / variance));
    }
    Link::of(i, j, &sums, poses)
}

impl Link {
    /// Normal equations in the world frame, with rotations about the cameras, from the sums over
    /// motions of the first camera along the axes of the second. Those of the second camera are the
    /// negatives, with a shift from its rotation.
    fn of(i: usize, j: usize, sums: &Sums, poses: &[Isometry3<f64>]) -> Link {
        let axes = poses[j].rotation.to_rotation_matrix().into_inner();
        let mut world = Matrix6::zeros();
        world.fixed_view_mut::<3, 3>(0, 0).copy_from(&axes);
        world.fixed_view_mut::<3, 3>(3, 3).copy_from(&axes);
        let own = world * sums.information() * world.transpose();
        let right = world * sums.right();
        let apart = poses[i].translation.vector - poses[j].translation.vector;
        let mut other = -Matrix6::identity();
        other.fixed_view_mut::<3, 3>(0, 3).copy_from(&-apart.cross_matrix());
        Link {
            from: i,
            to: j,
            blocks: [own, own * other.transpose(), other * own * other.transpose()],
            rights: [-right, -(other * right)],
            matched: sums.matched,
            squares: sums.square,
        }
    }
}

/// Takes a Gauss-Newton step on all poses; returns the largest shift, metres, and rotation,
/// radians.
fn step(
    views: &[Prepared],
    used: &[bool],
    loose: &[f64],
    poses: &mut [Isometry3<f64>],
    links: &[Link],
) -> (f64, f64) {
    /// Maximum number of independent measurements that a matched surface counts for, as
    /// neighbouring errors are correlated. From: chosen.
    const INDEPENDENT: f64 = 150.0;
    let mut slots = vec![None; views.len()];
    let active: Vec<usize> = (0..views.len()).filter(|&i| used[i] && loose[i] > 0.0).collect();
    active.iter().enumerate().for_each(|(slot, &i)| slots[i] = Some(6 * slot));
    let n = 6 * active.len();
    let mut normal = DMatrix::<f64>::zeros(n, n);
    let mut right = DVector::<f64>::zeros(n);
    for link in links {
        // What does not move has no rows.
        let (i, j) = (slots[link.from], slots[link.to]);
        let shared = (INDEPENDENT / link.matched.max(1) as f64).min(1.0);
        let mut add = |r: Option<usize>, c: Option<usize>, m: &Matrix6<f64>| {
            if let Some((r, c)) = r.zip(c) {
                let mut view = normal.fixed_view_mut::<6, 6>(r, c);
                view += m * shared;
            }
        };
        add(i, i, &link.blocks[0]);
        add(i, j, &link.blocks[1]);
        add(j, i, &link.blocks[1].transpose());
        add(j, j, &link.blocks[2]);
        for (at, own) in [(i, &link.rights[0]), (j, &link.rights[1])] {
            if let Some(at) = at {
                let mut rows = right.fixed_rows_mut::<6>(at);
                rows += own * shared;
            }
        }
    }
    for (slot, &i) in active.iter().enumerate() {
        let (turn, shift) = departure(&poses[i], &views[i].prior);
        for (k, (off, sigma)) in
            [(turn, views[i].sigma_rad), (shift, views[i].sigma_m)].into_iter().enumerate()
        {
            let sigma = loose[i] * sigma;
            let weight = prior_weight(off.norm() / sigma) / (sigma * sigma);
            for axis in 0..3 {
                let at = 6 * slot + 3 * k + axis;
                normal[(at, at)] += weight;
                right[at] -= weight * off[axis];
            }
        }
    }
    let Some(solution) = normal.cholesky().map(|c| c.solve(&right)) else { return (0.0, 0.0) };
    let mut most = (0.0_f64, 0.0_f64);
    for (slot, &i) in active.iter().enumerate() {
        let d = solution.fixed_rows::<6>(6 * slot);
        let (turn, shift) = (Vector3::new(d[0], d[1], d[2]), Vector3::new(d[3], d[4], d[5]));
        if !(turn.norm() < 1.0 && shift.norm() < 1.0) {
            continue;
        }
        poses[i] = Isometry3::from_parts(
            Translation3::from(poses[i].translation.vector + shift),
            UnitQuaternion::from_scaled_axis(turn) * poses[i].rotation,
        );
        most = (most.0.max(shift.norm()), most.1.max(turn.norm()));
    }
    most
}

/// Rigid transform of all views onto the robust mean of their localised poses.
pub(super) fn onto_priors(views: &[Prepared], used: &[bool], poses: &[Isometry3<f64>]) -> Isometry3<f64> {
    /// Number of Gauss-Newton steps; the first nearly suffices. From: chosen.
    const PASSES: usize = 4;
    let active: Vec<usize> = (0..poses.len()).filter(|&i| used[i]).collect();
    let sum: Vector3<f64> = active.iter().map(|&i| poses[i].translation.vector).sum();
    let middle = Translation3::from(sum / active.len().max(1) as f64);
    let mut about = Isometry3::identity();
    for _ in 0..PASSES {
        let moved = middle * about * middle.inverse();
        let (mut normal, mut right) = (Matrix6::<f64>::zeros(), Vector6::<f64>::zeros());
        for &i in &active {
            let pose = moved * poses[i];
            let (turn, shift) = departure(&pose, &views[i].prior);
            let weigh = |off: &Vector3<f64>, sigma: f64| prior_weight(off.norm() / sigma) / (sigma * sigma);
            let weights = [weigh(&turn, views[i].sigma_rad), weigh(&shift, views[i].sigma_m)];
            let arm = pose.translation.vector - middle.vector;
            let mut shifted = Matrix3x6::zeros();
            shifted.fixed_view_mut::<3, 3>(0, 0).copy_from(&-arm.cross_matrix());
            shifted.fixed_view_mut::<3, 3>(0, 3).copy_from(&Matrix3::identity());
            normal += shifted.transpose() * shifted * weights[1];
            right -= shifted.transpose() * shift * weights[1];
            for axis in 0..3 {
                normal[(axis, axis)] += weights[0];
                right[axis] -= weights[0] * turn[axis];
            }
        }
        let Some(solved) = normal.cholesky().map(|of| of.solve(&right)) else { break };
        let turn = UnitQuaternion::from_scaled_axis(solved.fixed_rows::<3>(0).into_owned());
        about = Isometry3::from_parts(solved.fixed_rows::<3>(3).into_owned().into(), turn) * about;
    }
    middle * about * middle.inverse()
}

/// Weight of a camera's localised pose in the common frame, decreasing with its distance, so that
/// one lost view does not drag the others.
fn prior_weight(sigmas: f64) -> f64 {
    /// Distance at which the weight is one half, in standard deviations. From: chosen.
    const HALVED: f64 = 4.0;
    1.0 / (1.0 + (sigmas / HALVED).powi(2))
}
