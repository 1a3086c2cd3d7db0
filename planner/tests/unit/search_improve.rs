//! Tests of `search::improve`.

use super::small;
use descry_planner::classical::compiled::Compiled;
use descry_planner::classical::successor::Successors;
use descry_planner::search::improve::Improve;

/// Improves a plan of the task; how many steps are left.
fn check(steps: &[&str], expected: usize) {
    let (task, grounded) = small::read(small::SHUTTLE, small::ROW);
    let compiled = Compiled::new(&grounded);
    let successors = Successors::new(&compiled);
    let number = |name: &&str| {
        let all = 0..grounded.actions.len();
        all.map(|index| small::action(&task, &grounded, index)).position(|own| own == **name)
    };
    let mut plan: Vec<u32> =
        steps.iter().map(|name| number(name).expect("the action is there") as u32).collect();
    let mut improve = Improve::new(&compiled, &successors, &|| false);
    improve.run(&mut plan, 1_000_000, &mut |_| {});
    let mut state = compiled.initial.clone();
    for &operator in &plan {
        assert!(compiled.applicable(operator, &state), "{plan:?}");
        compiled.advance(operator, &mut state);
    }
    assert!(compiled.is_goal(&state));
    assert_eq!(plan.len(), expected, "{plan:?}");
}

#[test]
fn detours_go() {
    check(&["(take x a)", "(go a b)", "(go b c)", "(put x c)"], 4);
    check(&["(go a b)", "(go b a)", "(take x a)", "(go a b)", "(go b c)", "(put x c)"], 4);
    let twice = ["(take x a)", "(go a b)", "(put x b)", "(go b a)", "(go a b)", "(take x b)", "(go b c)"];
    check(&[&twice[..], &["(put x c)"]].concat(), 4);
}
