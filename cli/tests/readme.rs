//! The commands of README and of the book are commands, and what README shows of an explanation is what is said.

use crate::binary;
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("..")
}

/// The lines of a text's fenced blocks, block by block.
fn blocks(text: &str) -> Vec<Vec<&str>> {
    let parts = text.split("\n```").skip(1).step_by(2);
    parts.map(|block| block.lines().skip(1).collect()).collect()
}

/// What help says of a command, `memory query` or `plan`; asked once.
fn help<'a>(known: &'a mut BTreeMap<String, String>, command: &str) -> &'a str {
    known.entry(command.to_owned()).or_insert_with(|| {
        let arguments: Vec<&str> = std::iter::once("help").chain(command.split(' ')).collect();
        let said = binary::outcome(Path::new("."), &arguments);
        assert!(said.status.success(), "`descry {command}` is no command");
        String::from_utf8_lossy(&said.stdout).into_owned()
    })
}

#[test]
fn every_command_that_is_shown_is_one_with_these_options() {
    let mut known = BTreeMap::new();
    let mut checked = 0;
    for page in ["README.md", "docs/see.md", "docs/scale.md", "docs/editors.md", "docs/introduction.md"] {
        let text = std::fs::read_to_string(root().join(page)).expect("the page is there");
        for line in blocks(&text).concat() {
            let Some(rest) = line.trim_start_matches("$ ").strip_prefix("descry ") else { continue };
            // What stands behind a gap is said of it.
            let typed = rest.split("   ").next().unwrap_or_default();
            let words: Vec<&str> = typed.split_whitespace().collect();
            let command = match words.as_slice() {
                [group @ ("memory" | "robot"), name, ..] => format!("{group} {name}"),
                [name, ..] => (*name).to_owned(),
                [] => panic!("{page}: {line}"),
            };
            let said = help(&mut known, &command);
            for option in words.iter().filter(|word| word.starts_with("--")) {
                let name = option.split('=').next().unwrap_or(option).trim_end_matches([',', ';', ':']);
                assert!(said.contains(name), "{page}: `descry {command}` has no {name}: {line}");
            }
            checked += 1;
        }
    }
    assert!(checked > 50, "{checked} commands");
}

#[test]
fn the_explanation_that_is_shown_is_what_is_said() {
    let text = std::fs::read_to_string(root().join("README.md")).expect("it is there");
    let all = blocks(&text);
    let at = all.iter().position(|block| block.contains(&"descry explain runs/ten")).expect("it is shown");
    let shown = all[at + 1].join("\n");
    let folder = tempfile::tempdir().expect("a folder");
    let run = binary::outcome(folder.path(), &["find", "cup A", "--seed", "10", "--run", "runs/ten"]);
    assert!(run.status.success(), "{}", String::from_utf8_lossy(&run.stderr));
    let said = binary::outcome(folder.path(), &["explain", "runs/ten"]);
    let said = String::from_utf8_lossy(&said.stdout);
    assert!(said.contains(&shown), "README shows\n{shown}\nbut this is said:\n{said}");
}

/// How a command of a page is run here.
#[derive(Clone, Copy)]
enum Way {
    /// It ends within seconds, with this exit code.
    Ends(i32),
    /// The same, in minutes.
    Slow(i32),
    /// It is not run here, and why.
    Not(&'static str),
}

/// Commands that do not simply end well within seconds, by how they begin.
const OTHERS: [(&str, Way); 19] = [
    ("descry find mug --robot \"program:", Way::Ends(1)), // The table of the template is empty.
    ("descry do \"bring cup A to the desk\"", Way::Slow(0)),
    ("descry do \"which cups are in the kitchen\"", Way::Slow(0)),
    ("descry do \"map the room\"", Way::Slow(0)),
    ("descry do \"learn what is new\"", Way::Slow(0)),
    ("descry do \"what has changed\"", Way::Slow(0)),
    ("descry name SEEN", Way::Not("needs a thing that came between two visits: tests/learning.py has them")),
    (
        "descry find \"the thing from Tuesday\"",
        Way::Not("needs one of that name: tests/learning.py has them"),
    ),
    ("descry find \"cup A\" --domain home", Way::Slow(0)),
    ("descry do --resume RUN", Way::Not("needs a kill: the tests of records do that")),
    ("descry lsp", Way::Not("serves until its input ends: the tests of editors do that")),
    ("descry experiment two-tables.toml --out all --merge", Way::Not("needs the folders of three machines")),
    ("descry find \"cup A\" --run runs/one --memory mongodb:", Way::Not("needs a server")),
    ("descry memory show mongodb:", Way::Not("needs a server")),
    ("descry memory query \"mongodb:", Way::Not("needs a server")),
    ("descry replay runs/one", Way::Not("what it plays is on a server")),
    ("descry find \"cup A\" --robot \"recorded:mongodb:", Way::Not("needs a server")),
    ("descry experiment FILE --out DIR", Way::Slow(0)),
    ("descry experiment two-tables.toml --out results --live", Way::Slow(0)),
];

/// What stands for something else on the pages, and what it is in the folder of [`scratch`].
const MEANT: [(&str, &str); 17] = [
    ("program:COMMAND", "program:python3 template.py"),
    ("recorded:DIR", "recorded:run"),
    ("check DIR", "check messenger"),
    ("--out DIR", "--out of-readme"),
    ("check DOMAIN [PROBLEM]", "check domain.pddl problem.pddl"),
    ("DOMAIN PROBLEM PLAN", "domain.pddl problem.pddl plan.plan"),
    ("DOMAIN PROBLEM", "domain.pddl problem.pddl"),
    ("(A x)", "(drive van home crossing)"),
    ("domain.pddl problem.pddl --attach", "roads.pddl roads-problem.pddl --attach"),
    ("FILES…", "domain.pddl problem.pddl"),
    ("CLOUD.pcd", "cloud.pcd"),
    ("FILE --", "two-tables.toml --"),
    ("--shards N --slurm F", "--out results --shards 2 --slurm batch.sh"),
    ("--shards 16", "--shards 8"),
    ("--out results --merge results", "--out shared --merge shared"),
    (" RUN", " run"),
    (" runs/mug", " run"),
];

/// A cloud of a table .8 m below its sensor with a block on it, PCD.
fn cloud() -> String {
    let table =
        (0..120 * 80).map(|n| (f64::from(n % 120) / 120.0 - 0.5, 1.0 + f64::from(n / 120) / 130.0, -0.8));
    let top = (0..400).map(|n| (f64::from(n % 20) / 250.0, 1.3 + f64::from(n / 20) / 250.0, -0.7));
    let front = (0..400).map(|n| (f64::from(n % 20) / 250.0, 1.3, -0.8 + f64::from(n / 20) / 200.0));
    let points: Vec<String> =
        table.chain(top).chain(front).map(|(x, y, z)| format!("{x:.4} {y:.4} {z:.4}\n")).collect();
    let n = points.len();
    format!(
        "VERSION .7\nFIELDS x y z\nSIZE 4 4 4\nTYPE F F F\nCOUNT 1 1 1\nWIDTH {n}\nHEIGHT 1\nVIEWPOINT 0 0 0 1 0 0 0\nPOINTS {n}\nDATA ascii\n{}",
        points.concat()
    )
}

/// A folder with what the pages speak of: a run, a domain's folder, PDDL files, a plan, a cloud, a small experiment, a body.
fn scratch() -> tempfile::TempDir {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path();
    let write = |name: &str, text: &str| std::fs::write(path.join(name), text).expect("it can be written");
    let read = |name: &str| std::fs::read_to_string(root().join(name)).expect("it is there");
    let roads = read("cli/tests/data/roads.pddl");
    let known = roads.replace("[path-cost ?from ?to]", "2");
    let known: Vec<&str> = known.lines().filter(|line| !line.contains("(:modules")).collect();
    write("domain.pddl", &known.join("\n").replace(" :modules", ""));
    write("roads.pddl", &roads);
    for name in ["problem.pddl", "roads-problem.pddl"] {
        write(name, &read("cli/tests/data/roads-problem.pddl"));
    }
    write("plan.plan", "0.000: (drive van home market) [2.000]\n");
    write(
        "cost.py",
        "import json, sys\nfor line in sys.stdin:\n    print(json.dumps({'id': json.loads(line)['id'], 'value': 2.0}), flush=True)\n",
    );
    write("cloud.pcd", &cloud());
    let batch = read("domains/tabletop/experiments/two-tables.toml");
    write("two-tables.toml", &batch.replace("runs = 200", "runs = 3"));
    for name in ["template.py", "descry_robot.py"] {
        write(name, &read(&format!("robots/python/{name}")));
    }
    for below in [".local/share/bash-completion/completions", ".zfunc", ".config/fish/completions"] {
        std::fs::create_dir_all(path.join(below)).expect("it can be made");
    }
    std::os::unix::fs::symlink(
        root().join("domains").canonicalize().expect("it is there"),
        path.join("domains"),
    )
    .expect("it can be linked");
    for made in [&["new", "messenger"][..], &["find", "cup A", "--run", "run"]] {
        assert!(binary::outcome(path, made).status.success(), "{made:?}");
    }
    folder
}

/// A command as it is typed, run in a folder that is its home, too.
fn typed(folder: &Path, command: &str) -> std::process::Output {
    let descry = Path::new(env!("CARGO_BIN_EXE_descry")).parent().expect("a folder");
    let path = format!("{}:{}", descry.display(), std::env::var("PATH").unwrap_or_default());
    let mut shell = std::process::Command::new("sh");
    shell.args(["-c", command]).current_dir(folder).env("PATH", path).env("HOME", folder);
    shell.stdin(std::process::Stdio::null()).output().expect("sh runs")
}

/// Types what the pages show, from top to bottom; `slow`: that which takes minutes, too.
fn follow(slow: bool) -> (usize, Vec<String>) {
    let folder = scratch();
    let (mut run, mut wrong) = (0, Vec::new());
    for page in ["README.md", "docs/see.md", "docs/scale.md", "docs/editors.md", "docs/introduction.md"] {
        let text = std::fs::read_to_string(root().join(page)).expect("the page is there");
        for line in blocks(&text).concat().into_iter().filter(|line| line.starts_with("descry ")) {
            // What stands behind a gap is said of it.
            let shown = line.split("   ").next().unwrap_or_default();
            let way = OTHERS.iter().find(|(begins, _)| shown.starts_with(begins)).map(|(_, way)| *way);
            let exit = match way.unwrap_or(Way::Ends(0)) {
                Way::Ends(exit) => exit,
                Way::Slow(exit) if slow => exit,
                Way::Slow(_) => continue,
                Way::Not(why) => {
                    println!("SKIPPED: {shown}: {why}");
                    continue;
                }
            };
            let command = MEANT.iter().fold(shown.to_string(), |said, (from, to)| said.replace(from, to));
            let ended = typed(folder.path(), &command);
            run += 1;
            if ended.status.code() != Some(exit) {
                let said = String::from_utf8_lossy(&ended.stderr);
                let last: Vec<&str> = said.lines().rev().take(5).collect();
                wrong.push(format!("{page}: {command}: {:?}, not {exit}: {last:?}", ended.status.code()));
            }
        }
    }
    (run, wrong)
}

#[test]
fn what_ends_within_seconds_ends_as_it_is_said() {
    let (run, wrong) = follow(false);
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
    assert!(run > 35, "{run} commands");
}

#[test]
#[ignore = "takes minutes: exploring, learning and batches"]
fn all_that_is_shown_ends_as_it_is_said() {
    let (run, wrong) = follow(true);
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
    assert!(run > 45, "{run} commands");
}
