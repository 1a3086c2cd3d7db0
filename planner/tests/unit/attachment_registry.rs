//! Tests of `attachment::registry`.

use descry_planner::attachment::Reading;
use descry_planner::attachment::registry::*;
use descry_planner::attachment::{Answer, Attachment, Call, CallError, CallKind, FactValue, Level, Read};

fn call(kind: CallKind, arguments: &[&str], readings: &[(&str, FactValue)]) -> Call {
    Call {
        module: "m".into(),
        kind,
        arguments: arguments.iter().map(|&name| name.into()).collect(),
        readings: readings
            .iter()
            .map(|(symbol, value)| Reading {
                symbol: (*symbol).into(),
                arguments: [].into(),
                value: value.clone(),
            })
            .collect(),
    }
}

struct Half;
impl Attachment for Half {
    fn reads(&self) -> Vec<Read> {
        vec![Read::All("x".to_string())]
    }
    fn evaluate(&self, call: &Call) -> Result<Answer, CallError> {
        Ok(Answer::Number(call.number("x", &[])? / 2.0))
    }
    fn relaxed(&self, _: &Call) -> Option<Result<Answer, CallError>> {
        Some(Ok(Answer::Number(0.0)))
    }
}

#[test]
fn the_cache_distinguishes_arguments_readings_and_level() {
    let mut attachments = Attachments::new();
    attachments.insert("half", Half);
    let ask = |arguments: &[&str], x: f64, level| {
        let readings = [("x", FactValue::Number(x))];
        attachments.call("half", &call(CallKind::Cost, arguments, &readings), level)
    };
    for (arguments, x, level, expected) in [
        (["a"], 4.0, Level::Exact, 2.0),
        (["a"], 4.0, Level::Exact, 2.0),
        (["b"], 4.0, Level::Exact, 2.0),
        (["a"], 6.0, Level::Exact, 3.0),
        (["a"], 6.0, Level::Relaxed, 0.0),
        (["a"], 6.0, Level::Relaxed, 0.0),
    ] {
        assert_eq!(ask(&arguments, x, level), Ok(Answer::Number(expected)));
    }
    let counts = attachments.statistics()["half"];
    assert_eq!((counts.calls, counts.relaxed, counts.hits), (3, 1, 2));
}

#[test]
fn names_resolve_by_binding_then_by_module() {
    let mut attachments = Attachments::new();
    let truth = |_: &Call| Ok(Answer::Truth(true));
    attachments.insert("pathCost", truth);
    attachments.insert("can-see", truth);
    for (binding, module, expected) in [
        ("pathCost@libnav.so", "path-cost", Some("pathCost")),
        ("other@libnav.so", "can-see", Some("can-see")),
        ("PATHCOST@libnav.so", "x", Some("pathCost")),
        ("other@libnav.so", "x", None),
    ] {
        assert_eq!(attachments.resolve(binding, module), expected, "{binding}");
    }
}

#[test]
fn answers_that_do_not_fit_are_errors_with_the_call() {
    let mut attachments = Attachments::new();
    attachments.insert("nan", |_: &Call| Ok(Answer::Number(f64::NAN)));
    attachments.insert("curious", |call: &Call| call.truth("door-open", &["d"]).map(Answer::Truth));
    let nan = attachments.call("nan", &call(CallKind::Cost, &["a", "b"], &[]), Level::Exact);
    assert_eq!(
        nan.map_err(|error| error.to_string()),
        Err("module [m a b] (attachment `nan`) failed: answered Number(NaN), expected a number from 0 to infinity"
            .to_string())
    );
    let undeclared = attachments.call("curious", &call(CallKind::Condition, &[], &[]), Level::Exact);
    let error = undeclared.expect_err("the fact was not declared").to_string();
    assert!(error.contains("(door-open d) is not among the facts"), "{error}");
    let unknown = attachments.call("gone", &call(CallKind::Condition, &[], &[]), Level::Exact);
    assert!(unknown.is_err_and(|error| error.to_string().contains("no attachment of this name")));
}

#[test]
fn a_batch_asks_only_what_the_cache_does_not_know() {
    let mut attachments = Attachments::new();
    attachments.insert("same", |call: &Call| Ok(Answer::Truth(&*call.arguments[0] == "a")));
    let calls = ["a", "b", "a"].map(|name| call(CallKind::Condition, &[name], &[]));
    assert_eq!(attachments.call("same", &calls[0], Level::Exact), Ok(Answer::Truth(true)));
    let answers = attachments.call_all("same", &calls);
    assert_eq!(answers, [true, false, true].map(|truth| Ok(Answer::Truth(truth))));
    let counts = attachments.statistics()["same"];
    assert_eq!((counts.calls, counts.hits), (2, 2));
}
