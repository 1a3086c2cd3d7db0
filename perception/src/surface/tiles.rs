//! Cells of a plane in square tiles, allocated on demand.

use rustc_hash::FxHashMap;
use std::cell::Cell;

/// Base-2 logarithm of the number of cells along each side of a tile. From: work.
const BITS: usize = 3;
/// Number of cells along each side of a tile. From: work.
const SIDE: usize = 1 << BITS;

/// Values by cell, with a default. Successive cells are mostly in one tile, so that few tiles are
/// looked up.
pub struct Tiles<T> {
    /// Start of each tile in `values`.
    starts: FxHashMap<[i32; 2], usize>,
    /// Most recently used tile, with its start.
    last: Cell<([i32; 2], usize)>,
    /// Tiles in order of allocation.
    tiles: Vec<[i32; 2]>,
    values: Vec<T>,
}

impl<T: Copy + Default> Tiles<T> {
    pub fn new() -> Tiles<T> {
        /// Mark of no tile. From: derived, tiles are numbered from the least cell by eight.
        const NONE: [i32; 2] = [i32::MIN; 2];
        Tiles {
            starts: FxHashMap::default(),
            last: Cell::new((NONE, 0)),
            tiles: Vec::new(),
            values: Vec::new(),
        }
    }

    /// Start of a tile's cells, if allocated.
    #[inline(always)]
    fn start(&self, tile: [i32; 2]) -> Option<usize> {
        let (last, start) = self.last.get();
        if last == tile {
            return Some(start);
        }
        let start = *self.starts.get(&tile)?;
        self.last.set((tile, start));
        Some(start)
    }

    #[inline(always)]
    pub fn get(&self, cell: [i32; 2]) -> T {
        self.start(cell.map(|at| at >> BITS))
            .map_or_else(T::default, |start| self.values[start + place(cell)])
    }

    #[inline(always)]
    pub fn at(&mut self, cell: [i32; 2]) -> &mut T {
        let tile = cell.map(|at| at >> BITS);
        let start = match self.start(tile) {
            Some(start) => start,
            None => self.lay(tile),
        };
        &mut self.values[start + place(cell)]
    }

    fn lay(&mut self, tile: [i32; 2]) -> usize {
        let start = self.values.len();
        self.values.resize(start + SIDE * SIDE, T::default());
        self.starts.insert(tile, start);
        self.tiles.push(tile);
        self.last.set((tile, start));
        start
    }

    /// Cells of all allocated tiles, sorted by x, then y.
    pub fn all(&self) -> Vec<([i32; 2], T)> {
        let mut tiles: Vec<(&[i32; 2], &[T])> =
            self.tiles.iter().zip(self.values.chunks_exact(SIDE * SIDE)).collect();
        tiles.sort_unstable_by_key(|(tile, _)| **tile);
        let mut all = Vec::with_capacity(self.values.len());
        for row in tiles.chunk_by(|a, b| a.0[0] == b.0[0]) {
            for k in 0..SIDE {
                for (tile, values) in row {
                    let [x, y] = tile.map(|at| at << BITS);
                    let column = values[k * SIDE..(k + 1) * SIDE].iter();
                    all.extend(
                        (y..=y | (SIDE as i32 - 1)).zip(column).map(|(y, value)| ([x + k as i32, y], *value)),
                    );
                }
            }
        }
        all
    }
}

/// Index of a cell in its tile.
#[inline(always)]
fn place(cell: [i32; 2]) -> usize {
    let [x, y] = cell.map(|at| at.cast_unsigned() as usize % SIDE);
    x * SIDE + y
}
