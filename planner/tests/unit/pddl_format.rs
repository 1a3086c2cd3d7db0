//! Tests of `pddl::format`.

use descry_planner::diagnostic::Source;
use descry_planner::pddl::format::*;

fn check(text: &str, expected: &str) {
    let once = format(&Source::new("t", text)).expect("it is balanced");
    assert_eq!(once, expected);
    assert_eq!(format(&Source::new("t", once.as_str())).expect("it is balanced"), once);
}

#[test]
fn parts_of_a_domain_stand_in_lines_of_their_own() {
    check(
        "(define (domain d) (:types a b - object)\n\n\n(:action go :parameters (?x - a)\n:precondition\n (and (at ?x)\n(not (on ?x) )  )\n :effect (and\n(at ?x)\n) )\n)",
        "(define (domain d)\n  (:types a b - object)\n\n  (:action go\n    :parameters (?x - a)\n    :precondition (and (at ?x)\n                       (not (on ?x)))\n    :effect (and\n      (at ?x))))\n",
    );
}

#[test]
fn comments_stay_with_what_they_are_about() {
    check(
        ";; a\n(define (domain d) ; b\n(:predicates\n  (p) ;c\n      (longer ?x);d\n\n ; e\n\n\n (q) ; f\n ) ; g\n)\n; h",
        ";; a\n(define (domain d) ; b\n  (:predicates\n    (p)          ;c\n    (longer ?x)  ;d\n\n    ; e\n\n    (q)  ; f\n    )    ; g\n  )\n; h\n",
    );
    let aligned = "(:types\n  pose        ; somewhere\n  surface     ; a table\n  kind)       ; a kind\n";
    check(aligned, aligned);
}

#[test]
fn what_is_too_wide_is_broken_where_it_means_something() {
    let fact = "(connected the-first-very-long-place the-second-very-long-place)";
    check(&format!("(:goal (and {fact} {fact}))"), &format!("(:goal (and\n  {fact}\n  {fact}))\n"));
    check(
        &format!("(forall (?x - place) (when {fact} {fact}))"),
        &format!("(forall (?x - place)\n  (when {fact}\n    {fact}))\n"),
    );
    let many = (0..30).map(|n| format!("place-{n}")).collect::<Vec<_>>().join(" ");
    let laid_out =
        format(&Source::new("t", format!("(:objects {many} - place a b - truck)"))).expect("balanced");
    assert!(
        laid_out.lines().all(|line| line.len() <= descry_planner::pddl::format::layout::WIDTH),
        "{laid_out}"
    );
    assert!(laid_out.ends_with("- place\n  a b - truck)\n"), "{laid_out}");
}

#[test]
fn odd_texts_are_left_alone_or_refused() {
    check("", "");
    check("\n\n; only\n\n\n; comments", "; only\n\n; comments\n");
    check("(a\r\n\tb)", "(a\n  b)\n");
    check("; one\r(a ; two\r\tb)", "; one\n(a ; two\n  b)\n");
    check("[call ?x]", "[call ?x]\n");
    for text in ["(a", "a)", "(a]", "((a)"] {
        assert!(format(&Source::new("t", text)).is_err(), "{text}");
    }
}
