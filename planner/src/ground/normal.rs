//! Normal form of the lifted task for grounding. An object function becomes a predicate with the
//! value as one more argument, so every term is a variable or an object.

use std::sync::Arc;

use super::pddl3::conditions::negated;
use super::unused::leave_out_what_nothing_uses;
use crate::task::{
    Assignment, Atom, CallTerm, Change, Comparison, Condition, Effect, Expression, Fluent, FunctionId,
    ObjectId, Quantified, Task, Term as LiftedTerm, Timed, Written,
};

/// Term: a variable (slot of a binding) or an object.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Term {
    Slot(u32),
    Object(u32),
}

impl Term {
    /// Object of the term under a binding; `NONE` for an unbound slot.
    pub(super) fn bound(self, binding: &[u32]) -> u32 {
        match self {
            Term::Slot(slot) => binding[slot as usize],
            Term::Object(object) => object,
        }
    }
}

/// Predicate with its terms. An object function counts as a predicate, numbered after the
/// predicates, with its value as last term.
#[derive(Clone, Debug)]
pub(super) struct Pattern {
    pub predicate: u32,
    pub terms: Vec<Term>,
}

/// Numeric function or module with its terms.
#[derive(Clone, Debug)]
pub(super) struct Named {
    pub index: u32,
    pub terms: Vec<Term>,
}

/// Condition in negation normal form, without function terms; `bool` is false for a negated
/// literal.
#[derive(Clone, Debug)]
pub(super) enum Formula {
    And(Vec<Formula>),
    Or(Vec<Formula>),
    Literal(Pattern, bool),
    Same(Term, Term, bool),
    Compare(Comparison, Number, Number, bool),
    Call(Named, bool),
    Forall(Vec<u32>, Box<Formula>),
    Exists(Vec<u32>, Box<Formula>),
}

/// Numeric expression without function terms.
#[derive(Clone, Debug)]
pub(super) enum Number {
    Constant(f64),
    Fluent(Named),
    Call(Named),
    Sum(Vec<Number>),
    Product(Vec<Number>),
    Difference(Box<[Number; 2]>),
    Quotient(Box<[Number; 2]>),
    Negative(Box<Number>),
    Duration,
    TotalTime,
    Violated(u32),
}

/// Change that an effect makes.
#[derive(Clone, Debug)]
pub(super) enum Change_ {
    Add(Pattern),
    Delete(Pattern),
    Number(Assignment, Named, Number),
    /// Makes an object function undefined: function and arguments, without a value.
    Unset(Pattern),
    Call(Named),
}

/// Effect, for all objects of the `forall` slots.
#[derive(Clone, Debug)]
pub(super) struct Effect_ {
    pub forall: Vec<u32>,
    pub when: Timed3<Formula>,
    pub change: Change_,
}

/// Values for the start, the whole duration and the end of an action.
#[derive(Clone, Debug)]
pub(super) struct Timed3<T> {
    pub start: T,
    pub over_all: T,
    pub end: T,
}

/// Action in normal form.
#[derive(Clone, Debug)]
pub(super) struct Action_ {
    pub schema: u32,
    /// Number of parameters, which are slots `0..arity`. The slots `extra` hold values of object
    /// functions that durations or rates mention.
    pub arity: usize,
    pub extra: Vec<u32>,
    pub domains: Vec<Arc<[ObjectId]>>,
    pub duration: Option<Vec<(bool, Comparison, Number)>>,
    pub condition: Timed3<Formula>,
    pub start_effects: Vec<Effect_>,
    pub end_effects: Vec<Effect_>,
    pub flows: Vec<(Named, Number)>,
}

impl Timed3<Formula> {
    /// Formulas for start, over all and end.
    pub fn all(&self) -> [&Formula; 3] {
        [&self.start, &self.over_all, &self.end]
    }
}

impl Formula {
    /// Visits every term of the formula.
    pub fn terms(&self, visit: &mut dyn FnMut(&Term)) {
        match self {
            Formula::And(parts) | Formula::Or(parts) => parts.iter().for_each(|part| part.terms(visit)),
            Formula::Literal(pattern, _) => pattern.terms.iter().for_each(visit),
            Formula::Same(one, other, _) => [one, other].into_iter().for_each(visit),
            Formula::Compare(_, left, right, _) => [left, right].iter().for_each(|side| side.terms(visit)),
            Formula::Call(call, _) => call.terms.iter().for_each(visit),
            Formula::Forall(_, body) | Formula::Exists(_, body) => body.terms(visit),
        }
    }
}

impl Number {
    /// Visits every term of the expression.
    pub fn terms(&self, visit: &mut dyn FnMut(&Term)) {
        match self {
            Number::Fluent(named) | Number::Call(named) => named.terms.iter().for_each(visit),
            Number::Sum(parts) | Number::Product(parts) => parts.iter().for_each(|part| part.terms(visit)),
            Number::Difference(sides) | Number::Quotient(sides) => {
                sides.iter().for_each(|side| side.terms(visit));
            }
            Number::Negative(inner) => inner.terms(visit),
            Number::Constant(_) | Number::Duration | Number::TotalTime | Number::Violated(_) => {}
        }
    }
}

/// Rule of a derived predicate in normal form.
#[derive(Clone, Debug)]
pub(super) struct Rule_ {
    pub head: Pattern,
    pub domains: Vec<Arc<[ObjectId]>>,
    pub body: Formula,
    pub stratum: u32,
}

/// Lifted task in normal form.
pub(super) struct Normal {
    pub actions: Vec<Action_>,
    pub rules: Vec<Rule_>,
    pub goal: Formula,
    pub goal_domains: Vec<Arc<[ObjectId]>>,
    pub metric: Option<Number>,
    /// Number of predicates and functions together.
    pub predicate_count: usize,
}

/// Slots of one action, rule or goal, with the objects of each slot; object functions in terms get
/// new slots.
struct Scope<'a> {
    task: &'a Task,
    domains: Vec<Arc<[ObjectId]>>,
}

/// New slots for the values of object functions, with the atoms that define these values.
#[derive(Default)]
struct Fresh {
    slots: Vec<u32>,
    atoms: Vec<Pattern>,
}

impl Fresh {
    fn is_empty(&self) -> bool {
        self.slots.is_empty()
    }

    fn positive(self, rest: Formula) -> Formula {
        if self.is_empty() {
            return rest;
        }
        let mut parts: Vec<_> = self.atoms.into_iter().map(|a| Formula::Literal(a, true)).collect();
        parts.push(rest);
        Formula::Exists(self.slots, Box::new(Formula::And(parts)))
    }

    fn negative(self, rest: Formula) -> Formula {
        if self.is_empty() {
            return rest;
        }
        let mut parts: Vec<_> = self.atoms.into_iter().map(|a| Formula::Literal(a, false)).collect();
        parts.push(rest);
        Formula::Forall(self.slots, Box::new(Formula::Or(parts)))
    }
}

impl<'a> Scope<'a> {
    fn new(task: &'a Task, slots: usize) -> Self {
        Scope { task, domains: vec![Arc::from([]); slots] }
    }

    fn quantify(&mut self, variables: &[Quantified]) -> Vec<u32> {
        for variable in variables {
            self.domains[variable.slot.index()] = variable.parameter.objects.clone();
        }
        variables.iter().map(|v| v.slot.0).collect()
    }

    fn term(&mut self, term: &LiftedTerm, fresh: &mut Fresh) -> Term {
        match term {
            LiftedTerm::Variable(slot) => Term::Slot(slot.0),
            LiftedTerm::Object(object) => Term::Object(object.0),
            LiftedTerm::Function(fluent) => {
                let mut terms = self.terms(&fluent.arguments, fresh);
                let slot = self.domains.len() as u32;
                self.domains.push(self.values_of(fluent));
                fresh.slots.push(slot);
                terms.push(Term::Slot(slot));
                fresh.atoms.push(Pattern { predicate: self.function_predicate(fluent), terms });
                Term::Slot(slot)
            }
        }
    }

    fn values_of(&self, fluent: &Fluent) -> Arc<[ObjectId]> {
        let types = self.task.function(fluent.function).result.as_deref().unwrap_or_default();
        (0..self.task.objects.len() as u32).map(ObjectId).filter(|&o| self.task.fits(o, types)).collect()
    }

    fn function_predicate(&self, fluent: &Fluent) -> u32 {
        self.task.predicates.len() as u32 + fluent.function.0
    }

    fn terms(&mut self, terms: &[LiftedTerm], fresh: &mut Fresh) -> Vec<Term> {
        terms.iter().map(|term| self.term(term, fresh)).collect()
    }

    fn atom(&mut self, atom: &Atom, fresh: &mut Fresh) -> Pattern {
        Pattern { predicate: atom.predicate.0, terms: self.terms(&atom.arguments, fresh) }
    }

    fn call(&mut self, call: &CallTerm, fresh: &mut Fresh) -> Named {
        Named { index: call.module.0, terms: self.terms(&call.arguments, fresh) }
    }

    fn fluent(&mut self, fluent: &Fluent, fresh: &mut Fresh) -> Named {
        Named { index: fluent.function.0, terms: self.terms(&fluent.arguments, fresh) }
    }

    fn formula(&mut self, condition: &Condition) -> Formula {
        match condition {
            Condition::And(parts) => Formula::And(parts.iter().map(|p| self.formula(p)).collect()),
            Condition::Or(parts) => Formula::Or(parts.iter().map(|p| self.formula(p)).collect()),
            Condition::Forall(variables, body) => {
                let slots = self.quantify(variables);
                Formula::Forall(slots, Box::new(self.formula(body)))
            }
            Condition::Exists(variables, body) => {
                let slots = self.quantify(variables);
                Formula::Exists(slots, Box::new(self.formula(body)))
            }
            Condition::Not(inner) => self.leaf(inner, false),
            leaf => self.leaf(leaf, true),
        }
    }

    fn leaf(&mut self, leaf: &Condition, wanted: bool) -> Formula {
        let mut fresh = Fresh::default();
        let formula = match leaf {
            Condition::Atom(atom) => Formula::Literal(self.atom(atom, &mut fresh), wanted),
            Condition::Same(pair, _) => self.same(&pair[0], &pair[1], wanted, &mut fresh),
            Condition::Compare(comparison, sides, _) => {
                let left = self.number(&sides[0], &mut fresh);
                let right = self.number(&sides[1], &mut fresh);
                Formula::Compare(*comparison, left, right, wanted)
            }
            Condition::Call(call) => Formula::Call(self.call(call, &mut fresh), wanted),
            other => return self.formula(other),
        };
        if wanted { fresh.positive(formula) } else { fresh.negative(formula) }
    }

    /// Equation of two terms; if one side is an object function, an atom of that function.
    fn same(&mut self, left: &LiftedTerm, right: &LiftedTerm, wanted: bool, fresh: &mut Fresh) -> Formula {
        let (function, value) = match (left, right) {
            (LiftedTerm::Function(f), value) => (f, value),
            (value, LiftedTerm::Function(f)) => (f, value),
            _ => return Formula::Same(self.term(left, fresh), self.term(right, fresh), wanted),
        };
        let mut terms = self.terms(&function.arguments, fresh);
        terms.push(self.term(value, fresh));
        Formula::Literal(Pattern { predicate: self.function_predicate(function), terms }, wanted)
    }

    fn number(&mut self, expression: &Expression, fresh: &mut Fresh) -> Number {
        let mut all = |parts: &[Expression]| parts.iter().map(|p| self.number(p, fresh)).collect::<Vec<_>>();
        match expression {
            Expression::Number(value) => Number::Constant(*value),
            Expression::Fluent(fluent) => Number::Fluent(self.fluent(fluent, fresh)),
            Expression::Call(call) => Number::Call(self.call(call, fresh)),
            Expression::Add(parts) => Number::Sum(all(parts)),
            Expression::Multiply(parts) => Number::Product(all(parts)),
            Expression::Subtract(pair) => {
                Number::Difference(Box::new([self.number(&pair[0], fresh), self.number(&pair[1], fresh)]))
            }
            Expression::Divide(pair) => {
                Number::Quotient(Box::new([self.number(&pair[0], fresh), self.number(&pair[1], fresh)]))
            }
            Expression::Negative(inner) => Number::Negative(Box::new(self.number(inner, fresh))),
            Expression::Duration => Number::Duration,
            Expression::TotalTime => Number::TotalTime,
            Expression::Violated(preference) => Number::Violated(preference.0),
        }
    }

    fn timed(&mut self, condition: &Timed<Condition>) -> Timed3<Formula> {
        Timed3 {
            start: self.formula(&condition.start),
            over_all: self.formula(&condition.over_all),
            end: self.formula(&condition.end),
        }
    }

    /// Effect in normal form. If an object function in it may be undefined, `needs` gets a
    /// condition under which the effect has a result.
    fn effect(&mut self, effect: &Effect, at_end: bool, needs: &mut Needs) -> Effect_ {
        let mut forall = self.quantify(&effect.forall);
        let mut when = self.timed(&effect.when);
        let mut fresh = Fresh::default();
        let change = match &effect.change {
            Change::Add(atom) => Change_::Add(self.atom(atom, &mut fresh)),
            Change::Delete(atom) => Change_::Delete(self.atom(atom, &mut fresh)),
            Change::Number(how, fluent, amount) => {
                let fluent = self.fluent(fluent, &mut fresh);
                Change_::Number(*how, fluent, self.number(amount, &mut fresh))
            }
            Change::Object(fluent, value) => {
                let predicate = self.function_predicate(fluent);
                let mut terms = self.terms(&fluent.arguments, &mut fresh);
                match value {
                    Some(value) => {
                        terms.push(self.term(value, &mut fresh));
                        Change_::Add(Pattern { predicate, terms })
                    }
                    None => Change_::Unset(Pattern { predicate, terms }),
                }
            }
            Change::Call(call) => Change_::Call(self.call(call, &mut fresh)),
        };
        if !fresh.is_empty() {
            if let Some(first) = fresh.atoms.iter().find(|atom| self.unsure(atom)) {
                if at_end && !(effect.when.start.is_true() && effect.when.over_all.is_true()) {
                    let function = first.predicate - self.task.predicates.len() as u32;
                    let forbidden = without_result(function, &forall, &when, &fresh);
                    needs.forbidden.push(forbidden);
                } else {
                    needs.conditions.push(self.defined(effect, at_end, &fresh));
                }
            }
            let place = if at_end { &mut when.end } else { &mut when.start };
            let mut parts: Vec<_> = fresh.atoms.into_iter().map(|a| Formula::Literal(a, true)).collect();
            parts.push(std::mem::replace(place, Formula::And(Vec::new())));
            *place = Formula::And(parts);
            forall.extend(fresh.slots);
        }
        Effect_ { forall, when, change }
    }

    /// True if the atom belongs to an object function that may be undefined.
    fn unsure(&self, atom: &Pattern) -> bool {
        let function = atom.predicate.checked_sub(self.task.predicates.len() as u32);
        function.is_some_and(|function| may_be_undefined(self.task, FunctionId(function)))
    }

    /// Condition of an action: where an effect happens, the object functions that it mentions are
    /// defined.
    fn defined(&mut self, effect: &Effect, at_end: bool, fresh: &Fresh) -> Formula {
        let atoms = fresh.atoms.iter().map(|atom| Formula::Literal(atom.clone(), true)).collect();
        let defined = Formula::Exists(fresh.slots.clone(), Box::new(Formula::And(atoms)));
        let now = if at_end { &effect.when.end } else { &effect.when.start };
        let otherwise = (!now.is_true()).then(|| self.formula(&negated(now)));
        let needed = match otherwise {
            Some(otherwise) => Formula::Or(vec![otherwise, defined]),
            None => defined,
        };
        let forall = effect.forall.iter().map(|quantified| quantified.slot.0).collect();
        if effect.forall.is_empty() { needed } else { Formula::Forall(forall, Box::new(needed)) }
    }
}

/// Conditions under which all effects of an action have a result.
#[derive(Default)]
struct Needs {
    /// Further conditions of the action.
    conditions: Vec<Formula>,
    /// Additional effects that make the action inapplicable where they happen; used for end effects
    /// with conditions on earlier times.
    forbidden: Vec<Effect_>,
}

/// Effect that makes an action inapplicable where one of its end effects mentions an undefined
/// object function: it assigns an undefined number to that function.
fn without_result(function: u32, forall: &[u32], when: &Timed3<Formula>, fresh: &Fresh) -> Effect_ {
    let mut absent: Vec<Formula> =
        fresh.atoms.iter().map(|atom| Formula::Literal(atom.clone(), false)).collect();
    let absent = if absent.len() == 1 { absent.remove(0) } else { Formula::Or(absent) };
    let undefined = Formula::Forall(fresh.slots.clone(), Box::new(absent));
    let mut when = when.clone();
    when.end = Formula::And(vec![when.end, undefined]);
    let nowhere = Named { index: function, terms: Vec::new() };
    let change = Change_::Number(Assignment::Assign, nowhere, Number::Constant(f64::NAN));
    Effect_ { forall: forall.to_vec(), when, change }
}

/// True if an object function may be undefined for some arguments.
fn may_be_undefined(task: &Task, function: FunctionId) -> bool {
    let arguments: usize =
        task.function(function).parameters.iter().map(|parameter| parameter.objects.len()).product();
    let given = task.init.objects.iter().filter(|(fluent, _)| fluent.function == function).count();
    let unset =
        |effect: &Effect| matches!(&effect.change, Change::Object(own, None) if own.function == function);
    let mut effects =
        task.actions.iter().flat_map(|action| action.effects.start.iter().chain(&action.effects.end));
    let mut written = task.modules.iter().flat_map(|module| &module.writes);
    given < arguments
        || effects.any(unset)
        || written.any(|place| matches!(place, Written::Object(own) if own.function == function))
}

fn action(task: &Task, schema: usize) -> Action_ {
    let lifted = &task.actions[schema];
    let mut scope = Scope::new(task, lifted.slots);
    for (slot, parameter) in lifted.parameters.iter().enumerate() {
        scope.domains[slot] = parameter.objects.clone();
    }
    let mut fresh = Fresh::default();
    let duration = lifted.duration.as_ref().map(|bounds| {
        bounds
            .iter()
            .map(|b| {
                let at_end = b.when == crate::task::When::End;
                (at_end, b.comparison, scope.number(&b.value, &mut fresh))
            })
            .collect()
    });
    let flows = lifted
        .continuous
        .iter()
        .map(|rate| (scope.fluent(&rate.fluent, &mut fresh), scope.number(&rate.per_second, &mut fresh)))
        .collect();
    let mut condition = scope.timed(&lifted.condition);
    if !fresh.is_empty() {
        let mut parts: Vec<_> = fresh.atoms.into_iter().map(|a| Formula::Literal(a, true)).collect();
        parts.push(condition.start);
        condition.start = Formula::And(parts);
    }
    let mut effects = |effects: &[Effect], at_end: bool, condition: &mut Formula| -> Vec<Effect_> {
        let mut needs = Needs::default();
        let mut effects: Vec<Effect_> =
            effects.iter().map(|effect| scope.effect(effect, at_end, &mut needs)).collect();
        effects.append(&mut needs.forbidden);
        if !needs.conditions.is_empty() {
            needs.conditions.push(std::mem::replace(condition, Formula::And(Vec::new())));
            *condition = Formula::And(needs.conditions);
        }
        effects
    };
    let start_effects = effects(&lifted.effects.start, false, &mut condition.start);
    let end_effects = effects(&lifted.effects.end, true, &mut condition.end);
    Action_ {
        schema: schema as u32,
        arity: lifted.parameters.len(),
        extra: fresh.slots,
        duration,
        condition,
        start_effects,
        end_effects,
        flows,
        domains: scope.domains,
    }
}

/// Converts a lifted task to normal form.
pub(super) fn normalise(task: &Task) -> Normal {
    let rules = task.rules.iter().map(|rule| {
        let mut scope = Scope::new(task, rule.slots);
        for (slot, parameter) in rule.parameters.iter().enumerate() {
            scope.domains[slot] = parameter.objects.clone();
        }
        let body = scope.formula(&rule.body);
        let terms = (0..rule.parameters.len() as u32).map(Term::Slot).collect();
        let stratum = task.predicate(rule.predicate).stratum.unwrap_or(0);
        let head = Pattern { predicate: rule.predicate.0, terms };
        Rule_ { head, domains: scope.domains, body, stratum }
    });
    let mut scope = Scope::new(task, task.goal.slots);
    let goal = scope.formula(&task.goal.body);
    let goal_domains = scope.domains;
    let mut scope = Scope::new(task, 0);
    let metric = task.metric.as_ref().map(|m| scope.number(&m.value, &mut Fresh::default()));
    let mut actions: Vec<Action_> = (0..task.actions.len()).map(|schema| action(task, schema)).collect();
    leave_out_what_nothing_uses(task, &mut actions);
    Normal {
        actions,
        rules: rules.collect(),
        goal,
        goal_domains,
        metric,
        predicate_count: task.predicates.len() + task.functions.len(),
    }
}

/// Term that an effect module writes; its slots are the module's parameters.
pub(super) enum Target {
    Number(Named),
    /// Truth of an atom.
    Truth(Pattern),
    /// Object function: the pattern has no value.
    Object(Pattern),
}

/// Terms that an effect module writes.
pub(super) fn module_writes(task: &Task, module: u32) -> Vec<Target> {
    let module = &task.modules[module as usize];
    let mut scope = Scope::new(task, module.parameters.len());
    let mut fresh = Fresh::default();
    let target = |written: &Written| match written {
        Written::Number(fluent) => Target::Number(scope.fluent(fluent, &mut fresh)),
        Written::Truth(atom) => Target::Truth(scope.atom(atom, &mut fresh)),
        Written::Object(fluent) => Target::Object(Pattern {
            predicate: scope.function_predicate(fluent),
            terms: scope.terms(&fluent.arguments, &mut fresh),
        }),
    };
    module.writes.iter().map(target).collect()
}
