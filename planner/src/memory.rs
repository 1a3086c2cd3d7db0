//! Memory limits of planning, and tables and heaps that grow without copying their content.

use std::ops::{Index, IndexMut};

/// Memory limit of planning.
#[derive(Clone, Copy, Debug)]
pub struct MemoryLimit {
    bytes: usize,
    /// Measures the memory of the whole process, bytes; `None` if the caller cannot measure it.
    used: Option<fn() -> u64>,
}

/// The limit divided by this is reserved for allocations between two checks.
const RESERVE: usize = 32;

impl MemoryLimit {
    /// Creates a limit of `bytes` (`None`: unlimited); `used` measures the memory of the whole
    /// process, bytes.
    pub fn new(bytes: Option<u64>, used: Option<fn() -> u64>) -> MemoryLimit {
        let bytes = bytes.map_or(usize::MAX, |bytes| usize::try_from(bytes).unwrap_or(usize::MAX));
        MemoryLimit { bytes: bytes - bytes / RESERVE, used: used.filter(|_| bytes != usize::MAX) }
    }

    /// Limit in bytes on the memory that the search itself counts; `None` if unlimited or if the
    /// process's memory is measured instead.
    pub(crate) fn counted(&self) -> Option<usize> {
        (self.used.is_none() && self.bytes != usize::MAX).then_some(self.bytes)
    }

    /// Limit that remains when `others` bytes are in use elsewhere. Unchanged if the process's
    /// memory is measured.
    pub fn beside(self, others: usize) -> MemoryLimit {
        match self.used {
            Some(_) => self,
            None => MemoryLimit { bytes: self.bytes.saturating_sub(others), ..self },
        }
    }

    /// True if `more` further bytes fit. Memory in use is the measured memory of the process, or
    /// `counted` bytes where that is not measured.
    pub fn has_room(&self, counted: impl FnOnce() -> usize, more: usize) -> bool {
        let used = match self.used {
            Some(used) => usize::try_from(used()).unwrap_or(usize::MAX),
            None => counted(),
        };
        used.saturating_add(more) <= self.bytes
    }
}

/// True if a list of this length is about to exceed its capacity (8/9 full).
pub(crate) fn soon(length: usize, capacity: usize) -> bool {
    length + length / 8 >= capacity
}

/// Maximum size of one chunk of a table, bytes.
const PIECE_BYTES: usize = 1 << 20;

/// Table of rows of equal length, stored in chunks: growth copies nothing (except in the first
/// chunk) and allocates one chunk at a time.
#[derive(Debug)]
pub struct Rows<T> {
    pieces: Vec<Vec<T>>,
    width: usize,
    /// Binary logarithm of the number of rows in a chunk.
    shift: u32,
    len: usize,
}

impl<T> Rows<T> {
    /// Creates an empty table whose rows have `width` items.
    pub fn new(width: usize) -> Rows<T> {
        let fitting = PIECE_BYTES / (width * size_of::<T>()).max(1);
        Rows { pieces: Vec::new(), width, shift: fitting.max(1).ilog2(), len: 0 }
    }

    /// Number of rows.
    pub fn len(&self) -> usize {
        self.len
    }

    /// Number of items in a row.
    pub(crate) fn width(&self) -> usize {
        self.width
    }

    /// Removes all rows; the memory of the first chunk is kept.
    pub(crate) fn clear(&mut self) {
        self.pieces.truncate(1);
        self.pieces.iter_mut().for_each(Vec::clear);
        self.len = 0;
    }

    /// Allocated memory, bytes.
    pub fn bytes(&self) -> usize {
        self.pieces.iter().map(|piece| piece.capacity() * size_of::<T>()).sum()
    }

    /// Chunk to which the next row is appended. The first chunk grows like a vector, because most
    /// tables stay small.
    fn last(&mut self) -> &mut Vec<T> {
        let at = self.len >> self.shift;
        if at == self.pieces.len() {
            let room = if at == 0 { 0 } else { self.width << self.shift };
            self.pieces.push(Vec::with_capacity(room));
        }
        self.len += 1;
        &mut self.pieces[at]
    }

    /// Row by index.
    #[inline]
    pub fn row(&self, index: usize) -> &[T] {
        let start = (index & ((1 << self.shift) - 1)) * self.width;
        &self.pieces[index >> self.shift][start..start + self.width]
    }

    /// Mutable row by index.
    #[inline]
    pub(crate) fn row_mut(&mut self, index: usize) -> &mut [T] {
        let start = (index & ((1 << self.shift) - 1)) * self.width;
        &mut self.pieces[index >> self.shift][start..start + self.width]
    }

    /// Appends a single-item row.
    pub(crate) fn push(&mut self, item: T) {
        debug_assert_eq!(self.width, 1);
        self.last().push(item);
    }

    /// Removes and returns the last single-item row; `None` if the table is empty.
    pub(crate) fn pop(&mut self) -> Option<T> {
        debug_assert_eq!(self.width, 1);
        self.len = self.len.checked_sub(1)?;
        self.pieces.truncate((self.len >> self.shift) + 1);
        self.pieces.last_mut()?.pop()
    }
}

impl<T: Clone> Rows<T> {
    /// Appends a row.
    pub fn push_row(&mut self, row: &[T]) {
        debug_assert_eq!(self.width, row.len());
        self.last().extend_from_slice(row);
    }
}

impl<T> Default for Rows<T> {
    fn default() -> Self {
        Rows::new(1)
    }
}

impl<T> Index<usize> for Rows<T> {
    type Output = T;

    fn index(&self, index: usize) -> &T {
        &self.row(index)[0]
    }
}

impl<T> IndexMut<usize> for Rows<T> {
    fn index_mut(&mut self, index: usize) -> &mut T {
        &mut self.row_mut(index)[0]
    }
}

/// Min-heap stored in chunks.
#[derive(Debug)]
pub struct Heap<T> {
    items: Rows<T>,
}

impl<T> Default for Heap<T> {
    fn default() -> Self {
        Heap { items: Rows::default() }
    }
}

impl<T: Ord + Copy> Heap<T> {
    /// True if the heap is empty.
    pub fn is_empty(&self) -> bool {
        self.items.len() == 0
    }

    /// Allocated memory, bytes.
    pub(crate) fn bytes(&self) -> usize {
        self.items.bytes()
    }

    /// Adds an item.
    pub fn push(&mut self, item: T) {
        let mut at = self.items.len();
        self.items.push(item);
        while at > 0 {
            let above = (at - 1) / 2;
            if self.items[above] <= item {
                break;
            }
            self.items[at] = self.items[above];
            at = above;
        }
        self.items[at] = item;
    }

    /// Removes and returns the smallest item; `None` if the heap is empty.
    pub fn pop(&mut self) -> Option<T> {
        let last = self.items.pop()?;
        let len = self.items.len();
        if len == 0 {
            return Some(last);
        }
        let least = self.items[0];
        let mut at = 0;
        loop {
            let mut below = 2 * at + 1;
            if below >= len {
                break;
            }
            if below + 1 < len && self.items[below + 1] < self.items[below] {
                below += 1;
            }
            if last <= self.items[below] {
                break;
            }
            self.items[at] = self.items[below];
            at = below;
        }
        self.items[at] = last;
        Some(least)
    }
}
