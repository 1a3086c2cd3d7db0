//! Syntax tree of a domain or problem file. Names are not resolved yet; every node has its span in
//! the text.

use crate::attachment::CallKind;
use crate::diagnostic::Span;

/// Interned, case-folded name or token; an index into [`Symbols`](super::lex::Symbols).
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct Symbol(pub u32);

/// Name with its span.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Name {
    /// Case-folded name.
    pub symbol: Symbol,
    /// Span of the name in the source text.
    pub span: Span,
}

/// Entry of a typed list, such as `?x - (either car truck)`.
#[derive(Debug, Clone, PartialEq)]
pub struct Typed {
    /// Name that is declared, such as `?x`.
    pub name: Name,
    /// Declared types: one, or the alternatives of an `either`; empty if untyped.
    pub types: Vec<Name>,
}

/// Head of a declaration: a predicate, function or module with its parameters.
#[derive(Debug, Clone, PartialEq)]
pub struct Signature {
    /// Name of the predicate, function or module.
    pub name: Name,
    /// Parameters, each with its types.
    pub parameters: Vec<Typed>,
}

/// Declared function.
#[derive(Debug, Clone, PartialEq)]
pub struct FunctionDeclaration {
    /// Name and parameters of the function.
    pub signature: Signature,
    /// Types of the function's value; empty or `number` for a numeric function.
    pub result: Vec<Name>,
}

/// Declaration of a module, such as `(can-see ?p - pose conditionchecker fn@lib.so)`.
#[derive(Debug, Clone, PartialEq)]
pub struct ModuleDeclaration {
    /// Name and parameters of the module.
    pub signature: Signature,
    /// Functions or predicates that an effect module writes, with arguments; empty for other kinds.
    pub writes: Vec<TermAst>,
    /// Kind of the module.
    pub kind: CallKind,
    /// Token that names the module's implementation: `fn@lib.so`.
    pub function: Name,
}

/// Option of a module, such as `(init@lib arg …)`.
#[derive(Debug, Clone, PartialEq)]
pub struct ModuleOptionAst {
    /// Token that names the option's function: `init@lib`.
    pub function: Name,
    /// Arguments of the option.
    pub arguments: Vec<Name>,
}

/// Call of a module, `[name arg …]`.
#[derive(Debug, Clone, PartialEq)]
pub struct CallAst {
    /// Name of the module.
    pub name: Name,
    /// Arguments of the call.
    pub arguments: Vec<TermAst>,
    /// Span of the whole call.
    pub span: Span,
}

/// Term whose value is an object or a number.
#[derive(Debug, Clone, PartialEq)]
pub enum TermAst {
    /// Name without parentheses: an object, or a function without parameters.
    Name(Name),
    /// Variable `?x`.
    Variable(Name),
    /// Number, such as `3.5`, with the token itself, which may be the name of an object.
    Number(f64, Name),
    /// Function with arguments, `(f a b)`.
    Apply {
        /// Name of the function.
        name: Name,
        /// Arguments of the function.
        arguments: Vec<TermAst>,
        /// Span of the whole term.
        span: Span,
    },
    /// Arithmetic, such as `(+ a b …)`.
    Arithmetic {
        /// Operation.
        operator: Arithmetic,
        /// Operands, at least one.
        operands: Vec<TermAst>,
        /// Span of the whole term.
        span: Span,
    },
    /// Call of a cost module, such as `[cost a b]`.
    Call(CallAst),
    /// `?duration` of the action.
    Duration(Span),
    /// `#t`, the time in a continuous effect.
    ContinuousTime(Span),
    /// `total-time`, in a metric.
    TotalTime(Span),
    /// `(is-violated name)`: number of violations of a preference, in a metric.
    Violated(Name),
}

/// Arithmetic operation.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Arithmetic {
    /// `+`
    Add,
    /// `-`; negation with one operand
    Subtract,
    /// `*`
    Multiply,
    /// `/`
    Divide,
}

/// Comparison of two terms.
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

/// Condition, goal or constraint.
#[derive(Debug, Clone, PartialEq)]
pub enum Formula {
    /// `(and …)` or `()`
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
    /// Predicate with arguments, `(p a b)`.
    Atom {
        /// Name of the predicate.
        name: Name,
        /// Arguments of the predicate.
        arguments: Vec<TermAst>,
        /// Span of the whole atom.
        span: Span,
    },
    /// Comparison, such as `(= a b)` or `(< a b)`.
    Compare {
        /// Kind of comparison.
        comparison: Comparison,
        /// Left and right side.
        sides: Box<[TermAst; 2]>,
        /// Span of the whole comparison.
        span: Span,
    },
    /// Call of a condition module, such as `[can-see a b]`.
    Call(CallAst),
    /// Condition with a time specifier, such as `(at start f)`; with the span of the whole.
    Timed(When, Box<Formula>, Span),
    /// `(preference name f)`, the name being optional; with the span of the whole.
    Preference(Option<Name>, Box<Formula>, Span),
    /// `(sometime f)` or another modal operator of PDDL3.
    Modal {
        /// Modal operator.
        operator: Modal,
        /// Times of the operator, seconds, in the order of the text; empty for operators without
        /// times.
        times_s: Vec<f64>,
        /// Conditions of the operator, one or two.
        formulas: Vec<Formula>,
        /// Span of the whole constraint.
        span: Span,
    },
}

/// Modal operator of PDDL3.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, serde::Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Modal {
    /// `(at end f)`: in the final state
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

/// Operator that changes a numeric function.
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

/// Effect of an action.
#[derive(Debug, Clone, PartialEq)]
pub enum EffectAst {
    /// `(and …)`
    And(Vec<EffectAst>),
    /// `(forall (…) e)`
    Forall(Vec<Typed>, Box<EffectAst>),
    /// `(when f e)`
    When(Formula, Box<EffectAst>),
    /// Add or delete effect, `(p a b)` or `(not (p a b))`.
    Literal {
        /// True for a delete effect.
        negated: bool,
        /// Name of the predicate.
        name: Name,
        /// Arguments of the predicate.
        arguments: Vec<TermAst>,
        /// Span of the whole literal.
        span: Span,
    },
    /// Change of a function's value, such as `(increase (f a) e)`.
    Assign {
        /// Kind of change.
        assignment: Assignment,
        /// Function that changes, with arguments.
        fluent: TermAst,
        /// New value, or amount of the change.
        value: TermAst,
        /// Span of the whole effect.
        span: Span,
    },
    /// Call of an effect module, such as `[update a b]`.
    Call(CallAst),
    /// Effect with a time specifier, such as `(at end e)`; with the span of the whole.
    Timed(When, Box<EffectAst>, Span),
}

/// Bound on the duration of an action, such as `(<= ?duration e)`.
#[derive(Debug, Clone, PartialEq)]
pub struct DurationBoundAst {
    /// Time at which the bound is evaluated: start or end of the action.
    pub when: When,
    /// Comparison; its left side is `?duration`.
    pub comparison: Comparison,
    /// Right side of the comparison, seconds.
    pub value: TermAst,
    /// Span of the whole bound.
    pub span: Span,
}

/// Declaration of an action, instantaneous or durative.
#[derive(Debug, Clone, PartialEq)]
pub struct ActionAst {
    /// Name of the action.
    pub name: Name,
    /// True for a `:durative-action`.
    pub durative: bool,
    /// Parameters of the action.
    pub parameters: Vec<Typed>,
    /// Calls of grounding modules, which propose values of further parameters.
    pub grounding: Vec<CallAst>,
    /// Bounds on the duration.
    pub duration: Vec<DurationBoundAst>,
    /// Precondition, or condition of a durative action; `None` if there is none.
    pub condition: Option<Formula>,
    /// Effect; `None` if there is none.
    pub effect: Option<EffectAst>,
    /// Span of the whole declaration.
    pub span: Span,
}

/// Rule of a derived predicate.
#[derive(Debug, Clone, PartialEq)]
pub struct Derived {
    /// Derived predicate with its parameters.
    pub head: Signature,
    /// Condition under which the derived predicate is true.
    pub body: Formula,
    /// Span of the whole rule.
    pub span: Span,
}

/// Contents of a domain file.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Domain {
    /// True if part of the file could not be parsed.
    pub unread: bool,
    /// Name of the domain; `None` if missing.
    pub name: Option<Name>,
    /// Declared requirements.
    pub requirements: Vec<Name>,
    /// Declared types.
    pub types: Vec<Typed>,
    /// `:oplinit`: options of modules that hold for all problems.
    pub module_options: Vec<ModuleOptionAst>,
    /// Declared modules.
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
    /// Instantaneous and durative actions.
    pub actions: Vec<ActionAst>,
}

/// Element of the initial state.
#[derive(Debug, Clone, PartialEq)]
pub enum Initial {
    /// Fact `(p a b)`, or `(not (p a b))`.
    Literal {
        /// True if the fact is declared false.
        negated: bool,
        /// Name of the predicate.
        name: Name,
        /// Arguments of the predicate.
        arguments: Vec<Name>,
        /// Span of the whole literal.
        span: Span,
    },
    /// Value of a function, `(= (f a b) v)`.
    Value {
        /// Name of the function.
        name: Name,
        /// Arguments of the function.
        arguments: Vec<Name>,
        /// Value of the function.
        value: InitialValue,
        /// Span of the whole equation.
        span: Span,
    },
    /// Timed initial literal, such as `(at 3.5 (p a b))`, with its time in seconds.
    At(f64, Box<Initial>),
}

/// Value of a function in the initial state.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum InitialValue {
    /// Number, with the token itself, which may be the name of an object.
    Number(f64, Name),
    /// Object, by name.
    Object(Name),
}

/// Metric of a problem.
#[derive(Debug, Clone, PartialEq)]
pub struct MetricAst {
    /// True if the metric is minimised, false if maximised.
    pub minimise: bool,
    /// Expression that is optimised.
    pub value: TermAst,
    /// Span of the whole section.
    pub span: Span,
}

/// Contents of a problem file.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct ProblemAst {
    /// True if part of the file could not be parsed.
    pub unread: bool,
    /// Name of the problem; `None` if missing.
    pub name: Option<Name>,
    /// Name of the domain that the problem is for; `None` if missing.
    pub domain: Option<Name>,
    /// Requirements repeated in the problem.
    pub requirements: Vec<Name>,
    /// `:moduleoptions`: options passed to modules before planning.
    pub module_options: Vec<ModuleOptionAst>,
    /// `:moduleexitoptions`: options passed to modules after planning.
    pub module_exit_options: Vec<ModuleOptionAst>,
    /// Objects of the problem.
    pub objects: Vec<Typed>,
    /// Elements of the initial state, timed literals included.
    pub initial: Vec<Initial>,
    /// Goal; `None` if missing.
    pub goal: Option<Formula>,
    /// Span of the whole `:goal` section.
    pub goal_span: Span,
    /// Trajectory constraints.
    pub constraints: Vec<Formula>,
    /// Metric; `None` if there is none.
    pub metric: Option<MetricAst>,
}
