//! A further look at the same place: what was found of the earlier ones is kept.
//!
//! What is known of a view by itself is kept as long as the view is the same. Where the earlier views lie, what was gathered of them and what
//! that was settled to is kept while it is a further view that comes: it alone is aligned, to the views beside it, and gathered, and what it
//! touches is settled. Errors of one look by one do not add up: whenever there are half as many views more, and whenever a view does not fit
//! in, all are merged anew. Which views are merged together follows from the views alone, not from what was merged before: the same views
//! give the same bytes, whatever was kept.

use super::check::belongs;
use super::fuse::{gather, gather_further};
use super::joint::Found;
use super::parts::Part;
use super::prepare::Prepared;
use super::settle::settle;
use super::{
    Aligned, FIRST, Gathered, MergeError, MergeOptions, Merged, Ready, SECOND, Step, ViewFit, check,
    filter_and_thin, fit, fits, joint, merged, objects, only_levelled, place, place_on, visibility,
};
use crate::cloud::Cloud;
use crate::pool;
use crate::view::View;
use crate::visibility::DepthMap;
use nalgebra::Isometry3;
use rayon::prelude::*;
use rustc_hash::FxHashMap;
use std::fmt;

/// Up to so many views all are merged together. From: chosen.
const FEW: usize = 6;

/// Merges the views of one place again and again, as they become more.
#[derive(Default)]
pub struct Merger {
    options: Option<MergeOptions>,
    digests: Vec<u64>,
    prepared: Vec<Prepared>,
    maps: Vec<Option<DepthMap>>,
    base: Option<Base>,
}

/// The views that were merged last.
struct Base {
    digests: Vec<u64>,
    aligned: Aligned,
    gathered: Vec<Gathered>,
    fits: Vec<ViewFit>,
    steps: Vec<Step>,
    /// How many views were settled.
    settled: usize,
}

impl fmt::Debug for Merger {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Merger").field("views", &self.digests.len()).finish_non_exhaustive()
    }
}

impl Merger {
    /// As [`merge`](super::merge), quicker if all views but the last were merged last time. Up to six views are merged as there; of more,
    /// the later are laid on the earlier.
    ///
    /// # Errors
    /// As [`merge`](super::merge).
    pub fn merge(&mut self, views: &[View], options: &MergeOptions) -> Result<Merged, MergeError> {
        pool::within(tracing::debug_span!("merge further", views = views.len()), || {
            check(views, options)?;
            if self.options.as_ref() != Some(options) {
                *self = Merger { options: Some(options.clone()), ..Merger::default() };
            }
            self.prepare(views, options);
            let anew = together(views.len());
            let is_begun =
                |base: &Base| base.digests.len() >= anew && self.digests.starts_with(&base.digests);
            let kept = self.base.take().filter(is_begun);
            let begun = kept.as_ref().map_or(anew, |base| base.digests.len());
            let mut base = kept.map_or_else(|| self.anew(&views[..anew], options), Ok);
            for n in begun + 1..=views.len() {
                let settled = base.ok().map(|base| self.settled(base));
                let further = settled.and_then(|base| self.further(base, &views[..n], options));
                base = further.map_or_else(|| self.anew(&views[..n], options), Ok);
            }
            let mut base = base?;
            let seen = visibility(self.maps.clone(), &base.aligned.used, &base.aligned.poses);
            let merged = merged(&mut base.gathered, seen, base.fits.clone(), base.steps.clone());
            base.settled = views.len();
            // If with one more all are merged anew, nothing of this is wanted.
            self.base = (together(views.len() + 1) <= views.len()).then_some(base);
            Ok(merged)
        })
    }

    /// What is known of each view by itself: of those that were here before it is kept.
    fn prepare(&mut self, views: &[View], options: &MergeOptions) {
        let digests: Vec<u64> = views.par_iter().map(digest).collect();
        let kept = self.prepared.drain(..).zip(self.maps.drain(..));
        let mut kept: FxHashMap<u64, _> = self.digests.drain(..).zip(kept).collect();
        let kept: Vec<_> = digests.iter().map(|digest| kept.remove(digest)).collect();
        let ready = |(view, kept): (&View, Option<(Prepared, Option<DepthMap>)>)| {
            kept.unwrap_or_else(|| Ready::of_view(view, options))
        };
        (self.prepared, self.maps) = views.par_iter().zip(kept).map(ready).unzip();
        self.digests = digests;
    }

    /// The first views, together.
    fn anew(&self, views: &[View], options: &MergeOptions) -> Result<Base, MergeError> {
        let (prepared, maps) = (&self.prepared[..views.len()], &self.maps[..views.len()]);
        let mut steps = filter_and_thin(views, prepared, options)?;
        let mut aligned = place(prepared, maps, options, &mut steps);
        let gathered = gather(views, prepared, &aligned.used, &aligned.poses, &aligned.planes, options);
        let fits = fits(prepared, &mut aligned);
        Ok(Base { digests: self.digests[..views.len()].to_vec(), aligned, gathered, fits, steps, settled: 0 })
    }

    /// What the further look touches is settled on what the earlier ones were settled to, whether they were merged by themselves or not.
    fn settled(&self, mut base: Base) -> Base {
        let views = base.digests.len();
        if base.settled < views {
            let seen = visibility(self.maps[..views].to_vec(), &base.aligned.used, &base.aligned.poses);
            settle(&mut base.gathered, &seen);
            base.settled = views;
        }
        base
    }

    /// The last of the first views with the others as they lie; `None` if it does not fit in, or another did not.
    fn further(&self, mut base: Base, views: &[View], options: &MergeOptions) -> Option<Base> {
        let last = views.len() - 1;
        let (prepared, maps) = (&self.prepared[..=last], &self.maps[..=last]);
        if prepared[last].points.is_empty() || !base.aligned.used.iter().all(|used| *used) {
            return None;
        }
        let (pose, found, parts) = base.aligned.lay_further(prepared, maps)?;
        let of_view = (&views[last], &prepared[last]);
        if !gather_further(&mut base.gathered, last, of_view, &pose, &base.aligned.planes, options) {
            return None;
        }
        base.aligned.take(pose, found, parts);
        base.digests.push(self.digests[last]);
        base.fits.push(fit(&prepared[last], &pose, &found, true, None));
        let result = format!("view {last} is laid on the others, which stay");
        base.steps.push(Step { name: "further look".to_owned(), points: found.matched, result });
        Some(base)
    }
}

/// How many of the first views of so many are merged together: few, or with half as many more each time.
fn together(views: usize) -> usize {
    let more = std::iter::successors(Some(FEW), |n| Some((3 * n).div_ceil(2)));
    more.take_while(|n| *n <= views).last().unwrap_or(views)
}

impl Aligned {
    /// Where the last of the views belongs if the others stay; `None` if that contradicts them. With what the alignment found of it and what its
    /// points belong to.
    fn lay_further(
        &self,
        prepared: &[Prepared],
        maps: &[Option<DepthMap>],
    ) -> Option<(Isometry3<f64>, Found, Vec<Part>)> {
        let last = prepared.len() - 1;
        let view = &prepared[last];
        let mut poses: Vec<Isometry3<f64>> = self.poses.iter().copied().chain([view.prior]).collect();
        let used = beside(&poses);
        let moves: Vec<bool> = (0..=last).map(|i| i == last).collect();
        let of_used = |(view, used): (&Prepared, &bool)| {
            vec![Part::Standing; if *used { view.points.len() } else { 0 }]
        };
        let all: Vec<Vec<Part>> = prepared.iter().zip(&used).map(of_used).collect();
        joint::align(prepared, &used, &moves, &all, &mut poses, &FIRST);
        let mut parts = self.parts.of.clone();
        parts.push(self.parts.of_view(view, &poses[last]));
        if let Some(up) = self.parts.up {
            let mut levelled = poses.clone();
            levelled[last] = only_levelled(view, &poses[last], &up);
            let others = (0..last).filter(|&i| used[i]);
            let placed: Vec<_> = others.flat_map(|i| objects(&prepared[i], &parts[i], &poses[i])).collect();
            place_on(prepared, &parts, &up, &placed, &levelled, &mut poses, last);
        }
        let found = *joint::align(prepared, &used, &moves, &parts, &mut poses, &SECOND).last()?;
        let fits = belongs(last, prepared, &parts, &poses, maps, &found);
        fits.then_some((poses[last], found, parts.pop()?))
    }

    fn take(&mut self, pose: Isometry3<f64>, found: Found, parts: Vec<Part>) {
        self.poses.push(pose);
        self.used.push(true);
        self.whys.push(None);
        self.found.push(found);
        self.parts.of.push(parts);
    }
}

/// The last view and those whose cameras are nearest to its.
fn beside(poses: &[Isometry3<f64>]) -> Vec<bool> {
    let last = poses.len() - 1;
    let apart = |i: usize| {
        let turn = poses[i].rotation.angle_to(&poses[last].rotation);
        (poses[i].translation.vector - poses[last].translation.vector).norm() + turn
    };
    let mut others: Vec<usize> = (0..last).collect();
    others.sort_by(|&a, &b| apart(a).total_cmp(&apart(b)).then(a.cmp(&b)));
    let mut beside = vec![false; poses.len()];
    others.iter().take(joint::PARTNERS).chain([&last]).for_each(|&i| beside[i] = true);
    beside
}

/// All that merging takes of a view, in one number.
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

/// Bytes in one number. Four parts of them are read side by side, and their words mixed in lanes: no memory and no product is waited for.
fn digest_of(bytes: &[u8]) -> u64 {
    /// Words that are mixed in side by side. From: work.
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
