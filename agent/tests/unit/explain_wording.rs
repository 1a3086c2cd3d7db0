//! Tests of `explain::wording`.

use descry_agent::explain::wording::*;

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

#[test]
fn shares_say_something_near_their_ends() {
    let cases = [
        (0.0, "0.00"),
        (-0.0, "0.00"),
        (-1e-9, "0.00"),
        (0.5, "0.50"),
        (0.004, "0.004"),
        (0.0174, "0.017"),
        (0.05, "0.05"),
        (0.00001, "0.00"),
        (0.9996, "0.9996"),
        (0.99999, "1.00"),
        (1.0, "1.00"),
        (9.1364, "9.14"),
    ];
    cases.iter().for_each(|(value, text)| assert_eq!(share(*value), *text));
    assert_eq!([share_of(0.89967, 0.9), share_of(0.912, 0.9)], ["0.8996", "0.91"]);
}
