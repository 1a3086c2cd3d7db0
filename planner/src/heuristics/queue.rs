//! Radix heap: a priority queue whose popped keys never decrease (Ahuja et al. 1990).

/// Radix heap of items with 32-bit keys; pushed keys must not be below the last key popped. Entries of
/// equal key leave in a deterministic order.
#[derive(Clone, Debug)]
pub(crate) struct RadixHeap {
    buckets: Vec<Vec<(u32, u32)>>,
    last: u32,
    len: usize,
}

impl RadixHeap {
    /// Empty heap.
    pub(crate) fn new() -> Self {
        RadixHeap { buckets: vec![Vec::new(); 33], last: 0, len: 0 }
    }

    /// Empties the heap; keys may start at 0 again.
    pub(crate) fn clear(&mut self) {
        if self.len > 0 {
            self.buckets.iter_mut().for_each(Vec::clear);
        }
        self.last = 0;
        self.len = 0;
    }

    /// Adds an entry; the key must be at least the last one popped.
    #[inline]
    pub(crate) fn push(&mut self, key: u32, item: u32) {
        let bucket = 32 - (key ^ self.last).leading_zeros() as usize;
        self.buckets[bucket].push((key, item));
        self.len += 1;
    }

    /// Removes and returns an entry (key, item) with the least key; `None` if the heap is empty.
    #[inline]
    pub(crate) fn pop(&mut self) -> Option<(u32, u32)> {
        if self.len == 0 {
            return None;
        }
        self.len -= 1;
        if let Some(entry) = self.buckets[0].pop() {
            return Some(entry);
        }
        let from = self.buckets.iter().position(|b| !b.is_empty())?;
        let entries = std::mem::take(&mut self.buckets[from]);
        self.last = entries.iter().map(|e| e.0).min().unwrap_or(self.last);
        for &(key, item) in &entries {
            let bucket = 32 - (key ^ self.last).leading_zeros() as usize;
            self.buckets[bucket].push((key, item));
        }
        let mut entries = entries;
        entries.clear();
        if self.buckets[from].is_empty() {
            self.buckets[from] = entries;
        }
        self.buckets[0].pop()
    }
}
