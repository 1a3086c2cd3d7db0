//! The k nearest neighbours of every point at once, leaf by leaf.

use super::{Bounds, LEAF, Neighbours, Span};
use rayon::prelude::*;

/// A neighbour found in bulk: squared distance in the upper half, slot in the tree in the lower, so that order is by distance and ties are settled.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) struct Found(u64);

impl Found {
    #[inline(always)]
    fn new(distance_sq: f32, slot: usize) -> Found {
        Found(u64::from(distance_sq.to_bits()) << 32 | slot as u64)
    }

    #[inline(always)]
    pub(crate) fn slot(self) -> usize {
        (self.0 & u64::from(u32::MAX)) as usize
    }

    #[inline(always)]
    pub(crate) fn distance_sq(self) -> f32 {
        f32::from_bits((self.0 >> 32) as u32)
    }
}

/// What one walk needs; kept between leaves.
#[derive(Default)]
struct Scratch {
    open: Vec<Span>,
    near: Vec<(f32, u32)>,
    found: Vec<Found>,
}

impl Neighbours {
    /// For every finite point, `result` of its slot and its `k` nearest points (itself among them, in no particular order).
    /// The answers stand at the indices of the points; where a point is not finite, `default` stands.
    pub(crate) fn map_all<T: Copy + Send + Sync>(
        &self,
        k: usize,
        default: T,
        result: impl Fn(usize, &[Found]) -> T + Sync,
    ) -> Vec<T> {
        let _span = tracing::debug_span!("all neighbours", points = self.len, k).entered();
        let mut out = vec![default; self.given];
        let k = k.min(self.len);
        if k == 0 {
            return out;
        }
        let mut by_slot = vec![default; self.index.len()];
        by_slot.par_chunks_mut(LEAF).enumerate().for_each_init(
            Scratch::default,
            |scratch, (leaf, answers)| {
                self.leaf_neighbours(leaf, k, scratch, |slot_in_leaf, found| {
                    answers[slot_in_leaf] = result(leaf * LEAF + slot_in_leaf, found);
                });
            },
        );
        for (&index, &answer) in self.index.iter().zip(&by_slot).take(self.len) {
            out[index as usize] = answer;
        }
        out
    }

    /// Coordinates of a slot.
    #[inline(always)]
    pub(crate) fn at(&self, slot: usize) -> [f32; 3] {
        [self.x[slot], self.y[slot], self.z[slot]]
    }

    fn leaf_neighbours(
        &self,
        leaf: usize,
        k: usize,
        scratch: &mut Scratch,
        mut give: impl FnMut(usize, &[Found]),
    ) {
        let Scratch { open, near, found } = scratch;
        let queries = (self.len - leaf * LEAF).min(LEAF);
        let (seed, own) = self.seed(leaf, k);
        let reach = (0..queries)
            .map(|i| self.bound_from(&self.at(leaf * LEAF + i), seed, k, found))
            .fold(0.0, f32::max);
        self.leaves_near(&own, reach, seed, open, near);
        for i in 0..queries {
            let q = self.at(leaf * LEAF + i);
            found.clear();
            let mut bound = f32::INFINITY;
            for &(box_distance_sq, other) in near.iter() {
                if box_distance_sq >= bound {
                    break;
                }
                let other = other as usize;
                self.add_near(other, &q, bound, found);
                if found.len() > 2 * k {
                    bound = keep_nearest(found, k);
                }
            }
            if found.len() > k {
                keep_nearest(found, k);
            }
            give(i, found);
        }
    }

    /// Adds the points of a leaf that are no farther than `bound`.
    #[inline(always)]
    fn add_near(&self, leaf: usize, q: &[f32; 3], bound: f32, found: &mut Vec<Found>) {
        let distances = self.leaf_distances(leaf, q);
        let before = found.len();
        found.resize(before + LEAF, Found(0));
        let mut kept = before;
        for (i, &d) in distances.iter().enumerate() {
            found[kept] = Found::new(d, leaf * LEAF + i);
            kept += usize::from(d <= bound && d < f32::INFINITY);
        }
        found.truncate(kept);
    }

    /// The smallest node around `leaf` that holds `k` points, and the bounds of the leaf itself.
    fn seed(&self, leaf: usize, k: usize) -> (Span, Bounds) {
        let mut span = self.root();
        let mut seed = span;
        while !span.is_leaf() {
            let (left, right) = span.children();
            span = if leaf < left.to { left } else { right };
            let holds = (span.to * LEAF).min(self.len) - span.from * LEAF;
            if holds >= k {
                seed = span;
            }
        }
        (seed, self.nodes[span.node])
    }

    /// Squared distance of the k-th nearest point of the seed: no more than so far are the k nearest of all.
    fn bound_from(&self, q: &[f32; 3], seed: Span, k: usize, found: &mut Vec<Found>) -> f32 {
        found.clear();
        let mut bound = f32::INFINITY;
        for leaf in seed.from..seed.to {
            self.add_near(leaf, q, bound, found);
            if found.len() > 2 * k {
                bound = keep_nearest(found, k);
            }
        }
        if found.len() >= k { keep_nearest(found, k) } else { f32::INFINITY }
    }

    /// The leaves of the seed and those whose boxes come nearer to `own` than the square root of `reach`, nearest first.
    /// Boxes just as far can only hold equals of what the seed has; coinciding points by the million would all be such.
    fn leaves_near(
        &self,
        own: &Bounds,
        reach: f32,
        seed: Span,
        open: &mut Vec<Span>,
        near: &mut Vec<(f32, u32)>,
    ) {
        near.clear();
        open.clear();
        open.push(self.root());
        while let Some(span) = open.pop() {
            let distance_sq = self.nodes[span.node].distance_sq_to(own);
            let touches_seed = span.from < seed.to && seed.from < span.to;
            if distance_sq >= reach && !touches_seed {
                continue;
            }
            if span.is_leaf() {
                near.push((distance_sq, span.from as u32));
            } else {
                let (left, right) = span.children();
                open.extend([right, left]);
            }
        }
        near.sort_unstable_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
    }
}

/// Keeps the `k` nearest and tells the squared distance of the farthest of them. There must be at least `k`.
#[inline(always)]
fn keep_nearest(found: &mut Vec<Found>, k: usize) -> f32 {
    if found.len() > k {
        found.select_nth_unstable(k - 1);
        found.truncate(k);
        return found[k - 1].distance_sq();
    }
    found.iter().map(|f| f.distance_sq()).fold(0.0, f32::max)
}
