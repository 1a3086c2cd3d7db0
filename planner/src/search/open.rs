//! Open lists: entries by rising key, first in first out among equal keys.

use std::collections::{BTreeMap, VecDeque};

/// A generated but not yet made state: its parent and the operator.
pub(crate) type Entry = (u32, u32);

/// Keys below this have a bucket each; others share a map.
const BUCKETS: usize = 1 << 14;

/// One open list.
#[derive(Default)]
pub(crate) struct OpenList {
    buckets: Vec<VecDeque<Entry>>,
    lowest: usize,
    beyond: BTreeMap<u32, VecDeque<Entry>>,
    len: usize,
    /// The lower, the sooner this list is asked next.
    pub priority: i64,
}

impl OpenList {
    /// Adds an entry.
    pub(crate) fn push(&mut self, key: u32, entry: Entry) {
        self.len += 1;
        let bucket = key as usize;
        if bucket >= BUCKETS {
            self.beyond.entry(key).or_default().push_back(entry);
            return;
        }
        if bucket >= self.buckets.len() {
            self.buckets.resize_with(bucket + 1, VecDeque::new);
        }
        self.buckets[bucket].push_back(entry);
        self.lowest = self.lowest.min(bucket);
    }

    /// Takes the first entry with the least key.
    pub(crate) fn pop(&mut self) -> Option<Entry> {
        if self.len == 0 {
            return None;
        }
        self.len -= 1;
        while self.lowest < self.buckets.len() {
            if let Some(entry) = self.buckets[self.lowest].pop_front() {
                return Some(entry);
            }
            self.lowest += 1;
        }
        let mut first = self.beyond.first_entry()?;
        let entry = first.get_mut().pop_front();
        if first.get().is_empty() {
            first.remove();
        }
        entry
    }

    /// Number of entries.
    pub(crate) fn len(&self) -> usize {
        self.len
    }
}
