//! Custom phrases with "not", "no", "all" and rooms: the robot looks before it answers, a question changes
//! nothing, and unseen things are not denied.

use std::fs;

use descry_domains::load::Domain;
use serde_json::Value;
use tempfile::TempDir;

use crate::binary;

const PHRASES: &str = r#"
[[goal]]
say = "make sure that <thing> is not on <surface>"
means = "(not (on <thing> <surface>))"

[[goal]]
say = "is <surface> free of <thing>"
means = "(<= (presence <thing> <surface>) 0.1)"
question = true

[[goal]]
say = "are there no <kind> on <surface>"
means = "(and (>= (clarity <surface>) <threshold>) (not (exists (?t - thing) (and (is ?t <kind>) (on ?t <surface>)))))"
question = true

[[goal]]
say = "are all <kind> on <surface>"
means = "(and (>= (completeness <kind>) <threshold>) (forall (?t - thing) (imply (is ?t <kind>) (on ?t <surface>))))"
question = true

[[goal]]
say = "is there <thing> in <room>"
means = "(exists (?s - surface) (and (in ?s <room>) (>= (presence <thing> ?s) <threshold>)))"
question = true

[[goal]]
say = "is <first:thing> beside <second:thing>"
means = "(exists (?s - surface) (and (>= (presence <first:thing> ?s) <threshold>) (>= (presence <second:thing> ?s) <threshold>)))"
question = true

[[goal]]
say = "is <thing> anywhere but on <surface>"
means = "(exists (?s - surface) (and (not (= ?s <surface>)) (>= (presence <thing> ?s) <threshold>)))"
question = true

[[goal]]
say = "what stands upon <surface>"
means = "(>= (clarity <surface>) <threshold>)"
answer.achieved = "cups: {(is ? cup)}; on the <surface>: {(on ? <surface>)}; cylinders: {(is ? cylinder)}"

[[goal]]
say = "find <thing> and all <kind>"
means = "(and (exists (?s - surface) (>= (presence <thing> ?s) <threshold>)) (>= (completeness <kind>) <threshold>))"

[[goal]]
say = "which <kind> are in <first:room> or <second:room>"
means = "(and (>= (completeness-in <kind> <first:room>) <threshold>) (>= (completeness-in <kind> <second:room>) <threshold>))"
"#;

/// Phrases about absence, and with words that *home* does not have.
const MORE: &str = r#"
[[goal]]
say = "is <surface> empty of <thing>"
means = "(= (presence <thing> <surface>) 0)"
question = true

[[goal]]
say = "is <surface> without <thing>"
means = "(>= (- 1 (presence <thing> <surface>)) 0.9)"
question = true

[[goal]]
say = "is <thing> absent from <surface>"
means = "(absent <thing> <surface>)"
question = true

[[goal]]
say = "is nothing on <surface>"
means = "(not (exists (?t - thing) (on ?t <surface>)))"
question = true

[[goal]]
say = "make sure that <thing> is nowhere on <surface>"
means = "(= (presence <thing> <surface>) 0)"

[[goal]]
say = "is <surface> clean"
means = "(wiped <surface>)"
question = true

[[goal]]
say = "is <surface> dirty"
means = "(not (wiped <surface>))"
question = true

[[goal]]
say = "wipe <surface>"
means = "(wiped <surface>)"

[[goal]]
say = "is <door> open"
means = "(not (shut <door>))"
question = true

[[goal]]
say = "is the tank full"
means = "(>= (tank) 90)"
question = true

[action.wipe]
program = ["sh", "wipe.sh"]
"#;

/// Words and an action that *home* does not have: what was wiped, what is in a tank, and a derived word.
const WORDS: [(&str, &str); 4] = [
    (":modules)", ":modules :derived-predicates)"),
    ("(:predicates", "(:predicates (wiped ?s - surface) (absent ?w - thing ?o - surface)"),
    ("(:functions", "(:functions (tank)"),
    (
        "(:durative-action move",
        "(:derived (absent ?w - thing ?o - surface) (not (on ?w ?o)))
  (:durative-action wipe
    :parameters (?from - pose ?on - surface)
    :duration (= ?duration 5)
    :condition (and (at start (at ?from)) (at start ([can-see ?from ?on])))
    :effect (and (at end (wiped ?on)) (at end (assign (tank) 100))))
  (:durative-action move",
    ),
];
const WIPE: &str = r#"while read -r asked; do
id=$(printf %s "$asked" | sed 's/.*"id":\([0-9]*\).*/\1/'); echo "{\"id\":$id,\"value\":\"wiped\"}"
done
"#;

/// Domain *home* with custom phrases. A question opens no door: the one between the rooms is open.
fn own() -> TempDir {
    written(PHRASES, &[])
}

/// Domain *home* with words and an action of its own.
fn wiping() -> TempDir {
    let folder = written(&format!("{PHRASES}{MORE}"), &WORDS);
    let path = folder.path().join("own/domain.toml");
    let text = fs::read_to_string(&path).expect("the domain was written");
    fs::write(&path, text.replace("init = [", "init = [\"(= (tank) 60)\", ")).expect("the domain is written");
    fs::write(folder.path().join("own/wipe.sh"), WIPE).expect("the program is written");
    folder
}

fn written(phrases: &str, words: &[(&str, &str)]) -> TempDir {
    let folder = TempDir::new().expect("a folder can be made");
    for (path, (_, text)) in &Domain::load("home").expect("a built-in domain").files {
        let to = folder.path().join("own").join(path);
        fs::create_dir_all(to.parent().expect("a folder")).expect("a folder can be made");
        let mut text = text.clone();
        match path.as_str() {
            "domain.toml" => text += phrases,
            "domain.pddl" => {
                for (from, to) in words {
                    assert!(text.contains(from), "{from}");
                    text = text.replacen(from, to, 1);
                }
            }
            "scenes/two-rooms.toml" => text = text.replace("shut_chance = 0.3", "state = \"open\""),
            _ => {}
        }
        fs::write(to, text).expect("the domain is written");
    }
    folder
}

/// Asks in two rooms, and checks the answer or verdict, its words, and the actions taken.
fn check(folder: &TempDir, goal: &str, seed: u64, expected: &str, words: &str) -> Value {
    let (seed, run) = (seed.to_string(), format!("run-{seed}-{}", goal.replace(' ', "-")));
    let asked =
        ["do", goal, "--domain", "own", "--scene", "two-rooms", "--seed", &seed, "--run", &run, "--json"];
    let exit = i32::from(!["yes", "achieved"].contains(&expected));
    let report = binary::check(folder.path(), &asked, exit);
    let said = report["answer"].as_str().or(report["verdict"].as_str());
    let why = report["why"].as_str().unwrap_or_default();
    assert!(said == Some(expected) && why.contains(words), "{goal}: {report}");
    report
}

#[test]
fn what_was_not_looked_at_is_not_denied() {
    let folder = own();
    // The mug stands on the desk, the cylinder does not.
    let no =
        check(&folder, "is the desk free of the mug", 96501, "no", "mug stands on the desk in the study");
    let yes = check(&folder, "is the desk free of the white cylinder", 96501, "yes", "it holds that");
    let sure =
        check(&folder, "make sure that the white cylinder is not on the desk", 96501, "achieved", "it holds");
    for report in [no, yes, sure] {
        assert!(report["views"].as_u64() > Some(0), "{report}");
    }
    check(&folder, "are there no mugs on the desk", 96501, "no", "");
    check(&folder, "are there no cups on the desk", 96501, "yes", "on the desk");
}

#[test]
fn no_wording_of_absence_is_true_unseen() {
    check_absence(&["is the desk empty of the"]);
}

#[test]
#[ignore = "slow: six searches of two rooms"]
fn no_other_wording_of_absence_is_true_unseen() {
    let folder = check_absence(&["is the desk without the", "is the"]);
    let report = check(&folder, "is nothing on the desk", 96501, "no", "stands on the desk");
    assert!(report["views"].as_u64() > Some(0), "{report}");
    let sure = "make sure that the white cylinder is nowhere on the desk";
    let report = check(&folder, sure, 96501, "achieved", "it holds");
    assert!(report["views"].as_u64() > Some(0), "{report}");
}

fn check_absence(wordings: &[&str]) -> TempDir {
    let folder = wiping();
    for &ask in wordings {
        let of = |thing: &str| match ask {
            "is the" => format!("is the {thing} absent from the desk"),
            ask => format!("{ask} {thing}"),
        };
        let no = check(&folder, &of("mug"), 96501, "no", "mug stands on the desk in the study");
        let yes = check(&folder, &of("white cylinder"), 96501, "yes", "it holds that");
        for report in [no, yes] {
            assert!(report["views"].as_u64() > Some(0), "{report}");
        }
    }
    folder
}

#[test]
fn a_question_changes_nothing_and_is_answered_from_what_is_known() {
    let folder = wiping();
    let untold = "no look shows that, and nothing has said so";
    let mut reports = vec![check(&folder, "is the desk clean", 96501, "cannot tell", untold)];
    reports.push(check(&folder, "is the desk dirty", 96501, "cannot tell", untold));
    reports.push(check(&folder, "is the study door open", 96501, "cannot tell", untold));
    // What the domain says in the beginning is known.
    let said = "as the domain says in the beginning";
    reports.push(check(&folder, "is the tank full", 96501, "no", said));
    for report in reports {
        assert_eq!((&report["views"], &report["distance_m"]), (&0.into(), &0.0.into()), "{report}");
    }
    check(&folder, "wipe the desk", 96501, "achieved", "it holds that");
}

#[test]
fn a_question_opens_no_door() {
    let folder = TempDir::new().expect("a folder can be made");
    let ask = ["do", "is the mug on the desk", "--domain", "home", "--scene", "two-rooms", "--seed", "96501"];
    let report = binary::check(folder.path(), &[&ask[..], &["--run", "run", "--json"]].concat(), 1);
    let why = report["why"].as_str().unwrap_or_default();
    assert_eq!(report["answer"], "cannot tell", "{report}");
    assert!(why.contains("the study door is shut, and a question opens nothing"), "{report}");
    let done = binary::documents(folder.path(), "run");
    assert!(done.iter().all(|document| !document.contains("(open-door ")), "{report}");
}

#[test]
fn an_answer_of_ones_own_lists_what_was_seen() {
    let folder = own();
    let report = check(&folder, "what stands upon the desk", 96501, "achieved", "cups: none; on the desk: ");
    let why = report["why"].as_str().unwrap_or_default();
    assert!(why.contains("mug") && !why.contains("on the desk: none"), "{report}");
}

#[test]
fn a_question_is_not_made_true() {
    let folder = own();
    check(&folder, "are all mugs on the counter", 96501, "no", "mug stands on the desk in the study");
    let done = binary::documents(folder.path(), "run-96501-are-all-mugs-on-the-counter");
    assert!(done.iter().all(|document| !document.contains("(pick-up ")), "{done:?}");
}

#[test]
#[ignore = "slow: all mugs of two rooms"]
fn what_is_so_of_all_is_answered_with_yes() {
    check(&own(), "are all mugs on the desk", 96501, "yes", "found the only mug: ");
}

#[test]
#[ignore = "slow: two searches of two rooms"]
fn what_is_asked_of_things_anywhere_has_the_answer_no_once_they_are_known() {
    let folder = own();
    for goal in ["is the mug beside the white cylinder", "is the mug anywhere but on the desk"] {
        check(&folder, goal, 96501, "no", "it does not hold that");
    }
}

#[test]
fn what_is_asked_of_rooms_is_about_them() {
    let folder = own();
    check(
        &folder,
        "is there a mug in the kitchen",
        96501,
        "no",
        "mug is not on the kitchen table or the counter",
    );
    check(&folder, "is there a mug in the study", 96501, "yes", "mug stands on the desk in the study");
}

#[test]
#[ignore = "slow: all cups of two rooms"]
fn what_is_asked_of_several_rooms_is_about_them() {
    let folder = own();
    let words = "found all 2 cups in the kitchen or the study: ";
    check(&folder, "which cups are in the kitchen or the study", 96501, "achieved", words);
}

#[test]
#[ignore = "slow: a search of the home for all cups"]
fn what_was_seen_is_said_before_what_may_stand_out_of_sight() {
    let folder = own();
    let (path, allowed) = (folder.path().join("own/domain.toml"), "out_of_sight = 0.01");
    let text = fs::read_to_string(&path).expect("the domain was written");
    assert!(text.contains(allowed), "{text}");
    fs::write(&path, text.replace(allowed, "out_of_sight = 0.005")).expect("the domain is written");
    // Of one object it is not sure, and there is little room where nothing was seen.
    let asked =
        ["do", "which cups are in the kitchen", "--domain", "own", "--seed", "11", "--run", "run", "--json"];
    let report = binary::check(folder.path(), &asked, 1);
    let why = report["why"].as_str().unwrap_or_default();
    assert!(why.contains(" are found, ") && why.contains("is one with "), "{report}");
}

#[test]
fn a_thing_and_a_kind_of_one_name_are_asked_for_at_once() {
    let folder = own();
    let checked = binary::outcome(folder.path(), &["check", "own"]);
    assert_eq!(checked.status.code(), Some(0), "{}", String::from_utf8_lossy(&checked.stderr));
    let words = "mug stands on the desk in the study; found the only mug: ";
    check(&folder, "find the mug and all mugs", 96501, "achieved", words);
}

/// A scene with two tables and an object, under the given names.
fn named(surface: &str, other: &str, thing: &str) -> String {
    format!(
        "title = \"Two tables\"\n[room]\nsize_m = [9.0, 5.0]\n[[surface]]\nname = \"{surface}\"\nsize_m = [1.2, 0.8]\nheight_m = 0.72\n[[surface]]\nname = \
         \"{other}\"\nposition_m = [3.0, 0.0]\nsize_m = [1.2, 0.8]\nheight_m = 0.72\n[start]\nposition_m = [-2.3, 0.0]\n[[object]]\nname = \
         \"{thing}\"\nshape.cup = {{ diameter_m = 0.070, height_m = 0.104 }}\non = [\"{other}\"]\n"
    )
}

#[test]
fn names_that_are_symbols_of_something_else_do_no_harm() {
    let folder = TempDir::new().expect("a folder can be made");
    fs::write(folder.path().join("two.toml"), named("table", "table 2", "cup A")).expect("a scene");
    let find = ["find", "cup A", "--scene", "two.toml", "--seed", "96001", "--json"];
    let report = binary::check(folder.path(), &find, 0);
    assert_eq!((&report["on"], &report["true_on"]), (&"table 2".into(), &"table 2".into()), "{report}");
    // Nobody could say which of these is meant.
    fs::write(folder.path().join("same.toml"), named("table", "Table!", "cup A")).expect("a scene");
    let ask = ["do", "is cup A on the table", "--scene", "same.toml"];
    let words = ["nothing tells the surface \"Table!\" from the surface \"table\"", "a name of its own"];
    binary::check_refused(folder.path(), &ask, 2, &words);
}
