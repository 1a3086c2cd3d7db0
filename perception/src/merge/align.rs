//! Alignment of all views, steps 3 and 4 of the paper: by all points, then by the objects; views
//! that contradict the others are left out.

use super::check::{self, Misfit};
use super::joint::{self, Found, Round};
use super::merged::{Step, ViewFit};
use super::options::MergeOptions;
use super::parts::{self, Part, Parts, Plane};
use super::prepare::{Prepared, departure};
use super::search::{self, Oriented, PERHAPS_SHARE, SURE_SHARE};
use crate::scale::SPREADS;
use crate::visibility::{DepthMap, Visibility};
use nalgebra::{Isometry3, Point3, Unit, UnitQuaternion, Vector3};

/// First alignment (paper step 3): all points, from far to near correspondences; the table weighs
/// most. From: chosen.
pub(super) const FIRST: Round = Round { from_m: 0.12, to_m: 0.04, passes: 6, asked: 800, rest_weight: 1.0 };

/// First alignment with a wider search, if a view would otherwise be left out: localisation may be
/// worse than stated. From: chosen.
pub(super) const WIDE: Round = Round { from_m: 0.3, passes: 12, asked: 900, ..FIRST };

/// Second alignment: planes and distant points weigh little, the objects decide (paper step 4).
/// From: chosen.
pub(super) const SECOND: Round =
    Round { from_m: 0.05, to_m: 0.012, passes: 9, asked: 1200, rest_weight: 0.2 };

/// Alignment of the remaining views after one was left out. From: chosen.
const SETTLE: Round = Round { from_m: 0.02, to_m: 0.012, passes: 4, asked: 1200, rest_weight: 0.2 };

/// Result of aligning all views (steps 3 and 4), with an entry per view.
#[derive(Debug)]
pub(super) struct Aligned {
    /// Aligned pose of each camera in the world.
    pub poses: Vec<Isometry3<f64>>,
    pub used: Vec<bool>,
    /// Reason each unused view is left out.
    pub whys: Vec<Option<Misfit>>,
    /// Result of the last alignment of each view.
    pub found: Vec<Found>,
    /// The dominant planes that are level, world frame.
    pub planes: Vec<Plane>,
    /// Part of the scene that each point belongs to.
    pub parts: Parts,
    pub steps: Vec<Step>,
}

impl Aligned {
    fn left_out(&self) -> usize {
        self.used.iter().filter(|used| !**used).count()
    }
}

/// Carries out steps 3 and 4, with a wider search if a view would otherwise be left out.
pub(super) fn place(
    prepared: &[Prepared],
    maps: &[Option<DepthMap>],
    options: &MergeOptions,
    steps: &mut Vec<Step>,
) -> Aligned {
    let mut aligned = align(prepared, maps, options.up, &FIRST);
    if aligned.left_out() > 0 {
        let wide = align(prepared, maps, options.up, &WIDE);
        if wide.left_out() < aligned.left_out() {
            aligned = wide;
        }
    }
    steps.append(&mut aligned.steps);
    aligned
}

/// Carries out steps 3 and 4 from the stated poses.
fn align(
    prepared: &[Prepared],
    maps: &[Option<DepthMap>],
    up: Option<Unit<Vector3<f64>>>,
    first: &Round,
) -> Aligned {
    let mut steps = Vec::new();
    let mut poses: Vec<Isometry3<f64>> = prepared.iter().map(|p| p.prior).collect();
    let mut whys: Vec<Option<Misfit>> =
        prepared.iter().map(|p| p.points.is_empty().then_some(Misfit::Empty)).collect();
    let mut used: Vec<bool> = whys.iter().map(Option::is_none).collect();
    align_everything(prepared, &used, &mut poses, first, &mut steps);
    let parts = parts::find(prepared, &used, &poses, up, &mut steps);
    let found =
        align_objects(prepared, &mut used, &mut whys, &parts.of, parts.up, &mut poses, maps, &mut steps);
    let planes = parts::level_again(&parts.planes, parts.up, prepared, &used, &parts.of, &poses);
    Aligned { poses, used, whys, found, planes, parts, steps }
}

/// Carries out step 3: alignment by all points, in which the table levels the views.
fn align_everything(
    prepared: &[Prepared],
    used: &[bool],
    poses: &mut [Isometry3<f64>],
    first: &Round,
    steps: &mut Vec<Step>,
) {
    let all: Vec<Vec<Part>> = prepared.iter().map(|p| vec![Part::Standing; p.points.len()]).collect();
    let found = joint::align(prepared, used, &as_stated(prepared), &all, poses, first);
    steps.push(aligned("first alignment", &found));
}

fn aligned(name: &str, found: &[Found]) -> Step {
    let matched: usize = found.iter().map(|f| f.matched).sum();
    let squares: f64 = found.iter().map(|f| f.matched as f64 * f.residual_m.powi(2)).sum();
    let residual_m = (squares / matched.max(1) as f64).sqrt();
    Step {
        name: name.to_owned(),
        points: matched,
        result: format!("matched within {:.1} mm of each other's planes", 1e3 * residual_m),
    }
}

/// Looseness 1 for each view: localisation errors as stated.
pub(super) fn as_stated(prepared: &[Prepared]) -> Vec<f64> {
    vec![1.0; prepared.len()]
}

/// Carries out the second half of step 4: alignment by the objects; views that contradict the
/// others are left out one by one.
#[allow(clippy::too_many_arguments)]
fn align_objects(
    prepared: &[Prepared],
    used: &mut [bool],
    whys: &mut [Option<Misfit>],
    parts: &[Vec<Part>],
    up: Option<Unit<Vector3<f64>>>,
    poses: &mut [Isometry3<f64>],
    maps: &[Option<DepthMap>],
    steps: &mut Vec<Step>,
) -> Vec<Found> {
    let levelled: Vec<Isometry3<f64>> = (0..prepared.len())
        .map(|i| up.map_or(poses[i], |up| only_levelled(&prepared[i], &poses[i], &up)))
        .collect();
    let mut retried = vec![false; prepared.len()];
    let loose = as_stated(prepared);
    let objects = up.map(|up| Objects { prepared, parts, up });
    if let Some(objects) = &objects {
        objects.place_all(used, &levelled, poses);
    }
    let mut found = joint::align(prepared, used, &loose, parts, poses, &SECOND);
    while let Some((worst, why)) = check::misfit(prepared, used, parts, poses, maps, &found) {
        if let Some(objects) = objects.as_ref().filter(|_| !retried[worst]) {
            // The others have settled since: a better model to be placed on than a single view was.
            retried[worst] = true;
            let others: Vec<usize> = (0..prepared.len()).filter(|&i| used[i] && i != worst).collect();
            poses[worst] = levelled[worst];
            let placed = objects.of_all(&others, poses);
            objects.place_on((worst, 1.0, PERHAPS_SHARE), &placed, &levelled[worst], &mut poses[worst]);
            found = joint::align(prepared, used, &loose, parts, poses, &SECOND);
            continue;
        }
        used[worst] = false;
        whys[worst] = Some(why);
        poses[worst] = prepared[worst].prior;
        let settled = joint::align(prepared, used, &loose, parts, poses, &SETTLE);
        found.iter_mut().zip(settled).zip(used.iter()).for_each(|((f, s), u)| {
            if *u {
                *f = s;
            }
        });
    }
    steps.push(aligned("second alignment", &found));
    found
}

/// Pose of the first alignment without its shift along the surface and its rotation about the
/// vertical, which are unreliable; tilt and height are certain.
pub(super) fn only_levelled(
    view: &Prepared,
    pose: &Isometry3<f64>,
    up: &Unit<Vector3<f64>>,
) -> Isometry3<f64> {
    let n = view.points.len().max(1) as f64;
    let middle = view.points.iter().fold(Vector3::zeros(), |s, p| s + p.at().coords) / n;
    let (before, after) = (view.prior * Point3::from(middle), pose * Point3::from(middle));
    let turn = pose.rotation * view.prior.rotation.inverse();
    /// Minimum norm of the twist's quaternion; below it, the twist is neglected. From: rounding.
    const NO_TURN: f64 = 1e-9;
    // Swing and twist: the twist is the part of the turn about the vertical.
    let along = up.dot(&turn.imag());
    let twist = nalgebra::Quaternion::from_parts(turn.scalar(), up.into_inner() * along);
    let twist = UnitQuaternion::try_new(twist, NO_TURN).unwrap_or_else(UnitQuaternion::identity);
    let swing = turn * twist.inverse();
    let rise = up.scale(up.dot(&(after - before)));
    let rotation = swing * view.prior.rotation;
    let translation = before.coords + rise - rotation * middle;
    Isometry3::from_parts(translation.into(), rotation)
}

/// Objects that stand on the surface in some views.
pub(super) struct Objects<'a> {
    pub prepared: &'a [Prepared],
    pub parts: &'a [Vec<Part>],
    pub up: Unit<Vector3<f64>>,
}

impl Objects<'_> {
    /// Places the objects of one view after another onto those already placed, the view with the
    /// most similar camera orientation first.
    fn place_all(&self, used: &[bool], levelled: &[Isometry3<f64>], poses: &mut [Isometry3<f64>]) {
        let mut left: Vec<usize> = (0..used.len()).filter(|&i| used[i]).collect();
        let count = |i: usize| self.parts[i].iter().filter(|p| **p == Part::Standing).count();
        let Some(first) = left.iter().copied().max_by_key(|&i| (count(i), usize::MAX - i)) else { return };
        left.retain(|&i| i != first);
        poses[first] = levelled[first];
        let mut done = vec![first];
        let mut placed = self.of_all(&done, poses);
        while !left.is_empty() {
            let apart = |i: usize| {
                let turns = done.iter().map(|&d| poses[i].rotation.angle_to(&poses[d].rotation));
                turns.min_by(f64::total_cmp).unwrap_or(0.0)
            };
            let nearest = left.iter().copied().min_by(|&a, &b| apart(a).total_cmp(&apart(b)).then(a.cmp(&b)));
            let Some(next) = nearest else { return };
            left.retain(|&i| i != next);
            self.place_on((next, 1.0, SURE_SHARE), &placed, &levelled[next], &mut poses[next]);
            placed.extend(self.of_all(&[next], poses));
            done.push(next);
        }
    }

    /// Object points and normals of some views, world frame.
    pub fn of_all(&self, views: &[usize], poses: &[Isometry3<f64>]) -> Vec<Oriented> {
        views.iter().flat_map(|&i| objects(&self.prepared[i], &self.parts[i], &poses[i])).collect()
    }

    /// Places the objects of a view onto placed ones by search from its levelled pose; keeps the
    /// current pose if that fits better, or if less than `least_share` of the points would match.
    /// `loose`: factor on the search window.
    pub fn place_on(
        &self,
        (view, loose, least_share): (usize, f64, f64),
        placed: &[Oriented],
        levelled: &Isometry3<f64>,
        pose: &mut Isometry3<f64>,
    ) {
        /// Margin of the matching share by which the current pose is preferred over a searched one.
        /// From: chosen.
        const STAYS: f64 = 0.05;
        let (up, view, parts) = (&self.up, &self.prepared[view], &self.parts[view]);
        let own = objects(view, parts, levelled);
        let window = window(view, loose, &own, levelled);
        let Some(found) = search::place(&own, placed, up, window, least_share) else { return };
        let stays = search::fits(&objects(view, parts, pose), placed, up) > found.share + STAYS;
        if !stays {
            *pose = found.correction * levelled;
        }
    }
}

/// Points and normals of the objects on the surface in a view, world frame.
pub(super) fn objects(view: &Prepared, parts: &[Part], pose: &Isometry3<f64>) -> Vec<Oriented> {
    let standing = (0..view.points.len()).filter(|&k| parts[k] == Part::Standing);
    standing.map(|k| (pose * view.points[k].at(), pose.rotation * view.points[k].normal())).collect()
}

/// Search window of a view from its pose uncertainty at the objects' distance: three standard
/// deviations, at least the 10 cm and 6° of a poor localisation.
fn window(view: &Prepared, loose: f64, objects: &[Oriented], pose: &Isometry3<f64>) -> search::Window {
    /// Minimum and maximum rotation of the search window, radians. From: chosen, 6° to 8°.
    const TURNS_RAD: (f64, f64) = (0.105, 0.14);
    /// Minimum and maximum shift of the search window, without the effect of rotation, metres.
    /// From: chosen.
    const SHIFTS_M: (f64, f64) = (0.10, 0.14);
    /// Maximum shift of the search window, with the effect of rotation, metres. From: chosen.
    const WIDEST_M: f64 = 0.3;
    /// Limit of the assumed distance of the objects, metres. From: chosen.
    const FARTHEST_M: f64 = 3.0;
    /// Factor on the search range of the rotation. From: chosen.
    const WIDER: f64 = 1.2;
    let sum = objects.iter().fold(Vector3::zeros(), |s, (p, _)| s + p.coords);
    let distance = (sum / objects.len().max(1) as f64 - pose.translation.vector).norm().min(FARTHEST_M);
    let turn_rad = loose * (SPREADS * view.sigma_rad).clamp(TURNS_RAD.0, TURNS_RAD.1);
    let shift_m = loose * (SPREADS * view.sigma_m).clamp(SHIFTS_M.0, SHIFTS_M.1) + distance * turn_rad;
    search::Window { shift_m: shift_m.min(WIDEST_M), turn_rad: WIDER * turn_rad }
}

/// The visibility of the used views from their corrected poses.
pub(super) fn visibility(maps: Vec<Option<DepthMap>>, used: &[bool], poses: &[Isometry3<f64>]) -> Visibility {
    let placed = |((map, used), pose): ((Option<DepthMap>, &bool), &Isometry3<f64>)| {
        map.filter(|_| *used).map(|map| DepthMap { camera_from_world: pose.inverse(), ..map })
    };
    Visibility { maps: maps.into_iter().zip(used).zip(poses).filter_map(placed).collect(), held: true }
}

/// Fit of each view; moves the reasons for leaving views out from `aligned`.
pub(super) fn fits(prepared: &[Prepared], aligned: &mut Aligned) -> Vec<ViewFit> {
    let Aligned { poses, used, found, whys, .. } = aligned;
    (0..prepared.len()).map(|i| fit(&prepared[i], &poses[i], &found[i], used[i], whys[i].take())).collect()
}

pub(super) fn fit(
    prepared: &Prepared,
    pose: &Isometry3<f64>,
    found: &Found,
    used: bool,
    left_out: Option<Misfit>,
) -> ViewFit {
    let (turn, shift) = departure(pose, &prepared.prior);
    let why = match &left_out {
        Some(why) => format!("left out: {why}"),
        None if found.matched == 0 => "nothing to align with".to_owned(),
        None if found.converged => "settled".to_owned(),
        None => "the passes ran out before it settled".to_owned(),
    };
    ViewFit {
        world_from_camera: *pose,
        moved_m: shift.norm(),
        moved_rad: turn.norm(),
        matched: found.matched,
        residual_m: found.residual_m,
        converged: used && (found.converged || found.matched == 0),
        used,
        is_at_odds: left_out.is_some_and(|why| why.is_at_odds()),
        why,
    }
}
