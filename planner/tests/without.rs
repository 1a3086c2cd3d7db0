//! Planning without some techniques, as ablation studies do.

use descry_planner::{Attachments, Options, Outcome, Source, TECHNIQUES, Task, Technique, Without, plan};

use crate::unit::small::{CELLAR, FUSES, ROW, SHUTTLE};

fn planned(domain: &str, problem: &str, without: Without) -> Outcome {
    let task = Task::read(&Source::new("domain", domain), &Source::new("problem", problem));
    let task = task.unwrap_or_else(|findings| panic!("{}", findings.render(false)));
    let options = Options { without, ..Options::default() };
    plan(&task, &Attachments::new(), &options, &|| false, &mut |_| {}).expect("the task is handled")
}

#[test]
fn plans_and_proofs_are_found_without_any_one_technique() {
    let empty_handed = ROW.replace("(lies x c)))", "(and (lies x c) (in x))))");
    for (technique, name, _) in TECHNIQUES {
        assert_eq!((Technique::named(name), technique.name()), (Some(technique), name));
        for (domain, problem) in [(SHUTTLE, ROW), (CELLAR, FUSES)] {
            let found = planned(domain, problem, Without::from_iter([technique]));
            assert!(matches!(found, Outcome::Solved { .. }), "without {name}: {found:?}");
        }
        let found = planned(SHUTTLE, &empty_handed, Without::from_iter([technique]));
        assert!(matches!(found, Outcome::Unsolvable { .. }), "without {name}: {found:?}");
    }
}

#[test]
fn without_any_search_nothing_is_claimed() {
    let searches = descry_planner::portfolio::PORTFOLIO.iter().map(|configuration| configuration.technique);
    let found = planned(SHUTTLE, ROW, searches.collect());
    assert!(matches!(found, Outcome::OutOfTime { best: None, .. }), "{found:?}");
}
