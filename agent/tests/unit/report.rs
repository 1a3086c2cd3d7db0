//! Tests of `report`.

use descry_agent::report::*;
use descry_domains::goal;
use descry_domains::lexicon::{Lexicon, Places};
use descry_domains::load::Domain;

#[test]
fn what_is_in_the_hand_stands_nowhere() {
    let domain = Domain::load("home").unwrap();
    let lexicon = Lexicon::new(&domain, &Places::default());
    let goal = goal::read("pick up cup A", &domain, &lexicon).unwrap();
    let check = |object: Option<&str>, position_m: Option<[f64; 3]>, expected: &str| {
        let seen = serde_json::json!({
            "label": "the red one", "confidence": 0.97, "position_m": position_m,
            "size_m": [0.07, 0.07, 0.1], "asked": true,
        });
        let report = Report {
            object: object.map(str::to_string),
            confidence: 0.97,
            position_m,
            objects: vec![serde_json::from_value(seen).unwrap()],
            ..Report::begin(&goal, "run".into())
        };
        let said = report.to_string();
        assert!(said.contains(expected), "{expected}: {said}");
        assert_eq!(said.contains(" m, 97 %"), said.contains(" at ("), "{said}");
    };
    let one = Some("the red one");
    check(one, None, "  the red one in the hand, 97 % sure\n");
    check(one, Some([1.0, 2.0, 0.8]), "  the red one at (1.00, 2.00, 0.80) m, 97 % sure\n");
    check(None, None, "  the red one        97 % sure in the hand\n");
}

#[test]
fn no_time_is_said_to_be_none() {
    let cases = [
        (0.0, "less than 1 ms"),
        (0.0004, "less than 1 ms"),
        (0.0021, "2 ms"),
        (0.9, "900 ms"),
        (1.26, "1.3 s"),
    ];
    cases.iter().for_each(|(time_s, said)| assert_eq!(brief(*time_s), *said));
}
