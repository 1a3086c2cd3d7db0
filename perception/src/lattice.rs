//! Sparse voxel grid as a sorted list of keys; neighbours are found by merging, without hashing.

use nalgebra::{Point3, Vector3};

/// Numbering of voxels by integer keys, with x most significant, then y, then z. The lattice is anchored at the world's
/// origin.
#[derive(Clone, Copy, Debug)]
pub struct Lattice {
    pub per_m: f64,
    /// Integer coordinates of the lowest voxel, with a margin of one voxel.
    low: [f64; 3],
    /// Bit shifts of x and y in a key.
    shift: [u32; 2],
    pub bits: u32,
}

impl Lattice {
    /// Creates a lattice over a box, with voxels at least `voxel_m` wide, and wider if keys would exceed 64 bits.
    pub fn over(low: &Point3<f64>, high: &Point3<f64>, mut voxel_m: f64) -> Lattice {
        loop {
            let per_m = 1.0 / voxel_m;
            let floor = |c: f64| (c * per_m).floor();
            let start = [low.x, low.y, low.z].map(|c| floor(c) - 1.0);
            let end = [high.x, high.y, high.z].map(|c| floor(c) + 2.0);
            let bits: [u32; 3] = std::array::from_fn(|k| (end[k] - start[k]).log2().ceil().max(1.0) as u32);
            if bits.iter().sum::<u32>() < 64 {
                let shift = [bits[1] + bits[2], bits[2]];
                return Lattice { per_m, low: start, shift, bits: bits.iter().sum() };
            }
            voxel_m *= 2.0;
        }
    }

    /// Key of the voxel that contains a point of the box.
    #[inline(always)]
    pub fn key(&self, p: &Vector3<f64>) -> u64 {
        let [i, j, k] = [0, 1, 2].map(|axis| (p[axis] * self.per_m - self.low[axis]) as u64);
        i << self.shift[0] | j << self.shift[1] | k
    }

    /// Key offsets of the nine columns of voxels around a voxel; added to the voxel's key, each gives the first of
    /// three consecutive voxels.
    fn columns(&self) -> [i64; 9] {
        let (x, y) = (1_i64 << self.shift[0], 1_i64 << self.shift[1]);
        std::array::from_fn(|c| (c as i64 / 3 - 1) * x + (c as i64 % 3 - 1) * y - 1)
    }

    /// Sorts keys with their payload, stably; overwrites `spare`.
    pub fn sort(&self, entries: &mut Vec<(u64, u32)>, spare: &mut Vec<(u64, u32)>) {
        const DIGIT: u32 = 11;
        const SMALL: usize = 2048;
        if entries.len() < SMALL {
            entries.sort_by_key(|e| e.0);
            return;
        }
        spare.resize(entries.len(), (0, 0));
        for shift in (0..self.bits).step_by(DIGIT as usize) {
            let digit = |key: u64| (key >> shift) as usize & ((1 << DIGIT) - 1);
            let mut ends = [0_u32; 1 << DIGIT];
            entries.iter().for_each(|e| ends[digit(e.0)] += 1);
            if ends[digit(entries[0].0)] as usize == entries.len() {
                continue;
            }
            let mut sum = 0;
            for end in &mut ends {
                sum += std::mem::replace(end, sum);
            }
            for entry in entries.iter() {
                let at = &mut ends[digit(entry.0)];
                spare[*at as usize] = *entry;
                *at += 1;
            }
            std::mem::swap(entries, spare);
        }
    }
}

/// Traversal of sorted keys that keeps track of the occupied voxels around.
pub struct NeighbourSweep<'a> {
    keys: &'a [u64],
    columns: [i64; 9],
    starts: [usize; 9],
}

impl<'a> NeighbourSweep<'a> {
    /// Starts a traversal at the key with index `first`.
    pub fn from(lattice: &Lattice, keys: &'a [u64], first: usize) -> NeighbourSweep<'a> {
        let columns = lattice.columns();
        let starts = columns.map(|c| {
            keys.get(first).map_or(0, |key| keys.partition_point(|k| *k < key.wrapping_add_signed(c)))
        });
        NeighbourSweep { keys, columns, starts }
    }

    /// Calls `found` with the indices of the occupied voxels among the 27 around and at a key. Keys must not decrease
    /// from call to call.
    #[inline(always)]
    pub fn visit(&mut self, key: u64, mut found: impl FnMut(usize)) {
        for (start, column) in self.starts.iter_mut().zip(&self.columns) {
            let from = key.wrapping_add_signed(*column);
            while *start < self.keys.len() && self.keys[*start] < from {
                *start += 1;
            }
            let mut at = *start;
            while at < self.keys.len() && self.keys[at] <= from + 2 {
                found(at);
                at += 1;
            }
        }
    }
}
