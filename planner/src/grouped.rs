//! Lists of values by a small integer key, stored in one array.

use std::ops::Range;

/// Values grouped by key; within a group in the order in which they were given.
#[derive(Debug, Clone, Default)]
pub(crate) struct Grouped<T> {
    /// Index of the first value of each key, and the number of all values last.
    from: Vec<u32>,
    pub(crate) values: Vec<T>,
}

impl<T: Copy + Default> Grouped<T> {
    /// Groups `pairs` of a key (less than `keys`) and a value.
    pub(crate) fn new(keys: usize, pairs: impl Iterator<Item = (u32, T)> + Clone) -> Grouped<T> {
        let mut from = vec![0; keys + 2];
        pairs.clone().for_each(|(key, _)| from[key as usize + 2] += 1);
        for key in 2..from.len() {
            from[key] += from[key - 1];
        }
        let mut values = vec![T::default(); from[keys + 1] as usize];
        for (key, value) in pairs {
            let place = &mut from[key as usize + 1];
            values[*place as usize] = value;
            *place += 1;
        }
        from.pop();
        Grouped { from, values }
    }

    /// Index range of the values of a key.
    pub(crate) fn range(&self, key: u32) -> Range<usize> {
        self.from[key as usize] as usize..self.from[key as usize + 1] as usize
    }

    /// Values of a key.
    pub(crate) fn of(&self, key: u32) -> &[T] {
        &self.values[self.range(key)]
    }

    /// Number of keys.
    pub(crate) fn keys(&self) -> usize {
        self.from.len() - 1
    }
}
