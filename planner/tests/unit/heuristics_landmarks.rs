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
