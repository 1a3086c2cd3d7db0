//! Tour improvement by local search (Croes 1958, Or 1976). If steps of one action lead from place to
//! place, such as drives, the stops of that tour are reordered or left out, and the steps between them
//! are built anew. A search that works step by step treats each order as a plan of its own, and there
//! are too many.

use std::collections::{BTreeMap, HashMap};

use crate::calls::Failure;

use super::advance::{Part, TemporalStep};
use super::schedule::Replayed;
use super::space::Space;
use super::world::World;

/// Maximum number of steps replayed for one plan.
const MOST_REPLAYED: usize = 20_000;
/// Maximum number of actions of a task for which tours are improved.
const MOST_ACTS: usize = 200_000;
/// Minimum difference of the measure at which a plan counts as better.
const BETTER: f64 = 1e-6;

/// Index of a task's actions by schema and arguments, for improving tours.
pub struct Tours<'w, 'a> {
    acts: HashMap<(u32, &'a [u32]), u32>,
    world: &'w World<'a>,
}

/// Part of a plan whose steps of one action schema lead from place to place.
struct Tour {
    /// Action schema of the travel steps.
    schema: u32,
    /// Argument position of the place where a travel step begins.
    from: usize,
    /// Argument position of the place where a travel step ends.
    to: usize,
    /// Arguments of the first travel step.
    arguments: Vec<u32>,
    /// Steps of the plan before the tour.
    before: Vec<TemporalStep>,
    /// Stops along the tour, with the steps done at each.
    stops: Vec<Stop>,
}

/// Place, with the steps done there.
#[derive(Clone)]
struct Stop {
    place: u32,
    steps: Vec<TemporalStep>,
}

impl<'w, 'a> Tours<'w, 'a> {
    /// Index of a world's actions; `None` if they are too many.
    pub fn new(world: &'w World<'a>) -> Option<Self> {
        if world.acts.len() > MOST_ACTS {
            return None;
        }
        let mut acts = HashMap::with_capacity(world.acts.len());
        for (act, n) in world.acts.iter().zip(0..) {
            acts.entry((act.origin.schema, act.origin.arguments.as_slice())).or_insert(n);
        }
        Some(Tours { acts, world })
    }

    /// Plan in which stops of tours are reordered or left out while this improves the plan. The result
    /// is a complete replay.
    pub fn rearranged(
        &self,
        space: &Space,
        mut plan: Replayed,
        stop: &dyn Fn() -> bool,
    ) -> Result<Replayed, Failure> {
        let mut left = MOST_REPLAYED;
        'better: loop {
            for tour in self.tours(&plan.1) {
                for stops in tour.orders() {
                    let Some(mut steps) = self.assembled(&tour, &stops) else { continue };
                    left = left.saturating_sub(steps.len());
                    if left == 0 || stop() {
                        return Ok(plan);
                    }
                    if let Some((measured, base)) = space.replay_to_goal(&mut steps, stop)?
                        && measured < plan.0 - BETTER
                    {
                        plan = (measured, steps, base);
                        continue 'better;
                    }
                }
            }
            return Ok(plan);
        }
    }

    /// Tours of a plan, each with at least two travel steps.
    fn tours(&self, steps: &[TemporalStep]) -> Vec<Tour> {
        let origin = |step: &TemporalStep| self.world.acts[step.act as usize].origin;
        let is_whole = |step: &TemporalStep| step.part == Part::Whole && step.proposal.is_none();
        let mut by_schema: BTreeMap<u32, Vec<usize>> = BTreeMap::new();
        for (at, step) in steps.iter().enumerate().filter(|(_, step)| is_whole(step)) {
            by_schema.entry(origin(step).schema).or_default().push(at);
        }
        let mut tours = Vec::new();
        for (schema, all) in by_schema {
            let arguments: Vec<&[u32]> =
                all.iter().map(|&at| origin(&steps[at]).arguments.as_slice()).collect();
            let Some((from, to)) = leads(&arguments) else { continue };
            let mut at = 0;
            while at < all.len() {
                let end = (at + 1..all.len()).find(|&n| !follows(arguments[n - 1], arguments[n], from, to));
                let end = end.unwrap_or(all.len());
                if end - at >= 2 {
                    let links = &all[at..end];
                    let ends = links.iter().skip(1).copied().chain([steps.len()]);
                    let stops =
                        links.iter().zip(ends).zip(&arguments[at..end]).map(|((&link, end), arguments)| {
                            Stop { place: arguments[to], steps: steps[link + 1..end].to_vec() }
                        });
                    tours.push(Tour {
                        schema,
                        from,
                        to,
                        arguments: arguments[at].to_vec(),
                        before: steps[..links[0]].to_vec(),
                        stops: stops.collect(),
                    });
                }
                at = end;
            }
        }
        tours
    }

    /// Plan with other stops in a tour; `None` if no action leads from one stop to the next.
    fn assembled(&self, tour: &Tour, stops: &[Stop]) -> Option<Vec<TemporalStep>> {
        let mut steps = tour.before.clone();
        let mut at = tour.arguments[tour.from];
        for stop in stops {
            if stop.place != at {
                let mut arguments = tour.arguments.clone();
                (arguments[tour.from], arguments[tour.to]) = (at, stop.place);
                steps.push(TemporalStep::whole(*self.acts.get(&(tour.schema, arguments.as_slice()))?));
                at = stop.place;
            }
            steps.extend(stop.steps.iter().cloned());
        }
        Some(steps)
    }
}

impl Tour {
    /// Variants of the stops: each one left out, each section reversed, and each one moved elsewhere.
    fn orders(&self) -> impl Iterator<Item = Vec<Stop>> + '_ {
        let all = self.stops.len();
        let less = (0..all).map(|n| {
            let mut stops = self.stops.clone();
            stops.remove(n);
            stops
        });
        let pairs = || (0..all).flat_map(move |a| (0..all).map(move |b| (a, b)));
        let turned = pairs().filter(|(a, b)| a < b).map(|(a, b)| {
            let mut stops = self.stops.clone();
            stops[a..=b].reverse();
            stops
        });
        // Neighbours that change places have been turned round.
        let moved = pairs().filter(|(a, b)| a.abs_diff(*b) > 1).map(|(a, b)| {
            let mut stops = self.stops.clone();
            let one = stops.remove(a);
            stops.insert(b, one);
            stops
        });
        less.chain(turned).chain(moved)
    }
}

/// Argument positions of origin and destination that most consecutive steps of an action agree with;
/// `None` if none do.
fn leads(all: &[&[u32]]) -> Option<(usize, usize)> {
    let width = all.first()?.len();
    let pairs =
        (0..width).flat_map(|from| (0..width).map(move |to| (from, to))).filter(|(from, to)| from != to);
    let count = |&(from, to): &(usize, usize)| {
        all.windows(2).filter(|pair| follows(pair[0], pair[1], from, to)).count()
    };
    let (most, best) = pairs.map(|pair| (count(&pair), pair)).max_by_key(|(count, _)| *count)?;
    (most > 0).then_some(best)
}

/// True if a step begins at the place where the step before it has ended, with all other arguments
/// equal.
fn follows(first: &[u32], second: &[u32], from: usize, to: usize) -> bool {
    let is_same = |n: usize| n == from || n == to || first[n] == second[n];
    first[to] == second[from] && (0..first.len()).all(is_same)
}
