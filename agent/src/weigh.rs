//! Comparison of a plan with its alternatives: the same steps with other objects, each with its
//! duration and gain as the plan's own task predicts them. Recorded with the plan, so that the
//! choice can be explained later.

mod others;
#[doc(hidden)]
pub mod steps;

use std::collections::BTreeMap;

use descry_domains::round::Round;
use descry_memory::{Blob, Form};
use descry_planner::semantics::{Binding, Changes, Pending};
use descry_planner::task::{Comparison, Effect, FunctionId};
use descry_planner::{Plan, SEPARATION_S, Semantics, State, Step, monitor};
use descry_skills::Call;
use others::{Other, kept};
use serde::{Deserialize, Serialize};
use serde_json::Value;
use steps::{Instead, brought, joined, leads, words};

use crate::compared::{self, Compared};
use crate::exit::CommandError;
use crate::reason::Break;
use crate::written::{self, call_of};

/// Name of the blob with the comparison, attached to a plan's event.
pub const BLOB: &str = "weighed";
/// Maximum number of combinations of objects that are tried.
const MOST_TRIED: usize = 600;
/// Number of alternatives kept for their gain per second; a few more are kept for other reasons.
pub const MOST_KEPT: usize = 12;
/// Maximum number of steps before a plan's first gain; plans that gain later are not compared.
pub const MOST_STEPS: usize = 6;
/// Durations that differ by less than this count as equal, seconds.
const SHORTER_S: f64 = 0.05;
/// Maximum duration of a detour, as a multiple of the step that it replaces.
const FAR: f64 = 2.0;
/// Minimum improvement of a number; smaller ones count as none.
const GAINED: f64 = 1e-6;

/// Comparison of a plan with its alternatives.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct Weighed {
    /// Numeric fluents that the goal (or else the steps' conditions) compares and the plan improves,
    /// with the value at the plan's end, or at its best moment if the plan consumes them.
    pub numbers: Vec<Expected>,
    /// Steps of the plan up to the first that improves a number; `None` if none of the first steps
    /// does.
    pub chosen: Option<Way>,
    /// Alternatives to `chosen`: those with the highest gain per second, in that order, then
    /// further notable ones.
    pub others: Vec<Way>,
    /// Number of alternatives that can be executed, the chosen plan and those not in `others`
    /// included.
    pub open: usize,
    /// The chosen steps with consecutive ones merged, if that is quicker and gains no less.
    pub shorter: Option<Way>,
    /// The chosen steps with one more step that makes a later one shorter, such as opening a door
    /// on the route; the quickest such change.
    pub through: Option<Way>,
    /// Remaining steps of the previous plan; `None` if the new plan has the same.
    pub left: Option<Way>,
    /// Numeric fluents that the remaining previous plan would improve.
    pub left_numbers: Vec<Expected>,
}

/// Numeric fluent of the domain, with its predicted change.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Expected {
    /// Function with arguments, in PDDL.
    pub name: String,
    /// Present value.
    pub now: f64,
    /// Value after the plan, if all goes as predicted.
    pub then: f64,
}

/// Sequence of steps with its duration and gain.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub struct Way {
    /// Steps, as calls.
    #[serde(with = "written::calls")]
    pub steps: Vec<Call>,
    /// Duration of each step, seconds; empty in records of earlier versions.
    #[serde(default)]
    pub each_s: Vec<f64>,
    /// Duration of all steps one after the other, seconds.
    pub takes_s: f64,
    /// Sum of the improvements of the compared numbers.
    pub gains: f64,
    /// True if the goal is predicted to hold after the steps; `None` if undecided, or in records of
    /// earlier versions.
    #[serde(default)]
    pub reaches: Option<bool>,
    /// Totals if the rest of the plan follows; `None` if that is impossible, or in records of
    /// earlier versions.
    #[serde(default)]
    pub whole: Option<Whole>,
    /// Obstacle to the rest of the plan; `None` if there is none, or in records of earlier
    /// versions.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub blocked: Option<Break>,
}

/// Totals of a whole plan.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Whole {
    /// Increase of the plan metric, in seconds; without a metric value, the duration of the steps
    /// one after the other.
    pub takes_s: f64,
    /// Number of steps.
    pub steps: usize,
    /// True if the goal is predicted to hold at the end.
    pub reaches: bool,
}

impl Way {
    /// Gain per second.
    pub fn rate(&self) -> f64 {
        self.gains / self.takes_s.max(1e-9)
    }

    /// Last argument of the last step, which is the object that the steps are about; `None` without
    /// one.
    pub fn about(&self) -> Option<&str> {
        self.steps.last()?.arguments.last().map(String::as_str)
    }
}

/// Comparison as a data blob for an event.
///
/// # Errors
/// [`CommandError::Bug`] if it cannot be written as JSON.
pub fn blob(weighed: &Weighed) -> Result<Blob<'static>, CommandError> {
    let data = serde_json::to_vec(weighed).map_err(|e| CommandError::Bug(e.to_string()))?;
    Ok(Blob { name: BLOB.into(), form: Form::Bytes, layout: Value::Null, data: data.into() })
}

/// Compares a plan with alternatives and with the remaining previous plan `left`. `goal`, in PDDL,
/// names the numbers by which they are compared.
pub fn weigh(round: &Round, plan: &Plan, left: &Plan, goal: &str) -> Weighed {
    let Some(scale) = Scale::new(round, plan, goal) else { return Weighed::default() };
    let weighed = scale.weigh(plan).unwrap_or_default();
    let left_way = scale.left(plan, left);
    let left_numbers = left_way.as_ref().map(|_| scale.at_most(&left.steps)).unwrap_or_default();
    Weighed { left: left_way, left_numbers, ..weighed }
}

/// Prediction of steps from the present state, and the numbers by which plans are compared.
struct Scale<'r> {
    semantics: Semantics<'r>,
    state: State,
    /// Numeric functions by which plans are compared, each with true if smaller values are better.
    counting: Vec<(FunctionId, bool)>,
    /// Text in PDDL that compares these numbers: the goal, or else the conditions of the plan's
    /// steps.
    asked: String,
    /// Objects in the goal that are affected by steps with conditions on the numbers; `None` if the
    /// goal itself names the numbers.
    aims: Option<Vec<String>>,
}

impl<'r> Scale<'r> {
    /// Scale by the numbers in the goal, or else in the conditions of the plan's steps; `None` if
    /// the initial state cannot be evaluated.
    fn new(round: &'r Round, plan: &Plan, goal: &str) -> Option<Self> {
        let semantics = Semantics::new(&round.task, &round.attachments);
        let state = semantics.initial().ok()?;
        let named = |text: &str| -> Vec<(FunctionId, bool)> {
            let words = words(text);
            let functions = (0..).zip(&round.task.functions).filter(|(_, f)| f.result.is_none());
            let named = functions.filter(|(_, f)| words.contains(&f.name.as_str()));
            named
                .map(|(n, f)| (FunctionId(n), compared::all(text).any(|c| c.less && c.word == f.name)))
                .collect()
        };
        let (mut counting, mut by) = (named(goal), goal.to_string());
        let mut aims = None;
        if counting.is_empty() {
            let asked = |step: &Step| {
                let (action, binding) = semantics.bind(step).ok()?;
                Some(semantics.condition_text(&round.task.action(action).condition.start, &binding))
            };
            by = plan.steps.iter().filter_map(asked).collect::<Vec<_>>().join(" ");
            counting = named(&by);
            let asking =
                plan.steps.iter().filter(|step| asked(step).is_some_and(|by| !named(&by).is_empty()));
            let brought = asking.flat_map(|step| brought(&semantics, step));
            aims = Some(brought.filter(|object| words(goal).contains(&object.as_str())).collect());
        }
        Some(Scale { semantics, state, counting, asked: by, aims })
    }

    /// Values of the compared numbers in a state, by name in PDDL, each with true if smaller values
    /// are better.
    fn numbers(&self, state: &State) -> BTreeMap<String, (f64, bool)> {
        let task = self.semantics.task;
        let of = |&(id, less): &(FunctionId, bool)| {
            let name = &task.function(id).name;
            let named = state.values(id).map(move |(arguments, value)| {
                let arguments: String =
                    arguments.iter().map(|&a| format!(" {}", task.object(a).name)).collect();
                (format!("({name}{arguments})"), (value, less))
            });
            let compared: Vec<Compared<'_>> = compared::all(&self.asked)
                .filter(|compared| compared.word == name)
                .map(|compared| Compared { of: self.any(compared.of), ..compared })
                .collect();
            let counts = move |(number, _): &(String, (f64, bool))| {
                compared.is_empty() || compared.iter().any(|compared| compared.fits(number))
            };
            named.filter(counts).collect::<Vec<_>>()
        };
        self.counting.iter().flat_map(of).collect()
    }

    /// Arguments of a compared function, with `?` for those that may differ between plans.
    fn any<'o>(&self, of: Vec<&'o str>) -> Vec<&'o str> {
        let Some(aims) = &self.aims else { return of };
        let is_aim = |object: &&str| aims.iter().any(|aim| aim == object);
        let any_is = of.iter().any(is_aim);
        of.into_iter().map(|object| if !any_is || is_aim(&object) { object } else { "?" }).collect()
    }

    /// Improvement of a number from `now` to `then`; 0 if it gets worse. `less`: smaller values are
    /// better.
    fn gain(now: f64, then: f64, less: bool) -> f64 {
        (if less { now - then } else { then - now }).max(0.0)
    }

    /// Duration of each of some consecutive steps, seconds, and the state after all; `None` if a
    /// step is inapplicable.
    fn after(&self, steps: &[Step]) -> Option<(Vec<f64>, State)> {
        let mut state = self.state.clone();
        let each = steps.iter().map(|step| self.apply(&mut state, step)).collect::<Option<_>>()?;
        Some((each, state))
    }

    /// Duration of a step in a state, seconds; `None` if it has no fixed duration.
    fn takes_s(&self, state: &State, step: &Step) -> Option<f64> {
        let (id, binding) = self.semantics.bind(step).ok()?;
        let Some(bounds) = &self.semantics.task.action(id).duration else { return Some(0.0) };
        let bound = bounds.iter().find(|b| b.comparison == Comparison::Equal)?;
        self.semantics.number(state, &bound.value, &binding).ok()?.filter(|s| s.is_finite())
    }

    /// Applies a step to a state; returns its duration, seconds, or `None` if the step is
    /// inapplicable.
    fn apply(&self, state: &mut State, step: &Step) -> Option<f64> {
        let semantics = &self.semantics;
        let (id, mut binding) = semantics.bind(step).ok()?;
        let action = semantics.task.action(id);
        let takes_s = self.takes_s(state, step)?;
        binding.duration_s = action.is_durative().then_some(takes_s);
        if !semantics.holds(state, &action.condition.start, &mut binding).ok()? {
            return None;
        }
        let pending = semantics.remember(state, &action.effects.end, &mut binding).ok()?;
        self.change(state, &action.effects.start, &mut binding, None)?;
        for condition in [&action.condition.over_all, &action.condition.end] {
            semantics.holds(state, condition, &mut binding).ok().filter(|holds| *holds)?;
        }
        self.change(state, &action.effects.end, &mut binding, Some(&pending))?;
        Some(takes_s)
    }

    /// Applies simultaneous effects to a state; `None` if these contradict each other or are
    /// undefined.
    fn change(
        &self,
        state: &mut State,
        effects: &[Effect],
        binding: &mut Binding,
        pending: Option<&Pending>,
    ) -> Option<()> {
        let mut changes = Changes::default();
        self.semantics.changes(state, effects, binding, pending, &mut changes).ok()?.ok()?;
        self.semantics.apply(state, &changes).ok()?.ok()
    }

    fn way(&self, steps: &[Step]) -> Option<Way> {
        let (each_s, state) = self.after(steps)?;
        let (now, then) = (self.numbers(&self.state), self.numbers(&state));
        let gain = |(name, (now, less)): (&String, &(f64, bool))| {
            then.get(name).map_or(0.0, |(then, _)| Self::gain(*now, *then, *less))
        };
        let takes_s = each_s.iter().sum();
        let gains = now.iter().map(gain).sum();
        let reaches = self.reaches(&state);
        let steps = steps.iter().map(call_of).collect();
        Some(Way { steps, each_s, takes_s, gains, reaches, ..Way::default() })
    }

    /// True if the goal holds in a state; `None` if that cannot be evaluated.
    fn reaches(&self, state: &State) -> Option<bool> {
        let goal = &self.semantics.task.goal;
        self.semantics.holds(state, &goal.body, &mut Binding::new(goal.slots)).ok()
    }

    /// Totals of steps executed one after the other; `None` if a step is inapplicable.
    fn whole(&self, steps: &[Step]) -> Option<Whole> {
        let (each_s, state) = self.after(steps)?;
        let takes_s = each_s.iter().sum();
        let counted = |state: &State, end_s: f64| self.semantics.measured(state, end_s, &[]).ok()?;
        let counted = counted(&self.state, 0.0).zip(counted(&state, takes_s)).map(|(now, then)| then - now);
        let reaches = self.reaches(&state)?;
        Some(Whole { takes_s: counted.unwrap_or(takes_s), steps: steps.len(), reaches })
    }

    /// Totals of an alternative followed by as much of the rest of the plan as the goal needs,
    /// tried with exchanged objects and with one connecting step. If that is impossible, the
    /// obstacle instead.
    fn led_on(&self, other: &Other, rest: &[Step]) -> (Option<Whole>, Option<Break>) {
        let ends = self.ends(other, rest);
        let all = ends.iter().map(|end| [&other.steps, end.as_slice()].concat());
        let all: Vec<_> = all.filter_map(|steps| Some((self.whole(&steps)?, steps))).collect();
        let mut reaching: Vec<_> = all.iter().filter(|(whole, _)| whole.reaches).collect();
        reaching.sort_by(|a, b| a.0.takes_s.total_cmp(&b.0.takes_s));
        // What ends too late is seen by who watches the clock.
        let late = |steps: &[Step]| if self.is_timed() { self.stuck(steps) } else { None };
        let ends: Vec<_> = reaching.into_iter().map(|(whole, steps)| (*whole, late(steps))).collect();
        if let Some((whole, _)) = ends.iter().find(|(_, late)| late.is_none()) {
            return (Some(*whole), None);
        }
        if let Some((_, late)) = ends.into_iter().next() {
            return (None, late);
        }
        let longer = all.iter().map(|(_, steps)| steps).filter(|steps| steps.len() > other.steps.len());
        let farthest = longer.filter_map(|steps| Some((self.way(steps)?.gains, steps)));
        match farthest.max_by(|a, b| a.0.total_cmp(&b.0)) {
            Some((_, steps)) => (None, self.stuck(steps)),
            None => (None, self.short_of(other, rest)),
        }
    }

    /// Continuations to be tried after an alternative, made from the rest of the plan.
    fn ends(&self, other: &Other, rest: &[Step]) -> Vec<Vec<Step>> {
        let exchanged: Vec<Step> = rest.iter().map(|step| other.instead.exchanged(step)).collect();
        let put: Vec<Step> = rest.iter().map(|step| other.instead.in_step(step)).collect();
        let mut ends = vec![Vec::new(), exchanged.clone(), put.clone()];
        let Some((last, (_, there))) = other.steps.last().zip(self.after(&other.steps)) else {
            return ends;
        };
        // What only looks again need not be done where one look is enough.
        let begins = (0..rest.len()).filter(|&n| n == 0 || rest[n - 1].action == last.action);
        for (steps, n) in begins.flat_map(|n| [(&exchanged[n..], n), (&rest[n..], n)]) {
            if n > 0 {
                // What is done from where the plan looks last is done from where the other does.
                let there = Instead::of(&rest[n - 1], last);
                ends.push(rest[n..].iter().map(|step| there.in_step(step)).collect());
                ends.push(steps.to_vec());
            }
            let led = self.led(&there, last, &steps[0], last);
            ends.extend(led.into_iter().map(|bridge| [std::slice::from_ref(&bridge), steps].concat()));
        }
        // What has begun with other objects may go on with those of the plan.
        for n in 1..rest.len().min(MOST_STEPS) {
            let begun: Vec<Step> = put[..n].iter().filter(|step| leads(step)).cloned().collect();
            let Some((_, there)) = self.after(&[&other.steps, begun.as_slice()].concat()) else { break };
            let led = self.led(&there, &put[n - 1], &rest[n], last);
            ends.extend(
                led.into_iter().map(|bridge| [&begun, std::slice::from_ref(&bridge), &rest[n..]].concat()),
            );
        }
        // Who is there already does not go there.
        ends.iter_mut().for_each(|end| end.retain(leads));
        ends
    }

    /// Applicable steps that lead from an object of step `from` to an object of step `to`.
    fn led(&self, there: &State, from: &Step, to: &Step, about: &Step) -> Vec<Step> {
        let pairs = from.arguments.iter().flat_map(|from| to.arguments.iter().map(move |to| (from, to)));
        let bridges = pairs.flat_map(|(from, to)| self.bridges(from, to, about));
        bridges.filter(|bridge| self.apply(&mut there.clone(), bridge).is_some()).collect()
    }

    /// Obstacle to the rest of a plan after an alternative: a number too small for the steps after
    /// the last observation, or else the first obstacle of any kind.
    fn short_of(&self, other: &Other, rest: &[Step]) -> Option<Break> {
        let is_look = |step: &Step| other.steps.last().is_some_and(|last| last.action == step.action);
        let looked = rest.iter().rposition(is_look);
        let there = looked.and_then(|n| Some(Instead::of(&rest[n], other.steps.last()?)));
        let there = there.as_ref().unwrap_or(&other.instead);
        let needed = &rest[looked.map_or(0, |n| n + 1)..];
        let needed: Vec<Step> = needed.iter().map(|step| there.in_step(step)).collect();
        let exchanged: Vec<Step> = rest.iter().map(|step| other.instead.exchanged(step)).collect();
        let stuck = |end: &Vec<Step>| self.stuck(&[&other.steps, end.as_slice()].concat());
        let by_number = stuck(&needed).filter(Break::is_of_too_little);
        by_number.or_else(|| stuck(&exchanged))
    }

    /// True if the task has timed initial literals, so that waiting changes the state.
    fn is_timed(&self) -> bool {
        !self.semantics.task.init.timed.is_empty()
    }

    /// First obstacle that the monitor finds in steps executed one after the other; `None` if the
    /// goal is reached.
    fn stuck(&self, steps: &[Step]) -> Option<Break> {
        let (mut state, mut begins_s, mut timed) = (self.state.clone(), 0.0, Vec::new());
        for step in steps {
            let duration_s = self.takes_s(&state, step).unwrap_or_default();
            timed.push(Step { start_s: Some(begins_s), duration_s, ..step.clone() });
            begins_s += duration_s + 2.0 * SEPARATION_S;
            if self.apply(&mut state, step).is_none() {
                break;
            }
        }
        let plan = Plan { steps: timed, ..Plan::default() };
        let Semantics { task, attachments, .. } = self.semantics;
        monitor(task, attachments, &plan).err().map(|broken| Break::of(&broken, &plan))
    }

    /// Numbers that steps improve, with their predicted values.
    fn expected(&self, steps: &[Step]) -> Vec<Expected> {
        let then = self.after(steps).map(|(_, state)| self.numbers(&state)).unwrap_or_default();
        let expected = |(name, (now, less)): (String, (f64, bool))| {
            let then = then.get(&name)?.0;
            (Self::gain(now, then, less) > GAINED).then_some(Expected { name, now, then })
        };
        self.numbers(&self.state).into_iter().filter_map(expected).collect()
    }

    /// Numbers that steps improve until their end; or, if none, until the moment of the greatest
    /// improvement (the steps may consume them later).
    fn at_most(&self, steps: &[Step]) -> Vec<Expected> {
        let whole = self.expected(steps);
        if !whole.is_empty() {
            return whole;
        }
        let gained = |all: &Vec<Expected>| all.iter().map(|n| (n.then - n.now).abs()).sum::<f64>();
        let parts = (1..steps.len()).map(|n| self.expected(&steps[..n]));
        parts.max_by(|a, b| gained(a).total_cmp(&gained(b))).unwrap_or_default()
    }

    fn weigh(&self, plan: &Plan) -> Option<Weighed> {
        let first = (1..=plan.steps.len().min(MOST_STEPS))
            .find_map(|n| Some((n, self.way(&plan.steps[..n]).filter(|way| way.gains > GAINED)?)));
        let (n, mut chosen) = first?;
        let numbers = self.at_most(&plan.steps);
        let (way, rest) = plan.steps.split_at(n);
        let others = self.others(way, &chosen);
        let open = others.len() + 1;
        let led = |other: Other| {
            let (whole, blocked) = self.led_on(&other, rest);
            Way { whole, blocked, ..other.way }
        };
        let others = kept(others).into_iter().map(led).collect();
        chosen.whole = self.whole(&plan.steps);
        let shorter = joined(way).and_then(|steps| self.way(&steps));
        let shorter = shorter.filter(|way| way.takes_s < chosen.takes_s && way.gains >= chosen.gains);
        let through = self.through(way).and_then(|steps| {
            let through = self.way(&steps)?;
            let whole = self.whole(&[&steps, rest].concat())?;
            Some(Way { whole: Some(whole), ..through })
        });
        Some(Weighed { numbers, chosen: Some(chosen), others, open, shorter, through, ..Weighed::default() })
    }

    /// Remaining steps of the previous plan with its totals, or else the obstacle; `None` if the
    /// new plan has the same steps, or if none remain.
    fn left(&self, plan: &Plan, left: &Plan) -> Option<Way> {
        let steps: Vec<Call> = left.steps.iter().map(call_of).collect();
        if steps.is_empty() || plan.steps.iter().map(call_of).eq(steps.iter().cloned()) {
            return None;
        }
        let whole = self.whole(&left.steps).filter(|whole| whole.reaches);
        let blocked = if whole.is_none() { self.stuck(&left.steps) } else { None };
        Some(Way { steps, whole, blocked, ..Way::default() })
    }

    /// The steps with one more inserted that makes a step between two objects shorter; the quickest
    /// such change, `None` if there is none.
    fn through(&self, steps: &[Step]) -> Option<Vec<Step>> {
        let task = self.semantics.task;
        let step = |action: &str, arguments: [&str; 2]| Step {
            start_s: None,
            action: action.into(),
            arguments: arguments.map(str::to_string).to_vec(),
            duration_s: 0.0,
        };
        let mut best: Option<(f64, Vec<Step>)> = None;
        for (n, lead) in steps.iter().enumerate() {
            let [from, to] = lead.arguments.as_slice() else { continue };
            let Some((_, before)) = self.after(&steps[..n]) else { continue };
            let Some(lead_s) = self.apply(&mut before.clone(), lead) else { continue };
            let others = task.actions.iter().filter(|a| a.name != lead.action && a.parameters.len() == 2);
            for (action, by) in others.flat_map(|a| a.parameters[0].objects.iter().map(move |by| (a, by))) {
                let by = task.object(*by).name.as_str();
                let mut there = before.clone();
                let first = (by != from).then(|| step(&lead.action, [from, by]));
                let Some(first_s) = first.as_ref().map_or(Some(0.0), |first| self.apply(&mut there, first))
                else {
                    continue;
                };
                // What is that much longer nobody would think of.
                if first_s > FAR * lead_s {
                    continue;
                }
                for what in action.parameters[1].objects.iter() {
                    let more = step(&action.name, [by, &task.object(*what).name]);
                    let on = step(&lead.action, [by, to]);
                    let mut then = there.clone();
                    let Some(more_s) = self.apply(&mut then, &more) else { continue };
                    let Some(on_s) = self.apply(&mut then, &on) else { continue };
                    let is_shorter =
                        self.apply(&mut there.clone(), &on).is_none_or(|old_s| on_s < old_s - SHORTER_S);
                    let takes_s = first_s + more_s + on_s;
                    let is_near = takes_s <= FAR * lead_s;
                    if is_near && is_shorter && best.as_ref().is_none_or(|(best_s, _)| takes_s < *best_s) {
                        let led = first.clone().into_iter().chain([more, on]);
                        let all = steps[..n].iter().cloned().chain(led).chain(steps[n + 1..].iter().cloned());
                        best = Some((takes_s, all.collect()));
                    }
                }
            }
        }
        best.map(|(_, steps)| steps)
    }
}
