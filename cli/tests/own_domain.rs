//! Custom domains, run on a small simulated table: changes of the template, and their outcomes.

mod senses;

use std::path::Path;
use std::process::{Command, Output};

use serde_json::Value;
use tempfile::TempDir;

/// A change of one file of the new domain.
struct Edit {
    file: &'static str,
    change: Box<dyn Fn(String) -> String>,
}

fn edit(file: &'static str, change: impl Fn(String) -> String + 'static) -> Edit {
    Edit { file, change: Box::new(change) }
}

fn append(file: &'static str, text: &str) -> Edit {
    let text = text.to_string();
    edit(file, move |before| format!("{before}\n{text}\n"))
}

fn replace(file: &'static str, from: &'static str, to: &'static str) -> Edit {
    edit(file, move |before| {
        assert!(before.contains(from), "{file} has no {from}");
        before.replacen(from, to, 1)
    })
}

/// Inserts an action before the last parenthesis.
fn action(text: &str) -> Edit {
    let text = text.to_string();
    edit("domain.pddl", move |before| {
        let (head, tail) = before.rsplit_once(')').expect("a parenthesis");
        format!("{head}\n{text}){tail}")
    })
}

/// A shell program that answers each question; `$id` is its number.
fn program(file: &'static str, body: &str) -> Edit {
    let id = r#"id=$(printf %s "$asked" | sed 's/.*"id":\([0-9]*\).*/\1/')"#;
    let text = format!("while read -r asked; do {id}\n{body}\ndone\n");
    edit(file, move |_| text.clone())
}

/// Shell code that prints an answer.
fn answers(value: &str) -> String {
    format!("echo '{{\"id\":'$id',{value}}}'")
}

fn descry(folder: &Path, arguments: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_descry"))
        .args(arguments)
        .current_dir(folder)
        .output()
        .expect("the binary runs")
}

fn shown(output: &Output) -> (String, String) {
    let text = |bytes: &[u8]| String::from_utf8_lossy(bytes).into_owned();
    (text(&output.stdout), text(&output.stderr))
}

/// A new domain `own` with changes, in an otherwise empty folder.
fn own(edits: &[Edit]) -> TempDir {
    let folder = TempDir::new().expect("a folder can be made");
    let made = descry(folder.path(), &["new", "own"]);
    assert!(made.status.success(), "{:?}", shown(&made));
    for Edit { file, change } in edits {
        let path = folder.path().join("own").join(file);
        let before = std::fs::read_to_string(&path).unwrap_or_default();
        std::fs::write(&path, change(before)).expect("the folder is writable");
    }
    folder
}

/// Pursues a goal and expects an exit code, words that must appear and words that must not.
fn check(edits: &[Edit], goal: &str, exit: i32, words: &[&str], never: &[&str]) -> Value {
    let folder = own(edits);
    pursued(&folder, goal, exit, words, never)
}

fn pursued(folder: &TempDir, goal: &str, exit: i32, words: &[&str], never: &[&str]) -> Value {
    let output = descry(folder.path(), &["do", goal, "--domain", "own", "--run", "run", "--json"]);
    let (out, err) = shown(&output);
    assert_eq!(output.status.code(), Some(exit), "{goal}\n{out}\n{err}");
    words.iter().for_each(|word| assert!(err.contains(word), "{goal}: no {word:?} in\n{err}"));
    never.iter().for_each(|word| assert!(!err.contains(word), "{goal}: {word:?} in\n{err}"));
    serde_json::from_str(&out).unwrap_or(Value::Null)
}

/// Adds a predicate for visited poses, and a phrase that requires two of them.
fn visits(more: &str) -> Vec<Edit> {
    vec![
        replace("domain.pddl", "(:predicates", "(:predicates\n    (visited ?where - pose)"),
        replace("domain.pddl", "(at end (at ?to))", "(at end (at ?to)) (at end (visited ?to))"),
        append(
            "domain.toml",
            "[[goal]]\nsay = \"go round\"\nmeans = \"(and (visited table-1) (visited table-4))\"",
        ),
        append("domain.toml", more),
    ]
}

#[test]
fn a_new_domain_has_no_finding_and_runs() {
    let folder = own(&[]);
    let checked = descry(folder.path(), &["check", "own"]);
    let (out, err) = shown(&checked);
    assert_eq!((checked.status.code(), err.trim()), (Some(0), "no finding"), "{out}");
    assert!(out.contains("(confidence thing)"), "{out}");
    let said = pursued(&folder, "find the mug", 0, &["achieved: the mug stands on the table"], &[]);
    assert_eq!((said["verdict"].as_str(), said["on"].as_str()), (Some("achieved"), Some("table")), "{said}");
}

#[test]
fn a_new_domain_is_written_over_nothing() {
    let folder = own(&[]);
    let check = |name: &str, words: &[&str]| {
        let (_, err) = shown(&descry(folder.path(), &["new", name]));
        words.iter().for_each(|word| assert!(err.contains(word), "{name}: no {word:?} in {err}"));
    };
    check("own", &["own: it holds something already", "nothing was written"]);
    check("own/domain.toml", &["own/domain.toml", "expected the name of a folder"]);
    std::fs::create_dir(folder.path().join("empty")).expect("a folder can be made");
    assert!(descry(folder.path(), &["new", "empty"]).status.success());
    assert!(descry(folder.path(), &["check", "empty"]).status.success());
    let (out, _) = shown(&descry(folder.path(), &["new", "my domains/own"]));
    assert!(out.contains("descry find mug --domain 'my domains/own'\n"), "{out}");
}

#[test]
fn an_answer_is_about_the_goal_that_was_asked() {
    let look = append(
        "domain.toml",
        "[[goal]]\nsay = \"look around\"\nmeans = \"(observed table-3 table)\"\nabout = \"look once\"",
    );
    let holds = "achieved: it holds that the table has been looked at from table-3";
    check(&[look], "look around", 0, &[holds], &["identified"]);
}

#[test]
fn a_phrase_with_two_slots_of_a_type_answers_with_both() {
    let folder = own(&[
        append(
            "scenes/default.toml",
            "[[object]]\nname = \"tin\"\nshape.cylinder = { diameter_m = 0.09, height_m = 0.15 }\n",
        ),
        append(
            "objects/tin.toml",
            "name = \"tin\"\nkind = \"tin\"\nheight_m = [0.14, 0.16]\ndiameter_m = [0.08, 0.10]\ntaper = [0.9, 1.1]\ntop = \"closed\"\nhandle = \"none\"\n",
        ),
        replace("objects/mug.toml", "[\"coffee mug\"]", "[\"mug for one and all\"]"),
        append(
            "domain.toml",
            "[[goal]]\nsay = \"find both <thing> and <thing>\"\nmeans = \"(and (>= (confidence <thing>) <threshold>) (>= (confidence <thing>) <threshold>))\"",
        ),
    ]);
    let words = ["the mug stands on the table; the tin stands on the table"];
    let said = pursued(&folder, "find both mug for one and all and tin", 0, &words, &[]);
    assert!(said["object"].is_null(), "two things are no object: {said}");
    let asked: Vec<&str> = said["objects"]
        .as_array()
        .into_iter()
        .flatten()
        .filter(|o| o["asked"] == true)
        .filter_map(|o| o["label"].as_str())
        .collect();
    assert_eq!(asked.len(), 2, "{said}");
    assert!(asked.contains(&"mug") && asked.contains(&"tin"), "{said}");
}

#[test]
fn all_of_a_kind_are_marked() {
    let folder = own(&[]);
    let goal = ["do", "find all cups", "--scene", "four-cups", "--seed", "2", "--json"];
    let output = descry(folder.path(), &goal);
    let (out, err) = shown(&output);
    assert_eq!(output.status.code(), Some(0), "{err}");
    let said: Value = serde_json::from_str(&out).expect("the output is JSON");
    for object in said["objects"].as_array().expect("a list") {
        assert_eq!(object["asked"] == true, object["kind"] == "cup", "{object}");
    }
    assert!(
        err.contains("besides:")
            || said["objects"].as_array().is_some_and(|o| o.iter().all(|o| o["asked"] == true))
    );
}

#[test]
fn what_is_remembered_brings_a_goal_about() {
    let said = check(&visits(""), "go round", 0, &["it holds that (and (visited table-1)"], &[]);
    assert!(said["replans"].as_u64() <= Some(1), "{said}");
}

#[test]
fn every_limit_ends_in_a_verdict() {
    let never = "[word.visited]\nis = \"planned\"\n";
    check(&visits(never), "go round", 5, &["the same situation has come back", "failed:"], &[]);
    check(
        &visits("[limits]\nseconds = 1.0"),
        "go round",
        1,
        &["cannot tell: it cannot be told: 1 s are over"],
        &[],
    );
    let plans = format!("{never}[limits]\nplans = 1");
    check(&visits(&plans), "go round", 1, &["1 plans were made"], &[]);
    let looks = [
        replace("scenes/default.toml", "name = \"mug\"\nkind = \"mug\"", "name = \"box\"\nkind = \"box\""),
        replace(
            "scenes/default.toml",
            "shape.mug = { diameter_m = 0.080, height_m = 0.095 }",
            "shape.box = { size_m = [0.2, 0.2, 0.3] }",
        ),
        append("domain.toml", "[limits]\nviews = 1"),
    ];
    check(&looks, "find mug", 1, &["1 looks were taken"], &["achieved"]);
}

/// Two actions, `ring` and `wave`, each carried out by a program that waits until the other is under way.
#[test]
fn steps_that_overlap_are_carried_out_at_the_same_time() {
    let greeting = |name: &str, done: &str| {
        action(&format!(
            "  (:durative-action {name} :parameters () :duration (= ?duration 4)\n    :condition (at start (not ({done}))) :effect (at end ({done})))\n"
        ))
    };
    let meets = |own: &str, other: &str| {
        let wait = format!(
            "touch {own}.here; n=0; while [ ! -e {other}.here ] && [ $n -lt 100 ]; do sleep 0.1; n=$((n+1)); done"
        );
        let met = answers("\"value\":\"met\"");
        format!("{wait}\n[ -e {other}.here ] && {met} || {}", answers("\"error\":\"alone\""))
    };
    let edits = [
        replace("domain.pddl", "(:predicates", "(:predicates\n    (rung)\n    (waved)"),
        greeting("ring", "rung"),
        greeting("wave", "waved"),
        program("ring.sh", &meets("ring", "wave")),
        program("wave.sh", &meets("wave", "ring")),
        append(
            "domain.toml",
            "[[goal]]\nsay = \"greet\"\nmeans = \"(and (rung) (waved) (>= (confidence mug) 0.8))\"\n\n[action.ring]\nprogram = [\"sh\", \"ring.sh\"]\nretries = 0\n\n[action.wave]\nprogram = [\"sh\", \"wave.sh\"]\nretries = 0",
        ),
    ];
    check(&edits, "greet", 0, &["achieved", "met"], &["alone", "failed "]);
}

/// An action `ring` carried out by a program, with a phrase and settings.
fn rings(body: &str, configured: &str) -> Vec<Edit> {
    vec![
        replace("domain.pddl", "(:predicates", "(:predicates\n    (rung)\n    (tired)"),
        action(
            "  (:durative-action ring :parameters () :duration (= ?duration 1)\n    :condition (at start (not (tired))) :effect (at end (rung)))\n",
        ),
        program("ring.sh", body),
        append(
            "domain.toml",
            "[[goal]]\nsay = \"ring\"\nmeans = \"(rung)\"\nanswer.achieved = \"it rang\"\n\n[word.tired]\nis = \"remembered\"\n\n[action.ring]\nprogram = [\"sh\", \"ring.sh\"]",
        ),
        append("domain.toml", configured),
    ]
}

#[test]
fn what_a_program_could_not_do_is_tried_again_and_given_up() {
    let (ding, busy) = (answers("\"value\":\"ding\""), answers("\"error\":\"busy\""));
    let third = format!("[ $id -ge 2 ] && {ding} || {busy}");
    let tries = ["busy; try 1 of 3", "busy; try 2 of 3", "ding", "achieved: it rang"];
    check(&rings(&third, "retries = 2\ngives_up = [\"(tired)\"]"), "ring", 0, &tries, &[]);
    let impossible = "cannot be done: nothing that can be done brings about (rung)";
    let given_up = ["busy; (ring) is given up: (tired)", impossible];
    check(&rings(&busy, "retries = 1\ngives_up = [\"(tired)\"]"), "ring", 1, &given_up, &["it rang"]);
    let teaches = "teaches = [{ when = \"program\", says = \"(tired)\" }]";
    check(&rings(&busy, teaches), "ring", 1, &["busy; (tired)", impossible], &["it rang"]);
    let no = answers("\"value\":false");
    let given_up = ["it answered false; (ring) is given up: (tired)", impossible];
    check(&rings(&no, "retries = 0\ngives_up = [\"(tired)\"]"), "ring", 1, &given_up, &["it rang"]);
    // What is no answer does not say that it is done.
    for none in ["\"valeu\":\"ding\"", "\"error\":5", "\"error\":{\"code\":5}"] {
        let expected = ["expected a `value`, or an `error` that is a text"];
        check(&rings(&answers(none), "retries = 0"), "ring", 5, &expected, &["it rang"]);
    }
    let crash = "echo no bell here >&2; exit 3";
    check(&rings(crash, "retries = 1"), "ring", 5, &["failed", "no bell here"], &["it rang"]);
    let late = "retries = 0\nlimit_s = 0.2";
    check(&rings("sleep 9", late), "ring", 5, &["no answer within 0.2 s"], &["it rang"]);
}

#[test]
fn what_is_to_be_brought_about_is_checked() {
    let ding = answers("\"value\":\"ding\"");
    let unmet = "retries = 1\ngives_up = [\"(tired)\"]\ncheck = \"(exists (?w - pose) (out-of-reach ?w))\"";
    let words = ["it was done, but (exists (?w - pose) (out-of-reach ?w)) does not hold", "cannot be done"];
    check(&rings(&ding, unmet), "ring", 1, &words, &["it rang"]);
    check(&rings(&ding, "check = \"(rung)\""), "ring", 0, &["it rang"], &["does not hold"]);
}

#[test]
fn a_fact_may_be_a_program() {
    let rain = |body: &str| {
        let mut edits =
            rings(&answers("\"value\":\"ding\""), "\n[word.raining]\nprogram = [\"sh\", \"rain.sh\"]");
        edits.push(replace("domain.pddl", "(:predicates", "(:predicates\n    (raining)"));
        edits.push(replace("domain.pddl", "(at start (not (tired)))", "(at start (raining))"));
        edits.push(program("rain.sh", body));
        edits
    };
    let says = |value: &str| answers(&format!("\"value\":{value}"));
    check(&rain(&says("[\"(raining)\"]")), "ring", 0, &["it rang"], &[]);
    check(&rain(&says("[]")), "ring", 1, &["cannot be done", "what is needed of `raining`"], &["it rang"]);
    check(&rain(&says("[\"(snowing)\"]")), "ring", 2, &["holds of raining", "(snowing)"], &[]);
    check(&rain(&says("[\"(raining table)\"]")), "ring", 2, &["is not about (raining)"], &[]);
    check(&rain(&says("7")), "ring", 2, &["holds of raining", "expected"], &[]);
    check(&rain("exit 1"), "ring", 2, &["holds of raining", "ended"], &[]);
}

/// The template robot with one change, as the value for `--robot`.
fn robot(what: &str) -> String {
    let file = Path::new(env!("CARGO_MANIFEST_DIR")).join("../robots/tests/programs/rogue.py");
    format!("program:python3 '{}' '{what}'", file.display())
}

#[test]
fn what_a_sense_of_the_body_says_is_told_to_the_programs_behind_facts() {
    if Command::new("python3").arg("--version").output().is_err() {
        return eprintln!("SKIPPED: python3 is not here");
    }
    let labelled =
        r#"case "$asked" in *'"readings":{"label-reader":'*TEA*) v='["(labelled)"]';; *) v='[]';; esac"#;
    let labelled = format!("{labelled}\n{}", answers("\"value\":'$v'"));
    let edits = [
        replace("domain.toml", "uses = [\"searching\"]", "uses = [\"searching\", \"reading\"]"),
        append("domain.toml", "[action.read-label]\ndoes = \"read ?by\"\nlimit_s = 5.0"),
        append("domain.toml", "[word.labelled]\nprogram = [\"sh\", \"labelled.sh\"]"),
        append("domain.toml", "[[goal]]\nsay = \"read the label\"\nmeans = \"(labelled)\""),
        replace("domain.pddl", "(:predicates", "(:predicates\n    (labelled)"),
        replace("domain.pddl", "(:types", "(:types\n    sense"),
        action(
            "(:durative-action read-label :parameters (?by - sense) :duration (= ?duration 1)
               :condition (at start (not (labelled))) :effect (at end (labelled)))",
        ),
        program("labelled.sh", &labelled),
    ];
    let folder = own(&edits);
    let with = |what: &str, run: &str| {
        let robot = robot(what);
        let asked = ["do", "read the label", "--domain", "own", "--robot", &robot, "--run", run];
        descry(folder.path(), &asked)
    };
    let (out, err) = shown(&with("reads labels", "reads"));
    assert!(out.contains("achieved"), "{out}{err}");
    assert!(err.contains(r#"it says {"by":"label reader","text":"TEA"}"#), "{out}{err}");
    let replayed = descry(folder.path(), &["replay", "reads"]);
    assert!(replayed.status.success(), "{:?}", shown(&replayed));
    // A body without such a sense cannot, and says so.
    let output = with("bare", "bare");
    assert_eq!(output.status.code(), Some(1), "{:?}", shown(&output));
}

#[test]
fn a_body_without_a_camera_cannot_tell() {
    if Command::new("python3").arg("--version").output().is_err() {
        return eprintln!("SKIPPED: python3 is not here");
    }
    let folder = TempDir::new().expect("a folder can be made");
    let output = descry(folder.path(), &["find", "mug", "--robot", &robot("no camera"), "--run", "run"]);
    let (out, err) = shown(&output);
    assert_eq!(output.status.code(), Some(1), "{out}{err}");
    assert!(out.contains("the body has no camera"), "{out}{err}");
}

#[test]
fn looks_that_contradict_the_map_prove_nothing() {
    if Command::new("python3").arg("--version").output().is_err() {
        return eprintln!("SKIPPED: python3 is not here");
    }
    let folder = TempDir::new().expect("a folder can be made");
    for (what, expected) in [
        ("honest", "cup A is not there"),
        ("depth reads long", "contradicts the map: depth reads 6 % too long"),
    ] {
        let output = descry(folder.path(), &["find", "cup A", "--robot", &robot(what), "--run", what]);
        let (out, err) = shown(&output);
        assert!(output.status.code() == Some(1) && out.contains(expected), "{what}: {out}{err}");
    }
}

#[test]
fn a_key_that_nobody_knows_is_a_finding_with_the_nearest_one() {
    let misspelt = |from: &'static str, to: &'static str, words: &[&str]| {
        let folder = own(&[replace("domain.toml", from, to)]);
        let output = descry(folder.path(), &["check", "own"]);
        let (out, err) = shown(&output);
        assert_eq!(output.status.code(), Some(1), "{to}: {out}{err}");
        let said = out + &err;
        words.iter().for_each(|word| assert!(said.contains(word), "{to}: no {word:?} in\n{said}"));
    };
    let words = ["unknown field `limits_s`", "did you mean `limit_s`?", "own/domain.toml:"];
    misspelt("limit_s = 120.0", "limits_s = 120.0", &words);
    misspelt("limit_s = 120.0", "limit_s = \"long\"", &["expected a number", "own/domain.toml:"]);
}

#[test]
fn a_domain_with_a_fault_is_refused_before_anything_begins() {
    let folder = own(&[replace("domain.toml", "\"observe ?from ?on\"", "\"observ ?from ?on\"")]);
    for arguments in
        [["goals", "--domain", "own"].as_slice(), &["find", "mug", "--domain", "own"], &["check", "own"]]
    {
        let output = descry(folder.path(), arguments);
        let (out, err) = shown(&output);
        assert!(
            err.contains("domain.toml:43") && err.contains("did you mean `observe`"),
            "{arguments:?}: {out}{err}"
        );
        assert_eq!(output.status.code(), Some(if arguments[0] == "check" { 1 } else { 2 }), "{arguments:?}");
    }
    assert!(!folder.path().join("runs").exists(), "nothing was begun");
}

#[test]
fn a_run_with_programs_is_lived_through_again_without_them() {
    let folder = own(&rings(&format!("echo x >> rung.txt; {}", answers("\"value\":\"ding\"")), ""));
    pursued(&folder, "ring", 0, &["it rang"], &[]);
    let replayed = descry(folder.path(), &["replay", "run"]);
    let (out, err) = shown(&replayed);
    assert_eq!(replayed.status.code(), Some(0), "{out}{err}");
    let rung = std::fs::read_to_string(folder.path().join("own/rung.txt")).expect("it rang");
    assert_eq!(rung.lines().count(), 1, "the program is not run again");
}

#[test]
fn a_number_that_forbids_every_drive_is_the_reason() {
    let charge = |init: &'static str| {
        vec![
            replace("domain.pddl", "(:functions", "(:functions (charge)"),
            replace(
                "domain.pddl",
                "(at start (not (= ?from ?to)))",
                "(at start (not (= ?from ?to))) (at start (>= (charge) [path-cost ?from ?to]))",
            ),
            replace("domain.pddl", "(at end (at ?to))", "(at end (at ?to)) (at end (assign (charge) 100))"),
            replace("domain.toml", "scene = \"default\"", init),
            append(
                "domain.toml",
                "[[goal]]\nsay = \"look from there\"\nmeans = \"(observed table-3 table)\"",
            ),
        ]
    };
    let never = ["it was asked for"];
    let low = charge("init = [\"(= (charge) 0.1)\"]\nscene = \"default\"");
    let words = ["no drive can be taken: (charge) is 0.10, and at least"];
    check(&low, "look from there", 1, &words, &never);
    // So where it has no value at all, which the check of the domain finds, too.
    let unset = charge("scene = \"default\"");
    check(&unset, "look from there", 1, &["no drive can be taken: (charge) has no value"], &never);
}

#[test]
fn a_deadline_holds_in_a_domain_without_a_word_for_it() {
    let ring = || rings(&answers("\"value\":\"ding\""), "");
    let slow = || {
        let mut edits = ring();
        edits.push(replace("domain.pddl", "() :duration (= ?duration 1)", "() :duration (= ?duration 40)"));
        edits
    };
    check(&ring(), "ring within 5 s", 0, &["it rang"], &[]);
    let words = ["takes 40.0 s, and 5.0 s are left until the deadline"];
    check(&slow(), "ring within 5 s", 1, &words, &["it rang"]);
    check(&slow(), "ring within 60 s", 0, &["it rang"], &[]);
}
