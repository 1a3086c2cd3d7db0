//! Classical planning: runs the portfolio's searches in turns, and improves the plan that they find.

use std::num::NonZeroUsize;
use std::ops::Range;
use std::sync::atomic::AtomicBool;

use tracing::debug_span;

use crate::classical::compiled::{Compiled, MOST_COUNTED};
use crate::classical::successor::Successors;
use crate::ground::GroundTask;
use crate::heuristics::landmarks::Landmarks;
use crate::heuristics::relaxed::Counting;
use crate::memory::MemoryLimit;
use crate::technique::{Technique, Without};

use super::abreast::in_order;
use super::horizon;
use super::improve::Improve;
use super::lazy::{self, Allowed, Counts, End, Shared, Strategy, search};
use super::novelty;
use super::portfolio::{Engine, FIRST, PORTFOLIO, Proof, ROUND_FACTOR, ROUNDS, SHORT_SHARE, turns};

/// Options of classical planning.
#[derive(Clone, Debug)]
pub struct ClassicalOptions {
    /// True to improve the plan until stopped or proven optimal.
    pub anytime: bool,
    /// True to return the first plan without improvement.
    pub only_first: bool,
    /// True if the task has soft goals: after the first plan, search then continues for as long as
    /// improvement may take.
    pub soft: bool,
    /// Only plans that cost less than this, in the unit of the metric, are accepted; `None` for no
    /// bound.
    pub bound: Option<f64>,
    /// Maximum memory.
    pub memory: MemoryLimit,
    /// Maximum number of evaluated states; `None` for no limit.
    pub evaluation_limit: Option<u64>,
    /// Maximum number of searches in parallel; `None` for one.
    pub threads: Option<NonZeroUsize>,
    /// Work of the first search before another one is tried; the limit grows in later rounds.
    pub first_work: u64,
    /// Techniques that are left out.
    pub without: Without,
}

/// Result of classical planning.
#[derive(Clone, Debug)]
pub struct ClassicalOutcome {
    /// Reason why planning ended.
    pub end: ClassicalEnd,
    /// Number of evaluated states.
    pub evaluated: u64,
    /// Number of expanded states.
    pub expanded: u64,
    /// Work done: a deterministic measure of effort.
    pub work: u64,
}

/// Reason why classical planning ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ClassicalEnd {
    /// A plan was found, and improved as requested.
    Done,
    /// Search space exhausted: no plan exists, or none better than the last one or the bound.
    Exhausted,
    /// Stopped by the caller or the evaluation limit.
    Stopped,
    /// The memory limit was reached.
    Memory,
}

/// Plans for a task that [`crate::classical::compiled::is_classical`]; `on_plan` gets every better plan
/// as operators and cost.
pub fn solve(
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
    let shared = Shared {
        task: &task,
        successors: &successors,
        landmarks: &landmarks,
        mutex_groups: &ground.mutex_groups,
        memory: options.memory,
        stop,
    };
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

/// Minimum work of improving a plan.
const LEAST_WORK: u64 = 5_000_000;
/// Further work of improving a plan, for each operator of the task.
const WORK_PER_OPERATOR: u64 = 1500;
/// Factor on the work of improvement for tasks with soft goals, to satisfy more preferences.
const SOFT_SHARE: u64 = 20;
/// Default work of the first search before the next one is tried.
pub const FIRST_WORK: u64 = 60_000_000;
/// Heuristic weights of the searches for better plans, in order (Richter and Westphal 2010).
const WEIGHTS: [u32; 4] = [5, 3, 2, 1];

const GREEDY: Strategy = Strategy {
    weight: None,
    counting: Counting::CostAndSteps,
    lookahead: true,
    steers: true,
    newest: false,
    landmarks: true,
    towards_landmarks: true,
    bound: u32::MAX,
    better_than: None,
    work_limit: u64::MAX,
    evaluation_limit: u64::MAX,
};

/// Turn from which planning ends if a search runs out of memory; at earlier turns, other searches may
/// need less.
const LAST_RESORT: usize = ROUNDS[0].len() + 3;

/// A search for a first plan, which can be continued.
enum Kept<'a, 's> {
    Lazy(Box<lazy::Search<'a, 's>>),
    Novelty(Box<novelty::NoveltySearch<'a, 's>>),
    Horizon(Box<horizon::SatSearch<'a, 's>>),
    /// Search that is finished.
    Spent,
}

impl<'a, 's> Kept<'a, 's> {
    fn new(shared: &'s Shared<'a>, place: usize, bound: u32, without: Without) -> Self {
        match PORTFOLIO[place].engine {
            Engine::Width { prunes } => {
                Kept::Novelty(Box::new(novelty::NoveltySearch::new(shared, bound, prunes)))
            }
            Engine::Satisfiability => Kept::Horizon(Box::new(horizon::SatSearch::new(shared, bound))),
            Engine::LazyGreedy { costs, lookahead, newest_first, prefers_landmarks } => {
                let counting = if costs { GREEDY.counting } else { Counting::Steps };
                let (newest, towards_landmarks) = (newest_first, prefers_landmarks);
                let landmarks = without.uses(Technique::LandmarkCount);
                let steers = without.uses(Technique::NumericLookahead);
                let strategy = Strategy {
                    bound,
                    lookahead,
                    newest,
                    counting,
                    towards_landmarks,
                    landmarks,
                    steers,
                    ..GREEDY
                };
                Kept::Lazy(Box::new(lazy::Search::new(shared, strategy)))
            }
        }
    }

    fn run(&mut self, allowed: Allowed<'_>) -> End {
        match self {
            Kept::Lazy(search) => search.run(allowed),
            Kept::Novelty(search) => search.run(allowed),
            Kept::Horizon(search) => search.run(allowed),
            Kept::Spent => End::Exhausted,
        }
    }

    fn counts(&self) -> Counts {
        match self {
            Kept::Lazy(search) => search.counts(),
            Kept::Novelty(search) => search.counts(),
            Kept::Horizon(search) => search.counts(),
            Kept::Spent => Counts::default(),
        }
    }

    fn bytes(&self) -> usize {
        match self {
            Kept::Lazy(search) => search.bytes(),
            Kept::Novelty(search) => search.bytes(),
            Kept::Horizon(search) => search.bytes(),
            Kept::Spent => 0,
        }
    }
}

/// Result of one turn of a search.
struct Taken<'a, 's> {
    place: usize,
    search: Kept<'a, 's>,
    end: End,
    took: Counts,
}

struct Run<'a, 's> {
    task: &'a Compiled,
    shared: &'s Shared<'a>,
    options: &'s ClassicalOptions,
    counts: Counts,
    /// Only plans with search costs below this bound are of interest.
    bound: u32,
    best: Option<Vec<u32>>,
    /// Number of adopted plans; each is better than the one before.
    plans: u64,
    on_plan: &'s mut dyn FnMut(&[u32], f64),
}

impl<'a, 's> Run<'a, 's> {
    fn all(&mut self) -> ClassicalEnd {
        let (plan, plain_too) = match self.first() {
            Ok(found) => found,
            Err(end) => return end,
        };
        if self.options.only_first {
            self.take(&plan);
            return if self.best.is_some() { ClassicalEnd::Done } else { ClassicalEnd::Stopped };
        }
        let budget = LEAST_WORK + WORK_PER_OPERATOR * self.task.operators() as u64;
        let mut plan = plan;
        if plain_too && self.options.without.uses(Technique::SecondSearch) {
            let bound = self.bound.min(self.task.search_cost(&plan));
            // Lookahead over numbers goes the longer ways.
            let work_limit = if self.task.numbers.is_empty() { budget / 2 } else { budget };
            let strategy = Strategy { lookahead: false, bound, work_limit, ..GREEDY };
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
            (true, soft) => match self.anytime(self.options.first_work * 4, u64::MAX) {
                ClassicalEnd::Done if !soft => self.beyond(),
                end => end,
            },
            (false, true) => self.anytime(2 * budget, self.counts.work + SOFT_SHARE * budget),
            (false, false) => ClassicalEnd::Done,
        }
    }

    /// First plan, and true if a search without lookahead is likely to find a shorter one quickly.
    ///
    /// The searches of the portfolio take turns; each continues where it stopped, with a higher work
    /// limit in each round.
    fn first(&mut self) -> Result<(Vec<u32>, bool), ClassicalEnd> {
        let mut kept: [Option<Kept<'a, 's>>; PORTFOLIO.len()] = Default::default();
        let (mut round, mut turn) = (0, 0);
        let mut work_limit = self.options.first_work / SHORT_SHARE;
        loop {
            let uses = |place: usize| self.options.without.uses(PORTFOLIO[place].technique);
            let order: Vec<usize> = turns(round).iter().copied().filter(|&place| uses(place)).collect();
            let is_over = |place| !uses(place) || matches!(kept[place], Some(Kept::Spent));
            if (0..PORTFOLIO.len()).all(is_over) {
                return Err(ClassicalEnd::Stopped);
            }
            let mut next = 0;
            while next < order.len() {
                let places = &order[self.side_by_side(next, order.len())];
                for (&place, taken) in places.iter().zip(self.take_turns(&mut kept, places, work_limit)) {
                    self.counts.add(taken.took);
                    tracing::debug!(turn, place, self.counts.evaluated, self.counts.work);
                    kept[place] = match taken.end {
                        End::Memory => None,
                        End::Exhausted => Some(Kept::Spent),
                        _ => Some(taken.search),
                    };
                    match taken.end {
                        End::Plan(plan) => return Ok((plan, turn <= ROUNDS[0].len() && place == FIRST)),
                        End::Exhausted if self.proves(place) => return Err(ClassicalEnd::Exhausted),
                        End::Stopped => return Err(ClassicalEnd::Stopped),
                        End::Memory if turn >= LAST_RESORT => return Err(ClassicalEnd::Memory),
                        End::Limit if self.limited() => return Err(ClassicalEnd::Stopped),
                        End::Memory | End::Limit | End::Exhausted => {}
                    }
                    (turn, next) = (turn + 1, next + 1);
                }
            }
            let more = if round == 0 { SHORT_SHARE } else { ROUND_FACTOR };
            work_limit = work_limit.saturating_mul(more);
            round += 1;
        }
    }

    /// True if exhaustion of a search proves that no plan exists (within the cost bound, if there is
    /// one).
    fn proves(&self, place: usize) -> bool {
        match PORTFOLIO[place].proof {
            Proof::Nothing => false,
            Proof::Unsolvable => true,
            Proof::UnsolvableWithoutBound => self.bound == u32::MAX,
        }
    }

    /// Range of turns, from this one on and within a round, that may run in parallel.
    fn side_by_side(&self, turn: usize, round: usize) -> Range<usize> {
        // What is left for a turn must be known before the one before it has ended.
        let counts = self.options.evaluation_limit.is_some() || self.shared.memory.counted().is_some();
        let threads = self.options.threads.filter(|_| !counts).map_or(1, NonZeroUsize::get);
        turn..turn + threads.min(round - turn % round)
    }

    /// Runs searches in parallel for one turn each, with a work limit; returns results up to the first
    /// conclusive one.
    fn take_turns(
        &self,
        kept: &mut [Option<Kept<'a, 's>>; PORTFOLIO.len()],
        places: &[usize],
        work: u64,
    ) -> Vec<Taken<'a, 's>> {
        let limit = self.options.evaluation_limit.unwrap_or(u64::MAX);
        let evaluations = limit.saturating_sub(self.counts.evaluated);
        let mut jobs = Vec::new();
        for &place in places {
            let mut search = kept[place]
                .take()
                .unwrap_or_else(|| Kept::new(self.shared, place, self.bound, self.options.without));
            let memory = self.shared.memory.beside(kept.iter().flatten().map(Kept::bytes).sum());
            let most = if PORTFOLIO[place].is_capped { self.options.first_work } else { u64::MAX };
            let work = work.min(most);
            jobs.push(move |cancelled: &AtomicBool| {
                let before = search.counts();
                let work = before.work.saturating_add(work);
                let evaluations = before.evaluated.saturating_add(evaluations);
                let end = search.run(Allowed { work, evaluations, memory, cancelled });
                Taken { took: search.counts().since(before), place, search, end }
            });
        }
        in_order(jobs, |taken| match taken.end {
            End::Plan(_) | End::Stopped => true,
            End::Exhausted => self.proves(taken.place),
            End::Memory | End::Limit => false,
        })
    }

    fn limited(&self) -> bool {
        self.options.evaluation_limit.is_some_and(|limit| self.counts.evaluated >= limit)
    }

    fn search(&mut self, strategy: Strategy) -> End {
        let (end, took) = self.search_each(&[strategy]).remove(0);
        self.counts.add(took);
        end
    }

    /// Improves a plan within a work limit and adopts it if it is the best so far; true if improvement
    /// ended because nothing got better.
    fn improve(&mut self, mut plan: Vec<u32>, work: u64) -> bool {
        let mut improve = Improve::new(self.task, self.shared.successors, self.shared.stop);
        improve.without = self.options.without;
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

    /// Searches with falling weights for plans below the bound and improves each, until the search is
    /// exhausted, the same plans return, a limit is reached, or the total work reaches `until`.
    ///
    /// If the metric is no sum of operator costs, no bound excludes the plans found before; search ends
    /// once all searches have twice found nothing better.
    fn anytime(&mut self, mut work_limit: u64, until: u64) -> ClassicalEnd {
        let mut turn = 0usize;
        let mut again = 0;
        loop {
            let strategies: Vec<Strategy> = self
                .side_by_side(turn, WEIGHTS.len())
                .map(|turn| Strategy { bound: self.bound, work_limit, ..for_better(turn) })
                .collect();
            for (strategy, (end, took)) in strategies.iter().zip(self.search_each(&strategies)) {
                if self.counts.work >= until {
                    return ClassicalEnd::Done;
                }
                self.counts.add(took);
                match end {
                    End::Plan(plan) => {
                        let (plans, counted) = (self.plans, self.task.search_cost(&plan));
                        let settled = self.improve(plan, work_limit);
                        if self.task.measure.is_sum() {
                            // What the search takes for cheaper need not be where it rounds: it must not come to the same again.
                            self.bound = self.bound.min(counted);
                            continue;
                        }
                        again = if settled && self.plans == plans { again + 1 } else { 0 };
                        if again == 2 * WEIGHTS.len() {
                            return ClassicalEnd::Done;
                        }
                    }
                    End::Exhausted if !strategy.lookahead && self.counts_exactly() => {
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

    /// True if search costs are exact and the bound can be represented.
    fn counts_exactly(&self) -> bool {
        self.task.has_exact_costs() && self.bound < MOST_COUNTED
    }

    /// Searches for plans with a better metric value, if the metric depends on the final state alone;
    /// `Exhausted` proves that none exists.
    fn beyond(&mut self) -> ClassicalEnd {
        let mut work_limit = self.options.first_work;
        for turn in 0.. {
            let cost = self.best.as_ref().map(|best| self.task.plan_cost(best));
            let known = self.task.measure.of_last(&self.task.numbers, &self.task.initial);
            let Some(better_than) = cost.filter(|cost| known.is_some() && cost.is_finite()) else {
                return ClassicalEnd::Done;
            };
            let strategy = Strategy { better_than: Some(better_than), work_limit, ..for_better(turn) };
            match self.search(strategy) {
                End::Plan(plan) => drop(self.improve(plan, work_limit)),
                End::Exhausted => return ClassicalEnd::Exhausted,
                End::Stopped => return ClassicalEnd::Stopped,
                End::Memory if turn > WEIGHTS.len() => return ClassicalEnd::Memory,
                End::Limit if self.limited() => return ClassicalEnd::Stopped,
                End::Memory | End::Limit => work_limit = work_limit.saturating_mul(2),
            }
        }
        ClassicalEnd::Done
    }

    /// Runs searches in parallel; returns results and counts, up to and including the first plan.
    fn search_each(&self, strategies: &[Strategy]) -> Vec<(End, Counts)> {
        let limit = self.options.evaluation_limit.unwrap_or(u64::MAX);
        let evaluation_limit = limit.saturating_sub(self.counts.evaluated);
        let job = |strategy: &Strategy| {
            let (shared, strategy) = (self.shared, Strategy { evaluation_limit, ..*strategy });
            move |cancelled: &AtomicBool| search(shared, strategy, cancelled)
        };
        in_order(strategies.iter().map(job).collect(), |(end, _)| matches!(end, End::Plan(_) | End::Stopped))
    }
}

/// Strategy of the search for a better plan at a turn.
fn for_better(turn: usize) -> Strategy {
    let counting = match (turn / WEIGHTS.len()).is_multiple_of(2) {
        true => Counting::CostAndSteps,
        false => Counting::CostThenSteps,
    };
    Strategy { weight: Some(WEIGHTS[turn % WEIGHTS.len()]), lookahead: turn % 2 == 1, counting, ..GREEDY }
}
