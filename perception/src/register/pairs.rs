//! Correspondences: for each source point the nearest target point.
//!
//! A point that has moved by δ since its last search still has the same nearest point `a` if `a` is
//! no farther than the second nearest point was, less δ. So most searches are spared once the pose
//! settles, with the same correspondences as with a search.

use super::Prepared;
use crate::neighbours::{LEAF, Neighbours, least};
use crate::pool;
use nalgebra::{Isometry3, Point3};

/// A source point and its corresponding target point.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Pair {
    /// Index in the source's points.
    pub source: u32,
    /// Index in the target's points.
    pub target: u32,
    /// Squared distance, square metres.
    pub distance_sq: f32,
}

/// For each source point, in order, the nearest target point within `within_m` under the pose, if
/// any.
pub fn pairs(
    source: &Prepared,
    target: &Prepared,
    target_from_source: &Isometry3<f64>,
    within_m: f32,
) -> Vec<Pair> {
    let place = Place::of(target_from_source);
    let search = |i: usize| -> Option<Pair> {
        let moved = place.apply(&source.points[i]);
        let near = target.tree.nearest(&Point3::from(moved), within_m)?;
        Some(Pair { source: i as u32, target: near.index, distance_sq: near.distance_sq })
    };
    pool::filter(source.points.len(), 1, search)
}

/// Pose as matrix rows, for fast transformation of many points.
pub(super) struct Place {
    rows: [[f64; 4]; 3],
}

impl Place {
    pub(super) fn of(pose: &Isometry3<f64>) -> Place {
        let r = pose.rotation.to_rotation_matrix();
        let t = pose.translation.vector;
        Place { rows: [0, 1, 2].map(|k| [r[(k, 0)], r[(k, 1)], r[(k, 2)], t[k]]) }
    }

    #[inline(always)]
    pub(super) fn apply(&self, p: &Point3<f32>) -> [f32; 3] {
        let (x, y, z) = (f64::from(p.x), f64::from(p.y), f64::from(p.z));
        let along = |r: &[f64; 4]| (r[0] * x + r[1] * y + r[2] * z + r[3]) as f32;
        [along(&self.rows[0]), along(&self.rows[1]), along(&self.rows[2])]
    }

    #[inline(always)]
    pub(super) fn turn(&self, v: [f64; 3]) -> [f64; 3] {
        let along = |r: &[f64; 4]| r[0] * v[0] + r[1] * v[1] + r[2] * v[2];
        [along(&self.rows[0]), along(&self.rows[1]), along(&self.rows[2])]
    }
}

/// Cached correspondence of one source point.
#[derive(Clone, Copy)]
pub(crate) struct Partner {
    /// Position of the point at its last search.
    searched_at: [f32; 3],
    /// Slot of the nearest point in the target's tree; `NONE` if none is near.
    slot: u32,
    /// Lower bound of the distance to all other target points at the last search, metres.
    others_m: f32,
    /// Current squared distance to the corresponding target point, square metres; infinite if none
    /// is near enough.
    pub(super) distance_sq: f32,
}

const NONE: u32 = u32::MAX;

impl Partner {
    pub(crate) const UNKNOWN: Partner = Partner {
        searched_at: [0.0; 3],
        slot: NONE,
        others_m: f32::NEG_INFINITY,
        distance_sq: f32::INFINITY,
    };

    /// Correspondence as a guess that needs verification.
    pub(crate) fn guess(self) -> Partner {
        Partner { slot: self.slot, ..Partner::UNKNOWN }
    }

    /// True if no search has been made yet.
    pub(crate) fn is_unknown(&self) -> bool {
        self.others_m == f32::NEG_INFINITY
    }

    /// Updates the correspondence for the point at `at`; returns its tree slot if within
    /// `within_m`. Another target point may be nearer by up to `slack_m`.
    #[inline(always)]
    pub(crate) fn update(
        &mut self,
        tree: &Neighbours,
        at: [f32; 3],
        within_m: f32,
        slack_m: f32,
    ) -> Option<usize> {
        let limit = within_m * within_m;
        let moved = distance_sq(&at, &self.searched_at).sqrt();
        let to_others = self.others_m - moved + slack_m;
        let still = match self.slot {
            NONE => to_others > within_m,
            slot => {
                self.distance_sq = distance_sq(&at, &tree.at(slot as usize));
                to_others > 0.0 && self.distance_sq <= to_others * to_others
            }
        };
        if !still {
            // Looking a little beyond the limit spares those without a partner the next search.
            const BEYOND: f32 = 1.25;
            let (nearest, second_sq) =
                tree.nearest_two(&at, (BEYOND * within_m) * (BEYOND * within_m), self.slot);
            self.searched_at = at;
            // Rounding may not make the others seem farther than they are.
            self.others_m = second_sq.sqrt() * (1.0 - 1e-5);
            (self.slot, self.distance_sq) = nearest.unwrap_or((NONE, f32::INFINITY));
        }
        (self.slot != NONE && self.distance_sq <= limit).then_some(self.slot as usize)
    }
}

#[inline(always)]
fn distance_sq(a: &[f32; 3], b: &[f32; 3]) -> f32 {
    let [x, y, z] = [a[0] - b[0], a[1] - b[1], a[2] - b[2]];
    x * x + y * y + z * z
}

/// Nearest point (slot) found so far, with the squared distances of the two nearest points.
struct Two {
    slot: u32,
    first_sq: f32,
    second_sq: f32,
}

impl Two {
    #[inline(always)]
    fn offer(&mut self, slot: u32, d: f32) {
        if d < self.first_sq {
            self.second_sq = self.first_sq;
            self.first_sq = d;
            self.slot = slot;
        } else if d < self.second_sq {
            self.second_sq = d;
        }
    }
}

impl Neighbours {
    /// Slot and squared distance of the nearest point below `limit_sq`, and the squared distance of
    /// the second (or the limit, if nearer); `guess`: slot that is likely near.
    fn nearest_two(&self, q: &[f32; 3], limit_sq: f32, guess: u32) -> (Option<(u32, f32)>, f32) {
        let mut two = Two { slot: NONE, first_sq: limit_sq, second_sq: limit_sq };
        if self.is_empty() || !q.iter().all(|c| c.is_finite()) {
            return (None, limit_sq);
        }
        let leaf = (guess != NONE).then_some(guess as usize / LEAF);
        if let Some(leaf) = leaf {
            self.offer_leaf(leaf, q, &mut two);
        }
        self.visit_two(q, 0, 0, self.leaves(), leaf.unwrap_or(usize::MAX), &mut two);
        ((two.slot != NONE).then_some((two.slot, two.first_sq)), two.second_sq)
    }

    #[inline(always)]
    fn offer_leaf(&self, leaf: usize, q: &[f32; 3], two: &mut Two) {
        let distances = self.leaf_distances(leaf, q);
        if least(&distances) >= two.second_sq {
            return;
        }
        for (i, &d) in distances.iter().enumerate() {
            if d < two.second_sq {
                two.offer((leaf * LEAF + i) as u32, d);
            }
        }
    }

    fn visit_two(&self, q: &[f32; 3], node: usize, from: usize, to: usize, seen: usize, two: &mut Two) {
        if to - from == 1 {
            if from != seen {
                self.offer_leaf(from, q, two);
            }
            return;
        }
        let mid = from + (to - from) / 2;
        let (left, right) = (node + 1, node + 2 * (mid - from));
        let (to_left, to_right) = (self.node_distance_sq(left, q), self.node_distance_sq(right, q));
        let left = (left, from, mid, to_left);
        let right = (right, mid, to, to_right);
        let (near, far) = if to_left <= to_right { (left, right) } else { (right, left) };
        for (node, from, to, distance_sq) in [near, far] {
            if distance_sq < two.second_sq {
                self.visit_two(q, node, from, to, seen, two);
            }
        }
    }
}
