//! Delete-relaxed reachability of the ground task, and removal of its unreachable parts.

use crate::grouped::Grouped;

use super::instantiate::{Clauses, Deed, RawCall, RawEffect};
use super::raw::{RawAction, RawTask};

/// Atoms that are reachable, and atoms that may be false.
pub(super) struct Reached {
    /// True, by atom, if the atom is reachable.
    pub atoms: Vec<bool>,
    /// True, by atom, if the atom is false initially or some effect may delete it.
    pub absent: Vec<bool>,
}

/// Relaxed operator with one effect: the atom `reaches` is reached once no condition is missing.
struct Unary {
    missing: u32,
    reaches: u32,
}

struct Fixpoint {
    unary: Vec<Unary>,
    /// Pairs of an atom and an operator that needs it. Atom numbers beyond the task's mean "this
    /// action was started".
    waits: Vec<(u32, u32)>,
    /// Buffer for the conditions of the operator that is being added.
    wanted: Vec<u32>,
}

impl Fixpoint {
    fn add<'c>(&mut self, conditions: impl Iterator<Item = &'c Clauses>, extra: Option<u32>, reaches: u32) {
        let positive = conditions.flat_map(|c| &c.literals).filter(|&&l| l & 1 == 0).map(|l| l >> 1);
        let wanted = &mut self.wanted;
        wanted.clear();
        wanted.extend(positive.chain(extra));
        wanted.sort_unstable();
        wanted.dedup();
        let id = self.unary.len() as u32;
        self.waits.extend(wanted.iter().map(|&atom| (atom, id)));
        self.unary.push(Unary { missing: wanted.len() as u32, reaches });
    }

    fn effect(&mut self, base: &[&Clauses], effect: &RawEffect, started: u32, calls: &[RawCall]) {
        let mut add = |atom| {
            let when = effect.when.iter().flat_map(|w| w.iter());
            self.add(base.iter().copied().chain(when), Some(started), atom);
        };
        match effect.deed {
            Deed::Add(atom) => add(atom),
            Deed::Call(call) => calls[call as usize].atoms().for_each(add),
            Deed::Delete(_) | Deed::Change(..) => {}
        }
    }

    fn run(mut self, init: &[bool], count: usize) -> Vec<bool> {
        let mut reached = vec![false; count];
        let waits = Grouped::new(count, self.waits.iter().copied());
        let mut queue: Vec<u32> = Vec::new();
        let reach = |atom: u32, queue: &mut Vec<u32>, reached: &mut Vec<bool>| {
            if !std::mem::replace(&mut reached[atom as usize], true) {
                queue.push(atom);
            }
        };
        for (atom, _) in init.iter().enumerate().filter(|&(_, &there)| there) {
            reach(atom as u32, &mut queue, &mut reached);
        }
        for unary in &self.unary {
            if unary.missing == 0 {
                reach(unary.reaches, &mut queue, &mut reached);
            }
        }
        while let Some(atom) = queue.pop() {
            for &id in waits.of(atom) {
                let unary = &mut self.unary[id as usize];
                unary.missing -= 1;
                if unary.missing == 0 {
                    reach(unary.reaches, &mut queue, &mut reached);
                }
            }
        }
        reached
    }
}

/// Removes actions, effects and axioms with unreachable conditions, and conditions that an
/// unreachable atom is false. Returns which atoms are reachable and which may be false.
pub(super) fn prune(task: &mut RawTask, calls: &[RawCall]) -> Reached {
    let count = task.init.len();
    let mut fixpoint = Fixpoint { unary: Vec::new(), waits: Vec::new(), wanted: Vec::new() };
    for (index, action) in task.actions.iter().enumerate() {
        let started = (count + index) as u32;
        fixpoint.add(std::iter::once(&action.start), None, started);
        for effect in &action.effects {
            fixpoint.effect(&[], effect, started, calls);
        }
        if let Some(later) = &action.later {
            for effect in &later.end_effects {
                fixpoint.effect(&[&later.over_all, &later.end], effect, started, calls);
            }
        }
    }
    for axiom in &task.axioms {
        fixpoint.add(std::iter::once(&axiom.body), None, axiom.head);
    }
    let mut init = task.init.clone();
    for (_, deeds) in &task.timed {
        for deed in deeds {
            if let Deed::Add(atom) = deed {
                init[*atom as usize] = true;
            }
        }
    }
    let mut atoms = fixpoint.run(&init, count + task.actions.len());
    task.actions.retain({
        let mut index = 0;
        let atoms = &atoms;
        move |action| {
            index += 1;
            let later = action.later.as_ref();
            atoms[count + index - 1]
                && later.is_none_or(|l| possible(&l.over_all, atoms) && possible(&l.end, atoms))
        }
    });
    atoms.truncate(count);
    task.axioms.retain(|axiom| possible(&axiom.body, &atoms));
    let mut absent: Vec<bool> = task.init.iter().map(|there| !there).collect();
    calls.iter().flat_map(RawCall::atoms).for_each(|a| absent[a as usize] = true);
    simplify(task, &atoms, &mut absent);
    Reached { atoms, absent }
}

fn possible(clauses: &Clauses, reached: &[bool]) -> bool {
    clauses.literals.iter().all(|&l| l & 1 == 1 || reached[(l >> 1) as usize])
}

fn simplify(task: &mut RawTask, reached: &[bool], absent: &mut [bool]) {
    let drop = |clauses: &mut Clauses| {
        clauses.literals.retain(|&l| l & 1 == 0 || reached[(l >> 1) as usize]);
    };
    let effects = |list: &mut Vec<RawEffect>, absent: &mut [bool]| {
        list.retain_mut(|effect| {
            if let Some(when) = &mut effect.when {
                if !when.iter().all(|c| possible(c, reached)) {
                    return false;
                }
                when.iter_mut().for_each(drop);
                if when.iter().all(Clauses::is_true) {
                    effect.when = None;
                }
            }
            match effect.deed {
                Deed::Delete(atom) => {
                    absent[atom as usize] = true;
                    reached[atom as usize]
                }
                _ => true,
            }
        });
    };
    for RawAction { start, effects: at_start, later, .. } in &mut task.actions {
        drop(start);
        effects(at_start, absent);
        if let Some(later) = later {
            drop(&mut later.over_all);
            drop(&mut later.end);
            effects(&mut later.end_effects, absent);
        }
    }
    for axiom in &mut task.axioms {
        drop(&mut axiom.body);
    }
    drop(&mut task.goal);
    for (_, deeds) in &task.timed {
        for deed in deeds {
            if let Deed::Delete(atom) = deed {
                absent[*atom as usize] = true;
            }
        }
    }
}
