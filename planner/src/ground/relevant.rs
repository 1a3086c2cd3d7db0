//! Backward relevance: what no goal, condition or metric asks for goes.

use super::instantiate::{Clauses, Deed, GroundEffect, RawCall, RawPlace};
use super::raw::{RawAction, RawTask};
use super::task::{Comparison, Expression};

/// What matters.
pub(super) struct Relevant {
    /// By atom: asked for.
    pub wanted: Vec<bool>,
    /// By atom: its absence is asked for.
    pub unwanted: Vec<bool>,
    /// By numeric fluent.
    pub numerics: Vec<bool>,
}

struct Work<'a> {
    relevant: Relevant,
    comparisons: &'a [Comparison],
    calls: &'a [RawCall],
    changed: bool,
}

/// Every numeric fluent and call in the expression.
pub(super) fn reads(expression: &Expression, fluent: &mut dyn FnMut(u32), call: &mut dyn FnMut(u32)) {
    match expression {
        Expression::Fluent(id) => fluent(*id),
        Expression::Call(id) => call(*id),
        Expression::Sum(parts) | Expression::Product(parts) => {
            parts.iter().for_each(|p| reads(p, fluent, call));
        }
        Expression::Difference(left, right) | Expression::Quotient(left, right) => {
            reads(left, fluent, call);
            reads(right, fluent, call);
        }
        Expression::Negative(inner) => reads(inner, fluent, call),
        Expression::Constant(_) | Expression::Duration | Expression::TotalTime | Expression::Violated(_) => {}
    }
}

impl Work<'_> {
    fn set(list: &mut [bool], index: u32, changed: &mut bool) {
        *changed |= !std::mem::replace(&mut list[index as usize], true);
    }

    fn clauses(&mut self, clauses: &Clauses) {
        for &literal in &clauses.literals {
            let list = if literal & 1 == 0 { &mut self.relevant.wanted } else { &mut self.relevant.unwanted };
            Self::set(list, literal >> 1, &mut self.changed);
        }
        for &id in &clauses.comparisons {
            let comparison = &self.comparisons[id as usize];
            self.expression(&comparison.left);
            self.expression(&comparison.right);
        }
    }

    fn expression(&mut self, expression: &Expression) {
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

    /// Also what only harms must be followed once the action is kept.
    fn keeps(&self, deed: &Deed) -> bool {
        match deed {
            Deed::Add(a) | Deed::Delete(a) => {
                self.relevant.wanted[*a as usize] || self.relevant.unwanted[*a as usize]
            }
            other => self.touches(other),
        }
    }

    fn effects(&mut self, effects: &[GroundEffect]) {
        for effect in effects {
            if !self.keeps(&effect.deed) {
                continue;
            }
            for clauses in effect.when.iter().flat_map(|w| w.iter()) {
                self.clauses(clauses);
            }
            match &effect.deed {
                Deed::Change(_, _, amount) => self.expression(amount),
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

/// Removes actions that bring nothing about that matters, and effects that nothing asks about. `metric` lists numeric
/// fluents that the metric depends on beyond the actions' costs; `valued` the atoms of object functions, where giving one
/// value takes the others away.
pub(super) fn prune(
    task: &mut RawTask,
    comparisons: &[Comparison],
    calls: &[RawCall],
    numerics: usize,
    metric: &[u32],
    valued: &[u32],
) -> Relevant {
    let count = task.init.len();
    let relevant = Relevant {
        wanted: vec![false; count],
        unwanted: vec![false; count],
        numerics: vec![false; numerics],
    };
    let mut work = Work { relevant, comparisons, calls, changed: true };
    work.clauses(&task.goal);
    metric.iter().for_each(|&id| work.relevant.numerics[id as usize] = true);
    valued.iter().for_each(|&atom| work.relevant.wanted[atom as usize] = true);
    let mut kept = vec![false; task.actions.len()];
    while std::mem::take(&mut work.changed) {
        for (index, action) in task.actions.iter().enumerate() {
            if kept[index] || work.useful(action) {
                work.changed |= !std::mem::replace(&mut kept[index], true);
                work.action(action);
            }
        }
        for axiom in &task.axioms {
            let head = axiom.head as usize;
            if work.relevant.wanted[head] || work.relevant.unwanted[head] {
                work.clauses(&axiom.body);
            }
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
