//! The lifted task: a checked domain and problem with every name looked up.
//!
//! Conditions are in negation normal form (`Not` stands only before an atom, an equation of objects, a numeric
//! `=` or a call; `imply` is an `or`). Variables are slots: an action's parameters are slots `0..parameters.len()`, quantified
//! variables follow, each with a slot of its own, so that one flat array of `slots` objects binds everything.

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
            /// Index into the task's list.
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
    /// Variable of an action, rule or formula: index into a binding.
    Slot
}

/// A checked domain and problem.
#[derive(Debug, Clone)]
pub struct Task {
    /// The two texts that all spans point into: domain and problem.
    pub sources: Arc<[Source]>,
    /// Name of the domain.
    pub domain: String,
    /// Name of the problem.
    pub problem: String,
    /// Types; number 0 is `object`.
    pub types: Vec<Type>,
    /// Constants of the domain, then objects of the problem.
    pub objects: Vec<Object>,
    /// Predicates, including derived ones.
    pub predicates: Vec<Predicate>,
    /// Functions, numeric and object-valued.
    pub functions: Vec<Function>,
    /// Semantic modules.
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
    /// Trajectory constraints; preferred ones refer to their preference.
    pub constraints: Vec<Trajectory>,
    /// Preferences by name; a shared name sums the violations.
    pub preferences: Vec<Preference>,
    /// Metric.
    pub metric: Option<Metric>,
    /// `:moduleoptions` of the problem.
    pub module_options: Vec<ModuleOption>,
    /// `:moduleexitoptions` of the problem.
    pub module_exit_options: Vec<ModuleOption>,
    /// Objects by name.
    pub(crate) objects_by_name: Arc<FxHashMap<String, ObjectId>>,
}

/// A type.
#[derive(Debug, Clone)]
pub struct Type {
    /// Name, lower case.
    pub name: String,
    /// Direct supertypes; none for `object` alone.
    pub parents: Vec<TypeId>,
    /// The type itself, then all its supertypes.
    pub ancestors: Vec<TypeId>,
    /// Objects of this type and its subtypes, ascending.
    pub objects: Vec<ObjectId>,
    /// Span of the declaration.
    pub span: Span,
}

/// An object or constant.
#[derive(Debug, Clone)]
pub struct Object {
    /// Name, lower case.
    pub name: String,
    /// Declared types; several (from `either`) mean that the object is of all of them.
    pub types: Vec<TypeId>,
    /// Span of the declaration.
    pub span: Span,
}

/// Variable with the alternatives of its type.
#[derive(Debug, Clone)]
pub struct Parameter {
    /// Name, with the question mark.
    pub name: String,
    /// Types of which a fitting object has at least one.
    pub types: Vec<TypeId>,
    /// Objects that fit, in rising order.
    pub objects: Arc<[ObjectId]>,
    /// Span of the declaration.
    pub span: Span,
}

/// A predicate.
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

/// A function.
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

/// A semantic module of PDDL/M.
#[derive(Debug, Clone)]
pub struct Module {
    /// Name, case kept.
    pub name: String,
    /// Kind.
    pub kind: CallKind,
    /// Parameters: slots `0..parameters.len()` of `writes`.
    pub parameters: Vec<Parameter>,
    /// Terms written by an effect module, over its parameters, in answer order.
    pub writes: Vec<Written>,
    /// Binding as written, `fn@lib.so`, case kept.
    pub function: String,
    /// Span of the declaration.
    pub span: Span,
}

/// Term written by an effect module.
#[derive(Debug, Clone, PartialEq)]
pub enum Written {
    /// A number.
    Number(Fluent),
    /// Value of an object function.
    Object(Fluent),
    /// The truth of an atom.
    Truth(Atom),
}

/// A line of `:moduleoptions`.
#[derive(Debug, Clone)]
pub struct ModuleOption {
    /// The token `init@lib`, case kept.
    pub function: String,
    /// Arguments, case kept.
    pub arguments: Vec<String>,
    /// Span.
    pub span: Span,
}

/// Formula or expression with its number of slots.
#[derive(Debug, Clone)]
pub struct Scoped<T> {
    /// Number of slots.
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
    /// Value of an object function; may be undefined, which equals nothing.
    Function(Box<Fluent>),
}

/// A predicate with its arguments.
#[derive(Debug, Clone, PartialEq)]
pub struct Atom {
    /// The predicate.
    pub predicate: PredicateId,
    /// Arguments.
    pub arguments: Vec<Term>,
    /// Span.
    pub span: Span,
}

/// A function with its arguments.
#[derive(Debug, Clone, PartialEq)]
pub struct Fluent {
    /// The function.
    pub function: FunctionId,
    /// Arguments.
    pub arguments: Vec<Term>,
    /// Span.
    pub span: Span,
}

/// A call of a semantic module.
#[derive(Debug, Clone, PartialEq)]
pub struct CallTerm {
    /// The module.
    pub module: ModuleId,
    /// Arguments.
    pub arguments: Vec<Term>,
    /// Span.
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
    /// Slot.
    pub slot: Slot,
    /// Name, type and objects.
    pub parameter: Parameter,
}

impl PartialEq for Quantified {
    fn eq(&self, other: &Self) -> bool {
        self.slot == other.slot && self.parameter.types == other.parameter.types
    }
}

/// A number.
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
    /// The negative.
    Negative(Box<Expression>),
    /// `?duration` of the action, in seconds.
    Duration,
    /// Makespan of the plan, seconds (metrics only); the number of steps for plans of instantaneous
    /// actions.
    TotalTime,
    /// Number of violations of preferences of this name; in metrics alone.
    Violated(PreferenceId),
    /// Answer of a cost module.
    Call(CallTerm),
}

/// Parts of an action at start, over all and at end; an instantaneous action has everything at
/// start.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Timed<T> {
    /// At start.
    pub start: T,
    /// Over all: the open interval between start and end.
    pub over_all: T,
    /// At end.
    pub end: T,
}

impl Default for Condition {
    fn default() -> Self {
        Condition::TRUE
    }
}

/// An action.
#[derive(Debug, Clone)]
pub struct Action {
    /// Name, lower case.
    pub name: String,
    /// Parameters: slots `0..parameters.len()`.
    pub parameters: Vec<Parameter>,
    /// Slots in all, quantified variables included.
    pub slots: usize,
    /// Bounds on the duration (all must hold); `None` for an instantaneous action.
    pub duration: Option<Vec<DurationBound>>,
    /// Precondition.
    pub condition: Timed<Condition>,
    /// Effects at start and at end (`over_all` is always empty).
    pub effects: Timed<Vec<Effect>>,
    /// Changes at a rate over the whole duration, from `#t`.
    pub continuous: Vec<Rate>,
    /// Calls of grounding modules that propose parameters.
    pub grounding: Vec<CallTerm>,
    /// Preferences over the action's conditions; every violation counts.
    pub preferences: Vec<(PreferenceId, Timed<Condition>)>,
    /// Span of the name.
    pub span: Span,
}

impl Action {
    /// True for durative actions.
    pub fn is_durative(&self) -> bool {
        self.duration.is_some()
    }
}

/// `?duration` compared with a bound, in seconds.
#[derive(Debug, Clone)]
pub struct DurationBound {
    /// Time at which the bound is evaluated: start or end.
    pub when: When,
    /// Comparison with `?duration` on the left-hand side: `<=`, `=`, `>=`, `<` or `>`.
    pub comparison: Comparison,
    /// The bound.
    pub value: Expression,
    /// Span.
    pub span: Span,
}

/// Conditional change, for all objects of its quantified variables.
#[derive(Debug, Clone, PartialEq)]
pub struct Effect {
    /// Quantified variables.
    pub forall: Vec<Quantified>,
    /// Condition of the effect. An effect at start has a `start` condition only; for one at end,
    /// `start` and `over_all` are conditions on those earlier times.
    pub when: Timed<Condition>,
    /// Change.
    pub change: Change,
    /// Span.
    pub span: Span,
}

/// Change by an effect. Deletions happen before additions.
#[derive(Debug, Clone, PartialEq)]
pub enum Change {
    /// The atom becomes true.
    Add(Atom),
    /// The atom becomes false.
    Delete(Atom),
    /// A number changes.
    Number(Assignment, Fluent, Expression),
    /// Assigns an object function, or makes it undefined.
    Object(Fluent, Option<Term>),
    /// Writes the fluents of an effect module.
    Call(CallTerm),
}

/// A number that changes at a rate while an action runs.
#[derive(Debug, Clone, PartialEq)]
pub struct Rate {
    /// The number.
    pub fluent: Fluent,
    /// Change per second, sign included.
    pub per_second: Expression,
    /// Span.
    pub span: Span,
}

/// A rule of a derived predicate: the head is true if the body is.
#[derive(Debug, Clone)]
pub struct Rule {
    /// The predicate of the head.
    pub predicate: PredicateId,
    /// Variables: slots `0..parameters.len()`.
    pub parameters: Vec<Parameter>,
    /// Slots in all.
    pub slots: usize,
    /// The body.
    pub body: Condition,
    /// Span of the head.
    pub span: Span,
}

/// A ground fact.
#[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct Fact {
    /// The predicate.
    pub predicate: PredicateId,
    /// Arguments.
    pub arguments: Box<[ObjectId]>,
}

/// A ground fluent.
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
    /// Numbers; every other one is undefined.
    pub numbers: Vec<(GroundFluent, f64)>,
    /// Values of object functions; every other one is undefined.
    pub objects: Vec<(GroundFluent, ObjectId)>,
    /// Timed initial literals, in order of time.
    pub timed: Vec<TimedInitial>,
}

/// A timed initial literal or fluent.
#[derive(Debug, Clone)]
pub struct TimedInitial {
    /// When, from the beginning of the plan.
    pub time_s: f64,
    /// Change.
    pub change: GroundChange,
    /// Span.
    pub span: Span,
}

/// A change without variables.
#[derive(Debug, Clone, PartialEq)]
pub enum GroundChange {
    /// The fact becomes true.
    Add(Fact),
    /// The fact becomes false.
    Delete(Fact),
    /// The number becomes this.
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
    /// Times, in seconds.
    pub times_s: Vec<f64>,
    /// One or two conditions.
    pub conditions: Vec<Condition>,
    /// Slots in all.
    pub slots: usize,
    /// Preference of the constraint, counted per binding of `forall`; `None` for a hard constraint.
    pub preference: Option<PreferenceId>,
    /// Span.
    pub span: Span,
}

/// Named preference with its goal conditions; constraints and action conditions refer to it.
#[derive(Debug, Clone)]
pub struct Preference {
    /// Name.
    pub name: String,
    /// Conditions on the final state; each counts one violation per binding of its quantified
    /// variables.
    pub goals: Vec<PreferredGoal>,
}

/// A condition on the last state that is only preferred.
#[derive(Debug, Clone)]
pub struct PreferredGoal {
    /// Quantified variables; each binding is an instance.
    pub forall: Vec<Quantified>,
    /// The condition.
    pub condition: Condition,
    /// Slots in all.
    pub slots: usize,
    /// Span.
    pub span: Span,
}

/// The metric.
#[derive(Debug, Clone)]
pub struct Metric {
    /// True to minimise, false to maximise.
    pub minimise: bool,
    /// Expression to minimise or maximise.
    pub value: Expression,
    /// Span.
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

    /// True if an object is of one of the types.
    pub fn fits(&self, object: ObjectId, types: &[TypeId]) -> bool {
        self.object(object)
            .types
            .iter()
            .any(|&own| types.iter().any(|wanted| self.type_of(own).ancestors.contains(wanted)))
    }

    /// True if an action takes time or a timed initial literal exists: plans then carry times.
    pub fn is_temporal(&self) -> bool {
        !self.init.timed.is_empty() || self.actions.iter().any(Action::is_durative)
    }
}
