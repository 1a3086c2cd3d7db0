//! Delete-relaxed reachability over the lifted task: rule bodies are joined once for every new atom
//! (semi-naive evaluation).
//!
//! A join continues with the body atom that has the fewest candidates under the present binding; a
//! body atom without candidates ends the branch at once.

use std::sync::Arc;

use crate::task::ObjectId;

use super::atoms::{Atoms, NONE};
use super::normal::{Formula, Pattern, Term};

/// Rule of the relaxed task: where the body holds, the head atoms are reachable.
pub(super) struct Rule {
    /// Objects of each slot.
    pub domains: Vec<Arc<[ObjectId]>>,
    pub body: Vec<Pattern>,
    /// Conditions that are no body atoms; tested once all slots are bound.
    pub filters: Vec<Formula>,
    /// Pairs of terms that must differ; tested as soon as both are bound.
    pub unequal: Vec<(Term, Term)>,
    /// Pairs of terms that must be equal; tested as soon as both are bound.
    pub equal: Vec<(Term, Term)>,
    /// Slots that must be bound, whether or not the body mentions them.
    pub slots: Vec<u32>,
    pub heads: Vec<Head>,
    /// Index of the list in [`Reach::instances`] that records the bindings of this rule, and the
    /// number of leading `slots` recorded.
    pub instance: Option<(u32, usize)>,
}

/// Atom that a rule makes reachable, for all objects of the `forall` slots.
pub(super) struct Head {
    pub forall: Vec<u32>,
    pub atom: Pattern,
}

/// Test of formulas by static facts.
pub(super) trait Possible {
    /// True unless static facts show that the formula is false under a complete binding.
    fn possible(
        &self,
        atoms: &Atoms,
        formula: &Formula,
        binding: &mut Vec<u32>,
        domains: &[Arc<[ObjectId]>],
    ) -> bool;

    /// True once stopped; results after that are invalid.
    fn is_stopped(&self) -> bool;
}

/// Error: the computation was stopped or exceeded its limit.
pub(super) struct Stopped;

/// Computation of the reachable atoms and action instances.
pub(super) struct Reach<'a, P: Possible> {
    pub atoms: Atoms,
    pub rules: &'a [Rule],
    /// True, by predicate, if effects or rules change its atoms.
    pub fluent: &'a [bool],
    pub possible: P,
    /// Bindings of each action's (then axiom alternative's) instances, in one flat list each.
    pub instances: Vec<Vec<u32>>,
    /// Maximum number of atoms and instances together.
    pub limit: usize,
    pub count: usize,
    /// Number of objects tried so far for slots that no body atom binds.
    pub tried: usize,
    pub stop: &'a (dyn Fn() -> bool + Sync),
}

/// Number of tried objects between two checks of the stop signal and the limit.
const TRIED_AT_ONCE: usize = 1 << 14;

/// State of one join.
struct Join<'r> {
    rule: &'r Rule,
    domains: &'r [Arc<[ObjectId]>],
    /// Objects that fit each slot, as a bit set; `None`: every object fits.
    fits: &'r [Option<Vec<u64>>],
    binding: Vec<u32>,
    trigger: u32,
    trigger_position: usize,
}

impl<P: Possible> Reach<'_, P> {
    /// Applies the rules until nothing new is reachable.
    pub(super) fn run(&mut self, objects: usize) -> Result<(), Stopped> {
        let rules = self.rules;
        let fits: Vec<Vec<Option<Vec<u64>>>> =
            rules.iter().map(|r| r.domains.iter().map(|d| bits_of(d, objects)).collect()).collect();
        let triggers = self.triggers();
        for (r, rule) in rules.iter().enumerate() {
            if rule.body.iter().all(|p| !self.fluent[p.predicate as usize]) {
                let mut join = self.start(r, &fits[r], NONE, usize::MAX);
                self.extend(&mut join, (1u64 << rule.body.len()) - 1)?;
            }
        }
        let mut next = 0;
        while next < self.atoms.len() {
            if next % 1024 == 0 && (self.stop)() {
                return Err(Stopped);
            }
            let atom = next as u32;
            let predicate = self.atoms.predicate(atom) as usize;
            for &(r, position) in &triggers[predicate] {
                let mut join = self.start(r, &fits[r], atom, position);
                let arguments = self.atoms.arguments(atom);
                if join.unify(&rules[r].body[position].terms, arguments, &mut Vec::new()) {
                    let rest = ((1u64 << rules[r].body.len()) - 1) & !(1 << position);
                    self.extend(&mut join, rest)?;
                }
            }
            next += 1;
        }
        Ok(())
    }

    /// Rules with an atom of a predicate in the body, each with the position of that atom, by
    /// predicate.
    fn triggers(&self) -> Vec<Vec<(usize, usize)>> {
        let mut triggers: Vec<Vec<(usize, usize)>> = vec![Vec::new(); self.fluent.len()];
        for (r, rule) in self.rules.iter().enumerate() {
            for (position, pattern) in rule.body.iter().enumerate() {
                if self.fluent[pattern.predicate as usize] {
                    triggers[pattern.predicate as usize].push((r, position));
                }
            }
        }
        triggers
    }

    fn start<'r>(
        &self,
        rule: usize,
        fits: &'r [Option<Vec<u64>>],
        trigger: u32,
        trigger_position: usize,
    ) -> Join<'r>
    where
        Self: 'r,
    {
        let rules: &'r [Rule] = self.rules;
        let domains = &rules[rule].domains[..];
        let binding = vec![NONE; domains.len()];
        Join { rule: &rules[rule], domains, fits, binding, trigger, trigger_position }
    }

    fn extend(&mut self, join: &mut Join<'_>, mut rest: u64) -> Result<(), Stopped> {
        if !join.consistent() {
            return Ok(());
        }
        let rule = join.rule;
        let mut best: Option<(u32, usize)> = None;
        let mut pattern = [NONE; 32];
        let mut left = rest;
        while left != 0 {
            let i = left.trailing_zeros() as usize;
            left &= left - 1;
            let body = &rule.body[i];
            let arity = body.terms.len();
            let bound = join.pattern(&body.terms, &mut pattern);
            if bound == arity {
                match self.atoms.find(body.predicate, &pattern[..arity]) {
                    Some(atom) if self.visible(join, i, atom) => rest &= !(1 << i),
                    _ => return Ok(()),
                }
                continue;
            }
            let count = self.atoms.count(body.predicate, &pattern[..arity]);
            if count == 0 {
                return Ok(());
            }
            if best.is_none_or(|(least, _)| count < least) {
                best = Some((count, i));
            }
        }
        match best {
            Some((_, i)) => self.branch(join, rest & !(1 << i), i),
            None => self.enumerate(join, 0),
        }
    }

    fn branch(&mut self, join: &mut Join<'_>, rest: u64, i: usize) -> Result<(), Stopped> {
        let rule = join.rule;
        let body = &rule.body[i];
        let mut pattern = [NONE; 32];
        join.pattern(&body.terms, &mut pattern);
        let (index, mut row) = self.atoms.first(body.predicate, &pattern[..body.terms.len()]);
        let mut bound = Vec::new();
        while row != NONE {
            let (atom, arguments) = self.atoms.row(body.predicate, row);
            if !self.visible(join, i, atom) {
                break;
            }
            bound.clear();
            if join.unify(&body.terms, arguments, &mut bound) {
                self.extend(join, rest)?;
            }
            for &slot in &bound {
                join.binding[slot as usize] = NONE;
            }
            row = self.atoms.next(body.predicate, index, row);
        }
        Ok(())
    }

    /// True if an atom may be matched at this position of the body. Atoms newer than the one that
    /// triggered the join are excluded, as is the trigger itself at earlier positions, so that each
    /// instance is found once.
    fn visible(&self, join: &Join<'_>, position: usize, atom: u32) -> bool {
        if !self.fluent[join.rule.body[position].predicate as usize] {
            return true;
        }
        if position < join.trigger_position { atom < join.trigger } else { atom <= join.trigger }
    }

    fn enumerate(&mut self, join: &mut Join<'_>, from: usize) -> Result<(), Stopped> {
        let rule = join.rule;
        let Some(at) = (from..rule.slots.len()).find(|&i| join.binding[rule.slots[i] as usize] == NONE)
        else {
            return self.fire(join);
        };
        let slot = rule.slots[at] as usize;
        for object in join.domains[slot].iter() {
            self.go_on()?;
            join.binding[slot] = object.0;
            if join.consistent() {
                self.enumerate(join, at + 1)?;
            }
        }
        join.binding[slot] = NONE;
        Ok(())
    }

    fn fire(&mut self, join: &mut Join<'_>) -> Result<(), Stopped> {
        let rule = join.rule;
        for filter in &rule.filters {
            let possible = self.possible.possible(&self.atoms, filter, &mut join.binding, join.domains);
            if self.possible.is_stopped() {
                return Err(Stopped);
            }
            if !possible {
                return Ok(());
            }
        }
        if let Some((action, arity)) = rule.instance {
            let list = &mut self.instances[action as usize];
            list.extend(rule.slots[..arity].iter().map(|&slot| join.binding[slot as usize]));
            self.count += 1;
        }
        for head in &rule.heads {
            self.head(join, head, 0)?;
        }
        if self.count + self.atoms.len() > self.limit || (self.count % 4096 == 1 && (self.stop)()) {
            return Err(Stopped);
        }
        Ok(())
    }

    fn head(&mut self, join: &mut Join<'_>, head: &Head, at: usize) -> Result<(), Stopped> {
        if at < head.forall.len() {
            let slot = head.forall[at] as usize;
            for object in join.domains[slot].iter() {
                self.go_on()?;
                join.binding[slot] = object.0;
                self.head(join, head, at + 1)?;
            }
            join.binding[slot] = NONE;
            return Ok(());
        }
        let mut arguments = [NONE; 32];
        let arity = join.pattern(&head.atom.terms, &mut arguments);
        self.atoms.insert(head.atom.predicate, &arguments[..arity]);
        Ok(())
    }

    /// Counts one more tried object; an error when stopped or beyond the limit.
    fn go_on(&mut self) -> Result<(), Stopped> {
        self.tried += 1;
        let asked = self.tried.is_multiple_of(TRIED_AT_ONCE);
        if asked && (self.count + self.atoms.len() > self.limit || (self.stop)()) {
            return Err(Stopped);
        }
        Ok(())
    }
}

impl Join<'_> {
    /// Writes the objects of the terms (`NONE` for unbound slots) to `out`; returns the number of
    /// bound ones.
    fn pattern(&self, terms: &[Term], out: &mut [u32; 32]) -> usize {
        let mut bound = 0;
        for (i, term) in terms.iter().enumerate() {
            out[i] = term.bound(&self.binding);
            bound += usize::from(out[i] != NONE);
        }
        bound
    }

    fn unify(&mut self, terms: &[Term], arguments: &[u32], bound: &mut Vec<u32>) -> bool {
        for (term, &argument) in terms.iter().zip(arguments) {
            match *term {
                Term::Object(object) if object == argument => {}
                Term::Object(_) => return false,
                Term::Slot(slot) => {
                    let held = self.binding[slot as usize];
                    if held != NONE {
                        if held != argument {
                            return false;
                        }
                        continue;
                    }
                    let fits = self.fits[slot as usize]
                        .as_ref()
                        .is_none_or(|bits| bits[argument as usize / 64] >> (argument % 64) & 1 == 1);
                    if !fits {
                        return false;
                    }
                    self.binding[slot as usize] = argument;
                    bound.push(slot);
                }
            }
        }
        true
    }

    fn consistent(&self) -> bool {
        let value = |t: Term| t.bound(&self.binding);
        self.rule.unequal.iter().all(|&(a, b)| value(a) != value(b) || value(a) == NONE)
            && self.rule.equal.iter().all(|&(a, b)| {
                let (a, b) = (value(a), value(b));
                a == b || a == NONE || b == NONE
            })
    }
}

fn bits_of(domain: &[ObjectId], objects: usize) -> Option<Vec<u64>> {
    if domain.len() == objects {
        return None;
    }
    let mut bits = vec![0u64; objects.div_ceil(64)];
    for object in domain {
        bits[object.index() / 64] |= 1 << (object.0 % 64);
    }
    Some(bits)
}
