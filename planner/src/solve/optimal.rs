//! Optimal planning for instantaneous actions: a plan that is proven optimal, or a proof that there
//! is none.

use crate::attachment::Attachments;
use crate::classical::compiled::{Compiled, is_classical};
use crate::diagnostic::{Diagnostic, Findings, Span};
use crate::explain::{Refusals, explain, too_slow};
use crate::ground::{Earns, GroundTask, Keep, compile, ground_with};
use crate::memory::MemoryLimit;
use crate::outcome::{Options, Outcome, PlanError, Statistics};
use crate::search::astar::{AStar, AStarLimits};
use crate::search::classical::named;
use crate::search::lazy::End;
use crate::semantics::Semantics;
use crate::state::State;
use crate::task::{Action, Task};

use super::{checked, freed, grounding_ended, on_the_way, with_culprits};

/// Plans optimally, by A* with the LM-cut heuristic: a plan in [`Outcome::Solved`] is proven
/// optimal.
///
/// `on_bound` is called with every better lower bound on the metric value (without a metric, on the
/// number of steps). Of the options, only the limits are used.
///
/// # Errors
///
/// [`PlanError::Refused`] for what the proof does not cover: durations, timed literals,
/// attachments, and metrics other than a sum of constant costs of at least 0.
pub fn plan_optimally(
    task: &Task,
    attachments: &Attachments,
    options: &Options,
    stop: &(dyn Fn() -> bool + Sync),
    on_bound: &mut dyn FnMut(f64),
) -> Result<Outcome, PlanError> {
    let refused =
        |finding| PlanError::Refused(Findings { sources: task.sources.to_vec(), list: vec![finding] });
    if let Some(finding) = beyond_the_proof(task) {
        return Err(refused(finding));
    }
    let memory = MemoryLimit::new(options.memory_limit_bytes, options.memory_used);
    if let Some(why) = too_slow(task, freed(task), memory.counted(), stop) {
        return Ok(Outcome::Unsolvable { why, statistics: Statistics::default() });
    }
    let compiled = compile(task);
    if compiled.as_ref().is_some_and(|compiled| compiled.forgets) {
        let help = "leave the preference out of the metric, or improve plans instead (`--anytime`)";
        return Err(refused(of_the_metric(
            task,
            "it counts a preference that is only looked at afterwards",
            help,
        )));
    }
    let searched = compiled.as_ref().map_or(task, |compiled| &compiled.task);
    let room = || memory.counted().is_some() || memory.has_room(|| 0, 0);
    let grounded = match ground_with(searched, memory.counted(), Keep::Relevant, &|| !room() || stop()) {
        Ok(grounded) => grounded,
        Err(_) if !room() => {
            return Ok(Outcome::OutOfMemory { best: None, statistics: Statistics::default() });
        }
        Err(error) => return grounding_ended(task, error),
    };
    let outcome = match prepared(searched, &grounded) {
        Err((fault, help)) => return Err(refused(of_the_metric(task, fault, help))),
        Ok(flat) => {
            let search = Search { task, searched, grounded: &grounded, flat: &flat, attachments, stop };
            search.run(options, memory.beside(grounded.bytes()), on_bound)?
        }
    };
    let outcome = on_the_way(task, attachments, options, stop, outcome);
    Ok(with_culprits(task, attachments, options, stop, outcome))
}

/// Compiled task; or, if optimality cannot be decided by summed costs, the reason and a remedy.
fn prepared(task: &Task, grounded: &GroundTask) -> Result<Compiled, (&'static str, &'static str)> {
    let improve = "improve plans instead (`--anytime`), which says when a plan is proven best";
    if !is_classical(grounded) {
        return Err(("its value is not known from a state", improve));
    }
    let flat = Compiled::new(grounded);
    let earns = grounded.metric.as_ref().map_or(Earns::Never, |metric| metric.earns);
    match () {
        () if !flat.measure.is_sum() => Err(("the cost of an action depends on the state", improve)),
        () if earns != Earns::Never || flat.measure.estimates.iter().any(|cost| *cost < 0.0) => {
            Err(("an action may improve it, so that longer plans may be better ones", improve))
        }
        () if !flat.has_proportional_costs() => Err((
            "its costs differ too much in size to be added up without rounding",
            "give costs as whole numbers of a larger unit, up to a million",
        )),
        () => {
            debug_assert!(task.modules.is_empty());
            Ok(flat)
        }
    }
}

/// Finding about the first durative action, timed literal or module, which the proof does not
/// cover; `None` if there is none.
fn beyond_the_proof(task: &Task) -> Option<Diagnostic> {
    let finding = |what: String, span: Span, label: &str| {
        let message = format!("optimal plans are proven for actions that take no time: {what}");
        let help = "improve plans instead (`--anytime`), which says when a plan is proven best";
        Diagnostic::error("not-proven-optimal", message, span, label).with_help(help)
    };
    let durative = task.actions.iter().find(|action| Action::is_durative(action));
    let timed = task.init.timed.first();
    let module = task.modules.first();
    durative
        .map(|action| finding(format!("`{}` has a duration", action.name), action.span, "takes time"))
        .or_else(|| timed.map(|timed| finding("a timed literal".into(), timed.span, "happens at a time")))
        .or_else(|| {
            let of = |name: &str| format!("`{name}` is answered by an attachment");
            module
                .map(|module| finding(of(&module.name), module.span, "its answers are not known beforehand"))
        })
}

/// Finding about a metric that the proof does not cover.
fn of_the_metric(task: &Task, fault: &str, help: &str) -> Diagnostic {
    let span = task.metric.as_ref().map_or(task.goal_span, |metric| metric.span);
    let message = format!("optimal plans are proven for sums of constant costs: {fault}");
    Diagnostic::error("not-proven-optimal", message, span, "this metric").with_help(help)
}

/// Optimal search on a grounded task.
struct Search<'a> {
    task: &'a Task,
    /// Task that is searched: `task` with preferences and constraints compiled away.
    searched: &'a Task,
    grounded: &'a GroundTask,
    flat: &'a Compiled,
    attachments: &'a Attachments,
    stop: &'a (dyn Fn() -> bool + Sync),
}

impl Search<'_> {
    fn run(
        &self,
        options: &Options,
        memory: MemoryLimit,
        on_bound: &mut dyn FnMut(f64),
    ) -> Result<Outcome, PlanError> {
        let value = self.value_of_bounds();
        let mut statistics =
            Statistics { actions: self.grounded.actions.len() as u64, ..Statistics::default() };
        let mut bound = None;
        let mut search = AStar::new(self.flat);
        let evaluations = options.evaluation_limit.unwrap_or(u64::MAX);
        let end = match self.grounded.goal_reachable {
            true => search.run(AStarLimits { memory, evaluations, stop: self.stop }, &mut |cost| {
                bound = Some(value(cost));
                on_bound(value(cost));
            }),
            false => End::Exhausted,
        };
        statistics.evaluated = search.counts().evaluated;
        statistics.expanded = search.counts().expanded;
        statistics.lower_bound = bound;
        Ok(match end {
            End::Plan(operators) => {
                let plan = named(self.searched, self.grounded, &operators);
                match checked(self.task, self.attachments, plan, self.stop)? {
                    Some(plan) => {
                        (statistics.optimal, statistics.plans) = (true, 1);
                        Outcome::Solved { plan, statistics }
                    }
                    None => Outcome::OutOfTime { best: None, statistics },
                }
            }
            End::Exhausted => {
                statistics.lower_bound = None;
                let why = explain(self.searched, self.grounded, &Refusals::new());
                Outcome::Unsolvable { why, statistics }
            }
            End::Memory => Outcome::OutOfMemory { best: None, statistics },
            End::Stopped | End::Limit => Outcome::OutOfTime { best: None, statistics },
        })
    }

    /// Converts a cost of the search to a metric value.
    fn value_of_bounds(&self) -> impl Fn(u32) -> f64 + '_ {
        let semantics = Semantics::new(self.searched, self.attachments);
        let nothing_done = semantics.measured(&State::initial(self.searched), 0.0, &[]);
        let base = nothing_done.ok().flatten().unwrap_or(0.0);
        let sign = if self.task.metric.as_ref().is_none_or(|metric| metric.minimise) { 1.0 } else { -1.0 };
        move |cost| base + sign * self.flat.unscaled(cost)
    }
}
