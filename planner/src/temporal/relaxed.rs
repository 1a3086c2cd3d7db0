//! The relaxed plan heuristic of the temporal search.
//!
//! Nothing is ever taken away: costs of facts spread as in the additive heuristic (Bonet and Geffner 2001), a plan is
//! read off the cheapest supporters (Keyder and Geffner 2008). Numeric conditions and calls whose answer depends on the
//! state are *tests*: an action supports a test if, done alone from the state at hand, it makes it true, or brings a
//! comparison closer; then it counts as often as it must be repeated (compare Hoffmann 2003, Scala et al. 2016).

use std::cmp::Reverse;
use std::collections::BinaryHeap;
use std::sync::Arc;

use rustc_hash::FxHashMap;

use crate::attachment::{CallKind, Level};
use crate::calls::Failure;
use crate::ground::{CallId, ComparisonId, Conjunction, Expression, Fact, Outcome, Place, Values};

use super::touch::Touched;
use super::world::{Moment, World};

/// Which part of an action a relaxed operator stands for.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub(crate) enum Part {
    /// All of it in one go.
    Whole,
    /// The start of an action that then stays open.
    Start,
    /// The end of an open action.
    End,
    /// A timed effect, or an axiom.
    Free,
}

/// Something whose truth is looked up by evaluation.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
enum Test {
    Comparison(ComparisonId),
    Call(CallId, bool),
}

#[derive(Debug, Clone)]
struct Operator {
    act: u32,
    part: Part,
    needs: Vec<u32>,
    gives: Vec<u32>,
    /// Tests that its numeric effects or facts may change.
    moves: Vec<u32>,
    /// Calls that never change: asked once the rest is reached.
    gates: Vec<(CallId, bool)>,
    /// Cost if it is the same in every state.
    cost: Option<f64>,
}

/// What the heuristic says of a state.
#[derive(Debug, Clone, Default)]
pub(crate) struct Estimate {
    /// Sum of the costs of the relaxed plan's operators.
    pub cost: f64,
    /// Number of its operators.
    pub steps: f64,
    /// Those that could be applied at once.
    pub preferred: Vec<(u32, Part)>,
}

/// The relaxed task and the working memory of its evaluation.
pub(crate) struct Relaxed {
    offsets: Vec<u32>,
    tests: Vec<Test>,
    /// Number of a test's proposition.
    test_index: FxHashMap<Test, u32>,
    /// By resource, the tests that read it.
    tests_on: Vec<Vec<u32>>,
    test_base: u32,
    /// Propositions from here on say that an action is open; after those of all actions, that it is closed.
    token_base: u32,
    operators: Vec<Operator>,
    needed_by: Vec<Vec<u32>>,
    goal: Vec<u32>,
    goal_gates: Vec<(CallId, bool)>,
    unit: f64,
    costs: Vec<f64>,
    supporters: Vec<(u32, f64)>,
    open_needs: Vec<u32>,
    operator_costs: Vec<f64>,
    queue: BinaryHeap<Reverse<(Key, u32)>>,
}

#[derive(Debug, Clone, Copy, PartialEq)]
struct Key(f64);

impl Eq for Key {}
impl PartialOrd for Key {
    fn partial_cmp(&self, other: &Key) -> Option<std::cmp::Ordering> {
        Some(self.cmp(other))
    }
}
impl Ord for Key {
    fn cmp(&self, other: &Key) -> std::cmp::Ordering {
        self.0.total_cmp(&other.0)
    }
}

const NOBODY: u32 = u32::MAX;

impl Relaxed {
    /// The relaxed task; `open_act` says of each action whether its start and end are apart in the search.
    pub fn new(world: &World, open_act: &[bool]) -> Relaxed {
        let mut relaxed = Relaxed::empty(world);
        let acts = world.acts.len() as u32;
        for (index, act) in world.acts.iter().enumerate() {
            let act_index = index as u32;
            let cost = constant_seconds(world, index);
            if open_act[index] {
                let token = relaxed.token_base + act_index;
                let before = needs_at_start(act, &act.start_effects);
                relaxed.operator(world, act_index, Part::Start, &before, &[], cost.map(|cost| cost * 0.5));
                relaxed.tokens(act_index, Part::Start, token);
                let before = Merged::of(&[&act.at_end]);
                relaxed.operator(world, act_index, Part::End, &before, &[token], cost.map(|cost| cost * 0.5));
                relaxed.tokens(act_index, Part::End, token + acts);
            } else {
                let before = needs_of_whole(act);
                relaxed.operator(world, act_index, Part::Whole, &before, &[], cost);
            }
        }
        relaxed.axioms_and_timed(world);
        relaxed.goal = relaxed.propositions(&world.ground.goal.facts, &world.ground.goal.comparisons);
        let goal_calls = world.ground.goal.calls.clone();
        for (call, wanted) in goal_calls {
            match relaxed.test_of(Test::Call(call, wanted)) {
                Some(test) => relaxed.goal.push(test),
                None => relaxed.goal_gates.push((call, wanted)),
            }
        }
        relaxed.finish(world);
        relaxed
    }

    fn empty(world: &World) -> Relaxed {
        let mut offsets = Vec::with_capacity(world.ground.variables.len());
        let mut next = 0;
        for variable in &world.ground.variables {
            offsets.push(next);
            next += variable.domain_size();
        }
        let comparisons = (0..world.ground.comparisons.len()).map(|index| Test::Comparison(index as u32));
        let changing = (0..world.ground.calls.len() as u32).filter(|&call| {
            let (variables, numbers) = world.calls.reads(call);
            world.calls.kind(call) == CallKind::Condition && !(variables.is_empty() && numbers.is_empty())
        });
        let calls = changing.flat_map(|call| [Test::Call(call, true), Test::Call(call, false)]);
        let tests: Vec<Test> = comparisons.chain(calls).collect();
        let token_base = next + tests.len() as u32;
        let numbered = tests.iter().enumerate().map(|(index, &test)| (test, next + index as u32));
        let test_index: FxHashMap<Test, u32> = numbered.collect();
        let mut tests_on = vec![Vec::new(); world.ground.variables.len() + world.ground.numerics.len()];
        for (index, test) in tests.iter().enumerate() {
            let mut touched = Touched::default();
            match test {
                Test::Comparison(comparison) => touched.comparison(world, *comparison),
                Test::Call(call, _) => touched.call(world, *call),
            }
            for resource in touched.resources(offsets.len()) {
                tests_on[resource as usize].push(next + index as u32);
            }
        }
        Relaxed {
            offsets,
            test_base: next,
            token_base,
            tests,
            test_index,
            tests_on,
            operators: Vec::new(),
            needed_by: Vec::new(),
            goal: Vec::new(),
            goal_gates: Vec::new(),
            unit: 1.0,
            costs: Vec::new(),
            supporters: Vec::new(),
            open_needs: Vec::new(),
            operator_costs: Vec::new(),
            queue: BinaryHeap::new(),
        }
    }

    fn test_of(&self, wanted: Test) -> Option<u32> {
        self.test_index.get(&wanted).copied()
    }

    fn fact(&self, fact: Fact) -> u32 {
        self.offsets[fact.variable as usize] + fact.value
    }

    /// The facts that an outcome may make true; of an effect module every value of what it writes.
    fn given(&self, world: &World, outcome: &Outcome) -> Vec<u32> {
        match outcome {
            Outcome::Set(fact) => vec![self.fact(*fact)],
            Outcome::Call(call) => {
                let places = world.ground.calls[*call as usize].writes.iter();
                let variables = places.filter_map(|place| match place {
                    Place::Truth(variable) | Place::Object(variable) => Some(*variable),
                    Place::Number(_) | Place::Nowhere => None,
                });
                let every = |variable: u32| 0..world.ground.variables[variable as usize].domain_size();
                variables
                    .flat_map(|v| every(v).map(move |value| (v, value)))
                    .map(|(v, value)| self.offsets[v as usize] + value)
                    .collect()
            }
            Outcome::Change { .. } | Outcome::Flow { .. } => Vec::new(),
        }
    }

    fn propositions(&self, facts: &[Fact], comparisons: &[ComparisonId]) -> Vec<u32> {
        let facts = facts.iter().map(|&fact| self.fact(fact));
        facts.chain(comparisons.iter().map(|&comparison| self.test_base + comparison)).collect()
    }

    /// One operator for what happens always, and one for each condition under which more happens.
    fn operator(
        &mut self,
        world: &World,
        act: u32,
        part: Part,
        before: &Merged,
        tokens: &[u32],
        cost: Option<f64>,
    ) {
        let action = &world.acts[act as usize];
        let effects: Vec<_> = match part {
            Part::Whole => {
                action.start_effects.iter().chain(&action.flow_effects).chain(&action.end_effects).collect()
            }
            Part::Start => action.start_effects.iter().collect(),
            Part::End | Part::Free => action.flow_effects.iter().chain(&action.end_effects).collect(),
        };
        let mut groups: Vec<(Merged, Vec<&Outcome>)> = vec![(Merged::default(), Vec::new())];
        for effect in effects {
            let extra = effect.when.as_ref().map_or_else(Merged::default, |when| {
                Merged::of(&[&when.here, &when.at_start, &when.over_all])
            });
            match groups.iter_mut().find(|(known, _)| *known == extra) {
                Some((_, outcomes)) => outcomes.push(&effect.outcome),
                None => groups.push((extra, vec![&effect.outcome])),
            }
        }
        for (extra, outcomes) in groups {
            let mut needs = self.propositions(&before.facts, &before.comparisons);
            needs.extend(self.propositions(&extra.facts, &extra.comparisons));
            needs.extend(tokens);
            let mut gates = Vec::new();
            for &(call, wanted) in before.calls.iter().chain(&extra.calls) {
                match self.test_of(Test::Call(call, wanted)) {
                    Some(test) => needs.push(test),
                    None => gates.push((call, wanted)),
                }
            }
            needs.sort_unstable();
            needs.dedup();
            let gives = outcomes.iter().flat_map(|outcome| self.given(world, outcome)).collect();
            let mut touched = Touched::default();
            outcomes.iter().for_each(|outcome| touched.outcome(world, outcome));
            let moves = self.tests_touched(&touched);
            self.operators.push(Operator { act, part, needs, gives, moves, gates, cost });
        }
    }

    /// Lets the operators just made for a part of an action give the token that it is open, or closed.
    fn tokens(&mut self, act: u32, part: Part, token: u32) {
        let own = self.operators.iter_mut().rev().take_while(|operator| operator.act == act);
        own.filter(|operator| operator.part == part).for_each(|operator| operator.gives.push(token));
    }

    fn tests_touched(&self, touched: &Touched) -> Vec<u32> {
        let resources = touched.resources(self.offsets.len());
        let mut tests: Vec<u32> =
            resources.iter().flat_map(|&resource| self.tests_on[resource as usize].iter().copied()).collect();
        tests.sort_unstable();
        tests.dedup();
        tests
    }

    fn axioms_and_timed(&mut self, world: &World) {
        for axiom in &world.ground.axioms {
            let mut needs = self.propositions(&axiom.body.facts, &axiom.body.comparisons);
            let mut gates = Vec::new();
            for &(call, wanted) in &axiom.body.calls {
                match self.test_of(Test::Call(call, wanted)) {
                    Some(test) => needs.push(test),
                    None => gates.push((call, wanted)),
                }
            }
            let gives = vec![self.fact(axiom.head)];
            let part = Part::Free;
            self.operators.push(Operator {
                act: NOBODY,
                part,
                needs,
                gives,
                moves: vec![],
                gates,
                cost: Some(0.0),
            });
        }
        // Anything not derived may be absent: negated conditions on derived facts count as reachable.
        for (variable, declared) in world.ground.variables.iter().enumerate() {
            if declared.stratum.is_some() {
                let gives = vec![self.fact(Fact { variable: variable as u32, value: 1 })];
                let cost = Some(0.0);
                let part = Part::Free;
                let nothing =
                    Operator { act: NOBODY, part, needs: vec![], gives, moves: vec![], gates: vec![], cost };
                self.operators.push(nothing);
            }
        }
        for timed in &world.ground.timed {
            let mut touched = Touched::default();
            timed.outcomes.iter().for_each(|outcome| touched.outcome(world, outcome));
            let moves = self.tests_touched(&touched);
            let gives = timed.outcomes.iter().flat_map(|outcome| self.given(world, outcome)).collect();
            let part = Part::Free;
            self.operators.push(Operator {
                act: NOBODY,
                part,
                needs: vec![],
                gives,
                moves,
                gates: vec![],
                cost: Some(0.0),
            });
        }
    }

    fn finish(&mut self, world: &World) {
        let acts = world.acts.len() as u32;
        let count = (self.token_base + 2 * acts) as usize;
        self.needed_by = vec![Vec::new(); count];
        for (index, operator) in self.operators.iter().enumerate() {
            operator.needs.iter().for_each(|&need| self.needed_by[need as usize].push(index as u32));
        }
        let known: Vec<f64> =
            self.operators.iter().filter_map(|operator| operator.cost).filter(|&c| c > 0.0).collect();
        let mean = known.iter().sum::<f64>() / known.len().max(1) as f64;
        self.unit = if mean.is_finite() && mean > 0.0 { mean } else { 1.0 };
        self.costs = vec![f64::INFINITY; count];
        self.supporters = vec![(NOBODY, 1.0); count];
        self.open_needs = vec![0; self.operators.len()];
        self.operator_costs = vec![0.0; self.operators.len()];
    }

    /// Estimates what is missing from a state in which the given actions are open; `None` if the goal is out of reach.
    pub fn estimate(
        &mut self,
        world: &World,
        state: &Values,
        open: &[u32],
    ) -> Result<Option<Estimate>, Failure> {
        self.seed(world, state, open)?;
        let closed_base = self.token_base + world.acts.len() as u32;
        let mut goal = self.goal.clone();
        goal.extend(open.iter().map(|&act| closed_base + act));
        for &(call, wanted) in &self.goal_gates {
            if world.calls.truth(call, None, state, Level::Relaxed)? != wanted {
                return Ok(None);
            }
        }
        let mut missing: usize = goal.iter().filter(|&&need| self.costs[need as usize] > 0.0).count();
        while let Some(Reverse((Key(cost), proposition))) = self.queue.pop() {
            if cost > self.costs[proposition as usize] {
                continue;
            }
            if cost > 0.0 && goal.contains(&proposition) {
                missing -= 1;
                if missing == 0 {
                    break;
                }
            }
            for position in 0..self.needed_by[proposition as usize].len() {
                let operator = self.needed_by[proposition as usize][position];
                self.open_needs[operator as usize] -= 1;
                self.operator_costs[operator as usize] += cost;
                if self.open_needs[operator as usize] == 0 {
                    self.fire(world, state, operator)?;
                }
            }
        }
        if goal.iter().any(|&need| self.costs[need as usize].is_infinite()) {
            return Ok(None);
        }
        Ok(Some(self.extract(world, &goal)))
    }

    fn seed(&mut self, world: &World, state: &Values, open: &[u32]) -> Result<(), Failure> {
        self.costs.fill(f64::INFINITY);
        self.supporters.fill((NOBODY, 1.0));
        self.queue.clear();
        self.operator_costs.fill(0.0);
        for (index, operator) in self.operators.iter().enumerate() {
            self.open_needs[index] = operator.needs.len() as u32;
        }
        for (variable, &value) in state.values.iter().enumerate() {
            self.reach(self.offsets[variable] + value, 0.0, NOBODY, 1.0);
        }
        let moment = Moment { state, duration_s: 0.0, proposal: None, level: Level::Relaxed };
        for index in 0..self.tests.len() {
            let holds = match self.tests[index] {
                Test::Comparison(comparison) => world.compare(comparison, &moment)?,
                Test::Call(call, wanted) => world.calls.truth(call, None, state, Level::Relaxed)? == wanted,
            };
            if holds {
                self.reach(self.test_base + index as u32, 0.0, NOBODY, 1.0);
            }
        }
        for &act in open {
            self.reach(self.token_base + act, 0.0, NOBODY, 1.0);
        }
        for operator in 0..self.operators.len() {
            if self.operators[operator].needs.is_empty() {
                self.fire(world, state, operator as u32)?;
            }
        }
        Ok(())
    }

    fn reach(&mut self, proposition: u32, cost: f64, supporter: u32, times: f64) {
        if cost < self.costs[proposition as usize] {
            self.costs[proposition as usize] = cost;
            self.supporters[proposition as usize] = (supporter, times);
            self.queue.push(Reverse((Key(cost), proposition)));
        }
    }

    /// Everything that the operator needs is reached.
    fn fire(&mut self, world: &World, state: &Values, index: u32) -> Result<(), Failure> {
        let before = self.operator_costs[index as usize];
        let operator = &self.operators[index as usize];
        let useful =
            operator.gives.iter().chain(&operator.moves).any(|&given| self.costs[given as usize] > before);
        if !useful {
            return Ok(());
        }
        for &(call, wanted) in &operator.gates {
            if world.calls.truth(call, None, state, Level::Relaxed)? != wanted {
                return Ok(());
            }
        }
        let Some(own) = self.own_cost(world, state, index)? else { return Ok(()) };
        self.operator_costs[index as usize] = own;
        for position in 0..self.operators[index as usize].gives.len() {
            self.reach(self.operators[index as usize].gives[position], before + own, index, 1.0);
        }
        for position in 0..self.operators[index as usize].moves.len() {
            let test = self.operators[index as usize].moves[position];
            if self.costs[test as usize] > before + own
                && let Some(times) = self.repetitions(world, state, index, test)?
            {
                self.reach(test, before + own * times, index, times);
            }
        }
        Ok(())
    }

    /// Seconds that the operator takes plus a share for being a step at all; `None` if it cannot be applied.
    fn own_cost(&self, world: &World, state: &Values, index: u32) -> Result<Option<f64>, Failure> {
        let operator = &self.operators[index as usize];
        if operator.part == Part::Free {
            return Ok(Some(0.0));
        }
        let step = if operator.part == Part::Whole { self.unit } else { self.unit * 0.5 };
        if let Some(cost) = operator.cost {
            return Ok(Some(cost + step));
        }
        let act = &world.acts[operator.act as usize];
        let proposal = first_proposal(world, state, operator.act)?;
        if !act.grounding.is_empty() && proposal.is_none() {
            return Ok(None);
        }
        let moment = Moment { state, duration_s: 0.0, proposal: proposal.as_ref(), level: Level::Relaxed };
        let share = if operator.part == Part::Whole { 1.0 } else { 0.5 };
        Ok(world.span(act, &moment)?.map(|span| span.least_s * share + step))
    }

    /// How often the operator must be repeated from the state to make a test true; `None` if it cannot help.
    fn repetitions(
        &self,
        world: &World,
        state: &Values,
        index: u32,
        test: u32,
    ) -> Result<Option<f64>, Failure> {
        let operator = &self.operators[index as usize];
        let after = effects_alone(world, state, operator)?;
        let Some(after) = after else { return Ok(None) };
        let moment = Moment { state: &after, duration_s: 0.0, proposal: None, level: Level::Relaxed };
        match self.tests[(test - self.test_base) as usize] {
            Test::Call(call, wanted) => {
                let holds = world.calls.truth(call, None, &after, Level::Relaxed)? == wanted;
                Ok(Some(if holds { 1.0 } else { UNSURE }))
            }
            Test::Comparison(comparison) => {
                if world.compare(comparison, &moment)? {
                    return Ok(Some(1.0));
                }
                let comparison = &world.ground.comparisons[comparison as usize];
                let now = Moment { state, ..moment };
                let gap = |moment: &Moment| -> Result<f64, Failure> {
                    Ok((world.evaluate(&comparison.left, moment)?
                        - world.evaluate(&comparison.right, moment)?)
                    .abs())
                };
                let (before, after) = (gap(&now)?, gap(&moment)?);
                if before.is_nan() {
                    return Ok((!after.is_nan()).then_some(UNSURE));
                }
                if after < before {
                    return Ok(Some((before / (before - after)).ceil().clamp(1.0, 1e6)));
                }
                let certain = self.changes_by_constants(world, operator);
                Ok((!certain).then_some(UNSURE))
            }
        }
    }

    /// Whether the operator does to numbers the same in every state.
    fn changes_by_constants(&self, world: &World, operator: &Operator) -> bool {
        let Some(act) = world.acts.get(operator.act as usize) else { return false };
        act.start_effects.iter().chain(&act.end_effects).all(|effect| match &effect.outcome {
            Outcome::Set(_) => true,
            Outcome::Change { amount, change, .. } => {
                use crate::ground::Change;
                matches!(change, Change::Increase | Change::Decrease)
                    && matches!(amount, Expression::Constant(_))
            }
            Outcome::Flow { .. } | Outcome::Call(_) => false,
        }) && act.flow_effects.is_empty()
    }

    fn extract(&self, world: &World, goal: &[u32]) -> Estimate {
        let mut estimate = Estimate::default();
        let mut seen = vec![false; self.costs.len()];
        let mut times_of: Vec<(u32, f64)> = Vec::new();
        let mut agenda: Vec<u32> = goal.to_vec();
        while let Some(proposition) = agenda.pop() {
            if std::mem::replace(&mut seen[proposition as usize], true) {
                continue;
            }
            let (supporter, times) = self.supporters[proposition as usize];
            if supporter == NOBODY {
                continue;
            }
            match times_of.iter_mut().find(|(known, _)| *known == supporter) {
                Some((_, most)) => *most = most.max(times),
                None => times_of.push((supporter, times)),
            }
            agenda.extend(&self.operators[supporter as usize].needs);
        }
        let mut counted: Vec<(u32, Part)> = Vec::new();
        for &(index, times) in &times_of {
            let operator = &self.operators[index as usize];
            if operator.part == Part::Free {
                continue;
            }
            let own = (operator.act, operator.part);
            if counted.contains(&own) {
                continue;
            }
            counted.push(own);
            estimate.cost += self.operator_costs[index as usize] * times;
            estimate.steps += times;
            if operator.needs.iter().all(|&need| self.costs[need as usize] == 0.0) {
                estimate.preferred.push(own);
            }
        }
        estimate.preferred.sort_unstable();
        let _ = world;
        estimate
    }
}

/// Stands for "perhaps, after other changes": how much dearer such support counts.
const UNSURE: f64 = 3.0;

fn first_proposal(world: &World, state: &Values, act: u32) -> Result<Option<Arc<str>>, Failure> {
    let Some(act) = world.acts.get(act as usize) else { return Ok(None) };
    let Some((module, arguments)) = act.grounding.first() else { return Ok(None) };
    Ok(world.calls.proposals(*module, arguments, &act.origin.arguments, state)?.into_iter().next())
}

/// The state after the operator's effects, whatever it needs.
fn effects_alone(world: &World, state: &Values, operator: &Operator) -> Result<Option<Values>, Failure> {
    let Some(act) = world.acts.get(operator.act as usize) else { return Ok(Some(state.clone())) };
    let proposal = first_proposal(world, state, operator.act)?;
    if !act.grounding.is_empty() && proposal.is_none() {
        return Ok(None);
    }
    let before = Moment { state, duration_s: 0.0, proposal: proposal.as_ref(), level: Level::Relaxed };
    let duration_s = world.span(act, &before)?.map_or(0.0, |span| span.least_s);
    let mut after = state.clone();
    let lists = match operator.part {
        Part::Whole => vec![&act.start_effects, &act.flow_effects, &act.end_effects],
        Part::Start => vec![&act.start_effects],
        Part::End | Part::Free => vec![&act.flow_effects, &act.end_effects],
    };
    for effects in lists {
        let from = after.clone();
        let moment = Moment { state: &from, duration_s, proposal: proposal.as_ref(), level: Level::Relaxed };
        if !world.apply(effects, &moment, &|_, _| true, &mut after)? {
            return Ok(None);
        }
    }
    Ok(Some(after))
}

/// Conditions taken together.
#[derive(Debug, Clone, Default, PartialEq)]
struct Merged {
    facts: Vec<Fact>,
    comparisons: Vec<ComparisonId>,
    calls: Vec<(CallId, bool)>,
}

impl Merged {
    fn of(parts: &[&Conjunction]) -> Merged {
        let mut merged = Merged::default();
        for part in parts {
            merged.facts.extend(&part.facts);
            merged.comparisons.extend(&part.comparisons);
            merged.calls.extend(&part.calls);
        }
        merged.facts.sort_unstable();
        merged.facts.dedup();
        merged
    }
}

fn needs_at_start(act: &super::world::Act, given: &[crate::ground::Effect]) -> Merged {
    let given = |fact: &Fact| given.iter().any(|effect| effect.outcome == Outcome::Set(*fact));
    let mut merged = Merged::of(&[&act.at_start]);
    merged.facts.extend(act.over_all.facts.iter().filter(|fact| !given(fact)));
    merged.facts.sort_unstable();
    merged.facts.dedup();
    merged
}

fn needs_of_whole(act: &super::world::Act) -> Merged {
    let mut merged = needs_at_start(act, &act.start_effects);
    let given = |fact: &Fact| act.start_effects.iter().any(|effect| effect.outcome == Outcome::Set(*fact));
    merged.facts.extend(act.at_end.facts.iter().filter(|fact| !given(fact)));
    merged.facts.sort_unstable();
    merged.facts.dedup();
    merged.calls.extend(&act.over_all.calls);
    merged.calls.extend(&act.at_end.calls);
    merged
}

/// The duration of an action if it is the same in every state, in seconds.
fn constant_seconds(world: &World, act: usize) -> Option<f64> {
    let act = &world.acts[act];
    if !act.durative {
        return Some(0.0);
    }
    let mut least_s: Option<f64> = None;
    for bound in act.bounds.iter().filter(|bound| !bound.at_end) {
        let Expression::Constant(seconds) = bound.seconds else { return None };
        use crate::ground::Relation;
        if matches!(bound.relation, Relation::Equal | Relation::AtLeast | Relation::Greater) {
            least_s = Some(least_s.unwrap_or(0.0).max(seconds));
        }
    }
    Some(least_s.unwrap_or(0.0))
}
