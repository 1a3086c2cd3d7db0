//! Solver for grounded tasks of instantaneous actions.

use crate::explain::{Refusals, explain};
use crate::ground::GroundTask;
use crate::memory::MemoryLimit;
use crate::outcome::{Options, Outcome, PlanError, Statistics};
use crate::plan::{Plan, Step};
use crate::task::Task;

use super::run::{ClassicalEnd, ClassicalOptions, FIRST_WORK, solve};

/// Plans for a task that [`crate::classical::compiled::is_classical`]. `check` validates a plan and
/// returns `None` for one that is no better than an earlier one; `soft` is true if the task has soft
/// goals.
#[allow(clippy::too_many_arguments)]
pub(crate) fn plan_classical(
    task: &Task,
    grounded: &GroundTask,
    options: &Options,
    soft: bool,
    memory: MemoryLimit,
    stop: &(dyn Fn() -> bool + Sync),
    check: &dyn Fn(Plan) -> Result<Option<Plan>, PlanError>,
    on_plan: &mut dyn FnMut(&Plan),
) -> Result<Outcome, PlanError> {
    let classical = ClassicalOptions {
        anytime: options.anytime,
        only_first: options.first,
        soft,
        bound: options.bound,
        memory,
        evaluation_limit: options.evaluation_limit,
        threads: options.threads,
        first_work: FIRST_WORK,
        without: options.without,
    };
    let mut statistics = Statistics { actions: grounded.actions.len() as u64, ..Statistics::default() };
    let mut best = None;
    let mut invalid = None;
    let mut plans = 0;
    let outcome = solve(grounded, &classical, stop, &mut |operators, _cost| match check(named(
        task, grounded, operators,
    )) {
        Ok(Some(plan)) => {
            plans += 1;
            on_plan(&plan);
            best = Some(plan);
        }
        Ok(None) => {}
        Err(error) => invalid = Some(error),
    });
    if let Some(error) = invalid.filter(|error| best.is_none() || matches!(error, PlanError::Internal { .. }))
    {
        return Err(error);
    }
    statistics.plans = plans;
    statistics.evaluated = outcome.evaluated;
    statistics.expanded = outcome.expanded;
    Ok(match (best, outcome.end) {
        (Some(plan), ClassicalEnd::Done) => Outcome::Solved { plan, statistics },
        (Some(plan), ClassicalEnd::Exhausted) => {
            statistics.optimal = true;
            Outcome::Solved { plan, statistics }
        }
        (None, ClassicalEnd::Done | ClassicalEnd::Exhausted) => {
            Outcome::Unsolvable { why: explain(task, grounded, &Refusals::new()), statistics }
        }
        (best, ClassicalEnd::Stopped) => Outcome::OutOfTime { best, statistics },
        (best, ClassicalEnd::Memory) => Outcome::OutOfMemory { best, statistics },
    })
}

/// Plan with the names of actions and objects in the task, for a sequence of operators.
pub(crate) fn named(task: &Task, grounded: &GroundTask, operators: &[u32]) -> Plan {
    let steps = operators.iter().map(|&operator| {
        let origin = &grounded.actions[operator as usize].origin;
        Step {
            start_s: None,
            action: task.actions[origin.schema as usize].name.clone(),
            arguments: origin.arguments.iter().map(|&o| task.objects[o as usize].name.clone()).collect(),
            duration_s: 0.0,
        }
    });
    Plan { steps: steps.collect(), ..Plan::default() }
}
