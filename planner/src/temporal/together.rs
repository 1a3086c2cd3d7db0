//! Detection of actions that may have to start, or to end, at the very same time.
//!
//! An over-all condition must hold strictly between start and end of its action. So two actions may
//! have to start at one time if each achieves the over-all condition of the other, and to end at one
//! time if each deletes it. The search orders all happenings and finds no such plan: where there may be
//! such actions, its exhaustion proves nothing.

use petgraph::algo::tarjan_scc;
use petgraph::graph::DiGraph;
use rustc_hash::FxHashMap;

use crate::ground::{GroundEffect, GroundOutcome};

use super::advance::derived_roots;
use super::touch::Touched;
use super::world::{Act, World};

/// Resource that is held or set, and its value; `None` for any value, and for numbers.
type Place = (u32, Option<u32>);

/// True if some actions may only be able to start, or to end, at the very same time; judged from the
/// actions alone.
pub(super) fn some_only_together(world: &World) -> bool {
    let roots = derived_roots(world);
    let held: Vec<Vec<Place>> = world.acts.iter().map(|act| held(world, &roots, act)).collect();
    let mut given = held.clone();
    for (act, held) in world.acts.iter().zip(&mut given) {
        let own: Vec<Place> = act.start_effects.iter().flat_map(|effect| set(world, effect)).collect();
        let asked = |variable: u32| act.at_start.facts.iter().any(|fact| fact.variable == variable);
        held.retain(|place| !asked(place.0) && !own.contains(place));
    }
    let gives = |held: Option<u32>, value: Option<u32>| held.is_none() || value.is_none() || held == value;
    let mut taken = held;
    for (act, held) in world.acts.iter().zip(&mut taken) {
        held.retain(|place| !act.at_end.facts.iter().any(|fact| fact.variable == place.0));
    }
    let takes = |held: Option<u32>, value: Option<u32>| held.is_none() || value.is_none() || held != value;
    in_a_circle(world, &given, |act| act.start_effects, gives)
        || in_a_circle(world, &taken, |act| act.end_effects, takes)
}

/// True if some actions form a cycle in which each holds a resource on which an effect of the next one
/// acts; `meets` decides this from the held value and the value set.
fn in_a_circle<'w>(
    world: &World<'w>,
    held: &[Vec<Place>],
    effects: impl Fn(&Act<'w>) -> &'w [GroundEffect],
    meets: impl Fn(Option<u32>, Option<u32>) -> bool,
) -> bool {
    // Actions are the first nodes, then the places that some of them hold.
    let acts = held.len() as u32;
    let mut nodes: FxHashMap<u32, Vec<(Option<u32>, u32)>> = FxHashMap::default();
    let mut edges: Vec<(u32, u32)> = Vec::new();
    let mut next = acts;
    for (act, &(resource, value)) in
        (0..acts).zip(held).flat_map(|(act, held)| held.iter().map(move |place| (act, place)))
    {
        let values = nodes.entry(resource).or_default();
        let node = values.iter().find(|(known, _)| *known == value).map_or(next, |&(_, node)| node);
        if node == next {
            values.push((value, node));
            next += 1;
        }
        edges.push((node, act));
    }
    for (act, effect) in
        (0..acts).zip(&world.acts).flat_map(|(act, own)| effects(own).iter().map(move |effect| (act, effect)))
    {
        for (resource, value) in set(world, effect) {
            let values = nodes.get(&resource).map_or(&[][..], Vec::as_slice);
            edges.extend(values.iter().filter(|(held, _)| meets(*held, value)).map(|&(_, node)| (act, node)));
        }
    }
    let circles = tarjan_scc(&DiGraph::<(), ()>::from_edges(edges));
    circles.iter().any(|circle| circle.iter().filter(|node| node.index() < acts as usize).count() > 1)
}

/// Resources of an action's over-all condition. Numeric bounds are left out: of simultaneous changes,
/// those that keep a bound can come first.
fn held(world: &World, roots: &[Vec<u32>], act: &Act) -> Vec<Place> {
    let mut places = Vec::new();
    for fact in &act.over_all.facts {
        match roots[fact.variable as usize].as_slice() {
            [] => places.push((fact.variable, Some(fact.value))),
            roots => places.extend(roots.iter().map(|&root| (root, None))),
        }
    }
    let mut touched = Touched::default();
    for &comparison in &act.over_all.comparisons {
        if !world.ground.comparisons[comparison as usize].relation.is_bound() {
            touched.comparison(world, comparison);
        }
    }
    act.over_all.calls.iter().for_each(|&(call, _)| touched.call(world, call));
    places.extend(touched.resources(roots.len()).into_iter().map(|resource| (resource, None)));
    places
}

/// Resources that an effect changes, with the value set.
fn set(world: &World, effect: &GroundEffect) -> Vec<Place> {
    if let GroundOutcome::Set(fact) = &effect.outcome {
        return vec![(fact.variable, Some(fact.value))];
    }
    let mut touched = Touched::default();
    touched.outcome(world, &effect.outcome);
    touched.resources(world.ground.variables.len()).into_iter().map(|resource| (resource, None)).collect()
}
