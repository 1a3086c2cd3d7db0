//! Consistency of views: whether each fits in with the others.

use super::joint::Found;
use super::parts::Part;
use super::prepare::{Prepared, departure};
use crate::surface::range_sigma_m;
use crate::visibility::{DepthMap, Seen};
use nalgebra::Isometry3;
use std::fmt;

/// Fewest matched points for a view to count as overlapping. From: chosen.
const FEWEST_MATCHED: usize = 80;
/// Minimum distance between a surface and free space seen by another camera for a contradiction,
/// metres, or [`CLEAR_SPREADS`] standard deviations if they are more. From: chosen.
pub(super) const CLEAR_M: f64 = 0.03;
/// Minimum distance for a contradiction, in standard deviations of both measurements. From: chosen,
/// so that five views of a room with poses 5 cm and 3° off come back together.
const CLEAR_SPREADS: f64 = 5.0;
/// Share of points that another camera looked through from which a view counts as wrongly placed. From: chosen.
const MOST_CONTRADICTED: f64 = 0.22;

/// Reason why a view is left out of a merge.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Misfit {
    /// The view has no usable point in range.
    Empty,
    /// The view shares too few points with the others: their number.
    Alone(usize),
    /// The required correction exceeds the localisation error, metres and radians.
    Far(f64, f64),
    /// The view contradicts free space seen by the others: share of its points.
    Contradicted(f64),
}

impl Misfit {
    /// True if the view contradicts the others; false if it merely lacks information.
    pub(super) fn is_at_odds(&self) -> bool {
        matches!(self, Misfit::Far(..) | Misfit::Contradicted(_))
    }
}

impl fmt::Display for Misfit {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Misfit::Empty => write!(f, "it has no usable point in range"),
            Misfit::Alone(matched) => write!(f, "it shares only {matched} points with the other views"),
            Misfit::Far(shift_m, turn_rad) => write!(
                f,
                "it would have to move {shift_m:.2} m and turn {:.1}°, more than localisation errs",
                turn_rad.to_degrees()
            ),
            Misfit::Contradicted(share) => {
                write!(
                    f,
                    "{:.0} % of what it shows contradicts what the other views saw through",
                    100.0 * share
                )
            }
        }
    }
}

/// Least consistent view, with the reason; `None` if all used views are consistent.
pub(super) fn misfit(
    views: &[Prepared],
    used: &[bool],
    parts: &[Vec<Part>],
    poses: &[Isometry3<f64>],
    maps: &[Option<DepthMap>],
    found: &[Found],
) -> Option<(usize, Misfit)> {
    let active: Vec<usize> = (0..views.len()).filter(|&i| used[i]).collect();
    if active.len() < 2 {
        return None;
    }
    let lonely = active.iter().copied().filter(|&i| found[i].matched < FEWEST_MATCHED);
    if let Some(i) = lonely.min_by_key(|&i| (views[i].points.len(), usize::MAX - i)) {
        return Some((i, Misfit::Alone(found[i].matched)));
    }
    let far = active.iter().copied().filter_map(|i| too_far(&views[i], &poses[i], 1.0).map(|why| (i, why)));
    if let Some(worst) = far.max_by(|a, b| a.1.0.total_cmp(&b.1.0)) {
        return Some((worst.0, worst.1.1));
    }
    let mut contradicted: Vec<(f64, usize)> =
        active.iter().map(|&i| (contradicted(i, &active, views, parts, poses, maps), i)).collect();
    contradicted.sort_by(|a, b| b.0.total_cmp(&a.0).then(b.1.cmp(&a.1)));
    let (share, worst) = contradicted[0];
    (share > MOST_CONTRADICTED).then_some((worst, Misfit::Contradicted(share)))
}

/// True if a further view with looseness `loose` is consistent with the used views at their poses;
/// `used` includes the further view.
pub(super) fn belongs(
    (view, loose, used): (usize, f64, &[bool]),
    views: &[Prepared],
    parts: &[Vec<Part>],
    poses: &[Isometry3<f64>],
    maps: &[Option<DepthMap>],
    found: &Found,
) -> bool {
    let all: Vec<usize> = (0..views.len()).filter(|&i| used[i]).collect();
    found.matched >= FEWEST_MATCHED
        && too_far(&views[view], &poses[view], loose).is_none()
        && contradicted(view, &all, views, parts, poses, maps) <= MOST_CONTRADICTED
}

/// Mean, over the other views that can judge, of the larger of two shares: this view's points that
/// contradict the other view, and the other view's points that contradict this one.
fn contradicted(
    i: usize,
    active: &[usize],
    views: &[Prepared],
    parts: &[Vec<Part>],
    poses: &[Isometry3<f64>],
    maps: &[Option<DepthMap>],
) -> f64 {
    let others = active.iter().copied().filter(|&j| j != i);
    let worst = others.filter_map(|j| {
        let own = contradiction(&views[i], &parts[i], &poses[i], maps[j].as_ref(), &poses[j]);
        let theirs = contradiction(&views[j], &parts[j], &poses[j], maps[i].as_ref(), &poses[i]);
        own.into_iter().chain(theirs).max_by(f64::total_cmp)
    });
    let (n, sum) = worst.fold((0, 0.0), |(n, s), c| (n + 1, s + c));
    sum / f64::from(n.max(1))
}

/// Correction of a camera pose as a multiple of the maximum plausible one, with the misfit; `None`
/// if plausible.
fn too_far(view: &Prepared, pose: &Isometry3<f64>, loose: f64) -> Option<(f64, Misfit)> {
    /// Maximum accepted pose correction, in standard deviations of localisation. From: chosen.
    const SPREADS: f64 = 5.0;
    /// Pose correction that is always accepted, metres and radians: stated errors are sometimes too
    /// small, and 10 cm and 6° must be corrected. From: chosen.
    const MENDED: (f64, f64) = (0.2, 0.2);
    let most = [(view.sigma_m, MENDED.0), (view.sigma_rad, MENDED.1)];
    let most = most.map(|(sigma, mended)| loose * (SPREADS * sigma).max(mended));
    let (turn, shift) = departure(pose, &view.prior);
    let excess = (shift.norm() / most[0]).max(turn.norm() / most[1]);
    (excess > 1.0).then(|| (excess, Misfit::Far(shift.norm(), turn.norm())))
}

/// Share of a view's object points through which another camera looked, of those that the other
/// camera can judge; `None` if those are too few.
fn contradiction(
    view: &Prepared,
    parts: &[Part],
    pose: &Isometry3<f64>,
    map: Option<&DepthMap>,
    map_pose: &Isometry3<f64>,
) -> Option<f64> {
    /// Approximate number of a view's points that are tested in another camera. From: chosen.
    const ASKED: usize = 300;
    /// Minimum number of points to judge. From: chosen.
    const FEWEST: u32 = 25;
    let map = map?;
    let map_from_view = map_pose.inv_mul(pose);
    let standing: Vec<usize> = (0..view.points.len()).filter(|&k| parts[k] == Part::Standing).collect();
    let stride = (standing.len() / ASKED).max(1);
    let (mut judged, mut through) = (0_u32, 0_u32);
    for &k in standing.iter().step_by(stride) {
        let place = map_from_view * view.points[k].at();
        let sigma_m = range_sigma_m(place.coords.norm()).hypot(f64::from(view.points[k].sigma_m));
        match map.look_from(&place, CLEAR_M.max(CLEAR_SPREADS * sigma_m)) {
            Seen::Free => (judged, through) = (judged + 1, through + 1),
            Seen::Surface => judged += 1,
            Seen::Hidden | Seen::Never => {}
        }
    }
    (judged >= FEWEST).then(|| f64::from(through) / f64::from(judged))
}
