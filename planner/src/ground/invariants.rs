//! Mutex groups: sets of atoms of which at most one holds in every reachable state.
//!
//! Candidates follow Helmert (2009), "Concise finite-domain representations for PDDL planning
//! tasks", section 5: a set of predicates, each with key arguments, which name a group, and at most
//! one counted argument. A candidate is tested against the ground actions instead of the lifted
//! ones, which is exact where several parameters are the same object. A durative action is two
//! transitions, joined by a token that says that the action is running; so what its start deletes
//! and its end adds again stays counted.

use rustc_hash::{FxHashMap, FxHashSet};

/// Atom that a transition adds or deletes, with the atoms in the condition of that effect.
pub(crate) type Changed = (u32, Vec<u32>);

/// Change of the state by an action's start, its end or a timed effect, in atoms.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Transition<'t> {
    /// Atoms of the transition's precondition, sorted.
    pub before: &'t [u32],
    /// Atoms that the transition adds, each with the further atoms that hold before it (condition
    /// of a conditional effect).
    pub adds: &'t [Changed],
    /// Atoms that the transition deletes, each with the complete condition of the deletion.
    /// Deletions whose condition is more than atoms are left out.
    pub deletes: &'t [Changed],
}

/// Transitions of a task, stored in common arrays.
#[derive(Debug, Default)]
pub(crate) struct Transitions {
    before: Vec<u32>,
    adds: Vec<Changed>,
    deletes: Vec<Changed>,
    /// End of each transition's part in `before`, `adds` and `deletes`.
    ends: Vec<[u32; 3]>,
}

impl Transitions {
    /// Number of transitions.
    pub fn len(&self) -> usize {
        self.ends.len()
    }

    /// Transition by index.
    pub fn get(&self, index: usize) -> Transition<'_> {
        let end = self.ends[index].map(|end| end as usize);
        let from = index.checked_sub(1).map_or([0; 3], |before| self.ends[before].map(|end| end as usize));
        Transition {
            before: &self.before[from[0]..end[0]],
            adds: &self.adds[from[1]..end[1]],
            deletes: &self.deletes[from[2]..end[2]],
        }
    }

    /// Adds a precondition to the open transition.
    pub fn before(&mut self, atom: u32) {
        self.before.push(atom);
    }

    /// Adds an add effect with the condition `after` to the open transition.
    pub fn adds(&mut self, atom: u32, after: Vec<u32>) {
        self.adds.push((atom, after));
    }

    /// Adds a delete effect with the condition `after` to the open transition.
    pub fn deletes(&mut self, atom: u32, after: Vec<u32>) {
        self.deletes.push((atom, after));
    }

    /// Closes the open transition; the next additions begin a new one.
    pub fn close(&mut self) {
        let from = self.ends.last().map_or(0, |ends| ends[0] as usize);
        self.before[from..].sort_unstable();
        self.ends.push([self.before.len() as u32, self.adds.len() as u32, self.deletes.len() as u32]);
    }
}

/// Predicates and arguments of the atoms among which groups are sought.
pub(crate) trait AtomNames {
    /// Predicate of an atom.
    fn predicate(&self, atom: u32) -> u32;
    /// Argument objects of an atom.
    fn arguments(&self, atom: u32) -> &[u32];
}

/// One predicate of a candidate invariant, with the argument positions that form the key, in key
/// order.
#[derive(Clone, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
struct Part {
    predicate: u32,
    key: Vec<u8>,
}

/// Maximum number of candidates tested.
const MOST_CANDIDATES: usize = 400;
/// Maximum number of transitions examined over all candidates.
const MOST_WORK: usize = 30_000_000;

struct Synthesis<'a, N: AtomNames> {
    names: &'a N,
    transitions: &'a Transitions,
    /// Transitions that add an atom of a predicate (indices), by predicate.
    adders: FxHashMap<u32, Vec<u32>>,
    /// Least predicate number of a token. Any number of a token's arguments may be outside the key.
    first_token: u32,
    work: usize,
}

/// Counterexample to a candidate: a transition whose add effect `add` makes an atom of `key` true
/// without making another one false.
struct Unbalanced {
    transition: u32,
    add: usize,
    key: Vec<u32>,
}

/// Finds mutex groups among `atoms`, in an order that follows from the order of the input; the
/// groups found so far if `stop` becomes true.
///
/// `initial`: atoms that hold initially. `predicates`: predicates to start from, each with its
/// arity.
pub(crate) fn mutex_groups<N: AtomNames>(
    names: &N,
    atoms: &[u32],
    initial: &[u32],
    transitions: &Transitions,
    predicates: &[(u32, usize)],
    first_token: u32,
    stop: &dyn Fn() -> bool,
) -> Vec<Vec<u32>> {
    let mut adders: FxHashMap<u32, Vec<u32>> = FxHashMap::default();
    for index in 0..transitions.len() {
        for (atom, _) in transitions.get(index).adds {
            let list = adders.entry(names.predicate(*atom)).or_default();
            if list.last() != Some(&(index as u32)) {
                list.push(index as u32);
            }
        }
    }
    let mut synthesis = Synthesis { names, transitions, adders, first_token, work: 0 };
    let invariants = synthesis.run(predicates, stop);
    let mut groups: FxHashSet<Vec<u32>> = FxHashSet::default();
    let mut ordered = Vec::new();
    for invariant in &invariants {
        for group in instances(names, atoms, initial, invariant) {
            if group.len() > 1 && groups.insert(group.clone()) {
                ordered.push(group);
            }
        }
    }
    ordered
}

impl<N: AtomNames> Synthesis<'_, N> {
    fn run(&mut self, predicates: &[(u32, usize)], stop: &dyn Fn() -> bool) -> Vec<Vec<Part>> {
        let mut queue: Vec<Vec<Part>> = Vec::new();
        let mut seen = FxHashSet::default();
        for &(predicate, arity) in predicates {
            let all: Vec<u8> = (0..arity as u8).collect();
            queue.push(vec![Part { predicate, key: all.clone() }]);
            for counted in 0..arity as u8 {
                let key = all.iter().copied().filter(|&p| p != counted).collect();
                queue.push(vec![Part { predicate, key }]);
            }
        }
        seen.extend(queue.iter().cloned());
        let mut valid = Vec::new();
        let mut next = 0;
        while next < queue.len() && next < MOST_CANDIDATES && self.work < MOST_WORK && !stop() {
            let candidate = queue[next].clone();
            next += 1;
            match self.test(&candidate) {
                None => valid.push(candidate),
                Some(Some(unbalanced)) => {
                    for refined in self.refine(&candidate, &unbalanced) {
                        if seen.insert(refined.clone()) {
                            queue.push(refined);
                        }
                    }
                }
                Some(None) => {}
            }
        }
        valid
    }

    /// Tests a candidate: `None` if it is an invariant, `Some(Some(_))` with a counterexample that
    /// a refinement may repair, `Some(None)` if none can.
    fn test(&mut self, candidate: &[Part]) -> Option<Option<Unbalanced>> {
        for part in candidate {
            let list = self.adders.get(&part.predicate).map_or(&[][..], |l| l);
            for &index in list {
                self.work += 1;
                let transition = self.transitions.get(index as usize);
                if let Some(reason) = self.test_one(candidate, index, transition) {
                    return Some(reason);
                }
            }
        }
        None
    }

    fn test_one(&self, candidate: &[Part], index: u32, transition: Transition) -> Option<Option<Unbalanced>> {
        for (i, (atom, extra)) in transition.adds.iter().enumerate() {
            let held = |a: &u32| transition.before.binary_search(a).is_ok() || extra.contains(a);
            let Some(part) = self.part(candidate, *atom) else { continue };
            if held(atom) {
                continue;
            }
            let heavy = transition.adds[..i].iter().any(|(other, _)| {
                other != atom
                    && !transition.before.contains(other)
                    && self.part(candidate, *other).is_some_and(|p| self.same_key(part, *atom, p, *other))
            });
            if heavy {
                return Some(None);
            }
            let balanced = transition.deletes.iter().any(|(gone, needs)| {
                held(gone)
                    && needs.iter().all(held)
                    && self.part(candidate, *gone).is_some_and(|p| self.same_key(part, *atom, p, *gone))
                    && !transition.adds.iter().any(|(added, _)| added == gone)
            });
            if !balanced {
                let arguments = self.names.arguments(*atom);
                let key = part.key.iter().map(|&p| arguments[p as usize]).collect();
                return Some(Some(Unbalanced { transition: index, add: i, key }));
            }
        }
        None
    }

    fn part<'c>(&self, candidate: &'c [Part], atom: u32) -> Option<&'c Part> {
        let predicate = self.names.predicate(atom);
        candidate.iter().find(|part| part.predicate == predicate)
    }

    fn same_key(&self, left: &Part, a: u32, right: &Part, b: u32) -> bool {
        let (a, b) = (self.names.arguments(a), self.names.arguments(b));
        left.key.iter().zip(&right.key).all(|(&l, &r)| a[l as usize] == b[r as usize])
    }

    /// Candidates extended by one more predicate, whose atom the unbalanced transition deletes; its
    /// key arguments are tried at every position where the objects fit.
    fn refine(&self, candidate: &[Part], unbalanced: &Unbalanced) -> Vec<Vec<Part>> {
        let transition = self.transitions.get(unbalanced.transition as usize);
        let extra = &transition.adds[unbalanced.add].1;
        let held = |a: &u32| transition.before.binary_search(a).is_ok() || extra.contains(a);
        let mut refined = Vec::new();
        for (gone, needs) in transition.deletes {
            let predicate = self.names.predicate(*gone);
            let known = candidate.iter().any(|part| part.predicate == predicate);
            if known || !held(gone) || !needs.iter().all(held) {
                continue;
            }
            let arguments = self.names.arguments(*gone);
            let counted = arguments.len().wrapping_sub(unbalanced.key.len());
            if arguments.len() < unbalanced.key.len() || (counted > 1 && predicate < self.first_token) {
                continue;
            }
            placements(&unbalanced.key, arguments, &mut Vec::new(), &mut |key| {
                let mut parts = candidate.to_vec();
                parts.push(Part { predicate, key: key.to_vec() });
                parts.sort();
                refined.push(parts);
            });
        }
        refined
    }
}

fn placements(key: &[u32], arguments: &[u32], chosen: &mut Vec<u8>, found: &mut dyn FnMut(&[u8])) {
    let Some(wanted) = key.get(chosen.len()) else {
        return found(chosen);
    };
    for (position, argument) in arguments.iter().enumerate() {
        if argument == wanted && !chosen.contains(&(position as u8)) {
            chosen.push(position as u8);
            placements(key, arguments, chosen, found);
            chosen.pop();
        }
    }
}

/// Groups of an invariant: for each key with exactly one initially true atom, all its atoms.
fn instances<N: AtomNames>(names: &N, atoms: &[u32], initial: &[u32], invariant: &[Part]) -> Vec<Vec<u32>> {
    let key_of = |atom: u32| {
        let predicate = names.predicate(atom);
        let part = invariant.iter().find(|part| part.predicate == predicate)?;
        let arguments = names.arguments(atom);
        Some(part.key.iter().map(|&p| arguments[p as usize]).collect::<Vec<u32>>())
    };
    let mut weights: FxHashMap<Vec<u32>, u32> = FxHashMap::default();
    for &atom in initial {
        if let Some(key) = key_of(atom) {
            *weights.entry(key).or_default() += 1;
        }
    }
    let mut places: FxHashMap<Vec<u32>, usize> = FxHashMap::default();
    let mut groups: Vec<Vec<u32>> = Vec::new();
    for &atom in atoms {
        let Some(key) = key_of(atom) else { continue };
        if weights.get(&key) != Some(&1) {
            continue;
        }
        let place = *places.entry(key).or_insert_with(|| {
            groups.push(Vec::new());
            groups.len() - 1
        });
        groups[place].push(atom);
    }
    groups
}
