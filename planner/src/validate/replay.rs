//! Replay of a plan, one happening after the other, from the initial state.

use super::cause::{Cause, Fault, Moment, Unmet};
use super::timeline::{Event, Happening, SEPARATION_S, happenings, makespan_s};
use crate::diagnostic::{Diagnostic, Span};
use crate::model::between::telling_parts;
use crate::model::relation::Relation;
use crate::plan::EPSILON_S;
use crate::plan::Plan;
use crate::semantics::effects::Clash;
use crate::semantics::{
    Binding, CallFailure, Changes, Pending, Semantics, Together, Touched, Why, value_text,
};
use crate::state::State;
use crate::task::{Action, ActionId, Comparison, GroundChange, Task, Timed, When};

/// Result of a complete replay.
pub(crate) struct Replayed {
    pub state: State,
    /// States with the times at which they begin, in seconds; empty for a task without constraints.
    pub trace: Vec<(f64, State)>,
    /// For each preference in conditions of actions, how often steps violated it.
    pub violations: Vec<f64>,
    /// End of the plan: a time in seconds, or the number of steps for a plan without times.
    pub end: f64,
}

/// Durative action that has started and not yet ended.
struct Running {
    step: usize,
    action: ActionId,
    binding: Binding,
    pending: Pending,
    since_s: f64,
}

/// Participant of a happening, with its read and write set.
struct Part {
    step: Option<usize>,
    touched: Touched,
}

struct Replay<'r, 'a> {
    semantics: &'r Semantics<'a>,
    plan: &'r Plan,
    bound: Vec<(ActionId, Binding)>,
    state: State,
    running: Vec<Running>,
    trace: Vec<(f64, State)>,
    violations: Vec<f64>,
    now_s: f64,
}

type Outcome<T> = Result<Result<T, Box<Fault>>, CallFailure>;

/// Unwraps a nested result; returns its fault or failure to the caller.
macro_rules! attempt {
    ($result:expr) => {
        match $result? {
            Ok(value) => value,
            Err(fault) => return Ok(Err(fault)),
        }
    };
}

/// Time up to which a plan is replayed.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Until {
    /// The end of the last step.
    LastStep,
    /// Last timed literal or end of the last step, whichever is later; PDDL 2.2 judges the goal there.
    LastHappening,
}

/// Replays a plan without checking the goal; timed literals happen up to `until`.
pub(super) fn replay(semantics: &Semantics<'_>, plan: &Plan, until: Until) -> Outcome<Replayed> {
    let task = semantics.task;
    let mut bound = Vec::with_capacity(plan.steps.len());
    for (index, step) in plan.steps.iter().enumerate() {
        match semantics.bind(step) {
            Ok(found) => bound.push(found),
            Err(misfit) => {
                let reason = format!("{}: {}", step_text(plan, index), misfit.reason);
                let span = misfit.span.unwrap_or_default();
                let finding = Diagnostic::error("plan", reason.clone(), span, "declared here");
                let (step, cause) = (Some(index), Cause::Other { reason: misfit.reason });
                return Ok(Err(Box::new(Fault { reason, step, cause, finding })));
            }
        }
    }
    let is_durative: Vec<bool> = bound.iter().map(|(action, _)| task.action(*action).is_durative()).collect();
    if let Some(fault) = without_times(task, plan, &bound, &is_durative) {
        return Ok(Err(Box::new(fault)));
    }
    let makespan_s = makespan_s(plan, &is_durative).filter(|_| !plan.steps.is_empty());
    let until_s = match until {
        Until::LastStep => makespan_s.unwrap_or(0.0) + SEPARATION_S,
        Until::LastHappening => f64::INFINITY,
    };
    let happenings = happenings(task, plan, &is_durative, until_s);
    let state = semantics.initial()?;
    let trace = if task.constraints.is_empty() { Vec::new() } else { vec![(0.0, state.clone())] };
    let (running, violations) = (Vec::new(), vec![0.0; task.preferences.len()]);
    let mut replay = Replay { semantics, plan, bound, state, running, trace, violations, now_s: 0.0 };
    for happening in &happenings {
        attempt!(replay.happening(happening));
    }
    let end = makespan_s.unwrap_or(plan.steps.len() as f64);
    Ok(Ok(Replayed { state: replay.state, trace: replay.trace, violations: replay.violations, end }))
}

/// Fault of a step without a time, if its action is durative or the task has timed literals; `None` if
/// there is none.
fn without_times(
    task: &Task,
    plan: &Plan,
    bound: &[(ActionId, Binding)],
    is_durative: &[bool],
) -> Option<Fault> {
    let untimed = |&index: &usize| plan.steps[index].start_s.is_none();
    let durative = (0..plan.steps.len()).filter(untimed).find(|&index| is_durative[index]);
    let (reason, span, label, step) = match (durative, task.init.timed.first()) {
        (Some(index), _) => {
            let reason = format!("{} takes time, but the plan has no times", step_text(plan, index));
            (reason, task.action(bound[index].0).span, "durative", Some(index))
        }
        (None, Some(timed)) => {
            let step = (0..plan.steps.len()).find(untimed)?;
            let reason = format!("the task has timed literals, but {} has no time", step_text(plan, step));
            (reason, timed.span, "before or after this?", Some(step))
        }
        (None, None) => return None,
    };
    let finding = Diagnostic::error("plan", reason.clone(), span, label)
        .with_help("write steps like `0.000: (move a b) [3.200]`");
    Some(Fault { cause: Cause::Other { reason: reason.clone() }, reason, step, finding })
}

/// Text that names a step in messages: its number (from 1), action, arguments and time.
fn step_text(plan: &Plan, index: usize) -> String {
    let step = &plan.steps[index];
    let arguments: String = step.arguments.iter().map(|name| format!(" {name}")).collect();
    let time = step.start_s.map_or(String::new(), |start_s| format!(" at {}", value_text(Some(start_s))));
    format!("step {} ({}{arguments}){time}", index + 1, step.action)
}

/// Fault about an unmet condition, with a finding at the condition's span; `action` adds a second
/// label.
pub(super) fn fault(
    reason: String,
    step: Option<usize>,
    cause: Cause,
    why: &Why,
    label: &str,
    action: Option<(Span, String)>,
) -> Fault {
    let values: Vec<String> = why.values.iter().map(|(name, value)| format!("{name} is {value}")).collect();
    let reason = if values.is_empty() { reason } else { format!("{reason}: {}", values.join(", ")) };
    let label = if values.is_empty() { label.to_string() } else { format!("{label}: {}", values.join(", ")) };
    let finding = Diagnostic::error("plan", reason.clone(), why.span, label);
    let finding = match action {
        Some((span, text)) => finding.with_label(span, text),
        None => finding,
    };
    Fault { reason, step, cause, finding }
}

impl Replay<'_, '_> {
    fn action(&self, step: usize) -> &Action {
        self.semantics.task.action(self.bound[step].0)
    }

    fn happening(&mut self, happening: &Happening) -> Outcome<()> {
        attempt!(self.flow(happening.time_s));
        let alone = happening.events.len() == 1;
        let mut parts: Vec<Part> = Vec::with_capacity(happening.events.len());
        for &event in &happening.events {
            parts.push(attempt!(self.part(event, alone)));
        }
        attempt!(self.conflicts(&parts, happening.time_s));
        let mut all = Changes::default();
        for part in parts {
            let changes = part.touched.changes;
            all.deleted.extend(changes.deleted);
            all.added.extend(changes.added);
            all.numbers.extend(changes.numbers);
            all.cleared.extend(changes.cleared);
            all.objects.extend(changes.objects);
        }
        self.start_and_end(&happening.events)?;
        if let Err(clash) = self.semantics.apply(&mut self.state, &all)? {
            let step = happening.events.iter().find_map(|event| event.step());
            return Ok(Err(Box::new(self.clash(step, clash))));
        }
        if !self.trace.is_empty() {
            self.trace.push((happening.time_s, self.state.clone()));
        }
        self.after_happening()
    }

    /// Participant for an event, with the changes that the event makes; a fault if the event cannot
    /// happen in the present state. `alone` leaves out the read set, which only other participants
    /// need.
    fn part(&mut self, event: Event, alone: bool) -> Outcome<Part> {
        let mut touched = Touched::default();
        let (step, at_end) = match event {
            Event::Timed(index) => {
                match &self.semantics.task.init.timed[index].change {
                    GroundChange::Add(fact) => touched.changes.added.push(fact.clone()),
                    GroundChange::Delete(fact) => touched.changes.deleted.push(fact.clone()),
                    GroundChange::Number(fluent, value) => {
                        let span = self.semantics.task.init.timed[index].span;
                        let assign = crate::task::Assignment::Assign;
                        touched.changes.numbers.push((fluent.clone(), assign, *value, span));
                    }
                    GroundChange::Object(fluent, value) => {
                        let span = self.semantics.task.init.timed[index].span;
                        touched.changes.objects.push((fluent.clone(), Some(*value), span));
                    }
                }
                return Ok(Ok(Part { step: None, touched }));
            }
            Event::End(step) => (step, true),
            Event::Start(step) | Event::Instant(step) => (step, false),
        };
        let (id, mut binding) = self.bound[step].clone();
        let action = self.semantics.task.action(id);
        let (condition, effects) = if at_end {
            (&action.condition.end, &action.effects.end)
        } else {
            (&action.condition.start, &action.effects.start)
        };
        if let Some(why) = self.semantics.why_not(&self.state, condition, &mut binding)? {
            let when = match event {
                Event::End(_) => Moment::End,
                Event::Start(_) => Moment::Start,
                _ => Moment::Before,
            };
            return Ok(Err(Box::new(self.unmet(step, &why, when))));
        }
        attempt!(self.duration(step, at_end, &mut binding));
        if !at_end {
            attempt!(self.proposed(step, &binding));
        }
        self.preferences(step, event, &mut binding)?;
        let running = self.running.iter().find(|running| running.step == step);
        let pending = match (at_end, running) {
            (false, _) => None,
            (true, Some(running)) => Some(running.pending.clone()),
            // What takes no time ends where it starts.
            (true, None) => Some(self.remembered(step)?),
        };
        let changes = self.semantics.changes(
            &self.state,
            effects,
            &mut binding,
            pending.as_ref(),
            &mut touched.changes,
        )?;
        if let Err(clash) = changes {
            return Ok(Err(Box::new(self.clash(Some(step), clash))));
        }
        if !alone {
            self.semantics.reads(&self.state, condition, &mut binding, &mut touched)?;
            self.semantics.effect_reads(&self.state, effects, at_end, &mut binding, &mut touched)?;
        }
        Ok(Ok(Part { step: Some(step), touched }))
    }

    fn unmet(&self, step: usize, why: &Why, when: Moment) -> Fault {
        let text = step_text(self.plan, step);
        let label = format!("does not hold {}", when.words());
        let reason = format!("{text}: {} {label}", why.condition);
        let cause = Cause::Condition { when, unmet: Unmet::of(why) };
        fault(reason, Some(step), cause, why, &label, Some((self.action(step).span, format!("in {text}"))))
    }

    fn clash(&self, step: Option<usize>, clash: Clash) -> Fault {
        let text = step.map_or("a timed literal".to_string(), |step| step_text(self.plan, step));
        let reason = format!("{text}: {}", clash.reason);
        let cause = Cause::Other { reason: clash.reason.clone() };
        let finding = Diagnostic::error("plan", reason.clone(), clash.span, clash.reason);
        Fault { reason, step, cause, finding }
    }

    /// Checks a step's duration against its bounds at start (or at end, if `at_end`), with a tolerance
    /// of ε.
    fn duration(&self, step: usize, at_end: bool, binding: &mut Binding) -> Outcome<()> {
        let Some(bounds) = &self.action(step).duration else { return Ok(Ok(())) };
        let duration_s = self.plan.steps[step].duration_s;
        for bound in bounds.iter().filter(|bound| (bound.when == When::End) == at_end) {
            let value = self.semantics.number(&self.state, &bound.value, binding)?;
            let slack = EPSILON_S + 1e-9 * duration_s;
            let meets = value.filter(|value| value.is_finite()).is_some_and(|value| match bound.comparison {
                Comparison::Less | Comparison::LessOrEqual => duration_s <= value + slack,
                Comparison::Equal => (duration_s - value).abs() <= slack,
                Comparison::Greater | Comparison::GreaterOrEqual => duration_s + slack >= value,
            });
            let strict = match (bound.comparison, value) {
                (Comparison::Less | Comparison::Greater, Some(value)) => {
                    Relation::of(bound.comparison, true).holds(duration_s, value)
                }
                _ => true,
            };
            if !meets || !strict {
                let name = self.semantics.expression_text(&bound.value, binding);
                let text = step_text(self.plan, step);
                let wanted = match value {
                    Some(value) if value.is_finite() => format!("{} is asked for", value_text(Some(value))),
                    Some(_) => format!("{name} says that it cannot be done"),
                    None => format!("{name} has no value"),
                };
                let reason = format!("{text} takes {}, {wanted}", value_text(Some(duration_s)));
                let cause = match value.filter(|value| value.is_finite()) {
                    Some(asked_s) => Cause::Duration { planned_s: duration_s, asked_s },
                    None => Cause::Other { reason: wanted.clone() },
                };
                let finding = Diagnostic::error("plan", reason.clone(), bound.span, wanted);
                return Ok(Err(Box::new(Fault { reason, step: Some(step), cause, finding })));
            }
        }
        Ok(Ok(()))
    }

    /// Checks that grounding modules propose the further arguments of a step.
    fn proposed(&self, step: usize, binding: &Binding) -> Outcome<()> {
        let action = self.action(step);
        for (call, proposal) in action.grounding.iter().zip(&binding.proposals) {
            let mut plain = binding.clone();
            plain.proposals.clear();
            if !self.semantics.proposals(&self.state, call, &plain)?.contains(proposal) {
                let text = step_text(self.plan, step);
                let why =
                    format!("`{proposal}` is not proposed by {}", self.semantics.call_text(call, &plain));
                let reason = format!("{text}: {why}");
                let finding = Diagnostic::error("plan", reason.clone(), call.span, "not proposed by this");
                let cause = Cause::Other { reason: why };
                return Ok(Err(Box::new(Fault { reason, step: Some(step), cause, finding })));
            }
        }
        Ok(Ok(()))
    }

    /// Counts the violations of preferred conditions at the start or end of a step.
    fn preferences(&mut self, step: usize, event: Event, binding: &mut Binding) -> Result<(), CallFailure> {
        let preferences = self.action(step).preferences.clone();
        for (id, Timed { start, end, .. }) in &preferences {
            let now = if matches!(event, Event::End(_)) { end } else { start };
            if !self.semantics.holds(&self.state, now, binding)? {
                self.violations[id.index()] += 1.0;
            }
        }
        Ok(())
    }

    /// Checks that no participant of a happening writes what another one reads or writes differently.
    fn conflicts(&self, parts: &[Part], time_s: f64) -> Outcome<()> {
        let mut together = Together::default();
        for (index, part) in parts.iter().enumerate() {
            let may_conflict = together.may_conflict(&part.touched);
            together.extend(&part.touched);
            for other in parts[..index].iter().filter(|_| may_conflict) {
                let Some(what) = part.touched.conflict(&other.touched, self.semantics) else { continue };
                let text = |step: Option<usize>| match step {
                    Some(step) => step_text(self.plan, step),
                    None => "a timed literal".to_string(),
                };
                let reason = format!(
                    "{} and {} both touch {what} at {}",
                    text(other.step),
                    text(part.step),
                    value_text(Some(time_s))
                );
                let step = part.step.or(other.step);
                let span = step.map_or(Span::default(), |step| self.action(step).span);
                let finding = Diagnostic::error("plan", reason.clone(), span, format!("touches {what}")).with_help(
                    format!("what depends on each other must be at least {SEPARATION_S} s apart; planners keep {EPSILON_S}"),
                );
                let cause = Cause::Other { reason: reason.clone() };
                return Ok(Err(Box::new(Fault { reason, step, cause, finding })));
            }
        }
        Ok(Ok(()))
    }

    /// Conditional end effects of a step that starts now, limited to those whose start conditions hold
    /// in the present state.
    fn remembered(&self, step: usize) -> Result<Pending, CallFailure> {
        let (action, mut binding) = self.bound[step].clone();
        let effects = &self.semantics.task.action(action).effects.end;
        self.semantics.remember(&self.state, effects, &mut binding)
    }

    fn start_and_end(&mut self, events: &[Event]) -> Result<(), CallFailure> {
        for event in events {
            if let Event::Start(step) = *event {
                let (action, binding) = self.bound[step].clone();
                let pending = self.remembered(step)?;
                let since_s = self.now_s;
                self.running.push(Running { step, action, binding, pending, since_s });
            }
        }
        self.running.retain(|running| !events.contains(&Event::End(running.step)));
        Ok(())
    }

    /// Checks the over-all conditions of running actions in the state right after a happening. If
    /// numbers change continuously, those of actions that have just started are skipped here:
    /// [`Replay::flow`] checks them.
    fn after_happening(&mut self) -> Outcome<()> {
        let flows = self.running.iter().any(|running| self.flows(running));
        let begun_s = if flows { self.now_s } else { f64::INFINITY };
        self.invariants(begun_s)
    }

    fn flows(&self, running: &Running) -> bool {
        !self.semantics.task.action(running.action).continuous.is_empty()
    }

    /// Checks the over-all conditions of all running actions that started before a time, in seconds.
    fn invariants(&mut self, begun_s: f64) -> Outcome<()> {
        let mut broken = None;
        for running in self.running.iter_mut().filter(|running| running.since_s < begun_s) {
            let action = self.semantics.task.action(running.action);
            if let Some(why) =
                self.semantics.why_not(&self.state, &action.condition.over_all, &mut running.binding)?
            {
                broken = Some((running.step, why));
                break;
            }
            let effects = &action.effects.end;
            self.semantics.keep(&self.state, effects, &mut running.binding, &mut running.pending)?;
            for (id, timed) in &action.preferences {
                if !self.semantics.holds(&self.state, &timed.over_all, &mut running.binding)? {
                    self.violations[id.index()] = self.violations[id.index()].max(1.0);
                }
            }
        }
        Ok(match broken {
            Some((step, why)) => Err(Box::new(self.unmet(step, &why, Moment::OverAll))),
            None => Ok(()),
        })
    }

    /// Advances continuous changes to a time in seconds, and checks over-all conditions on the way.
    fn flow(&mut self, until_s: f64) -> Outcome<()> {
        let elapsed_s = until_s - self.now_s;
        self.now_s = until_s;
        let changes = attempt!(self.flowing(elapsed_s));
        if changes.numbers.is_empty() || elapsed_s <= 0.0 {
            return Ok(Ok(()));
        }
        let middle = attempt!(self.moved(&changes, 0.5));
        let after = attempt!(self.moved(&changes, 1.0));
        let differences = [&self.state, &middle, &after].map(|state| self.differences(state));
        let [first, middle, last] = differences;
        let points = first?.into_iter().zip(middle?).zip(last?);
        let before = self.state.clone();
        for part in telling_parts(points.map(|((first, middle), last)| [first, middle, last])) {
            self.state = attempt!(self.moved(&changes, part));
            attempt!(self.invariants(f64::INFINITY));
            self.state.clone_from(&before);
        }
        self.state = after;
        Ok(Ok(()))
    }

    /// Sum of continuous changes over an elapsed time, in seconds, at the present rates.
    fn flowing(&self, elapsed_s: f64) -> Outcome<Changes> {
        let mut changes = Changes::default();
        for running in &self.running {
            for rate in &self.semantics.task.action(running.action).continuous {
                let value = self.semantics.number(&self.state, &rate.per_second, &running.binding)?;
                let fluent = self.semantics.ground(&self.state, &rate.fluent, &running.binding);
                let (Some(value), Some(fluent)) = (value, fluent) else {
                    let clash = Clash { reason: "this rate has no value".to_string(), span: rate.span };
                    return Ok(Err(Box::new(self.clash(Some(running.step), clash))));
                };
                let increase = crate::task::Assignment::Increase;
                changes.numbers.push((fluent, increase, value * elapsed_s, rate.span));
            }
        }
        Ok(Ok(changes))
    }

    /// State after a fraction of numeric changes (0 to 1) has been applied.
    fn moved(&self, changes: &Changes, part: f64) -> Outcome<State> {
        let mut partly = changes.clone();
        partly.numbers.iter_mut().for_each(|(_, _, amount, _)| *amount *= part);
        let mut state = self.state.clone();
        Ok(match self.semantics.apply(&mut state, &partly)? {
            Ok(()) => Ok(state),
            Err(clash) => Err(Box::new(self.clash(None, clash))),
        })
    }

    /// Left minus right of all comparisons in rules and in over-all conditions of running actions.
    fn differences(&self, state: &State) -> Result<Vec<f64>, CallFailure> {
        let mut found = Vec::new();
        self.semantics.rule_differences(state, &mut found)?;
        for running in &self.running {
            let action = self.semantics.task.action(running.action);
            let mut binding = running.binding.clone();
            let mut add = |condition, binding: &mut Binding| {
                self.semantics.differences(state, condition, binding, &mut found)
            };
            add(&action.condition.over_all, &mut binding)?;
            for (_, preferred) in &action.preferences {
                add(&preferred.over_all, &mut binding)?;
            }
            for effect in &action.effects.end {
                self.semantics.some_binding(&effect.forall, &mut binding, &mut |binding| {
                    add(&effect.when.over_all, binding)?;
                    Ok(false)
                })?;
            }
        }
        Ok(found)
    }
}

impl Event {
    fn step(self) -> Option<usize> {
        match self {
            Event::Timed(_) => None,
            Event::End(step) | Event::Start(step) | Event::Instant(step) => Some(step),
        }
    }
}
