//! Compilation of durative actions into instantaneous ones: each action compressed into one, or split
//! into its start and its end.

use std::sync::atomic::{AtomicBool, Ordering};

use rustc_hash::FxHashMap;

use crate::classical::compiled::is_classical;
use crate::ground::{
    Conjunction, Earns, GroundAction, GroundEffect, GroundExpression, GroundFact, GroundMetric,
    GroundOutcome, GroundTask, Meaning, Variable, exclusive,
};
use crate::memory::MemoryLimit;
use crate::search::run::{ClassicalOptions, FIRST_WORK, solve};

use crate::technique::Without;

use super::advance::{Part, TemporalStep};
use super::space::Space;
use super::world::{Act, DurationRange, NOTHING, World};

/// First plan by classical search over the compiled actions, with the numbers of evaluated states and
/// of units of work. `None` if the task cannot be compiled or no plan is found. Durations are ignored,
/// so the plan may not fit in time.
pub fn classical_plan(
    space: &Space,
    memory: MemoryLimit,
    evaluations: u64,
    without: Without,
    stop: &(dyn Fn() -> bool + Sync),
) -> Option<(Vec<TemporalStep>, u64, u64)> {
    let (task, parts) = compressed(space)?;
    if !is_classical(&task) {
        return None;
    }
    let options = ClassicalOptions {
        anytime: false,
        only_first: false,
        soft: false,
        bound: None,
        memory,
        evaluation_limit: Some(if space.tight { evaluations.min(MOST_EVALUATED) } else { evaluations }),
        threads: None,
        first_work: FIRST_WORK,
        without,
    };
    // The first plan is enough: what is cheap one after the other need not be quick side by side.
    let found = AtomicBool::new(false);
    let enough = || found.load(Ordering::Relaxed) || stop();
    let mut actions: Option<Vec<u32>> = None;
    let outcome = solve(&task, &options, &enough, &mut |plan, _| {
        actions.get_or_insert_with(|| plan.to_vec());
        found.store(true, Ordering::Relaxed);
    });
    let actions = actions?;
    let nothing = DurationRange { least_s: 0.0, most_s: 0.0 };
    let step = |&action: &u32| {
        let (act, part) = parts[action as usize];
        TemporalStep { act, part, proposal: None, taken_s: None, span: nothing }
    };
    Some((actions.iter().map(step).collect(), outcome.evaluated, outcome.work))
}

/// Maximum number of states that the classical search evaluates, if times can make its plan impossible.
const MOST_EVALUATED: u64 = 20_000;
/// Maximum number of actions that are split into start and end.
const MOST_APART: usize = 5_000;
/// Maximum number of conditions added to protect the over-all conditions of split actions.
const MOST_GUARDS: usize = 2_000_000;

/// Classical task in which every action is compressed or split, and the temporal action and part behind
/// each classical action. `None` for tasks with timed literals, state-dependent durations, too many
/// split actions, or split actions together with derived facts.
pub fn compressed(space: &Space) -> Option<(GroundTask, Vec<(u32, Part)>)> {
    let world = space.world;
    let apart: Vec<u32> = (0..world.acts.len() as u32).filter(|&act| space.open_act[act as usize]).collect();
    let derived = world.ground.variables.iter().any(|variable| variable.stratum.is_some());
    if !world.ground.timed.is_empty() || apart.len() > MOST_APART || derived && !apart.is_empty() {
        return None;
    }
    let mut task = GroundTask { durative: Vec::new(), actions: Vec::new(), ..world.ground.clone() };
    let mut parts = Vec::new();
    for (index, act) in world.acts.iter().enumerate().filter(|(index, _)| !space.open_act[*index]) {
        let Some(action) = in_one_go(act, seconds(act)?) else { continue };
        task.actions.push(action);
        parts.push((index as u32, Part::Whole));
    }
    for &index in &apart {
        let act = &world.acts[index as usize];
        let running = GroundFact { variable: task.variables.len() as u32, value: 0 };
        let Some(halves) = halves(act, seconds(act)?, running) else { continue };
        task.variables.push(Variable { values: vec![Meaning::Inner, Meaning::NoneOfThose], stratum: None });
        task.initial.values.push(IDLE);
        task.goal.facts.push(GroundFact { value: IDLE, ..running });
        task.actions.extend(halves);
        parts.extend([(index, Part::Start), (index, Part::End)]);
    }
    guard(world, &mut task, &parts)?;
    task.mutex_groups.extend(exclusive(&task));
    let expression = GroundExpression::Constant(0.0);
    task.metric = Some(GroundMetric {
        minimise: true,
        expression,
        additive: true,
        earns: Earns::Never,
        time_weight: 0.0,
    });
    Some((task, parts))
}

/// Value "not running" of the variable that says if a split action is running.
const IDLE: u32 = 1;

/// Start and end of a split action as two classical actions; the fact `running` holds in between.
/// `None` if the action can never run.
fn halves(act: &Act, seconds: f64, running: GroundFact) -> Option<[GroundAction; 2]> {
    let mut inside =
        in_one_go(&Act { at_end: &NOTHING, end_effects: &[], flow_effects: &[], ..act.clone() }, 0.0)?;
    inside.condition.facts.push(GroundFact { value: IDLE, ..running });
    let always = |fact: GroundFact| GroundEffect { when: None, outcome: GroundOutcome::Set(fact) };
    inside.effects.push(always(running));
    let nobody = Act { start_effects: &[], at_start: act.over_all, ..act.clone() };
    let mut end = in_one_go(&nobody, seconds)?;
    end.condition.facts.push(running);
    end.effects.push(always(GroundFact { value: IDLE, ..running }));
    Some([inside, end])
}

/// Adds conditions so that no action deletes an over-all condition of a running split action; `None` if
/// they would be too many.
fn guard(world: &World, task: &mut GroundTask, parts: &[(u32, Part)]) -> Option<()> {
    let mut kept: FxHashMap<u32, Vec<(u32, u32, GroundFact)>> = FxHashMap::default();
    for (action, &(act, _)) in parts.iter().enumerate().filter(|(_, (_, part))| *part == Part::Start) {
        let running = task.actions[action].condition.facts.last().copied()?;
        for fact in &world.acts[act as usize].over_all.facts {
            kept.entry(fact.variable).or_default().push((fact.value, act, running));
        }
    }
    let mut guards = 0;
    for (action, &(act, _)) in task.actions.iter_mut().zip(parts) {
        let own = &world.acts[act as usize];
        let changes = own.start_effects.iter().chain(own.end_effects).filter_map(set);
        let mut idle: Vec<GroundFact> = changes
            .flat_map(|fact| kept.get(&fact.variable).into_iter().flatten().map(move |kept| (fact, kept)))
            .filter(|(fact, (value, other, _))| fact.value != *value && *other != act)
            .map(|(_, &(_, _, running))| running)
            .collect();
        idle.sort_unstable();
        idle.dedup();
        guards += idle.len();
        action.condition.facts.extend(idle);
        action.condition.facts.sort_unstable();
        action.condition.facts.dedup();
        if guards > MOST_GUARDS {
            return None;
        }
    }
    Some(())
}

fn set(effect: &GroundEffect) -> Option<GroundFact> {
    match effect.outcome {
        GroundOutcome::Set(fact) => Some(fact),
        _ => None,
    }
}

fn seconds(act: &Act) -> Option<f64> {
    let mut least_s: f64 = 0.0;
    for bound in act.bounds {
        let GroundExpression::Constant(seconds) = bound.seconds else { return None };
        least_s = least_s.max(seconds);
    }
    Some(least_s)
}

/// Durative action as one classical action; `None` if its start deletes a later condition, its
/// conditions contradict each other, or it has conditional effects on earlier times or a grounding
/// module.
fn in_one_go(act: &Act, seconds: f64) -> Option<GroundAction> {
    let after_start =
        |variable: u32| act.start_effects.iter().rev().filter_map(set).find(|fact| fact.variable == variable);
    let mut condition = act.at_start.clone();
    for later in [act.over_all, act.at_end] {
        condition.comparisons.extend(&later.comparisons);
        condition.calls.extend(&later.calls);
        for fact in &later.facts {
            match after_start(fact.variable) {
                Some(given) if given == *fact => {}
                Some(_) => return None,
                None => condition.facts.push(*fact),
            }
        }
    }
    condition.facts.sort_unstable();
    condition.facts.dedup();
    if condition.facts.windows(2).any(|pair| pair[0].variable == pair[1].variable) {
        return None;
    }
    let overwritten = |fact: GroundFact| {
        act.end_effects
            .iter()
            .any(|end| end.when.is_none() && set(end).is_some_and(|e| e.variable == fact.variable))
    };
    let start = act.start_effects.iter().filter(|effect| set(effect).is_none_or(|fact| !overwritten(fact)));
    let effects: Vec<GroundEffect> = start.chain(act.flow_effects).chain(act.end_effects).cloned().collect();
    // Conditions on effects at the end would be looked up after the start; those are left to the other search.
    let plain = |part: &Conjunction| part.is_empty();
    let odd = act.durative
        && effects.iter().filter_map(|e| e.when.as_ref()).any(|w| !plain(&w.at_start) || !plain(&w.over_all));
    if odd || !act.grounding.is_empty() {
        return None;
    }
    Some(GroundAction {
        origin: act.origin.clone(),
        condition,
        effects,
        cost: GroundExpression::Constant(seconds),
    })
}
