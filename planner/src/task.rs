//! Lifted task: a checked domain and problem in which every name is replaced by an index.
//!
//! Conditions are in negation normal form (`Not` stands only before an atom, an equation of objects, a
//! numeric `=` or a call; `imply` is an `or`). Every variable has a slot of its own: an action's
//! parameters are slots `0..parameters.len()`, quantified variables follow. One flat array with an
//! object per slot binds them all.

use std::sync::Arc;

use rustc_hash::FxHashMap;

use crate::attachment::CallKind;
use crate::diagnostic::{Source, Span};
pub use crate::pddl::ast::{Assignment, Comparison, Modal, When};

macro_rules! identifiers {
    ($($(#[$doc:meta])* $name:ident)*) => {$(
        $(#[$doc])*
        #[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
        pub struct $name(pub u32);

        impl $name {
            /// Identifier as a list index.
            pub fn index(self) -> usize {
                self.0 as usize
            }
        }
    )*};
}

identifiers! {
    /// Index into [`Task::types`].
    TypeId
    /// Index into [`Task::objects`].
    ObjectId
    /// Index into [`Task::predicates`].
    PredicateId
    /// Index into [`Task::functions`].
    FunctionId
    /// Index into [`Task::modules`].
    ModuleId
    /// Index into [`Task::actions`].
    ActionId
    /// Index into [`Task::preferences`].
    PreferenceId
    /// Variable of an action, rule or formula: index into the objects of a binding.
    Slot
}

/// A checked domain and problem, with variables (lifted).
#[derive(Debug, Clone)]
pub struct Task {
    /// The two texts that all spans point into: domain and problem.
    pub sources: Arc<[Source]>,
    /// Name of the domain.
    pub domain: String,
    /// Name of the problem.
    pub problem: String,
    /// Types; the first is `object`.
    pub types: Vec<Type>,
    /// Constants of the domain, then objects of the problem.
    pub objects: Vec<Object>,
    /// Predicates, including derived ones.
    pub predicates: Vec<Predicate>,
    /// Functions, numeric and object-valued.
    pub functions: Vec<Function>,
    /// Semantic modules: external functions that conditions, effects and costs call (PDDL/M).
    pub modules: Vec<Module>,
    /// Rules of the derived predicates, lower strata first.
    pub rules: Vec<Rule>,
    /// Actions, instantaneous and durative.
    pub actions: Vec<Action>,
    /// The initial state.
    pub init: Init,
    /// The goal.
    pub goal: Scoped<Condition>,
    /// Span of the goal.
    pub goal_span: Span,
    /// Trajectory constraints, hard and preferred.
    pub constraints: Vec<Trajectory>,
    /// Preferences, one per name; violations of all conditions under one name are summed.
    pub preferences: Vec<Preference>,
    /// Metric; `None` if the problem has none.
    pub metric: Option<Metric>,
    /// Lines of the problem's `:moduleoptions`.
    pub module_options: Vec<ModuleOption>,
    /// Lines of the problem's `:moduleexitoptions`.
    pub module_exit_options: Vec<ModuleOption>,
    /// Identifier of each object, by name.
    pub(crate) objects_by_name: Arc<FxHashMap<String, ObjectId>>,
}

/// An object type.
#[derive(Debug, Clone)]
pub struct Type {
    /// Name, lower case.
    pub name: String,
    /// Direct supertypes; empty only for `object`.
    pub parents: Vec<TypeId>,
    /// The type itself, then all its supertypes.
    pub ancestors: Vec<TypeId>,
    /// Objects of this type and its subtypes, in ascending order.
    pub objects: Vec<ObjectId>,
    /// Span of the declaration.
    pub span: Span,
}

/// An object of the problem or a constant of the domain.
#[derive(Debug, Clone)]
pub struct Object {
    /// Name, lower case.
    pub name: String,
    /// Declared types; several (from `either`) mean that the object is of all of them.
    pub types: Vec<TypeId>,
    /// Span of the declaration.
    pub span: Span,
}

/// A typed variable; `either` gives several alternative types.
#[derive(Debug, Clone)]
pub struct Parameter {
    /// Name, with the question mark.
    pub name: String,
    /// Alternative types; an object fits if it is of one of them.
    pub types: Vec<TypeId>,
    /// Objects that fit one of the types, in ascending order.
    pub objects: Arc<[ObjectId]>,
    /// Span of the declaration.
    pub span: Span,
}

/// A predicate, basic or derived.
#[derive(Debug, Clone)]
pub struct Predicate {
    /// Name, lower case.
    pub name: String,
    /// Parameters.
    pub parameters: Vec<Parameter>,
    /// Stratum of the predicate's axioms, if derived: axioms of stratum `n` use negated derived
    /// atoms of lower strata only.
    pub stratum: Option<u32>,
    /// Span of the declaration.
    pub span: Span,
}

/// A function, numeric or object-valued.
#[derive(Debug, Clone)]
pub struct Function {
    /// Name, lower case.
    pub name: String,
    /// Parameters.
    pub parameters: Vec<Parameter>,
    /// Types of an object function's values; `None` for a numeric function.
    pub result: Option<Vec<TypeId>>,
    /// Span of the declaration.
    pub span: Span,
}

/// A semantic module of PDDL/M: an external function that the planner calls.
#[derive(Debug, Clone)]
pub struct Module {
    /// Name, case kept.
    pub name: String,
    /// Kind of the module's answer.
    pub kind: CallKind,
    /// Parameters; the terms in `writes` refer to them as slots `0..parameters.len()`.
    pub parameters: Vec<Parameter>,
    /// Terms that an effect module writes, in the order of the values in its answer.
    pub writes: Vec<Written>,
    /// External function as written in the domain (`fn@lib.so`), case kept.
    pub function: String,
    /// Span of the declaration.
    pub span: Span,
}

/// Term that an effect module writes.
#[derive(Debug, Clone, PartialEq)]
pub enum Written {
    /// Value of a numeric function.
    Number(Fluent),
    /// Value of an object function.
    Object(Fluent),
    /// Truth of an atom.
    Truth(Atom),
}

/// A line of `:moduleoptions` or `:moduleexitoptions`.
#[derive(Debug, Clone)]
pub struct ModuleOption {
    /// External function as written (`init@lib`), case kept.
    pub function: String,
    /// Arguments, case kept.
    pub arguments: Vec<String>,
    /// Span of the line.
    pub span: Span,
}

/// Formula or expression, with the number of variable slots that a binding for it needs.
#[derive(Debug, Clone)]
pub struct Scoped<T> {
    /// Number of variable slots.
    pub slots: usize,
    /// Formula or expression.
    pub body: T,
}

/// A term whose value is an object.
#[derive(Debug, Clone, PartialEq)]
pub enum Term {
    /// A variable.
    Variable(Slot),
    /// An object.
    Object(ObjectId),
    /// Value of an object function; may be undefined, and an undefined value equals no object.
    Function(Box<Fluent>),
}

/// A predicate with its arguments.
#[derive(Debug, Clone, PartialEq)]
pub struct Atom {
    /// The predicate.
    pub predicate: PredicateId,
    /// Arguments.
    pub arguments: Vec<Term>,
    /// Span of the atom.
    pub span: Span,
}

/// A function with its arguments.
#[derive(Debug, Clone, PartialEq)]
pub struct Fluent {
    /// The function.
    pub function: FunctionId,
    /// Arguments.
    pub arguments: Vec<Term>,
    /// Span of the term.
    pub span: Span,
}

/// A call of a semantic module.
#[derive(Debug, Clone, PartialEq)]
pub struct CallTerm {
    /// The module.
    pub module: ModuleId,
    /// Arguments.
    pub arguments: Vec<Term>,
    /// Span of the call.
    pub span: Span,
}

/// A condition in negation normal form.
#[derive(Debug, Clone, PartialEq)]
pub enum Condition {
    /// Conjunction; empty is true.
    And(Vec<Condition>),
    /// Disjunction; empty is false.
    Or(Vec<Condition>),
    /// Negation of a leaf: `Atom`, `Same`, `Call`, or a `Compare` for equality.
    Not(Box<Condition>),
    /// Universal quantification.
    Forall(Vec<Quantified>, Box<Condition>),
    /// Existential quantification.
    Exists(Vec<Quantified>, Box<Condition>),
    /// A fact, basic or derived.
    Atom(Atom),
    /// Equality of two object terms.
    Same(Box<[Term; 2]>, Span),
    /// Numeric comparison; false if a side is undefined.
    Compare(Comparison, Box<[Expression; 2]>, Span),
    /// Call of a condition module.
    Call(CallTerm),
}

impl Condition {
    /// The condition that always holds.
    pub const TRUE: Condition = Condition::And(Vec::new());

    /// True for the empty conjunction.
    pub fn is_true(&self) -> bool {
        matches!(self, Condition::And(parts) if parts.is_empty())
    }
}

/// Quantified variable with its slot.
#[derive(Debug, Clone)]
pub struct Quantified {
    /// Slot of the variable.
    pub slot: Slot,
    /// Name, type and objects.
    pub parameter: Parameter,
}

impl PartialEq for Quantified {
    fn eq(&self, other: &Self) -> bool {
        self.slot == other.slot && self.parameter.types == other.parameter.types
    }
}

/// A numeric expression.
#[derive(Debug, Clone, PartialEq)]
pub enum Expression {
    /// A constant.
    Number(f64),
    /// Value of a numeric function; may be undefined.
    Fluent(Fluent),
    /// A sum.
    Add(Vec<Expression>),
    /// Difference of two numbers.
    Subtract(Box<[Expression; 2]>),
    /// A product.
    Multiply(Vec<Expression>),
    /// Quotient of two numbers.
    Divide(Box<[Expression; 2]>),
    /// Negation of a number.
    Negative(Box<Expression>),
    /// `?duration` of the action, in seconds.
    Duration,
    /// Makespan of the plan, seconds (metrics only); the number of steps for plans of instantaneous
    /// actions.
    TotalTime,
    /// Number of violations of a preference (metrics only).
    Violated(PreferenceId),
    /// Number that a cost module answers.
    Call(CallTerm),
}

/// Values for the start, the over-all interval and the end of an action; instantaneous actions use
/// `start` only.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Timed<T> {
    /// Value for the start.
    pub start: T,
    /// Value for "over all": the open interval between start and end.
    pub over_all: T,
    /// Value for the end.
    pub end: T,
}

impl Default for Condition {
    fn default() -> Self {
        Condition::TRUE
    }
}

/// An action schema, instantaneous or durative.
#[derive(Debug, Clone)]
pub struct Action {
    /// Name, lower case.
    pub name: String,
    /// Parameters; parameter `i` is slot `i`.
    pub parameters: Vec<Parameter>,
    /// Number of variable slots, including those of quantified variables.
    pub slots: usize,
    /// Bounds on the duration (all must hold); `None` for an instantaneous action.
    pub duration: Option<Vec<DurationBound>>,
    /// Conditions at start, over all and at end.
    pub condition: Timed<Condition>,
    /// Effects at start and at end (`over_all` is always empty).
    pub effects: Timed<Vec<Effect>>,
    /// Continuous effects (`#t`): numbers that change at a rate over the whole duration.
    pub continuous: Vec<Rate>,
    /// Calls of grounding modules; each proposes the values of one further argument.
    pub grounding: Vec<CallTerm>,
    /// Preferred conditions of the action, each with its preference.
    pub preferences: Vec<(PreferenceId, Timed<Condition>)>,
    /// Span of the action's name.
    pub span: Span,
}

impl Action {
    /// True for durative actions.
    pub fn is_durative(&self) -> bool {
        self.duration.is_some()
    }
}

/// Bound on `?duration`, in seconds.
#[derive(Debug, Clone)]
pub struct DurationBound {
    /// Time at which the bound's value is evaluated: start or end.
    pub when: When,
    /// Comparison with `?duration` on the left-hand side: `<=`, `=`, `>=`, `<` or `>`.
    pub comparison: Comparison,
    /// Value of the bound, in seconds.
    pub value: Expression,
    /// Span of the bound.
    pub span: Span,
}

/// Conditional effect, applied for every binding of its quantified variables.
#[derive(Debug, Clone, PartialEq)]
pub struct Effect {
    /// Quantified variables of the effect.
    pub forall: Vec<Quantified>,
    /// Condition of the effect. An effect at start has a `start` condition only; for an effect at end,
    /// `start` and `over_all` are conditions on earlier times of the same action.
    pub when: Timed<Condition>,
    /// Change that the effect makes.
    pub change: Change,
    /// Span of the effect.
    pub span: Span,
}

/// Change made by an effect. Deletions are applied before additions.
#[derive(Debug, Clone, PartialEq)]
pub enum Change {
    /// The atom becomes true.
    Add(Atom),
    /// The atom becomes false.
    Delete(Atom),
    /// The numeric fluent is assigned, increased, decreased or scaled by the value.
    Number(Assignment, Fluent, Expression),
    /// The object function gets the value of the term, or becomes undefined (`None`).
    Object(Fluent, Option<Term>),
    /// An effect module gives new values to the terms that it writes.
    Call(CallTerm),
}

/// Continuous effect: a number that changes at a rate while an action runs.
#[derive(Debug, Clone, PartialEq)]
pub struct Rate {
    /// Number that changes.
    pub fluent: Fluent,
    /// Change per second, sign included.
    pub per_second: Expression,
    /// Span of the effect.
    pub span: Span,
}

/// A rule of a derived predicate: the head is true if the body is.
#[derive(Debug, Clone)]
pub struct Rule {
    /// The predicate of the head.
    pub predicate: PredicateId,
    /// Variables of the head; variable `i` is slot `i`.
    pub parameters: Vec<Parameter>,
    /// Number of variable slots, including those of quantified variables.
    pub slots: usize,
    /// The body.
    pub body: Condition,
    /// Span of the head.
    pub span: Span,
}

/// A ground fact: a predicate with objects as arguments.
#[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct Fact {
    /// The predicate.
    pub predicate: PredicateId,
    /// Arguments.
    pub arguments: Box<[ObjectId]>,
}

/// A ground fluent: a function with objects as arguments.
#[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct GroundFluent {
    /// The function.
    pub function: FunctionId,
    /// Arguments.
    pub arguments: Box<[ObjectId]>,
}

/// The initial state in the order of the text.
#[derive(Debug, Clone, Default)]
pub struct Init {
    /// True facts; all others are false.
    pub facts: Vec<Fact>,
    /// Values of numeric functions; all others are undefined.
    pub numbers: Vec<(GroundFluent, f64)>,
    /// Values of object functions; all others are undefined.
    pub objects: Vec<(GroundFluent, ObjectId)>,
    /// Timed initial literals, in order of time.
    pub timed: Vec<TimedInitial>,
}

/// A timed initial literal, or a timed change of a number or object function.
#[derive(Debug, Clone)]
pub struct TimedInitial {
    /// Time of the change, in seconds from the beginning of the plan.
    pub time_s: f64,
    /// Change that happens.
    pub change: GroundChange,
    /// Span of the literal.
    pub span: Span,
}

/// A change without variables.
#[derive(Debug, Clone, PartialEq)]
pub enum GroundChange {
    /// The fact becomes true.
    Add(Fact),
    /// The fact becomes false.
    Delete(Fact),
    /// The number gets this value.
    Number(GroundFluent, f64),
    /// The object function gets this value.
    Object(GroundFluent, ObjectId),
}

/// A modal constraint of PDDL3 on the trajectory of states.
#[derive(Debug, Clone)]
pub struct Trajectory {
    /// Quantified variables; the constraint holds for all their objects.
    pub forall: Vec<Quantified>,
    /// The operator.
    pub operator: Modal,
    /// Times that the operator takes, in seconds, such as `t` of `(within t f)`; empty if it takes
    /// none.
    pub times_s: Vec<f64>,
    /// Conditions that the operator takes: one, or two for operators such as `sometime-after`.
    pub conditions: Vec<Condition>,
    /// Number of variable slots.
    pub slots: usize,
    /// Preference of the constraint, violated once per binding of `forall` that breaks it; `None` for a
    /// hard constraint.
    pub preference: Option<PreferenceId>,
    /// Span of the constraint.
    pub span: Span,
}

/// A named preference. Constraints and action conditions refer to it by identifier.
#[derive(Debug, Clone)]
pub struct Preference {
    /// Name.
    pub name: String,
    /// Preferred conditions on the final state; each binding of a condition's quantified variables that
    /// violates it counts as one violation.
    pub goals: Vec<PreferredGoal>,
}

/// A condition on the last state that is only preferred.
#[derive(Debug, Clone)]
pub struct PreferredGoal {
    /// Quantified variables; each binding that violates the condition counts as one violation.
    pub forall: Vec<Quantified>,
    /// The condition.
    pub condition: Condition,
    /// Number of variable slots.
    pub slots: usize,
    /// Span of the condition.
    pub span: Span,
}

/// The metric of plans.
#[derive(Debug, Clone)]
pub struct Metric {
    /// True to minimise, false to maximise.
    pub minimise: bool,
    /// Expression to minimise or maximise.
    pub value: Expression,
    /// Span of the metric.
    pub span: Span,
}

impl Task {
    /// Type by index.
    pub fn type_of(&self, id: TypeId) -> &Type {
        &self.types[id.index()]
    }

    /// Object by index.
    pub fn object(&self, id: ObjectId) -> &Object {
        &self.objects[id.index()]
    }

    /// Predicate by index.
    pub fn predicate(&self, id: PredicateId) -> &Predicate {
        &self.predicates[id.index()]
    }

    /// Function by index.
    pub fn function(&self, id: FunctionId) -> &Function {
        &self.functions[id.index()]
    }

    /// Module by index.
    pub fn module(&self, id: ModuleId) -> &Module {
        &self.modules[id.index()]
    }

    /// Action by index.
    pub fn action(&self, id: ActionId) -> &Action {
        &self.actions[id.index()]
    }

    /// True if an object is of at least one of the types.
    pub fn fits(&self, object: ObjectId, types: &[TypeId]) -> bool {
        self.object(object)
            .types
            .iter()
            .any(|&own| types.iter().any(|wanted| self.type_of(own).ancestors.contains(wanted)))
    }

    /// True if plans carry times: some action is durative, or there are timed initial literals.
    pub fn is_temporal(&self) -> bool {
        !self.init.timed.is_empty() || self.actions.iter().any(Action::is_durative)
    }
}
