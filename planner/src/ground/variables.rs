//! Grouping of atoms into finite-domain variables, and translation of conditions and effects to
//! these.

use super::instantiate::{Clauses, Deed, RawEffect};
use super::task::{Conjunction, GroundEffect, GroundFact, GroundOutcome, GroundWhen, Variable};

/// Marks an atom that is no value of a variable.
const NOWHERE: GroundFact = GroundFact { variable: u32::MAX, value: 0 };

/// Encoding of atoms as values of variables.
pub(super) struct Encoding {
    /// Variable and value of each atom; `NOWHERE` for static and irrelevant atoms.
    facts: Vec<GroundFact>,
    /// Fact that is equivalent to the atom being false, by atom; `None` if no single fact is.
    absent: Vec<Option<GroundFact>>,
    /// Extra two-valued variable of an atom (value 0 true, 1 false), which makes its absence a
    /// single fact; `None` if it has none.
    doubles: Vec<Option<u32>>,
    /// True, by variable, if one of its atoms also has an extra variable.
    doubled: Vec<bool>,
    /// Value that means "none of these atoms", by variable.
    none: Vec<Option<u32>>,
    /// True, by atom, if it holds in every reachable state.
    always: Vec<bool>,
    /// Atoms of each variable, by value.
    pub atoms: Vec<Vec<u32>>,
    /// Number of variables for object functions; these come first.
    objects: usize,
}

/// Input of the choice of variables.
pub(super) struct Choice<'a> {
    /// True, by atom, if the atom needs a variable.
    pub carried: &'a [bool],
    /// True, by atom, if the atom holds in every reachable state.
    pub always: Vec<bool>,
    /// Mutex groups of atoms.
    pub groups: &'a [Vec<u32>],
    /// Groups that must become one variable each (object functions).
    pub fixed: &'a [Vec<u32>],
    /// True, by atom, if some condition requires the atom to be false.
    pub unwanted: &'a [bool],
    /// Axiom stratum of derived atoms, each of which gets a variable of its own after all others;
    /// `None` for other atoms.
    pub derived: &'a [Option<u32>],
}

/// Chooses the variables: first the fixed groups, then repeatedly the mutex group with the most
/// atoms that have no variable yet.
pub(super) fn encode(choice: Choice<'_>) -> Encoding {
    let count = choice.carried.len();
    let mut covered: Vec<bool> = choice.carried.iter().map(|c| !c).collect();
    for (atom, stratum) in choice.derived.iter().enumerate() {
        covered[atom] |= stratum.is_some();
    }
    let mut chosen: Vec<Vec<u32>> = Vec::new();
    let mut take = |group: &[u32], covered: &mut [bool]| {
        let atoms: Vec<u32> = group.iter().copied().filter(|&a| !covered[a as usize]).collect();
        atoms.iter().for_each(|&a| covered[a as usize] = true);
        if !atoms.is_empty() {
            chosen.push(atoms);
        }
    };
    let objects = choice.fixed.iter().filter(|group| group.iter().any(|&a| !covered[a as usize])).count();
    choice.fixed.iter().for_each(|group| take(group, &mut covered));
    let left = |group: &[u32], covered: &[bool]| group.iter().filter(|&&a| !covered[a as usize]).count();
    let mut heap: std::collections::BinaryHeap<(usize, std::cmp::Reverse<usize>)> = choice
        .groups
        .iter()
        .enumerate()
        .map(|(i, group)| (left(group, &covered), std::cmp::Reverse(i)))
        .collect();
    while let Some((size, std::cmp::Reverse(i))) = heap.pop() {
        let now = left(&choice.groups[i], &covered);
        if now < 2 {
            continue;
        }
        if now < size {
            heap.push((now, std::cmp::Reverse(i)));
            continue;
        }
        take(&choice.groups[i], &mut covered);
    }
    for atom in 0..count as u32 {
        take(&[atom], &mut covered);
    }
    let mut order: Vec<u32> = (0..count as u32)
        .filter(|&a| choice.carried[a as usize] && choice.derived[a as usize].is_some())
        .collect();
    order.sort_by_key(|&a| (choice.derived[a as usize], a));
    let plain = chosen.len();
    chosen.extend(order.into_iter().map(|a| vec![a]));
    place(choice, chosen, objects, plain)
}

fn place(choice: Choice<'_>, mut chosen: Vec<Vec<u32>>, objects: usize, plain: usize) -> Encoding {
    let count = choice.carried.len();
    let wants_double = |group: &[u32], a: u32| group.len() > 1 && choice.unwanted[a as usize];
    let doubled: Vec<u32> =
        chosen[..plain].iter().flat_map(|g| g.iter().copied().filter(move |&a| wants_double(g, a))).collect();
    let mut encoding = Encoding {
        facts: vec![NOWHERE; count],
        absent: vec![None; count],
        doubles: vec![None; count],
        doubled: Vec::new(),
        none: Vec::new(),
        always: choice.always,
        atoms: Vec::new(),
        objects,
    };
    let derived: Vec<Vec<u32>> = chosen.split_off(plain);
    for group in chosen {
        encoding.add(group);
    }
    for &atom in &doubled {
        let variable = encoding.atoms.len() as u32;
        encoding.atoms.push(vec![atom]);
        encoding.none.push(Some(1));
        encoding.doubles[atom as usize] = Some(variable);
        encoding.doubled.push(false);
        let shared = encoding.facts[atom as usize].variable as usize;
        encoding.doubled[shared] = true;
        encoding.absent[atom as usize] = Some(GroundFact { variable, value: 1 });
    }
    for group in derived {
        encoding.add(group);
    }
    encoding
}

impl Encoding {
    fn add(&mut self, group: Vec<u32>) {
        let variable = self.atoms.len() as u32;
        let none = group.len() as u32;
        for (value, &atom) in group.iter().enumerate() {
            self.facts[atom as usize] = GroundFact { variable, value: value as u32 };
        }
        if let [atom] = group[..] {
            self.absent[atom as usize] = Some(GroundFact { variable, value: 1 });
        }
        self.none.push(Some(none));
        self.doubled.push(false);
        self.atoms.push(group);
    }

    /// Variable and value of an atom; `None` if the atom has no variable.
    pub(super) fn fact(&self, atom: u32) -> Option<GroundFact> {
        let fact = self.facts[atom as usize];
        (fact != NOWHERE).then_some(fact)
    }

    /// Translates a condition without disjunctions to facts; `None` if it can never hold.
    pub(super) fn conjunction(&self, clauses: &Clauses) -> Option<Conjunction> {
        let mut facts = Vec::with_capacity(clauses.literals.len());
        for &literal in &clauses.literals {
            let atom = literal >> 1;
            if literal & 1 == 0 {
                if !self.always[atom as usize] {
                    facts.push(self.fact(atom)?);
                }
            } else if self.always[atom as usize] {
                return None;
            } else if self.facts[atom as usize] != NOWHERE {
                facts.push(self.absent[atom as usize]?);
            }
        }
        facts.sort_unstable();
        facts.dedup();
        if facts.windows(2).any(|pair| pair[0].variable == pair[1].variable) {
            return None;
        }
        Some(Conjunction { facts, comparisons: clauses.comparisons.clone(), calls: clauses.calls.clone() })
    }

    /// Translates effects to variables, deletes first. `before`: conditions that hold before the
    /// effects.
    pub(super) fn effects(&self, effects: &[RawEffect], before: &[&Conjunction]) -> Vec<GroundEffect> {
        let mut all = Vec::with_capacity(effects.len());
        for effect in effects {
            match &effect.deed {
                Deed::Delete(atom) => self.delete(*atom, effect, effects, before, &mut all),
                Deed::Add(atom) => self.replace(*atom, effect, &mut all),
                Deed::Change(..) | Deed::Call(_) => {}
            }
        }
        for effect in effects {
            match &effect.deed {
                Deed::Delete(_) => {}
                Deed::Add(atom) => {
                    let double =
                        self.doubles[*atom as usize].map(|variable| GroundFact { variable, value: 0 });
                    for fact in self.fact(*atom).into_iter().chain(double) {
                        self.push(effect, None, GroundOutcome::Set(fact), &mut all);
                    }
                }
                Deed::Change(fluent, change, amount) => {
                    let amount = (**amount).clone();
                    let outcome = GroundOutcome::Change { fluent: *fluent, change: *change, amount };
                    self.push(effect, None, outcome, &mut all);
                }
                Deed::Call(call) => self.push(effect, None, GroundOutcome::Call(*call), &mut all),
            }
        }
        all
    }

    /// Adds the deletes that an added atom implies for extra variables: the atom replaces the other
    /// values of its variable, whose extra variables become false.
    fn replace(&self, atom: u32, effect: &RawEffect, out: &mut Vec<GroundEffect>) {
        let variable = self.fact(atom).map(|fact| fact.variable as usize);
        let Some(variable) = variable.filter(|&variable| self.doubled[variable]) else { return };
        for &other in self.atoms[variable].iter().filter(|&&other| other != atom) {
            if let Some(variable) = self.doubles[other as usize] {
                self.push(effect, None, GroundOutcome::Set(GroundFact { variable, value: 1 }), out);
            }
        }
    }

    fn delete(
        &self,
        atom: u32,
        effect: &RawEffect,
        all: &[RawEffect],
        before: &[&Conjunction],
        out: &mut Vec<GroundEffect>,
    ) {
        if let Some(fact) = self.fact(atom).filter(|fact| (fact.variable as usize) < self.objects) {
            return self.unset(atom, fact, effect, out);
        }
        let added_again = all.iter().any(|other| {
            matches!(other.deed, Deed::Add(a) if a == atom)
                && (other.when.is_none() || other.when == effect.when)
        });
        if added_again {
            return;
        }
        if let Some(variable) = self.doubles[atom as usize] {
            self.push(effect, None, GroundOutcome::Set(GroundFact { variable, value: 1 }), out);
        }
        let Some(fact) = self.fact(atom) else { return };
        let Some(none) = self.none[fact.variable as usize] else { return };
        let replaced = all.iter().any(|other| {
            matches!(other.deed, Deed::Add(a) if self.facts[a as usize].variable == fact.variable)
                && (other.when.is_none() || other.when == effect.when)
        });
        if replaced {
            return;
        }
        let known = before.iter().any(|c| c.facts.binary_search(&fact).is_ok());
        let alone = self.atoms[fact.variable as usize].len() == 1;
        let extra = if known || alone { None } else { Some(fact) };
        self.push(
            effect,
            extra,
            GroundOutcome::Set(GroundFact { variable: fact.variable, value: none }),
            out,
        );
    }

    /// Adds the effects of an object function losing this value: it becomes undefined, which
    /// contradicts a simultaneous assignment of a value.
    fn unset(&self, atom: u32, fact: GroundFact, effect: &RawEffect, out: &mut Vec<GroundEffect>) {
        if let Some(variable) = self.doubles[atom as usize] {
            self.push(effect, None, GroundOutcome::Set(GroundFact { variable, value: 1 }), out);
        }
        let none = self.none[fact.variable as usize].filter(|_| fact.value == 0);
        if let Some(value) = none {
            self.push(effect, None, GroundOutcome::Set(GroundFact { variable: fact.variable, value }), out);
        }
    }

    fn push(
        &self,
        effect: &RawEffect,
        extra: Option<GroundFact>,
        outcome: GroundOutcome,
        out: &mut Vec<GroundEffect>,
    ) {
        let mut when = GroundWhen::default();
        if let Some(parts) = &effect.when {
            let [here, at_start, over_all] = &**parts;
            let all = (self.conjunction(here), self.conjunction(at_start), self.conjunction(over_all));
            let (Some(here), Some(at_start), Some(over_all)) = all else { return };
            when = GroundWhen { here, at_start, over_all };
        }
        if let Some(fact) = extra {
            if when.here.facts.iter().any(|f| f.variable == fact.variable && *f != fact) {
                return;
            }
            if let Err(place) = when.here.facts.binary_search(&fact) {
                when.here.facts.insert(place, fact);
            }
        }
        let always = when.here.is_empty() && when.at_start.is_empty() && when.over_all.is_empty();
        out.push(GroundEffect { when: if always { None } else { Some(Box::new(when)) }, outcome });
    }

    /// Initial value of a variable.
    pub(super) fn initial(&self, variable: usize, init: &[bool]) -> u32 {
        let atoms = &self.atoms[variable];
        atoms.iter().position(|&a| init[a as usize]).unwrap_or(atoms.len()) as u32
    }
}

/// True, by variable, if its value "none of these atoms" must be kept: the variable begins with it,
/// or has one atom only.
pub(super) fn used_none(variables: &[Variable], initial: &[u32]) -> Vec<bool> {
    variables.iter().zip(initial).map(|(v, &i)| v.values.len() <= 2 || i + 1 == v.domain_size()).collect()
}

/// Marks the variable of an effect that sets it to "none of these atoms".
pub(super) fn mark_none(variables: &[Variable], effect: &GroundEffect, used: &mut [bool]) {
    if let GroundOutcome::Set(fact) = effect.outcome {
        let variable = fact.variable as usize;
        used[variable] |= fact.value + 1 == variables[variable].domain_size();
    }
}

/// Removes the value "none of these atoms" from variables that never take it.
pub(super) fn drop_none(variables: &mut [Variable], used: &[bool]) {
    for (variable, used) in variables.iter_mut().zip(used) {
        if !used {
            variable.values.pop();
        }
    }
}
