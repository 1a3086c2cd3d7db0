//! Hough votes for upright axes: position and radius, in cells.

/// Number of radii of the Hough transform. From: chosen, steps of 6 mm in the range that is sought.
pub const RADII: usize = 11;
/// Cells along each side of a tile. From: work.
const TILE: usize = 16;

/// Hough accumulator in tiles, allocated on demand.
pub struct Votes {
    /// Lowest cell: x, y.
    low: [i32; 2],
    /// Number of tiles along y.
    deep: usize,
    /// Index plus one of each allocated tile; 0 for the others.
    tiles: Vec<u32>,
    /// Votes of each cell by radius, tile by tile.
    counts: Vec<[u16; RADII]>,
}

impl Votes {
    /// Empty accumulator over the cells from `low` to `high`.
    pub fn over(low: [i32; 2], high: [i32; 2]) -> Votes {
        let tiles = |k: usize| (high[k] - low[k]).max(0) as usize / TILE + 1;
        Votes { low, deep: tiles(1), tiles: vec![0; tiles(0) * tiles(1)], counts: Vec::new() }
    }

    /// Tile and index inside it; `None` beyond the declared cells.
    fn locate(&self, x: i32, y: i32) -> Option<(usize, usize)> {
        // What is lower than the lowest is far beyond the highest.
        let [i, j] = [x.wrapping_sub(self.low[0]), y.wrapping_sub(self.low[1])].map(|at| at as u32 as usize);
        let tile = i / TILE * self.deep + j / TILE;
        (j / TILE < self.deep && tile < self.tiles.len()).then_some((tile, i % TILE * TILE + j % TILE))
    }

    /// Adds one vote per radius in the given cells; votes beyond the declared cells are dropped.
    pub fn add(&mut self, cells: &[[i32; 2]; RADII]) {
        self.change(cells, |count| count.saturating_add(1));
    }

    /// Removes one vote per radius in the given cells.
    pub fn take_back(&mut self, cells: &[[i32; 2]; RADII]) {
        self.change(cells, |count| count.saturating_sub(1));
    }

    fn change(&mut self, cells: &[[i32; 2]; RADII], to: impl Fn(u16) -> u16) {
        for (radius, [x, y]) in cells.iter().enumerate() {
            if let Some((tile, place)) = self.locate(*x, *y) {
                let count = &mut self.lay(tile)[place][radius];
                *count = to(*count);
            }
        }
    }

    /// Adds the votes of another accumulator over the same cells.
    pub fn join(&mut self, other: &Votes) {
        for (tile, laid) in other.tiles.iter().enumerate().filter(|(_, laid)| **laid > 0) {
            let more = &other.counts[(*laid as usize - 1) * TILE * TILE..*laid as usize * TILE * TILE];
            for (own, more) in self.lay(tile).iter_mut().flatten().zip(more.iter().flatten()) {
                *own = own.saturating_add(*more);
            }
        }
    }

    /// Counts of a tile, allocated if needed.
    fn lay(&mut self, tile: usize) -> &mut [[u16; RADII]] {
        if self.tiles[tile] == 0 {
            self.counts.resize(self.counts.len() + TILE * TILE, [0; RADII]);
            self.tiles[tile] = (self.counts.len() / (TILE * TILE)) as u32;
        }
        let end = self.tiles[tile] as usize * TILE * TILE;
        &mut self.counts[end - TILE * TILE..end]
    }

    fn at(&self, x: i32, y: i32) -> Option<&[u16; RADII]> {
        let (tile, place) = self.locate(x, y)?;
        let laid = (self.tiles[tile] as usize).checked_sub(1)?;
        self.counts.get(laid * TILE * TILE + place)
    }

    /// Cells and radii with more than `few` votes of their own and at least `most` with their
    /// neighbours: votes with neighbours, and x, y and radius index.
    pub fn peaks(&self, few: u16, most: u32) -> Vec<(u32, [i32; 3])> {
        let mut peaks = Vec::new();
        for (tile, laid) in self.tiles.iter().enumerate().filter(|(_, laid)| **laid > 0) {
            let counts = &self.counts[(*laid as usize - 1) * TILE * TILE..*laid as usize * TILE * TILE];
            for (place, own) in counts.iter().enumerate() {
                if own.iter().all(|n| *n <= few) {
                    continue;
                }
                let x = self.low[0] + (tile / self.deep * TILE + place / TILE) as i32;
                let y = self.low[1] + (tile % self.deep * TILE + place % TILE) as i32;
                let around = self.around(x, y);
                let cells = (0..RADII).filter(|&k| own[k] > few).map(|k| (around[k], [x, y, k as i32]));
                peaks.extend(cells.filter(|(n, _)| *n >= most));
            }
        }
        peaks
    }

    /// Votes by radius, including neighbouring radii and the eight cells around.
    fn around(&self, x: i32, y: i32) -> [u32; RADII] {
        let mut columns = [0; RADII];
        for counts in (-1..=1).flat_map(|i| (-1..=1).filter_map(move |j| self.at(x + i, y + j))) {
            columns.iter_mut().zip(counts).for_each(|(sum, n)| *sum += u32::from(*n));
        }
        std::array::from_fn(|k| columns[k.saturating_sub(1)..(k + 2).min(RADII)].iter().sum())
    }
}
