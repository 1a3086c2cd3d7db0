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

/// Fact: a variable has a value.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct GroundFact {
    /// Variable that has the value.
    pub variable: VariableId,
    /// Value of the variable, below [`Variable::domain_size`].
    pub value: u32,
}

/// Meaning of a value of a finite-domain variable in the lifted task.
#[derive(Clone, Debug, PartialEq, Eq, Hash)]
pub enum Meaning {
    /// This atom holds, and no other atom of the variable.
    Atom {
        /// Predicate of the lifted task.
        predicate: u32,
        /// Objects of the lifted task, in the order of the arguments.
        arguments: Vec<u32>,
    },
    /// The object function has this value.
    Object {
        /// Function of the lifted task.
        fluent: u32,
        /// Argument objects of the lifted task.
        arguments: Vec<u32>,
        /// Value object; `None`: the function is undefined.
        value: Option<u32>,
    },
    /// A disjunction inside a condition, which became a derived variable.
    Inner,
    /// None of the variable's other atoms holds.
    NoneOfThose,
}

/// Finite-domain variable: a group of atoms of which at most one holds, or an object fluent.
#[derive(Clone, Debug)]
pub struct Variable {
    /// Meaning of each value. In a two-valued variable over one atom, value 0 is the atom, value 1
    /// its absence.
    pub values: Vec<Meaning>,
    /// Axiom stratum of a derived variable, which axioms make true (value 0) and no effect writes.
    /// `None`: not derived.
    pub stratum: Option<u32>,
}

impl Variable {
    /// Number of values.
    pub fn domain_size(&self) -> u32 {
        self.values.len() as u32
    }

    /// True if the variable is an object function; two different values given at once then
    /// contradict each other.
    pub fn is_object(&self) -> bool {
        matches!(self.values[0], Meaning::Object { .. })
    }
}

/// Numeric fluent that some effect, timed literal or attachment writes; all others are folded into
/// constants.
#[derive(Clone, Debug, PartialEq, Eq, Hash)]
pub struct NumericFluent {
    /// Numeric function of the lifted task.
    pub function: u32,
    /// Argument objects of the lifted task.
    pub arguments: Vec<u32>,
}

/// Arithmetic expression over a state; NaN if a fluent in it is undefined.
#[derive(Clone, Debug, PartialEq)]
pub enum GroundExpression {
    /// Constant.
    Constant(f64),
    /// Value of a numeric fluent.
    Fluent(NumericId),
    /// Answer of an attachment.
    Call(CallId),
    /// `?duration` of the action that the expression belongs to, seconds.
    Duration,
    /// `total-time`: the makespan, seconds; only in metrics.
    TotalTime,
    /// Number of violations of a preference; only in metrics.
    Violated(u32),
    /// Sum of all parts.
    Sum(Vec<GroundExpression>),
    /// Product of all parts.
    Product(Vec<GroundExpression>),
    /// First operand minus the second.
    Difference(Box<GroundExpression>, Box<GroundExpression>),
    /// First operand divided by the second.
    Quotient(Box<GroundExpression>, Box<GroundExpression>),
    /// Negated operand.
    Negative(Box<GroundExpression>),
}

impl GroundExpression {
    /// True if the expression is a linear function of numeric fluents.
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
    /// True if the expression times `factor` is certainly at least 0 in every state. Durations and
    /// answers of attachments count as never negative; fluents are undecided.
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

    /// Coefficient of a numeric fluent in a linear expression ([`GroundExpression::is_linear`]).
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

/// Numeric comparison; false if a side is undefined (NaN).
#[derive(Clone, Debug, PartialEq)]
pub struct GroundComparison {
    /// Left side.
    pub left: GroundExpression,
    /// Relation of left to right.
    pub relation: Relation,
    /// Right side.
    pub right: GroundExpression,
}

/// Conjunction of conditions; true if empty. Disjunctions have become separate actions or derived
/// variables.
#[derive(Clone, Debug, Default, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct Conjunction {
    /// Facts, sorted, at most one per variable.
    pub facts: Vec<GroundFact>,
    /// Numeric comparisons, sorted.
    pub comparisons: Vec<ComparisonId>,
    /// Attachment calls with the answer that each must give, sorted.
    pub calls: Vec<(CallId, bool)>,
}

impl Conjunction {
    /// True for the empty conjunction.
    pub fn is_empty(&self) -> bool {
        self.facts.is_empty() && self.comparisons.is_empty() && self.calls.is_empty()
    }
}

/// Change that an effect makes.
#[derive(Clone, Debug, PartialEq)]
pub enum GroundOutcome {
    /// Sets a variable to a value.
    Set(GroundFact),
    /// Changes a number at once.
    Change {
        /// Number that is changed.
        fluent: NumericId,
        /// Kind of change: assignment, increase, decrease or scaling.
        change: Change,
        /// Amount, evaluated in the state before all simultaneous effects.
        amount: GroundExpression,
    },
    /// Changes a number continuously while the action runs.
    Flow {
        /// Number that is changed.
        fluent: NumericId,
        /// Change per second.
        rate: GroundExpression,
    },
    /// Calls an effect module, which writes the terms that [`GroundCall::writes`] lists.
    Call(CallId),
}

/// Condition of a conditional effect, by the time at which each part must hold.
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
    /// Change that the effect makes.
    pub outcome: GroundOutcome,
}

impl GroundEffect {
    /// True if both effects may happen together and give one object function different values.
    pub(crate) fn contests(&self, other: &GroundEffect, variables: &[Variable]) -> bool {
        let (GroundOutcome::Set(one), GroundOutcome::Set(another)) = (&self.outcome, &other.outcome) else {
            return false;
        };
        one.variable == another.variable
            && one.value != another.value
            && variables[one.variable as usize].is_object()
            && !self.excludes(other)
    }

    /// True if the conditions of the two effects contradict each other.
    fn excludes(&self, other: &GroundEffect) -> bool {
        let (Some(one), Some(other)) = (&self.when, &other.when) else { return false };
        let differs = |fact: &GroundFact| {
            other.here.facts.iter().any(|f| f.variable == fact.variable && f.value != fact.value)
        };
        one.here.facts.iter().any(differs)
    }

    /// True if two of these effects may give one object function different values at once.
    pub(crate) fn some_contest(effects: &[GroundEffect], variables: &[Variable]) -> bool {
        let mut later = effects.iter().enumerate();
        later.any(|(place, one)| effects[..place].iter().any(|other| one.contests(other, variables)))
    }
}

/// Lifted action, rule or module from which a ground action, axiom or call was made, with its
/// arguments.
#[derive(Clone, Debug, Default, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct Origin {
    /// Index in the lifted task's list (actions: instantaneous and durative share one).
    pub schema: u32,
    /// Objects of the lifted task, in the order of the parameters.
    pub arguments: Vec<u32>,
}

/// Ground instantaneous action. A lifted instance with a disjunctive condition gives several.
#[derive(Clone, Debug)]
pub struct GroundAction {
    /// Lifted action and its arguments.
    pub origin: Origin,
    /// Precondition of the action.
    pub condition: Conjunction,
    /// Effects of the action.
    pub effects: Vec<GroundEffect>,
    /// Contribution to the metric, if that is additive ([`GroundMetric::additive`]).
    pub cost: GroundExpression,
}

/// Ground durative action.
#[derive(Clone, Debug)]
pub struct DurativeAction {
    /// Lifted action and its arguments.
    pub origin: Origin,
    /// Bounds on the duration.
    pub duration: Vec<GroundDurationBound>,
    /// Condition right before the start.
    pub at_start: Conjunction,
    /// Condition strictly between start and end (invariant).
    pub over_all: Conjunction,
    /// Condition right before the end.
    pub at_end: Conjunction,
    /// Effects at the start.
    pub start_effects: Vec<GroundEffect>,
    /// Continuous effects ([`GroundOutcome::Flow`] only).
    pub flow_effects: Vec<GroundEffect>,
    /// Effects at the end.
    pub end_effects: Vec<GroundEffect>,
    /// Contribution to the metric besides its share of time, if the metric is additive
    /// ([`GroundMetric::additive`]).
    pub cost: GroundExpression,
}

/// Bound on the duration of an action.
#[derive(Clone, Debug, PartialEq)]
pub struct GroundDurationBound {
    /// True if the expression is evaluated at the end of the action, false if at its start.
    pub at_end: bool,
    /// Relation of `?duration` to the expression.
    pub relation: Relation,
    /// Expression for the bound, seconds.
    pub seconds: GroundExpression,
}

/// Axiom: the derived variable is true (value 0) in every state in which the body holds.
#[derive(Clone, Debug)]
pub struct Axiom {
    /// Derived fact, always value 0 of its variable.
    pub head: GroundFact,
    /// Condition under which the derived fact holds.
    pub body: Conjunction,
}

/// Effects that happen by themselves at a time (timed initial literals and fluents).
#[derive(Clone, Debug)]
pub struct TimedEffect {
    /// Time, seconds from the start of the plan.
    pub time_s: f64,
    /// Changes, in the order of the problem file.
    pub outcomes: Vec<GroundOutcome>,
}

/// Ground call of an attachment.
#[derive(Clone, Debug, PartialEq, Eq, Hash)]
pub struct GroundCall {
    /// Module of the lifted task, and its arguments.
    pub origin: Origin,
    /// Terms that an effect module writes, in the order of the module's declaration; empty for
    /// other kinds.
    pub writes: Vec<Place>,
}

/// Term that an effect module writes.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Place {
    /// Numeric fluent.
    Number(NumericId),
    /// Truth of an atom: the two-valued variable whose value 0 means true and 1 false.
    Truth(VariableId),
    /// Object function: the variable whose values are [`Meaning::Object`].
    Object(VariableId),
    /// Term that the grounded task does not contain, because it is irrelevant or unreachable.
    Nowhere,
}

/// Metric of the task.
#[derive(Clone, Debug)]
pub struct GroundMetric {
    /// True if the metric is minimised, false if maximised.
    pub minimise: bool,
    /// Expression for the metric value of a plan.
    pub expression: GroundExpression,
    /// True if the metric is a constant plus action costs plus `time_weight` × makespan.
    pub additive: bool,
    /// Possibility that actions improve the metric without limit; if they may, a best value need
    /// not exist.
    pub earns: Earns,
    /// Weight of `total-time` in an additive metric, per second.
    pub time_weight: f64,
}

/// Possibility that actions make a metric better than it is without them.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Earns {
    /// No action can improve the metric.
    Never,
    /// Unknown before the search.
    Perhaps,
    /// Some action certainly improves the metric.
    Surely,
}

/// State: a value for each variable (derived ones included) and each numeric fluent.
#[derive(Clone, Debug, PartialEq)]
pub struct Values {
    /// Value of each variable.
    pub values: Vec<u32>,
    /// Value of each numeric fluent; NaN if undefined.
    pub numbers: Vec<f64>,
}

/// Grounded task.
#[derive(Clone, Debug)]
pub struct GroundTask {
    /// Finite-domain variables, derived ones last.
    pub variables: Vec<Variable>,
    /// Numeric fluents that are part of the state.
    pub numerics: Vec<NumericFluent>,
    /// Numeric comparisons that conditions refer to, each once.
    pub comparisons: Vec<GroundComparison>,
    /// Calls of attachments, each once.
    pub calls: Vec<GroundCall>,
    /// Instantaneous actions.
    pub actions: Vec<GroundAction>,
    /// Durative actions.
    pub durative: Vec<DurativeAction>,
    /// Axioms, sorted by stratum.
    pub axioms: Vec<Axiom>,
    /// Timed effects, sorted by time.
    pub timed: Vec<TimedEffect>,
    /// Initial state; axioms whose bodies contain calls are not applied in it.
    pub initial: Values,
    /// Goal condition.
    pub goal: Conjunction,
    /// Metric; `None`: the number of steps counts, or in temporal tasks the makespan.
    pub metric: Option<GroundMetric>,
    /// Further mutex groups: at most one fact of each group holds in a reachable state.
    pub mutex_groups: Vec<Vec<GroundFact>>,
    /// False if the goal is unreachable even under delete relaxation.
    pub goal_reachable: bool,
    /// Obstacles that explain an unreachable goal: atoms that nothing achieves, the goal's first.
    pub obstacles: Vec<super::obstacles::Obstacle>,
}

impl GroundTask {
    /// Approximate memory of the ground task, bytes; mainly that of the actions.
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
