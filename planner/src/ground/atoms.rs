//! Ground atoms, numbered, with one hash index for every combination of bound arguments that a join
//! asks for.

use rustc_hash::FxHashMap;

/// Marks an argument or slot that is bound to no object, and the end of a list of rows.
pub(super) const NONE: u32 = u32::MAX;

/// Rows of one predicate that agree on the arguments of an index, as a linked list in ascending
/// order.
#[derive(Clone, Copy)]
struct Chain {
    first: u32,
    last: u32,
    length: u32,
}

struct Index {
    /// Arguments that form the key: bit `i` for argument `i`.
    mask: u32,
    chains: FxHashMap<u64, Chain>,
    /// Next row with the same key, by row; `NONE` after the last.
    next: Vec<u32>,
}

/// Atoms of one predicate, one per row, in the order of their discovery.
struct Table {
    arity: usize,
    arguments: Vec<u32>,
    /// Atom number, by row.
    atoms: Vec<u32>,
    indexes: Vec<Index>,
}

/// All reachable atoms, numbered in order of discovery.
pub(super) struct Atoms {
    tables: Vec<Table>,
    /// Predicate and row, by atom number.
    places: Vec<(u32, u32)>,
    /// Number of bits by which a key is rotated for each argument.
    bits: u32,
}

fn key_of(bits: u32, arguments: impl Iterator<Item = u32>) -> u64 {
    arguments.fold(0u64, |key, a| key.rotate_left(bits).wrapping_add(key >> 61) ^ u64::from(a + 1))
}

impl Atoms {
    /// Creates an empty set of atoms over this many predicates and objects.
    pub(super) fn new(predicates: usize, objects: usize) -> Self {
        let table = || Table {
            arity: 0,
            arguments: Vec::new(),
            atoms: Vec::new(),
            indexes: vec![Index { mask: NONE, chains: FxHashMap::default(), next: Vec::new() }],
        };
        let bits = usize::BITS - (objects + 1).leading_zeros();
        Atoms { tables: (0..predicates).map(|_| table()).collect(), places: Vec::new(), bits }
    }

    /// Number of atoms.
    pub(super) fn len(&self) -> usize {
        self.places.len()
    }

    /// Predicate of an atom.
    pub(super) fn predicate(&self, atom: u32) -> u32 {
        self.places[atom as usize].0
    }

    /// Arguments of an atom.
    pub(super) fn arguments(&self, atom: u32) -> &[u32] {
        let (predicate, row) = self.places[atom as usize];
        self.tables[predicate as usize].row(row)
    }

    /// Adds a predicate and returns its number.
    pub(super) fn add_predicate(&mut self) -> u32 {
        self.tables.push(Table {
            arity: 0,
            arguments: Vec::new(),
            atoms: Vec::new(),
            indexes: vec![Index { mask: NONE, chains: FxHashMap::default(), next: Vec::new() }],
        });
        self.tables.len() as u32 - 1
    }

    /// All atoms of a predicate.
    pub(super) fn of(&self, predicate: u32) -> &[u32] {
        &self.tables[predicate as usize].atoms
    }

    /// Number of the atom; `None` if the set does not contain it.
    pub(super) fn find(&self, predicate: u32, arguments: &[u32]) -> Option<u32> {
        let table = &self.tables[predicate as usize];
        let index = &table.indexes[0];
        let mut row = index.chains.get(&key_of(self.bits, arguments.iter().copied()))?.first;
        while row != NONE {
            if table.row(row) == arguments {
                return Some(table.atoms[row as usize]);
            }
            row = index.next[row as usize];
        }
        None
    }

    /// Inserts an atom; returns its number, and true if it is new.
    pub(super) fn insert(&mut self, predicate: u32, arguments: &[u32]) -> (u32, bool) {
        if let Some(atom) = self.find(predicate, arguments) {
            return (atom, false);
        }
        let atom = self.places.len() as u32;
        let table = &mut self.tables[predicate as usize];
        table.arity = arguments.len();
        let row = table.atoms.len() as u32;
        table.atoms.push(atom);
        table.arguments.extend_from_slice(arguments);
        for index in &mut table.indexes {
            index.push(self.bits, row, arguments);
        }
        self.places.push((predicate, row));
        (atom, true)
    }

    /// Upper bound on the number of atoms of the predicate that match the bound arguments of
    /// `pattern` (the others are `NONE`). Not exact, because keys of different arguments may
    /// collide.
    pub(super) fn count(&mut self, predicate: u32, pattern: &[u32]) -> u32 {
        let mask = mask_of(pattern);
        if mask == 0 {
            return self.tables[predicate as usize].atoms.len() as u32;
        }
        let index = self.index(predicate, mask, pattern.len());
        let key = key_of(self.bits, pattern.iter().copied().filter(|&a| a != NONE));
        self.tables[predicate as usize].indexes[index].chains.get(&key).map_or(0, |c| c.length)
    }

    /// Index for these bound arguments and its first row that may match them (keys may collide);
    /// the row is `NONE` if there is none.
    pub(super) fn first(&mut self, predicate: u32, pattern: &[u32]) -> (usize, u32) {
        let mask = mask_of(pattern);
        if mask == 0 {
            let rows = self.tables[predicate as usize].atoms.len();
            return (usize::MAX, if rows == 0 { NONE } else { 0 });
        }
        let index = self.index(predicate, mask, pattern.len());
        let key = key_of(self.bits, pattern.iter().copied().filter(|&a| a != NONE));
        (index, self.tables[predicate as usize].indexes[index].chains.get(&key).map_or(NONE, |c| c.first))
    }

    /// Row after `row` in an index that [`Atoms::first`] returned; `NONE` at the end.
    pub(super) fn next(&self, predicate: u32, index: usize, row: u32) -> u32 {
        let table = &self.tables[predicate as usize];
        if index == usize::MAX {
            return if row as usize + 1 < table.atoms.len() { row + 1 } else { NONE };
        }
        table.indexes[index].next[row as usize]
    }

    /// Atom number and arguments of a row.
    pub(super) fn row(&self, predicate: u32, row: u32) -> (u32, &[u32]) {
        let table = &self.tables[predicate as usize];
        (table.atoms[row as usize], table.row(row))
    }

    fn index(&mut self, predicate: u32, mask: u32, arity: usize) -> usize {
        let full = (1u64 << arity) - 1;
        if u64::from(mask) == full {
            return 0;
        }
        let bits = self.bits;
        let table = &mut self.tables[predicate as usize];
        if let Some(found) = table.indexes.iter().position(|index| index.mask == mask) {
            return found;
        }
        let mut index = Index { mask, chains: FxHashMap::default(), next: Vec::new() };
        for row in 0..table.atoms.len() as u32 {
            index.push(bits, row, table.row(row));
        }
        table.indexes.push(index);
        table.indexes.len() - 1
    }
}

fn mask_of(pattern: &[u32]) -> u32 {
    pattern.iter().enumerate().fold(0, |mask, (i, &a)| if a == NONE { mask } else { mask | 1 << i })
}

impl Table {
    fn row(&self, row: u32) -> &[u32] {
        &self.arguments[row as usize * self.arity..(row as usize + 1) * self.arity]
    }
}

impl Index {
    fn push(&mut self, bits: u32, row: u32, arguments: &[u32]) {
        let mask = self.mask;
        let bound = arguments.iter().enumerate().filter(|(i, _)| mask == NONE || mask >> i & 1 == 1);
        let key = key_of(bits, bound.map(|(_, &a)| a));
        self.next.push(NONE);
        let chain = self.chains.entry(key).or_insert(Chain { first: row, last: row, length: 0 });
        if chain.length > 0 {
            self.next[chain.last as usize] = row;
        }
        chain.last = row;
        chain.length += 1;
    }
}
