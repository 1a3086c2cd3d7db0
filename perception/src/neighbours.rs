//! Nearest neighbours: a balanced tree of tight boxes over leaves of 32 points, with one array per coordinate.
//!
//! The tree has no pointers: the node that covers leaves `a..b` has its left child next to it and its right child
//! `2·(mid − a)` places on. Neighbours of all points are found leaf by leaf, so that 32 queries share one traversal.

mod all;
mod nearby;

use crate::cloud::{CloudError, is_finite};
use crate::pool;
use nalgebra::Point3;

pub(crate) use nearby::{Nearby, least};

/// Number of points per leaf; the last leaf is padded with infinite coordinates, which are near nothing.
pub(crate) const LEAF: usize = 32;

/// Neighbour of a query point.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Neighbour {
    /// Index in the points that the tree was built from.
    pub index: u32,
    /// Squared distance from the query point, square metres.
    pub distance_sq: f32,
}

/// Axis-aligned box.
#[derive(Clone, Copy, Debug)]
struct Bounds {
    low: [f32; 3],
    high: [f32; 3],
}

impl Bounds {
    const EMPTY: Bounds = Bounds { low: [f32::INFINITY; 3], high: [f32::NEG_INFINITY; 3] };

    fn around(items: &[Item]) -> Bounds {
        items.iter().fold(Bounds::EMPTY, |mut b, item| {
            for k in 0..3 {
                b.low[k] = lesser(item.at[k], b.low[k]);
                b.high[k] = greater(item.at[k], b.high[k]);
            }
            b
        })
    }

    #[inline(always)]
    fn distance_sq(&self, q: &[f32; 3]) -> f32 {
        let beyond = |k: usize| greater(greater(self.low[k] - q[k], q[k] - self.high[k]), 0.0);
        let (x, y, z) = (beyond(0), beyond(1), beyond(2));
        x * x + y * y + z * z
    }

    fn distance_sq_to(&self, other: &Bounds) -> f32 {
        let mut sum = 0.0;
        for k in 0..3 {
            let d = greater(greater(self.low[k] - other.high[k], other.low[k] - self.high[k]), 0.0);
            sum += d * d;
        }
        sum
    }

    fn widest_axis(&self) -> usize {
        let width = |k: usize| self.high[k] - self.low[k];
        (1..3).fold(0, |best, k| if width(k) > width(best) { k } else { best })
    }
}

/// Minimum of numbers that are not NaN: a single instruction, unlike [`f32::min`].
#[inline(always)]
fn lesser(a: f32, b: f32) -> f32 {
    if a < b { a } else { b }
}

/// Maximum of numbers that are not NaN: a single instruction, unlike [`f32::max`].
#[inline(always)]
fn greater(a: f32, b: f32) -> f32 {
    if a > b { a } else { b }
}

#[derive(Clone, Copy)]
struct Item {
    at: [f32; 3],
    index: u32,
}

/// Search tree over the finite points of a cloud.
pub struct Neighbours {
    /// x of the point in each slot; each leaf has `LEAF` slots.
    x: Vec<f32>,
    /// y of the point in each slot.
    y: Vec<f32>,
    /// z of the point in each slot.
    z: Vec<f32>,
    /// Index of the point in each slot; `u32::MAX` in padding.
    index: Vec<u32>,
    nodes: Vec<Bounds>,
    len: usize,
    /// Number of points that the tree was built from, including missing returns.
    given: usize,
}

/// Node of the tree with its range of leaves.
#[derive(Clone, Copy)]
struct Span {
    node: usize,
    from: usize,
    to: usize,
}

impl Span {
    fn children(self) -> (Span, Span) {
        let mid = self.from + (self.to - self.from) / 2;
        let left = Span { node: self.node + 1, from: self.from, to: mid };
        let right = Span { node: self.node + 2 * (mid - self.from), from: mid, to: self.to };
        (left, right)
    }

    fn is_leaf(self) -> bool {
        self.to - self.from == 1
    }
}

impl Neighbours {
    /// Builds the tree over the finite points; coinciding points are all kept.
    ///
    /// # Errors
    /// If there are more points than 32-bit indices can name.
    pub fn new(points: &[Point3<f32>]) -> Result<Neighbours, CloudError> {
        if points.len() >= u32::MAX as usize {
            return Err(CloudError::TooMany { points: points.len() });
        }
        let _span = tracing::debug_span!("neighbour tree", points = points.len()).entered();
        let mut items: Vec<Item> = (0u32..)
            .zip(points)
            .filter(|(_, p)| is_finite(p))
            .map(|(index, p)| Item { at: [p.x, p.y, p.z], index })
            .collect();
        let len = items.len();
        let leaves = len.div_ceil(LEAF);
        let mut nodes = vec![Bounds::EMPTY; (2 * leaves).saturating_sub(1)];
        if leaves > 0 {
            build(&mut items, &mut nodes, leaves);
        }
        let padded = |value: &dyn Fn(&Item) -> f32| {
            let mut column: Vec<f32> = items.iter().map(value).collect();
            column.resize(leaves * LEAF, f32::INFINITY);
            column
        };
        let (x, y, z) = (padded(&|i| i.at[0]), padded(&|i| i.at[1]), padded(&|i| i.at[2]));
        let mut index: Vec<u32> = items.iter().map(|i| i.index).collect();
        index.resize(leaves * LEAF, u32::MAX);
        Ok(Neighbours { x, y, z, index, nodes, len, given: points.len() })
    }

    /// Number of finite points.
    pub fn len(&self) -> usize {
        self.len
    }

    /// True if there are no finite points.
    pub fn is_empty(&self) -> bool {
        self.len == 0
    }

    /// Number of points that the tree was built from, including missing returns.
    pub fn given(&self) -> usize {
        self.given
    }

    /// Nearest point within `within_m`, the first in tree order among ties; `None` if there is none or the query is not
    /// finite.
    pub fn nearest(&self, query: &Point3<f32>, within_m: f32) -> Option<Neighbour> {
        let mut best = Neighbour { index: u32::MAX, distance_sq: next_up(within_m * within_m) };
        if !self.is_empty() && is_finite(query) {
            self.visit_nearest(&[query.x, query.y, query.z], self.root(), &mut best);
        }
        (best.index != u32::MAX).then_some(best)
    }

    /// The `k` nearest points, nearest first; all if there are fewer, none if the query is not finite.
    pub fn k_nearest(&self, query: &Point3<f32>, k: usize) -> Vec<Neighbour> {
        let mut found = Vec::with_capacity(k.min(self.len) + 1);
        if k > 0 && !self.is_empty() && is_finite(query) {
            self.visit_k(&[query.x, query.y, query.z], self.root(), k, &mut found);
        }
        found
    }

    /// Calls `found` with every point within `radius_m`, in tree order; with none if the query is not finite.
    pub fn within(&self, query: &Point3<f32>, radius_m: f32, mut found: impl FnMut(Neighbour)) {
        if self.is_empty() || !is_finite(query) {
            return;
        }
        let q = [query.x, query.y, query.z];
        let limit = radius_m * radius_m;
        let mut open = vec![self.root()];
        while let Some(span) = open.pop() {
            if self.nodes[span.node].distance_sq(&q) > limit {
                continue;
            }
            if !span.is_leaf() {
                let (left, right) = span.children();
                open.extend([right, left]);
                continue;
            }
            let distances = self.leaf_distances(span.from, &q);
            for (slot, &distance_sq) in distances.iter().enumerate().filter(|(_, d)| **d <= limit) {
                let index = self.index[span.from * LEAF + slot];
                if index != u32::MAX {
                    found(Neighbour { index, distance_sq });
                }
            }
        }
    }

    /// Index of the point in each slot, without padding.
    pub(crate) fn indices(&self) -> &[u32] {
        &self.index[..self.len]
    }

    pub(crate) fn leaves(&self) -> usize {
        self.nodes.len().div_ceil(2)
    }

    #[inline(always)]
    pub(crate) fn node_distance_sq(&self, node: usize, q: &[f32; 3]) -> f32 {
        self.nodes[node].distance_sq(q)
    }

    fn root(&self) -> Span {
        Span { node: 0, from: 0, to: self.leaves() }
    }

    #[inline(always)]
    pub(crate) fn leaf_distances(&self, leaf: usize, q: &[f32; 3]) -> [f32; LEAF] {
        let range = leaf * LEAF..(leaf + 1) * LEAF;
        let (x, y, z) = (&self.x[range.clone()], &self.y[range.clone()], &self.z[range]);
        let mut out = [0.0; LEAF];
        for i in 0..LEAF {
            let (dx, dy, dz) = (x[i] - q[0], y[i] - q[1], z[i] - q[2]);
            out[i] = dx * dx + dy * dy + dz * dz;
        }
        out
    }

    fn visit_nearest(&self, q: &[f32; 3], span: Span, best: &mut Neighbour) {
        if span.is_leaf() {
            let distances = self.leaf_distances(span.from, q);
            if least(&distances) >= best.distance_sq {
                return;
            }
            for (slot, &distance_sq) in distances.iter().enumerate() {
                if distance_sq < best.distance_sq {
                    *best = Neighbour { index: self.index[span.from * LEAF + slot], distance_sq };
                }
            }
            return;
        }
        let (left, right) = span.children();
        let to_left = self.nodes[left.node].distance_sq(q);
        let to_right = self.nodes[right.node].distance_sq(q);
        let (near, to_near, far, to_far) = if to_left <= to_right {
            (left, to_left, right, to_right)
        } else {
            (right, to_right, left, to_left)
        };
        if to_near < best.distance_sq {
            self.visit_nearest(q, near, best);
        }
        if to_far < best.distance_sq {
            self.visit_nearest(q, far, best);
        }
    }

    fn visit_k(&self, q: &[f32; 3], span: Span, k: usize, found: &mut Vec<Neighbour>) {
        let limit = |found: &Vec<Neighbour>| {
            if found.len() < k { f32::INFINITY } else { found[found.len() - 1].distance_sq }
        };
        if span.is_leaf() {
            let distances = self.leaf_distances(span.from, q);
            for (slot, &distance_sq) in distances.iter().enumerate() {
                if distance_sq < limit(found) {
                    let at = found.partition_point(|n| n.distance_sq <= distance_sq);
                    found.insert(at, Neighbour { index: self.index[span.from * LEAF + slot], distance_sq });
                    found.truncate(k);
                }
            }
            return;
        }
        let (left, right) = span.children();
        let to_left = self.nodes[left.node].distance_sq(q);
        let to_right = self.nodes[right.node].distance_sq(q);
        let order = if to_left <= to_right {
            [(left, to_left), (right, to_right)]
        } else {
            [(right, to_right), (left, to_left)]
        };
        for (child, distance_sq) in order {
            if distance_sq < limit(found) {
                self.visit_k(q, child, k, found);
            }
        }
    }
}

/// Next larger number of a finite number; other numbers are returned unchanged.
fn next_up(value: f32) -> f32 {
    if value.is_finite() { value.next_up() } else { value }
}

/// Builds the nodes: splits items at the median of the widest axis so that the left part fills whole leaves; the halves
/// may be built in parallel.
fn build(items: &mut [Item], nodes: &mut [Bounds], leaves: usize) {
    const PARALLEL_FROM: usize = 1 << 14;
    let bounds = Bounds::around(items);
    nodes[0] = bounds;
    if leaves == 1 {
        return;
    }
    let left_leaves = leaves / 2;
    let left_len = left_leaves * LEAF;
    let axis = bounds.widest_axis();
    items.select_nth_unstable_by(left_len, |a, b| a.at[axis].total_cmp(&b.at[axis]));
    let parallel = items.len() >= PARALLEL_FROM;
    let (left, right) = items.split_at_mut(left_len);
    let (left_nodes, right_nodes) = nodes[1..].split_at_mut(2 * left_leaves - 1);
    let mut build_left = || build(left, left_nodes, left_leaves);
    let mut build_right = || build(right, right_nodes, leaves - left_leaves);
    if parallel {
        pool::join(build_left, build_right);
    } else {
        build_left();
        build_right();
    }
}
