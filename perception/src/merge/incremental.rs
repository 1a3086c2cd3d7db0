//! Incremental merge: a further view of the same place reuses the results of the earlier ones.
//!
//! Results that depend on one view alone are kept while the view is unchanged. A further view is aligned to
//! the nearest earlier views, which stay fixed, and fused; only the voxels that it touches are
//! settled again, and the frame stays the average of the localised poses. Few views hardly
//! determine their poses relative to each other, so the next ones may move them; if they do, all
//! views are fused again. Real cameras distort, and errors of single steps add up: the first views,
//! and all views whenever there are half as many more, are merged together. That is done ahead, in
//! a thread, while the robot drives. Which views are merged together follows from the views alone,
//! so that the same views give the same bytes, whatever was kept.

use super::align::{
    Aligned, FIRST, Objects, SECOND, WIDE, as_stated, fit, fits, objects, only_levelled, place, visibility,
};
use super::check::{belongs, misfit};
use super::depth_samples::Looked;
use super::error::MergeError;
use super::fuse::{Gathered, gather, gather_further};
use super::joint::{self, Found, Round};
use super::merged::{Merged, Step, ViewFit};
use super::options::MergeOptions;
use super::parts::{Part, level_again};
use super::prepare::{Prepared, Ready, departure, filter_and_thin};
use super::search::{PERHAPS_SHARE, SURE_SHARE};
use super::settle::merged;
use crate::cloud::Cloud;
use crate::pool;
use crate::view::View;
use crate::visibility::{DepthMap, Visibility};
use nalgebra::Isometry3;
use rustc_hash::FxHashMap;
use std::fmt;
use std::sync::Arc;
use std::thread::{self, JoinHandle};

/// Number of first views that are merged jointly: a single one shows too little to align another
/// with. From: chosen, names from two views with twice the assumed noise have a Brier score of .025
/// in place of .028.
const TOGETHER: usize = 2;
/// Number of earlier views up to which all are merged together. From: chosen.
const FEW: usize = 6;
/// Number of views up to which the earlier ones may move when a further one is aligned.
/// From: chosen, fewer false names at twice the assumed noise.
const MOVABLE: usize = 4;
/// Minimum relative motion of the earlier views from which they are fused again, metres.
/// From: chosen, with 2 mm there are twice as many false names at twice the assumed noise, three and
/// four views, as with none.
const MOVED_M: f64 = 0.001;

/// Incremental merger of the growing set of views of one place.
#[derive(Default)]
pub struct Merger {
    kept: Kept,
    /// Background computation for the next view.
    ahead: Option<JoinHandle<Kept>>,
}

/// State of the views that were merged last.
#[derive(Default)]
struct Kept {
    options: Option<MergeOptions>,
    digests: Vec<u64>,
    prepared: Vec<Prepared>,
    maps: Vec<Option<DepthMap>>,
    /// Base with which a further view is aligned; `None` if the views must be merged together for a
    /// new base.
    base: Option<Base>,
}

/// State of a merge to which a further view can be added.
struct Base {
    digests: Vec<u64>,
    aligned: Aligned,
    seen: Visibility,
    gathered: Vec<Gathered>,
    /// Returns gathered from each view, while few enough views may still move.
    looked: Option<Vec<Arc<Looked>>>,
    fits: Vec<ViewFit>,
    steps: Vec<Step>,
}

impl fmt::Debug for Merger {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Merger").field("views", &self.kept.digests.len()).finish_non_exhaustive()
    }
}

impl Merger {
    /// Result of [`merge`](super::merge) with the last view aligned to the merge of the others;
    /// faster if the others were merged before.
    ///
    /// # Errors
    /// As [`merge`](super::merge).
    pub fn merge(&mut self, views: &[View], options: &MergeOptions) -> Result<Merged, MergeError> {
        let kept = self.kept();
        pool::within(tracing::debug_span!("merge further", views = views.len()), || {
            kept.merge(views, options)
        })
    }

    /// Starts, in a thread of its own, the part of the next merge that depends on the present views
    /// alone; without this call the same result comes later.
    pub fn go_ahead(&mut self, views: Vec<View>) {
        let kept = self.kept();
        if kept.base.is_none() && kept.digests.len() == views.len() {
            let mut kept = std::mem::take(kept);
            // Without a thread it is known less, and merged later.
            let ahead = thread::Builder::new().name("merge ahead".to_owned()).spawn(move || {
                pool::within(tracing::debug_span!("merge ahead", views = views.len()), || {
                    kept.go_ahead(&views)
                });
                kept
            });
            self.ahead = ahead.ok();
        }
    }

    /// Waits for the background work.
    pub fn wait(&mut self) {
        self.kept();
    }

    /// Kept state, after waiting for background work.
    fn kept(&mut self) -> &mut Kept {
        if let Some(ahead) = self.ahead.take() {
            self.kept = ahead.join().unwrap_or_else(|panic| std::panic::resume_unwind(panic));
        }
        &mut self.kept
    }
}

impl Kept {
    fn merge(&mut self, views: &[View], options: &MergeOptions) -> Result<Merged, MergeError> {
        options.check(views)?;
        if self.options.as_ref() != Some(options) {
            *self = Kept { options: Some(options.clone()), ..Kept::default() };
        }
        self.prepare(views, options);
        let earlier = &views[..views.len() - 1];
        let before = if earlier.len() < TOGETHER { None } else { self.base_of(earlier, options).ok() };
        // Of few views the one that was left out may be the one that fits in with the next.
        let before = before.filter(|base| views.len() > FEW || base.are_all_used());
        let are_all_used = before.as_ref().is_none_or(Base::are_all_used);
        let laid = before.and_then(|before| self.further(before, views, options));
        let is_laid = laid.is_some();
        let base = laid.map_or_else(|| self.anew(views, options), Ok)?;
        let mut merged = merged(&base.gathered, base.seen.clone(), base.fits.clone(), base.steps.clone());
        if is_laid {
            merged = self.onto_priors(merged, &base.aligned);
        }
        let stays = !is_laid || are_all_used && together(views.len()) < views.len();
        self.base = stays.then_some(base);
        Ok(merged)
    }

    fn go_ahead(&mut self, views: &[View]) {
        let options = self.options.clone().unwrap_or_default();
        let are_known = pool::map(views, 1, digest) == self.digests;
        if are_known {
            self.base = self.base_of(views, &options).ok();
        }
    }

    /// Prepares the views that are not prepared yet.
    fn prepare(&mut self, views: &[View], options: &MergeOptions) {
        let digests = pool::map(views, 1, digest);
        let kept = self.prepared.drain(..).zip(self.maps.drain(..));
        let mut kept: FxHashMap<u64, _> = self.digests.drain(..).zip(kept).collect();
        let kept: Vec<_> = digests.iter().map(|digest| kept.remove(digest)).collect();
        let mut kept: Vec<Option<(Prepared, Option<DepthMap>)>> = kept;
        pool::for_each(
            &mut kept,
            1,
            || (),
            |(), n, kept| {
                kept.get_or_insert_with(|| Ready::of_view(&views[n], options));
            },
        );
        (self.prepared, self.maps) = kept.into_iter().flatten().unzip();
        self.digests = digests;
    }

    /// Merged base for aligning the next view, from the kept state.
    fn base_of(&mut self, views: &[View], options: &MergeOptions) -> Result<Base, MergeError> {
        let anew = together(views.len());
        let is_begun = |base: &Base| {
            (anew..=views.len()).contains(&base.digests.len()) && self.digests.starts_with(&base.digests)
        };
        let kept = self.base.take().filter(is_begun);
        let begun = kept.as_ref().map_or(anew, |base| base.digests.len());
        let mut base = kept.map_or_else(|| self.anew(&views[..anew], options), Ok);
        for n in begun + 1..=views.len() {
            let before = base.ok().filter(Base::are_all_used);
            let further = before.and_then(|base| self.further(base, &views[..n], options));
            base = further.map_or_else(|| self.anew(&views[..n], options), Ok);
        }
        base
    }

    /// Merges all given views together.
    fn anew(&self, views: &[View], options: &MergeOptions) -> Result<Base, MergeError> {
        let (prepared, maps) = (&self.prepared[..views.len()], &self.maps[..views.len()]);
        let mut steps = filter_and_thin(views, prepared, options)?;
        let mut aligned = place(prepared, maps, options, &mut steps);
        let mut looked = (views.len() < MOVABLE).then(Vec::new);
        let seen = visibility(maps.to_vec(), &aligned.used, &aligned.poses);
        let gathered = gather(views, prepared, &aligned, &seen, options, looked.as_mut());
        let fits = fits(prepared, &mut aligned);
        let digests = self.digests[..views.len()].to_vec();
        Ok(Base { digests, aligned, seen, gathered, looked, fits, steps })
    }

    /// Adds the last view to the merge of the others, which stay fixed unless they are few; `None`
    /// if the last view does not fit.
    fn further(&self, mut base: Base, views: &[View], options: &MergeOptions) -> Option<Base> {
        let last = views.len() - 1;
        let (prepared, maps) = (&self.prepared[..=last], &self.maps[..=last]);
        if prepared[last].points.is_empty() {
            return None;
        }
        let lay = |first: &Round| base.aligned.lay_further(prepared, maps, first);
        let Laid { poses, found, parts } = lay(&FIRST).or_else(|| lay(&WIDE))?;
        let aligned = &mut base.aligned;
        let moved_m = if last < MOVABLE { aligned.moved_m(prepared, &poses) } else { 0.0 };
        // Where it lies if the others stay.
        let pose = aligned.poses[0] * poses[0].inv_mul(&poses[last]);
        aligned.take(pose, found[last], parts);
        base.digests.push(self.digests[last]);
        let seen = |Aligned { used, poses, .. }: &Aligned| visibility(maps.to_vec(), used, poses);
        let matched = found[last].matched;
        let result = if moved_m > MOVED_M {
            let Aligned { used, parts, .. } = &*aligned;
            aligned.planes = level_again(&parts.planes, parts.up, prepared, used, &parts.of, &poses);
            (aligned.poses, aligned.found) = (poses, found);
            base.seen = seen(aligned);
            base.gathered = gather(views, prepared, aligned, &base.seen, options, base.looked.as_mut());
            base.fits = fits(prepared, aligned);
            format!("view {last} is laid on the others, which it moves by {:.1} mm", 1e3 * moved_m)
        } else {
            let of_view = (&views[last], &prepared[last]);
            let planes = &aligned.planes;
            base.seen = seen(aligned);
            if !gather_further(&mut base.gathered, last, of_view, &pose, planes, &base.seen, options) {
                return None;
            }
            base.fits.push(fit(&prepared[last], &pose, &found[last], true, None));
            format!("view {last} is laid on the others, which stay")
        };
        base.steps.push(Step { name: "further look".to_owned(), points: matched, result });
        Some(base)
    }

    /// Result moved onto the mean of the localised poses of all used views.
    fn onto_priors(&self, merged: Merged, Aligned { used, poses, .. }: &Aligned) -> Merged {
        let mut merged = merged.moved(&joint::onto_priors(&self.prepared, used, poses));
        for (fit, Prepared { prior, .. }) in merged.fits.iter_mut().zip(&self.prepared) {
            if !fit.used {
                fit.world_from_camera = *prior;
            }
            let (turn, shift) = departure(&fit.world_from_camera, prior);
            (fit.moved_m, fit.moved_rad) = (shift.norm(), turn.norm());
        }
        merged
    }
}

/// Poses of the views after a further one is aligned, with the alignment's findings and the parts
/// of the new view's points.
struct Laid {
    poses: Vec<Isometry3<f64>>,
    found: Vec<Found>,
    parts: Vec<Part>,
}

impl Base {
    fn are_all_used(&self) -> bool {
        self.aligned.used.iter().all(|used| *used)
    }
}

/// Number of first views that are merged together: all if few, then 6, 9, 14, and so on by half as
/// many more.
fn together(views: usize) -> usize {
    let more = std::iter::successors(Some(FEW), |n| Some((3 * n).div_ceil(2)));
    more.take_while(|n| *n <= views).last().unwrap_or(views)
}

impl Aligned {
    /// Aligns the last view, with the given first alignment: alone if the others stay fixed, or all
    /// together if they are few. `None` on contradiction.
    fn lay_further(&self, prepared: &[Prepared], maps: &[Option<DepthMap>], first: &Round) -> Option<Laid> {
        let last = prepared.len() - 1;
        let view = &prepared[last];
        let mut poses: Vec<Isometry3<f64>> = self.poses.iter().copied().chain([view.prior]).collect();
        let used = beside(&self.used, &poses);
        // Where localisation has the others on the average errs as well.
        let others = self.used.iter().filter(|used| **used).count();
        let looser = (1.0 + 1.0 / others.max(1) as f64).sqrt();
        let loose: Vec<f64> = (0..=last).map(|i| if i == last { looser } else { 0.0 }).collect();
        let of_used = |(view, used): (&Prepared, &bool)| {
            vec![Part::Standing; if *used { view.points.len() } else { 0 }]
        };
        let all: Vec<Vec<Part>> = prepared.iter().zip(&used).map(of_used).collect();
        joint::align(prepared, &used, &loose, &all, &mut poses, first);
        let mut parts = self.parts.of.clone();
        parts.push(self.parts.of_view(view, &poses[last]));
        let all: Vec<bool> = self.used.iter().copied().chain([true]).collect();
        let settle = |mut poses: Vec<Isometry3<f64>>| {
            let (found, fits);
            if last < MOVABLE {
                found = joint::align(prepared, &all, &as_stated(prepared), &parts, &mut poses, &SECOND);
                fits = misfit(prepared, &all, &parts, &poses, maps, &found).is_none();
            } else {
                found = joint::align(prepared, &used, &loose, &parts, &mut poses, &SECOND);
                fits = belongs((last, looser, &all), prepared, &parts, &poses, maps, &found[last]);
            }
            fits.then_some((poses, found))
        };
        let others: Vec<usize> = (0..last).filter(|&i| used[i]).collect();
        let on = self.parts.up.map(|up| Objects { prepared, parts: &parts, up });
        let on = on.map(|objects| (objects.of_all(&others, &poses), objects));
        let placed = |least_share: f64| {
            let mut poses = poses.clone();
            if let Some((placed, objects)) = &on {
                let levelled = only_levelled(view, &poses[last], &objects.up);
                objects.place_on((last, looser, least_share), placed, &levelled, &mut poses[last]);
            }
            poses
        };
        let (poses, found) = [SURE_SHARE, PERHAPS_SHARE].into_iter().map(placed).find_map(settle)?;
        Some(Laid { poses, found, parts: parts.pop()? })
    }

    /// Root mean square displacement of a view's objects, relative to the first view, since the
    /// alignment without the last view, metres: maximum over the views.
    fn moved_m(&self, prepared: &[Prepared], poses: &[Isometry3<f64>]) -> f64 {
        let last = poses.len() - 1;
        let moved = |i: usize| poses[i] * self.poses[i].inverse();
        let of_view = |i: usize| {
            let among_others = moved(0).inv_mul(&moved(i));
            let points = objects(&prepared[i], &self.parts.of[i], &self.poses[i]);
            let sum: f64 = points.iter().map(|(p, _)| (among_others * p - p).norm_squared()).sum();
            (sum / points.len().max(1) as f64).sqrt()
        };
        (0..last).map(of_view).fold(0.0, f64::max)
    }

    fn take(&mut self, pose: Isometry3<f64>, found: Found, parts: Vec<Part>) {
        self.poses.push(pose);
        self.used.push(true);
        self.whys.push(None);
        self.found.push(found);
        self.parts.of.push(parts);
    }
}

/// Selects the last view and, of the used earlier ones, those with the nearest cameras.
fn beside(used: &[bool], poses: &[Isometry3<f64>]) -> Vec<bool> {
    let last = poses.len() - 1;
    let apart = |i: usize| {
        let turn = poses[i].rotation.angle_to(&poses[last].rotation);
        (poses[i].translation.vector - poses[last].translation.vector).norm() + turn
    };
    let mut others: Vec<usize> = (0..last).filter(|&i| used[i]).collect();
    others.sort_by(|&a, &b| apart(a).total_cmp(&apart(b)).then(a.cmp(&b)));
    let mut beside = vec![false; poses.len()];
    others.iter().take(joint::PARTNERS).chain([&last]).for_each(|&i| beside[i] = true);
    beside
}

/// A digest of all data of a view that merging uses.
fn digest(view: &View) -> u64 {
    let View { cloud, intrinsics, world_from_camera: pose, pose_sigma_m, pose_sigma_rad, stamp_ns } = view;
    let Cloud { points, grid, colours, normals, .. } = cloud;
    let camera = intrinsics.map(|c| [c.width as f64, c.height as f64, c.fx, c.fy, c.cx, c.cy]);
    let numbers = pose.translation.vector.iter().chain(pose.rotation.coords.iter());
    let numbers = numbers.chain([pose_sigma_m, pose_sigma_rad]).chain(camera.iter().flatten());
    let has = [normals.is_some(), colours.is_some()].map(u64::from);
    let counts = [*stamp_ns as u64, grid.map_or(0, |grid| grid.width as u64), points.len() as u64];
    let words: Vec<u64> = numbers.map(|number| number.to_bits()).chain(counts).chain(has).collect();
    let parts: [&[u8]; 4] = [
        bytemuck::cast_slice(&words),
        bytemuck::cast_slice(points),
        bytemuck::cast_slice(normals.as_deref().unwrap_or_default()),
        bytemuck::cast_slice(colours.as_deref().unwrap_or_default()),
    ];
    parts.into_iter().fold(0, |digest, bytes| mixed(digest, digest_of(bytes)))
}

/// 64-bit hash of bytes, in four independent lanes for speed.
fn digest_of(bytes: &[u8]) -> u64 {
    /// Number of words hashed side by side. From: work.
    const LANES: usize = 4;
    let (words, last) = bytes.as_chunks::<8>();
    let (rows, rest) = words.as_chunks::<LANES>();
    let quarter = rows.len() / 4;
    let mut lanes = [[0_u64; LANES]; 4];
    let mut mix = |part: usize, row: &[[u8; 8]]| {
        let lanes = lanes[part].iter_mut().zip(row);
        lanes.for_each(|(lane, word)| *lane = mixed(*lane, u64::from_ne_bytes(*word)));
    };
    let parts: [&[_]; 4] = std::array::from_fn(|part| &rows[part * quarter..(part + 1) * quarter]);
    for at in 0..quarter {
        parts.iter().enumerate().for_each(|(part, rows)| mix(part, &rows[at]));
    }
    rows[4 * quarter..].iter().for_each(|row| mix(0, row));
    let mut end = [0; 8];
    end[..last.len()].copy_from_slice(last);
    mix(1, rest);
    mix(2, &[end]);
    lanes.into_iter().flatten().fold(0, mixed)
}

#[inline(always)]
fn mixed(digest: u64, word: u64) -> u64 {
    // Turned, so that the highest bits count as much as all others.
    (digest.rotate_left(26) ^ word).wrapping_mul(0x9E37_79B9_7F4A_7C15)
}
