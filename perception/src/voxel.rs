//! Voxel downsampling: one point per voxel, the centroid of its points.

use crate::cloud::{Cloud, is_finite};
use nalgebra::{Point3, Vector3};

/// Reason why points cannot be assigned to voxels.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum VoxelError {
    /// The edge length is not positive.
    #[error("a voxel edge of {edge_m} m: give a positive length, such as 0.01")]
    Edge {
        /// Given edge length, metres.
        edge_m: f32,
    },
    /// A point lies beyond the range of voxel numbers, about a million on each side of the origin.
    #[error(
        "point {index} lies {distance_m} m out, too far for voxels of {edge_m} m (the farthest is {farthest_m} m): \
         are these millimetres (scale by 0.001), or a stray return?"
    )]
    TooFar {
        /// Index of the point.
        index: usize,
        /// Greatest absolute coordinate of the point, metres.
        distance_m: f32,
        /// Edge length of the voxels, metres.
        edge_m: f32,
        /// Greatest coordinate within range, metres.
        farthest_m: f32,
    },
}

/// Number of voxels along an axis on each side of zero; three axes fill 63 bits.
const HALF_RANGE: i64 = 1 << 20;

/// Floor as an integer; the standard function is slow on the oldest instruction set.
#[inline(always)]
pub(crate) fn floor(value: f64) -> i64 {
    let toward_zero = value as i64;
    toward_zero.saturating_sub(i64::from(toward_zero as f64 > value))
}

/// Downsamples to one point per voxel of edge `edge_m`, the centroid, in order of first occurrence.
///
/// The grid is fixed to the origin of the frame, so that the same surface gives the same voxels in every cloud. Colours
/// and normals are averaged; the label is that of the voxel's first point. Points that are not finite are left out.
///
/// # Errors
/// If the edge is not positive or a point lies more than a million voxels from the origin.
pub fn downsample(cloud: &Cloud, edge_m: f32) -> Result<Cloud, VoxelError> {
    let _span = tracing::debug_span!("voxels", points = cloud.len()).entered();
    let assigned = assign(&cloud.points, edge_m)?;
    let counts = assigned.counts();
    let points = assigned
        .sums(cloud.points.iter().map(|p| [f64::from(p.x), f64::from(p.y), f64::from(p.z)]))
        .zip(&counts)
        .map(|(sum, &n)| Point3::from(sum.map(|s| (s / f64::from(n)) as f32)))
        .collect();
    let colours = cloud.colours.as_ref().map(|colours| {
        assigned
            .sums(colours.iter().map(|c| c.map(f64::from)))
            .zip(&counts)
            .map(|(sum, &n)| sum.map(|s| (s / f64::from(n)).round() as u8))
            .collect()
    });
    let normals = cloud.normals.as_ref().map(|normals| {
        assigned
            .sums(normals.iter().map(|n| {
                if n.iter().all(|c| c.is_finite()) { [n.x, n.y, n.z].map(f64::from) } else { [0.0; 3] }
            }))
            .map(|sum| Vector3::from(sum).try_normalize(0.0).map_or(Vector3::repeat(f32::NAN), |n| n.cast()))
            .collect()
    });
    let labels = cloud.labels.as_ref().map(|labels| {
        let mut first = vec![None; assigned.voxels];
        for (&voxel, &label) in assigned.voxel.iter().zip(labels).filter(|(v, _)| **v != NONE) {
            first[voxel as usize].get_or_insert(label);
        }
        first.into_iter().flatten().collect()
    });
    Ok(Cloud { points, grid: None, colours, normals, labels })
}

/// Voxel number of a point without a voxel.
pub const NONE: u32 = u32::MAX;

/// Assignment of points to voxels.
#[derive(Clone, Debug, PartialEq)]
pub struct Assigned {
    /// Voxel number of each point, counted by first occurrence; [`NONE`] for points that are not finite.
    pub voxel: Vec<u32>,
    /// Number of voxels.
    pub voxels: usize,
}

impl Assigned {
    /// Number of points in each voxel.
    pub fn counts(&self) -> Vec<u32> {
        let mut counts = vec![0u32; self.voxels];
        self.voxel.iter().filter(|v| **v != NONE).for_each(|&v| counts[v as usize] += 1);
        counts
    }

    fn sums(&self, values: impl Iterator<Item = [f64; 3]>) -> std::vec::IntoIter<[f64; 3]> {
        let mut sums = vec![[0.0; 3]; self.voxels];
        for (&voxel, value) in self.voxel.iter().zip(values).filter(|(v, _)| **v != NONE) {
            let sum: &mut [f64; 3] = &mut sums[voxel as usize];
            (0..3).for_each(|k| sum[k] += value[k]);
        }
        sums.into_iter()
    }
}

/// Numbers the voxels of edge `edge_m` that hold points, in order of first occurrence.
///
/// # Errors
/// As [`downsample`].
pub fn assign(points: &[Point3<f32>], edge_m: f32) -> Result<Assigned, VoxelError> {
    if !(edge_m.is_finite() && edge_m > 0.0) {
        return Err(VoxelError::Edge { edge_m });
    }
    let per_m = 1.0 / f64::from(edge_m);
    let mut table = Table::with_room_for(points.len() / 8);
    let mut voxel = Vec::with_capacity(points.len());
    let mut last = (u64::MAX, NONE);
    for (index, p) in points.iter().enumerate() {
        if !is_finite(p) {
            voxel.push(NONE);
            continue;
        }
        let axis = |c: f32| floor(f64::from(c) * per_m);
        let Some(key) = key([axis(p.x), axis(p.y), axis(p.z)]) else {
            let distance_m = p.coords.amax();
            return Err(VoxelError::TooFar {
                index,
                distance_m,
                edge_m,
                farthest_m: HALF_RANGE as f32 * edge_m,
            });
        };
        if key != last.0 {
            last = (key, table.number(key));
        }
        voxel.push(last.1);
    }
    Ok(Assigned { voxel, voxels: table.len as usize })
}

/// Unique key of the voxel at integer coordinates; `None` beyond the range of an axis.
#[inline(always)]
pub(crate) fn key([x, y, z]: [i64; 3]) -> Option<u64> {
    let axis = |c: i64| c.saturating_add(HALF_RANGE) as u64;
    let [x, y, z] = [axis(x), axis(y), axis(z)];
    ((x | y | z) < 2 * HALF_RANGE as u64).then_some(x << 42 | y << 21 | z)
}

/// Hash table that numbers keys in order of first occurrence (open addressing, linear probing).
#[derive(Clone, Debug)]
pub(crate) struct Table {
    slots: Vec<(u64, u32)>,
    mask: usize,
    len: u32,
}

impl Table {
    pub(crate) fn with_room_for(keys: usize) -> Table {
        let size = (2 * keys).next_power_of_two().max(1 << 10);
        Table { slots: vec![(u64::MAX, 0); size], mask: size - 1, len: 0 }
    }

    pub(crate) fn number(&mut self, key: u64) -> u32 {
        let mut at = self.home(key);
        loop {
            let (found, number) = self.slots[at];
            if found == key {
                return number;
            }
            if found == u64::MAX {
                break;
            }
            at = (at + 1) & self.mask;
        }
        let number = self.len;
        self.slots[at] = (key, number);
        self.len += 1;
        if self.len as usize * 2 > self.slots.len() {
            self.grow();
        }
        number
    }

    /// Number of a key; `None` if the key has none.
    pub(crate) fn find(&self, key: u64) -> Option<u32> {
        let mut at = self.home(key);
        loop {
            let (found, number) = self.slots[at];
            if found == key {
                return Some(number);
            }
            if found == u64::MAX {
                return None;
            }
            at = (at + 1) & self.mask;
        }
    }

    fn home(&self, key: u64) -> usize {
        let mixed = key.wrapping_mul(0x9E37_79B9_7F4A_7C15);
        (mixed >> 32) as usize & self.mask
    }

    fn grow(&mut self) {
        let old = std::mem::replace(self, Table::with_room_for(self.slots.len()));
        self.len = old.len;
        for slot in old.slots.into_iter().filter(|s| s.0 != u64::MAX) {
            let mut at = self.home(slot.0);
            while self.slots[at].0 != u64::MAX {
                at = (at + 1) & self.mask;
            }
            self.slots[at] = slot;
        }
    }
}
