//! Tests of `plan`.

use descry_planner::diagnostic::{Findings, Source};
use descry_planner::plan::*;

fn read(text: &str) -> Result<Plan, Findings> {
    Plan::read(&Source::new("plan", text))
}

#[test]
fn both_forms_are_read_and_written() {
    for (text, written) in [
        ("(move a b)\n(move B c)\n; cost = 2 (unit cost)\n", "(move a b)\n(move B c)\n; cost = 2\n"),
        ("0.5: (b) [1]\n0: (A x) [D:2.25; C:1]", "0.000: (a x) [2.250]\n0.500: (b) [1.000]\n"),
        ("\u{feff}(a)\r\n(b)\r\n", "(a)\n(b)\n"),
        ("; a comment\n0.333333: (a)[0.1](b)", ""),
        ("1.4285714285714286: (a) [0.1234565]", "1.4285714285714286: (a) [0.1234565]\n"),
        ("(a)\n; cost = 4.0009999999999994", "(a)\n; cost = 4.001\n"),
        ("", ""),
    ] {
        match read(text) {
            Ok(plan) => assert_eq!(plan.to_string(), written),
            Err(findings) => {
                assert!(written.is_empty(), "{findings}");
                assert!(findings.to_string().contains("some steps have a time"), "{findings}");
            }
        }
    }
}

#[test]
fn every_bad_line_is_a_finding() {
    let findings = read("0: (a) [x]\nmove a b\n1: (b) [2]\n2: (c [1]\nNaN: (d) [1]\n-1: (e) [1]\n");
    let findings = findings.expect_err("five lines are no steps");
    assert_eq!(findings.list.len(), 5, "{findings}");
}

#[test]
fn numbers_are_written_as_people_read_them() {
    for (value, written) in [
        (4.0009999999999994, "4.001"),
        (-0.0, "0"),
        (12.5, "12.5"),
        (1.0 / 3.0, "0.333333"),
        (3e-9, "3e-9"),
        (123_456_789_012.0, "123456789012"),
        (1e300, "1e300"),
        (f64::INFINITY, "inf"),
    ] {
        assert_eq!(number_text(value), written);
    }
}

#[test]
fn only_what_rounding_left_goes() {
    for (text, tidy) in [
        ("0.30000000000000004: (a) [4.0009999999999994]", "0.300: (a) [4.001]\n"),
        ("0.3343333333333333: (a) [0.3333333333333333]", "0.3343333333333333: (a) [0.3333333333333333]\n"),
        ("0.125: (a) [0.0000001]", "0.125: (a) [0.0000001]\n"),
    ] {
        assert_eq!(read(text).map(|plan| plan.tidy().to_string()).ok().as_deref(), Some(tidy));
    }
}

#[test]
fn the_makespan_is_the_last_end() {
    assert_eq!(read("0: (a) [5]\n1: (b) [1]").ok().and_then(|plan| plan.makespan_s()), Some(5.0));
    assert_eq!(read("(a)").ok().and_then(|plan| plan.makespan_s()), None);
}
