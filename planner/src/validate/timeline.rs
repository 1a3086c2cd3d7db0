//! Timeline of a plan: its happenings in time order.

use crate::plan::{Plan, Step};
use crate::task::Task;

/// Minimum time between two happenings, in seconds; events closer than this happen at the same time. It
/// is small because plans are printed with few digits and other planners separate happenings by as
/// little.
pub const SEPARATION_S: f64 = 1e-4;

/// An event of a plan at one point in time.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub(super) enum Event {
    /// A timed initial literal or change, by its index in the task.
    Timed(usize),
    /// End of a durative step, by the step's index.
    End(usize),
    /// Start of a durative step, by the step's index.
    Start(usize),
    /// An instantaneous step, by its index.
    Instant(usize),
}

/// All events that happen at the same time.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Happening {
    pub time_s: f64,
    pub events: Vec<Event>,
}

/// Happenings of a plan in time order, with the timed literals before `until_s`. `is_durative` says of
/// each step whether its action is durative.
///
/// In a plan without times, every step is a happening of its own, at times 1, 2, ….
pub(super) fn happenings(task: &Task, plan: &Plan, is_durative: &[bool], until_s: f64) -> Vec<Happening> {
    if plan.steps.iter().any(|step| step.start_s.is_none()) {
        let one = |step: usize| Happening { time_s: (step + 1) as f64, events: vec![Event::Instant(step)] };
        return (0..plan.steps.len()).map(one).collect();
    }
    let mut events: Vec<(f64, Event)> = Vec::new();
    for (index, step) in plan.steps.iter().enumerate() {
        let start_s = step.start_s.unwrap_or(0.0);
        if is_durative[index] {
            events.push((start_s, Event::Start(index)));
            events.push((start_s + step.duration_s, Event::End(index)));
        } else {
            events.push((start_s, Event::Instant(index)));
        }
    }
    for (index, timed) in task.init.timed.iter().enumerate() {
        if timed.time_s < until_s {
            events.push((timed.time_s, Event::Timed(index)));
        }
    }
    events.sort_by(|one, other| one.0.total_cmp(&other.0).then(one.1.cmp(&other.1)));
    let mut all: Vec<Happening> = Vec::new();
    for (time_s, event) in events {
        match all
            .last_mut()
            .filter(|last| time_s - last.time_s < SEPARATION_S && !starts(&last.events, event))
        {
            Some(last) => last.events.push(event),
            None => all.push(Happening { time_s, events: vec![event] }),
        }
    }
    all
}

/// End of the last step, in seconds; instantaneous steps take no time, whatever duration the plan
/// states. `None` for a plan without times.
pub(super) fn makespan_s(plan: &Plan, is_durative: &[bool]) -> Option<f64> {
    let end_s = |(step, is_durative): (&Step, &bool)| {
        Some(step.start_s? + if *is_durative { step.duration_s } else { 0.0 })
    };
    let mut ends_s = plan.steps.iter().zip(is_durative).map(end_s);
    ends_s.try_fold(0.0, |last: f64, end_s| Some(last.max(end_s?)))
}

/// True if `event` ends a step that starts among `events`: even a step of zero duration starts before
/// it ends.
fn starts(events: &[Event], event: Event) -> bool {
    matches!(event, Event::End(step) if events.contains(&Event::Start(step)))
}
