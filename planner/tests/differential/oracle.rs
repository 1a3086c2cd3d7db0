//! Reference implementation of the semantics, written a second time as plainly as possible.

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

/// An action in progress.
#[derive(Debug, Clone)]
pub struct Running {
    pub step: usize,
    action: usize,
    arguments: Vec<usize>,
    duration_s: f64,
    /// Effects at the end, with the object that they are for, whose earlier conditions were met so far.
    pending: Vec<(usize, usize)>,
    /// Started by the last happening.
    is_new: bool,
}

/// A state with what is in progress.
#[derive(Debug, Clone)]
pub struct World {
    pub state: State,
    pub running: Vec<Running>,
}

/// A timed literal, the end of a step, or its start.
#[derive(Debug, Clone)]
pub enum Event<'s> {
    Timed(usize),
    End(usize),
    Start(usize, &'s Step),
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
    pub fn happen(&self, world: &World, events: &[Event]) -> Option<World> {
        let before = &world.state;
        let mut next = world.clone();
        next.running.iter_mut().for_each(|running| running.is_new = false);
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
                    next.running.push(Running { step, action, arguments, duration_s, pending, is_new: true });
                }
                _ => {}
            }
        }
        next.state.facts = next.state.facts & !deleted | added;
        reckon(&mut next.state.numbers, &changes)?;
        self.derive(&mut next.state);
        let flows = self.flows(&next);
        self.goes_on(&mut next, flows).then_some(next)
    }

    /// True if some action changes numbers at a rate.
    pub fn may_flow(&self) -> bool {
        self.task.actions.iter().any(|action| !action.flows.is_empty())
    }

    /// True if an action in progress changes numbers at a rate.
    pub fn flows(&self, world: &World) -> bool {
        world.running.iter().any(|running| !self.task.actions[running.action].flows.is_empty())
    }

    /// Lets time pass up to the next happening, which changes numbers at rates; `None` if the actions in progress
    /// cannot go on all the time in between.
    pub fn pass(&self, world: &World, elapsed_s: f64) -> Option<World> {
        let mut changes = Vec::new();
        for running in &world.running {
            for flow in &self.task.actions[running.action].flows {
                let place = self.numbers[flow.fluent.index]
                    + self.place(&self.objects(&flow.fluent, &running.arguments));
                let rate = self.number(&flow.per_second, &world.state, &running.arguments, 0.0)?;
                changes.push((place, "increase", if flow.increases { rate } else { -rate } * elapsed_s));
            }
        }
        if changes.is_empty() || elapsed_s <= 0.0 {
            return Some(world.clone());
        }
        let after = |part: f64| {
            let mut next = world.clone();
            let partly: Vec<_> =
                changes.iter().map(|&(place, how, amount)| (place, how, part * amount)).collect();
            reckon(&mut next.state.numbers, &partly)?;
            self.derive(&mut next.state);
            Some(next)
        };
        let mut last = after(1.0)?;
        let mut points = self.crossings(world, &last);
        points.extend([0.0, 1.0]);
        points.sort_by(f64::total_cmp);
        for pair in 1..points.len() {
            let inside = [(points[pair - 1] + points[pair]) / 2.0, points[pair]];
            for part in inside.into_iter().filter(|&part| part < 1.0) {
                let mut there = after(part)?;
                for (own, known) in there.running.iter_mut().zip(&last.running) {
                    own.pending.clone_from(&known.pending);
                }
                if !self.goes_on(&mut there, false) {
                    return None;
                }
                last.running = there.running;
            }
        }
        Some(last)
    }

    /// Crossings between two states of the comparisons that matter to the actions in progress, as parts of the way.
    fn crossings(&self, first: &World, last: &World) -> Vec<f64> {
        let [before, after] = [first, last].map(|world| {
            let mut found = Vec::new();
            for rule in &self.task.rules {
                for mut binding in tuples(self.task, &self.task.predicates[rule.predicate]) {
                    self.differences(&rule.body, &world.state, &mut binding, &mut found);
                }
            }
            for running in &first.running {
                let action = &self.task.actions[running.action];
                let mut binding = running.arguments.clone();
                action.condition[1]
                    .iter()
                    .for_each(|own| self.differences(own, &world.state, &mut binding, &mut found));
                for effect in &action.effects {
                    for object in self.objects_for(effect) {
                        let mut binding = bound(effect, object, &running.arguments);
                        effect.when[1]
                            .iter()
                            .for_each(|own| self.differences(own, &world.state, &mut binding, &mut found));
                    }
                }
            }
            found
        });
        let crossing = |(first, last): (f64, f64)| {
            let part = first / (first - last);
            let nothing =
                |own: f64, apart: f64| own.abs() <= TOLERANCE && ((last - first) * apart).abs() <= TOLERANCE;
            let inside =
                part > 1e-9 && part < 1.0 - 1e-9 && !nothing(first, part) && !nothing(last, 1.0 - part);
            inside.then_some(part)
        };
        before.into_iter().zip(after).filter_map(crossing).collect()
    }

    /// Differences between the sides of all comparisons of a formula; NaN where one has no value.
    fn differences(&self, formula: &Formula, state: &State, binding: &mut Vec<usize>, found: &mut Vec<f64>) {
        match formula {
            Formula::And(parts) | Formula::Or(parts) => {
                parts.iter().for_each(|part| self.differences(part, state, binding, found));
            }
            Formula::Not(inner) => self.differences(inner, state, binding, found),
            Formula::Imply(sides) => {
                sides.iter().for_each(|side| self.differences(side, state, binding, found))
            }
            Formula::Quantified { variable, of, body, .. } => {
                for object in self.task.of(*of) {
                    binding.resize(binding.len().max(variable + 1), 0);
                    binding[*variable] = object;
                    self.differences(body, state, binding, found);
                }
            }
            Formula::Atom(_) | Formula::Same(..) => {}
            Formula::Compare(_, left, right) => {
                let [left, right] = [left, right].map(|side| self.number(side, state, binding, 0.0));
                found.push(left.zip(right).map_or(f64::NAN, |(left, right)| left - right));
            }
        }
    }

    /// True if the actions in progress may go on in a state; removes their end effects whose condition has
    /// failed on the way. Where numbers flow, those that have just begun are asked from then on.
    fn goes_on(&self, next: &mut World, flows: bool) -> bool {
        let World { state, running } = next;
        for own in running.iter_mut().filter(|own| !flows || !own.is_new) {
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
        let value = |bound: &Option<Number>, none: f64| {
            bound.as_ref().map_or(Some(none), |bound| self.number(bound, state, arguments, 0.0))
        };
        let (Some(least), Some(most)) = (value(least, 0.0), value(most, f64::INFINITY)) else { return false };
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
        let mut now_s = 0.0;
        while let Some((time_s, _)) = rest.first() {
            let count = rest.iter().take_while(|(other_s, _)| other_s - time_s < TOGETHER_S).count();
            let together: Vec<Event> = rest[..count].iter().map(|(_, event)| event.clone()).collect();
            world = self.happen(&self.pass(&world, time_s - now_s)?, &together)?;
            now_s = *time_s;
            rest = &rest[count..];
        }
        world.running.is_empty().then_some(world.state)
    }

    /// Durations to try: the least, the greatest, and one between them; 0 for an action that takes no time.
    pub fn durations(&self, action: usize, arguments: &[usize], state: &State) -> Vec<f64> {
        let Some(bounds) = &self.task.actions[action].duration else { return vec![0.0] };
        let [least, most] =
            bounds.each_ref().map(|bound| self.number(bound.as_ref()?, state, arguments, 0.0));
        let Some(least) = least else { return Vec::new() };
        let most = match &bounds[1] {
            None => least + 4.0,
            Some(_) => most.unwrap_or(least),
        };
        let mut all = vec![least, most];
        all.dedup();
        if matches!(
            bounds,
            [
                Some(Number::Fluent(_) | Number::Constant(_)),
                None | Some(Number::Binary(..) | Number::Fluent(_))
            ]
        ) {
            all.push((least + most) / 2.0);
        }
        all.retain(|&duration_s| duration_s > 0.05);
        all
    }
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
