//! Sparse grid of voxels in blocks of 8 × 8 × 8, or of 8 × 8 columns: a surface occupies few
//! blocks, each with many neighbouring voxels. A block of columns has a cell for every column.

use nalgebra::{Point3, Vector3};
use rustc_hash::FxHashMap;

/// Number of voxels along a side of a block. From: work.
pub(super) const SIDE: usize = 8;
/// Number of voxels along a side of a block with a margin of one voxel. From: work.
pub(super) const WIDE: usize = SIDE + 2;
/// Mark of an absent cell or block. From: mark.
pub(super) const NONE: u32 = u32::MAX;
/// Maximum number of voxels along an axis: single precision then resolves a sixteenth of a voxel.
/// From: derived, single precision has 24 bits.
const MOST: f64 = (1 << 20) as f64;

/// Voxels over a box, fixed to the world's origin.
#[derive(Clone, Copy, Debug)]
pub(super) struct Grid {
    /// Side of a voxel, metres.
    pub voxel_m: f64,
    /// Lowest corner, metres.
    pub origin_m: Vector3<f64>,
}

impl Grid {
    /// Grid over a box, with voxels of `voxel_m`, or wider ones if the box needs more than [`MOST`]
    /// voxels along an axis.
    pub fn over(low: &Point3<f64>, high: &Point3<f64>, voxel_m: f64) -> Grid {
        /// Margin of the grid around its bounds, voxels. From: chosen.
        const BORDER: f64 = 4.0;
        let voxel_m = voxel_m.max((high - low).amax() / (MOST - BORDER));
        let origin_m = low.coords.map(|c| ((c / voxel_m).floor() - 1.0) * voxel_m);
        Grid { voxel_m, origin_m }
    }
}

/// Position of a block, in blocks: 20 bits per axis.
type Place = u64;
/// Bits of a coordinate in a key. From: derived, three axes in 64 bits.
const PLACE_BITS: u32 = 20;

/// Set of voxels of a block: one number per layer along z, with one bit per voxel, x fastest.
pub(super) type Mask = [u64; SIDE];

/// Numbers of the 27 blocks around one, itself in the middle; `None` where there is no block.
pub(super) type Beside = [Option<u32>; 27];

/// Cells of occupied voxels.
pub(super) struct VoxelBlocks<C> {
    /// Number of each block, by position.
    numbers: FxHashMap<Place, u32>,
    /// Position of each block.
    places: Vec<Place>,
    /// Index of the cell of each voxel, block by block, x fastest; [`NONE`] for empty voxels.
    slots: Vec<u32>,
    /// Layers of voxels in a block, along z.
    layers: usize,
    /// Cells; a block of columns has a cell, at first `empty`, for each column.
    pub cells: Vec<C>,
    empty: C,
    /// Number of occupied cells.
    pub occupied: usize,
    /// Voxels of each block that were asked for since the mask was last cleared.
    pub touched: Vec<Mask>,
    /// Cache of recently used blocks (position and number), by the last bits of the position.
    recent: [(Place, u32); RECENT * RECENT * RECENT],
}

/// Size of the cache `recent` along each axis, blocks. From: work.
const RECENT: usize = 4;

impl<C: Copy> VoxelBlocks<C> {
    /// Empty grid of blocks, whose cells begin as `empty`; blocks of columns along z have one
    /// layer.
    pub fn new(columns: bool, empty: C) -> VoxelBlocks<C> {
        VoxelBlocks {
            numbers: FxHashMap::default(),
            places: Vec::new(),
            slots: Vec::new(),
            layers: if columns { 1 } else { SIDE },
            cells: Vec::new(),
            empty,
            occupied: 0,
            touched: Vec::new(),
            recent: [(Place::MAX, NONE); RECENT * RECENT * RECENT],
        }
    }

    fn are_columns(&self) -> bool {
        self.layers == 1
    }

    fn voxels(&self) -> usize {
        self.layers * SIDE * SIDE
    }

    /// Number of the cell at a position (voxels from the grid's lowest corner); marks the cell as
    /// occupied.
    #[inline(always)]
    pub fn cell(&mut self, at: &[f32; 3]) -> u32 {
        let mut voxel = at.map(|c| c as i32 as u32);
        voxel[2] *= u32::from(!self.are_columns());
        let [x, y, z] = voxel.map(|c| c / SIDE as u32);
        let place = Place::from(x) | Place::from(y) << PLACE_BITS | Place::from(z) << (2 * PLACE_BITS);
        let recent = [x, y, z].iter().fold(0, |at, c| at * RECENT + *c as usize % RECENT);
        let block = match self.recent[recent] {
            (known, block) if known == place => block as usize,
            _ => self.block(place, recent),
        };
        let [x, y, z] = voxel.map(|c| c as usize % SIDE);
        self.touched[block][z] |= 1 << (y * SIDE + x);
        let at = block * self.voxels() + (z * SIDE + y) * SIDE + x;
        let slot = &mut self.slots[at];
        let is_new = *slot == NONE;
        self.occupied += usize::from(is_new);
        if self.layers == 1 {
            // Without asking: nobody could guess the answer.
            *slot = at as u32;
        } else if is_new {
            *slot = self.cells.len() as u32;
            self.cells.push(self.empty);
        }
        *slot
    }

    /// Sorts the cells by block, so that neighbours in space are neighbours in memory; returns
    /// their former numbers. `None` for columns, which already are in order.
    pub fn sort(&mut self) -> Option<Vec<u32>> {
        if self.are_columns() {
            return None;
        }
        let mut former = Vec::with_capacity(self.cells.len());
        for slot in self.slots.iter_mut().filter(|slot| **slot != NONE) {
            former.push(*slot);
            *slot = former.len() as u32 - 1;
        }
        // With room for those of further looks: what outgrows its memory is copied whole.
        let mut cells = Vec::with_capacity(former.len() + former.len() / 2);
        cells.extend(former.iter().map(|&number| self.cells[number as usize]));
        self.cells = cells;
        Some(former)
    }

    #[inline(never)]
    fn block(&mut self, place: Place, recent: usize) -> usize {
        let next = self.places.len();
        let block = *self.numbers.entry(place).or_insert(next as u32) as usize;
        if block == next {
            self.places.push(place);
            self.touched.push(Mask::default());
            self.slots.resize(self.slots.len() + self.voxels(), NONE);
            if self.are_columns() {
                self.cells.resize(self.slots.len(), self.empty);
            }
        }
        self.recent[recent] = (place, block as u32);
        block
    }

    /// Number of blocks that hold a cell.
    pub fn len(&self) -> usize {
        self.places.len()
    }

    /// Calls `found` with the index of each touched cell.
    pub fn visit_touched(&self, mut found: impl FnMut(usize)) {
        for (slots, touched) in self.slots.chunks(self.voxels()).zip(&self.touched) {
            for (slots, mut touched) in slots.chunks(SIDE * SIDE).zip(*touched) {
                while touched != 0 {
                    found(slots[touched.trailing_zeros() as usize] as usize);
                    touched &= touched - 1;
                }
            }
        }
    }

    /// Numbers of the cells of a block.
    pub fn cells_of(&self, block: usize) -> impl Iterator<Item = usize> {
        let slots = self.slots[block * self.voxels()..].iter().take(self.voxels());
        slots.filter(|slot| **slot != NONE).map(|slot| *slot as usize)
    }

    /// Calls `found` for each cell of the middle block with its number and, if the mask holds it,
    /// the cell numbers in the 27 voxels around it, its own included.
    pub fn visit(&self, beside: &Beside, mask: &Mask, mut found: impl FnMut(usize, Option<&[u32]>)) {
        let mut wide = [[[NONE; WIDE]; WIDE]; WIDE];
        self.wide(beside, &mut wide);
        let mut around = [0_u32; 27];
        for z in 1..=self.layers {
            for y in 1..=SIDE {
                if wide[z][y] == [NONE; WIDE] {
                    continue;
                }
                let rows: [&[u32; WIDE]; 9] =
                    std::array::from_fn(|row| &wide[z + row / 3 - 1][y + row % 3 - 1]);
                for x in 1..=SIDE {
                    let own = wide[z][y][x];
                    if own == NONE {
                        continue;
                    }
                    if !is_in(mask, [x, y, z]) {
                        found(own as usize, None);
                        continue;
                    }
                    let mut count = 0;
                    for row in rows {
                        for &cell in &row[x - 1..x + 2] {
                            // Written over by the next if there is none.
                            around[count.min(26)] = cell;
                            count += usize::from(cell != NONE);
                        }
                    }
                    found(own as usize, Some(&around[..count]));
                }
            }
        }
    }

    /// Cell numbers of the middle block of columns with a margin of one cell, by y, x.
    pub fn wide_columns(&self, beside: &Beside) -> [[u32; WIDE]; WIDE] {
        std::array::from_fn(|y| self.wide_row(beside, 1, y))
    }

    /// Cell numbers of a block and of the layer of voxels around it, indexed by z, y, x.
    fn wide(&self, beside: &Beside, wide: &mut [[[u32; WIDE]; WIDE]; WIDE]) {
        for (z, layer) in wide.iter_mut().enumerate() {
            for (y, row) in layer.iter_mut().enumerate() {
                *row = self.wide_row(beside, z, y);
            }
        }
    }

    /// Numbers of the 27 blocks around one, itself in the middle.
    pub fn beside(&self, block: usize) -> Beside {
        let place = self.places[block];
        // Columns have nothing above and below them.
        let mut beside = [None; 27];
        for part in if self.are_columns() { 9..18 } else { 0..27 } {
            let step = |by: usize, bits: u32| (by as Place).wrapping_sub(1) << bits;
            // Beyond the lowest lies a place that is beyond the highest as well: no block.
            let next = place
                .wrapping_add(step(part % 3, 0))
                .wrapping_add(step(part / 3 % 3, PLACE_BITS))
                .wrapping_add(step(part / 9, 2 * PLACE_BITS));
            beside[part] = if next == place { Some(block as u32) } else { self.numbers.get(&next).copied() };
        }
        beside
    }

    /// One row of a block extended by one voxel on each side; the outer voxels come from the
    /// neighbouring blocks.
    #[inline(always)]
    fn wide_row(&self, beside: &Beside, z: usize, y: usize) -> [u32; WIDE] {
        let ((above, z), (behind, y)) = (in_block(z), in_block(y));
        let of = |aside: usize| {
            let first = beside[(above * 3 + behind) * 3 + aside]? as usize * self.voxels();
            self.slots[first + (z * SIDE + y) * SIDE..].first_chunk::<SIDE>()
        };
        let mut row = [NONE; WIDE];
        row[0] = of(0).map_or(NONE, |slots| slots[SIDE - 1]);
        row[SIDE + 1] = of(2).map_or(NONE, |slots| slots[0]);
        if let Some(slots) = of(1) {
            row[1..=SIDE].copy_from_slice(slots);
        }
        row
    }
}

/// Along one axis of a block with a margin of one voxel: the block that holds the voxel (0
/// previous, 1 this, 2 next), and the voxel's index there.
#[inline(always)]
fn in_block(wide: usize) -> (usize, usize) {
    (wide.div_ceil(SIDE), (wide + SIDE - 1) % SIDE)
}

/// True if a mask holds a voxel, given by its coordinates in the block with a margin.
#[inline(always)]
pub(super) fn is_in(mask: &Mask, [x, y, z]: [usize; 3]) -> bool {
    mask[z - 1] >> ((y - 1) * SIDE + x - 1) & 1 == 1
}
