//! Conditions whose variables are replaced by objects, with quantifiers expanded and static parts
//! evaluated.

use rustc_hash::FxHashSet;

use crate::diagnostic::Span;
use crate::task::{
    Atom, CallTerm, Condition, Expression, Fact, Fluent, GroundChange, ObjectId, PredicateId, Quantified,
    Slot, Task, Term,
};

/// Conjunction of conditions; true and false parts are simplified.
pub(super) fn all(parts: impl IntoIterator<Item = Condition>) -> Condition {
    let mut list = Vec::new();
    for part in parts {
        match part {
            Condition::And(inner) => list.extend(inner),
            Condition::Or(inner) if inner.is_empty() => return Condition::Or(inner),
            other => list.push(other),
        }
    }
    single(list, Condition::And)
}

/// Disjunction of conditions; true and false parts are simplified.
pub(super) fn any(parts: impl IntoIterator<Item = Condition>) -> Condition {
    let mut list = Vec::new();
    for part in parts {
        match part {
            Condition::Or(inner) => list.extend(inner),
            Condition::And(inner) if inner.is_empty() => return Condition::And(inner),
            other => list.push(other),
        }
    }
    single(list, Condition::Or)
}

fn single(mut list: Vec<Condition>, many: fn(Vec<Condition>) -> Condition) -> Condition {
    match list.pop() {
        Some(only) if list.is_empty() => only,
        Some(last) => {
            list.push(last);
            many(list)
        }
        None => many(list),
    }
}

/// True if the condition is the empty disjunction.
pub(super) fn is_false(condition: &Condition) -> bool {
    matches!(condition, Condition::Or(parts) if parts.is_empty())
}

/// Negation in negation normal form. Exact except for comparisons: with an undefined number, a
/// comparison and its negation are both false.
pub(crate) fn negated(condition: &Condition) -> Condition {
    match condition {
        Condition::And(parts) => any(parts.iter().map(negated)),
        Condition::Or(parts) => all(parts.iter().map(negated)),
        Condition::Not(inner) => (**inner).clone(),
        Condition::Forall(variables, inner) => Condition::Exists(variables.clone(), Box::new(negated(inner))),
        Condition::Exists(variables, inner) => Condition::Forall(variables.clone(), Box::new(negated(inner))),
        leaf => Condition::Not(Box::new(leaf.clone())),
    }
}

/// Calls `visit` with every binding of the variables to objects.
pub(super) fn each_binding(
    variables: &[Quantified],
    binding: &mut Vec<Option<ObjectId>>,
    visit: &mut dyn FnMut(&mut Vec<Option<ObjectId>>),
) {
    let Some((first, rest)) = variables.split_first() else { return visit(binding) };
    for &object in first.parameter.objects.iter() {
        binding[first.slot.index()] = Some(object);
        each_binding(rest, binding, visit);
    }
}

/// Predicates that nothing changes, and the initial facts.
pub(super) struct Fixed {
    /// True, by predicate, if nothing changes its atoms.
    predicates: Vec<bool>,
    facts: FxHashSet<Fact>,
}

impl Fixed {
    pub(super) fn new(task: &Task) -> Fixed {
        use crate::task::{Change, Written};
        let mut predicates: Vec<bool> = task.predicates.iter().map(|own| own.stratum.is_none()).collect();
        let mut change = |id: PredicateId| predicates[id.index()] = false;
        for action in &task.actions {
            for effect in action.effects.start.iter().chain(&action.effects.end) {
                if let Change::Add(atom) | Change::Delete(atom) = &effect.change {
                    change(atom.predicate);
                }
            }
        }
        for written in task.modules.iter().flat_map(|module| &module.writes) {
            if let Written::Truth(atom) = written {
                change(atom.predicate);
            }
        }
        for timed in &task.init.timed {
            if let GroundChange::Add(fact) | GroundChange::Delete(fact) = &timed.change {
                change(fact.predicate);
            }
        }
        Fixed { predicates, facts: task.init.facts.iter().cloned().collect() }
    }

    /// Replaces the variables of a condition by their objects in `binding`, expands quantifiers and
    /// evaluates static atoms.
    pub(super) fn ground(&self, condition: &Condition, binding: &mut Vec<Option<ObjectId>>) -> Condition {
        match condition {
            Condition::And(parts) => all(parts.iter().map(|part| self.ground(part, binding))),
            Condition::Or(parts) => any(parts.iter().map(|part| self.ground(part, binding))),
            Condition::Not(inner) => match self.ground(inner, binding) {
                leaf @ (Condition::And(_) | Condition::Or(_)) => negated(&leaf),
                leaf => Condition::Not(Box::new(leaf)),
            },
            Condition::Forall(variables, inner) => all(self.instances(variables, inner, binding)),
            Condition::Exists(variables, inner) => any(self.instances(variables, inner, binding)),
            Condition::Atom(atom) => self.atom(atom, binding),
            Condition::Same(both, span) => {
                let both = both.each_ref().map(|own| term(own, binding));
                match &both {
                    [Term::Object(left), Term::Object(right)] => truth(left == right),
                    _ => Condition::Same(Box::new(both), *span),
                }
            }
            Condition::Compare(how, sides, span) => {
                let sides = sides.each_ref().map(|side| expression(side, binding));
                Condition::Compare(*how, Box::new(sides), *span)
            }
            Condition::Call(own) => Condition::Call(call(own, binding)),
        }
    }

    fn instances(
        &self,
        variables: &[Quantified],
        inner: &Condition,
        binding: &mut Vec<Option<ObjectId>>,
    ) -> Vec<Condition> {
        let mut list = Vec::new();
        each_binding(variables, binding, &mut |binding| list.push(self.ground(inner, binding)));
        list
    }

    fn atom(&self, atom: &Atom, binding: &[Option<ObjectId>]) -> Condition {
        let arguments: Vec<Term> = atom.arguments.iter().map(|own| term(own, binding)).collect();
        let object = |own: &Term| if let Term::Object(id) = own { Some(*id) } else { None };
        let objects: Option<Box<[ObjectId]>> = arguments.iter().map(object).collect();
        match objects {
            Some(arguments) if self.predicates[atom.predicate.index()] => {
                truth(self.facts.contains(&Fact { predicate: atom.predicate, arguments }))
            }
            _ => Condition::Atom(Atom { arguments, predicate: atom.predicate, span: Span::default() }),
        }
    }
}

/// Canonical text of a condition, independent of the order of its parts.
pub(super) fn words(condition: &Condition) -> String {
    let list = |name: &str, parts: &[Condition]| {
        let mut list: Vec<String> = parts.iter().map(words).collect();
        list.sort_unstable();
        format!("{name}{list:?}")
    };
    match condition {
        Condition::And(parts) => list("and", parts),
        Condition::Or(parts) => list("or", parts),
        other => format!("{other:?}"),
    }
}

fn truth(holds: bool) -> Condition {
    if holds { Condition::TRUE } else { Condition::Or(Vec::new()) }
}

fn term(own: &Term, binding: &[Option<ObjectId>]) -> Term {
    let bound = |slot: Slot| binding.get(slot.index()).copied().flatten();
    match own {
        Term::Variable(slot) => bound(*slot).map_or_else(|| own.clone(), Term::Object),
        Term::Object(_) => own.clone(),
        Term::Function(own) => Term::Function(Box::new(fluent(own, binding))),
    }
}

fn terms(list: &[Term], binding: &[Option<ObjectId>]) -> Vec<Term> {
    list.iter().map(|own| term(own, binding)).collect()
}

fn fluent(own: &Fluent, binding: &[Option<ObjectId>]) -> Fluent {
    Fluent { arguments: terms(&own.arguments, binding), ..*own }
}

fn call(own: &CallTerm, binding: &[Option<ObjectId>]) -> CallTerm {
    CallTerm { arguments: terms(&own.arguments, binding), ..*own }
}

fn expression(own: &Expression, binding: &[Option<ObjectId>]) -> Expression {
    let list = |parts: &[Expression]| parts.iter().map(|part| expression(part, binding)).collect();
    let both = |sides: &[Expression; 2]| Box::new(sides.each_ref().map(|side| expression(side, binding)));
    match own {
        Expression::Fluent(own) => Expression::Fluent(fluent(own, binding)),
        Expression::Add(parts) => Expression::Add(list(parts)),
        Expression::Multiply(parts) => Expression::Multiply(list(parts)),
        Expression::Subtract(sides) => Expression::Subtract(both(sides)),
        Expression::Divide(sides) => Expression::Divide(both(sides)),
        Expression::Negative(inner) => Expression::Negative(Box::new(expression(inner, binding))),
        Expression::Call(own) => Expression::Call(call(own, binding)),
        Expression::Number(_) | Expression::Duration | Expression::TotalTime | Expression::Violated(_) => {
            own.clone()
        }
    }
}
