//! The order in which searches are tried, and the improvement of what they find.

use tracing::debug_span;

use crate::classical::compiled::Compiled;
use crate::classical::successor::Successors;
use crate::ground::GroundTask;
use crate::heuristics::landmarks::Landmarks;
use crate::heuristics::relaxed::Counting;
use crate::memory::MemoryLimit;

use super::improve::Improve;
use super::lazy::{self, Allowed, Counts, End, Shared, Strategy, search};
use super::novelty;

/// How a classical task is to be solved.
#[derive(Clone, Debug)]
pub(crate) struct ClassicalOptions {
    /// Keep improving until stopped or nothing cheaper is left.
    pub anytime: bool,
    /// A first plan leaves undone what nobody must do: search on for as long as improving it may take.
    pub soft: bool,
    /// Only plans whose cost is below this.
    pub bound: Option<f64>,
    /// What the search may take.
    pub memory: MemoryLimit,
    /// States to evaluate at most.
    pub evaluation_limit: Option<u64>,
}

/// How it ended.
#[derive(Clone, Debug)]
pub(crate) struct ClassicalOutcome {
    /// Why it ended.
    pub end: ClassicalEnd,
    /// States evaluated.
    pub evaluated: u64,
    /// States expanded.
    pub expanded: u64,
    /// Work done, as the heuristics count it.
    pub work: u64,
}

/// Why a classical search ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum ClassicalEnd {
    /// With what was asked for.
    Done,
    /// The search space is exhausted: there is no plan, or none that is cheaper.
    Exhausted,
    /// Stopped from outside or by the evaluation limit.
    Stopped,
    /// Out of memory.
    Memory,
}

/// Solves a task that is [`crate::classical::compiled::is_classical`].
pub(crate) fn solve(
    ground: &GroundTask,
    options: &ClassicalOptions,
    stop: &(dyn Fn() -> bool + Sync),
    on_plan: &mut dyn FnMut(&[u32], f64),
) -> ClassicalOutcome {
    let _span = debug_span!("classical").entered();
    let stopped = ClassicalOutcome { end: ClassicalEnd::Stopped, evaluated: 0, expanded: 0, work: 0 };
    let task = Compiled::new(ground);
    if stop() {
        return stopped;
    }
    let successors = Successors::new(&task);
    if stop() {
        return stopped;
    }
    let landmarks = debug_span!("landmarks").in_scope(|| Landmarks::new(&task, &ground.mutex_groups, stop));
    let shared =
        Shared { task: &task, successors: &successors, landmarks: &landmarks, memory: options.memory, stop };
    let bound = options.bound.filter(|_| task.measure.is_sum()).map_or(u32::MAX, |bound| task.scaled(bound));
    let mut run = Run {
        task: &task,
        shared: &shared,
        options,
        counts: Counts::default(),
        bound,
        best: None,
        plans: 0,
        on_plan,
    };
    let end = run.all();
    tracing::debug!(landmarks = landmarks.len(), run.counts.evaluated, run.counts.work);
    ClassicalOutcome {
        end,
        evaluated: run.counts.evaluated,
        expanded: run.counts.expanded,
        work: run.counts.work,
    }
}

/// Work that every plan is improved for, however small the task.
const LEAST_WORK: u64 = 5_000_000;
/// Further work for each operator.
const WORK_PER_OPERATOR: u64 = 1500;
/// How much more than that the search for plans that keep more preferences may take.
const SOFT_SHARE: u64 = 20;
/// Work of the first search before another is tried; later rounds get more.
const FIRST_WORK: u64 = 60_000_000;
/// How much more work each round of first searches gets.
const ROUND_FACTOR: u64 = 3;
/// Weights of the searches for better plans, one after another (Richter and Westphal 2010).
const WEIGHTS: [u32; 4] = [5, 3, 2, 1];

const GREEDY: Strategy = Strategy {
    weight: None,
    counting: Counting::CostAndSteps,
    lookahead: true,
    newest: false,
    landmarks: true,
    bound: u32::MAX,
    work_limit: u64::MAX,
    evaluation_limit: u64::MAX,
};

/// The searches for a first plan in the order of their turns, two rounds: with lookahead, by novelty, plainly; every other
/// round those that order states by estimates take the newest of equally good ones first.
const ORDER: [usize; 6] = [0, NOVELTY, PLAIN, 1, NOVELTY, PLAIN + 1];
/// Place of the search by novelty.
const NOVELTY: usize = 2;
/// Places of the searches without lookahead begin here.
const PLAIN: usize = 3;

/// A search for a first plan that can be gone on with.
enum Kept<'a, 's> {
    Lazy(Box<lazy::Search<'a, 's>>),
    Novelty(Box<novelty::Search<'a, 's>>),
}

impl<'a, 's> Kept<'a, 's> {
    fn new(shared: &'s Shared<'a>, place: usize, bound: u32) -> Self {
        if place == NOVELTY {
            return Kept::Novelty(Box::new(novelty::Search::new(shared, bound)));
        }
        let (lookahead, newest) = (place < NOVELTY, matches!(place, 1 | 4));
        Kept::Lazy(Box::new(lazy::Search::new(shared, Strategy { bound, lookahead, newest, ..GREEDY })))
    }

    fn run(&mut self, allowed: Allowed) -> End {
        match self {
            Kept::Lazy(search) => search.run(allowed),
            Kept::Novelty(search) => search.run(allowed),
        }
    }

    fn counts(&self) -> Counts {
        match self {
            Kept::Lazy(search) => search.counts(),
            Kept::Novelty(search) => search.counts(),
        }
    }

    fn bytes(&self) -> usize {
        match self {
            Kept::Lazy(search) => search.bytes(),
            Kept::Novelty(search) => search.bytes(),
        }
    }
}

struct Run<'a, 's> {
    task: &'a Compiled,
    shared: &'s Shared<'a>,
    options: &'s ClassicalOptions,
    counts: Counts,
    /// Only cheaper plans (in the search's costs) are of interest.
    bound: u32,
    best: Option<Vec<u32>>,
    /// Plans taken, each better than the one before.
    plans: u64,
    on_plan: &'s mut dyn FnMut(&[u32], f64),
}

impl<'a, 's> Run<'a, 's> {
    fn all(&mut self) -> ClassicalEnd {
        let (plan, plain_too) = match self.first() {
            Ok(found) => found,
            Err(end) => return end,
        };
        let budget = LEAST_WORK + WORK_PER_OPERATOR * self.task.operators() as u64;
        let mut plan = plan;
        if plain_too {
            let bound = self.bound.min(self.task.search_cost(&plan));
            let strategy = Strategy { lookahead: false, bound, work_limit: budget / 2, ..GREEDY };
            if let End::Plan(other) = self.search(strategy) {
                plan = other;
            }
        }
        let first = if self.options.anytime { u64::MAX } else { budget };
        self.improve(plan, first);
        if self.best.is_none() {
            return ClassicalEnd::Stopped;
        }
        if self.limited() || (self.shared.stop)() {
            return if self.options.anytime { ClassicalEnd::Stopped } else { ClassicalEnd::Done };
        }
        match (self.options.anytime, self.options.soft) {
            (true, _) => self.anytime(FIRST_WORK * 4, u64::MAX),
            (false, true) => self.anytime(2 * budget, self.counts.work + SOFT_SHARE * budget),
            (false, false) => ClassicalEnd::Done,
        }
    }

    /// The first plan, and whether a search without lookahead may still find a shorter one quickly.
    ///
    /// Several searches take turns, each going on where it stopped, with more and more work each round.
    fn first(&mut self) -> Result<(Vec<u32>, bool), ClassicalEnd> {
        let mut kept: [Option<Kept<'a, 's>>; 5] = Default::default();
        let mut work_limit = FIRST_WORK;
        let mut turn = 0usize;
        loop {
            let place = ORDER[turn % ORDER.len()];
            let end = self.take_turn(&mut kept, place, work_limit);
            tracing::debug!(turn, self.counts.evaluated, self.counts.work);
            if matches!(end, End::Memory | End::Exhausted) {
                kept[place] = None;
            }
            match end {
                End::Plan(plan) => {
                    return Ok((plan, turn == 0));
                }
                // With a bound, only a search that follows cheaper ways to known states proves anything.
                End::Exhausted if place >= PLAIN || self.bound == u32::MAX => {
                    return Err(ClassicalEnd::Exhausted);
                }
                End::Stopped => return Err(ClassicalEnd::Stopped),
                // Another search may do with less.
                End::Memory if turn >= 2 => return Err(ClassicalEnd::Memory),
                End::Limit if self.limited() => return Err(ClassicalEnd::Stopped),
                End::Memory | End::Limit | End::Exhausted => {}
            }
            turn += 1;
            if turn.is_multiple_of(3) {
                work_limit = work_limit.saturating_mul(ROUND_FACTOR);
            }
        }
    }

    /// Lets one of the searches for a first plan go on for so much work.
    fn take_turn(&mut self, kept: &mut [Option<Kept<'a, 's>>; 5], place: usize, work: u64) -> End {
        let others: usize = kept.iter().flatten().map(Kept::bytes).sum();
        let evaluations = self
            .options
            .evaluation_limit
            .map_or(u64::MAX, |limit| limit.saturating_sub(self.counts.evaluated));
        let search = kept[place].get_or_insert_with(|| Kept::new(self.shared, place, self.bound));
        let (before, own) = (search.counts(), search.bytes());
        let memory = self.shared.memory.beside(others - own.min(others));
        let end = search.run(Allowed {
            work: before.work.saturating_add(work),
            evaluations: before.evaluated.saturating_add(evaluations),
            memory,
        });
        self.counts.add(search.counts().since(before));
        end
    }

    fn limited(&self) -> bool {
        self.options.evaluation_limit.is_some_and(|limit| self.counts.evaluated >= limit)
    }

    fn search(&mut self, strategy: Strategy) -> End {
        let limit = self.options.evaluation_limit.unwrap_or(u64::MAX);
        let evaluation_limit = limit.saturating_sub(self.counts.evaluated);
        search(self.shared, Strategy { evaluation_limit, ..strategy }, &mut self.counts)
    }

    /// Improves a plan for so much work and takes it if it is the best so far; tells whether more work would do no more.
    fn improve(&mut self, mut plan: Vec<u32>, work: u64) -> bool {
        let mut improve = Improve::new(self.task, self.shared.successors, self.shared.stop);
        improve.evaluation_limit =
            self.options.evaluation_limit.unwrap_or(u64::MAX).saturating_sub(self.counts.evaluated);
        let anytime = self.options.anytime;
        if anytime {
            self.take(&plan);
        }
        let settled = improve.run(&mut plan, work, &mut |better| {
            if anytime {
                self.take(better);
            }
        });
        self.counts.evaluated += improve.evaluated;
        self.counts.work += improve.work();
        self.take(&plan);
        settled
    }

    fn take(&mut self, plan: &[u32]) {
        let cost = self.task.plan_cost(plan);
        if self.options.bound.is_some_and(|bound| cost >= bound) {
            return;
        }
        if self.best.as_ref().is_none_or(|best| cost < self.task.plan_cost(best)) {
            // What operators are taken to cost bounds nothing where the metric is no sum of it.
            if self.task.measure.is_sum() {
                self.bound = self.bound.min(self.task.search_cost(plan));
            }
            self.best = Some(plan.to_vec());
            self.plans += 1;
            (self.on_plan)(plan, cost);
        }
    }

    /// Searches with falling weights for plans below the bound, each improved, until there is none.
    ///
    /// Where the metric is no sum over the operators, no bound keeps a search from the plan that it found before: once all
    /// of them end so, there is nothing left to try. Ends too once so much work is done in all.
    fn anytime(&mut self, mut work_limit: u64, until: u64) -> ClassicalEnd {
        let mut turn = 0usize;
        let mut again = 0;
        loop {
            if self.counts.work >= until {
                return ClassicalEnd::Done;
            }
            let weight = WEIGHTS[turn % WEIGHTS.len()];
            let strategy = Strategy {
                weight: Some(weight),
                lookahead: turn % 2 == 1,
                counting: if (turn / WEIGHTS.len()).is_multiple_of(2) {
                    Counting::CostAndSteps
                } else {
                    Counting::CostThenSteps
                },
                bound: self.bound,
                work_limit,
                ..GREEDY
            };
            match self.search(strategy) {
                End::Plan(plan) => {
                    let plans = self.plans;
                    let settled = self.improve(plan, work_limit);
                    if self.task.measure.is_sum() {
                        continue;
                    }
                    again = if settled && self.plans == plans { again + 1 } else { 0 };
                    if again == 2 * WEIGHTS.len() {
                        return ClassicalEnd::Done;
                    }
                }
                End::Exhausted if !strategy.lookahead && self.task.has_exact_costs() => {
                    return ClassicalEnd::Exhausted;
                }
                End::Exhausted if !strategy.lookahead => return ClassicalEnd::Done,
                End::Stopped => return ClassicalEnd::Stopped,
                End::Memory if turn > WEIGHTS.len() => return ClassicalEnd::Memory,
                End::Limit if self.limited() => return ClassicalEnd::Stopped,
                // A lookahead search keeps the first way to a state: it cannot prove that no cheaper plan exists.
                End::Memory | End::Limit | End::Exhausted => again = 0,
            }
            turn += 1;
            if turn.is_multiple_of(WEIGHTS.len()) {
                work_limit = work_limit.saturating_mul(2);
            }
        }
    }
}
