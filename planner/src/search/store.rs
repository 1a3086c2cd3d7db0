//! Generated states without duplicates, packed into 64-bit words.

use crate::classical::compiled::Compiled;
use crate::memory::{Rows, soon};

/// Value that stands for no state.
pub(crate) const NO_STATE: u32 = u32::MAX;

/// Position of a variable's bits in a packed state.
#[derive(Clone, Copy, Debug)]
struct Place {
    word: u32,
    shift: u32,
    mask: u64,
}

/// Packed states, each with its parent, operator and path cost.
pub(crate) struct Store {
    places: Vec<Place>,
    /// Number of words for the packed variables; the numbers follow, one word each.
    packed_words: usize,
    /// Index of the first number in an unpacked state.
    numbers: usize,
    packed: Rows<u64>,
    /// Hash table with open addressing: index of a state, or [`NO_STATE`] for a free slot.
    table: Vec<u32>,
    ways: Rows<Way>,
    scratch: Vec<u64>,
}

/// Way in which a state was reached: parent, operator and path cost.
#[derive(Clone, Copy, Debug)]
struct Way {
    parent: u32,
    operator: u32,
    /// Cost of the path from the initial state, in search costs.
    cost: u32,
    /// True if the state's successors have been generated.
    expanded: bool,
}

fn hash(words: &[u64]) -> u64 {
    let mut h = 0x9e37_79b9_7f4a_7c15u64;
    for &word in words {
        h = (h ^ word).wrapping_mul(0xff51_afd7_ed55_8ccd);
        h ^= h >> 32;
    }
    h
}

impl Store {
    /// Empty store for a task's states; derived variables are not stored but recomputed.
    pub(crate) fn new(task: &Compiled) -> Store {
        let mut order: Vec<usize> = (0..task.basic).collect();
        let bits = |v: usize| 32 - task.domains[v].saturating_sub(1).leading_zeros();
        order.sort_by_key(|&v| std::cmp::Reverse(bits(v)));
        let mut places = vec![Place { word: 0, shift: 0, mask: 0 }; task.basic];
        let mut free: Vec<u32> = Vec::new();
        for v in order {
            let need = bits(v);
            let word = match free.iter().position(|&f| f >= need) {
                Some(word) => word,
                None => {
                    free.push(64);
                    free.len() - 1
                }
            };
            places[v] = Place { word: word as u32, shift: 64 - free[word], mask: (1u64 << need) - 1 };
            free[word] -= need;
        }
        let packed_words = free.len().max(1);
        let words = packed_words + task.numbers.len();
        Store {
            places,
            packed_words,
            numbers: task.domains.len(),
            packed: Rows::new(words),
            table: vec![NO_STATE; 1024],
            ways: Rows::default(),
            scratch: vec![0; words],
        }
    }

    /// Forgets all states.
    pub(crate) fn clear(&mut self) {
        if self.table.len() > 4096 {
            self.table = vec![NO_STATE; 1024];
        } else {
            self.table.fill(NO_STATE);
        }
        self.packed.clear();
        self.ways.clear();
    }

    /// Memory of the store, and memory of its hash table after the next growth (0 unless near), in
    /// bytes.
    pub(crate) fn bytes(&self) -> [usize; 2] {
        let table = size_of_val(&self.table[..]);
        let next = if soon(self.ways.len() * 3 / 2, self.table.len()) { 2 * table } else { 0 };
        [self.packed.bytes() + self.ways.bytes() + table, next]
    }

    /// Inserts a state with its parent, operator and path cost; returns the state's index, and true if
    /// the state is new.
    pub(crate) fn insert(&mut self, state: &[u32], parent: u32, operator: u32, cost: u32) -> (u32, bool) {
        self.scratch.fill(0);
        for (place, &value) in self.places.iter().zip(state) {
            self.scratch[place.word as usize] |= u64::from(value) << place.shift;
        }
        let numbers = state[self.numbers..].chunks_exact(2);
        for (word, halves) in self.scratch[self.packed_words..].iter_mut().zip(numbers) {
            *word = u64::from(halves[0]) | u64::from(halves[1]) << 32;
        }
        let mask = self.table.len() - 1;
        let mut slot = hash(&self.scratch) as usize & mask;
        while self.table[slot] != NO_STATE {
            let id = self.table[slot] as usize;
            if self.packed.row(id) == &self.scratch[..] {
                return (id as u32, false);
            }
            slot = (slot + 1) & mask;
        }
        let id = self.ways.len() as u32;
        self.table[slot] = id;
        self.packed.push_row(&self.scratch);
        self.ways.push(Way { parent, operator, cost, expanded: false });
        if self.ways.len() * 3 > self.table.len() * 2 {
            self.grow();
        }
        (id, true)
    }

    fn grow(&mut self) {
        let size = self.table.len() * 2;
        self.table = Vec::new();
        self.table = vec![NO_STATE; size];
        for id in 0..self.packed.len() {
            let mut slot = hash(self.packed.row(id)) as usize & (size - 1);
            while self.table[slot] != NO_STATE {
                slot = (slot + 1) & (size - 1);
            }
            self.table[slot] = id as u32;
        }
    }

    /// Unpacks a state into `state` and computes its derived variables.
    pub(crate) fn load(&self, task: &Compiled, id: u32, state: &mut Vec<u32>) {
        let words = self.packed.row(id as usize);
        state.clear();
        state.extend(self.places.iter().map(|p| (words[p.word as usize] >> p.shift & p.mask) as u32));
        state.resize(task.domains.len(), 1);
        if !task.numbers.is_empty() {
            state.extend(words[self.packed_words..].iter().flat_map(|&w| [w as u32, (w >> 32) as u32]));
            task.numbers.compare_all(state);
        }
        task.derive(state);
    }

    /// Cost of the best known path from the initial state to a state, in search costs.
    pub(crate) fn cost(&self, id: u32) -> u32 {
        self.ways[id as usize].cost
    }

    /// Replaces the path to a state by a cheaper one.
    pub(crate) fn improve(&mut self, id: u32, parent: u32, operator: u32, cost: u32) {
        let way = &mut self.ways[id as usize];
        *way = Way { parent, operator, cost, ..*way };
    }

    /// True if the state's successors have been generated.
    pub(crate) fn is_expanded(&self, id: u32) -> bool {
        self.ways[id as usize].expanded
    }

    /// Marks a state as expanded, or as to be expanded again (`false`).
    pub(crate) fn set_expanded(&mut self, id: u32, expanded: bool) {
        self.ways[id as usize].expanded = expanded;
    }

    /// Operators on the path from the initial state to a state.
    pub(crate) fn plan_to(&self, mut id: u32) -> Vec<u32> {
        let mut plan = Vec::new();
        while self.ways[id as usize].parent != NO_STATE {
            plan.push(self.ways[id as usize].operator);
            id = self.ways[id as usize].parent;
        }
        plan.reverse();
        plan
    }
}
