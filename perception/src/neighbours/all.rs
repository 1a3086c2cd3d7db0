//! The k nearest neighbours of every point at once, leaf by leaf.

use super::nearby::Nearby;
use super::{Bounds, LEAF, Neighbours, Span};
use crate::pool;

/// Reusable buffers of a tree traversal.
#[derive(Default)]
struct Scratch {
    open: Vec<Span>,
    leaves: Vec<NearLeaf>,
    nearby: Nearby,
}

/// Leaf that may contain neighbours of the current leaf's points.
#[derive(Clone, Copy)]
struct NearLeaf {
    /// Squared distance from the box of the current leaf, square metres.
    distance_sq: f32,
    leaf: u32,
    bounds: Bounds,
}

/// Number of candidates beyond `k` that are gathered before the bound is tightened.
const SLACK: usize = 64;

impl Neighbours {
    /// Computes `result` for every finite point, from its slot and its `k` nearest points (itself included, unordered).
    /// Results are in point order, with `default` for points that are not finite.
    pub(crate) fn map_all<T: Copy + Send + Sync>(
        &self,
        k: usize,
        default: T,
        result: impl Fn(usize, &Nearby) -> T + Sync,
    ) -> Vec<T> {
        let _span = tracing::debug_span!("all neighbours", points = self.len, k).entered();
        let mut out = vec![default; self.given];
        let k = k.min(self.len);
        if k == 0 {
            return out;
        }
        let mut by_slot = vec![default; self.index.len()];
        let mut leaves: Vec<&mut [T]> = by_slot.chunks_mut(LEAF).collect();
        pool::for_each(&mut leaves, 1, Scratch::default, |scratch, leaf, answers| {
            self.leaf_neighbours(leaf, k, scratch, |slot_in_leaf, nearby| {
                answers[slot_in_leaf] = result(leaf * LEAF + slot_in_leaf, nearby);
            });
        });
        for (&index, &answer) in self.index.iter().zip(&by_slot).take(self.len) {
            out[index as usize] = answer;
        }
        out
    }

    /// Coordinates of the point in a slot.
    #[inline(always)]
    pub(crate) fn at(&self, slot: usize) -> [f32; 3] {
        [self.x[slot], self.y[slot], self.z[slot]]
    }

    fn leaf_neighbours(
        &self,
        leaf: usize,
        k: usize,
        scratch: &mut Scratch,
        mut give: impl FnMut(usize, &Nearby),
    ) {
        let Scratch { open, leaves, nearby } = scratch;
        let queries = (self.len - leaf * LEAF).min(LEAF);
        let (seed, own) = self.seed(leaf, k);
        let mut bounds = [0.0; LEAF];
        for (i, bound) in bounds.iter_mut().enumerate().take(queries) {
            *bound = self.bound_from(&self.at(leaf * LEAF + i), seed, k, nearby);
        }
        let reach = bounds.iter().copied().fold(0.0, f32::max);
        self.leaves_near(&own, reach, seed, open, leaves);
        for (i, &bound) in bounds.iter().enumerate().take(queries) {
            let q = self.at(leaf * LEAF + i);
            let mut bound = bound;
            nearby.clear();
            for near in leaves.iter() {
                if near.distance_sq > bound {
                    break;
                }
                if near.bounds.distance_sq(&q) > bound {
                    continue;
                }
                nearby.add(&self.leaf_distances(near.leaf as usize, &q), near.leaf as usize * LEAF, bound);
                if nearby.len() > k + SLACK {
                    bound = nearby.keep(k, bound);
                }
            }
            nearby.keep(k, bound);
            give(i, nearby);
        }
    }

    /// Smallest node around `leaf` with at least `k` points, and the bounds of the leaf.
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

    /// Squared distance of the k-th nearest point of the seed, an upper bound for the k-th nearest of all.
    fn bound_from(&self, q: &[f32; 3], seed: Span, k: usize, nearby: &mut Nearby) -> f32 {
        nearby.clear();
        let mut bound = f32::MAX;
        for leaf in seed.from..seed.to {
            nearby.add(&self.leaf_distances(leaf, q), leaf * LEAF, bound);
            if nearby.len() > k + SLACK {
                bound = nearby.keep(k, bound);
            }
        }
        nearby.keep(k, bound)
    }

    /// Collects into `leaves` those of the seed, and those whose boxes are nearer to `own` than the square root of
    /// `reach`, nearest first. Boxes at equal distance contain only ties, which coinciding points would produce by the
    /// million.
    fn leaves_near(
        &self,
        own: &Bounds,
        reach: f32,
        seed: Span,
        open: &mut Vec<Span>,
        leaves: &mut Vec<NearLeaf>,
    ) {
        leaves.clear();
        open.clear();
        open.push(self.root());
        while let Some(span) = open.pop() {
            let bounds = self.nodes[span.node];
            let distance_sq = bounds.distance_sq_to(own);
            let touches_seed = span.from < seed.to && seed.from < span.to;
            if distance_sq >= reach && !touches_seed {
                continue;
            }
            if span.is_leaf() {
                leaves.push(NearLeaf { distance_sq, leaf: span.from as u32, bounds });
            } else {
                let (left, right) = span.children();
                open.extend([right, left]);
            }
        }
        leaves.sort_unstable_by(|a, b| a.distance_sq.total_cmp(&b.distance_sq).then(a.leaf.cmp(&b.leaf)));
    }
}
