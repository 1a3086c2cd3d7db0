//! Tests of `wording`.

use descry_explain::wording::*;

#[test]
fn lines_are_as_long_as_asked_and_calls_stay_whole() {
    let text = "go from here (move start table-5) to there and (observe table-5 table) look";
    let lines = wrapped(text, "- ", 30);
    assert!(lines.lines().all(|l| l.chars().count() <= 30), "{lines}");
    assert!(lines.contains("(move start table-5)") && lines.contains("(observe table-5 table)"), "{lines}");
    let back: Vec<&str> = lines.trim_start_matches("- ").split_whitespace().collect();
    assert_eq!(back.join(" "), text);
    assert_eq!(wrapped("", "- ", 30), "- ");
    let passing = wrapped("cup A with 0.80 (other cup 0.10, mug 0.05)", "", 26);
    assert_eq!(passing, "cup A with 0.80 (other cup\n0.10, mug 0.05)");
}

#[test]
fn what_has_the_same_share_is_said_together() {
    let check = |all: &[(f64, &str)], said: &str| {
        assert_eq!(by_share(all.iter().map(|(value, of)| (*value, of.to_string()))), said);
    };
    check(&[], "");
    check(&[(0.5, "on a")], "0.50 on a");
    check(&[(0.5, "on a"), (0.075, "on b"), (0.0751, "on c")], "0.50 on a; 0.075 each on b and on c");
}
