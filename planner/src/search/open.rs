//! Open lists: entries in order of rising key, oldest or newest first among equal keys.

use std::collections::{BTreeMap, VecDeque};

/// Open-list entry for a successor that is not yet generated: parent state and operator.
pub(crate) type Entry = (u32, u32);

/// Number of keys that have a bucket of their own; larger keys share a map.
const BUCKETS: usize = 1 << 14;

/// Number of entries of one chunk of a queue.
const PIECE: usize = 4096;

/// FIFO queue in chunks, which grows without copying.
#[derive(Default)]
struct Queue {
    pieces: VecDeque<VecDeque<Entry>>,
}

impl Queue {
    fn push(&mut self, entry: Entry) {
        match self.pieces.back_mut() {
            Some(last) if last.len() < PIECE => last.push_back(entry),
            _ => self.pieces.push_back(VecDeque::from([entry])),
        }
    }

    /// Removes the oldest entry, or the newest if `newest`; `None` if the queue is empty.
    fn pop(&mut self, newest: bool) -> Option<Entry> {
        let piece = if newest { self.pieces.back_mut() } else { self.pieces.front_mut() }?;
        let entry = if newest { piece.pop_back() } else { piece.pop_front() };
        if piece.is_empty() && self.pieces.len() > 1 {
            if newest {
                self.pieces.pop_back()
            } else {
                self.pieces.pop_front()
            };
        }
        entry
    }

    fn is_empty(&self) -> bool {
        self.pieces.iter().all(VecDeque::is_empty)
    }
}

/// Open list made of one bucket per key.
#[derive(Default)]
pub(crate) struct OpenList {
    buckets: Vec<Queue>,
    lowest: usize,
    beyond: BTreeMap<u32, Queue>,
    len: usize,
    /// Priority among several open lists: the list with the lowest value is used next.
    pub priority: i64,
}

impl OpenList {
    /// Adds an entry.
    pub(crate) fn push(&mut self, key: u32, entry: Entry) {
        self.len += 1;
        let bucket = key as usize;
        if bucket >= BUCKETS {
            self.beyond.entry(key).or_default().push(entry);
            return;
        }
        if bucket >= self.buckets.len() {
            self.buckets.resize_with(bucket + 1, Queue::default);
        }
        self.buckets[bucket].push(entry);
        self.lowest = self.lowest.min(bucket);
    }

    /// Removes an entry with the least key: the oldest such entry, or the newest if `newest`.
    pub(crate) fn pop(&mut self, newest: bool) -> Option<Entry> {
        if self.len == 0 {
            return None;
        }
        self.len -= 1;
        while self.lowest < self.buckets.len() {
            if let Some(entry) = self.buckets[self.lowest].pop(newest) {
                return Some(entry);
            }
            self.lowest += 1;
        }
        let mut first = self.beyond.first_entry()?;
        let entry = first.get_mut().pop(newest);
        if first.get().is_empty() {
            first.remove();
        }
        entry
    }

    /// Number of entries.
    pub(crate) fn len(&self) -> usize {
        self.len
    }

    /// Approximate memory of the entries in bytes, including spare capacity.
    pub(crate) fn bytes(&self) -> usize {
        self.buckets.len() * size_of::<Queue>() + self.len * size_of::<Entry>() * 3 / 2
    }
}
