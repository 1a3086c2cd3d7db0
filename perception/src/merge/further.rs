//! A further look at the same place: what was found of the earlier ones is kept.
//!
//! What is known of a view by itself is kept as long as the view is the same. Where the earlier views lie and what was gathered of them is
//! kept while it is a further view that comes: it alone is aligned, to the views beside it, and gathered. Errors of one look by one do not add
//! up: whenever there are half as many views more, and whenever a view does not fit in, all are merged anew.

use super::check::belongs;
use super::fuse::{gather, gather_further};
use super::joint::Found;
use super::parts::Part;
use super::prepare::Prepared;
use super::{
    Aligned, FIRST, Gathered, MergeError, MergeOptions, Merged, Ready, SECOND, Step, ViewFit, check, fits,
    joint, merged, objects, only_levelled, place, place_on, visibility,
};
use crate::cloud::Cloud;
use crate::view::View;
use crate::visibility::DepthMap;
use nalgebra::Isometry3;
use rayon::prelude::*;
use rustc_hash::FxHashMap;
use std::fmt;

/// Up to so many views all are merged anew with each.
const FEW: usize = 4;
/// So many views beside a further one hold it where it belongs.
const BESIDE: usize = 5;

/// Merges the views of one place again and again, as they become more.
#[derive(Default)]
pub struct Merger {
    options: Option<MergeOptions>,
    digests: Vec<u64>,
    prepared: Vec<Prepared>,
    maps: Vec<Option<DepthMap>>,
    base: Option<Base>,
}

/// What was merged last.
struct Base {
    digests: Vec<u64>,
    /// Views when all were merged anew.
    anew: usize,
    aligned: Aligned,
    gathered: Vec<Gathered>,
    fits: Vec<ViewFit>,
    steps: Vec<Step>,
}

impl fmt::Debug for Merger {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Merger").field("views", &self.digests.len()).finish_non_exhaustive()
    }
}

impl Merger {
    /// As [`merge`](super::merge), quicker if all views but the last were merged last time. Then the earlier views stay where they were found.
    ///
    /// # Errors
    /// As [`merge`](super::merge).
    pub fn merge(&mut self, views: &[View], options: &MergeOptions) -> Result<Merged, MergeError> {
        let _span = tracing::debug_span!("merge further", views = views.len()).entered();
        check(views, options)?;
        if self.options.as_ref() != Some(options) {
            *self = Merger { options: Some(options.clone()), ..Merger::default() };
        }
        self.prepare(views, options);
        match self.further(views, options) {
            Some(merged) => Ok(merged),
            None => self.anew(views, options),
        }
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

    /// All views together.
    fn anew(&mut self, views: &[View], options: &MergeOptions) -> Result<Merged, MergeError> {
        self.base = None;
        let mut steps = super::filter_and_thin(views, &self.prepared, options)?;
        let mut aligned = place(&self.prepared, &self.maps, options, &mut steps);
        let gathered = gather(views, &self.prepared, &aligned.used, &aligned.poses, &aligned.planes, options);
        let fits = fits(&self.prepared, &mut aligned);
        let seen = visibility(self.maps.clone(), &aligned.used, &aligned.poses);
        let merged = merged(&gathered, seen, fits.clone(), steps.clone());
        let (digests, anew) = (self.digests.clone(), views.len());
        self.base = Some(Base { digests, anew, aligned, gathered, fits, steps });
        Ok(merged)
    }

    /// The last view with the others as they lie; `None` if it is no further view of these or does not fit in.
    fn further(&mut self, views: &[View], options: &MergeOptions) -> Option<Merged> {
        let last = views.len() - 1;
        let base = self.base.as_mut()?;
        let is_further = base.digests == self.digests[..last] && base.aligned.used.iter().all(|used| *used);
        if !is_further
            || views.len() <= FEW
            || 2 * views.len() >= 3 * base.anew
            || self.prepared[last].points.is_empty()
        {
            return None;
        }
        let (pose, found, parts) = base.aligned.lay_further(&self.prepared, &self.maps)?;
        let of_view = (&views[last], &self.prepared[last]);
        if !gather_further(&mut base.gathered, last, of_view, &pose, &base.aligned.planes, options) {
            return None;
        }
        base.aligned.take(pose, found, parts);
        base.digests.push(self.digests[last]);
        base.fits.push(super::fit(&self.prepared[last], &pose, &found, true, None));
        let seen = visibility(self.maps.clone(), &base.aligned.used, &base.aligned.poses);
        let mut steps = base.steps.clone();
        let result = format!("{} views stay where they lay, one is laid on them", last);
        steps.push(Step { name: "further look".to_owned(), points: found.matched, result });
        Some(merged(&base.gathered, seen, base.fits.clone(), steps))
    }
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
    others.iter().take(BESIDE).chain([&last]).for_each(|&i| beside[i] = true);
    beside
}

/// All that merging takes of a view, in one number.
fn digest(view: &View) -> u64 {
    let mut digest = Digest([0; LANES]);
    let pose = &view.world_from_camera;
    let camera = view.intrinsics.map(|c| [c.width as f64, c.height as f64, c.fx, c.fy, c.cx, c.cy]);
    let numbers = pose.translation.vector.iter().chain(pose.rotation.coords.iter());
    let numbers = numbers.chain([&view.pose_sigma_m, &view.pose_sigma_rad]).chain(camera.iter().flatten());
    numbers.for_each(|number| digest.take([number.to_bits(); LANES]));
    let Cloud { points, grid, colours, normals, .. } = &view.cloud;
    digest.take([view.stamp_ns as u64, grid.map_or(0, |grid| grid.width as u64), points.len() as u64]);
    let (pairs, last) = points.as_chunks::<2>();
    for [p, q] in pairs {
        digest.take([0, 1, 2].map(|k| u64::from(p[k].to_bits()) << 32 | u64::from(q[k].to_bits())));
    }
    last.iter().for_each(|p| digest.take([p.x, p.y, p.z].map(|c| u64::from(c.to_bits()))));
    normals.iter().flatten().for_each(|n| digest.take([n.x, n.y, n.z].map(|c| u64::from(c.to_bits()))));
    colours.iter().flatten().for_each(|colour| digest.take(colour.map(u64::from)));
    let [one, other, third] = digest.0;
    one ^ other.rotate_left(21) ^ third.rotate_left(42)
}

/// Numbers that words are mixed into, side by side: none waits for another.
struct Digest([u64; LANES]);

const LANES: usize = 3;

impl Digest {
    #[inline(always)]
    fn take(&mut self, words: [u64; LANES]) {
        for (lane, word) in self.0.iter_mut().zip(words) {
            // Turned, so that the highest bits count as much as all others.
            *lane = (lane.rotate_left(26) ^ word).wrapping_mul(0x9E37_79B9_7F4A_7C15);
        }
    }
}
