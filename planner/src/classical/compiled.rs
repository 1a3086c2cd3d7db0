//! A ground task of instantaneous actions over finite-domain variables and numbers, in flat arrays.

use std::sync::Arc;

use crate::ground::{
    Conjunction, GroundAction, GroundEffect, GroundFact, GroundOutcome, GroundTask, Meaning, Variable,
};
use crate::model::agreement::reset;

use super::measure::ClassicalMeasure;
use super::numbers::{Numbers, is_plain};

/// Factors tried, in this order, to make all costs whole numbers; if none does, costs are scaled by the
/// first one and rounded for the search. Reported plan costs are exact.
const COST_SCALES: [f64; 4] = [1e3, 1e4, 1e5, 1e6];
/// Maximum distance from a whole number at which a cost counts as whole.
const WHOLE: f64 = 1e-6;
/// Maximum operator cost in the search; larger costs are scaled down.
const LARGEST_COST: f64 = 1.0e6;
/// Maximum plan cost that the search can represent; `u32::MAX` means infinite.
pub(crate) const MOST_COUNTED: u32 = u32::MAX - 1;

/// Lists of different lengths, stored in one array.
#[derive(Clone, Debug, Default)]
pub struct Lists<T> {
    starts: Vec<u32>,
    items: Vec<T>,
}

impl<T> Lists<T> {
    /// Collection without lists.
    pub(crate) fn new() -> Self {
        Lists { starts: vec![0], items: Vec::new() }
    }

    /// Appends a list.
    pub(crate) fn push(&mut self, list: impl IntoIterator<Item = T>) {
        self.items.extend(list);
        self.starts.push(self.items.len() as u32);
    }

    /// List by index.
    #[inline]
    pub fn get(&self, index: usize) -> &[T] {
        &self.items[self.starts[index] as usize..self.starts[index + 1] as usize]
    }

    /// The items of all lists.
    pub(crate) fn all(&self) -> &[T] {
        &self.items
    }

    /// Number of lists.
    pub(crate) fn len(&self) -> usize {
        self.starts.len() - 1
    }

    /// Groups `(list number, item)` pairs into lists, keeping the order of items within a list.
    pub(crate) fn group(count: usize, pairs: impl Iterator<Item = (u32, T)> + Clone) -> Self
    where
        T: Copy + Default,
    {
        let mut starts = vec![0u32; count + 1];
        for (list, _) in pairs.clone() {
            starts[list as usize + 1] += 1;
        }
        for i in 0..count {
            starts[i + 1] += starts[i];
        }
        let mut next = starts.clone();
        let mut items = vec![T::default(); starts[count] as usize];
        for (list, item) in pairs {
            items[next[list as usize] as usize] = item;
            next[list as usize] += 1;
        }
        Lists { starts, items }
    }
}

/// Effect on one fact, with its conditions.
#[derive(Clone, Copy, Debug)]
pub struct Achieve {
    /// Begin of the effect's range in [`Compiled::conditions`]; the range is empty for an unconditional
    /// effect.
    pub from: u32,
    /// End of the effect's range in [`Compiled::conditions`], exclusive.
    pub to: u32,
    /// Fact that the effect makes true.
    pub fact: GroundFact,
}

/// Task of instantaneous actions, stored in flat arrays.
#[derive(Clone, Debug)]
pub struct Compiled {
    /// Domain size of each variable: basic variables first, then derived ones, then numeric conditions.
    pub domains: Vec<u32>,
    /// Number of basic variables, which are neither derived nor numeric conditions.
    pub basic: usize,
    /// Identifier of each variable's first fact; fact = offset + value.
    pub offsets: Vec<u32>,
    /// Number of facts.
    pub facts: usize,
    /// Preconditions by operator.
    pub preconditions: Lists<GroundFact>,
    /// Effects on facts, by operator.
    pub effects: Lists<Achieve>,
    /// Conditions of all effects, in ranges given by [`Achieve`].
    pub conditions: Vec<GroundFact>,
    /// True, by operator, if its effects may give one object fluent several values at once; empty if
    /// this holds for no operator.
    contested: Vec<bool>,
    /// True, by variable, if it stands for an object fluent.
    objects: Vec<bool>,
    /// Operator costs of the search: whole numbers, scaled by `cost_scale`.
    pub costs: Vec<u32>,
    /// Measure of a plan's cost.
    pub measure: ClassicalMeasure,
    /// Factor from exact costs to search costs.
    pub cost_scale: f64,
    /// True if every operator costs one.
    pub unit_cost: bool,
    /// True if some operator costs nothing.
    pub free_operators: bool,
    /// Body facts of each axiom, axioms of lower strata first.
    pub axiom_bodies: Lists<GroundFact>,
    /// Head fact of each axiom.
    pub axiom_heads: Vec<GroundFact>,
    /// Index of the first axiom of each stratum; the last entry is the number of axioms.
    pub strata: Vec<usize>,
    /// Axioms whose body contains a fact, by fact.
    pub axioms_with: Lists<u32>,
    /// Goal facts.
    pub goal: Vec<GroundFact>,
    /// Initial state, derived variables and numbers included.
    pub initial: Vec<u32>,
    /// Predicate or function of each fact, encoded as one number; `u32::MAX` for facts of no single
    /// predicate or function.
    pub symbols: Vec<u32>,
    /// Variable of each fact.
    pub variables: Vec<u32>,
    /// Numeric fluents and their changes.
    pub numbers: Arc<Numbers>,
}

/// True if search over instantaneous actions can solve the task: no durations, timed literals or calls.
pub fn is_classical(task: &GroundTask) -> bool {
    let plain = |c: &Conjunction| c.calls.is_empty();
    let plain_effect = |e: &GroundEffect| {
        let outcome = match &e.outcome {
            GroundOutcome::Set(_) => true,
            GroundOutcome::Change { amount, .. } => is_plain(amount),
            GroundOutcome::Flow { .. } | GroundOutcome::Call(_) => false,
        };
        outcome && e.when.as_ref().is_none_or(|w| plain(&w.here))
    };
    task.durative.is_empty()
        && task.timed.is_empty()
        && plain(&task.goal)
        && task.comparisons.iter().all(|c| is_plain(&c.left) && is_plain(&c.right))
        && task.axioms.iter().all(|a| plain(&a.body))
        && task.metric.as_ref().is_none_or(|m| m.additive || is_plain(&m.expression))
        && task
            .actions
            .iter()
            .all(|a| plain(&a.condition) && is_plain(&a.cost) && a.effects.iter().all(plain_effect))
}

/// True, by action, if its effects may give one object fluent several values at once; empty if this
/// holds for no action.
fn contested(task: &GroundTask) -> Vec<bool> {
    let is_contested = |action: &GroundAction| GroundEffect::some_contest(&action.effects, &task.variables);
    let contested: Vec<bool> = task.actions.iter().map(is_contested).collect();
    if contested.contains(&true) { contested } else { Vec::new() }
}

impl Compiled {
    /// Compiles a ground task that [`is_classical`].
    pub fn new(task: &GroundTask) -> Compiled {
        let compared = std::iter::repeat_n(2, task.comparisons.len());
        let domains: Vec<u32> = task.variables.iter().map(|v| v.domain_size()).chain(compared).collect();
        let numbers = Numbers::new(task, task.variables.len());
        let basic = task.variables.iter().filter(|v| v.stratum.is_none()).count();
        let mut offsets = Vec::with_capacity(domains.len());
        let mut facts = 0;
        for &size in &domains {
            offsets.push(facts);
            facts += size;
        }
        let mut preconditions = Lists::new();
        let mut effects = Lists::new();
        let mut conditions = Vec::new();
        for action in &task.actions {
            preconditions.push(numbers.facts(&action.condition));
            let mut list = Vec::with_capacity(action.effects.len());
            for effect in &action.effects {
                let GroundOutcome::Set(fact) = effect.outcome else { continue };
                let from = conditions.len() as u32;
                conditions.extend(effect.when.iter().flat_map(|w| numbers.facts(&w.here)));
                list.push(Achieve { from, to: conditions.len() as u32, fact });
            }
            effects.push(list);
        }
        let measure = ClassicalMeasure::new(task, &numbers);
        let (costs, cost_scale) = costs(&measure.estimates);
        let mut axiom_bodies = Lists::new();
        let mut strata = Vec::new();
        let mut last = None;
        for (index, axiom) in task.axioms.iter().enumerate() {
            let stratum = task.variables[axiom.head.variable as usize].stratum;
            if last != Some(stratum) {
                strata.push(index);
                last = Some(stratum);
            }
            axiom_bodies.push(numbers.facts(&axiom.body));
        }
        strata.push(task.axioms.len());
        let fact_id = |f: &GroundFact| offsets[f.variable as usize] + f.value;
        let pairs = (0..axiom_bodies.len())
            .flat_map(|i| axiom_bodies.get(i).iter().map(move |f: &GroundFact| (fact_id(f), i as u32)));
        let axioms_with = Lists::group(facts as usize, pairs);
        let of_variables = task.variables.iter().flat_map(|v| v.values.iter().map(symbol));
        let of_comparisons = std::iter::repeat_n(u32::MAX, 2 * task.comparisons.len());
        let mut compiled = Compiled {
            basic,
            facts: facts as usize,
            preconditions,
            effects,
            conditions,
            contested: contested(task),
            objects: task.variables.iter().map(Variable::is_object).collect(),
            unit_cost: measure.estimates.iter().all(|&c| c == 1.0),
            cost_scale,
            free_operators: costs.contains(&0),
            costs,
            measure,
            axiom_heads: task.axioms.iter().map(|a| a.head).collect(),
            axiom_bodies,
            strata,
            axioms_with,
            goal: numbers.facts(&task.goal),
            initial: task.initial.values.clone(),
            symbols: of_variables.chain(of_comparisons).collect(),
            variables: (0..domains.len() as u32)
                .flat_map(|v| std::iter::repeat_n(v, domains[v as usize] as usize))
                .collect(),
            domains,
            offsets,
            numbers: Arc::new(numbers),
        };
        if !compiled.numbers.is_empty() {
            let mut state = std::mem::take(&mut compiled.initial);
            compiled.numbers.append_initial(&mut state);
            compiled.derive(&mut state);
            compiled.initial = state;
        }
        compiled
    }

    /// Identifier of a fact.
    #[inline]
    pub fn id(&self, fact: GroundFact) -> u32 {
        self.offsets[fact.variable as usize] + fact.value
    }

    /// True if a fact, given by its identifier, holds in a state.
    #[inline]
    pub(crate) fn holds(&self, fact: u32, state: &[u32]) -> bool {
        let variable = self.variables[fact as usize] as usize;
        self.offsets[variable] + state[variable] == fact
    }

    /// Variables and numbers that an operator writes; numeric fluent `n` has index `n` plus the number
    /// of variables.
    pub(crate) fn written(&self, operator: u32) -> impl Iterator<Item = u32> + '_ {
        let base = self.domains.len() as u32;
        let numbers = self.numbers.writes(operator).map(move |n| base + n);
        self.effects.get(operator as usize).iter().map(|e| e.fact.variable).chain(numbers)
    }

    /// Variables and numbers that an operator reads; numeric fluent `n` has index `n` plus the number
    /// of variables.
    pub(crate) fn read(&self, operator: u32) -> Vec<u32> {
        let effects = self.effects.get(operator as usize);
        let conditions = effects.iter().flat_map(|e| &self.conditions[e.from as usize..e.to as usize]);
        let (variables, mut numbers) = self.numbers.change_reads(operator);
        let own = self.preconditions.get(operator as usize).iter().chain(conditions).map(|f| f.variable);
        let mut read: Vec<u32> = own.chain(variables).collect();
        let first = self.numbers.first;
        let compared = read.iter().filter(|&&v| v as usize >= first);
        numbers.extend(compared.flat_map(|&v| self.numbers.reads[v as usize - first].iter().copied()));
        read.extend(numbers.into_iter().map(|n| self.domains.len() as u32 + n));
        read.sort_unstable();
        read.dedup();
        read
    }

    /// Number of operators.
    pub fn operators(&self) -> usize {
        self.costs.len()
    }

    /// True if an operator is applicable in a state.
    #[inline]
    pub fn applicable(&self, operator: u32, state: &[u32]) -> bool {
        self.preconditions.get(operator as usize).iter().all(|f| state[f.variable as usize] == f.value)
            && self.possible(operator, state)
    }

    /// True if an operator whose preconditions hold leaves all numbers defined and finite, and gives
    /// each object fluent at most one value.
    #[inline]
    pub(crate) fn possible(&self, operator: u32, state: &[u32]) -> bool {
        (self.numbers.is_empty() || self.numbers.possible(operator, state))
            && (self.contested.is_empty() || self.agrees(operator, state))
    }

    /// True if some operator may be inapplicable although its preconditions hold.
    pub(crate) fn some_impossible(&self) -> bool {
        !self.numbers.is_empty() || !self.contested.is_empty()
    }

    fn agrees(&self, operator: u32, state: &[u32]) -> bool {
        if !self.contested[operator as usize] {
            return true;
        }
        let happens = |effect: &&Achieve| {
            let conditions = &self.conditions[effect.from as usize..effect.to as usize];
            self.objects[effect.fact.variable as usize]
                && conditions.iter().all(|f| state[f.variable as usize] == f.value)
        };
        let set = self.effects.get(operator as usize).iter().filter(happens);
        reset(set.map(|effect| (effect.fact.variable, effect.fact.value))).is_none()
    }

    /// True if the goal holds in a state.
    pub fn is_goal(&self, state: &[u32]) -> bool {
        self.goal.iter().all(|f| state[f.variable as usize] == f.value)
    }

    /// Writes the state after an operator to `next`, derived variables included.
    pub(crate) fn apply(&self, operator: u32, state: &[u32], next: &mut Vec<u32>) {
        next.clear();
        next.extend_from_slice(state);
        for effect in self.effects.get(operator as usize) {
            let conditions = &self.conditions[effect.from as usize..effect.to as usize];
            if conditions.iter().all(|f| state[f.variable as usize] == f.value) {
                next[effect.fact.variable as usize] = effect.fact.value;
            }
        }
        if !self.numbers.is_empty() {
            self.numbers.apply(operator, state, next);
        }
        self.derive(next);
    }

    /// Applies an operator to a state in place.
    pub fn advance(&self, operator: u32, state: &mut [u32]) {
        let effects = self.effects.get(operator as usize);
        let conditional = effects.iter().any(|e| e.from != e.to);
        if conditional || !self.numbers.is_empty() {
            let mut next = Vec::with_capacity(state.len());
            self.apply(operator, state, &mut next);
            state.copy_from_slice(&next);
            return;
        }
        for effect in effects {
            state[effect.fact.variable as usize] = effect.fact.value;
        }
        self.derive(state);
    }

    /// Brings the derived variables of a state up to date.
    pub(crate) fn derive(&self, state: &mut [u32]) {
        if self.axiom_heads.is_empty() {
            return;
        }
        state[self.basic..self.numbers.first].fill(1);
        let mut queue: Vec<u32> = Vec::new();
        for bounds in self.strata.windows(2) {
            let holds = |axiom: usize, state: &[u32]| {
                self.axiom_bodies.get(axiom).iter().all(|f| state[f.variable as usize] == f.value)
            };
            for axiom in bounds[0]..bounds[1] {
                let head = self.axiom_heads[axiom];
                if state[head.variable as usize] != head.value && holds(axiom, state) {
                    state[head.variable as usize] = head.value;
                    queue.push(self.id(head));
                }
            }
            while let Some(fact) = queue.pop() {
                for &axiom in self.axioms_with.get(fact as usize) {
                    let axiom = axiom as usize;
                    if axiom < bounds[0] || axiom >= bounds[1] {
                        continue;
                    }
                    let head = self.axiom_heads[axiom];
                    if state[head.variable as usize] != head.value && holds(axiom, state) {
                        state[head.variable as usize] = head.value;
                        queue.push(self.id(head));
                    }
                }
            }
        }
    }

    /// True if the search's operator costs equal those of the metric.
    pub(crate) fn has_exact_costs(&self) -> bool {
        let exact = |(&counted, &exact): (&u32, &f64)| f64::from(counted) == exact;
        self.measure.is_sum() && self.costs.iter().zip(&self.measure.estimates).all(exact)
    }

    /// True if the search's operator costs are proportional to those of the metric.
    pub(crate) fn has_proportional_costs(&self) -> bool {
        let proportional = |(&counted, &exact): (&u32, &f64)| {
            let scaled = exact * self.cost_scale;
            (f64::from(counted) - scaled).abs() < WHOLE * scaled.max(1.0)
        };
        self.measure.is_sum() && self.costs.iter().zip(&self.measure.estimates).all(proportional)
    }

    /// Converts a cost of the search to the unit of the metric.
    pub(crate) fn unscaled(&self, cost: u32) -> f64 {
        f64::from(cost) / self.cost_scale
    }

    /// Cost of a plan in the search's unit.
    pub(crate) fn search_cost(&self, plan: &[u32]) -> u32 {
        plan.iter().fold(0, |sum, &op| self.with_cost(sum, op))
    }

    /// Cost of a plan, in the search's unit, after one more operator; cut at [`MOST_COUNTED`].
    pub(crate) fn with_cost(&self, cost: u32, operator: u32) -> u32 {
        cost.saturating_add(self.costs[operator as usize]).min(MOST_COUNTED)
    }

    /// Converts a cost bound of the metric to the search's unit, rounded up.
    pub(crate) fn scaled(&self, cost: f64) -> u32 {
        (cost * self.cost_scale).ceil().clamp(0.0, f64::from(u32::MAX)) as u32
    }

    /// Cost of a plan in the unit of the metric, exact.
    pub(crate) fn plan_cost(&self, plan: &[u32]) -> f64 {
        self.measure.of(self, plan)
    }
}

fn symbol(meaning: &Meaning) -> u32 {
    match meaning {
        Meaning::Atom { predicate, .. } => *predicate << 1,
        Meaning::Object { fluent, value: Some(_), .. } => *fluent << 1 | 1,
        _ => u32::MAX,
    }
}

fn costs(exact: &[f64]) -> (Vec<u32>, f64) {
    let largest = exact.iter().copied().fold(0.0, f64::max);
    let whole = exact.iter().all(|c| c.fract() == 0.0);
    let makes_whole =
        |scale: &&f64| exact.iter().all(|c| ((c * **scale).round() - c * **scale).abs() < WHOLE);
    let finest = COST_SCALES.iter().find(makes_whole).copied().unwrap_or(COST_SCALES[0]);
    let scale = if whole { 1.0 } else { finest }.min(LARGEST_COST / largest.max(1.0));
    let costs = exact.iter().map(|c| (c * scale).round().clamp(0.0, LARGEST_COST) as u32).collect();
    (costs, scale)
}
