//! The way in: [`plan`] takes a task to a timed plan, or says why there is none.

use std::collections::BTreeMap;

use serde::Serialize;

use crate::attachment::{AttachmentError, Attachments, CallStatistics};
use crate::calls::{Calls, report};
use crate::diagnostic::{Diagnostic, Findings};
use crate::explain::{Explanation, explain, is_open, narrowed};
use crate::ground::{Expression, GroundError, GroundTask, ground};
use crate::plan::Plan;
use crate::search::classical::plan_classical;
use crate::search::compiled::is_classical;
use crate::task::Task;
use crate::temporal::{Counts, Limits, Measure, Progress, Reason, Timed, World, search_plans};
use crate::validate::validate;

/// The least time between two happenings of which one disturbs the other, in seconds.
pub const EPSILON_S: f64 = 0.001;

/// How to plan.
#[derive(Debug, Clone, Default)]
pub struct Options {
    /// Keep improving until stopped, or until the best plan is proven best. Otherwise stop after the first plan and a
    /// short improvement whose length is fixed by the task alone.
    pub anytime: bool,
    /// Accept only plans whose metric (makespan or cost where there is none) is below this.
    pub bound: Option<f64>,
    /// Decides every choice that is left to chance; the search for plans without times leaves none.
    pub seed: u64,
    /// Give up beyond this much memory for the grounded task and the search.
    pub memory_limit_bytes: Option<u64>,
    /// Give up, or stop improving, after this many evaluated states.
    pub evaluation_limit: Option<u64>,
}

/// What planning took.
#[derive(Debug, Clone, Default, PartialEq, Serialize)]
pub struct Statistics {
    /// States evaluated by a heuristic.
    pub evaluated: u64,
    /// States whose successors were made.
    pub expanded: u64,
    /// Plans found, each better than the one before.
    pub plans: u64,
    /// Ground actions.
    pub actions: u64,
    /// Set where the plan is proven to be best.
    pub optimal: bool,
    /// Set where the task has preferences: they score plans, and no search looks for those that keep more of them.
    pub scored_only: bool,
    /// By attachment, for this call alone.
    pub attachments: BTreeMap<String, CallStatistics>,
}

/// How planning ended.
#[derive(Debug, Clone)]
pub enum Outcome {
    /// A plan, validated.
    Solved {
        /// The best plan found.
        plan: Plan,
        /// What it took.
        statistics: Statistics,
    },
    /// Proven to have no plan.
    Unsolvable {
        /// Why.
        why: Explanation,
        /// What it took.
        statistics: Statistics,
    },
    /// Stopped before a plan was found, or (anytime) before the best one was proven best: then with a plan.
    OutOfTime {
        /// The best plan so far.
        best: Option<Plan>,
        /// What it took.
        statistics: Statistics,
    },
    /// The memory limit was reached.
    OutOfMemory {
        /// The best plan so far.
        best: Option<Plan>,
        /// What it took.
        statistics: Statistics,
    },
}

impl Outcome {
    /// The plan, if there is one.
    pub fn plan(&self) -> Option<&Plan> {
        match self {
            Outcome::Solved { plan, .. } => Some(plan),
            Outcome::OutOfTime { best, .. } | Outcome::OutOfMemory { best, .. } => best.as_ref(),
            Outcome::Unsolvable { .. } => None,
        }
    }

    /// What it took.
    pub fn statistics(&self) -> &Statistics {
        match self {
            Outcome::Solved { statistics, .. }
            | Outcome::Unsolvable { statistics, .. }
            | Outcome::OutOfTime { statistics, .. }
            | Outcome::OutOfMemory { statistics, .. } => statistics,
        }
    }

    fn statistics_mut(&mut self) -> &mut Statistics {
        match self {
            Outcome::Solved { statistics, .. }
            | Outcome::Unsolvable { statistics, .. }
            | Outcome::OutOfTime { statistics, .. }
            | Outcome::OutOfMemory { statistics, .. } => statistics,
        }
    }
}

/// Why there is no answer at all.
#[derive(Debug, Clone, thiserror::Error)]
#[non_exhaustive]
pub enum PlanError {
    /// The task asks for something that cannot be done: a module without an attachment, or a part of the language that
    /// no search here handles. Each finding points at its place.
    #[error("{}", first_message(.0))]
    Refused(Findings),
    /// An attachment failed; the finding points at the call in the domain.
    #[error("{error}")]
    Attachment {
        /// The failed call.
        error: Box<AttachmentError>,
        /// The same, under the text.
        findings: Findings,
    },
    /// The search's plan does not pass validation: a fault of this crate.
    #[error("internal error: a plan that was found is not valid: {reason}\n{plan}")]
    Internal {
        /// What the validator said.
        reason: String,
        /// The plan.
        plan: Plan,
    },
}

impl PlanError {
    /// What can be drawn under the text of the domain, if it is the domain's fault.
    pub fn findings(&self) -> Option<&Findings> {
        match self {
            PlanError::Refused(findings) | PlanError::Attachment { findings, .. } => Some(findings),
            PlanError::Internal { .. } => None,
        }
    }
}

fn first_message(findings: &Findings) -> &str {
    findings.list.first().map_or("the task is refused", |finding: &Diagnostic| finding.message.as_str())
}

/// Plans.
///
/// `stop` is asked often; once it says true, planning ends within some milliseconds with what it has. `on_plan` hears
/// of every plan that is better than the one before. Every plan has been validated. Deterministic for a seed, up to
/// when `stop` says true.
///
/// # Errors
///
/// [`PlanError`]: a missing or failing attachment, a part of the language that no search handles, or a fault of ours.
pub fn plan(
    task: &Task,
    attachments: &Attachments,
    options: &Options,
    stop: &(dyn Fn() -> bool + Sync),
    on_plan: &mut dyn FnMut(&Plan),
) -> Result<Outcome, PlanError> {
    let mut outcome = search(task, attachments, options, stop, on_plan)?;
    outcome.statistics_mut().scored_only = !task.preferences.is_empty();
    if let Outcome::Unsolvable { why, statistics } = &mut outcome
        && options.bound.is_none()
        && task.modules.is_empty()
        && statistics.actions <= MOST_ACTIONS_TAKEN_APART
        && is_open(why)
    {
        let limit = statistics.evaluated.max(LEAST_EVALUATIONS);
        let options =
            Options { evaluation_limit: Some(limit), anytime: false, bound: None, ..options.clone() };
        let mut unsolvable = |task: &Task| {
            let found = search(task, attachments, &options, stop, &mut |_| {});
            !stop() && matches!(found, Ok(Outcome::Unsolvable { .. }))
        };
        if let Some(narrowed) = narrowed(task, &mut unsolvable) {
            *why = narrowed;
        }
    }
    Ok(outcome)
}

/// Goals of tasks with more ground actions than this are not taken apart to find out which parts are to blame.
const MOST_ACTIONS_TAKEN_APART: u64 = 5_000;
/// Evaluated states that a part of a goal may always take.
const LEAST_EVALUATIONS: u64 = 1_000;

fn search(
    task: &Task,
    attachments: &Attachments,
    options: &Options,
    stop: &(dyn Fn() -> bool + Sync),
    on_plan: &mut dyn FnMut(&Plan),
) -> Result<Outcome, PlanError> {
    let before = attachments.statistics();
    let memory_bytes =
        options.memory_limit_bytes.map_or(usize::MAX, |bytes| usize::try_from(bytes).unwrap_or(usize::MAX));
    let grounded = match ground(task, options.memory_limit_bytes.map(|_| memory_bytes), stop) {
        Ok(grounded) => grounded,
        Err(error) => return grounding_ended(task, error),
    };
    // Every search has its own form of the grounded task beside it.
    let memory_bytes = memory_bytes.saturating_sub(2 * grounded.bytes());
    if grounded.goal_reachable && is_classical(&grounded) {
        let check = |plan| checked(task, attachments, plan);
        let left = options.memory_limit_bytes.map(|_| memory_bytes as u64);
        let options = Options { memory_limit_bytes: left, ..options.clone() };
        return plan_classical(task, &grounded, &options, stop, &check, on_plan);
    }
    let calls = Calls::bind(task, &grounded, attachments)?;
    configure(task, attachments)?;
    let world = World::new(task, &grounded, calls);
    let mut statistics = Statistics {
        actions: (grounded.actions.len() + grounded.durative.len()) as u64,
        ..Statistics::default()
    };
    let limits = Limits {
        anytime: options.anytime,
        bound: options.bound.unwrap_or(f64::INFINITY),
        evaluations: options.evaluation_limit.unwrap_or(u64::MAX),
        memory_bytes,
        seed: options.seed,
    };
    let mut best: Option<Plan> = None;
    let mut invalid: Option<PlanError> = None;
    let mut hear = |timed: &[Timed]| {
        let plan = to_plan(task, &grounded, &world, timed);
        match checked(task, attachments, plan) {
            Ok(plan) => {
                on_plan(&plan);
                best = Some(plan);
            }
            Err(error) => invalid = Some(error),
        }
        Ok(())
    };
    let found = match grounded.goal_reachable {
        true => search_plans(&world, &measure(&grounded), limits, stop, &mut hear),
        false => Ok(Progress { reason: Reason::Exhausted, counts: Counts::default(), plans: 0 }),
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
    Ok(match (best, progress.reason) {
        (Some(plan), reason @ (Reason::Exhausted | Reason::Enough)) => {
            // What preferences cost, only the validator knows.
            statistics.optimal = reason == Reason::Exhausted && task.preferences.is_empty();
            Outcome::Solved { plan, statistics }
        }
        (None, Reason::Exhausted | Reason::Enough) => {
            let why = explain(task, &grounded, &world.calls.refusals());
            Outcome::Unsolvable { why, statistics }
        }
        (best, Reason::Stopped | Reason::Unproven) => Outcome::OutOfTime { best, statistics },
        (best, Reason::Memory) => Outcome::OutOfMemory { best, statistics },
    })
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

/// Hands `:moduleoptions` to the attachments of those names; entries that name none are for another planner.
fn configure(task: &Task, attachments: &Attachments) -> Result<(), PlanError> {
    for option in &task.module_options {
        let name = option.function.split('@').next().unwrap_or_default();
        attachments.configure(name, &option.arguments).map_err(|error| report(task, Box::new(error)))?;
    }
    Ok(())
}

/// What plans of a task are measured by.
fn measure(grounded: &GroundTask) -> Measure {
    match &grounded.metric {
        None => Measure::Makespan,
        Some(metric) if metric.minimise && metric.expression == Expression::TotalTime => Measure::Makespan,
        Some(metric) if metric.additive && metric.minimise => {
            Measure::Additive { time_weight: metric.time_weight }
        }
        Some(metric) if metric.minimise => Measure::Expression(metric.expression.clone()),
        Some(metric) => Measure::Expression(Expression::Negative(Box::new(metric.expression.clone()))),
    }
}

fn to_plan(task: &Task, grounded: &GroundTask, world: &World, timed: &[Timed]) -> Plan {
    let classical = grounded.durative.is_empty() && grounded.timed.is_empty();
    let steps = timed.iter().map(|timed| {
        let origin = &world.acts[timed.step.act as usize].origin;
        let names = origin.arguments.iter().map(|&object| task.objects[object as usize].name.clone());
        crate::plan::Step {
            start_s: (!classical).then_some(timed.start_s),
            action: task.actions[origin.schema as usize].name.clone(),
            arguments: names.chain(timed.step.proposal.iter().map(|name| name.to_string())).collect(),
            duration_s: timed.duration_s,
        }
    });
    Plan { steps: steps.collect(), ..Plan::default() }
}

/// Every plan that leaves this crate has passed the validator. The searches do not look at constraints on the way to the
/// goal: a plan that breaks nothing else is refused.
fn checked(task: &Task, attachments: &Attachments, plan: Plan) -> Result<Plan, PlanError> {
    let verdict = validate(task, attachments, &plan);
    if verdict.valid {
        return Ok(Plan { cost: verdict.cost, ..plan });
    }
    if task.constraints.iter().any(|constraint| constraint.preference.is_none()) {
        let mut free = task.clone();
        free.constraints.retain(|constraint| constraint.preference.is_some());
        if validate(&free, attachments, &plan).valid {
            let help =
                "constraints are checked, but not planned for: ask for the same in conditions and the goal";
            let explained = |finding: Diagnostic| finding.with_help(help);
            let list = verdict.findings.list.into_iter().map(explained).collect();
            return Err(PlanError::Refused(Findings { list, ..verdict.findings }));
        }
    }
    Err(PlanError::Internal { reason: verdict.reason.unwrap_or_default(), plan })
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
