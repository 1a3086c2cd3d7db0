//! A sparse voxel grid as a sorted list: cells in the order of their keys, so that neighbours are found by walking, not by hashing.

use nalgebra::{Point3, Vector3};

/// Numbers the voxels of a part of the world: x counts most, then y, then z. The lattice is fixed to the world's origin.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Lattice {
    per_m: f64,
    /// Lowest voxel, with a layer of margin.
    low: [f64; 3],
    /// How far x and y are shifted in a key.
    shift: [u32; 2],
    bits: u32,
}

impl Lattice {
    /// The lattice over a box. The voxels are at least `voxel_m` wide, wider if 64 bits could not number them.
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

    /// Key of the voxel that holds a point of the box.
    #[inline(always)]
    pub fn key(&self, p: &Vector3<f64>) -> u64 {
        let [i, j, k] = [0, 1, 2].map(|axis| (p[axis] * self.per_m - self.low[axis]) as u64);
        i << self.shift[0] | j << self.shift[1] | k
    }

    /// What the nine columns of voxels around one differ in from its key: add, and three voxels in a row are meant.
    fn columns(&self) -> [i64; 9] {
        let (x, y) = (1_i64 << self.shift[0], 1_i64 << self.shift[1]);
        std::array::from_fn(|c| (c as i64 / 3 - 1) * x + (c as i64 % 3 - 1) * y - 1)
    }

    /// Sorts keys with their payload; equal keys stay in order. What `spare` holds is overwritten.
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

/// Walks along sorted keys and keeps track of the occupied voxels around.
pub(crate) struct Around<'a> {
    keys: &'a [u64],
    columns: [i64; 9],
    starts: [usize; 9],
}

impl<'a> Around<'a> {
    /// A walk that begins at the key number `first`.
    pub fn from(lattice: &Lattice, keys: &'a [u64], first: usize) -> Around<'a> {
        let columns = lattice.columns();
        let starts = columns.map(|c| {
            keys.get(first).map_or(0, |key| keys.partition_point(|k| *k < key.wrapping_add_signed(c)))
        });
        Around { keys, columns, starts }
    }

    /// Calls `found` with the numbers of the occupied voxels among the 27 around a key, itself among them. Keys must not fall from call to call.
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

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn lattice() -> Lattice {
        Lattice::over(&Point3::new(-1.0, -0.5, 0.2), &Point3::new(0.7, 0.5, 0.9), 0.05)
    }

    proptest! {
        #[test]
        fn a_walk_finds_what_a_search_of_all_finds(
            places in prop::collection::vec((-1.0..0.7_f64, -0.5..0.5_f64, 0.2..0.9_f64), 1..1000)
        ) {
            let lattice = lattice();
            let voxel = |p: &(f64, f64, f64)| [p.0, p.1, p.2].map(|c| (c / 0.05).floor() as i64);
            let mut entries: Vec<(u64, u32)> = (0..).zip(&places)
                .map(|(i, p)| (lattice.key(&Vector3::new(p.0, p.1, p.2)), i))
                .collect();
            let mut expected = entries.clone();
            expected.sort();
            lattice.sort(&mut entries, &mut Vec::new());
            prop_assert_eq!(&entries, &expected);
            entries.dedup_by_key(|e| e.0);
            let keys: Vec<u64> = entries.iter().map(|e| e.0).collect();
            let first = keys.len() / 3;
            let mut around = Around::from(&lattice, &keys, first);
            for (key, own) in entries.iter().skip(first) {
                let own = voxel(&places[*own as usize]);
                let near = |other: &[i64; 3]| (0..3).all(|k| (own[k] - other[k]).abs() <= 1);
                let expected: Vec<usize> = entries.iter().enumerate()
                    .filter(|(_, e)| near(&voxel(&places[e.1 as usize])))
                    .map(|(at, _)| at)
                    .collect();
                let mut found = Vec::new();
                around.visit(*key, |at| found.push(at));
                prop_assert_eq!(found, expected);
            }
        }
    }

    #[test]
    fn a_box_beyond_all_numbers_gets_wider_voxels() {
        let far = 1e9;
        let lattice = Lattice::over(&Point3::new(-far, -far, -far), &Point3::new(far, far, far), 0.003);
        assert!(lattice.per_m < 1.0 / 0.003 && lattice.bits < 64);
    }
}
