//! Backward relevance analysis: parts that no goal, condition or metric depends on are removed.

use rustc_hash::FxHashMap;

use super::instantiate::{Clauses, Deed, RawCall, RawEffect, RawPlace};
use super::raw::{RawAction, RawTask};
use super::task::{Change, GroundComparison, GroundExpression};
use crate::model::agreement::contradictions;

/// Atoms and numeric fluents that are relevant.
pub(super) struct Relevant {
    /// True, by atom, if some relevant condition needs the atom true.
    pub wanted: Vec<bool>,
    /// True, by atom, if some relevant condition needs the atom false.
    pub unwanted: Vec<bool>,
    /// True, by numeric fluent, if the fluent is relevant.
    pub numerics: Vec<bool>,
}

struct Work<'a> {
    relevant: Relevant,
    comparisons: &'a [GroundComparison],
    calls: &'a [RawCall],
    /// True, by numeric fluent, if the fluent has no initial value.
    undefined: &'a [bool],
    /// Number of the object function instance to which an atom belongs.
    valued: &'a FxHashMap<u32, u32>,
    changed: bool,
}

/// Calls `fluent` and `call` for every numeric fluent and every call in an expression.
pub(super) fn reads(expression: &GroundExpression, fluent: &mut dyn FnMut(u32), call: &mut dyn FnMut(u32)) {
    match expression {
        GroundExpression::Fluent(id) => fluent(*id),
        GroundExpression::Call(id) => call(*id),
        GroundExpression::Sum(parts) | GroundExpression::Product(parts) => {
            parts.iter().for_each(|p| reads(p, fluent, call));
        }
        GroundExpression::Difference(left, right) | GroundExpression::Quotient(left, right) => {
            reads(left, fluent, call);
            reads(right, fluent, call);
        }
        GroundExpression::Negative(inner) => reads(inner, fluent, call),
        GroundExpression::Constant(_)
        | GroundExpression::Duration
        | GroundExpression::TotalTime
        | GroundExpression::Violated(_) => {}
    }
}

/// True if a change of a number may have an undefined result, which makes the action inapplicable
/// whether or not the number is relevant. `undefined` marks the numeric fluents without an initial
/// value.
pub(super) fn is_risky(change: Change, fluent: u32, amount: &GroundExpression, undefined: &[bool]) -> bool {
    let mut risky = change == Change::ScaleDown || change != Change::Assign && undefined[fluent as usize];
    reads(amount, &mut |id| risky |= undefined[id as usize], &mut |_| {});
    risky || may_fail(amount)
}

/// Value of a constant; NaN for other expressions.
fn known(expression: &GroundExpression) -> f64 {
    if let GroundExpression::Constant(value) = expression { *value } else { f64::NAN }
}

/// True if an expression may be undefined even where all fluents in it are defined.
fn may_fail(expression: &GroundExpression) -> bool {
    match expression {
        GroundExpression::Constant(value) => !value.is_finite(),
        GroundExpression::Sum(parts) | GroundExpression::Product(parts) => parts.iter().any(may_fail),
        GroundExpression::Difference(left, right) => may_fail(left) || may_fail(right),
        GroundExpression::Quotient(left, right) => {
            let safe = matches!(**right, GroundExpression::Constant(value) if value != 0.0);
            !safe || may_fail(left)
        }
        GroundExpression::Negative(inner) => may_fail(inner),
        GroundExpression::Call(_) => true,
        _ => false,
    }
}

impl Work<'_> {
    fn set(list: &mut [bool], index: u32, changed: &mut bool) {
        *changed |= !std::mem::replace(&mut list[index as usize], true);
    }

    fn clauses(&mut self, clauses: &Clauses) {
        self.literals(clauses, 0);
        self.numbers(clauses);
    }

    /// Marks the body of an axiom as relevant: as is if its head is needed true, negated if the
    /// head is needed false.
    fn body(&mut self, body: &Clauses, head: u32) {
        if self.relevant.wanted[head as usize] {
            self.literals(body, 0);
        }
        if self.relevant.unwanted[head as usize] {
            self.literals(body, 1);
        }
        if self.keeps(&Deed::Add(head)) {
            self.numbers(body);
        }
    }

    /// Marks the literals of a condition as needed, or with `flipped` 1 their negations.
    fn literals(&mut self, clauses: &Clauses, flipped: u32) {
        for literal in clauses.literals.iter().map(|literal| literal ^ flipped) {
            let list = if literal & 1 == 0 { &mut self.relevant.wanted } else { &mut self.relevant.unwanted };
            Self::set(list, literal >> 1, &mut self.changed);
        }
    }

    fn numbers(&mut self, clauses: &Clauses) {
        for &id in &clauses.comparisons {
            let comparison = &self.comparisons[id as usize];
            self.expression(&comparison.left);
            self.expression(&comparison.right);
        }
    }

    fn expression(&mut self, expression: &GroundExpression) {
        let (numerics, changed) = (&mut self.relevant.numerics, &mut self.changed);
        reads(expression, &mut |id| Self::set(numerics, id, changed), &mut |_| {});
    }

    fn touches(&self, deed: &Deed) -> bool {
        match deed {
            Deed::Add(a) => self.relevant.wanted[*a as usize],
            Deed::Delete(a) => self.relevant.unwanted[*a as usize],
            Deed::Change(id, ..) => self.relevant.numerics[*id as usize],
            Deed::Call(_) => true,
        }
    }

    /// True if it may matter that this effect does not happen.
    fn harms(&self, deed: &Deed) -> bool {
        match deed {
            Deed::Add(a) => self.relevant.unwanted[*a as usize],
            Deed::Delete(a) => self.relevant.wanted[*a as usize],
            other => self.keeps(other),
        }
    }

    /// True if the effect changes something relevant or may make the action inapplicable.
    fn keeps(&self, deed: &Deed) -> bool {
        match deed {
            Deed::Add(a) | Deed::Delete(a) => {
                self.relevant.wanted[*a as usize] || self.relevant.unwanted[*a as usize]
            }
            Deed::Change(id, change, amount) => {
                self.relevant.numerics[*id as usize] || is_risky(*change, *id, amount, self.undefined)
            }
            other => self.touches(other),
        }
    }

    /// Marks numbers that one action may change in contradicting ways as relevant, because the
    /// contradiction makes the action inapplicable.
    fn contradictions(&mut self, effects: &[RawEffect]) {
        let change = |effect: &RawEffect| match &effect.deed {
            Deed::Change(id, change, amount) => Some((*id, *change, known(amount))),
            _ => None,
        };
        let changes: Vec<_> = effects.iter().filter_map(change).collect();
        for (first, _) in contradictions(changes.iter().copied()) {
            Self::set(&mut self.relevant.numerics, changes[first].0, &mut self.changed);
        }
        if !self.valued.is_empty() {
            self.contests(effects);
        }
    }

    /// Marks the negated conditions of effects that may give one object function two values at
    /// once, because that makes the action inapplicable.
    fn contests(&mut self, effects: &[RawEffect]) {
        // The object, its value (none where it loses that), and how it gets it.
        let valued = self.valued;
        let given = effects.iter().filter_map(|effect| match effect.deed {
            Deed::Add(atom) => Some((*valued.get(&atom)?, Some(atom), effect)),
            Deed::Delete(atom) => Some((*valued.get(&atom)?, None, effect)),
            _ => None,
        });
        let given: Vec<(u32, Option<u32>, &RawEffect)> = given.collect();
        for (place, &(object, value, one)) in given.iter().enumerate() {
            for &(other_object, other_value, other) in &given[..place] {
                if object != other_object || value == other_value || self.exclude(one, other) {
                    continue;
                }
                for clauses in
                    [one, other].into_iter().flat_map(|effect| effect.when.iter().flat_map(|w| w.iter()))
                {
                    self.literals(clauses, 1);
                    self.numbers(clauses);
                }
            }
        }
    }

    /// True if the conditions of two effects require different values of one object function, so
    /// that not both can happen.
    fn exclude(&self, one: &RawEffect, other: &RawEffect) -> bool {
        let (Some(one), Some(other)) = (&one.when, &other.when) else { return false };
        let has = |literal: u32| if literal & 1 == 0 { self.valued.get(&(literal >> 1)) } else { None };
        one[0].literals.iter().any(|&literal| {
            has(literal).is_some_and(|object| {
                other[0].literals.iter().any(|&another| another != literal && has(another) == Some(object))
            })
        })
    }

    fn effects(&mut self, effects: &[RawEffect]) {
        self.contradictions(effects);
        for effect in effects {
            if !self.keeps(&effect.deed) {
                continue;
            }
            for clauses in effect.when.iter().flat_map(|w| w.iter()) {
                if self.touches(&effect.deed) {
                    self.clauses(clauses);
                }
                if self.harms(&effect.deed) {
                    self.literals(clauses, 1);
                    self.numbers(clauses);
                }
            }
            match &effect.deed {
                Deed::Change(id, _, amount) => {
                    Self::set(&mut self.relevant.numerics, *id, &mut self.changed);
                    self.expression(amount);
                }
                Deed::Call(id) => {
                    for place in &self.calls[*id as usize].writes {
                        if let RawPlace::Number(number) = place {
                            Self::set(&mut self.relevant.numerics, *number, &mut self.changed);
                        }
                    }
                }
                Deed::Add(_) | Deed::Delete(_) => {}
            }
        }
    }

    fn action(&mut self, action: &RawAction) {
        self.clauses(&action.start);
        self.effects(&action.effects);
        if let Some(later) = &action.later {
            self.clauses(&later.over_all);
            self.clauses(&later.end);
            self.effects(&later.end_effects);
            later.flows.iter().for_each(|(_, rate)| self.expression(rate));
            later.duration.iter().for_each(|bound| self.expression(&bound.seconds));
        }
    }

    fn useful(&self, action: &RawAction) -> bool {
        action.effects.iter().any(|e| self.touches(&e.deed))
            || action.later.as_ref().is_some_and(|later| {
                later.end_effects.iter().any(|e| self.touches(&e.deed))
                    || later.flows.iter().any(|(id, _)| self.relevant.numerics[*id as usize])
            })
    }
}

/// Removes irrelevant actions, effects and axioms; returns what is relevant.
///
/// `undefined`: numeric fluents without initial value. `metric`: numeric fluents in the state that
/// the metric reads. `valued`: number of the object function instance of each of its atoms.
pub(super) fn prune(
    task: &mut RawTask,
    comparisons: &[GroundComparison],
    calls: &[RawCall],
    undefined: &[bool],
    metric: &[u32],
    valued: &FxHashMap<u32, u32>,
) -> Relevant {
    let count = task.init.len();
    let relevant = Relevant {
        wanted: vec![false; count],
        unwanted: vec![false; count],
        numerics: vec![false; undefined.len()],
    };
    let mut work = Work { relevant, comparisons, calls, undefined, valued, changed: true };
    work.clauses(&task.goal);
    metric.iter().for_each(|&id| work.relevant.numerics[id as usize] = true);
    valued.keys().for_each(|&atom| work.relevant.wanted[atom as usize] = true);
    let mut kept = vec![false; task.actions.len()];
    while std::mem::take(&mut work.changed) {
        for (index, action) in task.actions.iter().enumerate() {
            if kept[index] || work.useful(action) {
                work.changed |= !std::mem::replace(&mut kept[index], true);
                work.action(action);
            }
        }
        for axiom in &task.axioms {
            work.body(&axiom.body, axiom.head);
        }
    }
    let mut index = 0;
    task.actions.retain(|_| {
        index += 1;
        kept[index - 1]
    });
    let keeps = |deed: &Deed| work.keeps(deed);
    for action in &mut task.actions {
        action.effects.retain(|e| keeps(&e.deed));
        if let Some(later) = &mut action.later {
            later.end_effects.retain(|e| keeps(&e.deed));
        }
    }
    task.axioms.retain(|a| work.keeps(&Deed::Add(a.head)));
    work.relevant
}
