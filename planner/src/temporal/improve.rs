//! Anytime search: finds a first plan, then better ones.
//!
//! The first search is greedy. Then come searches from the beginning that give path costs ever more
//! weight relative to the heuristic (restarting weighted A*; Richter, Thayer and Ruml 2010), and then a
//! large neighbourhood search: part of the plan is removed, the rest is kept, and the goal is reached
//! again from there at lower cost.

use std::cell::OnceCell;
use std::collections::BTreeSet;

use crate::calls::Failure;
use crate::ground::Earns;
use crate::memory::MemoryLimit;
use crate::technique::{Technique, Without};

use super::advance::{Situation, TemporalStep};
use super::compress::classical_plan;
use super::destroy::{Chance, keep_for, taken_apart};
use super::envelope::{all_apart, envelopes, in_one_go_suffices};
use super::joined::shortened;
use super::linear::{is_linear, linear_plan};
use super::manner::{Counts, End, Manner};
use super::overlap::helpful;
use super::relaxed::Relaxed;
use super::schedule::{Replayed, tightened};
use super::search::Search;
use super::space::{Base, Measure, Space};
use super::timed::{Timed, schedule};
use super::tours::Tours;
use super::world::World;

/// Limits of the search for plans.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Limits {
    /// True to improve the plan until stopped or proven best.
    pub anytime: bool,
    /// True to return the first plan without improvement.
    pub first: bool,
    /// Only plans with a measure below this bound are accepted.
    pub bound: f64,
    /// Maximum number of evaluated states.
    pub evaluations: u64,
    /// Maximum memory.
    pub memory: MemoryLimit,
    /// Seed of all random choices.
    pub seed: u64,
    /// Techniques that are left out.
    pub without: Without,
}

/// Progress of the search, and the reason why it ended.
#[derive(Debug, Clone)]
pub(crate) struct Progress {
    /// Reason why the search ended.
    pub reason: Reason,
    /// Counts of evaluated and expanded states, and of work.
    pub counts: Counts,
    /// Number of plans found, each better than the one before.
    pub plans: u64,
    /// Actions that might allow a plan if they overlapped themselves, once everything else is
    /// exhausted.
    pub overlapping: Vec<u32>,
}

/// Reason why a search for plans ended.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Reason {
    /// Search space exhausted: no (better) plan exists, unless self-overlapping actions allow one.
    Exhausted,
    /// Nothing is left to search, but parts of the space were pruned: nothing is proven.
    Unproven,
    /// The effort planned for the search is used up.
    Enough,
    /// Stopped by the caller, or by the limit of evaluations.
    Stopped,
    /// The memory limit was reached.
    Memory,
}

/// Effort of improving a plan without `anytime`, in evaluated states times actions, per
/// [`STEPS_PER_SHARE`] steps of the plan.
const IMPROVEMENT_WORK: u64 = 2_000_000;
/// Number of plan steps for which the effort of improvement grows by [`IMPROVEMENT_WORK`].
const STEPS_PER_SHARE: u64 = 16;
/// Minimum effort of improving a plan without `anytime`, as a multiple of the states evaluated for the
/// first plan.
const IMPROVEMENT_FACTOR: u64 = 20;
/// Minimum limit on the work of improving a plan without `anytime`; the limit is the work done before,
/// if that is more.
const LEAST_WORK: u64 = 150_000_000;
/// Maximum number of consecutive repairs without success, per step of the plan, without `anytime`.
const PATIENCE: u64 = 10;
/// Weights of the heuristic in the searches from the beginning that improve a plan.
const WEIGHTS: [f64; 2] = [3.0, 1.0];
/// Minimum and maximum number of evaluations of each first, short search for a plan.
const FIRST_TRY: (u64, u64) = (50, 500);
/// Effort of each first, short search for a plan, in evaluated states times actions.
const FIRST_WORK: u64 = 2_000_000;
/// Minimum number of evaluations granted to a search with self-overlapping actions.
const LEAST_OVERLAPPED: u64 = 2_000;
/// Number of evaluations of a search for a first plan before linear programs are tried.
const SHORT: u64 = 500;
/// Minimum number of evaluations granted to one repair in the large neighbourhood search.
const REPAIR: u64 = 200;

/// Searches for plans; `on_plan` gets every better plan.
pub(crate) fn search_plans(
    world: &World,
    measure: &Measure,
    mut limits: Limits,
    stop: &(dyn Fn() -> bool + Sync),
    on_plan: &mut dyn FnMut(&[Timed]) -> Result<(), Failure>,
) -> Result<Progress, Failure> {
    let (inside, all) = (envelopes(world), all_apart(world));
    // What the searches before leave out, the last one looks at.
    let mut passes = vec![Pass::new(&all, false), Pass::new(&all, true)];
    if inside != all && limits.without.uses(Technique::Envelopes) {
        passes.insert(0, Pass::new(&inside, false));
    }
    let linear =
        limits.without.uses(Technique::LinearPrograms) && world.chooses_numbers() && is_linear(world);
    if linear && !world.chooses_without_end() {
        // Times that are tried serve most tasks: linear programs choose them before the others are searched at length.
        let short = [&inside, &all].map(|apart| Pass { is_short: true, ..Pass::new(apart, false) });
        passes.splice(0..0, short.into_iter().skip(usize::from(inside == all)));
    }
    let mut progress =
        Progress { reason: Reason::Unproven, counts: Counts::default(), plans: 0, overlapping: Vec::new() };
    let mut tried = !linear;
    for pass in passes {
        if !tried && !pass.is_short {
            tried = true;
            if progress.plans == 0 && by_programs(world, measure, &limits, stop, &mut progress, on_plan)? {
                break;
            }
        }
        let over = pass.run(world, measure, &mut limits, stop, &mut progress, on_plan)?;
        if over || progress.plans > 0 && !limits.anytime {
            break;
        }
    }
    if progress.reason == Reason::Exhausted && !progress.overlapping.is_empty() {
        overlapped(world, measure, limits, stop, &mut progress, on_plan)?;
    }
    if progress.plans > 0 && progress.reason == Reason::Unproven {
        progress.reason = Reason::Enough;
    }
    Ok(progress)
}

/// Searches for a first plan by linear programs; true if one is found, which ends the search.
fn by_programs(
    world: &World,
    measure: &Measure,
    limits: &Limits,
    stop: &(dyn Fn() -> bool + Sync),
    progress: &mut Progress,
    on_plan: &mut dyn FnMut(&[Timed]) -> Result<(), Failure>,
) -> Result<bool, Failure> {
    let space = Space::new(world, all_apart(world), measure.clone());
    let mut relaxed = Relaxed::new(&space);
    let left = limits.evaluations.saturating_sub(progress.counts.evaluated);
    let (plan, evaluated) = linear_plan(&space, &mut relaxed, limits.bound, left, stop)?;
    progress.counts.evaluated += evaluated;
    let Some(plan) = plan else { return Ok(false) };
    progress.plans += 1;
    progress.reason = Reason::Enough;
    on_plan(&plan)?;
    Ok(true)
}

/// Searches once more, with about the same effort, for a plan with self-overlapping actions, after
/// everything else is exhausted.
fn overlapped(
    world: &World,
    measure: &Measure,
    mut limits: Limits,
    stop: &(dyn Fn() -> bool + Sync),
    progress: &mut Progress,
    on_plan: &mut dyn FnMut(&[Timed]) -> Result<(), Failure>,
) -> Result<(), Failure> {
    let known = progress.clone();
    let evaluated = progress.counts.evaluated;
    limits.evaluations = limits.evaluations.min(evaluated + evaluated.max(LEAST_OVERLAPPED));
    let pass = Pass { at_once: 2, ..Pass::new(&all_apart(world), false) };
    pass.run(world, measure, &mut limits, stop, progress, on_plan)?;
    progress.overlapping = known.overlapping;
    progress.reason = if progress.plans > known.plans { Reason::Enough } else { Reason::Exhausted };
    Ok(())
}

/// One pass of searching for plans and improving them, with some of the actions split into start and
/// end.
struct Pass {
    /// True, by action, if start and end are separate steps.
    apart: Vec<bool>,
    /// True if nothing may be pruned that could lead to a plan.
    exact: bool,
    /// Maximum number of instances of an action that are in progress at once.
    at_once: usize,
    /// True if the search for a first plan ends after [`SHORT`] evaluated states.
    is_short: bool,
}

impl Pass {
    fn new(apart: &[bool], exact: bool) -> Pass {
        Pass { apart: apart.to_vec(), exact, at_once: 1, is_short: false }
    }

    /// Runs the pass, with the best bound of earlier passes; true if no further pass is needed.
    fn run(
        &self,
        world: &World,
        measure: &Measure,
        limits: &mut Limits,
        stop: &(dyn Fn() -> bool + Sync),
        progress: &mut Progress,
        on_plan: &mut dyn FnMut(&[Timed]) -> Result<(), Failure>,
    ) -> Result<bool, Failure> {
        let space = Space::new(world, self.apart.clone(), measure.clone());
        let relaxed = Relaxed::new(&space);
        let begin = Situation { state: world.initial()?, open: Vec::new(), timed: 0 };
        let base = Base { situation: begin, costs: 0.0, track: space.begin(), clock: space.clock(&[]) };
        let mut run = Run {
            space: &space,
            relaxed,
            base,
            exact: self.exact,
            at_once: self.at_once,
            most_first: if self.is_short { SHORT } else { u64::MAX },
            elsewhere: 0,
            work: u64::MAX,
            limits: *limits,
            stop,
            progress: progress.clone(),
            overlapping: BTreeSet::new(),
            on_plan,
            best: None,
            tours: OnceCell::new(),
        };
        run.first()?;
        if run.best.is_some() && !limits.first {
            run.improve()?;
        }
        if let Some(best) = &run.best {
            limits.bound = best.measured - tolerance(best.measured);
        }
        let mut overlapping = run.overlapping;
        *progress = run.progress;
        if progress.reason == Reason::Exhausted {
            if self.apart != all_apart(world) && !self.all_in_one_go(&space, progress, &mut overlapping) {
                progress.reason = Reason::Unproven;
            }
            progress.overlapping = helpful(world, overlapping, space.earns != Earns::Never);
        }
        Ok(progress.reason != Reason::Unproven)
    }

    /// True if plans of compressed actions stand for all plans: any plan can be rearranged into one,
    /// which stays valid but may end later. Adds actions to `overlapping` for which this holds only if
    /// they do not overlap themselves.
    fn all_in_one_go(&self, space: &Space, progress: &Progress, overlapping: &mut BTreeSet<u32>) -> bool {
        if self.apart.contains(&true) || progress.plans > 0 && space.timed_measure() {
            return false;
        }
        let suffices = in_one_go_suffices(space.world);
        suffices.map(|alone| overlapping.extend(alone)).is_some()
    }
}

struct Run<'r, 'w, 'a> {
    space: &'r Space<'w, 'a>,
    relaxed: Relaxed,
    base: Base,
    exact: bool,
    at_once: usize,
    /// Maximum number of states that the search for a first plan evaluates.
    most_first: u64,
    /// Number of states that the classical search evaluated.
    elsewhere: u64,
    /// Maximum work of all searches together.
    work: u64,
    limits: Limits,
    stop: &'r (dyn Fn() -> bool + Sync),
    progress: Progress,
    /// Actions that could have overlapped themselves in the search that proved exhaustion.
    overlapping: BTreeSet<u32>,
    on_plan: &'r mut dyn FnMut(&[Timed]) -> Result<(), Failure>,
    best: Option<Best>,
    tours: OnceCell<Option<Tours<'w, 'a>>>,
}

/// Best plan found so far.
struct Best {
    measured: f64,
    /// Sum of the times, in seconds, at which the goal's facts are achieved.
    slowness_s: f64,
    steps: Vec<TemporalStep>,
}

impl Run<'_, '_, '_> {
    fn manner(&self, weight: Option<f64>, timed: bool, evaluations: u64) -> Manner {
        let strictly = |best: &Best| best.measured - tolerance(best.measured);
        let bound = self.best.as_ref().map_or(self.limits.bound, strictly);
        let left = self.limits.evaluations.saturating_sub(self.progress.counts.evaluated);
        let evaluations = evaluations.min(left);
        Manner {
            weight,
            timed,
            eager: true,
            bound,
            evaluations,
            work: self.work.saturating_sub(self.progress.counts.work),
            memory: self.limits.memory,
            shuffle: 0,
            exact: self.exact,
            at_once: self.at_once,
        }
    }

    fn search(&mut self, base: Option<&Base>, manner: Manner) -> Result<End, Failure> {
        let base = base.unwrap_or(&self.base);
        let (end, counts) =
            Search::new(self.space, &mut self.relaxed, base, manner).run(&|| (self.stop)())?;
        self.progress.counts.evaluated += counts.evaluated;
        self.progress.counts.expanded += counts.expanded;
        self.progress.counts.work += counts.work;
        Ok(end)
    }

    fn first(&mut self) -> Result<(), Failure> {
        // Short tries that follow some relaxed plans, or all; then the classical search, where the task allows it; then at
        // length.
        let short =
            (FIRST_WORK / (self.space.world.acts.len() as u64).max(1)).clamp(FIRST_TRY.0, FIRST_TRY.1);
        for (eager, technique) in [(false, Technique::SparseLookahead), (true, Technique::EagerLookahead)] {
            if !self.limits.without.uses(technique) {
                continue;
            }
            let manner = Manner { eager, ..self.manner(None, self.space.counts_time(), short) };
            let end = self.search(None, manner)?;
            if self.took(end)? {
                return Ok(());
            }
        }
        let left = self.limits.evaluations.saturating_sub(self.progress.counts.evaluated);
        if self.at_once == 1
            && self.limits.without.uses(Technique::Compression)
            && let Some((steps, evaluated, work)) =
                classical_plan(self.space, self.limits.memory, left, self.limits.without, self.stop)
        {
            self.progress.counts.evaluated += evaluated;
            self.progress.counts.work += work;
            self.elsewhere += evaluated;
            if self.take(steps)? {
                return Ok(());
            }
        }
        let end = self.search(None, self.manner(None, false, self.most_first))?;
        if !self.took(end)? && self.progress.reason == Reason::Enough {
            let is_left = self.progress.counts.evaluated < self.limits.evaluations;
            let is_short = self.most_first < u64::MAX && is_left;
            self.progress.reason = if is_short { Reason::Unproven } else { Reason::Stopped };
        }
        Ok(())
    }

    /// Records the result of a search; true if this ends the search for a first plan.
    fn took(&mut self, end: End) -> Result<bool, Failure> {
        let (reason, over) = match end {
            End::Found(steps) => (Reason::Unproven, self.take(steps)?),
            End::Exhausted { proven: true, overlapping } => {
                self.overlapping = overlapping;
                (Reason::Exhausted, true)
            }
            End::Exhausted { .. } => (Reason::Unproven, false),
            End::Budget => (Reason::Enough, false),
            End::Stopped => (Reason::Stopped, true),
            End::Memory => (Reason::Memory, true),
        };
        self.progress.reason = reason;
        Ok(over)
    }

    /// Adopts a plan, without superfluous steps and shortened, if it is better than the best one; true
    /// if so. Of equally good plans, the one whose goals are achieved earlier is kept, as it is closer
    /// to an improvement.
    fn take(&mut self, mut steps: Vec<TemporalStep>) -> Result<bool, Failure> {
        let Some((mut measured, mut base)) = self.space.replay_to_goal(&mut steps, self.stop)? else {
            return Ok(false);
        };
        let mut lean = keep_for(self.space.world, &steps, &self.space.world.ground.goal);
        if lean.len() < steps.len()
            && let Some((leaner, lean_base)) = self.space.replay_to_goal(&mut lean, self.stop)?
            && leaner <= measured
        {
            (measured, steps, base) = (leaner, lean, lean_base);
        }
        let found = steps.clone();
        if self.limits.first {
            return self.keep((measured, steps, base), found);
        }
        let uses = |technique| self.limits.without.uses(technique);
        let plan = (measured, steps, base);
        let shorter = if uses(Technique::Shortcuts) { shortened(self.space, plan, self.stop)? } else { plan };
        let shorter = if uses(Technique::Tours) { self.rearranged(shorter)? } else { shorter };
        let plan =
            if uses(Technique::Tightening) { tightened(self.space, shorter, self.stop)? } else { shorter };
        self.keep(plan, found)
    }

    /// Adopts a replayed plan if it is better than the best one; true if so. `found` is the plan as the
    /// search found it, which is used if the improved one cannot be scheduled.
    fn keep(&mut self, plan: Replayed, found: Vec<TemporalStep>) -> Result<bool, Failure> {
        let (measured, mut steps, base) = plan;
        let ready_s = base.track.order.ready_s();
        let goal = &self.space.world.ground.goal.facts;
        let slowness_s: f64 = goal.iter().map(|fact| ready_s[fact.variable as usize]).sum();
        let mut ordered = self.space.in_time_order(&steps);
        if let Some((again, _)) = self.space.replay_to_goal(&mut ordered, self.stop)?
            && again <= measured
        {
            steps = ordered;
        }
        let better = match &self.best {
            // A metric without a value is no worse than any, where nothing is asked of it.
            None => measured < self.limits.bound || measured.is_nan() && self.limits.bound.is_infinite(),
            Some(best) => measured < best.measured - tolerance(best.measured),
        };
        let nearer = |best: &Best| measured <= best.measured && slowness_s < best.slowness_s - 1e-6;
        if !better && !self.best.as_ref().is_some_and(nearer) {
            return Ok(false);
        }
        let plan = better.then(|| {
            schedule(self.space, &steps, self.stop).or_else(|| {
                steps = found;
                schedule(self.space, &steps, self.stop)
            })
        });
        if matches!(plan, Some(None)) {
            return Ok(false);
        }
        self.best = Some(Best { measured, slowness_s, steps });
        if let Some(plan) = plan.flatten() {
            self.progress.plans += 1;
            (self.on_plan)(&plan)?;
        }
        Ok(better)
    }

    /// Plan with the stops of its tours reordered, if that is better.
    fn rearranged(&self, plan: Replayed) -> Result<Replayed, Failure> {
        match self.tours.get_or_init(|| Tours::new(self.space.world)) {
            Some(tours) => tours.rearranged(self.space, plan, self.stop),
            None => Ok(plan),
        }
    }

    fn improve(&mut self) -> Result<(), Failure> {
        let before = self.progress.counts.evaluated;
        let spent = before - self.elsewhere;
        let least = IMPROVEMENT_WORK / (self.space.world.acts.len() as u64).max(1);
        let shares = 1 + self.best.as_ref().map_or(0, |best| best.steps.len()) as u64 / STEPS_PER_SHARE;
        let budget = match self.limits.anytime {
            true => self.limits.evaluations,
            false => before + (shares * least.clamp(100, 10_000)).max(IMPROVEMENT_FACTOR * spent),
        };
        if !self.limits.anytime {
            self.work = self.progress.counts.work + self.progress.counts.work.max(LEAST_WORK);
        }
        self.progress.reason = Reason::Enough;
        let timed = self.space.counts_time();
        // A greedy plan that watches the time, then restarts with falling weights, each with a share of the budget.
        let share = (least / 3).clamp(50, 3000);
        let mut proven = false;
        for weight in WEIGHTS.map(Some) {
            if !self.limits.without.uses(Technique::Restarts) {
                break;
            }
            if self.progress.counts.evaluated >= budget || self.progress.counts.work >= self.work {
                return Ok(());
            }
            loop {
                let end = self.search(None, self.manner(weight, timed, share))?;
                match end {
                    End::Found(steps) => {
                        if !self.take(steps)? {
                            break;
                        }
                    }
                    End::Budget => break,
                    End::Exhausted { proven: all, overlapping } => {
                        (proven, self.overlapping) = (all, overlapping);
                        break;
                    }
                    End::Stopped => return self.ended(Reason::Stopped),
                    End::Memory => break,
                }
            }
            if proven {
                break;
            }
        }
        if proven {
            return self.ended(Reason::Exhausted);
        }
        if !self.limits.without.uses(Technique::Neighbourhoods) {
            return Ok(());
        }
        self.neighbourhoods(budget)
    }

    fn ended(&mut self, reason: Reason) -> Result<(), Failure> {
        self.progress.reason = reason;
        Ok(())
    }

    /// Large neighbourhood search: removes part of the plan and replans it, until the budget is used
    /// up.
    fn neighbourhoods(&mut self, budget: u64) -> Result<(), Failure> {
        let mut chance = Chance::new(self.limits.seed);
        let mut idle = 0;
        let mut tries: u64 = 0;
        let mut fruitless: u64 = 0;
        while self.progress.counts.evaluated < budget && self.progress.counts.work < self.work {
            if (self.stop)() {
                return self.ended(Reason::Stopped);
            }
            let Some(Best { steps, measured, .. }) = &self.best else { return Ok(()) };
            let as_good = measured + tolerance(*measured);
            tries += 1;
            fruitless += 1;
            if !self.limits.anytime && fruitless > PATIENCE * steps.len() as u64 {
                return Ok(());
            }
            let mut kept = taken_apart(self.space, steps, &mut chance);
            let Some((_, base)) = self.space.replay(&mut kept, self.stop)? else {
                idle += 1;
                if idle > 1000 {
                    return Ok(());
                }
                continue;
            };
            let timed = self.space.counts_time() && !tries.is_multiple_of(3);
            let left = budget - self.progress.counts.evaluated;
            let mut manner = self.manner(None, timed, REPAIR.max(4 * steps.len() as u64).min(left));
            manner.shuffle = tries;
            manner.eager = tries.is_multiple_of(2);
            manner.bound = as_good;
            let before = self.progress.counts.evaluated;
            let end = self.search(Some(&base), manner)?;
            // A repair that fails at once costs no evaluation, but must not go on for ever.
            idle = if self.progress.counts.evaluated == before { idle + 1 } else { 0 };
            if idle > 1000 {
                return Ok(());
            }
            match end {
                End::Found(more) => {
                    kept.extend(more);
                    if self.take(kept)? {
                        fruitless = 0;
                    }
                }
                End::Exhausted { .. } | End::Budget => {}
                End::Stopped => return self.ended(Reason::Stopped),
                End::Memory => return self.ended(Reason::Memory),
            }
        }
        if self.limits.evaluations <= self.progress.counts.evaluated {
            return self.ended(Reason::Stopped);
        }
        Ok(())
    }
}

/// Minimum difference of the measure at which a plan counts as better, above the rounding of sums of
/// times.
fn tolerance(measured: f64) -> f64 {
    1e-6 * measured.abs().max(1.0)
}
