//! Uses of a run's record: replay, as a body, and to resume a killed run.

use std::path::Path;

use crate::beside::shared;
use crate::binary::{
    check, check_refused, documents, first_line, kill_after, outcome, start, without_readers,
};
use serde_json::Value;
use tempfile::TempDir;

fn report(folder: &Path, run: &str) -> Value {
    let text = std::fs::read_to_string(folder.join(run).join("report.json")).expect("the run has ended");
    let mut report: Value = serde_json::from_str(&text).expect("a report");
    for key in ["wall_s", "planning_s", "geometry_s", "run", "crc32"] {
        report[key] = Value::Null;
    }
    report
}

/// Pursues a goal three times: undisturbed, killed once, and killed again after resuming. All must end the
/// same, to the last document, and replay identically.
fn check_goal(goal: &[&str], kills: &[&[usize]]) {
    let folder = TempDir::new().expect("a folder can be made");
    let folder = folder.path();
    check(folder, &[goal, &["--run", "whole", "--json"]].concat(), 0);
    let again = check(folder, &["replay", "whole", "--json"], 0);
    assert_eq!((&again["same"], &again["verdict"]), (&true.into(), &"achieved".into()), "{again}");
    assert!(
        again["compared"].as_array().is_some_and(|c| c.iter().all(|kind| kind[1].as_u64() > Some(0))),
        "{again}"
    );
    let all = documents(folder, "whole");
    for (n, lines) in kills.iter().enumerate() {
        let run = format!("killed-{n}");
        kill_after(folder, &[goal, &["--run", &run]].concat(), lines[0]);
        let cut = check(folder, &["replay", &run, "--json"], 0);
        assert!(cut["cut_off"].is_string() && cut["same"] == true, "{cut}");
        for lines in &lines[1..] {
            kill_after(folder, &["do", "--resume", &run], *lines);
        }
        check(folder, &["do", "--resume", &run, "--json"], 0);
        assert_eq!(documents(folder, &run), all, "killed after {lines:?} lines");
        assert_eq!(report(folder, &run), report(folder, "whole"));
        let report = check(folder, &["memory", "verify", &run, "--json"], 0);
        assert_eq!(report["whole"], true);
    }
}

#[test]
fn a_simulated_run_is_played_again_and_goes_on_after_kills() {
    check_goal(&["find", "cup A"], &[&[2], &[14, 9]]);
}

#[test]
#[ignore = "data: reads ../shared"]
fn a_run_on_real_views_is_played_again_and_goes_on_after_kills() {
    let kitchen = shared("data/kitchen");
    let robot = format!("recorded:{}", kitchen.display());
    check_goal(&["do", "find mug with confidence 0.96", "--robot", &robot], &[&[1], &[12, 10]]);
}

/// A run with the record of another as its body finds the object at the same place.
fn check_as_body(thing: &str, first: &[&str]) {
    let folder = TempDir::new().expect("a folder can be made");
    let folder = folder.path();
    let found = check(folder, &[&["find", thing, "--run", "first", "--json"], first].concat(), 0);
    let again = check(folder, &["find", thing, "--robot", "recorded:first", "--run", "second", "--json"], 0);
    let place = |report: &Value| -> [f64; 3] {
        serde_json::from_value(report["position_m"].clone()).expect("a position is three numbers")
    };
    let [a, b] = [place(&found), place(&again)];
    let apart_m = a.iter().zip(&b).map(|(a, b)| (a - b).powi(2)).sum::<f64>().sqrt();
    assert!(apart_m < 0.02, "{apart_m} m apart: {found} {again}");
    assert!(again["views"].as_u64() <= found["views"].as_u64(), "it has no more to look at");
    let third = check(folder, &["find", thing, "--robot", "recorded:second", "--json"], 0);
    assert_eq!(third["verdict"], "achieved", "a record of a record serves as well");
}

#[test]
fn a_record_of_the_simulation_is_a_body() {
    check_as_body("cup A", &[]);
}

#[test]
#[ignore = "data: reads ../shared"]
fn a_record_of_real_views_is_a_body() {
    let kitchen = shared("data/kitchen");
    check_as_body("mug", &["--robot", &format!("recorded:{}", kitchen.display())]);
}

#[test]
fn what_cannot_be_played_or_go_on_is_said() {
    let folder = TempDir::new().expect("a folder can be made");
    let folder = folder.path();
    check_refused(folder, &["replay", "nothing"], 2, &["run.json", "descry runs"]);
    check_refused(folder, &["do", "--resume", "nothing"], 2, &["run.json"]);
    check_refused(folder, &["find", "cup A", "--max-bytes", "much"], 2, &["no size", "500MB"]);
    check_refused(
        folder,
        &["find", "cup A", "--min-free", "900000TB"],
        2,
        &["--min-free", "are left before"],
    );
    check_refused(folder, &["replay", "nothing", "--speed", "0"], 2, &["no speed"]);
    if cfg!(not(feature = "mongodb")) {
        let words = ["built without MongoDB", "cargo build --release --features mongodb"];
        check_refused(folder, &["find", "cup A", "--memory", "mongodb://host/runs"], 2, &words);
        check_refused(folder, &["memory", "show", "mongodb://host/runs"], 2, &words);
    }
    std::fs::create_dir_all(folder.join("empty/segments")).expect("a folder can be made");
    check_refused(
        folder,
        &["find", "mug", "--robot", "recorded:empty"],
        2,
        &["no cloud", "folder of depth frames"],
    );
    kill_after(folder, &["find", "cup A", "--run", "cut"], 2);
    check_refused(folder, &["find", "mug", "--resume", "cut"], 2, &["find cup A", "leave the goal out"]);
    check_refused(folder, &["do", "--resume", "cut", "--seed", "3"], 2, &["--seed"]);
    std::fs::remove_dir_all(folder.join("cut/record")).expect("the record can be spoilt");
    std::fs::create_dir_all(folder.join("cut/record/segments")).expect("the record can be spoilt");
    check_refused(folder, &["replay", "cut"], 2, &["does not say what the run began with"]);
}

/// Checks the number of records that a query finds; none means exit code 1.
fn check_query(folder: &Path, conditions: &[&str], expected: std::ops::RangeInclusive<usize>) {
    let exit = i32::from(*expected.end() == 0);
    let found = check(folder, &[&["memory", "query", "run", "--json"], conditions].concat(), exit);
    let found = found["records"].as_array().map_or(0, Vec::len);
    assert!(expected.contains(&found), "{conditions:?} finds {found}, expected {expected:?}");
}

fn place(numbers: &Value) -> String {
    numbers.as_array().expect("a place").iter().map(Value::to_string).collect::<Vec<_>>().join(",")
}

#[test]
fn a_record_is_queried_verified_and_exported() {
    let folder = TempDir::new().expect("a folder can be made");
    let folder = folder.path();
    let report = check(folder, &["find", "cup A", "--run", "run", "--json"], 0);
    let views = report["views"].as_u64().expect("a number") as usize;
    let clouds = check(folder, &["memory", "query", "run", "--kind", "cloud", "--json"], 0);
    let eye = place(&clouds["records"][0]["seen_from_m"]);
    let cup = place(&report["position_m"]);
    check_query(folder, &["--kind", "cloud"], views..=views);
    let clouds = ["memory", "query", "run", "--kind", "clouds"];
    check_refused(
        folder,
        &clouds,
        1,
        &["nothing of the kind \"clouds\"", "there are: ", "belief, body, cloud, "],
    );
    check_query(folder, &["--kind", "cloud", "--frame", "camera"], views..=views);
    check_query(folder, &["--kind", "cloud", "--frame", "elsewhere"], 0..=0);
    check_query(folder, &["--kind", "cloud", "--nearest", "1", "--tolerance", "1000"], 1..=1);
    check_query(folder, &["--kind", "cloud", "--nearest", "1000000"], 0..=0);
    check_query(folder, &["--kind", "cloud", "--to", "1000000", "--newest", "--limit", "1"], 1..=1);
    check_query(folder, &["--from", "1000000"], 0..=0);
    check_query(folder, &["--object", "cup A", "--min-confidence", "0.5"], 1..=views);
    check_query(folder, &["--object", "cup A", "--min-confidence", "1"], 0..=0);
    check_query(folder, &["--seen-from", &eye, "--radius", "0.01"], 1..=views);
    check_query(folder, &["--covers", &cup, "--radius", "0.01", "--kind", "cloud"], 1..=views);
    check_query(folder, &["--covers", "100,100,100"], 0..=0);
    let shown = check(folder, &["memory", "show", "run", "--json"], 0);
    assert_eq!(shown["stats"]["kinds"]["cloud"]["records"], views);
    assert!(shown["stats"]["pinned"].as_u64() > Some(0), "what the belief rests on is pinned: {shown}");
    let exported = check(folder, &["export", "run", "all.mcap", "--json"], 0);
    assert_eq!(exported["records"], shown["stats"]["records"]);
    check_refused(folder, &["export", "run", "all.mcap"], 2, &["all.mcap is there already"]);
    check(folder, &["memory", "verify", "run", "--json"], 0);
    let segment = folder.join("run/record/segments/00000001.mcap");
    let mut bytes = std::fs::read(&segment).expect("the record has a segment");
    let middle = bytes.len() / 2;
    bytes[middle] ^= 1;
    std::fs::write(&segment, bytes).expect("the segment can be spoilt");
    let spoilt = check(folder, &["memory", "verify", "run", "--json"], 1);
    assert!(spoilt["report"]["faults"].as_array().is_some_and(|f| !f.is_empty()), "{spoilt}");
    assert_eq!(spoilt["whole"], false);
    check_refused(folder, &["memory", "show", "nothing"], 2, &["holds no record"]);
}

/// A size limit too small for the sensor data, or for the evidence of the belief, ends a run with a message
/// that states a sufficient one.
#[test]
fn a_bound_that_is_too_small_is_said() {
    let folder = TempDir::new().expect("a folder can be made");
    let folder = folder.path();
    let cases: [(&str, &[&str]); 2] = [
        ("1MB", &["bounded to 1.0 MB", "more do not fit", "--max-bytes"]),
        ("8MB", &["bounded to 8.0 MB", "records by `views`", "--max-bytes"]),
    ];
    for (bound, words) in cases {
        check_refused(folder, &["find", "cup A", "--run", bound, "--max-bytes", bound], 5, words);
        check(folder, &["memory", "verify", bound, "--json"], 0);
    }
}

/// Old records are pruned during a run; the evidence of its belief and plan stays.
#[test]
fn a_bounded_record_keeps_what_the_belief_rests_on() {
    let folder = TempDir::new().expect("a folder can be made");
    let folder = folder.path();
    let bounds = ["--max-age", "5", "--max-bytes", "60MB", "--durability", "process"];
    check(folder, &[&["find", "cup A", "--run", "run", "--json"], bounds.as_slice()].concat(), 0);
    let shown = check(folder, &["memory", "show", "run", "--json"], 0);
    let beliefs = check(
        folder,
        &["memory", "query", "run", "--kind", "belief", "--newest", "--limit", "1", "--json"],
        0,
    );
    let cites =
        beliefs["records"][0]["body"]["tracks"][0]["cites"].as_array().expect("a belief cites").clone();
    let clouds = check(folder, &["memory", "query", "run", "--kind", "cloud", "--json"], 0);
    let there: Vec<&Value> = clouds["records"].as_array().expect("a list").iter().map(|d| &d["id"]).collect();
    assert!(cites.iter().all(|id| there.contains(&id)), "{cites:?} of {there:?}, {shown}");
    let events = check(folder, &["memory", "query", "run", "--kind", "event", "--json"], 0);
    let first = &events["records"][0]["body"]["event"];
    assert_ne!(first, "goal", "what nothing rests on has gone: {shown}");
    check(folder, &["memory", "verify", "run", "--json"], 0);
    let again = check(folder, &["replay", "run", "--json"], 0);
    assert_eq!((&again["same"], &again["verdict"]), (&true.into(), &"achieved".into()), "{again}");
}

/// A copy of the built-in domain's folder with a change applied to every text.
fn domain(folder: &Path, change: impl Fn(&str, String) -> String) {
    let from = Path::new(env!("CARGO_MANIFEST_DIR")).join("../domains/tabletop");
    for sub in ["", "objects", "scenes"] {
        std::fs::create_dir_all(folder.join(sub)).expect("a folder can be made");
        for entry in std::fs::read_dir(from.join(sub)).expect("the domain is a folder").flatten() {
            if entry.path().is_file() {
                let text = std::fs::read_to_string(entry.path()).expect("a domain is text");
                let text = change(&entry.file_name().to_string_lossy(), text);
                std::fs::write(folder.join(sub).join(entry.file_name()), text).expect("it can be written");
            }
        }
    }
}

/// The current domain differs or is missing: a run replays and resumes with the domain in its record.
#[test]
fn a_run_needs_no_domain_but_that_of_its_record() {
    let folder = TempDir::new().expect("a folder can be made");
    let folder = folder.path();
    let words = folder.join("words");
    domain(&words, |_, text| text);
    let scene = std::fs::read_to_string(words.join("scenes/default.toml")).expect("the scene is a file");
    std::fs::write(folder.join("my.toml"), scene).expect("a scene can be written");
    let goal = ["find", "cup A", "--domain", "words", "--scene", "my.toml"];
    check(folder, &[&goal[..], &["--run", "whole", "--json"]].concat(), 0);
    kill_after(folder, &[&goal[..], &["--run", "cut"]].concat(), 9);
    let wider = |_: &str, text: String| text.replace("diameter_m = 0.070", "diameter_m = 0.072");
    domain(&words, wider);
    std::fs::remove_file(folder.join("my.toml")).expect("the scene can be removed");
    let again = check(folder, &["replay", "whole", "--json"], 0);
    assert_eq!(again["same"], true, "{again}");
    std::fs::remove_dir_all(&words).expect("the domain can be removed");
    check(folder, &["replay", "whole", "--json"], 0);
    check(folder, &["do", "--resume", "cut", "--json"], 0);
    assert_eq!(documents(folder, "cut"), documents(folder, "whole"));
}

/// Answers of programs are in the record: a replay runs none, and resuming requires permission.
#[test]
fn a_record_runs_no_program_by_itself() {
    let folder = TempDir::new().expect("a folder can be made");
    let folder = folder.path();
    let ran = folder.join("ran");
    let script = format!(
        "touch {}; while read line; do n=${{line#*:}}; echo \"{{\\\"id\\\":${{n%%,*}},\\\"value\\\":2.5}}\"; done",
        ran.display()
    );
    let attached = format!("\n[attachments.path-cost]\nprogram = [\"sh\", \"-c\", '''{script}''']\n");
    domain(&folder.join("words"), |name, text| match name {
        "domain.toml" => text + &attached,
        _ => text,
    });
    let goal = ["find", "cup A", "--domain", "words"];
    check(folder, &[&goal[..], &["--run", "whole", "--json"]].concat(), 0);
    let forget = || std::fs::remove_file(&ran).expect("the program was run");
    forget();
    let again = check(folder, &["replay", "whole", "--json"], 0);
    assert_eq!((&again["same"], &again["cut_off"]), (&true.into(), &Value::Null), "{again}");
    kill_after(folder, &[&goal[..], &["--run", "cut"]].concat(), 9);
    forget();
    let cut = check(folder, &["replay", "cut", "--json"], 0);
    assert!(cut["cut_off"].is_string(), "{cut}");
    let words = ["path-cost: sh -c touch", "--allow-programs"];
    check_refused(folder, &["do", "--resume", "cut"], 2, &words);
    assert!(!ran.exists(), "no program was run");
    check(folder, &["do", "--resume", "cut", "--allow-programs", "--json"], 0);
    assert_eq!(documents(folder, "cut"), documents(folder, "whole"));
}

/// Concurrent processes that start runs: in one folder one of them succeeds, in separate folders each does.
#[test]
fn every_run_has_a_folder_of_its_own() {
    let folder = TempDir::new().expect("a folder can be made");
    let folder = folder.path();
    let goals = ["cup A", "cup B", "mug"];
    let all: Vec<_> = goals.iter().map(|goal| start(folder, &["find", goal, "--run", "one"])).collect();
    let mut lost = 0;
    for mut child in all {
        // A winner speaks of its goal; the others of the winner, before they end.
        let said = first_line(&mut child);
        if said.contains("another process is writing a run there") || said.contains("holds a run already") {
            lost += 1;
            assert_eq!(child.wait().expect("it ends").code(), Some(2), "{said}");
        } else {
            child.kill().expect("it can be killed");
            child.wait().expect("it is gone");
        }
    }
    assert_eq!(lost, goals.len() - 1);
    let header = std::fs::read_to_string(folder.join("one/run.json")).expect("the winner has one");
    let header: Value = serde_json::from_str(&header).expect("it is whole");
    let begun = check(folder, &["memory", "query", "one", "--kind", "run", "--json"], 0);
    assert_eq!(begun["records"][0]["body"]["goal"], header["goal"]);
    let all: Vec<_> = goals.iter().map(|_| start(folder, &["find", "cup A"])).collect();
    for mut child in all {
        let said = first_line(&mut child);
        assert!(said.contains("cup A"), "{said}");
        child.kill().expect("it can be killed");
        child.wait().expect("it is gone");
    }
    let runs = check(folder, &["runs", "--json"], 0);
    assert_eq!(runs["runs"].as_array().map(Vec::len), Some(goals.len()), "{runs}");
}

/// Warnings are printed, a closed reader is not an error, endless input is cut off, and runs have dates.
#[test]
fn the_world_around_a_run_is_as_it_is() {
    let folder = TempDir::new().expect("a folder can be made");
    let folder = folder.path();
    check_refused(folder, &["recognise", "/dev/zero"], 2, &["/dev/zero", "it is a device"]);
    check_refused(folder, &["check", "/dev/zero"], 2, &["/dev/zero", "it is a device"]);
    kill_after(folder, &["find", "cup A", "--run", "runs/one"], 8);
    let listed = outcome(folder, &["runs"]);
    let listed = String::from_utf8_lossy(&listed.stdout).into_owned();
    let is_date = |text: &str| text.starts_with("20") && text[..16].matches(['-', ':']).count() == 3;
    assert!(is_date(&listed) && listed.contains("unfinished"), "{listed}");
    check(folder, &["find", "cup A", "--run", "runs/two", "--json"], 0);
    for file in ["index.sqlite", "index.sqlite-wal", "index.sqlite-shm"] {
        std::fs::write(folder.join("runs/two/record").join(file), "no index").expect("it can be spoilt");
    }
    let shown = outcome(folder, &["show", "runs/two"]);
    let warned = String::from_utf8_lossy(&shown.stderr).into_owned();
    assert!(
        shown.status.success() && warned.contains("WARN") && warned.contains("index is damaged"),
        "{warned}"
    );
    assert!(!warned.contains('\u{1b}'), "no colour where there is no terminal");
    for (out, err) in [(true, false), (false, true), (true, true)] {
        for arguments in [&["show", "runs/one"][..], &["runs", "nowhere"], &["replay", "runs/one"]] {
            let exit = without_readers(folder, arguments, out, err);
            assert_eq!(exit, Some(0), "{arguments:?} without a reader of {out} {err}");
        }
    }
}
