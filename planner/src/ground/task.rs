//! The grounded task: finite-domain variables, numeric fluents, actions without parameters.
//!
//! Ids are plain indices. Those of predicates, fluents, objects, actions and modules are the lifted task's own.

pub use crate::model::relation::Relation;
pub use crate::task::Assignment as Change;

/// Index of a finite-domain variable in [`GroundTask::variables`].
pub type VariableId = u32;
/// Index of a numeric fluent in [`GroundTask::numerics`].
pub type NumericId = u32;
/// Index of a ground attachment call in [`GroundTask::calls`].
pub type CallId = u32;
/// Index of a numeric comparison in [`GroundTask::comparisons`].
pub type ComparisonId = u32;

/// Variable with one of its values.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct GroundFact {
    /// The variable.
    pub variable: VariableId,
    /// Value of the variable, below [`Variable::domain_size`].
    pub value: u32,
}

/// Meaning of a value of a finite-domain variable in the lifted task.
#[derive(Clone, Debug, PartialEq, Eq, Hash)]
pub enum Meaning {
    /// The atom holds, and no other atom of the variable does.
    Atom {
        /// Predicate of the lifted task.
        predicate: u32,
        /// Objects of the lifted task.
        arguments: Vec<u32>,
    },
    /// The object fluent has this value.
    Object {
        /// Object fluent of the lifted task.
        fluent: u32,
        /// Objects of the lifted task.
        arguments: Vec<u32>,
        /// The value, or `None` for an undefined fluent.
        value: Option<u32>,
    },
    /// Derived variable of a nested condition: a disjunction inside a condition.
    Inner,
    /// None of the other values' atoms holds.
    NoneOfThose,
}

/// Finite-domain variable: a group of atoms of which at most one holds, or an object fluent.
#[derive(Clone, Debug)]
pub struct Variable {
    /// Meaning of each value. In a two-valued variable over one atom, value 0 is the atom, value 1
    /// its absence.
    pub values: Vec<Meaning>,
    /// Axiom stratum of a derived variable, which no effect writes; its default is value 1
    /// (absent). `None`: not derived.
    pub stratum: Option<u32>,
}

impl Variable {
    /// Number of values.
    pub fn domain_size(&self) -> u32 {
        self.values.len() as u32
    }

    /// True for object fluents: two values given at once contradict each other.
    pub fn is_object(&self) -> bool {
        matches!(self.values[0], Meaning::Object { .. })
    }
}

/// Numeric fluent written by some effect, timed literal or attachment; others are folded into
/// constants.
#[derive(Clone, Debug, PartialEq, Eq, Hash)]
pub struct NumericFluent {
    /// Numeric function of the lifted task.
    pub function: u32,
    /// Objects of the lifted task.
    pub arguments: Vec<u32>,
}

/// Arithmetic expression over the state; NaN if an input fluent is undefined (its number is NaN).
#[derive(Clone, Debug, PartialEq)]
pub enum GroundExpression {
    /// A number.
    Constant(f64),
    /// Value of a numeric fluent.
    Fluent(NumericId),
    /// The answer of an attachment.
    Call(CallId),
    /// `?duration` of the action at hand, in seconds.
    Duration,
    /// `total-time`: the makespan, only in metrics.
    TotalTime,
    /// Number of a preference's violations; only in metrics.
    Violated(u32),
    /// Sum of all.
    Sum(Vec<GroundExpression>),
    /// The product of all.
    Product(Vec<GroundExpression>),
    /// First minus second.
    Difference(Box<GroundExpression>, Box<GroundExpression>),
    /// First over second.
    Quotient(Box<GroundExpression>, Box<GroundExpression>),
    /// Minus the expression.
    Negative(Box<GroundExpression>),
}

impl GroundExpression {
    /// True if the value is a weighted sum of numbers.
    pub fn is_linear(&self) -> bool {
        match self {
            GroundExpression::Constant(_) | GroundExpression::Fluent(_) => true,
            GroundExpression::Sum(parts) => parts.iter().all(GroundExpression::is_linear),
            GroundExpression::Difference(left, right) => left.is_linear() && right.is_linear(),
            GroundExpression::Negative(inner) => inner.is_linear(),
            GroundExpression::Product(parts) => {
                let factors = parts.iter().filter(|part| !matches!(part, GroundExpression::Constant(_)));
                factors.clone().count() <= 1 && factors.into_iter().all(GroundExpression::is_linear)
            }
            GroundExpression::Quotient(left, right) => {
                left.is_linear() && matches!(**right, GroundExpression::Constant(_))
            }
            GroundExpression::Call(_)
            | GroundExpression::Duration
            | GroundExpression::TotalTime
            | GroundExpression::Violated(_) => false,
        }
    }
}

impl GroundExpression {
    /// True if the value times `factor` is at least 0 in every state, judged by constants,
    /// durations and attachment answers (never negative).
    pub fn is_never_negative(&self, factor: f64) -> bool {
        match self {
            GroundExpression::Constant(value) => factor * value >= 0.0,
            GroundExpression::Duration | GroundExpression::Call(_) => factor >= 0.0,
            GroundExpression::Sum(parts) => parts.iter().all(|part| part.is_never_negative(factor)),
            GroundExpression::Product(parts) => {
                let rest = parts.iter().filter(|part| !matches!(part, GroundExpression::Constant(_)));
                let constants = parts.iter().map(|part| match part {
                    GroundExpression::Constant(value) => *value,
                    _ => 1.0,
                });
                factor * constants.product::<f64>() >= 0.0
                    && rest.into_iter().all(|part| part.is_never_negative(1.0))
            }
            GroundExpression::Negative(inner) => inner.is_never_negative(-factor),
            _ => false,
        }
    }

    /// Coefficient of a number in a sum ([`Expression::is_linear`]).
    pub fn weight_of(&self, fluent: NumericId) -> f64 {
        match self {
            GroundExpression::Fluent(own) => f64::from(u8::from(*own == fluent)),
            GroundExpression::Sum(parts) => parts.iter().map(|part| part.weight_of(fluent)).sum(),
            GroundExpression::Difference(left, right) => left.weight_of(fluent) - right.weight_of(fluent),
            GroundExpression::Negative(inner) => -inner.weight_of(fluent),
            GroundExpression::Product(parts) => {
                let factor = |part: &GroundExpression| match part {
                    GroundExpression::Constant(number) => *number,
                    other => other.weight_of(fluent),
                };
                if parts.iter().all(|part| matches!(part, GroundExpression::Constant(_))) {
                    return 0.0;
                }
                parts.iter().map(factor).product()
            }
            GroundExpression::Quotient(left, right) => match **right {
                GroundExpression::Constant(number) => left.weight_of(fluent) / number,
                _ => 0.0,
            },
            _ => 0.0,
        }
    }
}

/// Numeric comparison; false if a side is NaN.
#[derive(Clone, Debug, PartialEq)]
pub struct GroundComparison {
    /// Left side.
    pub left: GroundExpression,
    /// Relation of left to right.
    pub relation: Relation,
    /// Right side.
    pub right: GroundExpression,
}

/// A conjunction of conditions; empty is true. Disjunctions have been split off into actions or derived variables.
#[derive(Clone, Debug, Default, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct Conjunction {
    /// Facts, sorted, at most one per variable.
    pub facts: Vec<GroundFact>,
    /// Numeric conditions, sorted.
    pub comparisons: Vec<ComparisonId>,
    /// Attachment calls and the answer wanted, sorted.
    pub calls: Vec<(CallId, bool)>,
}

impl Conjunction {
    /// True for the empty conjunction.
    pub fn is_empty(&self) -> bool {
        self.facts.is_empty() && self.comparisons.is_empty() && self.calls.is_empty()
    }
}

/// Outcome of an effect.
#[derive(Clone, Debug, PartialEq)]
pub enum GroundOutcome {
    /// The variable takes the value.
    Set(GroundFact),
    /// The number changes.
    Change {
        /// Number that changes.
        fluent: NumericId,
        /// Kind of change.
        change: Change,
        /// Amount, evaluated in the state before the effects.
        amount: GroundExpression,
    },
    /// The number changes continuously while the action runs: by `rate` a second.
    Flow {
        /// Number that changes.
        fluent: NumericId,
        /// Change a second.
        rate: GroundExpression,
    },
    /// An effect module writes the numbers that [`GroundCall::writes`] lists.
    Call(CallId),
}

/// Condition of a conditional effect.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct GroundWhen {
    /// Condition at the time of the effect.
    pub here: Conjunction,
    /// Condition at the start of the durative action (end effects only).
    pub at_start: Conjunction,
    /// Condition throughout the durative action (end effects only).
    pub over_all: Conjunction,
}

/// Effect with its condition. Simultaneous effects of one action are all evaluated before any is
/// applied, then applied in order (deletes before adds).
#[derive(Clone, Debug, PartialEq)]
pub struct GroundEffect {
    /// Condition of the effect; `None`: unconditional.
    pub when: Option<Box<GroundWhen>>,
    /// Outcome.
    pub outcome: GroundOutcome,
}

impl GroundEffect {
    /// True if both effects may happen together and give one object fluent different values.
    pub(crate) fn contests(&self, other: &GroundEffect, variables: &[Variable]) -> bool {
        let (GroundOutcome::Set(one), GroundOutcome::Set(another)) = (&self.outcome, &other.outcome) else {
            return false;
        };
        one.variable == another.variable
            && one.value != another.value
            && variables[one.variable as usize].is_object()
            && !self.excludes(other)
    }

    /// True if the conditions of both cannot hold at once.
    fn excludes(&self, other: &GroundEffect) -> bool {
        let (Some(one), Some(other)) = (&self.when, &other.when) else { return false };
        let differs = |fact: &GroundFact| {
            other.here.facts.iter().any(|f| f.variable == fact.variable && f.value != fact.value)
        };
        one.here.facts.iter().any(differs)
    }

    /// True if some of these effects may give an object fluent several values at once.
    pub(crate) fn some_contest(effects: &[GroundEffect], variables: &[Variable]) -> bool {
        let mut later = effects.iter().enumerate();
        later.any(|(place, one)| effects[..place].iter().any(|other| one.contests(other, variables)))
    }
}

/// Origin of a ground action, axiom or call: its lifted counterpart with the arguments.
#[derive(Clone, Debug, Default, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct Origin {
    /// Index in the lifted task's list (actions: instantaneous and durative share one).
    pub schema: u32,
    /// Objects of the lifted task, in the order of the parameters.
    pub arguments: Vec<u32>,
}

/// Instantaneous action; a disjunctive condition gives several ground actions per lifted instance.
#[derive(Clone, Debug)]
pub struct GroundAction {
    /// Lifted action and its arguments.
    pub origin: Origin,
    /// Precondition.
    pub condition: Conjunction,
    /// Effects.
    pub effects: Vec<GroundEffect>,
    /// Contribution to the metric; see [`GroundMetric::additive`].
    pub cost: GroundExpression,
}

/// A durative action.
#[derive(Clone, Debug)]
pub struct DurativeAction {
    /// Lifted action and its arguments.
    pub origin: Origin,
    /// Bounds on the duration, seconds, evaluated at the start (`true`) or at the end (`false`).
    pub duration: Vec<GroundDurationBound>,
    /// Condition right before the start.
    pub at_start: Conjunction,
    /// Condition strictly between start and end (invariant).
    pub over_all: Conjunction,
    /// Condition just before the end.
    pub at_end: Conjunction,
    /// Effects at the start.
    pub start_effects: Vec<GroundEffect>,
    /// Continuous effects ([`GroundOutcome::Flow`] only).
    pub flow_effects: Vec<GroundEffect>,
    /// Effects at the end.
    pub end_effects: Vec<GroundEffect>,
    /// Contribution to the metric besides time; see [`GroundMetric::additive`].
    pub cost: GroundExpression,
}

/// A bound on a duration.
#[derive(Clone, Debug, PartialEq)]
pub struct GroundDurationBound {
    /// True if evaluated at the end of the action instead of its start.
    pub at_end: bool,
    /// Relation of `?duration` to the expression.
    pub relation: Relation,
    /// Seconds.
    pub seconds: GroundExpression,
}

/// Axiom: the derived variable is true (value 0) in every state in which the body holds.
#[derive(Clone, Debug)]
pub struct Axiom {
    /// Derived fact, always value 0 of its variable.
    pub head: GroundFact,
    /// Condition.
    pub body: Conjunction,
}

/// Effects that happen by themselves at a time (timed initial literals and fluents).
#[derive(Clone, Debug)]
pub struct TimedEffect {
    /// When, in seconds from the start of the plan.
    pub time_s: f64,
    /// Outcomes, in the order of the problem file.
    pub outcomes: Vec<GroundOutcome>,
}

/// A ground call of an attachment.
#[derive(Clone, Debug, PartialEq, Eq, Hash)]
pub struct GroundCall {
    /// The module of the lifted task and the arguments.
    pub origin: Origin,
    /// Terms written by an effect module, in module order; empty for other kinds.
    pub writes: Vec<Place>,
}

/// Term written by an effect module.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Place {
    /// A number.
    Number(NumericId),
    /// The truth of an atom: value 0 of this two-valued variable is true, 1 false.
    Truth(VariableId),
    /// An object fluent: the variable whose values' meanings are [`Meaning::Object`].
    Object(VariableId),
    /// Irrelevant term.
    Nowhere,
}

/// Metric.
#[derive(Clone, Debug)]
pub struct GroundMetric {
    /// True for minimisation.
    pub minimise: bool,
    /// The whole expression.
    pub expression: GroundExpression,
    /// True if the metric is a constant plus action costs plus `time_weight` × makespan.
    pub additive: bool,
    /// Possible improvement by actions beyond the value without them; if any, a best value may not
    /// exist.
    pub earns: Earns,
    /// The weight of `total-time` in an additive metric.
    pub time_weight: f64,
}

/// Possibility that actions improve a metric beyond its value without them.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Earns {
    /// Impossible.
    Never,
    /// Unknown before the search.
    Perhaps,
    /// Certain: some action improves the metric.
    Surely,
}

/// State: value of each variable (derived ones up to date), and each numeric fluent (NaN if
/// undefined).
#[derive(Clone, Debug, PartialEq)]
pub struct Values {
    /// Values by variable.
    pub values: Vec<u32>,
    /// Values by numeric fluent.
    pub numbers: Vec<f64>,
}

/// The grounded task.
#[derive(Clone, Debug)]
pub struct GroundTask {
    /// Finite-domain variables, derived ones last.
    pub variables: Vec<Variable>,
    /// Numeric fluents.
    pub numerics: Vec<NumericFluent>,
    /// Numeric conditions, each once.
    pub comparisons: Vec<GroundComparison>,
    /// Attachment calls, each once.
    pub calls: Vec<GroundCall>,
    /// Instantaneous actions.
    pub actions: Vec<GroundAction>,
    /// Durative actions.
    pub durative: Vec<DurativeAction>,
    /// Axioms, by stratum.
    pub axioms: Vec<Axiom>,
    /// Timed effects, by time.
    pub timed: Vec<TimedEffect>,
    /// Initial state, with derived variables evaluated unless calls are involved.
    pub initial: Values,
    /// Goal.
    pub goal: Conjunction,
    /// Metric; `None` counts steps (classical) or time (temporal).
    pub metric: Option<GroundMetric>,
    /// Mutex groups beyond those that share a variable.
    pub mutex_groups: Vec<Vec<GroundFact>>,
    /// False if the goal is unreachable even under delete relaxation.
    pub goal_reachable: bool,
    /// Obstacles of an unreachable task: atoms without achievers, the goal's first.
    pub obstacles: Vec<super::obstacles::Obstacle>,
}

impl GroundTask {
    /// Approximate memory of the ground task, bytes; actions dominate.
    pub(crate) fn bytes(&self) -> usize {
        let condition = |condition: &Conjunction| {
            condition.facts.len() * size_of::<GroundFact>()
                + condition.comparisons.len() * size_of::<ComparisonId>()
                + condition.calls.len() * size_of::<(CallId, bool)>()
        };
        let effects = |effects: &[GroundEffect]| {
            let when = |when: &GroundWhen| {
                let parts = [&when.here, &when.at_start, &when.over_all];
                size_of::<GroundWhen>() + parts.into_iter().map(condition).sum::<usize>()
            };
            let conditional = effects.iter().filter_map(|effect| effect.when.as_deref());
            size_of_val(effects) + conditional.map(when).sum::<usize>()
        };
        let actions = self
            .actions
            .iter()
            .map(|action| size_of_val(action) + condition(&action.condition) + effects(&action.effects));
        let durative = self.durative.iter().map(|action| {
            let conditions = [&action.at_start, &action.over_all, &action.at_end];
            let lists = [&action.start_effects, &action.flow_effects, &action.end_effects];
            size_of_val(action)
                + size_of_val(&action.duration[..])
                + conditions.into_iter().map(condition).sum::<usize>()
                + lists.into_iter().map(|list| effects(list)).sum::<usize>()
        });
        let origins = self.actions.iter().map(|action| &action.origin);
        let origins = origins.chain(self.durative.iter().map(|action| &action.origin));
        let named: usize = origins.map(|origin| size_of_val(&origin.arguments[..])).sum();
        actions.sum::<usize>() + durative.sum::<usize>() + named
    }
}
