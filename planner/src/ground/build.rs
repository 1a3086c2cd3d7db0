//! Steps of grounding, from the lifted to the grounded task.

use rustc_hash::{FxHashMap, FxHashSet};
use tracing::debug_span;

use crate::model::relation::Relation;
use crate::task::{GroundChange, Task};

use super::assemble::{assemble, initial_numbers};
use super::atoms::{Atoms, NONE};
use super::groups::groups;
use super::instantiate::{Clauses, Deed, Instantiate, RawEffect};
use super::metric;
use super::normal::{self, Action_, Change_, Effect_, Formula, Normal, Number, Target};
use super::obstacles;
use super::raw::{Later, RawAction, RawAxiom, RawTask, Resolve};
use super::reach::Reach;
use super::relaxed;
use super::relevant::{self, Relevant};
use super::rules::{self, Rules};
use super::statics::{Statics, Tries};
use super::task::{GroundDurationBound, GroundExpression, GroundTask, NumericFluent};

/// Reason why a task was not grounded.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum GroundError {
    /// The caller's stop signal came.
    #[error("stopped while grounding")]
    Stopped,
    /// The memory limit was exceeded: by more than this number of ground atoms and actions.
    #[error("grounding needs more than the memory allowed: over {0} ground atoms and actions")]
    TooLarge(usize),
    /// The named predicate, function or action has more arguments than the implementation can
    /// handle.
    #[error("`{0}` has more than 31 arguments, values of functions included; split it")]
    TooManyArguments(String),
}

/// Approximate memory per ground atom or action until the search compiles the task, bytes.
const BYTES_AN_INSTANCE: usize = 600;

/// Grounds a task: relaxed reachability, evaluation of static parts, removal of unreachable and
/// irrelevant parts, and mutex groups as finite-domain variables.
///
/// # Errors
/// [`GroundError`] when stopped, too large, or beyond the limit on arguments.
pub fn ground(
    task: &Task,
    memory_limit_bytes: Option<usize>,
    stop: &(dyn Fn() -> bool + Sync),
) -> Result<GroundTask, GroundError> {
    ground_with(task, memory_limit_bytes, Keep::Relevant, stop)
}

/// Parts of a grounded task that are kept; others are removed as irrelevant.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Keep {
    /// Parts on which the goal or the metric depends.
    Relevant,
    /// The same parts, with the numeric fluents of the metric as part of the state instead of as
    /// action costs.
    Metric,
    /// All parts on which any goal may depend.
    All,
}

/// Grounds a task and keeps the parts that `kept` selects.
pub(crate) fn ground_with(
    task: &Task,
    memory_limit_bytes: Option<usize>,
    kept: Keep,
    stop: &(dyn Fn() -> bool + Sync),
) -> Result<GroundTask, GroundError> {
    let _span = debug_span!("ground").entered();
    widths(task)?;
    let normal = normal::normalise(task);
    let mut atoms = Atoms::new(normal.predicate_count, task.objects.len());
    let rules = rules::make(task, &normal, &mut || atoms.add_predicate());
    let statics = statics(task, &normal, &rules, stop);
    insert_initial(task, &mut atoms);
    let limit = memory_limit_bytes.map_or(usize::MAX / 2, |bytes| bytes / BYTES_AN_INSTANCE);
    let mut reach = Reach {
        atoms,
        rules: &rules.rules,
        fluent: &rules.fluent,
        possible: &statics,
        instances: vec![Vec::new(); normal.actions.len() + rules.alternatives.len()],
        limit,
        count: 0,
        tried: 0,
        stop,
    };
    let span = debug_span!("reach").entered();
    if reach.run(task.objects.len()).is_err() {
        let large = reach.count + reach.atoms.len() > limit;
        return Err(if large { GroundError::TooLarge(limit) } else { GroundError::Stopped });
    }
    drop(span);
    let (atoms, instances) = (reach.atoms, reach.instances);
    let mut make = Instantiate::new(&statics, atoms);
    let _span = debug_span!("instantiate").entered();
    mark_always(task, &normal, &instances, &mut make, stop)?;
    let (mut raw, goal_possible) = instantiate(task, &normal, &rules, instances, &mut make, stop)?;
    let halt = || if stop() { Err(GroundError::Stopped) } else { Ok(()) };
    halt()?;
    let expression = normal.metric.as_ref().map(|m| make.expression(m, &[]));
    let reached = relaxed::prune(&mut raw, &make.calls);
    let soft = !task.preferences.is_empty() || !task.constraints.is_empty();
    let keep = kept == Keep::All || soft || !task.modules.is_empty();
    let signed = expression.map(|e| (task.metric.as_ref().is_none_or(|m| m.minimise), e));
    let undefined: Vec<bool> = initial_numbers(&make).iter().map(|number| number.is_nan()).collect();
    let costs = metric::costs(&raw, &make.comparisons, &undefined, signed, keep, kept == Keep::Metric);
    for action in &mut raw.actions {
        action.cost = costs.of(action);
    }
    halt()?;
    let lacks = |&literal: &u32| literal & 1 == 0 && !reached.atoms[(literal >> 1) as usize];
    let out_of_reach = !goal_possible
        || raw.goal.literals.iter().any(lacks)
        || raw.actions.is_empty() && raw.timed.is_empty();
    let found = match out_of_reach {
        true => obstacles::obstacles(&normal, &make.atoms, &reached.atoms),
        false => Vec::new(),
    };
    let groups = groups(&raw, &make, &reached, &rules, &normal, task, stop);
    halt()?;
    let everything = |wanted: bool| vec![wanted; raw.init.len()];
    let relevant = if keep {
        let unwanted = absences(&raw);
        Relevant { wanted: everything(true), unwanted, numerics: vec![true; make.numerics.len()] }
    } else {
        let valued = valued(task, &make.atoms);
        let mut relevant =
            relevant::prune(&mut raw, &make.comparisons, &make.calls, &undefined, &costs.read, &valued);
        // An effect that only harms has its conditions too, though nobody wants it to happen.
        let asked = relevant.unwanted.iter_mut().zip(absences(&raw));
        asked.for_each(|(unwanted, asked)| *unwanted |= asked);
        relevant
    };
    halt()?;
    let mut ground = assemble(task, raw, make, reached, relevant, groups, costs.metric, goal_possible);
    ground.obstacles = found;
    Ok(ground)
}

/// Number of the object function instance (function with its arguments) to which each of its atoms
/// belongs, by atom.
fn valued(task: &Task, atoms: &Atoms) -> FxHashMap<u32, u32> {
    let functions = task.predicates.len()..task.predicates.len() + task.functions.len();
    let mut objects: FxHashMap<(u32, &[u32]), u32> = FxHashMap::default();
    let valued = (0..atoms.len() as u32)
        .filter(|&atom| functions.contains(&(atoms.predicate(atom) as usize)))
        .filter_map(|atom| {
            let (_, arguments) = atoms.arguments(atom).split_last()?;
            let next = objects.len() as u32;
            let object = *objects.entry((atoms.predicate(atom), arguments)).or_insert(next);
            Some((atom, object))
        });
    valued.collect()
}

fn widths(task: &Task) -> Result<(), GroundError> {
    let named = task.predicates.iter().map(|p| (&p.name, p.parameters.len()));
    let named = named.chain(task.functions.iter().map(|f| (&f.name, f.parameters.len() + 1)));
    let mut named = named.chain(task.actions.iter().map(|a| (&a.name, a.parameters.len())));
    match named.find(|(_, width)| *width > 31) {
        Some((name, _)) => Err(GroundError::TooManyArguments(name.clone())),
        None => Ok(()),
    }
}

fn statics<'a>(
    task: &'a Task,
    normal: &Normal,
    rules: &Rules,
    stop: &'a (dyn Fn() -> bool + Sync),
) -> Statics<'a> {
    let mut written = vec![false; task.functions.len()];
    for action in &normal.actions {
        for effect in action.start_effects.iter().chain(&action.end_effects) {
            match &effect.change {
                Change_::Number(_, fluent, _) => written[fluent.index as usize] = true,
                Change_::Call(call) => {
                    for target in normal::module_writes(task, call.index) {
                        if let Target::Number(number) = target {
                            written[number.index as usize] = true;
                        }
                    }
                }
                _ => {}
            }
        }
        for (fluent, _) in &action.flows {
            written[fluent.index as usize] = true;
        }
    }
    let mut fluent = rules.fluent.clone();
    for timed in &task.init.timed {
        match &timed.change {
            GroundChange::Add(fact) | GroundChange::Delete(fact) => fluent[fact.predicate.index()] = true,
            GroundChange::Number(number, _) => written[number.function.index()] = true,
            GroundChange::Object(function, _) => {
                fluent[task.predicates.len() + function.function.index()] = true;
            }
        }
    }
    let number = |(fluent, value): &(crate::task::GroundFluent, f64)| {
        ((fluent.function.0, fluent.arguments.iter().map(|o| o.0).collect()), *value)
    };
    let numbers = task.init.numbers.iter().map(number).collect();
    Statics { task, fluent, written, numbers, tries: Tries::new(stop) }
}

/// Atom that states that an object function has a value: its predicate, and its arguments with the
/// value last.
fn object_atom(task: &Task, fluent: &crate::task::GroundFluent, value: u32) -> (u32, Vec<u32>) {
    let mut arguments: Vec<u32> = fluent.arguments.iter().map(|o| o.0).collect();
    arguments.push(value);
    (task.predicates.len() as u32 + fluent.function.0, arguments)
}

fn fact_atom(fact: &crate::task::Fact) -> (u32, Vec<u32>) {
    (fact.predicate.0, fact.arguments.iter().map(|o| o.0).collect())
}

fn insert_initial(task: &Task, atoms: &mut Atoms) {
    let facts = task.init.facts.iter().map(fact_atom);
    let objects = task.init.objects.iter().map(|(fluent, value)| object_atom(task, fluent, value.0));
    let timed = task.init.timed.iter().filter_map(|timed| match &timed.change {
        GroundChange::Add(fact) => Some(fact_atom(fact)),
        GroundChange::Object(fluent, value) => Some(object_atom(task, fluent, value.0)),
        _ => None,
    });
    for (predicate, arguments) in facts.chain(objects).chain(timed) {
        atoms.insert(predicate, &arguments);
    }
}

/// Marks the atoms that hold initially and that nothing deletes, and which therefore hold in every
/// state.
fn mark_always(
    task: &Task,
    normal: &Normal,
    instances: &[Vec<u32>],
    make: &mut Instantiate<'_>,
    stop: &dyn Fn() -> bool,
) -> Result<(), GroundError> {
    let mut always = vec![false; make.atoms.len()];
    for fact in &task.init.facts {
        let (predicate, arguments) = fact_atom(fact);
        if let Some(atom) = make.atoms.find(predicate, &arguments) {
            always[atom as usize] = task.predicates[predicate as usize].stratum.is_none();
        }
    }
    for (action, list) in normal.actions.iter().zip(instances) {
        let effects = action.start_effects.iter().chain(&action.end_effects);
        let deletes = effects.filter(|effect| matches!(effect.change, Change_::Delete(_)));
        let deletes: Vec<Effect_> = deletes.map(unconditional).collect();
        if deletes.is_empty() {
            continue;
        }
        let mut gone = Vec::new();
        for_instances(action, list, stop, |binding| {
            for effect in &deletes {
                make.effect(effect, false, binding, &action.domains, &mut gone);
            }
            for effect in gone.drain(..) {
                if let Deed::Delete(atom) = effect.deed {
                    always[atom as usize] = false;
                }
            }
        })?;
    }
    for module in 0..task.modules.len() as u32 {
        for target in normal::module_writes(task, module) {
            if let Target::Truth(pattern) = target {
                make.atoms.of(pattern.predicate).iter().for_each(|&a| always[a as usize] = false);
            }
        }
    }
    for timed in &task.init.timed {
        if let GroundChange::Delete(fact) = &timed.change {
            let (predicate, arguments) = fact_atom(fact);
            if let Some(atom) = make.atoms.find(predicate, &arguments) {
                always[atom as usize] = false;
            }
        }
    }
    make.always = always;
    Ok(())
}

/// Copy of an effect without its condition.
fn unconditional(effect: &Effect_) -> Effect_ {
    let nothing = || Formula::And(Vec::new());
    Effect_ {
        forall: effect.forall.clone(),
        when: normal::Timed3 { start: nothing(), over_all: nothing(), end: nothing() },
        change: effect.change.clone(),
    }
}

fn for_instances(
    action: &Action_,
    list: &[u32],
    stop: &dyn Fn() -> bool,
    mut body: impl FnMut(&mut Vec<u32>),
) -> Result<(), GroundError> {
    let width = action.arity + action.extra.len();
    let mut binding = vec![NONE; action.domains.len()];
    // Instances without arguments leave no trace: such an action is always made, and goes in the relaxed fixpoint
    // where it cannot be applied.
    let count = list.len().checked_div(width).unwrap_or(1);
    for i in 0..count {
        if i % 1024 == 0 && stop() {
            return Err(GroundError::Stopped);
        }
        let arguments = &list[i * width..(i + 1) * width];
        binding[..action.arity].copy_from_slice(&arguments[..action.arity]);
        for (&slot, &value) in action.extra.iter().zip(&arguments[action.arity..]) {
            binding[slot as usize] = value;
        }
        body(&mut binding);
    }
    Ok(())
}

fn distinct(list: Vec<u32>, width: usize) -> Vec<u32> {
    if width == 0 {
        return list;
    }
    let mut seen: FxHashSet<&[u32]> = FxHashSet::default();
    let kept: Vec<&[u32]> = list.chunks(width).filter(|&chunk| seen.insert(chunk)).collect();
    kept.concat()
}

fn instantiate(
    task: &Task,
    normal: &Normal,
    rules: &Rules,
    mut instances: Vec<Vec<u32>>,
    make: &mut Instantiate<'_>,
    stop: &dyn Fn() -> bool,
) -> Result<(RawTask, bool), GroundError> {
    let top = normal.rules.iter().map(|r| r.stratum + 1).max().unwrap_or(0);
    let statics = make.statics;
    let mut resolve = Resolve::new(make.atoms.len() as u32, &statics.tries);
    let mut axioms = Vec::new();
    for (i, alternative) in rules.alternatives.iter().enumerate() {
        let list = std::mem::take(&mut instances[normal.actions.len() + i]);
        axioms_of(normal, alternative, &list, make, &mut resolve, stop, &mut axioms)?;
    }
    let mut actions = Vec::new();
    for (index, action) in normal.actions.iter().enumerate() {
        let mut list = std::mem::take(&mut instances[index]);
        if rules.repeats[index] {
            list = distinct(list, action.arity + action.extra.len());
        }
        actions.reserve(list.len().checked_div(action.arity + action.extra.len()).unwrap_or(1));
        for_instances(action, &list, stop, |binding| {
            raw_actions(action, binding, make, &mut resolve, top, &mut actions);
        })?;
    }
    let mut goal = Clauses::default();
    let mut binding = vec![NONE; normal.goal_domains.len()];
    let possible = make.conjoin(&normal.goal, &mut binding, &normal.goal_domains, &mut goal);
    let goal = resolve.flat(goal, top);
    if statics.tries.are_stopped() {
        return Err(GroundError::Stopped);
    }
    axioms.append(&mut resolve.axioms);
    axioms.sort_by_key(|a: &RawAxiom| a.stratum);
    let timed = timed(task, make);
    let mut init = vec![false; resolve.atoms() as usize];
    let facts = task.init.facts.iter().map(fact_atom);
    let objects = task.init.objects.iter().map(|(fluent, value)| object_atom(task, fluent, value.0));
    for (predicate, arguments) in facts.chain(objects) {
        if let Some(atom) = make.atoms.find(predicate, &arguments) {
            init[atom as usize] = true;
        }
    }
    Ok((RawTask { actions, axioms, goal, init, inner: make.atoms.len() as u32, timed }, possible))
}

fn axioms_of(
    normal: &Normal,
    alternative: &rules::Alternative,
    list: &[u32],
    make: &mut Instantiate<'_>,
    resolve: &mut Resolve<'_>,
    stop: &dyn Fn() -> bool,
    axioms: &mut Vec<RawAxiom>,
) -> Result<(), GroundError> {
    let rule = &normal.rules[alternative.rule];
    let width = alternative.slots.len();
    let mut binding = vec![NONE; rule.domains.len()];
    let count = list.len().checked_div(width).unwrap_or(1);
    for i in 0..count {
        if i % 1024 == 0 && stop() {
            return Err(GroundError::Stopped);
        }
        for (&slot, &value) in alternative.slots.iter().zip(&list[i * width..(i + 1) * width]) {
            binding[slot as usize] = value;
        }
        let arguments: Vec<u32> = rule.head.terms.iter().map(|t| t.bound(&binding)).collect();
        let Some(head) = make.atoms.find(rule.head.predicate, &arguments) else { continue };
        let mut body = Clauses::default();
        if !alternative.parts.iter().all(|p| make.conjoin(p, &mut binding, &rule.domains, &mut body)) {
            continue;
        }
        for body in resolve.split(body, rule.stratum) {
            axioms.push(RawAxiom { head, body, stratum: rule.stratum });
        }
    }
    Ok(())
}

fn raw_actions(
    action: &Action_,
    binding: &mut Vec<u32>,
    make: &mut Instantiate<'_>,
    resolve: &mut Resolve<'_>,
    top: u32,
    out: &mut Vec<RawAction>,
) {
    let mut start = Clauses::default();
    if !make.conjoin(&action.condition.start, binding, &action.domains, &mut start) {
        return;
    }
    let mut effects = Vec::with_capacity(action.start_effects.len());
    for effect in &action.start_effects {
        make.effect(effect, false, binding, &action.domains, &mut effects);
    }
    if never(&effects) {
        return;
    }
    flatten(&mut effects, resolve, top);
    let later = match &action.duration {
        None => None,
        Some(bounds) => match later(action, bounds, binding, make, resolve, top) {
            Some(later) => Some(Box::new(later)),
            None => return,
        },
    };
    let free = GroundExpression::Constant(0.0);
    let arguments: Box<[u32]> = binding[..action.arity].into();
    let mut ways = resolve.split(start, top);
    let Some(last) = ways.pop() else { return };
    for start in ways {
        let (arguments, effects, later) = (arguments.clone(), effects.clone(), later.clone());
        out.push(RawAction { schema: action.schema, arguments, start, effects, later, cost: free.clone() });
    }
    out.push(RawAction { schema: action.schema, arguments, start: last, effects, later, cost: free });
}

fn later(
    action: &Action_,
    bounds: &[(bool, crate::task::Comparison, Number)],
    binding: &mut Vec<u32>,
    make: &mut Instantiate<'_>,
    resolve: &mut Resolve<'_>,
    top: u32,
) -> Option<Later> {
    let (mut over_all, mut end) = (Clauses::default(), Clauses::default());
    let possible = make.conjoin(&action.condition.over_all, binding, &action.domains, &mut over_all)
        && make.conjoin(&action.condition.end, binding, &action.domains, &mut end);
    if !possible {
        return None;
    }
    let mut end_effects = Vec::new();
    for effect in &action.end_effects {
        make.effect(effect, true, binding, &action.domains, &mut end_effects);
    }
    if never(&end_effects) {
        return None;
    }
    flatten(&mut end_effects, resolve, top);
    let flows = action
        .flows
        .iter()
        .map(|(fluent, rate)| (make.numeric(fluent, binding), make.expression(rate, binding)))
        .collect();
    let duration = bounds
        .iter()
        .map(|(at_end, comparison, number)| {
            let seconds = make.expression(number, binding);
            // What never changes is the same at the start.
            let at_end = *at_end && !matches!(seconds, GroundExpression::Constant(_));
            GroundDurationBound { at_end, relation: Relation::of(*comparison, true), seconds }
        })
        .collect();
    let (over_all, end) = (resolve.flat(over_all, top), resolve.flat(end, top));
    Some(Later { over_all, end, end_effects, flows, duration })
}

/// True if an unconditional effect has an amount that is constant and not finite (undefined).
fn never(effects: &[RawEffect]) -> bool {
    let undefined =
        |amount: &GroundExpression| matches!(amount, GroundExpression::Constant(value) if !value.is_finite());
    let fails = |effect: &RawEffect| matches!(&effect.deed, Deed::Change(_, _, amount) if undefined(amount));
    effects.iter().any(|effect| effect.when.is_none() && fails(effect))
}

fn flatten(effects: &mut [RawEffect], resolve: &mut Resolve<'_>, top: u32) {
    for effect in effects {
        for clauses in effect.when.iter_mut().flat_map(|w| w.iter_mut()) {
            if !clauses.ors.is_empty() {
                *clauses = resolve.flat(std::mem::take(clauses), top);
            }
        }
    }
}

fn timed(task: &Task, make: &mut Instantiate<'_>) -> Vec<(f64, Vec<Deed>)> {
    let mut timed: Vec<(f64, Vec<Deed>)> = Vec::new();
    for entry in &task.init.timed {
        let deeds = match &entry.change {
            GroundChange::Add(fact) => {
                let (predicate, arguments) = fact_atom(fact);
                make.atoms.find(predicate, &arguments).map(Deed::Add).into_iter().collect()
            }
            GroundChange::Delete(fact) => {
                let (predicate, arguments) = fact_atom(fact);
                make.atoms.find(predicate, &arguments).map(Deed::Delete).into_iter().collect()
            }
            GroundChange::Number(fluent, value) => {
                let arguments = fluent.arguments.iter().map(|o| o.0).collect();
                let id = make.numeric_id(NumericFluent { function: fluent.function.0, arguments });
                vec![Deed::Change(
                    id,
                    super::task::Change::Assign,
                    Box::new(GroundExpression::Constant(*value)),
                )]
            }
            GroundChange::Object(fluent, value) => {
                let (predicate, arguments) = object_atom(task, fluent, value.0);
                make.atoms.find(predicate, &arguments).map(Deed::Add).into_iter().collect()
            }
        };
        let deeds: Vec<Deed> = deeds;
        match timed.last_mut() {
            Some((time_s, list)) if *time_s == entry.time_s => list.extend(deeds),
            _ => timed.push((entry.time_s, deeds)),
        }
    }
    timed
}

/// Marks the atoms that some condition requires to be false.
fn absences(raw: &RawTask) -> Vec<bool> {
    let mut unwanted = vec![false; raw.init.len()];
    let mut mark = |clauses: &Clauses| {
        for &literal in clauses.literals.iter().filter(|&&l| l & 1 == 1) {
            unwanted[(literal >> 1) as usize] = true;
        }
    };
    mark(&raw.goal);
    raw.axioms.iter().for_each(|a| mark(&a.body));
    for action in &raw.actions {
        mark(&action.start);
        let later = action.later.as_ref();
        if let Some(later) = later {
            mark(&later.over_all);
            mark(&later.end);
        }
        for effect in action.effects.iter().chain(later.iter().flat_map(|l| &l.end_effects)) {
            effect.when.iter().flat_map(|w| w.iter()).for_each(&mut mark);
        }
    }
    unwanted
}
