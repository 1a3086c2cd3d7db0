//! Entry point: [`plan`] finds a timed plan for a task, or explains why there is none.

pub(crate) mod optimal;

use std::cell::Cell;
use std::collections::{BTreeMap, BTreeSet};
use std::sync::atomic::{AtomicBool, Ordering};

use crate::attachment::{Attachments, CallStatistics};
use crate::calls::{Calls, report};
use crate::classical::compiled::is_classical;
use crate::diagnostic::{Diagnostic, Findings};
use crate::explain::{Explanation, constrained, explain, narrowed, too_slow};
use crate::ground::{Earliest, Earns, GroundError, GroundExpression, GroundTask, Keep, compile, ground_with};
use crate::memory::MemoryLimit;
use crate::outcome::{Options, Outcome, PlanError, Statistics};
use crate::plan::{EPSILON_S, Plan};
use crate::search::classical::plan_classical;
use crate::task::Task;
use crate::temporal::{Counts, Limits, Measure, Progress, Reason, Timed, World, search_plans, to_plan};
use crate::validate::validate_until;

/// Plans for a task.
///
/// `stop` is polled often; within some milliseconds after it returns true, planning ends with what was
/// found so far. `on_plan` is called with every plan that is better than the one before. All plans are
/// validated. The result is deterministic for a seed, as far as `stop` does not intervene.
///
/// # Errors
///
/// [`PlanError`]: a missing or failing attachment, a part of the language that no search supports, or
/// an internal error.
pub fn plan(
    task: &Task,
    attachments: &Attachments,
    options: &Options,
    stop: &(dyn Fn() -> bool + Sync),
    on_plan: &mut dyn FnMut(&Plan),
) -> Result<Outcome, PlanError> {
    let memory = MemoryLimit::new(options.memory_limit_bytes, options.memory_used);
    if let Some(why) = too_slow(task, freed(task), memory.counted(), stop) {
        return Ok(Outcome::Unsolvable { why, statistics: Statistics::default() });
    }
    let outcome = search(task, attachments, options, stop, on_plan)?;
    let outcome = on_the_way(task, attachments, options, stop, outcome);
    Ok(with_culprits(task, attachments, options, stop, outcome))
}

/// Narrows the explanation of an unsolvable task to the parts of the goal that conflict.
fn with_culprits(
    task: &Task,
    attachments: &Attachments,
    options: &Options,
    stop: &(dyn Fn() -> bool + Sync),
    mut outcome: Outcome,
) -> Outcome {
    if let Outcome::Unsolvable { why, statistics } = &mut outcome
        && options.bound.is_none()
        && task.modules.is_empty()
        && statistics.actions <= MOST_ACTIONS_TAKEN_APART
        && why.exhausted
    {
        let limit = statistics.evaluated.max(LEAST_EVALUATIONS);
        let options =
            Options { evaluation_limit: Some(limit), anytime: false, bound: None, ..options.clone() };
        let mut overlapping = why.overlapping.clone();
        let mut unsolvable = |task: &Task| match search(task, attachments, &options, stop, &mut |_| {}) {
            Ok(Outcome::Unsolvable { why, .. }) if !stop() => {
                overlapping.extend(why.overlapping);
                true
            }
            _ => false,
        };
        if let Some(narrowed) = narrowed(&freed(task), why.only_lost, &mut unsolvable) {
            *why = narrowed.but_for(task, &overlapping);
        }
    }
    outcome
}

/// Maximum number of ground actions for which conflicting parts of an unsolvable goal are sought.
const MOST_ACTIONS_TAKEN_APART: u64 = 5_000;
/// Maximum spacing of `f64` at the end of a plan, as a fraction of epsilon; beyond, planning fails
/// as `too-long`.
/// From: a few times, each rounded by half of that spacing, are added up between two happenings.
const LEAST_SPACING: f64 = 0.1;
/// Memory of a search's own form of the task, as a multiple of the grounded task's.
const FORMS: usize = 2;
/// Minimum limit on evaluated states for the searches that explain why there is no plan.
const LEAST_EVALUATIONS: u64 = 1_000;

/// After a search without a plan, determines whether the goal itself is unreachable or only the
/// constraints cannot be kept.
fn on_the_way(
    task: &Task,
    attachments: &Attachments,
    options: &Options,
    stop: &(dyn Fn() -> bool + Sync),
    outcome: Outcome,
) -> Outcome {
    let Outcome::Unsolvable { statistics, .. } = &outcome else { return outcome };
    let plain = task.constraints.is_empty() && task.preferences.is_empty();
    if plain || options.bound.is_some() && !task.is_temporal() {
        return outcome;
    }
    let limit = (2 * statistics.evaluated).max(LEAST_EVALUATIONS);
    let options = Options { evaluation_limit: Some(limit), anytime: false, bound: None, ..options.clone() };
    let statistics = statistics.clone();
    match search(&freed(task), attachments, &options, stop, &mut |_| {}) {
        Ok(Outcome::Unsolvable { why, .. }) => Outcome::Unsolvable { why, statistics },
        _ if task.is_temporal() => Outcome::OutOfTime { best: None, statistics },
        found => {
            let reachable = matches!(found, Ok(Outcome::Solved { .. }));
            Outcome::Unsolvable { why: constrained(task, reachable), statistics }
        }
    }
}

/// Task without constraints and preferences; also without metric if there were preferences.
fn freed(task: &Task) -> Task {
    let mut free = task.clone();
    free.constraints.clear();
    if !free.preferences.is_empty() {
        free.preferences.clear();
        free.actions.iter_mut().for_each(|action| action.preferences.clear());
        free.metric = None;
    }
    free
}

/// Plans for a task after compiling its preferences and constraints away.
fn search(
    task: &Task,
    attachments: &Attachments,
    options: &Options,
    stop: &(dyn Fn() -> bool + Sync),
    on_plan: &mut dyn FnMut(&Plan),
) -> Result<Outcome, PlanError> {
    let Some(compiled) = compile(task) else {
        return search_on(task, task, None, attachments, options, stop, on_plan);
    };
    let mut outcome = search_on(task, &compiled.task, None, attachments, options, stop, on_plan)?;
    let statistics = outcome.statistics_mut();
    statistics.scored_only = compiled.forgets || compiled.uncounted;
    // Times say more than the compiled task does of what happens at once and when.
    statistics.optimal &= !statistics.scored_only && !task.is_temporal();
    Ok(outcome)
}

/// Plans for `task`, a compilation of `original`. Without bookkeeping actions, the plans are valid
/// for `original`.
///
/// If actions certainly improve the metric, there may be ever more and better states. Then a first
/// search ignores this and finds a plan, or proves that there is none; with `anytime`, a second
/// search improves the metric. `grounded`: `task` grounded already, if it was.
pub(crate) fn search_on(
    original: &Task,
    task: &Task,
    grounded: Option<&GroundTask>,
    attachments: &Attachments,
    options: &Options,
    stop: &(dyn Fn() -> bool + Sync),
    on_plan: &mut dyn FnMut(&Plan),
) -> Result<Outcome, PlanError> {
    let (outcome, earns) = search_for(original, task, grounded, attachments, options, stop, on_plan)?;
    let Outcome::Solved { plan, mut statistics } = outcome else { return Ok(outcome) };
    statistics.optimal &= earns == Earns::Never;
    let evaluation_limit = options.evaluation_limit.map(|limit| limit.saturating_sub(statistics.evaluated));
    if earns != Earns::Surely || !options.anytime || evaluation_limit == Some(0) {
        return Ok(Outcome::Solved { plan, statistics });
    }
    let sign = if original.metric.as_ref().is_none_or(|metric| metric.minimise) { 1.0 } else { -1.0 };
    let cost = |plan: &Plan| sign * plan.cost.unwrap_or(0.0);
    let (mut best, mut plans) = (plan, statistics.plans);
    let mut hear = |plan: &Plan| {
        if cost(plan) < cost(&best) {
            best = plan.clone();
            plans += 1;
            on_plan(plan);
        }
    };
    let options = Options { evaluation_limit, ..options.clone() };
    let (outcome, _) = search_keeping(original, task, attachments, &options, Keep::Metric, stop, &mut hear)?;
    let more = outcome.statistics();
    statistics.plans = plans;
    statistics.evaluated += more.evaluated;
    statistics.expanded += more.expanded;
    statistics.optimal = more.optimal;
    Ok(match outcome {
        Outcome::OutOfTime { .. } => Outcome::OutOfTime { best: Some(best), statistics },
        Outcome::OutOfMemory { .. } => Outcome::OutOfMemory { best: Some(best), statistics },
        Outcome::Solved { .. } | Outcome::Unsolvable { .. } => Outcome::Solved { plan: best, statistics },
    })
}

/// Runs one search on the given grounded task, or grounds the parts of the task that are relevant
/// to the goal. Also returns whether actions may improve the metric.
fn search_for(
    original: &Task,
    task: &Task,
    grounded: Option<&GroundTask>,
    attachments: &Attachments,
    options: &Options,
    stop: &(dyn Fn() -> bool + Sync),
    on_plan: &mut dyn FnMut(&Plan),
) -> Result<(Outcome, Earns), PlanError> {
    let memory = MemoryLimit::new(options.memory_limit_bytes, options.memory_used);
    match grounded {
        Some(grounded) => search_in(original, task, grounded, attachments, options, memory, stop, on_plan),
        None => search_keeping(original, task, attachments, options, Keep::Relevant, stop, on_plan),
    }
}

/// Grounds a task, keeping the parts that `keep` selects, and runs one search on it.
fn search_keeping(
    original: &Task,
    task: &Task,
    attachments: &Attachments,
    options: &Options,
    keep: Keep,
    stop: &(dyn Fn() -> bool + Sync),
    on_plan: &mut dyn FnMut(&Plan),
) -> Result<(Outcome, Earns), PlanError> {
    let memory = MemoryLimit::new(options.memory_limit_bytes, options.memory_used);
    let full = AtomicBool::new(false);
    let halt = || {
        let room = memory.counted().is_some() || memory.has_room(|| 0, 0);
        full.fetch_or(!room, Ordering::Relaxed);
        !room || stop()
    };
    let out_of_memory =
        || Ok((Outcome::OutOfMemory { best: None, statistics: Statistics::default() }, Earns::Never));
    let grounded = match ground_with(task, memory.counted(), keep, &halt) {
        Ok(grounded) => grounded,
        Err(GroundError::Stopped) if full.load(Ordering::Relaxed) => return out_of_memory(),
        Err(error) => return Ok((grounding_ended(task, error)?, Earns::Never)),
    };
    search_in(original, task, &grounded, attachments, options, memory, stop, on_plan)
}

/// Runs one search on a grounded task.
#[allow(clippy::too_many_arguments)]
fn search_in(
    original: &Task,
    task: &Task,
    grounded: &GroundTask,
    attachments: &Attachments,
    options: &Options,
    memory: MemoryLimit,
    stop: &(dyn Fn() -> bool + Sync),
    on_plan: &mut dyn FnMut(&Plan),
) -> Result<(Outcome, Earns), PlanError> {
    let additive = grounded.metric.as_ref().filter(|metric| metric.additive);
    let earns = additive.map_or(Earns::Never, |metric| metric.earns);
    let options = &Options { anytime: options.anytime && earns != Earns::Surely, ..options.clone() };
    // Every search has its own form of the grounded task beside it.
    let compiled = FORMS * grounded.bytes();
    if grounded.goal_reachable && !memory.has_room(|| grounded.bytes(), compiled) {
        return Ok((Outcome::OutOfMemory { best: None, statistics: Statistics::default() }, earns));
    }
    let memory = memory.beside(compiled);
    // What searches know of preferences may be less than what the validator counts.
    let least = Cell::new(f64::INFINITY);
    let sign = if original.metric.as_ref().is_none_or(|metric| metric.minimise) { 1.0 } else { -1.0 };
    let unchecked = Cell::new(false);
    let check = |plan| {
        let Some(plan) = checked(original, attachments, plan, stop)? else {
            unchecked.set(true);
            return Ok(None);
        };
        let cost = sign * plan.cost.unwrap_or(0.0);
        let better = original.preferences.is_empty() || cost < least.get();
        least.set(least.get().min(cost));
        Ok(better.then_some(plan))
    };
    // Parameters that a module proposes are no part of the ground actions: only the search in time asks for them.
    let proposes = task.actions.iter().any(|action| !action.grounding.is_empty());
    if grounded.goal_reachable && !proposes && is_classical(grounded) {
        // Violations are numbers that the original does not have.
        let soft = !original.preferences.is_empty() && task.functions.len() > original.functions.len();
        let outcome = plan_classical(task, grounded, options, soft, memory, stop, &check, on_plan)?;
        return Ok((found_at_least(outcome, unchecked.get()), earns));
    }
    let outcome =
        plan_in_time((task, grounded), attachments, limits(options, memory), stop, &check, on_plan)?;
    Ok((found_at_least(outcome, unchecked.get()), earns))
}

/// Outcome without its proof if some plan was found but its validation was stopped (`unchecked`).
fn found_at_least(outcome: Outcome, unchecked: bool) -> Outcome {
    match outcome {
        Outcome::Unsolvable { statistics, .. } if unchecked => Outcome::OutOfTime { best: None, statistics },
        Outcome::Solved { plan, mut statistics } if unchecked => {
            statistics.optimal = false;
            Outcome::OutOfTime { best: Some(plan), statistics }
        }
        outcome => outcome,
    }
}

/// Plans for a grounded task with times, attachments or costs that depend on the state.
fn plan_in_time(
    (task, grounded): (&Task, &GroundTask),
    attachments: &Attachments,
    limits: Limits,
    stop: &(dyn Fn() -> bool + Sync),
    check: &dyn Fn(Plan) -> Result<Option<Plan>, PlanError>,
    on_plan: &mut dyn FnMut(&Plan),
) -> Result<Outcome, PlanError> {
    let before = attachments.statistics();
    let calls = Calls::bind(task, grounded, attachments)?;
    configure(task, attachments)?;
    let world = World::new(task, grounded, calls);
    let mut statistics = Statistics {
        actions: (grounded.actions.len() + grounded.durative.len()) as u64,
        ..Statistics::default()
    };
    let mut best: Option<Plan> = None;
    let mut invalid: Option<PlanError> = None;
    let mut hear = |timed: &[Timed]| {
        let plan = to_plan(&world, timed);
        match check(plan) {
            Ok(Some(plan)) => {
                on_plan(&plan);
                best = Some(plan);
            }
            Ok(None) => {}
            Err(error) => invalid = Some(error),
        }
        Ok(())
    };
    let comes_and_lasts =
        |earliest: Earliest| earliest.of(&grounded.goal).is_finite() && earliest.lasts(&grounded.goal);
    let in_time = grounded.timed.is_empty() || comes_and_lasts(Earliest::new(grounded));
    let found = match grounded.goal_reachable && in_time {
        true => search_plans(&world, &measure(grounded), limits, stop, &mut hear),
        false => Ok(Progress {
            reason: Reason::Exhausted,
            counts: Counts::default(),
            plans: 0,
            overlapping: Vec::new(),
        }),
    };
    let progress = found.map_err(|failure| world.calls.report(failure))?;
    if let Some(error) = invalid.filter(|error| best.is_none() || matches!(error, PlanError::Internal { .. }))
    {
        return Err(error);
    }
    statistics.evaluated = progress.counts.evaluated;
    statistics.expanded = progress.counts.expanded;
    statistics.plans = progress.plans;
    statistics.attachments = since(&before, attachments.statistics());
    let schemas = progress.overlapping.iter().map(|&act| world.acts[act as usize].origin.schema);
    let overlapping: BTreeSet<String> =
        schemas.map(|schema| task.actions[schema as usize].name.clone()).collect();
    let why = || explain(task, grounded, &world.calls.refusals()).but_for(task, &overlapping);
    let reason = match progress.reason {
        Reason::Exhausted if best.is_some() && (!overlapping.is_empty() || world.chooses_costs()) => {
            Reason::Enough
        }
        reason => reason,
    };
    Ok(ended(best, reason, why, statistics))
}

/// Outcome of planning after a temporal search ended for `reason`.
fn ended(
    best: Option<Plan>,
    reason: Reason,
    why: impl FnOnce() -> Explanation,
    mut statistics: Statistics,
) -> Outcome {
    match (best, reason) {
        (Some(plan), Reason::Exhausted | Reason::Enough) => {
            statistics.optimal = reason == Reason::Exhausted;
            Outcome::Solved { plan, statistics }
        }
        (None, Reason::Exhausted | Reason::Enough) => Outcome::Unsolvable { why: why(), statistics },
        (best, Reason::Stopped | Reason::Unproven) => Outcome::OutOfTime { best, statistics },
        (best, Reason::Memory) => Outcome::OutOfMemory { best, statistics },
    }
}

fn limits(options: &Options, memory: MemoryLimit) -> Limits {
    Limits {
        anytime: options.anytime,
        first: options.first,
        bound: options.bound.unwrap_or(f64::INFINITY),
        evaluations: options.evaluation_limit.unwrap_or(u64::MAX),
        memory,
        seed: options.seed,
        without: options.without,
    }
}

fn grounding_ended(task: &Task, error: GroundError) -> Result<Outcome, PlanError> {
    let statistics = Statistics::default();
    match error {
        GroundError::Stopped => Ok(Outcome::OutOfTime { best: None, statistics }),
        GroundError::TooLarge(_) => Ok(Outcome::OutOfMemory { best: None, statistics }),
        other => {
            let place = task.actions.first().map(|action| action.span).unwrap_or_default();
            let finding = Diagnostic::error("too-many-arguments", other.to_string(), place, "in this domain");
            Err(PlanError::Refused(Findings { sources: task.sources.to_vec(), list: vec![finding] }))
        }
    }
}

/// Passes `:moduleoptions` to the attachments of the same names; other entries are meant for other
/// planners.
fn configure(task: &Task, attachments: &Attachments) -> Result<(), PlanError> {
    for option in &task.module_options {
        let name = option.function.split('@').next().unwrap_or_default();
        attachments.configure(name, &option.arguments).map_err(|error| report(task, Box::new(error)))?;
    }
    Ok(())
}

/// Measure by which the temporal search compares plans of a task.
fn measure(grounded: &GroundTask) -> Measure {
    match &grounded.metric {
        None => Measure::Makespan,
        Some(metric) if metric.minimise && metric.expression == GroundExpression::TotalTime => {
            Measure::Makespan
        }
        Some(metric) if metric.additive => {
            let sign = if metric.minimise { 1.0 } else { -1.0 };
            Measure::Additive { sign, time_weight: sign * metric.time_weight }
        }
        Some(metric) if metric.minimise => Measure::Expression(metric.expression.clone()),
        Some(metric) => Measure::Expression(GroundExpression::Negative(Box::new(metric.expression.clone()))),
    }
}

/// Validates a plan, with noise removed from its times where possible; `None` if validation was
/// stopped.
///
/// # Errors
/// [`PlanError::Untried`] if only constraints are violated; [`PlanError::Refused`] if the plan is
/// too long for `f64`; else [`PlanError::Internal`].
fn checked(
    task: &Task,
    attachments: &Attachments,
    mut plan: Plan,
    stop: &(dyn Fn() -> bool + Sync),
) -> Result<Option<Plan>, PlanError> {
    plan.steps.retain(|step| !step.action.contains(' '));
    if !task.init.timed.is_empty() && plan.makespan_s().is_none() {
        give_times(task, &mut plan);
    }
    // What is left of rounding goes, unless the plan rests on it.
    let tidy = plan.tidy();
    if tidy != plan {
        let Some(verdict) = validate_until(task, attachments, &tidy, stop) else { return Ok(None) };
        if verdict.valid {
            return Ok(Some(Plan { cost: verdict.cost, ..tidy }));
        }
    }
    let Some(verdict) = validate_until(task, attachments, &plan, stop) else { return Ok(None) };
    if verdict.valid {
        return Ok(Some(Plan { cost: verdict.cost, ..plan }));
    }
    if task.constraints.iter().any(|constraint| constraint.preference.is_none()) {
        let mut free = task.clone();
        free.constraints.retain(|constraint| constraint.preference.is_some());
        let Some(freely) = validate_until(&free, attachments, &plan, stop) else { return Ok(None) };
        if freely.valid {
            let help = "checked, but not planned for: `always-within`, `hold-during` and `hold-after`, `within` where actions take no \
                 time, and what attachments say or changes by itself; ask for the same in conditions and the goal";
            let explained = |finding: Diagnostic| {
                let message = format!("not decided: in the plan that was found {}", finding.message);
                Diagnostic { message, ..finding }.with_help(help)
            };
            let list = verdict.findings.list.into_iter().map(explained).collect();
            return Err(PlanError::Untried(Findings { list, ..verdict.findings }));
        }
    }
    if let Some(finding) = too_long(task, &plan) {
        let findings = Findings { sources: task.sources.to_vec(), list: vec![finding] };
        return Err(PlanError::Refused(findings));
    }
    Err(PlanError::Internal { reason: verdict.reason.unwrap_or_default(), plan })
}

/// Error about the longest action of a plan that is too long for times of `f64` to be exact enough;
/// `None` for shorter plans.
fn too_long(task: &Task, plan: &Plan) -> Option<Diagnostic> {
    let spacing_s = plan.makespan_s()? * f64::EPSILON;
    let longest = plan.steps.iter().max_by(|one, other| one.duration_s.total_cmp(&other.duration_s))?;
    let action = task.actions.iter().find(|action| action.name == longest.action)?;
    let message =
        format!("plans of {:.0e} s are too long: times have steps of {EPSILON_S} s", plan.makespan_s()?);
    let label = format!("this may take {:.0e} s", longest.duration_s);
    let finding = Diagnostic::error("too-long", message, action.span, label);
    (spacing_s > LEAST_SPACING * EPSILON_S)
        .then(|| finding.with_help("give durations and times in a larger unit, such as hours"))
}

/// Assigns start times one epsilon apart to a plan without times, leaving out the times of timed
/// literals.
fn give_times(task: &Task, plan: &mut Plan) {
    let is_taken =
        |at_s: f64| task.init.timed.iter().any(|timed| (timed.time_s - at_s).abs() < EPSILON_S / 2.0);
    let mut times_s = (0..).map(|tick: u32| f64::from(tick) * EPSILON_S).filter(|&at_s| !is_taken(at_s));
    plan.steps.iter_mut().for_each(|step| step.start_s = times_s.next());
}

fn since(
    before: &BTreeMap<String, CallStatistics>,
    mut now: BTreeMap<String, CallStatistics>,
) -> BTreeMap<String, CallStatistics> {
    for (name, counts) in &mut now {
        if let Some(earlier) = before.get(name) {
            counts.calls -= earlier.calls;
            counts.relaxed -= earlier.relaxed;
            counts.hits -= earlier.hits;
            counts.time_s -= earlier.time_s;
        }
    }
    now.retain(|_, counts| counts.calls + counts.relaxed + counts.hits > 0);
    now
}
