//! Candidates of a nearest-neighbour search, and selection of the k nearest.

use super::LEAF;

/// Candidates near a query point: squared distances and slots, unordered.
#[derive(Default)]
pub(crate) struct Nearby {
    /// Squared distances; this and the next field have room for a leaf beyond `len`.
    distances: Vec<f32>,
    slots: Vec<u32>,
    len: usize,
    order: Vec<(u32, u32)>,
}

/// Maximum number of bracketing steps before sorting; many ties admit no narrow bracket.
const GUESSES: usize = 12;
/// Maximum number of candidates around the k-th that are sorted.
const FEW: usize = 8;

/// Bracket of the k-th nearest: a squared distance on each side, with the number of candidates up to it.
struct Parting {
    low: f32,
    below: usize,
    high: f32,
    above: usize,
}

/// Least of a leaf's distances. Eight at a time: a chain of single comparisons would take longer than the distances
/// themselves.
#[inline(always)]
pub(crate) fn least(distances: &[f32; LEAF]) -> f32 {
    let (eights, _) = distances.as_chunks::<8>();
    let mut lanes = [f32::INFINITY; 8];
    for eight in eights {
        for (lane, &d) in lanes.iter_mut().zip(eight) {
            *lane = if d < *lane { d } else { *lane };
        }
    }
    lanes.iter().fold(f32::INFINITY, |a, &b| if b < a { b } else { a })
}

impl Nearby {
    pub(crate) fn len(&self) -> usize {
        self.len
    }

    pub(crate) fn slots(&self) -> &[u32] {
        &self.slots[..self.len]
    }

    pub(crate) fn distances_sq(&self) -> &[f32] {
        &self.distances[..self.len]
    }

    pub(super) fn clear(&mut self) {
        self.len = 0;
    }

    /// Adds the points of a leaf within `bound`, a finite squared distance; `first`: the leaf's first slot.
    #[inline(always)]
    pub(super) fn add(&mut self, distances: &[f32; LEAF], first: usize, bound: f32) {
        let end = self.len + LEAF;
        if self.distances.len() < end {
            self.distances.resize(2 * end, 0.0);
            self.slots.resize(2 * end, 0);
        }
        let (Some(out), Some(slots)) = (
            self.distances[self.len..].first_chunk_mut::<LEAF>(),
            self.slots[self.len..].first_chunk_mut::<LEAF>(),
        ) else {
            return;
        };
        let mut kept = 0;
        for (i, &d) in distances.iter().enumerate() {
            // Every candidate is written where the next kept one belongs: no branch to predict. `kept` is never above `i`.
            out[kept % LEAF] = d;
            slots[kept % LEAF] = (first + i) as u32;
            kept += usize::from(d <= bound);
        }
        self.len += kept;
    }

    /// Keeps the `k` nearest candidates and returns the squared distance of the farthest, square metres; with fewer
    /// than `k`, keeps all and returns `bound`.
    #[inline(always)]
    pub(super) fn keep(&mut self, k: usize, bound: f32) -> f32 {
        if self.len > k {
            match self.part(k) {
                Some(parting) => self.cut(k, parting),
                None => self.sort(k),
            }
        } else if self.len < k {
            return bound;
        }
        self.farthest()
    }

    #[inline(always)]
    fn farthest(&self) -> f32 {
        let (eights, rest) = self.distances_sq().as_chunks::<8>();
        let mut lanes = [0.0f32; 8];
        for eight in eights {
            for (lane, &d) in lanes.iter_mut().zip(eight) {
                *lane = if d > *lane { d } else { *lane };
            }
        }
        lanes.iter().chain(rest).fold(0.0, |a, &b| if b > a { b } else { a })
    }

    /// Bracket of the k-th nearest candidate with at most `FEW` candidates in between; `None` if none is found. On a
    /// surface, the count grows with the squared distance, so interpolation is usually close.
    #[inline(always)]
    fn part(&self, k: usize) -> Option<Parting> {
        let mut p = Parting { low: -1.0, below: 0, high: self.farthest(), above: self.len };
        for guess in 0..GUESSES {
            if p.above - p.below <= FEW {
                return Some(p);
            }
            let from = p.low.max(0.0);
            let share = (k as f32 - p.below as f32) / (p.above as f32 - p.below as f32);
            // Every third guess halves, in case the candidates are spread otherwise.
            let share = if guess % 3 == 2 { 0.5 } else { share };
            let limit = from + (p.high - from) * share;
            let count = self.distances_sq().iter().map(|d| u32::from(*d <= limit)).sum::<u32>() as usize;
            if count < k {
                (p.low, p.below) = (limit, count);
            } else {
                (p.high, p.above) = (limit, count);
            }
        }
        None
    }

    /// Keeps the `k` nearest candidates: those below the bracket and the nearest of those inside it; ties by slot.
    #[inline(always)]
    fn cut(&mut self, k: usize, parting: Parting) {
        let mut between = [(f32::INFINITY, u32::MAX); FEW + 1];
        let (mut kept, mut few) = (0, 0);
        for i in 0..self.len {
            let (d, slot) = (self.distances[i], self.slots[i]);
            self.distances[kept] = d;
            self.slots[kept] = slot;
            kept += usize::from(d <= parting.low);
            between[few] = (d, slot);
            few = (few + usize::from(d > parting.low && d <= parting.high)).min(FEW);
        }
        let between = &mut between[..few];
        between.sort_unstable_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
        for &(d, slot) in between.iter().take(k - kept) {
            self.distances[kept] = d;
            self.slots[kept] = slot;
            kept += 1;
        }
        self.len = kept;
    }

    /// Keeps the `k` nearest candidates by selection, ties by slot.
    #[cold]
    fn sort(&mut self, k: usize) {
        self.order.clear();
        let (distances, slots) = (&self.distances[..self.len], &self.slots[..self.len]);
        self.order.extend(distances.iter().zip(slots).map(|(d, slot)| (d.to_bits(), *slot)));
        self.order.select_nth_unstable(k - 1);
        for (i, &(bits, slot)) in self.order[..k].iter().enumerate() {
            self.distances[i] = f32::from_bits(bits);
            self.slots[i] = slot;
        }
        self.len = k;
    }
}
