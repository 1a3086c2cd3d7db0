//! Syntax tree of a domain or problem file: names unresolved, every node with its span.

use crate::attachment::CallKind;
use crate::diagnostic::Span;

/// Case-folded name or token (names of modules and their functions keep their case in `text`).
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct Symbol(pub u32);

/// Name with its span.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Name {
    /// The case-folded name.
    pub symbol: Symbol,
    /// Span in the source.
    pub span: Span,
}

/// Entry of a typed list, such as `?x - (either car truck)`.
#[derive(Debug, Clone, PartialEq)]
pub struct Typed {
    /// Name that is declared.
    pub name: Name,
    /// Types, the alternatives of an `either`; empty if untyped.
    pub types: Vec<Name>,
}

/// Declared predicate, or head of a derived one.
#[derive(Debug, Clone, PartialEq)]
pub struct Signature {
    /// Name.
    pub name: Name,
    /// Parameters.
    pub parameters: Vec<Typed>,
}

/// Declared function; `result` is empty or `number` for numeric ones.
#[derive(Debug, Clone, PartialEq)]
pub struct FunctionDeclaration {
    /// Name and parameters.
    pub signature: Signature,
    /// Types of the function's value.
    pub result: Vec<Name>,
}

/// A declared module: `(can-see ?p - pose conditionchecker fn@lib.so)`.
#[derive(Debug, Clone, PartialEq)]
pub struct ModuleDeclaration {
    /// Name and parameters.
    pub signature: Signature,
    /// The fluents that an effect module writes.
    pub writes: Vec<TermAst>,
    /// Kind of the module.
    pub kind: CallKind,
    /// The token `fn@lib.so`.
    pub function: Name,
}

/// An option line `(init@lib arg …)`.
#[derive(Debug, Clone, PartialEq)]
pub struct ModuleOptionAst {
    /// The token `init@lib`.
    pub function: Name,
    /// Arguments.
    pub arguments: Vec<Name>,
}

/// A call of a module, `[name arg …]`.
#[derive(Debug, Clone, PartialEq)]
pub struct CallAst {
    /// The module's name.
    pub name: Name,
    /// Arguments.
    pub arguments: Vec<TermAst>,
    /// The whole call.
    pub span: Span,
}

/// Something with a value: an object or a number.
#[derive(Debug, Clone, PartialEq)]
pub enum TermAst {
    /// A plain name: an object, or a function without parameters written without parentheses.
    Name(Name),
    /// `?x`
    Variable(Name),
    /// `3.5`, and the word, which may be an object's name
    Number(f64, Name),
    /// `(f a b)`
    Apply {
        /// The function.
        name: Name,
        /// Arguments.
        arguments: Vec<TermAst>,
        /// The whole term.
        span: Span,
    },
    /// `(+ a b …)`
    Arithmetic {
        /// The operation.
        operator: Arithmetic,
        /// Operands, at least one.
        operands: Vec<TermAst>,
        /// The whole term.
        span: Span,
    },
    /// `[cost a b]`
    Call(CallAst),
    /// `?duration`
    Duration(Span),
    /// `#t`
    ContinuousTime(Span),
    /// `total-time`
    TotalTime(Span),
    /// `(is-violated name)`
    Violated(Name),
}

/// Operations on numbers.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Arithmetic {
    /// `+`
    Add,
    /// `-`, with one operand the negative
    Subtract,
    /// `*`
    Multiply,
    /// `/`
    Divide,
}

/// Comparisons.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, serde::Serialize, serde::Deserialize)]
pub enum Comparison {
    /// `<`
    Less,
    /// `<=`
    LessOrEqual,
    /// `=`
    Equal,
    /// `>=`
    GreaterOrEqual,
    /// `>`
    Greater,
}

/// Time specifier of a part of a durative action.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum When {
    /// `at start`
    Start,
    /// `over all`
    OverAll,
    /// `at end`
    End,
}

/// A condition, goal or constraint.
#[derive(Debug, Clone, PartialEq)]
pub enum Formula {
    /// `(and …)`, also `()`
    And(Vec<Formula>),
    /// `(or …)`
    Or(Vec<Formula>),
    /// `(not f)`
    Not(Box<Formula>),
    /// `(imply f g)`
    Imply(Box<Formula>, Box<Formula>),
    /// `(exists (…) f)`
    Exists(Vec<Typed>, Box<Formula>),
    /// `(forall (…) f)`
    Forall(Vec<Typed>, Box<Formula>),
    /// `(p a b)`
    Atom {
        /// The predicate.
        name: Name,
        /// Arguments.
        arguments: Vec<TermAst>,
        /// The whole atom.
        span: Span,
    },
    /// `(= a b)`, `(< a b)`, …
    Compare {
        /// The comparison.
        comparison: Comparison,
        /// Both sides.
        sides: Box<[TermAst; 2]>,
        /// The whole comparison.
        span: Span,
    },
    /// `[can-see a b]`
    Call(CallAst),
    /// `(at start f)`, …
    Timed(When, Box<Formula>, Span),
    /// `(preference name f)`
    Preference(Option<Name>, Box<Formula>, Span),
    /// `(sometime f)` and the other modal operators of PDDL3
    Modal {
        /// The operator.
        operator: Modal,
        /// Numbers (times).
        times_s: Vec<f64>,
        /// Formulas.
        formulas: Vec<Formula>,
        /// The whole constraint.
        span: Span,
    },
}

/// Modal operators of PDDL3.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, serde::Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Modal {
    /// `(at end f)`: in the last state
    AtEnd,
    /// `(always f)`
    Always,
    /// `(sometime f)`
    Sometime,
    /// `(within t f)`
    Within,
    /// `(at-most-once f)`
    AtMostOnce,
    /// `(sometime-after f g)`
    SometimeAfter,
    /// `(sometime-before f g)`
    SometimeBefore,
    /// `(always-within t f g)`
    AlwaysWithin,
    /// `(hold-during t u f)`
    HoldDuring,
    /// `(hold-after t f)`
    HoldAfter,
}

/// Five operators that change a fluent.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Assignment {
    /// `assign`
    Assign,
    /// `increase`
    Increase,
    /// `decrease`
    Decrease,
    /// `scale-up`
    ScaleUp,
    /// `scale-down`
    ScaleDown,
}

/// An effect.
#[derive(Debug, Clone, PartialEq)]
pub enum EffectAst {
    /// `(and …)`
    And(Vec<EffectAst>),
    /// `(forall (…) e)`
    Forall(Vec<Typed>, Box<EffectAst>),
    /// `(when f e)`
    When(Formula, Box<EffectAst>),
    /// `(p a b)` or `(not (p a b))`
    Literal {
        /// True if the atom becomes false.
        negated: bool,
        /// The predicate.
        name: Name,
        /// Arguments.
        arguments: Vec<TermAst>,
        /// The whole literal.
        span: Span,
    },
    /// `(increase (f a) e)`, …
    Assign {
        /// Kind of change.
        assignment: Assignment,
        /// The fluent that changes.
        fluent: TermAst,
        /// The new value, or the amount of the change.
        value: TermAst,
        /// The whole effect.
        span: Span,
    },
    /// `[update a b]`
    Call(CallAst),
    /// `(at end e)`, …
    Timed(When, Box<EffectAst>, Span),
}

/// Bound on a duration, `(<= ?duration e)`, at start or end.
#[derive(Debug, Clone, PartialEq)]
pub struct DurationBoundAst {
    /// Time at which the bound is evaluated.
    pub when: When,
    /// Comparison with `?duration` on the left-hand side.
    pub comparison: Comparison,
    /// The bound.
    pub value: TermAst,
    /// The whole bound.
    pub span: Span,
}

/// An action, instantaneous or durative.
#[derive(Debug, Clone, PartialEq)]
pub struct ActionAst {
    /// Name.
    pub name: Name,
    /// True for a `:durative-action`.
    pub durative: bool,
    /// Parameters.
    pub parameters: Vec<Typed>,
    /// Calls of grounding modules.
    pub grounding: Vec<CallAst>,
    /// Bounds on the duration.
    pub duration: Vec<DurationBoundAst>,
    /// Precondition.
    pub condition: Option<Formula>,
    /// Effect.
    pub effect: Option<EffectAst>,
    /// The whole declaration.
    pub span: Span,
}

/// A derived predicate's rule.
#[derive(Debug, Clone, PartialEq)]
pub struct Derived {
    /// Head.
    pub head: Signature,
    /// The condition under which the head is true.
    pub body: Formula,
    /// The whole rule.
    pub span: Span,
}

/// A domain file.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Domain {
    /// True if a part of the domain could not be parsed.
    pub unread: bool,
    /// Name.
    pub name: Option<Name>,
    /// Declared requirements.
    pub requirements: Vec<Name>,
    /// Declared types.
    pub types: Vec<Typed>,
    /// `:oplinit`: options of the modules, independent of the problem.
    pub module_options: Vec<ModuleOptionAst>,
    /// Declared semantic modules.
    pub modules: Vec<ModuleDeclaration>,
    /// Declared constants.
    pub constants: Vec<Typed>,
    /// Declared predicates.
    pub predicates: Vec<Signature>,
    /// Declared functions.
    pub functions: Vec<FunctionDeclaration>,
    /// Trajectory constraints.
    pub constraints: Vec<Formula>,
    /// Rules of derived predicates.
    pub derived: Vec<Derived>,
    /// Actions of both kinds.
    pub actions: Vec<ActionAst>,
}

/// An element of the initial state.
#[derive(Debug, Clone, PartialEq)]
pub enum Initial {
    /// `(p a b)`, or `(not (p a b))`
    Literal {
        /// True for a negative literal.
        negated: bool,
        /// The predicate.
        name: Name,
        /// Arguments.
        arguments: Vec<Name>,
        /// The whole literal.
        span: Span,
    },
    /// `(= (f a b) v)`
    Value {
        /// The function.
        name: Name,
        /// Arguments.
        arguments: Vec<Name>,
        /// Value.
        value: InitialValue,
        /// The whole equation.
        span: Span,
    },
    /// `(at 3.5 (p a b))`
    At(f64, Box<Initial>),
}

/// Value of a function in the initial state.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum InitialValue {
    /// A number, and the word, which may be an object's name.
    Number(f64, Name),
    /// An object.
    Object(Name),
}

/// The metric of a problem.
#[derive(Debug, Clone, PartialEq)]
pub struct MetricAst {
    /// True to minimise, false to maximise.
    pub minimise: bool,
    /// The expression that is optimised.
    pub value: TermAst,
    /// The whole section.
    pub span: Span,
}

/// A problem file.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct ProblemAst {
    /// True if a part of the problem could not be parsed.
    pub unread: bool,
    /// Name.
    pub name: Option<Name>,
    /// Name of the domain that the problem refers to.
    pub domain: Option<Name>,
    /// Requirements repeated in the problem.
    pub requirements: Vec<Name>,
    /// `:moduleoptions`
    pub module_options: Vec<ModuleOptionAst>,
    /// `:moduleexitoptions`
    pub module_exit_options: Vec<ModuleOptionAst>,
    /// Objects.
    pub objects: Vec<Typed>,
    /// The initial state, timed literals included.
    pub initial: Vec<Initial>,
    /// The goal.
    pub goal: Option<Formula>,
    /// Span of the whole goal section.
    pub goal_span: Span,
    /// Trajectory constraints.
    pub constraints: Vec<Formula>,
    /// The metric.
    pub metric: Option<MetricAst>,
}
