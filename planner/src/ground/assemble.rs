//! Last step of grounding: variables, actions and axioms in their final form.

use rustc_hash::{FxHashMap, FxHashSet};

use crate::model::relation::quotient;
use crate::task::Task;

use super::groups::Groups;
use super::instantiate::{Deed, Instantiate, RawCall, RawEffect, RawPlace};
use super::raw::{RawAction, RawTask};
use super::relaxed::Reached;
use super::relevant::{Relevant, reads};
use super::task::{
    Axiom, Conjunction, DurativeAction, GroundAction, GroundCall, GroundComparison, GroundDurationBound,
    GroundEffect, GroundExpression, GroundFact, GroundMetric, GroundOutcome, GroundTask, Meaning,
    NumericFluent, Origin, Place, TimedEffect, Values, Variable,
};
use super::variables::{Choice, Encoding, drop_none, encode, mark_none, used_none};

/// New indices of the numeric fluents that are still used, by old index.
#[derive(Default)]
struct Renumber {
    numerics: FxHashMap<u32, u32>,
}

#[allow(clippy::too_many_arguments)]
pub(super) fn assemble(
    task: &Task,
    mut raw: RawTask,
    make: Instantiate<'_>,
    reached: Reached,
    relevant: Relevant,
    groups: Groups,
    metric: Option<GroundMetric>,
    goal_possible: bool,
) -> GroundTask {
    let strata = strata(&raw);
    let always: Vec<bool> = (0..raw.init.len())
        .map(|a| raw.init[a] && !reached.absent[a] && strata[a].is_none() && make.atoms_hold(a))
        .collect();
    let fluent = |a: usize| a >= raw.inner as usize || make.changes(a as u32);
    let carried: Vec<bool> = (0..raw.init.len())
        .map(|a| {
            let matters = relevant.wanted[a] || relevant.unwanted[a];
            reached.atoms[a] && !always[a] && matters && fluent(a)
        })
        .collect();
    let encoding = encode(Choice {
        carried: &carried,
        always,
        groups: &shared(&raw, &groups),
        fixed: &groups.fixed,
        unwanted: &relevant.unwanted,
        derived: &strata,
    });
    let mut variables = variables(task, &raw, &make, &encoding, &strata);
    let initial: Vec<u32> = (0..variables.len()).map(|v| encoding.initial(v, &raw.init)).collect();
    let goal = encoding.conjunction(&raw.goal);
    let missing = raw.goal.literals.iter().any(|&l| l & 1 == 0 && !reached.atoms[(l >> 1) as usize]);
    let unreachable = !goal_possible || goal.is_none() || missing;
    let lasting = raw.actions.iter().filter(|action| action.later.is_some()).count();
    let mut actions = Vec::with_capacity(raw.actions.len() - lasting);
    let mut durative = Vec::with_capacity(lasting);
    for action in std::mem::take(&mut raw.actions) {
        encode_action(&encoding, action, &mut actions, &mut durative);
    }
    drop_contested(&variables, &mut actions, &mut durative);
    let axioms = raw.axioms.iter().filter_map(|axiom| {
        Some(Axiom { head: encoding.fact(axiom.head)?, body: encoding.conjunction(&axiom.body)? })
    });
    let axioms: Vec<Axiom> = axioms.collect();
    let timed: Vec<TimedEffect> =
        raw.timed.iter().map(|(time_s, deeds)| timed(&encoding, *time_s, deeds)).collect();
    let all = actions.iter().flat_map(|a: &GroundAction| &a.effects);
    let mut all = all
        .chain(durative.iter().flat_map(|d: &DurativeAction| d.start_effects.iter().chain(&d.end_effects)));
    drop_unused_none_timed(&mut variables, &initial, &mut all, &timed);
    let mutex_groups = groups
        .found
        .iter()
        .map(|g| g.iter().filter_map(|&a| encoding.fact(a)).collect::<Vec<GroundFact>>())
        .filter(|g| g.windows(2).any(|pair| pair[0].variable != pair[1].variable))
        .collect();
    let numbers = initial_numbers(&make);
    let calls = make.calls.into_iter().map(|c| call(c, &encoding)).collect();
    let mut ground = GroundTask {
        variables,
        numerics: make.numerics,
        comparisons: make.comparisons,
        calls,
        actions,
        durative,
        axioms,
        timed,
        initial: Values { values: initial, numbers },
        goal: goal.unwrap_or_default(),
        metric,
        mutex_groups,
        goal_reachable: !unreachable,
        obstacles: Vec::new(),
    };
    compact(&mut ground, !task.modules.is_empty());
    derive_initial(&mut ground);
    ground
}

/// Mutex groups whose atoms may share one variable. Atoms that a timed literal deletes are left
/// out: they may be false already when it comes, and then it must change nothing.
fn shared(raw: &RawTask, groups: &Groups) -> Vec<Vec<u32>> {
    let lost = raw.timed.iter().flat_map(|(_, deeds)| deeds).filter_map(|deed| match deed {
        Deed::Delete(atom) => Some(*atom),
        _ => None,
    });
    let lost: FxHashSet<u32> = lost.collect();
    let kept = |group: &Vec<u32>| group.iter().copied().filter(|atom| !lost.contains(atom)).collect();
    groups.found.iter().map(kept).collect()
}

/// Drops actions that always give one object function several values at once.
fn drop_contested(
    variables: &[Variable],
    actions: &mut Vec<GroundAction>,
    durative: &mut Vec<DurativeAction>,
) {
    let never = |effects: &[GroundEffect]| {
        let always: Vec<GroundEffect> =
            effects.iter().filter(|effect| effect.when.is_none()).cloned().collect();
        GroundEffect::some_contest(&always, variables)
    };
    if variables.iter().any(Variable::is_object) {
        actions.retain(|action| !never(&action.effects));
        durative.retain(|action| !never(&action.start_effects) && !never(&action.end_effects));
    }
}

fn strata(raw: &RawTask) -> Vec<Option<u32>> {
    let mut strata = vec![None; raw.init.len()];
    for axiom in &raw.axioms {
        strata[axiom.head as usize] = Some(axiom.stratum);
    }
    strata
}

fn call(raw: RawCall, encoding: &Encoding) -> GroundCall {
    let variable = |atom: Option<&u32>| atom.and_then(|&a| encoding.fact(a)).map(|fact| fact.variable);
    let place = |place: &RawPlace| match place {
        RawPlace::Number(id) => Place::Number(*id),
        RawPlace::Truth(atom) => variable(atom.as_ref()).map_or(Place::Nowhere, Place::Truth),
        RawPlace::Object(atoms) => variable(atoms.first()).map_or(Place::Nowhere, Place::Object),
    };
    GroundCall { writes: raw.writes.iter().map(place).collect(), origin: raw.origin }
}

fn drop_unused_none_timed(
    variables: &mut [Variable],
    initial: &[u32],
    effects: &mut dyn Iterator<Item = &GroundEffect>,
    timed: &[TimedEffect],
) {
    let wrapped: Vec<GroundEffect> = timed
        .iter()
        .flat_map(|t| t.outcomes.iter().map(|o| GroundEffect { when: None, outcome: o.clone() }))
        .collect();
    let mut used = used_none(variables, initial);
    effects.for_each(|e| mark_none(variables, e, &mut used));
    wrapped.iter().for_each(|e| mark_none(variables, e, &mut used));
    drop_none(variables, &used);
}

fn variables(
    task: &Task,
    raw: &RawTask,
    make: &Instantiate<'_>,
    encoding: &Encoding,
    strata: &[Option<u32>],
) -> Vec<Variable> {
    let functions = task.predicates.len() as u32;
    let meaning = |atom: u32| {
        if atom >= raw.inner {
            return Meaning::Inner;
        }
        let predicate = make.atoms.predicate(atom);
        let arguments = make.atoms.arguments(atom);
        match arguments.split_last() {
            Some((&value, arguments)) if predicate >= functions => Meaning::Object {
                fluent: predicate - functions,
                arguments: arguments.to_vec(),
                value: Some(value),
            },
            _ => Meaning::Atom { predicate, arguments: arguments.to_vec() },
        }
    };
    encoding
        .atoms
        .iter()
        .map(|atoms| {
            let mut values: Vec<Meaning> = atoms.iter().map(|&a| meaning(a)).collect();
            values.push(match &values[0] {
                Meaning::Object { fluent, arguments, .. } => {
                    Meaning::Object { fluent: *fluent, arguments: arguments.clone(), value: None }
                }
                _ => Meaning::NoneOfThose,
            });
            Variable { values, stratum: strata[atoms[0] as usize] }
        })
        .collect()
}

fn encode_action(
    encoding: &Encoding,
    action: RawAction,
    actions: &mut Vec<GroundAction>,
    durative: &mut Vec<DurativeAction>,
) {
    let Some(condition) = encoding.conjunction(&action.start) else { return };
    let cost = action.cost;
    let origin = Origin { schema: action.schema, arguments: action.arguments.into_vec() };
    let effects = encoding.effects(&action.effects, &[&condition]);
    let Some(later) = action.later else {
        actions.push(GroundAction { origin, condition, effects, cost });
        return;
    };
    let parts = (encoding.conjunction(&later.over_all), encoding.conjunction(&later.end));
    let (Some(over_all), Some(at_end)) = parts else { return };
    let end_effects = encoding.effects(&later.end_effects, &[&over_all, &at_end]);
    let flow = |(fluent, rate): (u32, GroundExpression)| GroundEffect {
        when: None,
        outcome: GroundOutcome::Flow { fluent, rate },
    };
    durative.push(DurativeAction {
        origin,
        duration: later.duration,
        at_start: condition,
        over_all,
        at_end,
        start_effects: effects,
        flow_effects: later.flows.into_iter().map(flow).collect(),
        end_effects,
        cost,
    });
}

fn timed(encoding: &Encoding, time_s: f64, deeds: &[Deed]) -> TimedEffect {
    let effects: Vec<RawEffect> =
        deeds.iter().map(|deed| RawEffect { when: None, deed: deed.clone() }).collect();
    let outcomes = encoding.effects(&effects, &[]).into_iter().map(|effect| effect.outcome);
    TimedEffect { time_s, outcomes: outcomes.collect() }
}

/// Initial values of the numeric fluents; NaN if undefined.
pub(super) fn initial_numbers(make: &Instantiate<'_>) -> Vec<f64> {
    let number = |f: &NumericFluent| {
        make.statics.numbers.get(&(f.function, f.arguments[..].into())).copied().unwrap_or(f64::NAN)
    };
    make.numerics.iter().map(number).collect()
}

/// Drops comparisons and numeric fluents that nothing refers to. With `keep` nothing is dropped.
fn compact(ground: &mut GroundTask, keep: bool) {
    if keep {
        return;
    }
    let mut used = vec![false; ground.comparisons.len()];
    for_conjunctions(ground, &mut |c| c.comparisons.iter().for_each(|&id| used[id as usize] = true));
    let mut next = 0;
    let ids: Vec<u32> = used
        .iter()
        .map(|&used| {
            next += u32::from(used);
            next.wrapping_sub(1)
        })
        .collect();
    let mut index = 0;
    ground.comparisons.retain(|_| {
        index += 1;
        used[index - 1]
    });
    for_conjunctions(ground, &mut |c| c.comparisons.iter_mut().for_each(|id| *id = ids[*id as usize]));
    let mut renumber = Renumber::default();
    for_expressions(ground, &mut |e| {
        let numerics = &mut renumber.numerics;
        let mut mention = |id| {
            numerics.insert(id, 0);
        };
        reads(e, &mut mention, &mut |_| {});
    });
    for_outcomes(ground, &mut |o| {
        if let GroundOutcome::Change { fluent, .. } | GroundOutcome::Flow { fluent, .. } = o {
            renumber.numerics.insert(*fluent, 0);
        }
    });
    let mut kept: Vec<u32> = renumber.numerics.keys().copied().collect();
    kept.sort_unstable();
    for (new, &old) in kept.iter().enumerate() {
        renumber.numerics.insert(old, new as u32);
    }
    ground.initial.numbers = kept.iter().map(|&id| ground.initial.numbers[id as usize]).collect();
    ground.numerics = kept.iter().map(|&id| ground.numerics[id as usize].clone()).collect();
    for_expressions(ground, &mut |e| rename(e, &renumber.numerics));
    for_outcomes(ground, &mut |o| {
        if let GroundOutcome::Change { fluent, .. } | GroundOutcome::Flow { fluent, .. } = o {
            *fluent = renumber.numerics[fluent];
        }
    });
}

fn rename(expression: &mut GroundExpression, numerics: &FxHashMap<u32, u32>) {
    match expression {
        GroundExpression::Fluent(id) => *id = numerics[id],
        GroundExpression::Sum(parts) | GroundExpression::Product(parts) => {
            parts.iter_mut().for_each(|p| rename(p, numerics));
        }
        GroundExpression::Difference(left, right) | GroundExpression::Quotient(left, right) => {
            rename(left, numerics);
            rename(right, numerics);
        }
        GroundExpression::Negative(inner) => rename(inner, numerics),
        GroundExpression::Constant(_)
        | GroundExpression::Call(_)
        | GroundExpression::Duration
        | GroundExpression::TotalTime
        | GroundExpression::Violated(_) => {}
    }
}

fn for_effects(ground: &mut GroundTask) -> impl Iterator<Item = &mut GroundEffect> {
    let actions = ground.actions.iter_mut().flat_map(|a| &mut a.effects);
    let durative = ground
        .durative
        .iter_mut()
        .flat_map(|d| d.start_effects.iter_mut().chain(&mut d.flow_effects).chain(&mut d.end_effects));
    actions.chain(durative)
}

fn for_conjunctions(ground: &mut GroundTask, body: &mut dyn FnMut(&mut Conjunction)) {
    body(&mut ground.goal);
    ground.axioms.iter_mut().for_each(|a| body(&mut a.body));
    ground.actions.iter_mut().for_each(|a| body(&mut a.condition));
    for d in &mut ground.durative {
        [&mut d.at_start, &mut d.over_all, &mut d.at_end].into_iter().for_each(&mut *body);
    }
    for effect in for_effects(ground) {
        if let Some(when) = &mut effect.when {
            [&mut when.here, &mut when.at_start, &mut when.over_all].into_iter().for_each(&mut *body);
        }
    }
}

fn for_outcomes(ground: &mut GroundTask, body: &mut dyn FnMut(&mut GroundOutcome)) {
    for_effects(ground).for_each(|e| body(&mut e.outcome));
    ground.timed.iter_mut().flat_map(|t| &mut t.outcomes).for_each(body);
}

fn for_expressions(ground: &mut GroundTask, body: &mut dyn FnMut(&mut GroundExpression)) {
    for GroundComparison { left, right, .. } in &mut ground.comparisons {
        body(left);
        body(right);
    }
    for_outcomes(ground, &mut |o| match o {
        GroundOutcome::Change { amount, .. } => body(amount),
        GroundOutcome::Flow { rate, .. } => body(rate),
        GroundOutcome::Set(_) | GroundOutcome::Call(_) => {}
    });
    ground.actions.iter_mut().for_each(|a| body(&mut a.cost));
    for d in &mut ground.durative {
        body(&mut d.cost);
        d.duration.iter_mut().for_each(|GroundDurationBound { seconds, .. }| body(seconds));
    }
    if let Some(GroundMetric { expression, additive: false, .. }) = &mut ground.metric {
        body(expression);
    }
}

/// Evaluates the derived variables of the initial state; conditions with attachment calls count as
/// false.
pub(super) fn derive_initial(ground: &mut GroundTask) {
    let mut from = 0;
    while from < ground.axioms.len() {
        let stratum = ground.variables[ground.axioms[from].head.variable as usize].stratum;
        let same = ground.axioms[from..]
            .iter()
            .take_while(|a| ground.variables[a.head.variable as usize].stratum == stratum)
            .count();
        let mut changed = true;
        while std::mem::take(&mut changed) {
            for i in from..from + same {
                let axiom = &ground.axioms[i];
                let head = axiom.head;
                if ground.initial.values[head.variable as usize] != head.value
                    && holds_without_calls(ground, &axiom.body)
                {
                    ground.initial.values[head.variable as usize] = head.value;
                    changed = true;
                }
            }
        }
        from += same;
    }
}

fn holds_without_calls(ground: &GroundTask, condition: &Conjunction) -> bool {
    let state = &ground.initial;
    condition.calls.is_empty()
        && condition.facts.iter().all(|f| state.values[f.variable as usize] == f.value)
        && condition.comparisons.iter().all(|&id| {
            let GroundComparison { left, relation, right } = &ground.comparisons[id as usize];
            relation.holds(left.number(&state.numbers), right.number(&state.numbers))
        })
}

impl GroundExpression {
    /// Value of the expression given the values of the numeric fluents; NaN if a fluent is
    /// undefined or if the expression contains a call, a duration, the total time or a violation
    /// count.
    pub fn number(&self, numbers: &[f64]) -> f64 {
        match self {
            GroundExpression::Constant(value) => *value,
            GroundExpression::Fluent(id) => numbers[*id as usize],
            GroundExpression::Sum(parts) => parts.iter().map(|p| p.number(numbers)).sum(),
            GroundExpression::Product(parts) => parts.iter().map(|p| p.number(numbers)).product(),
            GroundExpression::Difference(left, right) => left.number(numbers) - right.number(numbers),
            GroundExpression::Quotient(left, right) => quotient(left.number(numbers), right.number(numbers)),
            GroundExpression::Negative(inner) => -inner.number(numbers),
            GroundExpression::Call(_)
            | GroundExpression::Duration
            | GroundExpression::TotalTime
            | GroundExpression::Violated(_) => f64::NAN,
        }
    }
}

impl Instantiate<'_> {
    /// True if effects, rules or timed literals change atoms of this atom's predicate.
    fn changes(&self, atom: u32) -> bool {
        let predicate = self.atoms.predicate(atom) as usize;
        predicate < self.statics.task.predicates.len() + self.statics.task.functions.len()
            && self.statics.fluent[predicate]
    }

    /// True if the atom belongs to a predicate. An atom of an object function may cease to hold
    /// without a delete: another value replaces it.
    fn atoms_hold(&self, atom: usize) -> bool {
        atom < self.atoms.len()
            && (self.atoms.predicate(atom as u32) as usize) < self.statics.task.predicates.len()
    }
}
