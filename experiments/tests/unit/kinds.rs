//! Experiment files as people write them, and each kind on a small scale.

use descry_agent::stop::Stop;
use descry_domains::load::{Domain, program_texts};
use descry_experiments::kinds::kind::inputs_of;
use descry_experiments::kinds::*;
use descry_experiments::{Row, Source};
use std::path::Path;

/// Text of a shipped experiment: by its file name in the domain tabletop, or with the domain's name
/// before it.
fn shipped(name: &str) -> String {
    let (domain, file) = name.split_once('/').unwrap_or(("tabletop", name));
    let path =
        Path::new(env!("CARGO_MANIFEST_DIR")).join("../domains").join(domain).join("experiments").join(file);
    std::fs::read_to_string(&path).unwrap_or_else(|e| panic!("{}: {e}", path.display()))
}

fn source(text: String) -> Source {
    Source { path: "e.toml".into(), text, assignments: Vec::new() }
}

#[test]
fn shipped_files_are_read() {
    for (name, jobs) in [
        ("where-to-look.toml", 200 * 3 * 8),
        ("figure-4.toml", 104),
        ("faults.toml", 1000),
        ("two-tables.toml", 200 * 3),
        ("home/find.toml", 4 * 300),
        ("home/bring.toml", 4 * 300),
        ("home/faults.toml", 2 * 300),
        ("home/two-rooms.toml", 200 * 3),
    ] {
        let kind = read(&source(shipped(name))).unwrap_or_else(|e| panic!("{name}: {e}"));
        let ids: std::collections::BTreeSet<String> = kind.jobs().into_iter().map(|job| job.id).collect();
        assert_eq!(ids.len(), jobs, "{name}");
    }
}

#[test]
fn files_that_name_other_bodies_are_read() {
    for (name, jobs) in [("home.toml", 10 * 3 * 2), ("two-tables.toml", 20 * 2 * 2), ("figure-4.toml", 200)] {
        let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../robots/mujoco").join(name);
        let text = std::fs::read_to_string(&path).unwrap_or_else(|e| panic!("{}: {e}", path.display()));
        let kind = read(&source(text)).unwrap_or_else(|e| panic!("{name}: {e}"));
        assert_eq!(kind.jobs().len(), jobs, "{name}");
    }
}

#[test]
fn programs_of_a_domain_count_as_inputs() {
    let folder = concat!(env!("CARGO_MANIFEST_DIR"), "/../domains/multi-object-search");
    let domain = Domain::load(folder).unwrap_or_else(|e| panic!("{e}"));
    let inputs = inputs_of(&domain, String::new(), std::iter::empty());
    let program = inputs.iter().find(|(name, _)| name.ends_with("world.py"));
    assert!(program.is_some_and(|(_, text)| text.contains("def ")), "{inputs:?}");
}

/// The template robot with a ground-truth file: everything is visible to the camera, or there is a cup A that
/// it does not show.
const TELLING: &str = r#"
import json, sys
sys.path.insert(0, "PYTHON")
import descry_robot as descry, template
seed, truth, without = sys.argv[1:]
still = {"translation": [0, 0, 0.72], "rotation": [0, 0, 0, 1]}
cup = {"name": "cup A", "kind": "cup A", "surface": "table", "present": True, "map_from_object": still,
       "centre_m": [0, 0, 0.77], "size_m": [0.07, 0.07, 0.104]}
base = {"x_m": -2, "y_m": 0, "yaw_rad": 0}
with open(truth, "w") as file:
    json.dump({"stamp_ns": int(seed), "base": base, "objects": [] if without == "cup A" else [cup]}, file)
descry.serve(template.Template())
"#;

#[test]
fn a_run_with_a_program_is_held_against_the_truth_that_it_tells() {
    if std::process::Command::new("python3").arg("--version").output().is_err() {
        println!("SKIPPED: python3 is not here");
        return;
    }
    let folder = tempfile::tempdir().unwrap_or_else(|e| panic!("{e}"));
    let python = Path::new(env!("CARGO_MANIFEST_DIR")).join("../robots/python");
    let body = folder.path().join("body.py");
    let written = std::fs::write(&body, TELLING.replace("PYTHON", &python.display().to_string()));
    written.unwrap_or_else(|e| panic!("{e}"));
    let text = format!(
        "name = \"own\"\nkind = \"tasks\"\ndomain = \"tabletop\"\nscene = \"two-tables\"\nruns = 2\npolicies = [\"plan\"]\n\
         [[goal]]\nsay = \"find cup A\"\ntargets = [\"cup A\"]\ntruly = \"found\"\nabsent_share = 0.5\n\
         [[case]]\nname = \"own body\"\nrobot = \"program:python3 '{}' {{seed}} {{truth}} {{without}}\"\n",
        body.display()
    );
    for (number, present) in [(0, true), (1, false)] {
        let row = one_job(text.clone(), number);
        assert_eq!(row["present"], present, "{row:?}");
        assert!(row["verdict"] != "achieved" && row["views"].as_u64() > Some(0), "{row:?}");
        let said_no = row["verdict"] == "not_found";
        assert_eq!(
            (&row["false_yes"], &row["false_not_there"]),
            (&false.into(), &(said_no && present).into()),
            "{row:?}"
        );
    }
}

#[test]
fn mistakes_are_drawn_under_the_text() {
    let check = |file: &str, from: &str, to: &str, expected: &[&str]| {
        let text = shipped(file);
        assert!(text.contains(from), "{from} is not in {file}");
        let error =
            read(&source(text.replacen(from, to, 1))).err().map(|e| e.to_string()).unwrap_or_default();
        for part in expected {
            assert!(error.contains(part), "\"{part}\" is not in\n{error}");
        }
    };
    let look = "where-to-look.toml";
    check(
        look,
        "kind = \"where-to-look\"",
        "kind = \"dance\"",
        &["e.toml:6", "\"dance\"", "figure-4, where-to-look, faults, tasks"],
    );
    check(look, "scenes = 200", "scenes = 0", &["scenes = 0", "1 to 1000000"]);
    check(look, "scenes = 200", "scenes = \"many\"", &["scenes = \"many\"", "^"]);
    check(look, "scenes = 200", "scene_count = 200", &["scene_count"]);
    check(look, "\"nearest\"", "\"next\"", &["no policy is called \"next\"", "gain-per-second"]);
    check(look, "ours = \"plan\"", "ours = \"plans\"", &["ours = \"plans\"", "one of: plan"]);
    check(look, "goal = \"find cup A\"", "goal = \"find cup Q\"", &["cup Q", "cup A"]);
    check(look, "[0.25, 0.6]", "[0.6, 0.25]", &["no range of shares"]);
    check(
        "figure-4.toml",
        "\"published\"",
        "\"neural\"",
        &["no recogniser is called \"neural\"", "descry, published"],
    );
    check("figure-4.toml", "\"mug\"]", "\"jug\"]", &["no object is called \"jug\"", "cup B"]);
    let bring = "home/bring.toml";
    check(bring, "\"sweep\"", "\"broom\"", &["no policy is called \"broom\"", "nearest-surface"]);
    check(bring, "[\"cup A\"]", "[\"cup Q\"]", &["goal \"pick up cup A\"", "\"cup Q\"", "red cup 1"]);
    check(bring, "surface = \"desk\"", "", &["on which surface", "add surface"]);
    check(bring, "surface = \"desk\"", "surface = \"disk\"", &["no surface \"disk\"", "coffee table"]);
    check(bring, "[\"cup A\"]", "[]", &["goal \"pick up cup A\"", "no targets"]);
    check(
        bring,
        "surface = \"desk\"",
        "surface = \"counter\"",
        &["about the surface \"desk\"", "surface = \"desk\""],
    );
    check(bring, "[\"cup A\"]", "[\"white cylinder\"]", &["about \"cup A\", which none of its targets is"]);
    let find = "home/find.toml";
    check(find, "truly = \"answered\"", "truly = \"stands\"", &["it is a question", "answered"]);
    check(find, "truly = \"found\"", "truly = \"answered\"\nsurface = \"desk\"", &["it is no question"]);
    check(find, "room = \"kitchen\"", "", &["about the room \"kitchen\"", "room = \"kitchen\""]);
    check(bring, "truly = \"held\"", "truly = \"hold\"", &["truly = \"hold\"", "all-stand"]);
    let other = |robot: &str| format!("[[case]]\nname = \"other\"\n{robot}\n\n[[goal]]");
    let rooms = "home/two-rooms.toml";
    check(rooms, "[[goal]]", &other("robot = \"program:x {seed}\""), &["no {truth}", "--truth {truth}"]);
    check(rooms, "[[goal]]", &other("robot = \"sim\""), &["expected program:COMMAND"]);
    let both = "robot = \"program:x {seed} {truth}\"\nfault = [{ kind = \"grasp_slips\", at = 1 }]";
    check(rooms, "[[goal]]", &other(both), &["befall our simulator only"]);
    check(
        bring,
        "[[goal]]",
        &other("robot = \"program:x {seed} {truth}\""),
        &["\"oracle\" asks our simulator"],
    );
    check("faults.toml", "chance = 0.3", "chance = 3", &["case \"blocked path\"", "between 0 and 1"]);
}

#[test]
fn every_fourth_scene_of_each_level_is_without_the_target() {
    let text = shipped("where-to-look.toml").replace("scenes = 200", "scenes = 24");
    let text = text.replace("poses = [5, 8, 16]", "poses = [5]");
    let kind = read(&source(text)).unwrap_or_else(|e| panic!("{e}"));
    let jobs = kind.jobs();
    assert_eq!(jobs.len(), 24 * 8);
    let levels: Vec<&str> =
        jobs.iter().step_by(8).filter_map(|job| job.factors["occlusion"].as_str()).collect();
    assert_eq!(levels[..4], ["hidden", "below a quarter", "up to 0.6", "hidden"]);
}

/// Runs one job of a shipped file; returns its only row.
fn one_job(text: String, number: usize) -> Row {
    let folder = tempfile::tempdir().unwrap_or_else(|e| panic!("{e}"));
    let kind = read(&source(text)).unwrap_or_else(|e| panic!("{e}"));
    let once = kind.run(number, &folder.path().join("a"), &Stop::default()).unwrap_or_else(|e| panic!("{e}"));
    let again =
        kind.run(number, &folder.path().join("b"), &Stop::default()).unwrap_or_else(|e| panic!("{e}"));
    assert_eq!(once.rows, again.rows, "a job gives the same again");
    once.rows.into_iter().last().unwrap_or_default()
}

#[test]
fn a_run_is_held_against_the_truth() {
    let row = one_job(shipped("where-to-look.toml"), 0);
    let measured = descry_experiments::kinds::trial::Measured::read(0, &row);
    assert!(measured.is_some_and(|m| m.present && m.views >= 1.0 && m.seconds > 0.0), "{row:?}");
}

#[test]
fn the_first_look_is_given_to_the_oracle_too() {
    let once =
        shipped("where-to-look.toml").replace("scenes = 200", "scenes = 1").replace("[5, 8, 16]", "[8]");
    let views = |text: String| one_job(text, 7)["views"].as_u64();
    assert_eq!(
        views(once.replace("first_look_from_start = true", "")),
        Some(1),
        "it goes where the cup is seen"
    );
    assert_eq!(views(once), Some(2));
}

#[test]
fn what_somebody_took_away_is_missed() {
    let text = shipped("faults.toml").replace("first_seed = 1", "first_seed = 9001");
    let kind = read(&source(text.clone())).unwrap_or_else(|e| panic!("{e}"));
    let of = |id: &str| kind.jobs().iter().position(|job| job.id == id);
    let number = of("case=object moved run=12").unwrap_or_else(|| panic!("{:?}", kind.jobs()[0].id));
    assert_eq!(one_job(text, number)["verdict"], "achieved", "found where it stands now");
}

#[test]
fn two_views_are_scored() {
    let row = one_job(shipped("figure-4.toml").replace("poses = 5", "poses = 2"), 0);
    assert_eq!(
        (row["mode"].as_str(), row["views"].as_u64(), row["things"].as_u64()),
        (Some("merged"), Some(2), Some(4))
    );
    assert!(row["handled"].as_array().is_some_and(|handled| handled.len() == 1), "{row:?}");
}

#[test]
fn a_policy_gets_through_a_shut_door_and_the_planner_does_the_rest() {
    // The body starts in the kitchen, cup A stands in the study, the door between them is shut.
    let text = shipped("home/two-rooms.toml")
        .replace("\"plan\"", "\"nearest-surface\", \"oracle\"")
        .replace("first_seed = 5001", "first_seed = 5004");
    let bring = "[[goal]]\nsay = \"bring cup A to the counter\"\ntargets = [\"cup A\"]\ntruly = \"stands\"\nsurface = \"counter\"\n\
                 stages = [\"open-door\", \"pick-up\"]\n\n[[case]]\nname = \"shut\"\n\
                 fault = [{ kind = \"door_shut\", at = 1, door = \"study door\" }]\n";
    let text = text.split("[[goal]]").next().unwrap_or_default().to_string() + bring;
    let kind = read(&source(text)).unwrap_or_else(|e| panic!("{e}"));
    let folder = tempfile::tempdir().unwrap_or_else(|e| panic!("{e}"));
    let once = kind.run(1, folder.path(), &Stop::default()).unwrap_or_else(|e| panic!("{e}"));
    let row = &once.rows[0];
    assert_eq!(
        (&row["right"], &row["open-door done"], &row["pick-up done"]),
        (&true.into(), &true.into(), &true.into()),
        "{row:?}"
    );
}

#[test]
fn a_program_is_the_files_that_its_command_names_and_what_it_may_use() {
    let folder = tempfile::tempdir().expect("a folder");
    let folder = folder.path();
    std::fs::create_dir_all(folder.join("calls")).expect("a folder");
    for (name, text) in
        [("act.py", "a"), ("common.py", "c"), ("notes.txt", "n"), ("calls/cost.py", "k"), ("run", "r")]
    {
        std::fs::write(folder.join(name), text).expect("written");
    }
    let cases: [(&[&str], &[&str]); 5] = [
        (&["python3", "act.py", "once"], &["a", "c"]),
        (&["python3", "calls/cost.py"], &["k"]),
        (&["python3", "absent.py"], &[]),
        (&["run"], &[]),
        (&["python3", "act.py", "notes.txt"], &["a", "c", "n"]),
    ];
    for (command, expected) in cases {
        let texts = program_texts(command.iter().copied(), folder);
        assert_eq!(texts.values().collect::<Vec<_>>(), expected, "{command:?}");
    }
}
