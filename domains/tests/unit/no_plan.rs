//! Tests of `no_plan`.

use descry_domains::no_plan::*;
use descry_planner::{NoPlan, Refusal};

#[test]
fn refused_calls_are_told_by_what_they_ask() {
    let about = |name: &str| (name == "w").then(|| "whether it is worth it; often".to_string());
    let refused = |module: &str, answer, calls: &[&str]| NoPlan::Refused {
        module: module.into(),
        answer,
        calls: calls.iter().map(|call| call.to_string()).collect(),
    };
    let check = |reasons: &[NoPlan], said: &str| assert_eq!(told(reasons, &about), said);
    let worth = refused("w", Refusal::No, &["[w a b]", "[w c d]"]);
    check(
        &[worth, refused("v", Refusal::No, &["[v x]"])],
        "it was asked whether it is worth it, 2 times, and each time the answer was no; v is no for [v x]",
    );
    check(&[refused("v", Refusal::Impossible, &["[v x]", "[v y]"])], "v is impossible in 2 cases");
    let finding = NoPlan::Finding { message: "nothing".into(), help: Some("try".into()) };
    check(&[finding], "nothing (try)");
}
