//! Delete-relaxed task of the temporal search: operators over propositions.
//!
//! Numeric conditions, and calls whose answer depends on the state, are *tests*: propositions whose
//! truth is evaluated in the state. Every operator that changes something that a test reads may make it
//! true.

use rustc_hash::FxHashMap;

use crate::attachment::CallKind;
use crate::ground::{
    CallId, ComparisonId, Conjunction, GroundEffect, GroundExpression, GroundFact, GroundOutcome, NumericId,
    Place, Relation,
};
use crate::grouped::Grouped;

use super::advance::Part;
use super::direction::may_help;
use super::envelope::settled;
use super::estimate::Work;
use super::space::Space;
use super::touch::Touched;
use super::world::{Act, World};

/// Proposition whose truth is evaluated: a comparison, or a call with the wanted answer.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub(super) enum Test {
    Comparison(ComparisonId),
    Call(CallId, bool),
}

#[derive(Debug, Clone)]
pub(super) struct Operator {
    pub(super) act: u32,
    pub(super) part: Part,
    pub(super) needs: Vec<u32>,
    pub(super) gives: Vec<u32>,
    /// Tests that the operator's effects may make true.
    pub(super) moves: Vec<u32>,
    /// Calls that are no tests; asked once all preconditions are reached.
    pub(super) gates: Vec<(CallId, bool)>,
    /// Minimum duration, if it is the same in every state.
    pub(super) seconds: Seconds,
}

/// Data of an operator that every evaluation reads, close together in memory.
#[derive(Debug, Clone, Copy)]
pub(super) struct Hot {
    /// Index in [`Relaxed::given`] of the operator's first effect.
    pub(super) gives: u32,
    /// Index in [`Relaxed::given`] behind the effects, where the tests begin that the operator may make
    /// true.
    pub(super) moves: u32,
    /// Index in [`Relaxed::given`] behind the tests that the operator may make true.
    pub(super) end: u32,
    /// Number of preconditions.
    pub(super) needs: u32,
    /// True if the operator's applicability depends on no attachment.
    pub(super) plain: bool,
    /// Duration, in seconds; infinite if the action is never applicable, NaN while unknown or if it
    /// depends on the state.
    pub(super) seconds: f64,
    /// Cost of one step, apart from its duration, in seconds.
    pub(super) step: f64,
}

impl Hot {
    /// True if the operator's applicability depends on no attachment and its duration is known.
    pub(super) fn is_known(&self) -> bool {
        self.plain && !self.seconds.is_nan()
    }

    /// Lower bound on the operator's cost, in time (`timed`) or in summed costs; durations count as 0
    /// while unknown.
    pub(super) fn least(&self, timed: bool) -> f64 {
        self.seconds.max(0.0) + if timed { 0.0 } else { self.step }
    }
}

/// An operator that has a certain proposition as precondition.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Waiter {
    pub(super) operator: u32,
    /// Only effect of the operator; [`NOBODY`] if there are several or none.
    pub(super) target: u32,
    /// Duration as far as known, in seconds; 0 while unknown.
    pub(super) seconds: f64,
    /// Cost of one step, apart from its duration, in seconds.
    pub(super) step: f64,
}

/// Minimum duration of an operator.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Seconds {
    /// The same in every state, in seconds; infinite if the action is never applicable.
    Known(f64),
    /// The same in every state, but unknown until it has been evaluated.
    Settled,
    /// Depends on the state.
    Depends,
}

impl Seconds {
    /// This duration; zero instead if `zero` is true and the duration does not depend on the state.
    fn or_zero(self, zero: bool) -> Seconds {
        if zero && self != Seconds::Depends { Seconds::Known(0.0) } else { self }
    }
}

/// Relaxed task, with the working memory of its heuristic.
pub(crate) struct Relaxed {
    pub(super) offsets: Vec<u32>,
    pub(super) tests: Vec<Test>,
    /// Proposition of each test.
    test_index: FxHashMap<Test, u32>,
    /// True, by test, if an operator or the goal has the test as precondition.
    pub(super) asked: Vec<bool>,
    /// Variables and numbers that each test reads, as indices of resources.
    pub(super) test_reads: Vec<Vec<u32>>,
    /// Tests that read each resource.
    tests_on: Vec<Vec<u32>>,
    pub(super) test_base: u32,
    /// Propositions "is running" and "is not running" of each action with separate start and end.
    pub(super) tokens: FxHashMap<u32, (u32, u32)>,
    /// First proposition about running actions.
    pub(super) token_base: u32,
    pub(super) operators: Vec<Operator>,
    pub(super) hot: Vec<Hot>,
    /// Effects and possibly satisfied tests of all operators, one operator after the other.
    pub(super) given: Vec<u32>,
    /// Operators that have a proposition as precondition, by proposition.
    pub(super) needed_by: Grouped<Waiter>,
    pub(super) goal: Vec<u32>,
    pub(super) goal_gates: Vec<(CallId, bool)>,
    /// Mean duration of the operators in seconds, which is also the cost of one step.
    pub(super) unit: f64,
    /// Contribution of each action to the plan measure apart from the makespan, in equivalent seconds
    /// of makespan.
    pub(super) counted: Vec<Option<GroundExpression>>,
    /// Operators without preconditions.
    pub(super) free: Vec<u32>,
    pub(super) work: Work,
    /// Buffer for what an operator under construction changes.
    touched: Touched,
}

pub(super) const NOBODY: u32 = u32::MAX;

impl Relaxed {
    /// Relaxed task of a search space.
    pub fn new(space: &Space) -> Relaxed {
        let (world, open_act) = (space.world, &space.open_act);
        let mut relaxed = Relaxed { counted: space.measure.counted(world), ..Relaxed::empty(world) };
        let apart = (0..world.acts.len() as u32).filter(|&act| open_act[act as usize]);
        let base = relaxed.token_base;
        relaxed.tokens =
            apart.zip(0..).map(|(act, rank)| (act, (base + 2 * rank, base + 2 * rank + 1))).collect();
        for (index, act) in world.acts.iter().enumerate() {
            let act_index = index as u32;
            let seconds = seconds_of(world, index);
            if let Some(&(open, closed)) = relaxed.tokens.get(&act_index) {
                let before = needs_at_start(world, act);
                relaxed.operator(
                    world,
                    act_index,
                    Part::Start,
                    &before,
                    &[],
                    seconds.or_zero(matches!(seconds, Seconds::Known(_))),
                );
                relaxed.give(act_index, Part::Start, open);
                let before = Merged::of(&[act.at_end]);
                relaxed.operator(world, act_index, Part::End, &before, &[open], seconds);
                relaxed.give(act_index, Part::End, closed);
            } else {
                let before = needs_of_whole(world, act);
                relaxed.operator(world, act_index, Part::Whole, &before, &[], seconds);
            }
        }
        relaxed.axioms_and_timed(world);
        relaxed.goal =
            relaxed.propositions(&world.ground.goal.facts, &world.ground.goal.comparisons).collect();
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
        let plain = plain_calls(world);
        let changing = (0..world.ground.calls.len() as u32).filter(|&call| {
            let (variables, numbers) = world.calls.reads(call);
            let condition = plain[call as usize] && world.calls.kind(call) == CallKind::Condition;
            condition && !(variables.is_empty() && numbers.is_empty())
        });
        let calls = changing.flat_map(|call| [Test::Call(call, true), Test::Call(call, false)]);
        let tests: Vec<Test> = comparisons.chain(calls).collect();
        let token_base = next + tests.len() as u32;
        let numbered = tests.iter().enumerate().map(|(index, &test)| (test, next + index as u32));
        let test_index: FxHashMap<Test, u32> = numbered.collect();
        let mut test_reads = Vec::with_capacity(tests.len());
        let mut tests_on = vec![Vec::new(); world.ground.variables.len() + world.ground.numerics.len()];
        for (index, test) in tests.iter().enumerate() {
            let mut touched = Touched::default();
            match test {
                Test::Comparison(comparison) => touched.comparison(world, *comparison),
                Test::Call(call, _) => touched.call(world, *call),
            }
            let resources = touched.resources(offsets.len());
            resources.iter().for_each(|&resource| tests_on[resource as usize].push(next + index as u32));
            test_reads.push(resources);
        }
        Relaxed {
            offsets,
            test_base: next,
            tokens: FxHashMap::default(),
            token_base,
            test_index,
            tests_on,
            asked: vec![false; tests.len()],
            test_reads,
            tests,
            operators: Vec::new(),
            hot: Vec::new(),
            given: Vec::new(),
            needed_by: Grouped::default(),
            goal: Vec::new(),
            goal_gates: Vec::new(),
            unit: 1.0,
            counted: Vec::new(),
            free: Vec::new(),
            work: Work::default(),
            touched: Touched::default(),
        }
    }

    /// Work done since the last call of this function.
    pub(super) fn spent(&mut self) -> u64 {
        std::mem::take(&mut self.work.spent)
    }

    fn test_of(&self, wanted: Test) -> Option<u32> {
        self.test_index.get(&wanted).copied()
    }

    /// True if a test reads a number.
    pub(super) fn is_tested(&self, number: NumericId) -> bool {
        !self.tests_on[self.offsets.len() + number as usize].is_empty()
    }

    fn fact(&self, fact: GroundFact) -> u32 {
        self.offsets[fact.variable as usize] + fact.value
    }

    /// Adds the facts that an outcome may make true; for an effect module, all values of the variables
    /// that it writes.
    fn given(&self, world: &World, outcome: &GroundOutcome, into: &mut Vec<u32>) {
        match outcome {
            GroundOutcome::Set(fact) => into.push(self.fact(*fact)),
            GroundOutcome::Call(call) => {
                for place in &world.ground.calls[*call as usize].writes {
                    if let Place::Truth(variable) | Place::Object(variable) = place {
                        let values = world.ground.variables[*variable as usize].domain_size();
                        let first = self.offsets[*variable as usize];
                        into.extend(first..first + values);
                    }
                }
            }
            GroundOutcome::Change { .. } | GroundOutcome::Flow { .. } => {}
        }
    }

    fn propositions(&self, facts: &[GroundFact], comparisons: &[ComparisonId]) -> impl Iterator<Item = u32> {
        let facts = facts.iter().map(|&fact| self.fact(fact));
        facts.chain(comparisons.iter().map(|&comparison| self.test_base + comparison))
    }

    /// Adds relaxed operators for one part of an action: one for its unconditional effects, and one for
    /// each condition of its other effects.
    fn operator(
        &mut self,
        world: &World,
        act: u32,
        part: Part,
        before: &Merged,
        tokens: &[u32],
        seconds: Seconds,
    ) {
        let action = &world.acts[act as usize];
        let lists: [&[GroundEffect]; 3] = match part {
            Part::Whole => [action.start_effects, action.flow_effects, action.end_effects],
            Part::Start => [action.start_effects, &[], &[]],
            Part::End | Part::Free => [action.flow_effects, action.end_effects, &[]],
        };
        let effects = lists.into_iter().flatten();
        let plain = effects.clone().filter(|effect| effect.when.is_none());
        let plain: Vec<&GroundOutcome> = plain.map(|effect| &effect.outcome).collect();
        self.under(world, (act, part), (before, &Merged::default()), tokens, seconds, &plain);
        let mut groups: Vec<(Merged, Vec<&GroundOutcome>)> = Vec::new();
        for effect in effects {
            let Some(when) = &effect.when else { continue };
            let extra = Merged::of(&[&when.here, &when.at_start, &when.over_all]);
            match groups.iter_mut().find(|(known, _)| *known == extra) {
                Some((_, outcomes)) => outcomes.push(&effect.outcome),
                None => groups.push((extra, vec![&effect.outcome])),
            }
        }
        for (extra, outcomes) in &groups {
            self.under(world, (act, part), (before, extra), tokens, seconds, outcomes);
        }
    }

    /// Adds the relaxed operator for the effects under one condition.
    fn under(
        &mut self,
        world: &World,
        (act, part): (u32, Part),
        (before, extra): (&Merged, &Merged),
        tokens: &[u32],
        seconds: Seconds,
        outcomes: &[&GroundOutcome],
    ) {
        let action = &world.acts[act as usize];
        let mut needs = Vec::with_capacity(before.facts.len() + before.calls.len() + tokens.len());
        for part in [before, extra] {
            needs.extend(self.propositions(&part.facts, &part.comparisons));
        }
        needs.extend(tokens);
        let mut gates = Vec::new();
        for &(call, wanted) in before.calls.iter().chain(&extra.calls) {
            // Calls that get a proposed parameter are asked with it, when all else is reached.
            let test = self.test_of(Test::Call(call, wanted)).filter(|_| action.grounding.is_empty());
            match test {
                Some(test) => needs.push(test),
                None => gates.push((call, wanted)),
            }
        }
        needs.sort_unstable();
        needs.dedup();
        let mut gives = Vec::with_capacity(outcomes.len());
        outcomes.iter().for_each(|outcome| self.given(world, outcome, &mut gives));
        let mut moves = self.tests_touched(world, outcomes);
        moves.retain(|&test| match self.tests[(test - self.test_base) as usize] {
            Test::Comparison(comparison) => may_help(world, outcomes, comparison),
            Test::Call(..) => true,
        });
        self.operators.push(Operator { act, part, needs, gives, moves, gates, seconds });
    }

    /// Adds the proposition `token` to the effects of all operators just added for one part of an
    /// action.
    fn give(&mut self, act: u32, part: Part, token: u32) {
        let own = self.operators.iter_mut().rev().take_while(|operator| operator.act == act);
        own.filter(|operator| operator.part == part).for_each(|operator| operator.gives.push(token));
    }

    fn tests_touched(&mut self, world: &World, outcomes: &[&GroundOutcome]) -> Vec<u32> {
        let touched = &mut self.touched;
        touched.clear();
        outcomes.iter().for_each(|outcome| touched.outcome(world, outcome));
        let numbers = touched.numbers.iter().map(|&number| self.offsets.len() + number as usize);
        let resources = touched.variables.iter().map(|&variable| variable as usize).chain(numbers);
        let mut tests: Vec<u32> =
            resources.flat_map(|resource| self.tests_on[resource].iter().copied()).collect();
        tests.sort_unstable();
        tests.dedup();
        tests
    }

    fn axioms_and_timed(&mut self, world: &World) {
        for axiom in &world.ground.axioms {
            let mut needs: Vec<u32> = self.propositions(&axiom.body.facts, &axiom.body.comparisons).collect();
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
                seconds: Seconds::Known(0.0),
            });
        }
        // Anything not derived may be absent: negated conditions on derived facts count as reachable.
        for (variable, declared) in world.ground.variables.iter().enumerate() {
            if declared.stratum.is_some() {
                let gives = vec![self.fact(GroundFact { variable: variable as u32, value: 1 })];
                let (part, seconds) = (Part::Free, Seconds::Known(0.0));
                let nothing = Operator {
                    act: NOBODY,
                    part,
                    needs: vec![],
                    gives,
                    moves: vec![],
                    gates: vec![],
                    seconds,
                };
                self.operators.push(nothing);
            }
        }
        for timed in &world.ground.timed {
            let moves = self.tests_touched(world, &timed.outcomes.iter().collect::<Vec<_>>());
            let mut gives = Vec::new();
            timed.outcomes.iter().for_each(|outcome| self.given(world, outcome, &mut gives));
            let part = Part::Free;
            self.operators.push(Operator {
                act: NOBODY,
                part,
                needs: vec![],
                gives,
                moves,
                gates: vec![],
                seconds: Seconds::Known(0.0),
            });
        }
    }

    fn finish(&mut self, world: &World) {
        let count = self.token_base as usize + 2 * self.tokens.len();
        let needs = self.operators.iter().flat_map(|operator| &operator.needs).chain(&self.goal);
        for &need in needs.filter(|&&need| (self.test_base..self.token_base).contains(&need)) {
            self.asked[(need - self.test_base) as usize] = true;
        }
        let known = self.operators.iter().filter_map(|operator| match operator.seconds {
            Seconds::Known(seconds) if seconds > 0.0 => Some(seconds),
            _ => None,
        });
        let known: Vec<f64> = known.collect();
        let mean = known.iter().sum::<f64>() / known.len().max(1) as f64;
        self.unit = if mean.is_finite() && mean > 0.0 { mean } else { 1.0 };
        // What nobody needs does not count as given.
        let mut needed = vec![false; count];
        let needs = self.operators.iter().flat_map(|operator| &operator.needs).chain(&self.goal);
        needs.for_each(|&need| needed[need as usize] = true);
        self.tokens.values().for_each(|&(_, closed)| needed[closed as usize] = true);
        for operator in &self.operators {
            let gives = self.given.len() as u32;
            self.given.extend(operator.gives.iter().filter(|&&given| needed[given as usize]));
            let moves = self.given.len() as u32;
            self.given.extend(operator.moves.iter().filter(|&&moved| needed[moved as usize]));
            let grounding =
                world.acts.get(operator.act as usize).is_some_and(|act| !act.grounding.is_empty());
            let seconds = match operator.seconds {
                Seconds::Known(seconds) => seconds,
                Seconds::Settled | Seconds::Depends => f64::NAN,
            };
            let step = match operator.part {
                Part::Whole => self.unit,
                Part::Start | Part::End => self.unit * 0.5,
                Part::Free => 0.0,
            };
            let plain = operator.gates.is_empty() && !grounding;
            let needs = operator.needs.len() as u32;
            let end = self.given.len() as u32;
            self.hot.push(Hot { gives, moves, end, needs, plain, seconds, step });
        }
        self.index_needs(count);
        let free = self.operators.iter().enumerate().filter(|(_, operator)| operator.needs.is_empty());
        self.free = free.map(|(index, _)| index as u32).collect();
        self.work = Work::new(count, self.operators.len());
    }

    /// Lists operators by precondition. Those that depend on attachments come last, as their effects
    /// may be reached otherwise by then.
    fn index_needs(&mut self, propositions: usize) {
        let waiter = |hot: &Hot, operator: usize| {
            let target = match self.given[hot.gives as usize..hot.end as usize] {
                [only] => only,
                _ => NOBODY,
            };
            Waiter { operator: operator as u32, target, seconds: hot.seconds.max(0.0), step: hot.step }
        };
        let waiters = [true, false].into_iter().flat_map(|known| {
            let all = self.hot.iter().enumerate().filter(move |(_, hot)| hot.is_known() == known);
            all.flat_map(|(index, hot)| {
                let waiter = waiter(hot, index);
                self.operators[index].needs.iter().map(move |&need| (need, waiter))
            })
        });
        self.needed_by = Grouped::new(propositions, waiters);
    }
}

/// True, by call, if some condition uses it without a proposed argument.
fn plain_calls(world: &World) -> Vec<bool> {
    let mut plain = vec![false; world.ground.calls.len()];
    let mut note = |condition: &Conjunction| {
        condition.calls.iter().for_each(|&(call, _)| plain[call as usize] = true);
    };
    for act in world.acts.iter().filter(|act| act.grounding.is_empty()) {
        [act.at_start, act.over_all, act.at_end].into_iter().for_each(&mut note);
        for when in act.start_effects.iter().chain(act.end_effects).filter_map(|effect| effect.when.as_ref())
        {
            [&when.here, &when.at_start, &when.over_all].into_iter().for_each(&mut note);
        }
    }
    world.ground.axioms.iter().for_each(|axiom| note(&axiom.body));
    note(&world.ground.goal);
    plain
}

/// Several conditions combined.
#[derive(Debug, Clone, Default, PartialEq)]
struct Merged {
    facts: Vec<GroundFact>,
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

/// True if the start of an action may itself make a fact true that is needed later.
fn may_give(world: &World, act: &Act, fact: &GroundFact) -> bool {
    let derived = world.ground.variables[fact.variable as usize].stratum.is_some();
    let gives = |effect: &GroundEffect| effect.outcome == GroundOutcome::Set(*fact);
    derived && !act.start_effects.is_empty() || act.start_effects.iter().any(gives)
}

/// True if an action changes something that a call reads, at its start or continuously.
fn may_turn(world: &World, act: &Act, call: CallId) -> bool {
    let (mut read, mut written) = (Touched::default(), Touched::default());
    read.call(world, call);
    act.start_effects
        .iter()
        .chain(act.flow_effects)
        .for_each(|effect| written.outcome(world, &effect.outcome));
    written.meets(&read)
}

fn needs_at_start(world: &World, act: &Act) -> Merged {
    let mut merged = Merged::of(&[act.at_start]);
    merged.facts.extend(act.over_all.facts.iter().filter(|fact| !may_give(world, act, fact)));
    merged.facts.sort_unstable();
    merged.facts.dedup();
    merged
}

fn needs_of_whole(world: &World, act: &Act) -> Merged {
    let mut merged = needs_at_start(world, act);
    merged.facts.extend(act.at_end.facts.iter().filter(|fact| !may_give(world, act, fact)));
    merged.facts.sort_unstable();
    merged.facts.dedup();
    let calls = act.over_all.calls.iter().chain(&act.at_end.calls);
    merged.calls.extend(calls.filter(|(call, _)| !may_turn(world, act, *call)));
    merged
}

/// Minimum duration of an action, if it is the same in every state.
fn seconds_of(world: &World, act: usize) -> Seconds {
    let act = &world.acts[act];
    if !act.durative {
        return Seconds::Known(0.0);
    }
    let bounds = act.bounds.iter().filter(|bound| !bound.at_end);
    if !bounds.clone().all(|bound| settled(world, &bound.seconds)) || !act.grounding.is_empty() {
        return Seconds::Depends;
    }
    let mut least_s: f64 = 0.0;
    for bound in bounds {
        let GroundExpression::Constant(seconds) = bound.seconds else { return Seconds::Settled };
        if matches!(bound.relation, Relation::Equal | Relation::AtLeast | Relation::Greater) {
            least_s = least_s.max(seconds);
        }
    }
    if act.share > 0.0 { Seconds::Settled } else { Seconds::Known(least_s) }
}
