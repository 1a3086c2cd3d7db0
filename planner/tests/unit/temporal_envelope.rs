//! Tests of `temporal::envelope`.

use super::small;
use descry_planner::attachment::Attachments;
use descry_planner::calls::Calls;
use descry_planner::temporal::envelope::{all_apart, envelopes, in_one_go_suffices};
use descry_planner::temporal::world::World;

/// Checks for each schema whether its start and end are apart, and whether compressed actions suffice.
fn check(domain: &str, expected: &[(&str, bool)], suffices: bool) {
    let (task, grounded) = small::read(domain, small::FUSES);
    let nobody = Attachments::default();
    let calls = Calls::bind(&task, &grounded, &nobody).expect("nothing to bind");
    let world = World::new(&task, &grounded, calls);
    for (act, apart) in world.acts.iter().zip(envelopes(&world)) {
        let name = &task.actions[act.origin.schema as usize].name;
        let own = expected.iter().find(|(expected, _)| expected == name);
        assert_eq!(own.map(|own| own.1), Some(apart), "{name}");
    }
    assert!(all_apart(&world).iter().all(|apart| *apart));
    assert_eq!(in_one_go_suffices(&world).is_some(), suffices);
}

#[test]
fn what_gives_something_while_it_lasts_is_apart() {
    check(small::CELLAR, &[("burn", true), ("mend", false)], false);
    // Light that stays needs nobody inside.
    let lasting = small::CELLAR.replace(" (at end (not (light)))", "");
    check(&lasting, &[("burn", false), ("mend", false)], true);
}
