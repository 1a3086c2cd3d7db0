//! Tests of `words`.

use descry_domains::words::*;

#[test]
fn atoms_and_values_are_read() {
    let check = |text: &str, expected: Option<(&str, &[&str], Option<f64>)>| {
        let expected =
            expected.map(|(n, a, v)| vec![(n.to_string(), a.iter().map(|s| s.to_string()).collect(), v)]);
        assert_eq!(read(text).ok(), expected, "{text}");
    };
    check("(visited table-3)", Some(("visited", &["table-3"], Some(1.0))));
    check("( Raining )", Some(("raining", &[], Some(1.0))));
    check("(not (open door))", Some(("open", &["door"], None)));
    check("(= (count anna) 2.5)", Some(("count", &["anna"], Some(2.5))));
    for bad in ["visited", "(visited", "(a (b))", "(= (count anna) many)", "(visited ?x)", "()"] {
        check(bad, None);
    }
}
