//! Derived facts: the least fixpoint of the rules, stratum by stratum.
//!
//! Rule bodies are evaluated as joins: variables are bound by matching true atoms where possible; all
//! objects of a type are tried only for variables that no atom or equation binds.

use std::sync::Arc;

use super::{Binding, CallFailure, Semantics, UNBOUND};
use crate::state::State;
use crate::task::{Atom, Condition, Expression, Fluent, ObjectId, Rule, Slot, Term};

impl Semantics<'_> {
    /// Recomputes the derived facts of a state.
    pub fn derive(&self, state: &mut State) -> Result<(), CallFailure> {
        let rules = &self.task.rules;
        for rule in rules {
            state.clear_predicate(rule.predicate);
        }
        let stratum = |rule: &Rule| self.task.predicate(rule.predicate).stratum;
        for rules in rules.chunk_by(|one, other| stratum(one) == stratum(other)) {
            let mut changed = true;
            while changed {
                changed = false;
                for rule in rules {
                    let mut heads: Vec<Vec<ObjectId>> = Vec::new();
                    Join::new(self, state, rule).run(vec![&rule.body], &mut heads)?;
                    let before = state.count(rule.predicate);
                    for head in heads {
                        state.set_fact(rule.predicate, &head, true);
                    }
                    changed |= state.count(rule.predicate) > before;
                }
                // A single rule that does not use itself is done after one round.
                changed &= rules.len() > 1 || rules.iter().any(|rule| mentions(&rule.body, rule));
            }
        }
        Ok(())
    }
}

/// State of the join over one rule's body.
struct Join<'j, 'a> {
    semantics: &'j Semantics<'a>,
    state: &'j State,
    rule: &'j Rule,
    binding: Binding,
    /// Objects that fit each slot; `None` for a slot not yet in scope.
    domains: Vec<Option<Arc<[ObjectId]>>>,
}

impl<'j, 'a> Join<'j, 'a> {
    fn new(semantics: &'j Semantics<'a>, state: &'j State, rule: &'j Rule) -> Self {
        let mut domains: Vec<Option<Arc<[ObjectId]>>> = vec![None; rule.slots];
        for (domain, parameter) in domains.iter_mut().zip(&rule.parameters) {
            *domain = Some(parameter.objects.clone());
        }
        Join { semantics, state, rule, binding: Binding::new(rule.slots), domains }
    }

    /// Appends the arguments of all heads for which every condition in `open` holds.
    fn run(
        &mut self,
        mut open: Vec<&'j Condition>,
        heads: &mut Vec<Vec<ObjectId>>,
    ) -> Result<(), CallFailure> {
        let mut next = 0;
        while next < open.len() {
            match open[next] {
                Condition::And(parts) => {
                    open.swap_remove(next);
                    open.extend(parts);
                }
                Condition::Exists(variables, inner) => {
                    if variables.iter().any(|variable| variable.parameter.objects.is_empty()) {
                        return Ok(());
                    }
                    for variable in variables {
                        self.binding.set(variable.slot, UNBOUND);
                        self.domains[variable.slot.index()] = Some(variable.parameter.objects.clone());
                    }
                    open[next] = inner;
                }
                condition if self.is_bound(condition) => {
                    if !self.semantics.holds(self.state, condition, &mut self.binding)? {
                        return Ok(());
                    }
                    open.swap_remove(next);
                }
                _ => next += 1,
            }
        }
        if let Some(at) = self.best_atom(&open) {
            let Condition::Atom(atom) = open.swap_remove(at) else { return Ok(()) };
            return self.join(atom, &open, heads);
        }
        if let Some((at, slot, object)) = self.equation(&open) {
            open.swap_remove(at);
            return match object {
                Some(object) => self.try_object(slot, object, &open, heads),
                None => Ok(()),
            };
        }
        if let Some(at) = open.iter().position(|condition| matches!(condition, Condition::Or(_))) {
            let Condition::Or(parts) = open.swap_remove(at) else { return Ok(()) };
            for part in parts {
                let mut open = open.clone();
                open.push(part);
                self.run(open, heads)?;
            }
            return Ok(());
        }
        let Some(slot) = self.unbound_slot(&open) else {
            heads.push(self.binding.objects[..self.rule.parameters.len()].to_vec());
            return Ok(());
        };
        let Some(domain) = self.domains[slot.index()].clone() else { return Ok(()) };
        for &object in domain.iter() {
            self.try_object(slot, object, &open, heads)?;
        }
        Ok(())
    }

    /// Binds a slot to an object, continues the join, then unbinds the slot.
    fn try_object(
        &mut self,
        slot: Slot,
        object: ObjectId,
        open: &[&'j Condition],
        heads: &mut Vec<Vec<ObjectId>>,
    ) -> Result<(), CallFailure> {
        let before = self.binding.objects.clone();
        if self.fits(slot, object) {
            self.binding.set(slot, object);
            self.run(open.to_vec(), heads)?;
        }
        self.binding.objects = before;
        Ok(())
    }

    fn fits(&self, slot: Slot, object: ObjectId) -> bool {
        let domain = self.domains.get(slot.index()).and_then(Option::as_ref);
        domain.is_some_and(|domain| domain.binary_search(&object).is_ok())
    }

    /// Matches an atom with each true instance, continuing the join with its variables bound.
    fn join(
        &mut self,
        atom: &'j Atom,
        open: &[&'j Condition],
        heads: &mut Vec<Vec<ObjectId>>,
    ) -> Result<(), CallFailure> {
        let state = self.state;
        let before = self.binding.objects.clone();
        for instance in state.instances(atom.predicate) {
            let matched = atom.arguments.iter().zip(instance).all(|(term, &object)| match term {
                Term::Variable(slot) if self.binding.get(*slot) == UNBOUND => {
                    let fits = self.fits(*slot, object);
                    self.binding.set(*slot, object);
                    fits
                }
                Term::Variable(slot) => self.binding.get(*slot) == object,
                term => self.semantics.object(state, term, &self.binding) == Some(object),
            });
            if matched {
                self.run(open.to_vec(), heads)?;
            }
            self.binding.objects.clone_from(&before);
        }
        Ok(())
    }

    /// Index of the open atom whose predicate has the fewest true instances; `None` if no atom can be
    /// matched yet.
    fn best_atom(&self, open: &[&Condition]) -> Option<usize> {
        let joinable = |condition: &Condition| match condition {
            Condition::Atom(atom) => {
                let plain = atom
                    .arguments
                    .iter()
                    .all(|term| matches!(term, Term::Variable(_)) || self.is_bound_term(term));
                plain.then(|| self.state.count(atom.predicate))
            }
            _ => None,
        };
        let counts = open.iter().enumerate().filter_map(|(at, condition)| Some((joinable(condition)?, at)));
        counts.min().map(|(_, at)| at)
    }

    /// Equation between an unbound variable and a term with bound variables: its index, the variable's
    /// slot and the term's object (`None` if undefined).
    fn equation(&self, open: &[&Condition]) -> Option<(usize, Slot, Option<ObjectId>)> {
        open.iter().enumerate().find_map(|(at, condition)| {
            let Condition::Same(terms, _) = condition else { return None };
            let [left, right] = &**terms;
            let solve = |variable: &Term, value: &Term| match variable {
                Term::Variable(slot) if self.binding.get(*slot) == UNBOUND && self.is_bound_term(value) => {
                    Some((at, *slot, self.semantics.object(self.state, value, &self.binding)))
                }
                _ => None,
            };
            solve(left, right).or_else(|| solve(right, left))
        })
    }

    /// First unbound variable in an open condition or the head; `None` if all are bound.
    fn unbound_slot(&self, open: &[&Condition]) -> Option<Slot> {
        let mut found = None;
        for condition in open {
            self.slots_in(condition, &mut Vec::new(), &mut |slot| {
                if self.binding.get(slot) == UNBOUND && found.is_none() {
                    found = Some(slot);
                }
            });
        }
        let head = (0..self.rule.parameters.len()).map(|slot| Slot(slot as u32));
        found.or_else(|| head.into_iter().find(|&slot| self.binding.get(slot) == UNBOUND))
    }

    fn is_bound(&self, condition: &Condition) -> bool {
        let mut bound = true;
        self.slots_in(condition, &mut Vec::new(), &mut |slot| bound &= self.binding.get(slot) != UNBOUND);
        bound
    }

    fn is_bound_term(&self, term: &Term) -> bool {
        let mut bound = true;
        term_slots(term, &mut |slot| bound &= self.binding.get(slot) != UNBOUND);
        bound
    }

    /// Reports the free variables of a condition to `found`; `inner` are variables bound by quantifiers
    /// around it.
    fn slots_in(&self, condition: &Condition, inner: &mut Vec<Slot>, found: &mut dyn FnMut(Slot)) {
        match condition {
            Condition::And(parts) | Condition::Or(parts) => {
                parts.iter().for_each(|part| self.slots_in(part, inner, found));
            }
            Condition::Not(part) => self.slots_in(part, inner, found),
            Condition::Forall(variables, part) | Condition::Exists(variables, part) => {
                let before = inner.len();
                inner.extend(variables.iter().map(|variable| variable.slot));
                self.slots_in(part, inner, found);
                inner.truncate(before);
            }
            leaf => leaf_slots(leaf, &mut |slot| {
                if !inner.contains(&slot) {
                    found(slot);
                }
            }),
        }
    }
}

fn leaf_slots(leaf: &Condition, found: &mut dyn FnMut(Slot)) {
    match leaf {
        Condition::Atom(Atom { arguments, .. }) => arguments.iter().for_each(|term| term_slots(term, found)),
        Condition::Call(call) => call.arguments.iter().for_each(|term| term_slots(term, found)),
        Condition::Same(terms, _) => terms.iter().for_each(|term| term_slots(term, found)),
        Condition::Compare(_, sides, _) => sides.iter().for_each(|side| expression_slots(side, found)),
        _ => {}
    }
}

fn term_slots(term: &Term, found: &mut dyn FnMut(Slot)) {
    match term {
        Term::Variable(slot) => found(*slot),
        Term::Object(_) => {}
        Term::Function(fluent) => fluent.arguments.iter().for_each(|term| term_slots(term, found)),
    }
}

fn expression_slots(expression: &Expression, found: &mut dyn FnMut(Slot)) {
    match expression {
        Expression::Fluent(Fluent { arguments, .. }) => {
            arguments.iter().for_each(|term| term_slots(term, found))
        }
        Expression::Call(call) => call.arguments.iter().for_each(|term| term_slots(term, found)),
        Expression::Add(parts) | Expression::Multiply(parts) => {
            parts.iter().for_each(|part| expression_slots(part, found));
        }
        Expression::Subtract(sides) | Expression::Divide(sides) => {
            sides.iter().for_each(|side| expression_slots(side, found));
        }
        Expression::Negative(inner) => expression_slots(inner, found),
        Expression::Number(_) | Expression::Duration | Expression::TotalTime | Expression::Violated(_) => {}
    }
}

/// True if a condition uses the predicate of the rule's head.
fn mentions(condition: &Condition, rule: &Rule) -> bool {
    match condition {
        Condition::And(parts) | Condition::Or(parts) => parts.iter().any(|part| mentions(part, rule)),
        Condition::Not(inner) | Condition::Forall(_, inner) | Condition::Exists(_, inner) => {
            mentions(inner, rule)
        }
        Condition::Atom(atom) => atom.predicate == rule.predicate,
        Condition::Same(..) | Condition::Compare(..) | Condition::Call(_) => false,
    }
}
