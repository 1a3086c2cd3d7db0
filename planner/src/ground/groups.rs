//! Groups of atoms that may share a variable: mutex groups found by invariant synthesis, and the
//! values of object functions.

use rustc_hash::FxHashMap;
use tracing::debug_span;

use super::invariants::{AtomNames, Transitions, mutex_groups};
use crate::task::Task;

use super::atoms::Atoms;
use super::instantiate::{Clauses, Deed, Instantiate, RawEffect};
use super::normal::{self, Normal, Target};
use super::raw::RawTask;
use super::relaxed;
use super::rules::Rules;

/// Predicates and arguments of atoms, and of the tokens that stand for "this durative action is
/// running".
struct Names<'a> {
    atoms: &'a Atoms,
    /// Number of the first token; smaller numbers are atoms.
    first: u32,
    first_token: u32,
    tokens: Vec<(u32, &'a [u32])>,
}

impl AtomNames for Names<'_> {
    fn predicate(&self, atom: u32) -> u32 {
        if atom < self.first {
            return self.atoms.predicate(atom);
        }
        self.first_token + self.tokens[(atom - self.first) as usize].0
    }

    fn arguments(&self, atom: u32) -> &[u32] {
        if atom < self.first {
            return self.atoms.arguments(atom);
        }
        self.tokens[(atom - self.first) as usize].1
    }
}

/// Mutex groups found by synthesis, and the groups (values of an object function) that must share a
/// variable.
pub(super) struct Groups {
    pub found: Vec<Vec<u32>>,
    pub fixed: Vec<Vec<u32>>,
}

pub(super) fn groups(
    raw: &RawTask,
    make: &Instantiate<'_>,
    reached: &relaxed::Reached,
    rules: &Rules,
    normal: &Normal,
    task: &Task,
    stop: &dyn Fn() -> bool,
) -> Groups {
    let _span = debug_span!("invariants").entered();
    let functions = task.predicates.len() as u32;
    let live: Vec<u32> = (0..raw.inner)
        .filter(|&a| reached.atoms[a as usize] && rules.fluent[make.atoms.predicate(a) as usize])
        .filter(|&a| (make.atoms.predicate(a) as usize) < normal.predicate_count)
        .collect();
    let mut fixed: FxHashMap<Vec<u32>, usize> = FxHashMap::default();
    let mut fixed_groups: Vec<Vec<u32>> = Vec::new();
    for &atom in live.iter().filter(|&&a| make.atoms.predicate(a) >= functions) {
        let arguments = make.atoms.arguments(atom);
        let mut key = vec![make.atoms.predicate(atom)];
        key.extend(&arguments[..arguments.len() - 1]);
        let place = *fixed.entry(key).or_insert_with(|| {
            fixed_groups.push(Vec::new());
            fixed_groups.len() - 1
        });
        fixed_groups[place].push(atom);
    }
    let first = raw.init.len() as u32;
    let first_token = rules.fluent.len() as u32;
    let durative: Vec<usize> = (0..raw.actions.len()).filter(|&i| raw.actions[i].later.is_some()).collect();
    let tokens = durative.iter().map(|&i| (raw.actions[i].schema, &raw.actions[i].arguments[..])).collect();
    let names = Names { atoms: &make.atoms, first, first_token, tokens };
    let transitions = transitions(raw, first);
    let by_module: Vec<u32> = (0..task.modules.len() as u32)
        .flat_map(|module| normal::module_writes(task, module))
        .filter_map(|target| if let Target::Truth(pattern) = target { Some(pattern.predicate) } else { None })
        .collect();
    let plain: Vec<u32> = live
        .iter()
        .copied()
        .filter(|&a| {
            let predicate = make.atoms.predicate(a);
            !by_module.contains(&predicate)
                && predicate < functions
                && task.predicates[predicate as usize].stratum.is_none()
        })
        .collect();
    let mut predicates: Vec<(u32, usize)> =
        plain.iter().map(|&a| (make.atoms.predicate(a), make.atoms.arguments(a).len())).collect();
    predicates.sort_unstable();
    predicates.dedup();
    let initial: Vec<u32> = plain.iter().copied().filter(|&a| raw.init[a as usize]).collect();
    let found = mutex_groups(&names, &plain, &initial, &transitions, &predicates, first_token, stop);
    Groups { found, fixed: fixed_groups }
}

/// Transitions of all instantaneous actions, action starts, action ends and timed effects. Tokens
/// of durative actions are numbered from `token`.
fn transitions(raw: &RawTask, mut token: u32) -> Transitions {
    let mut all = Transitions::default();
    for action in &raw.actions {
        transition(&[&action.start], &action.effects, raw.inner, &mut all);
        if let Some(later) = &action.later {
            all.adds(token, Vec::new());
            all.close();
            transition(&[&later.over_all, &later.end], &later.end_effects, raw.inner, &mut all);
            all.before(token);
            all.deletes(token, Vec::new());
            token += 1;
        }
        all.close();
    }
    for (_, deeds) in &raw.timed {
        for deed in deeds {
            if let Deed::Add(atom) = deed {
                all.adds(*atom, Vec::new());
            }
        }
        all.close();
    }
    all
}

/// Adds an action's start or end to the open transition. Deletes whose conditions are not plain
/// atoms are left out, since they may not happen.
fn transition(before: &[&Clauses], effects: &[RawEffect], inner: u32, into: &mut Transitions) {
    let positive = |c: &Clauses| {
        let literals = c.literals.iter().filter(|&&l| l & 1 == 0);
        literals.map(|&l| l >> 1).collect::<Vec<_>>()
    };
    for clauses in before {
        clauses.literals.iter().filter(|&&l| l & 1 == 0).for_each(|&l| into.before(l >> 1));
    }
    for effect in effects {
        let when = effect.when.as_deref();
        match effect.deed {
            Deed::Add(atom) => into.adds(atom, when.map_or_else(Vec::new, |w| positive(&w[0]))),
            Deed::Delete(atom) => {
                let plain = |c: &Clauses| {
                    c.comparisons.is_empty()
                        && c.calls.is_empty()
                        && c.literals.iter().all(|l| l & 1 == 0 && l >> 1 < inner)
                };
                match when {
                    None => into.deletes(atom, Vec::new()),
                    Some(w) if plain(&w[0]) && w[1].is_true() && w[2].is_true() => {
                        into.deletes(atom, positive(&w[0]));
                    }
                    Some(_) => {}
                }
            }
            Deed::Change(..) | Deed::Call(_) => {}
        }
    }
}
