//! Packed states, each stored once.

use rustc_hash::FxHasher;
use std::hash::Hasher;

use crate::ground::{GroundTask, Values};
use crate::memory::growing;

/// Where a variable's value stands in the words of a packed state.
#[derive(Debug, Clone, Copy)]
struct Field {
    word: u32,
    shift: u32,
    mask: u64,
}

/// States as words, with a table to find equal ones.
///
/// A state is its variables, bit-packed, its numbers, and one word that the search adds (what is in progress).
pub(crate) struct Store {
    fields: Vec<Field>,
    value_words: usize,
    stride: usize,
    words: Vec<u64>,
    table: Vec<u32>,
    count: u32,
}

const EMPTY: u32 = u32::MAX;

impl Store {
    /// For the states of a task.
    pub fn new(ground: &GroundTask) -> Store {
        let mut fields = Vec::with_capacity(ground.variables.len());
        let (mut word, mut shift) = (0, 0);
        for variable in &ground.variables {
            let bits = (u32::BITS - variable.domain_size().saturating_sub(1).leading_zeros()).max(1);
            if shift + bits > u64::BITS {
                word += 1;
                shift = 0;
            }
            fields.push(Field { word, shift, mask: (1 << bits) - 1 });
            shift += bits;
        }
        let value_words = if fields.is_empty() { 0 } else { word as usize + 1 };
        let stride = value_words + ground.numerics.len() + 1;
        Store { fields, value_words, stride, words: Vec::new(), table: vec![EMPTY; 1024], count: 0 }
    }

    /// The number of the state, and whether it is new.
    pub fn insert(&mut self, state: &Values, extra: u64) -> (u32, bool) {
        let start = self.words.len();
        self.words.resize(start + self.stride, 0);
        for (field, &value) in self.fields.iter().zip(&state.values) {
            self.words[start + field.word as usize] |= u64::from(value) << field.shift;
        }
        for (index, number) in state.numbers.iter().enumerate() {
            // Adding zero makes -0.0 and 0.0 one state.
            self.words[start + self.value_words + index] = (number + 0.0).to_bits();
        }
        self.words[start + self.stride - 1] = extra;
        let mut slot = self.slot(&self.words[start..]);
        loop {
            let found = self.table[slot];
            if found == EMPTY {
                break;
            }
            let other = found as usize * self.stride;
            if self.words[other..other + self.stride] == self.words[start..] {
                self.words.truncate(start);
                return (found, false);
            }
            slot = (slot + 1) & (self.table.len() - 1);
        }
        self.table[slot] = self.count;
        self.count += 1;
        if self.count as usize * 2 > self.table.len() {
            self.grow();
        }
        (self.count - 1, true)
    }

    /// The state of a number, and its extra word.
    pub fn get(&self, index: u32, into: &mut Values) -> u64 {
        let start = index as usize * self.stride;
        let words = &self.words[start..start + self.stride];
        into.values.clear();
        into.values.extend(
            self.fields.iter().map(|field| ((words[field.word as usize] >> field.shift) & field.mask) as u32),
        );
        into.numbers.clear();
        into.numbers
            .extend(words[self.value_words..self.stride - 1].iter().map(|&bits| f64::from_bits(bits)));
        words[self.stride - 1]
    }

    /// Bytes in use.
    pub fn bytes(&self) -> usize {
        let table = 2 * self.count as usize;
        growing::<u64>(self.words.len(), self.words.capacity()) + growing::<u32>(table, self.table.len())
    }

    fn slot(&self, words: &[u64]) -> usize {
        let mut hasher = FxHasher::default();
        words.iter().for_each(|&word| hasher.write_u64(word));
        // The multiplication of the hasher leaves its good bits on top.
        (hasher.finish() >> 20) as usize & (self.table.len() - 1)
    }

    fn grow(&mut self) {
        self.table = vec![EMPTY; self.table.len() * 2];
        for index in 0..self.count {
            let start = index as usize * self.stride;
            let mut slot = self.slot(&self.words[start..start + self.stride]);
            while self.table[slot] != EMPTY {
                slot = (slot + 1) & (self.table.len() - 1);
            }
            self.table[slot] = index;
        }
    }
}
