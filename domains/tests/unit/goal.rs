//! Tests of `goal`.

use descry_domains::goal::*;
use descry_domains::lexicon::Lexicon;
use descry_domains::load::Domain;
use descry_domains::objective::Filled;
use descry_domains::slots::*;

fn filled(slots: &[(&str, &str)]) -> Vec<Filled> {
    let mut all: Vec<Filled> = Vec::new();
    for (slot, symbol) in slots {
        let number = all.iter().filter(|f| f.slot == *slot).count();
        all.push(Filled { slot: (*slot).into(), number, symbol: (*symbol).into(), name: (*symbol).into() });
    }
    all
}

#[test]
fn slots_are_filled_one_by_one() {
    let check = |text: &str, slots: &[(&str, &str)], expected: Result<&str, &str>| {
        let found = put_in(text, &filled(slots), |f| f.symbol.clone());
        match expected {
            Ok(expected) => assert_eq!(found.as_deref(), Ok(expected)),
            Err(part) => assert!(found.as_ref().is_err_and(|e| e.contains(part)), "{text}: {found:?}"),
        }
    };
    check("(>= (c <thing>) 0.8)", &[("thing", "a")], Ok("(>= (c a) 0.8)"));
    check("(and (c <thing>) (d <thing>))", &[("thing", "a")], Ok("(and (c a) (d a))"));
    check("(and (c <thing>) (c <thing>))", &[("thing", "a"), ("thing", "b")], Ok("(and (c a) (c b))"));
    check(
        "(and (c <thing> <surface>) (c <thing> <surface>))",
        &[("thing", "a"), ("surface", "s"), ("thing", "b")],
        Ok("(and (c a s) (c b s))"),
    );
    check(
        "(on <first:thing> <second:thing>)",
        &[("first:thing", "a"), ("second:thing", "b")],
        Ok("(on a b)"),
    );
    check("(c <thing>)", &[("thing", "a"), ("thing", "b")], Err("<first:thing>"));
    check("(c <cup>)", &[("thing", "a")], Err("no slot <cup>; it has <thing>"));
    check("(< (x) 3) ", &[], Ok("(< (x) 3) "));
}

#[test]
fn a_yes_is_likelier_than_a_no() {
    let domain = Domain::load("tabletop").unwrap();
    let lexicon = Lexicon::new(&domain, &descry_domains::lexicon::Places::of_scene(&domain));
    let check = |confidence: &str, expected: Result<f64, &str>| {
        let said = format!("is cup A on the table with confidence {confidence}");
        let found = read(&said, &domain, &lexicon).map(|goal| goal.threshold);
        match expected {
            Ok(threshold) => assert_eq!(found.ok(), Some(threshold), "{said}"),
            Err(part) => assert!(found.is_err_and(|e| e.to_string().contains(part)), "{said}"),
        }
    };
    check("0.9", Ok(0.9));
    check("0.51", Ok(0.51));
    for low in ["0.5", "0.3", "1e-300"] {
        check(low, Err("asks for a yes that is no likelier than a no"));
    }
    for none in ["0", "1", "2", "-0.7", "nan", "much"] {
        check(none, Err("asks for no probability"));
    }
}

#[test]
fn how_sure_and_how_soon_are_said_once() {
    let domain = Domain::load("tabletop").unwrap();
    let lexicon = Lexicon::new(&domain, &descry_domains::lexicon::Places::of_scene(&domain));
    let check = |conditions: &str, expected: Result<(f64, Option<f64>), &str>| {
        let found = read(&format!("find cup A {conditions}"), &domain, &lexicon);
        let found = found.map(|goal| (goal.threshold, goal.deadline_s)).map_err(|e| e.to_string());
        match expected {
            Ok(expected) => assert_eq!(found, Ok(expected), "{conditions}"),
            Err(part) => assert!(found.is_err_and(|e| e.contains(part)), "{conditions}"),
        }
    };
    check("within 60 seconds with confidence 0.9", Ok((0.9, Some(60.0))));
    let times = [
        ("90 s", 90.0),
        ("90s", 90.0),
        ("5 minutes", 300.0),
        ("five minutes", 300.0),
        ("1.5 min", 90.0),
        ("half an hour", 1800.0),
    ];
    for (time, expected_s) in times {
        check(&format!("within {time}"), Ok((0.8, Some(expected_s))));
    }
    check("within 5", Err("\"within 5\" does not say of what"));
    check("within 5 with confidence 0.9", Err("\"within 5 seconds\" or \"within 5 minutes\""));
    for none in ["0 s", "-5", "nan", "inf s", "1e9e s", "5 days", "s", "many minutes", ""] {
        check(&format!("within {none}"), Err("asks for no time"));
    }
    check("with confidence 0.9 within 60 seconds", Ok((0.9, Some(60.0))));
    check("with confidence 0.9 with confidence 0.6", Err("\"with confidence\" is said twice"));
    check("within 9 seconds with confidence 0.9 within 1 minute", Err("\"within\" is said twice"));
}

#[test]
fn words_fit_a_phrase_in_every_way() {
    let check = |say: &str, words: &str, expected: &[&[&str]]| {
        let words: Vec<String> = words.split_whitespace().map(str::to_string).collect();
        let found: Vec<Vec<String>> = fits(&pattern(say), &words, |a, b| a == b)
            .into_iter()
            .map(|way| way.into_iter().map(|(_, held)| held).collect())
            .collect();
        assert_eq!(found, expected, "{say}");
    };
    check("find <thing>", "find cup a", &[&["cup a"]]);
    check("where is <thing>?", "where is cup a", &[&["cup a"]]);
    check("Find, please, <thing>", "find please cup", &[&["cup"]]);
    check("find <thing>", "find", &[]);
    check("find", "find cup", &[]);
    check(
        "find both <thing> and <thing>",
        "find both salt and pepper and a cup",
        &[&["salt", "pepper and a cup"], &["salt and pepper", "a cup"]],
    );
}

#[test]
fn what_a_body_does_not_know_is_said_to_be_so() {
    let domain = Domain::load("home").unwrap();
    let lexicon = Lexicon::new(&domain, &descry_domains::lexicon::Places::default());
    let why = read("bring cup A to the desk", &domain, &lexicon).unwrap_err().to_string();
    assert!(why.contains("the body knows no surface beforehand") && !why.contains("known: "), "{why}");
}

#[test]
fn a_shape_has_any_name_that_is_no_other() {
    let check = |domain: &str, said: &str, expected: Option<(&str, &str)>| {
        let domain = Domain::load(domain).unwrap();
        let lexicon = Lexicon::new(&domain, &descry_domains::lexicon::Places::default());
        let goal = read(said, &domain, &lexicon);
        let found = goal.as_ref().ok().map(|g| (g.pddl.as_str(), g.slots[0].name.as_str()));
        assert_eq!(found, expected, "{said}: {goal:?}");
    };
    check("shapes", "learn the coffee table", Some(("(learned coffee-table)", "coffee table")));
    check("shapes", "learn dell box", Some(("(learned dell-box)", "dell box")));
    check("shapes", "where is Bob's bin?", Some(("(>= (found bob-s-bin) 0.9)", "bob's bin")));
    check("shapes", "learn this", None);
    check("shapes", "learn !", None);
    check("tabletop", "find coffee table", None);
}

#[test]
fn a_domains_own_words_go_before_words_that_request_the_same() {
    let mut domain = Domain::load("tabletop").unwrap();
    let find = domain.config.goal.iter().find(|goal| goal.say == "find <thing>").unwrap().clone();
    let means = "(< (confidence <thing>) 0.1)".to_string();
    domain.config.goal.push(descry_domains::config::GoalPhrase {
        say: "look for <thing>".into(),
        means,
        ..find
    });
    let lexicon = Lexicon::new(&domain, &descry_domains::lexicon::Places::of_scene(&domain));
    let pddl = |said: &str| read(said, &domain, &lexicon).unwrap().pddl;
    assert_eq!(pddl("please look for cup A"), pddl("look for cup A"));
    assert_ne!(pddl("please look for cup A"), pddl("find cup A"));
}
