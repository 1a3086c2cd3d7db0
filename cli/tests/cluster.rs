//! Shards of an experiment as a scheduler runs them: each with its index in the scheduler's variable, in one
//! shared folder.

use std::path::Path;
use std::process::Command;

use crate::binary::{check_refused, outcome};

const BATCH: &str = r#"
name = "A few runs"
kind = "tasks"
about = "It's \"a few\": $HOME"
domain = "tabletop"
scene = "default"
runs = 2
first_seed = 1
policies = ["plan", "nearest"]

[[goal]]
say = "find cup A"
targets = ["cup A"]
truly = "found"
"#;

/// Results of a batch that do not depend on where it ran.
fn results(folder: &Path, out: &str) -> Vec<String> {
    ["jobs.csv", "summary.json", "tables.md"]
        .map(|name| {
            std::fs::read_to_string(folder.join(out).join(name))
                .unwrap_or_else(|e| panic!("{out}/{name}: {e}"))
        })
        .to_vec()
}

/// Runs a shell command as the pod or array task with these variables.
fn run(folder: &Path, arguments: &[&str], variables: &[(&str, &str)]) {
    let binary = Path::new(env!("CARGO_BIN_EXE_descry"));
    let path = format!(
        "{}:{}",
        binary.parent().expect("a folder").display(),
        std::env::var("PATH").unwrap_or_default()
    );
    let mut shell = Command::new(arguments[0]);
    shell.args(&arguments[1..]).env("PATH", path).envs(variables.iter().copied()).current_dir(folder);
    let ran = shell.output().expect("there is a shell");
    assert!(ran.status.success(), "{variables:?}: {}", String::from_utf8_lossy(&ran.stderr));
}

#[test]
fn the_files_of_an_array_can_be_read() {
    let folder = tempfile::tempdir().expect("a folder");
    let folder = folder.path();
    std::fs::write(folder.join("batch.toml"), BATCH).expect("the folder is writable");
    let write = ["experiment", "batch.toml", "--out", "by slurm", "--shards", "3"];
    let written =
        outcome(folder, &[&write[..], &["--slurm", "batch.sh", "--kubernetes", "batch.yaml"]].concat());
    assert!(written.status.success(), "{}", String::from_utf8_lossy(&written.stderr));
    run(folder, &["bash", "-n", "batch.sh"], &[]);
    let yaml = std::fs::read_to_string(folder.join("batch.yaml")).expect("it is written");
    let text = yaml.lines().find_map(|line| line.trim().strip_prefix("\"batch.toml\": "));
    let text: String = serde_json::from_str(text.expect("the key is there")).expect("it is JSON");
    assert_eq!(text, BATCH);
}

#[test]
#[ignore = "slow: three batches, one of them in shards"]
fn an_array_of_shards_gives_what_one_batch_gives() {
    let folder = tempfile::tempdir().expect("a folder");
    // A shell would read it as two words, and as the home of somebody.
    let folder = &folder.path().join("some $HOME's");
    std::fs::create_dir(folder).expect("the folder is writable");
    std::fs::write(folder.join("batch.toml"), BATCH).expect("the folder is writable");
    assert!(outcome(folder, &["experiment", "batch.toml", "--out", "whole"]).status.success());
    let expected = results(folder, "whole");
    let write = ["experiment", "batch.toml", "--out", "by slurm", "--shards", "3", "--jobs", "1"];
    let written =
        outcome(folder, &[&write[..], &["--slurm", "batch.sh", "--kubernetes", "batch.yaml"]].concat());
    assert!(written.status.success(), "{}", String::from_utf8_lossy(&written.stderr));
    // From anywhere: the script goes to where it was written.
    let script = folder.join("batch.sh").display().to_string();
    run(Path::new("/"), &["bash", "-n", &script], &[]);
    for task in ["0", "2", "1"] {
        run(Path::new("/"), &["bash", &script], &[("SLURM_ARRAY_TASK_ID", task)]);
    }
    assert_eq!(results(folder, "by slurm"), expected, "the last shard writes the results");
    let yaml = std::fs::read_to_string(folder.join("batch.yaml")).expect("it is written");
    let line =
        |key: &str| yaml.lines().find_map(|line| line.trim().strip_prefix(key)).expect("the key is there");
    let command: Vec<String> = serde_json::from_str(line("command: ")).expect("it is JSON");
    let text: String = serde_json::from_str(line("\"batch.toml\": ")).expect("it is JSON");
    assert_eq!(text, BATCH);
    std::fs::create_dir(folder.join("mounted")).expect("the folder is writable");
    std::fs::write(folder.join("mounted/batch.toml"), text).expect("the folder is writable");
    let command: Vec<&str> = command.iter().map(String::as_str).collect();
    for pod in ["1", "0", "2"] {
        let mounted =
            [("EXPERIMENT", "mounted/batch.toml"), ("RESULTS", "by pods"), ("JOB_COMPLETION_INDEX", pod)];
        run(folder, &command, &mounted);
    }
    let merge = ["experiment", "batch.toml", "--out", "merged", "--merge", "by pods"];
    assert!(outcome(folder, &merge).status.success());
    assert_eq!(results(folder, "merged"), expected);
}

#[test]
fn what_cannot_be_divided_is_refused() {
    let folder = tempfile::tempdir().expect("a folder");
    let folder = folder.path();
    std::fs::write(folder.join("batch.toml"), BATCH).expect("the folder is writable");
    for shards in ["0", "5"] {
        let asked = ["experiment", "batch.toml", "--slurm", "batch.sh", "--shards", shards];
        check_refused(folder, &asked, 2, &["4 jobs", "from 1 to 4"]);
    }
    check_refused(folder, &["experiment", "batch.toml", "--slurm", "batch.sh"], 2, &["--shards"]);
    check_refused(folder, &["experiment", "batch.toml", "--shards", "2"], 2, &["--slurm"]);
    assert!(!folder.join("batch.sh").exists());
}

#[test]
fn a_value_of_the_file_may_be_given_on_the_command_line() {
    let folder = tempfile::tempdir().expect("a folder");
    std::fs::write(folder.path().join("batch.toml"), BATCH).expect("it can be written");
    let of = |set: &[&str]| {
        let mut arguments = vec!["experiment", "batch.toml", "--shards", "1", "--kubernetes", "job.yaml"];
        arguments.extend(set);
        let made = outcome(folder.path(), &arguments);
        assert!(made.status.success(), "{}", String::from_utf8_lossy(&made.stderr));
        std::fs::read_to_string(folder.path().join("job.yaml")).expect("it is written")
    };
    let plain = of(&[]);
    let set =
        of(&["--set", "runs=5", "--set", "goal.0.targets=[\"cup B\"]", "--set", "goal.0.say=\"find cup B\""]);
    let changed = plain.replace("runs = 2", "runs = 5").replace("cup A", "cup B");
    assert_ne!(plain, set);
    assert_eq!(set, changed, "nothing else differs");
    let added = of(&["--set", "goal.0.absent_share=0.5", "--set", "position_tolerance_m=0.1"]);
    for part in [r"position_tolerance_m = 0.1\n\nname", r"[[goal]]\nabsent_share = 0.5\nsay"] {
        assert!(added.contains(part), "{part} is not in\n{added}");
    }
    for (wrong, words) in [
        ("goal.1.say=\"x\"", "`goal` has one entry, number 0"),
        ("goals.0.say=\"x\"", "the file has the keys about, domain, first_seed, goal"),
        ("rums=5", "(with --set rums=5):1:1: unknown field `rums`, expected one of `name`"),
        ("goal.0.absent_shar=5", "unknown field `absent_shar`, expected one of `say`"),
        ("goal=5", "`goal` has one entry, number 0"),
        ("runs", "expected KEY=VALUE"),
        ("runs=five of them", "a text needs quotes: 'runs=\"five of them\"'"),
        ("runs=5\nfirst_seed=2", "no TOML value"),
    ] {
        check_refused(folder.path(), &["experiment", "batch.toml", "--set", wrong], 2, &[words]);
    }
}
