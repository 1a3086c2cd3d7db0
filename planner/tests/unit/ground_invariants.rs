//! Tests of `ground::invariants`.

use super::small;
use std::collections::BTreeSet;

#[test]
fn where_something_is_it_is_alone() {
    let (task, grounded) = small::read(small::SHUTTLE, small::ROW);
    let named = |variable: u32, value: u32| {
        small::fact(&task, &grounded, descry_planner::ground::GroundFact { variable, value })
    };
    let variables = grounded.variables.iter().enumerate();
    let groups: Vec<BTreeSet<String>> = variables
        .map(|(index, variable)| (0..variable.values.len() as u32).map(|v| named(index as u32, v)).collect())
        .collect();
    for expected in
        [&["(at a)", "(at b)", "(at c)"][..], &["(in x)", "(lies x a)", "(lies x b)", "(lies x c)"]]
    {
        let holds = |group: &BTreeSet<String>| expected.iter().all(|name| group.contains(*name));
        assert!(groups.iter().any(holds), "{expected:?} share no variable: {groups:?}");
    }
}
