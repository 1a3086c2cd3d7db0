//! Open lists: entries by rising key, by age among equal keys.

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

    /// Takes an entry with the least key: the first one that came, or (`newest`) the last.
    pub(crate) fn pop(&mut self, newest: bool) -> Option<Entry> {
        let take =
            |entries: &mut VecDeque<Entry>| if newest { entries.pop_back() } else { entries.pop_front() };
        if self.len == 0 {
            return None;
        }
        self.len -= 1;
        while self.lowest < self.buckets.len() {
            if let Some(entry) = take(&mut self.buckets[self.lowest]) {
                return Some(entry);
            }
            self.lowest += 1;
        }
        let mut first = self.beyond.first_entry()?;
        let entry = take(first.get_mut());
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
