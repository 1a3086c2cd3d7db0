//! Schedule compression: shortens a plan after the search.
//!
//! A sequence of steps orders only those that interfere, but it may order these unfavourably.
//! Happenings are the nodes of a simple temporal network (Dechter, Meiri and Pearl 1991), with edges
//! for durations, for the order of interfering happenings, and for timed literals. The longest path in
//! the network determines the makespan: only a step that changes places with a neighbour on that path
//! can shorten the plan (as in the neighbourhoods of van Laarhoven, Aarts and Lenstra 1992).

use petgraph::algo::bellman_ford;
use petgraph::graph::{DiGraph, NodeIndex};

use crate::calls::Failure;

use super::advance::{Part, TemporalStep};
use super::order::Order;
use super::space::{Base, Space, Track};

/// Maximum number of steps replayed for one plan.
const MOST_REPLAYED: usize = 50_000;

/// Result of replaying a plan: its measure, its steps, and the situation at its end.
pub(crate) type Replayed = (f64, Vec<TemporalStep>, Base);

/// Plan in which steps on the critical path change places while this improves the plan; never worse
/// than before. The result is a complete replay.
pub(crate) fn tightened(
    space: &Space,
    mut plan: Replayed,
    stop: &dyn Fn() -> bool,
) -> Result<Replayed, Failure> {
    if !space.timed_measure() {
        return Ok(plan);
    }
    let mut left = MOST_REPLAYED;
    'improved: loop {
        // The longest path of a long plan takes its time.
        if left <= plan.1.len() || stop() {
            return Ok(plan);
        }
        for (before, after) in critical_pairs(&plan.1, &plan.2.track) {
            for (from, to) in [(after, before), (before, after)] {
                left = left.saturating_sub(plan.1.len());
                if left == 0 || stop() {
                    return Ok(plan);
                }
                let mut steps = plan.1.clone();
                let moved = steps.remove(from);
                steps.insert(to, moved);
                if let Some((measured, base)) = space.replay_to_goal(&mut steps, stop)?
                    && measured < plan.0 - 1e-6
                {
                    plan = (measured, steps, base);
                    continue 'improved;
                }
            }
        }
        return Ok(plan);
    }
}

/// Pairs of different steps that follow each other on the longest path of the network, last pair first.
fn critical_pairs(steps: &[TemporalStep], track: &Track) -> Vec<(usize, usize)> {
    let path = longest_path(&track.order);
    let step_of = steps_of(steps, track);
    let mut pairs: Vec<(usize, usize)> = Vec::new();
    for pair in path.windows(2) {
        let (Some(after), Some(before)) = (step_of[pair[0]], step_of[pair[1]]) else { continue };
        if before < after && !pairs.contains(&(before, after)) {
            pairs.push((before, after));
        }
    }
    pairs
}

/// Happenings on a longest path of the network, from the end of the plan to its beginning.
pub fn longest_path(order: &Order) -> Vec<usize> {
    let mut network: DiGraph<(), f64> = DiGraph::with_capacity(order.len() + 1, 4 * order.len());
    let begin = network.add_node(());
    let happenings: Vec<NodeIndex> = (0..order.len()).map(|_| network.add_node(())).collect();
    // The shortest path over distances with their signs turned is the longest.
    happenings.iter().for_each(|&happening| {
        network.add_edge(begin, happening, 0.0);
    });
    order.distances(|from, to, gap_s| {
        let node = |happening: Option<u32>| happening.map_or(begin, |index| happenings[index as usize]);
        network.add_edge(node(from), node(to), -gap_s);
    });
    let Ok(paths) = bellman_ford(&network, begin) else { return Vec::new() };
    let own = happenings.iter().enumerate().filter(|&(index, _)| !order.is_given(index));
    let ends = own.map(|(_, &node)| node);
    let last = ends.min_by(|a, b| paths.distances[a.index()].total_cmp(&paths.distances[b.index()]));
    let mut path = Vec::new();
    let mut node = last;
    while let Some(happening) = node.filter(|&node| node != begin && path.len() <= happenings.len()) {
        path.push(happening.index() - 1);
        node = paths.predecessors[happening.index()];
    }
    path
}

/// Step to which each happening belongs; `None` for timed literals.
fn steps_of(steps: &[TemporalStep], track: &Track) -> Vec<Option<usize>> {
    let mut step_of = vec![None; track.order.len()];
    let mut open: Vec<usize> = Vec::new();
    for (index, step) in steps.iter().enumerate() {
        match step.part {
            Part::Whole | Part::Start => {
                let Some((start, end)) = track.actions[index] else { continue };
                step_of[start as usize] = Some(index);
                match end {
                    Some(end) if step.part == Part::Whole => step_of[end as usize] = Some(index),
                    _ => open.push(index),
                }
            }
            Part::End => {
                let same =
                    |&start: &usize| steps[start].act == step.act && steps[start].proposal == step.proposal;
                let started = open.iter().position(same).map(|position| open.remove(position));
                let end = started.and_then(|start| track.actions[start]).and_then(|(_, end)| end);
                if let Some(end) = end {
                    step_of[end as usize] = Some(index);
                }
            }
            Part::Free => {}
        }
    }
    step_of
}
