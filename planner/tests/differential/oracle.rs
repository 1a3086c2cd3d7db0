//! Reference implementation of the semantics, written a second time as plainly as possible, with exhaustive
//! searches.

use std::cmp::Reverse;
use std::collections::{BinaryHeap, HashMap, HashSet, VecDeque};

use super::generate::tuples;
use super::task::{Change, Effect, Formula, Named, Number, Task, Term};

/// Facts by bit, derived ones included, and numbers; NaN where undefined.
#[derive(Debug, Clone, PartialEq)]
pub struct State {
    pub facts: u64,
    pub numbers: Vec<f64>,
}

/// A step of a plan: start, action, arguments, duration.
#[derive(Debug, Clone, PartialEq)]
pub struct Step {
    pub start_s: f64,
    pub action: usize,
    pub arguments: Vec<usize>,
    pub duration_s: f64,
}

#[derive(Debug, Clone)]
struct Running {
    step: usize,
    action: usize,
    arguments: Vec<usize>,
    duration_s: f64,
    /// Effects at the end, with the object that they are for, whose earlier conditions were met so far.
    pending: Vec<(usize, usize)>,
}

/// A state with what is in progress.
#[derive(Debug, Clone)]
struct World {
    state: State,
    running: Vec<Running>,
}

#[derive(Debug, Clone)]
enum Event<'s> {
    Timed(usize),
    End(usize),
    Start(usize, &'s Step),
}

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

/// A task with a bit for every fact.
pub struct Oracle<'t> {
    pub task: &'t Task,
    facts: Vec<u32>,
    numbers: Vec<usize>,
    /// Every action with every fitting tuple of arguments.
    pub instances: Vec<(usize, Vec<usize>)>,
}

/// Numbers nearer than this are equal.
const TOLERANCE: f64 = 1e-7;
/// So are large ones that differ by no more than this part.
const RELATIVE_TOLERANCE: f64 = 1e-12;
/// Events nearer than this are at one time.
const TOGETHER_S: f64 = 1e-4;
/// Spacing of the starts that the search tries, seconds.
const GAP_S: f64 = 0.01;

impl<'t> Oracle<'t> {
    pub fn new(task: &'t Task) -> Oracle<'t> {
        let count = |kinds: &Vec<usize>| task.objects.pow(kinds.len() as u32);
        let (mut facts, mut numbers) = (vec![0u32], vec![0]);
        for kinds in &task.predicates {
            facts.push(facts[facts.len() - 1] + count(kinds) as u32);
        }
        for kinds in &task.functions {
            numbers.push(numbers[numbers.len() - 1] + count(kinds));
        }
        let instances = task.actions.iter().enumerate().flat_map(|(index, action)| {
            tuples(task, &action.parameters).into_iter().map(move |arguments| (index, arguments))
        });
        let instances = instances.collect();
        Oracle { task, facts, numbers, instances }
    }

    fn place(&self, arguments: &[usize]) -> usize {
        arguments.iter().fold(0, |place, &object| place * self.task.objects + object)
    }

    fn bit(&self, predicate: usize, arguments: &[usize]) -> u64 {
        1 << (self.facts[predicate] as usize + self.place(arguments))
    }

    /// The initial state with what follows from it.
    pub fn initial(&self) -> State {
        let task = self.task;
        let facts = task.facts.iter().fold(0, |facts, (p, arguments)| facts | self.bit(*p, arguments));
        let mut state = State { facts, numbers: vec![f64::NAN; self.numbers[task.functions.len()]] };
        for (function, arguments, value) in &task.numbers {
            state.numbers[self.numbers[*function] + self.place(arguments)] = *value;
        }
        self.derive(&mut state);
        state
    }

    fn derive(&self, state: &mut State) {
        let basic = self.facts[self.task.derived];
        state.facts &= (1u64 << basic) - 1;
        for predicate in self.task.derived..self.task.predicates.len() {
            loop {
                let before = state.facts;
                for rule in self.task.rules.iter().filter(|rule| rule.predicate == predicate) {
                    for arguments in tuples(self.task, &self.task.predicates[predicate]) {
                        let mut binding = arguments.clone();
                        if self.holds(&rule.body, true, state, &mut binding) {
                            state.facts |= self.bit(predicate, &arguments);
                        }
                    }
                }
                if state.facts == before {
                    break;
                }
            }
        }
    }

    fn objects(&self, named: &Named, binding: &[usize]) -> Vec<usize> {
        named.terms.iter().map(|&term| object(term, binding)).collect()
    }

    /// True if a formula, or its negation, holds; neither does where a number that it compares is undefined.
    fn holds(&self, formula: &Formula, wanted: bool, state: &State, binding: &mut Vec<usize>) -> bool {
        let mut part = |part: &Formula, wanted: bool| self.holds(part, wanted, state, binding);
        match formula {
            Formula::And(parts) if wanted => parts.iter().all(|own| part(own, true)),
            Formula::And(parts) => parts.iter().any(|own| part(own, false)),
            Formula::Or(parts) if wanted => parts.iter().any(|own| part(own, true)),
            Formula::Or(parts) => parts.iter().all(|own| part(own, false)),
            Formula::Not(inner) => part(inner, !wanted),
            Formula::Imply(sides) if wanted => part(&sides[0], false) || part(&sides[1], true),
            Formula::Imply(sides) => part(&sides[0], true) && part(&sides[1], false),
            Formula::Quantified { all, variable, of, body } => {
                let mut test = |object: usize| {
                    binding.resize(binding.len().max(variable + 1), 0);
                    binding[*variable] = object;
                    self.holds(body, wanted, state, binding)
                };
                if *all == wanted {
                    self.task.of(*of).all(&mut test)
                } else {
                    self.task.of(*of).any(&mut test)
                }
            }
            Formula::Atom(atom) => {
                let bit = self.bit(atom.index, &self.objects(atom, binding));
                (state.facts & bit != 0) == wanted
            }
            Formula::Same(left, right) => (object(*left, binding) == object(*right, binding)) == wanted,
            Formula::Compare(relation, left, right) => {
                let (left, right) =
                    (self.number(left, state, binding, 0.0), self.number(right, state, binding, 0.0));
                let (Some(left), Some(right)) = (left, right) else { return false };
                let larger = left.abs().max(right.abs());
                let equal = (left - right).abs() <= TOLERANCE.max(RELATIVE_TOLERANCE * larger);
                let holds = match *relation {
                    "<" => left < right && !equal,
                    "<=" => left < right || equal,
                    "=" => equal,
                    ">=" => left > right || equal,
                    _ => left > right && !equal,
                };
                holds == wanted
            }
        }
    }

    fn number(&self, number: &Number, state: &State, binding: &[usize], duration_s: f64) -> Option<f64> {
        match number {
            Number::Constant(value) => Some(*value),
            Number::Duration => Some(duration_s),
            Number::Negative(inner) => Some(-self.number(inner, state, binding, duration_s)?),
            Number::Fluent(fluent) => {
                let place = self.numbers[fluent.index] + self.place(&self.objects(fluent, binding));
                Some(state.numbers[place]).filter(|value| !value.is_nan())
            }
            Number::Binary(operator, sides) => {
                let left = self.number(&sides[0], state, binding, duration_s)?;
                let right = self.number(&sides[1], state, binding, duration_s)?;
                Some(match operator {
                    '+' => left + right,
                    '-' => left - right,
                    '*' => left * right,
                    _ => left / right,
                })
                .filter(|value| value.is_finite())
            }
        }
    }

    pub fn is_goal(&self, state: &State) -> bool {
        self.holds(&self.task.goal, true, state, &mut Vec::new())
    }

    /// Value of the metric.
    pub fn metric(&self, state: &State) -> Option<f64> {
        self.number(self.task.metric.as_ref()?, state, &[], 0.0)
    }

    /// True if an optional condition of an effect holds for an object of its own variable.
    fn met(
        &self,
        effect: &Effect,
        time: usize,
        for_object: usize,
        state: &State,
        arguments: &[usize],
    ) -> bool {
        let mut binding = bound(effect, for_object, arguments);
        effect.when[time].as_ref().is_none_or(|when| self.holds(when, true, state, &mut binding))
    }

    fn objects_for(&self, effect: &Effect) -> std::ops::Range<usize> {
        effect.forall.map_or(0..1, |(_, of)| self.task.of(of))
    }

    /// Lets events happen together; `None` if they cannot.
    fn happen(&self, world: &World, events: &[Event]) -> Option<World> {
        let before = &world.state;
        let mut next = world.clone();
        let (mut added, mut deleted) = (0u64, 0u64);
        let mut changes: Vec<(usize, &str, f64)> = Vec::new();
        for event in events {
            let (action, arguments, duration_s, ending) = match event {
                Event::Timed(index) => {
                    let (_, predicate, arguments, holds) = &self.task.timed[*index];
                    let bit = self.bit(*predicate, arguments);
                    if *holds {
                        added |= bit
                    } else {
                        deleted |= bit
                    }
                    continue;
                }
                Event::Start(_, step) => (step.action, &step.arguments, step.duration_s, None),
                Event::End(step) => {
                    let running = world.running.iter().find(|running| running.step == *step)?;
                    (running.action, &running.arguments, running.duration_s, Some(running))
                }
            };
            let own = &self.task.actions[action];
            let mut binding = arguments.clone();
            let condition = &own.condition[if ending.is_some() { 2 } else { 0 }];
            if condition.as_ref().is_some_and(|own| !self.holds(own, true, before, &mut binding)) {
                return None;
            }
            if ending.is_none() && !self.allows(action, arguments, duration_s, before) {
                return None;
            }
            for (index, effect) in
                own.effects.iter().enumerate().filter(|(_, e)| e.at_end == ending.is_some())
            {
                for object in self.objects_for(effect) {
                    let remembered = effect.at_end && (effect.when[0].is_some() || effect.when[1].is_some());
                    let gone = || ending.is_some_and(|running| !running.pending.contains(&(index, object)));
                    let now = if effect.at_end { 2 } else { 0 };
                    if remembered && gone() || !self.met(effect, now, object, before, arguments) {
                        continue;
                    }
                    let binding = bound(effect, object, arguments);
                    match &effect.change {
                        Change::Add(atom) => added |= self.bit(atom.index, &self.objects(atom, &binding)),
                        Change::Delete(atom) => {
                            deleted |= self.bit(atom.index, &self.objects(atom, &binding))
                        }
                        Change::Number(how, fluent, amount) => {
                            let place =
                                self.numbers[fluent.index] + self.place(&self.objects(fluent, &binding));
                            changes.push((place, how, self.number(amount, before, &binding, duration_s)?));
                        }
                    }
                }
            }
            match event {
                Event::End(step) => next.running.retain(|running| running.step != *step),
                Event::Start(step, from) if own.duration.is_some() => {
                    let (step, arguments) = (*step, from.arguments.clone());
                    let pending = self.pending(action, &arguments, before);
                    next.running.push(Running { step, action, arguments, duration_s, pending });
                }
                _ => {}
            }
        }
        next.state.facts = next.state.facts & !deleted | added;
        reckon(&mut next.state.numbers, &changes)?;
        self.derive(&mut next.state);
        self.goes_on(&mut next).then_some(next)
    }

    /// True if the actions in progress may go on in a state; removes their end effects whose condition has
    /// failed on the way.
    fn goes_on(&self, next: &mut World) -> bool {
        let World { state, running } = next;
        for own in running {
            let action = &self.task.actions[own.action];
            let over_all = action.condition[1].as_ref();
            if over_all.is_some_and(|over_all| !self.holds(over_all, true, state, &mut own.arguments.clone()))
            {
                return false;
            }
            let arguments = &own.arguments;
            own.pending
                .retain(|&(index, object)| self.met(&action.effects[index], 1, object, state, arguments));
        }
        true
    }

    fn pending(&self, action: usize, arguments: &[usize], before: &State) -> Vec<(usize, usize)> {
        let effects =
            self.task.actions[action].effects.iter().enumerate().filter(|(_, effect)| effect.at_end);
        let all = effects
            .flat_map(|(index, effect)| self.objects_for(effect).map(move |object| (index, effect, object)));
        let met = all.filter(|&(_, effect, object)| self.met(effect, 0, object, before, arguments));
        met.map(|(index, _, object)| (index, object)).collect()
    }

    fn allows(&self, action: usize, arguments: &[usize], duration_s: f64, state: &State) -> bool {
        let Some([least, most]) = &self.task.actions[action].duration else { return true };
        let value = |number| self.number(number, state, arguments, 0.0);
        let (Some(least), Some(most)) = (value(least), value(most)) else { return false };
        duration_s >= least - 1e-3 && duration_s <= most + 1e-3
    }

    /// Last state of a plan, if all of it can happen; `timed` tells a plan with times from a plain
    /// sequence.
    pub fn replay(&self, plan: &[Step], timed: bool) -> Option<State> {
        let mut events: Vec<(f64, Event)> = Vec::new();
        for (index, step) in plan.iter().enumerate() {
            events.push((step.start_s, Event::Start(index, step)));
            if self.task.actions[step.action].duration.is_some() {
                events.push((step.start_s + step.duration_s, Event::End(index)));
            }
        }
        if timed {
            let given = self.task.timed.iter().enumerate();
            events.extend(given.map(|(index, given)| (given.0, Event::Timed(index))));
        }
        events.sort_by(|one, other| one.0.total_cmp(&other.0));
        let mut world = World { state: self.initial(), running: Vec::new() };
        let mut rest = &events[..];
        while let Some((time_s, _)) = rest.first() {
            let count = rest.iter().take_while(|(other_s, _)| other_s - time_s < TOGETHER_S).count();
            let together: Vec<Event> = rest[..count].iter().map(|(_, event)| event.clone()).collect();
            world = self.happen(&world, &together)?;
            rest = &rest[count..];
        }
        world.running.is_empty().then_some(world.state)
    }

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
        let start = Epoch {
            world: World { state: self.initial(), running: Vec::new() },
            plan: Vec::new(),
            now_s: 0.0,
            given: 0,
        };
        let mut given: Vec<usize> = (0..self.task.timed.len()).collect();
        given.sort_by(|&one, &other| self.task.timed[one].0.total_cmp(&self.task.timed[other].0));
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
        let end_s = |running: &Running| {
            let step: &Step = &epoch.plan[running.step];
            step.start_s + step.duration_s
        };
        let mut due: Vec<(f64, Event)> =
            epoch.world.running.iter().map(|running| (end_s(running), Event::End(running.step))).collect();
        due.extend(given.get(epoch.given).map(|&index| (self.task.timed[index].0, Event::Timed(index))));
        due.sort_by(|one, other| one.0.total_cmp(&other.0));
        let mut all = Vec::new();
        if let Some((time_s, event)) = due.first()
            && let Some(world) = self.happen(&epoch.world, std::slice::from_ref(event))
        {
            let passed = epoch.given + usize::from(matches!(event, Event::Timed(_)));
            all.push(Epoch { world, plan: epoch.plan.clone(), now_s: *time_s, given: passed });
        }
        let start_s = epoch.now_s + GAP_S;
        if due.first().is_some_and(|(time_s, _)| time_s - start_s < GAP_S / 2.0) || epoch.plan.len() >= 8 {
            return all;
        }
        for (action, arguments) in &self.instances {
            for duration_s in self.durations(*action) {
                let step = Step { start_s, action: *action, arguments: arguments.clone(), duration_s };
                let clashes = |other_s: f64| (other_s - start_s - duration_s).abs() < GAP_S / 2.0;
                if duration_s > 0.0 && due.iter().any(|(time_s, _)| clashes(*time_s)) {
                    continue;
                }
                let Some(world) = self.happen(&epoch.world, &[Event::Start(epoch.plan.len(), &step)]) else {
                    continue;
                };
                let plan = epoch.plan.iter().cloned().chain([step]).collect();
                all.push(Epoch { world, plan, now_s: start_s, given: epoch.given });
            }
        }
        all
    }

    /// The least and the greatest duration of an action; 0 for one that takes no time.
    pub fn durations(&self, action: usize) -> Vec<f64> {
        let Some(bounds) = &self.task.actions[action].duration else { return vec![0.0] };
        let mut all: Vec<f64> =
            bounds.iter().filter_map(|bound| self.number(bound, &self.initial(), &[], 0.0)).collect();
        all.dedup();
        all
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

fn object(term: Term, binding: &[usize]) -> usize {
    match term {
        Term::Variable(variable) => binding[variable],
        Term::Object(object) => object,
    }
}

fn bound(effect: &Effect, object: usize, arguments: &[usize]) -> Vec<usize> {
    let mut binding = arguments.to_vec();
    if let Some((variable, _)) = effect.forall {
        binding.resize(binding.len().max(variable + 1), 0);
        binding[variable] = object;
    }
    binding
}

/// Changes numbers one after the other; `None` if one is none then.
fn reckon(numbers: &mut [f64], changes: &[(usize, &str, f64)]) -> Option<()> {
    for &(place, how, amount) in changes {
        let value = &mut numbers[place];
        match how {
            "assign" => *value = amount,
            "increase" => *value += amount,
            "decrease" => *value -= amount,
            _ => *value *= amount,
        }
        if !value.is_finite() {
            return None;
        }
    }
    Some(())
}
