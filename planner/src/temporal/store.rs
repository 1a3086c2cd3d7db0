//! Generated states of the temporal search without duplicates, packed into 64-bit words.

use std::hash::Hasher;

use rustc_hash::FxHasher;

use crate::ground::{GroundTask, Values};
use crate::memory::{Rows, soon};

/// Position of a variable's bits in the words of a packed state.
#[derive(Debug, Clone, Copy)]
struct Field {
    word: u32,
    shift: u32,
    mask: u64,
}

/// Packed states, with a hash table that finds equal ones.
///
/// A state consists of its variables (packed), its numbers, and one extra word of the search for what
/// else distinguishes states.
pub(crate) struct Store {
    fields: Vec<Field>,
    value_words: usize,
    words: Rows<u64>,
    scratch: Vec<u64>,
    table: Vec<u32>,
    count: u32,
}

const EMPTY: u32 = u32::MAX;

impl Store {
    /// Empty store for the states of a task.
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
        let (words, scratch) = (Rows::new(stride), vec![0; stride]);
        Store { fields, value_words, words, scratch, table: vec![EMPTY; 1024], count: 0 }
    }

    /// Inserts a state with its extra word; returns its index, and true if the state is new.
    pub fn insert(&mut self, state: &Values, extra: u64) -> (u32, bool) {
        self.scratch.fill(0);
        for (field, &value) in self.fields.iter().zip(&state.values) {
            self.scratch[field.word as usize] |= u64::from(value) << field.shift;
        }
        let (numbers, last) = self.scratch.split_at_mut(self.value_words + state.numbers.len());
        for (word, number) in numbers[self.value_words..].iter_mut().zip(&state.numbers) {
            // Adding zero makes -0.0 and 0.0 one state.
            *word = (number + 0.0).to_bits();
        }
        last[0] = extra;
        let mut slot = self.slot(&self.scratch);
        loop {
            let found = self.table[slot];
            if found == EMPTY {
                break;
            }
            if self.words.row(found as usize) == &self.scratch[..] {
                return (found, false);
            }
            slot = (slot + 1) & (self.table.len() - 1);
        }
        self.table[slot] = self.count;
        self.words.push_row(&self.scratch);
        self.count += 1;
        if self.count as usize * 2 > self.table.len() {
            self.grow();
        }
        (self.count - 1, true)
    }

    /// Unpacks a state by index into `into`; returns its extra word.
    pub fn get(&self, index: u32, into: &mut Values) -> u64 {
        let words = self.words.row(index as usize);
        into.values.clear();
        into.values.extend(
            self.fields.iter().map(|field| ((words[field.word as usize] >> field.shift) & field.mask) as u32),
        );
        into.numbers.clear();
        into.numbers
            .extend(words[self.value_words..words.len() - 1].iter().map(|&bits| f64::from_bits(bits)));
        words[words.len() - 1]
    }

    /// Memory of the store, and memory of its hash table after the next growth (0 unless near), in
    /// bytes.
    pub fn bytes(&self) -> [usize; 2] {
        let table = size_of_val(&self.table[..]);
        let next = if soon(2 * self.count as usize, self.table.len()) { 2 * table } else { 0 };
        [self.words.bytes() + table, next]
    }

    fn slot(&self, words: &[u64]) -> usize {
        let mut hasher = FxHasher::default();
        words.iter().for_each(|&word| hasher.write_u64(word));
        // The multiplication of the hasher leaves its good bits on top.
        (hasher.finish() >> 20) as usize & (self.table.len() - 1)
    }

    fn grow(&mut self) {
        let size = self.table.len() * 2;
        self.table = Vec::new();
        self.table = vec![EMPTY; size];
        for index in 0..self.count {
            let mut slot = self.slot(self.words.row(index as usize));
            while self.table[slot] != EMPTY {
                slot = (slot + 1) & (self.table.len() - 1);
            }
            self.table[slot] = index;
        }
    }
}
