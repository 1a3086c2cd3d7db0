//! Searches by the reference implementation: all there is up to a number of states, and random walks.

use std::cmp::Reverse;
use std::collections::{BinaryHeap, HashMap, HashSet, VecDeque};

use super::generate::Chance;
use super::oracle::{Event, Oracle, Running, State, Step, World};

/// Result of a search.
#[derive(Debug)]
pub enum Found {
    Plan(Vec<Step>),
    /// Everything was seen.
    Nothing,
    /// There is more than was looked at.
    Unknown,
}

/// Result of a uniform-cost search.
#[derive(Debug)]
pub enum Cheapest {
    /// The metric of the best plan, or its steps without one.
    Cost(f64),
    /// Everything was seen.
    Nothing,
    /// There is more than was looked at.
    Unknown,
}

/// Random plans that are tried.
const WALKS: usize = 50;
/// Spacing of the starts that the search tries, seconds.
const GAP_S: f64 = 0.01;

impl Oracle<'_> {
    /// A shortest plan without times.
    pub fn search(&self, most: usize) -> Found {
        let start = World { state: self.initial(), running: Vec::new() };
        let mut seen: HashMap<(u64, Vec<u64>), ()> = HashMap::from([(key(&start.state), ())]);
        let mut queue = VecDeque::from([(start, Vec::new())]);
        let mut all = true;
        while let Some((world, plan)) = queue.pop_front() {
            if self.is_goal(&world.state) {
                return Found::Plan(plan);
            }
            for (action, arguments) in &self.instances {
                let step = Step {
                    start_s: plan.len() as f64,
                    action: *action,
                    arguments: arguments.clone(),
                    duration_s: 0.0,
                };
                let Some(next) = self.happen(&world, &[Event::Start(0, &step)]) else { continue };
                if seen.len() >= most {
                    all = false;
                } else if seen.insert(key(&next.state), ()).is_none() {
                    queue.push_back((next, plan.iter().cloned().chain([step]).collect()));
                }
            }
        }
        if all { Found::Nothing } else { Found::Unknown }
    }

    /// The cost of the cheapest plan without times. Nothing but the metric reads the function that it is.
    pub fn cheapest(&self, most: usize) -> Cheapest {
        let cost = |state: &State, steps: usize| self.metric(state).unwrap_or(steps as f64);
        // Costs are halves.
        let in_halves = |cost: f64| (2.0 * cost).round() as u64;
        let place = |world: &World| {
            let mut state = world.state.clone();
            if self.task.metric.is_some() {
                state.numbers.pop();
            }
            key(&state)
        };
        let mut worlds = vec![(World { state: self.initial(), running: Vec::new() }, 0)];
        let mut queue = BinaryHeap::from([(Reverse(0), 0)]);
        let mut closed = HashSet::new();
        while let Some((_, index)) = queue.pop() {
            let (world, steps) = worlds[index].clone();
            if !closed.insert(place(&world)) {
                continue;
            }
            if self.is_goal(&world.state) {
                return Cheapest::Cost(cost(&world.state, steps));
            }
            if closed.len() >= most {
                return Cheapest::Unknown;
            }
            for (action, arguments) in &self.instances {
                let (action, arguments) = (*action, arguments.clone());
                let step = Step { start_s: steps as f64, action, arguments, duration_s: 0.0 };
                let Some(next) = self.happen(&world, &[Event::Start(0, &step)]) else { continue };
                queue.push((Reverse(in_halves(cost(&next.state, steps + 1))), worlds.len()));
                worlds.push((next, steps + 1));
            }
        }
        Cheapest::Nothing
    }

    /// Some plan with times: what starts, starts a little after what happened last.
    pub fn search_timed(&self, most: usize) -> Found {
        let (start, given) = (self.begin(), self.given());
        if self.ends_well(&start, &given) {
            return Found::Plan(Vec::new());
        }
        let mut queue = VecDeque::from([start]);
        let mut made = 0;
        while let Some(epoch) = queue.pop_front() {
            for next in self.after(&epoch, &given) {
                if self.ends_well(&next, &given) {
                    return Found::Plan(next.plan);
                }
                made += 1;
                if made < most {
                    queue.push_back(next);
                }
            }
        }
        Found::Unknown
    }

    /// True if the goal holds after the last timed literal, if nothing more is done.
    fn ends_well(&self, epoch: &Epoch, given: &[usize]) -> bool {
        let mut left = given[epoch.given..].iter();
        let last =
            left.try_fold(epoch.world.clone(), |world, &index| self.happen(&world, &[Event::Timed(index)]));
        epoch.world.running.is_empty() && last.is_some_and(|last| self.is_goal(&last.state))
    }

    fn after(&self, epoch: &Epoch, given: &[usize]) -> Vec<Epoch> {
        let due = self.due(epoch, given);
        let mut all: Vec<Epoch> =
            due.first().and_then(|first| self.goes_by(epoch, first)).into_iter().collect();
        // Where numbers flow, waiting makes a difference.
        let waits_s: &[f64] = if self.flows(&epoch.world) { &[0.0, 0.5, 1.0] } else { &[0.0] };
        for wait_s in waits_s {
            for (action, arguments) in &self.instances {
                for duration_s in self.durations(*action, arguments, &epoch.world.state) {
                    let start_s = epoch.now_s + wait_s + GAP_S;
                    let step = Step { start_s, action: *action, arguments: arguments.clone(), duration_s };
                    all.extend(self.starts(epoch, step, &due));
                }
            }
        }
        all
    }

    /// Timed literals, by time.
    fn due(&self, epoch: &Epoch, given: &[usize]) -> Vec<(f64, Event<'static>)> {
        let end_s = |running: &Running| {
            let step: &Step = &epoch.plan[running.step];
            step.start_s + step.duration_s
        };
        let mut due: Vec<(f64, Event)> =
            epoch.world.running.iter().map(|running| (end_s(running), Event::End(running.step))).collect();
        due.extend(given.get(epoch.given).map(|&index| (self.task.timed[index].0, Event::Timed(index))));
        due.sort_by(|one, other| one.0.total_cmp(&other.0));
        due
    }

    /// The epoch after what happens next by itself.
    fn goes_by(&self, epoch: &Epoch, (time_s, event): &(f64, Event)) -> Option<Epoch> {
        let before = self.pass(&epoch.world, time_s - epoch.now_s)?;
        let world = self.happen(&before, std::slice::from_ref(event))?;
        let passed = epoch.given + usize::from(matches!(event, Event::Timed(_)));
        Some(Epoch { world, plan: epoch.plan.clone(), now_s: *time_s, given: passed })
    }

    /// The epoch after a start; `None` if it cannot happen, or not before what is due.
    fn starts(&self, epoch: &Epoch, step: Step, due: &[(f64, Event)]) -> Option<Epoch> {
        let late = due.first().is_some_and(|(time_s, _)| time_s - step.start_s < GAP_S / 2.0);
        let clashes = |other_s: f64| (other_s - step.start_s - step.duration_s).abs() < GAP_S / 2.0;
        let clash = step.duration_s > 0.0 && due.iter().any(|(time_s, _)| clashes(*time_s));
        if late || clash || epoch.plan.len() >= 8 {
            return None;
        }
        let before = self.pass(&epoch.world, step.start_s - epoch.now_s)?;
        let world = self.happen(&before, &[Event::Start(epoch.plan.len(), &step)])?;
        let now_s = step.start_s;
        let plan = epoch.plan.iter().cloned().chain([step]).collect();
        Some(Epoch { world, plan, now_s, given: epoch.given })
    }

    /// A random plan and the state that it ends in; `None` if what was begun cannot end.
    pub fn walk(&self, chance: &mut Chance) -> Option<(Vec<Step>, State)> {
        let given = self.given();
        let mut epoch = self.begin();
        let most = 1 + chance.below(5);
        for _ in 0..60 {
            let due = self.due(&epoch, &given);
            let is_over = epoch.plan.len() >= most;
            if is_over && due.is_empty() {
                return Some((epoch.plan, epoch.world.state));
            }
            if is_over || chance.percent(25) && !due.is_empty() {
                epoch = self.goes_by(&epoch, due.first()?)?;
            } else if !self.instances.is_empty() {
                let (action, arguments) = self.instances[chance.below(self.instances.len())].clone();
                let durations = self.durations(action, &arguments, &epoch.world.state);
                if !durations.is_empty() {
                    let start_s = epoch.now_s + GAP_S + chance.of(&[0.0, 0.0, 0.25, 0.5, 1.0]);
                    let step = Step { start_s, action, arguments, duration_s: chance.of(&durations) };
                    epoch = self.starts(&epoch, step, &due).unwrap_or(epoch);
                }
            }
        }
        None
    }

    /// A plan among some random ones.
    pub fn wander(&self, chance: &mut Chance) -> Found {
        let walks = (0..WALKS).filter_map(|_| self.walk(chance));
        let reaches = |(plan, last): (Vec<Step>, State)| self.is_goal(&last).then_some(plan);
        walks.filter_map(reaches).next().map_or(Found::Unknown, Found::Plan)
    }

    fn begin(&self) -> Epoch {
        let world = World { state: self.initial(), running: Vec::new() };
        Epoch { world, plan: Vec::new(), now_s: 0.0, given: 0 }
    }

    /// Timed literals, by time.
    fn given(&self) -> Vec<usize> {
        let mut given: Vec<usize> = (0..self.task.timed.len()).collect();
        given.sort_by(|&one, &other| self.task.timed[one].0.total_cmp(&self.task.timed[other].0));
        given
    }
}

/// State of the search for temporal plans.
struct Epoch {
    world: World,
    plan: Vec<Step>,
    now_s: f64,
    given: usize,
}

fn key(state: &State) -> (u64, Vec<u64>) {
    (state.facts, state.numbers.iter().map(|number| (number + 0.0).to_bits()).collect())
}
