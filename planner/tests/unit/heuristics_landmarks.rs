//! Tests of `heuristics::landmarks`.

use super::small;
use descry_planner::classical::compiled::Compiled;
use descry_planner::ground::GroundFact;
use descry_planner::heuristics::landmarks::Landmarks;

#[test]
fn what_every_plan_passes_is_found() {
    let (task, grounded) = small::read(small::SHUTTLE, small::ROW);
    let compiled = Compiled::new(&grounded);
    let landmarks = Landmarks::new(&compiled, &grounded.mutex_groups, &|| false);
    let variable = |id: u32| compiled.variables[id as usize];
    let named = |id: u32| {
        let value = id - compiled.offsets[variable(id) as usize];
        small::fact(&task, &grounded, GroundFact { variable: variable(id), value })
    };
    let single = landmarks.all.iter().filter(|landmark| landmark.facts.len() == 1);
    let found: Vec<String> = single.map(|landmark| named(landmark.facts[0])).collect();
    for expected in ["(lies x c)", "(in x)", "(at c)", "(at b)"] {
        assert!(found.iter().any(|name| name == expected), "{expected} is not among {found:?}");
    }
    let goals = landmarks.all.iter().filter(|landmark| landmark.goal);
    assert_eq!(goals.map(|landmark| named(landmark.facts[0])).collect::<Vec<_>>(), ["(lies x c)"]);
}

/// Facts that the delete relaxation reaches if some facts never become true: operators without axioms, applied
/// until nothing changes.
fn reached(task: &Compiled, without: &[u32]) -> Vec<bool> {
    let mut reached = vec![false; task.facts];
    task.offsets
        .iter()
        .zip(&task.initial)
        .for_each(|(offset, value)| reached[(offset + value) as usize] = true);
    loop {
        let applicable = |operator: &usize| {
            task.preconditions.get(*operator).iter().all(|&fact| reached[task.id(fact) as usize])
        };
        let added: Vec<u32> = (0..task.operators())
            .filter(applicable)
            .flat_map(|operator| task.effects.get(operator).iter().map(|effect| task.id(effect.fact)))
            .filter(|fact| !reached[*fact as usize] && !without.contains(fact))
            .collect();
        if added.is_empty() {
            return reached;
        }
        added.into_iter().for_each(|fact| reached[fact as usize] = true);
    }
}

/// Boxes on a ring of places with a road across, of which some can be carried both ways round.
fn rings() -> impl Iterator<Item = String> {
    (3..8usize).flat_map(|places| {
        (1..places).map(move |across| {
            let road = |(from, to): (usize, usize)| format!("(road p{from} p{to})");
            let ring = (0..places).flat_map(|p| [(p, (p + 1) % places), ((p + 2) % places, p)]);
            let roads: String = ring.chain([(0, across)]).map(road).collect();
            let names: String = (0..places).map(|p| format!("p{p} ")).collect();
            format!(
                "(define (problem ring) (:domain shuttle) (:objects {names}- place x y - box)
                  (:init (at p0) (free) (lies x p1) (lies y p{across}) {roads})
                  (:goal (and (lies x p{across}) (lies y p0))))"
            )
        })
    })
}

#[test]
fn no_goal_is_reached_without_a_landmark() {
    let mut found = 0;
    for problem in rings().chain([small::ROW.to_string()]) {
        let (_, grounded) = small::read(small::SHUTTLE, &problem);
        let task = Compiled::new(&grounded);
        let is_goal = |reached: &[bool]| task.goal.iter().all(|&fact| reached[task.id(fact) as usize]);
        assert!(is_goal(&reached(&task, &[])), "{problem}");
        let landmarks = Landmarks::new(&task, &grounded.mutex_groups, &|| false);
        let initial = |fact: &u32| reached_at_once(&task, *fact);
        for landmark in landmarks.all.iter().filter(|landmark| !landmark.facts.iter().any(initial)) {
            found += 1;
            assert!(!is_goal(&reached(&task, &landmark.facts)), "{:?} in {problem}", landmark.facts);
        }
    }
    assert!(found > 50, "only {found} landmarks");
}

fn reached_at_once(task: &Compiled, fact: u32) -> bool {
    let variable = task.variables[fact as usize] as usize;
    task.offsets[variable] + task.initial[variable] == fact
}
