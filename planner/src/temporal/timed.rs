//! Plans with times, and their validation.

use crate::plan::Plan;
use crate::validate::validate;

use super::advance::{Part, TemporalStep};
use super::mentions::keep_apart;
use super::space::{Space, Track};
use super::world::World;

/// Action of a plan with its times.
#[derive(Debug, Clone)]
pub(crate) struct Timed {
    /// Step of the search.
    pub step: TemporalStep,
    /// Start time, in seconds.
    pub start_s: f64,
    /// Duration, in seconds.
    pub duration_s: f64,
}

/// Earliest schedule of a plan, with interfering happenings apart; `None` if stopped, or if the times
/// cannot be made valid.
pub(super) fn schedule(space: &Space, steps: &[TemporalStep], stop: &dyn Fn() -> bool) -> Option<Vec<Timed>> {
    let mut track = space.track(steps).ok()?;
    track.pass_timed(space).ok()?;
    let mut apart = track.clone();
    match keep_apart(space, steps, &mut apart, stop) {
        Ok(true) => Some(timed(steps, &apart)),
        Ok(false) => None,
        // A schedule that has no room for more distance is mostly as good as the search took it for.
        Err(_) => {
            let world = space.world;
            let plan = timed(steps, &track);
            let is_sure = world.ground.timed.is_empty();
            let valid = || validate(world.task, world.calls.attachments(), &to_plan(world, &plan)).valid;
            (is_sure || valid()).then_some(plan)
        }
    }
}

/// Actions of a temporal network at their earliest times.
fn timed(steps: &[TemporalStep], track: &Track) -> Vec<Timed> {
    let actions =
        track.actions.iter().zip(steps).filter_map(|(action, step)| action.map(|action| (action, step)));
    let mut plan: Vec<Timed> = actions
        .map(|((start, end), step)| {
            let start_s = track.order.earliest_s(start);
            let duration_s = end.map_or(0.0, |end| {
                let taken_s = track.order.earliest_s(end) - start_s;
                // Exact where the duration is fixed: differences of times carry rounding.
                if step.span.least_s == step.span.most_s {
                    step.span.least_s
                } else {
                    taken_s.max(step.span.least_s)
                }
            });
            Timed { step: step.clone(), start_s, duration_s }
        })
        .collect();
    plan.sort_by(|a, b| a.start_s.total_cmp(&b.start_s));
    debug_assert!(plan.iter().all(|timed| matches!(timed.step.part, Part::Whole | Part::Start)));
    plan
}

/// True if the validator accepts a plan with its times. Needed with continuous change, or if effects
/// depend on chosen durations: the search then does not know the order of happenings.
pub(super) fn is_valid(space: &Space, steps: &[TemporalStep], stop: &dyn Fn() -> bool) -> bool {
    let Some(timed) = schedule(space, steps, stop) else { return false };
    let world = space.world;
    validate(world.task, world.calls.attachments(), &to_plan(world, &timed)).valid
}

/// Plan with the names of actions and objects in the task.
pub(crate) fn to_plan(world: &World, timed: &[Timed]) -> Plan {
    let classical = world.ground.durative.is_empty() && world.ground.timed.is_empty();
    let steps = timed.iter().map(|timed| {
        let origin = &world.acts[timed.step.act as usize].origin;
        let names = origin.arguments.iter().map(|&object| world.task.objects[object as usize].name.clone());
        crate::plan::Step {
            start_s: (!classical).then_some(timed.start_s),
            action: world.task.actions[origin.schema as usize].name.clone(),
            arguments: names.chain(timed.step.proposal.iter().map(|name| name.to_string())).collect(),
            duration_s: timed.duration_s,
        }
    });
    Plan { steps: steps.collect(), ..Plan::default() }
}
