//! One vessel is poured into another one, and what is in which is known then, to later runs too; of what nobody has poured it is not.

use std::path::Path;

use descry_domains::abilities::searching::policies;
use descry_domains::conclusion::Verdict;
use descry_domains::load::Domain;

use crate::lived::{Lived, lived_after};

const POUR: &str = "pour green cup into bowl";

/// The domain of the cookbook, and what is asked of it after other runs that kept what they knew in a store.
fn runs(scene: &str, store: &Path, said: &[&str]) -> Vec<Lived> {
    let domain = Path::new(env!("CARGO_MANIFEST_DIR")).join("../docs/cookbook/pour");
    let domain = Domain::load(&domain.display().to_string()).expect("a domain");
    let store = store.display().to_string();
    let run = |said: &&str| lived_after(Some(&store), &domain, said, scene, 1, policies::PLAN);
    said.iter().map(|said| run(said).unwrap_or_else(|e| panic!("{said}: {e}"))).collect()
}

/// Contents poured and spilt, as the simulator knows them.
fn events(lived: &Lived) -> Vec<&str> {
    let said = lived.truth[1].events.iter().map(|event| event.what.as_str());
    said.filter(|what| what.contains("pour") || what.contains("spil")).collect()
}

#[test]
fn what_was_poured_is_known_and_what_nobody_poured_is_not() {
    let scratch = tempfile::TempDir::new().expect("a folder can be made");
    let asked = ["is there water in bowl", POUR, "is there water in bowl"];
    let [before, pours, after] = &runs("default", &scratch.path().join("store"), &asked)[..] else {
        panic!()
    };
    let verdicts = [before, pours, after].map(|run| run.report.verdict);
    let why = [before, pours, after].map(|run| &run.report.why);
    assert_eq!(verdicts, [Verdict::CannotTell, Verdict::Achieved, Verdict::Achieved], "{why:?}");
    assert_eq!(events(pours), ["the hand pours 0.20 l of \"green cup\" into \"bowl\""]);
    let works = |run: &Lived| -> Vec<String> {
        let actions = run.done.iter().map(|(call, _)| call.action.clone());
        actions.filter(|action| !["move", "observe"].contains(&action.as_str())).collect()
    };
    let worked = works(pours);
    let ends = [worked.first(), worked.last()].map(|action| action.map(String::as_str));
    assert_eq!(ends, [Some("pick-up"), Some("pour")], "{worked:?}");
    for question in [before, after] {
        assert!(works(question).is_empty() && events(question).is_empty(), "a question pours nothing");
    }
}
