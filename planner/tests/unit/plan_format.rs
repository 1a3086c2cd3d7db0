//! Tests of `plan::format`.

use descry_planner::diagnostic::Source;
use descry_planner::plan::Plan;

#[test]
fn plans_are_laid_out_and_read_as_before() {
    for (text, expected) in [
        ("", ""),
        ("(move  a b)\n\n\n\n( MOVE b c )\n;cost = 2\n", "(move a b)\n\n(MOVE b c)\n;cost = 2\n"),
        ("0:(a)[1](b)", ""),
        (
            "0 : (a x) [ 2 ] ; first\n;; second\n1.00000001: (b)[D:1; C:3]",
            "0.000: (a x) [2.000]  ; first\n;; second\n1.00000001: (b) [D:1; C:3]\n",
        ),
        ("0.5: (b) [1] 0.25: (a) [1]", "0.500: (b) [1.000]\n0.250: (a) [1.000]\n"),
    ] {
        let source = Source::new("plan", text);
        let Ok(laid_out) = Plan::format(&source) else {
            assert!(expected.is_empty() && Plan::read(&source).is_err(), "{text}");
            continue;
        };
        assert_eq!(laid_out, expected);
        let again = Source::new("plan", laid_out.as_str());
        assert_eq!(Plan::format(&again).ok().as_deref(), Some(laid_out.as_str()));
        assert_eq!(Plan::read(&source).ok(), Plan::read(&again).ok());
    }
}
