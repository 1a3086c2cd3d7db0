//! From no plan to a first one, and from there to better ones.

use crate::calls::Failure;

use super::advance::Step;
use super::envelope::{all_apart, envelopes};
use super::relaxed::{Part, Relaxed};
use super::search::{Counts, End, Manner, Measure, Search, Space};
use super::world::World;

/// How far to go.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Limits {
    /// Improve until stopped or proven best.
    pub anytime: bool,
    /// Only plans below this.
    pub bound: f64,
    /// States evaluated at most.
    pub evaluations: u64,
    /// Memory at most.
    pub memory_bytes: usize,
}

/// An action of a plan with its times.
#[derive(Debug, Clone)]
pub(crate) struct Timed {
    /// The step of the search.
    pub step: Step,
    /// When it starts.
    pub start_s: f64,
    /// How long it takes.
    pub duration_s: f64,
}

/// How the search for plans ended.
#[derive(Debug, Clone)]
pub(crate) struct Progress {
    /// The best plan, in order of time.
    pub best: Option<Vec<Timed>>,
    /// What stopped it.
    pub reason: Reason,
    /// What it took.
    pub counts: Counts,
    /// How many plans were found.
    pub plans: u64,
}

/// Why a search for plans ended.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Reason {
    /// Every possibility was seen: without a plan, there is none.
    Exhausted,
    /// The effort that was meant to be spent is spent.
    Enough,
    /// Asked to stop, or the limit of evaluations is reached.
    Stopped,
    /// Out of memory.
    Memory,
}

/// After a first plan without `anytime`: evaluations to spend on better ones, at least.
const SHORT_IMPROVEMENT: u64 = 2000;
/// Weights of the heuristic in the searches that improve a plan (as in Richter and Westphal 2010).
const WEIGHTS: [f64; 4] = [5.0, 3.0, 2.0, 1.0];

/// Searches for plans; `on_plan` hears of each that is better than the one before.
pub(crate) fn search_plans(
    world: &World,
    measure: Measure,
    limits: Limits,
    stop: &dyn Fn() -> bool,
    on_plan: &mut dyn FnMut(&[Timed]) -> Result<(), Failure>,
) -> Result<Progress, Failure> {
    let apart = envelopes(world);
    let all = all_apart(world);
    let mut progress =
        Progress { best: None, reason: Reason::Exhausted, counts: Counts::default(), plans: 0 };
    let mut splits = vec![apart];
    if splits[0] != all {
        splits.push(all);
    }
    for split in splits {
        let space = Space::new(world, split, measure.clone());
        let mut relaxed = Relaxed::new(world, &space.open_act);
        let mut bound = limits.bound;
        let end = phase(&space, &mut relaxed, None, bound, limits.evaluations, &limits, stop, &mut progress)?;
        match end {
            End::Found(mut steps) => {
                let Some((mut measured, _)) = space.replay(&mut steps)? else { continue };
                report(&space, &steps, &mut progress, on_plan)?;
                bound = measured;
                let mut left = match limits.anytime {
                    true => limits.evaluations,
                    false => SHORT_IMPROVEMENT.max(2 * progress.counts.evaluated),
                };
                progress.reason = Reason::Enough;
                let mut weights = WEIGHTS.iter().peekable();
                while let Some(&&weight) = weights.peek() {
                    let before = progress.counts.evaluated;
                    let end =
                        phase(&space, &mut relaxed, Some(weight), bound, left, &limits, stop, &mut progress)?;
                    left = left.saturating_sub(progress.counts.evaluated - before);
                    match end {
                        End::Found(mut steps) => {
                            if let Some((better, _)) = space.replay(&mut steps)? {
                                report(&space, &steps, &mut progress, on_plan)?;
                                measured = better;
                                bound = measured;
                            }
                            weights.next();
                            if weights.peek().is_none() {
                                weights = WEIGHTS[3..].iter().peekable();
                            }
                        }
                        End::Exhausted => {
                            progress.reason = Reason::Exhausted;
                            break;
                        }
                        End::Budget => break,
                        End::Stopped => {
                            progress.reason = Reason::Stopped;
                            break;
                        }
                        End::Memory => {
                            progress.reason = Reason::Memory;
                            break;
                        }
                    }
                }
                return Ok(progress);
            }
            End::Exhausted => progress.reason = Reason::Exhausted,
            End::Budget | End::Stopped => {
                progress.reason = Reason::Stopped;
                return Ok(progress);
            }
            End::Memory => {
                progress.reason = Reason::Memory;
                return Ok(progress);
            }
        }
    }
    Ok(progress)
}

#[allow(clippy::too_many_arguments)]
fn phase(
    space: &Space,
    relaxed: &mut Relaxed,
    weight: Option<f64>,
    bound: f64,
    evaluations: u64,
    limits: &Limits,
    stop: &dyn Fn() -> bool,
    progress: &mut Progress,
) -> Result<End, Failure> {
    let manner = Manner { weight, bound, evaluations, memory_bytes: limits.memory_bytes };
    let (end, counts) = Search::new(space, relaxed, manner).run(stop)?;
    progress.counts.evaluated += counts.evaluated;
    progress.counts.expanded += counts.expanded;
    Ok(end)
}

fn report(
    space: &Space,
    steps: &[Step],
    progress: &mut Progress,
    on_plan: &mut dyn FnMut(&[Timed]) -> Result<(), Failure>,
) -> Result<(), Failure> {
    let Ok(ordered) = space.order(steps) else { return Ok(()) };
    let mut plan: Vec<Timed> = ordered
        .starts
        .iter()
        .map(|&(index, start, end)| {
            let start_s = ordered.order.earliest_s(start);
            let duration_s = end.map_or(0.0, |end| {
                let span = steps[index].span;
                let taken_s = ordered.order.earliest_s(end) - start_s;
                // Exact where the duration is fixed: differences of times carry rounding.
                if span.least_s == span.most_s { span.least_s } else { taken_s.max(span.least_s) }
            });
            Timed { step: steps[index].clone(), start_s, duration_s }
        })
        .collect();
    plan.sort_by(|a, b| a.start_s.total_cmp(&b.start_s));
    debug_assert!(plan.iter().all(|timed| matches!(timed.step.part, Part::Whole | Part::Start)));
    progress.plans += 1;
    on_plan(&plan)?;
    progress.best = Some(plan);
    Ok(())
}
