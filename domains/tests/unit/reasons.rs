//! Tests of `reasons`.

use descry_domains::english::percent;
use descry_domains::reasons::*;

#[test]
fn doubt_about_all_of_a_kind_is_about_something() {
    let check = |least: Option<&str>, together: f64, hidden: f64, is_bare: bool, expected: &str| {
        assert_eq!(
            about(least.map(str::to_string), together, hidden, 0.1, is_bare),
            expected,
            "{least:?} {hidden}"
        );
    };
    let one = ", what stands at (0.10, 0.20) m is one with 60 %";
    let hides = |p: f64| format!(", there may be more where nothing was seen ({})", percent(p));
    let seen =
        |p: f64| format!(", each object that was seen is sure enough, all together are not ({})", percent(p));
    check(Some(one), 0.6, 0.05, false, one);
    check(Some(one), 0.6, 0.2, false, &format!("{one}{}", hides(0.2)));
    check(None, 0.96, 0.05, false, &hides(0.05));
    check(None, 0.89, 0.02, false, &format!("{}{}", seen(0.89), hides(0.02)));
    check(None, 0.8999, 0.005, false, &seen(0.89));
    check(None, 0.88, -1e-9, false, &seen(0.88));
    check(None, 1.0, -1e-9, true, &hides(0.0));
}

#[test]
fn what_may_be_it_is_named_as_what_it_is_rather() {
    let check = |own: &[&str], cup_a: f64, other: f64, than: f64, expected: &str| {
        let probabilities = [("cup A".to_string(), cup_a), ("other cup".to_string(), other)];
        assert_eq!(
            likelier(&probabilities, than, |name| own.contains(&name)),
            expected,
            "{own:?} {cup_a} {other}"
        );
    };
    check(&["other cup"], 0.869, 0.12, 0.12, "; rather cup A, 86 %");
    check(&["other cup"], 0.3, 0.4, 0.4, "");
    check(&["other cup"], 0.0, 0.1, 0.1, "");
    check(&["cup A", "other cup"], 0.5, 0.2, 0.7, "");
}
