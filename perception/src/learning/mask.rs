//! Masks over the pixels of an image: morphology by squares (section V-A, a).

use crate::cloud::Grid;

/// Set of pixels of an image, row by row.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Mask {
    pub grid: Grid,
    pub set: Vec<bool>,
}

impl Mask {
    pub fn none(grid: Grid) -> Mask {
        Mask { grid, set: vec![false; grid.width * grid.height] }
    }

    pub fn of(grid: Grid, pixels: impl IntoIterator<Item = usize>) -> Mask {
        let mut mask = Mask::none(grid);
        pixels.into_iter().for_each(|i| mask.set[i] = true);
        mask
    }

    /// Indices of the set pixels, ascending.
    pub fn pixels(&self) -> impl Iterator<Item = usize> + '_ {
        (0..self.set.len()).filter(|&i| self.set[i])
    }

    pub fn count(&self) -> usize {
        self.set.iter().filter(|s| **s).count()
    }

    /// True if a set pixel lies on the image border.
    pub fn touches_border(&self) -> bool {
        let Grid { width, height } = self.grid;
        self.pixels().any(|i| {
            let (u, v) = (i % width, i / width);
            u == 0 || v == 0 || u + 1 == width || v + 1 == height
        })
    }

    /// Dilation by a square of `reach` pixels to each side.
    pub fn dilated(&self, reach: usize) -> Mask {
        self.along_rows(reach).transposed().along_rows(reach).transposed()
    }

    /// Erosion by a square of `reach` pixels to each side; pixels outside the image count as set.
    pub fn eroded(&self, reach: usize) -> Mask {
        let out = Mask { grid: self.grid, set: self.set.iter().map(|s| !s).collect() }.dilated(reach);
        Mask { grid: self.grid, set: out.set.into_iter().map(|s| !s).collect() }
    }

    /// Closing by a square of `reach` pixels to each side; gaps at the image border stay open.
    pub fn closed(&self, reach: usize) -> Mask {
        let Grid { width, height } = self.grid;
        let wide = Grid { width: width + 2 * reach, height: height + 2 * reach };
        let there = |i: usize| (i / width + reach) * wide.width + i % width + reach;
        let closed = Mask::of(wide, self.pixels().map(there)).dilated(reach).eroded(reach);
        Mask { grid: self.grid, set: (0..self.set.len()).map(|i| closed.set[there(i)]).collect() }
    }

    /// Opening by a square of `reach` pixels to each side: removes parts narrower than the square.
    pub fn opened(&self, reach: usize) -> Mask {
        self.eroded(reach).dilated(reach)
    }

    fn along_rows(&self, reach: usize) -> Mask {
        let mut out = Mask::none(self.grid);
        let width = self.grid.width.max(1);
        for (line, to) in self.set.chunks_exact(width).zip(out.set.chunks_exact_mut(width)) {
            let mut free_from = 0;
            for u in (0..width).filter(|&u| line[u]) {
                let end = (u + reach + 1).min(width);
                to[u.saturating_sub(reach).max(free_from)..end].fill(true);
                free_from = end;
            }
        }
        out
    }

    fn transposed(&self) -> Mask {
        let Grid { width, height } = self.grid;
        let mut out = Mask::none(Grid { width: height, height: width });
        for v in 0..height {
            for u in 0..width {
                out.set[u * height + v] = self.set[v * width + u];
            }
        }
        out
    }
}
