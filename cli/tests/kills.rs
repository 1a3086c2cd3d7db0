//! Kills at any moment: the run goes on to the same end, and nothing that was done is asked for again.

mod binary;
mod body;

use std::path::Path;
use std::time::Duration;

use binary::{check, start};
use body::{body_in, check_nothing_twice, has_python};
use serde_json::Value;
use tempfile::TempDir;

const KILLS: u64 = 200;

/// Kills a command after a while, as the seed has it; false if it had ended by then.
fn kill_at_random(folder: &Path, arguments: &[&str], seed: u64, longest_ms: u64) -> bool {
    let mut child = start(folder, arguments);
    let wait_ms = (seed.wrapping_mul(0x9e37_79b9_7f4a_7c15) >> 33) % longest_ms;
    std::thread::sleep(Duration::from_millis(wait_ms));
    let under_way = child.try_wait().expect("it can be asked").is_none();
    let _ = child.kill();
    child.wait().expect("it is gone");
    under_way
}

/// Pursues a goal with a body, killed again and again; each run ends as an undisturbed one does.
fn check_kills(robot: &str, exit: i32, longest_ms: u64, after: impl Fn(&Path)) {
    let (mut kills, mut runs) = (0, 0_u64);
    while kills < KILLS {
        runs += 1;
        let folder = TempDir::new().expect("a folder can be made");
        let folder = folder.path();
        body_in(folder);
        let seed = (runs % 5 + 1).to_string();
        let goal = ["find", "cup A", "--robot", robot, "--seed", &seed, "--run"];
        let whole: Value = check(folder, &[&goal[..], &["whole", "--json"]].concat(), exit);
        for of_the_body in ["heard", "stands"] {
            let _ = std::fs::remove_file(folder.join(of_the_body));
        }
        let resume = ["do", "--resume", "run", "--allow-programs"];
        let mut killed = kill_at_random(folder, &[&goal[..], &["run"]].concat(), kills, longest_ms);
        // Before anything was kept there is nothing to go on with.
        let has_begun = || folder.join("run/run.json").exists();
        while killed && kills < KILLS && has_begun() {
            kills += 1;
            killed = kill_at_random(folder, &resume, kills, longest_ms);
        }
        if has_begun() {
            let context = || format!("run {runs} after {kills} kills");
            let report = check(folder, &[&resume[..], &["--json"]].concat(), exit);
            assert_eq!(report["verdict"], whole["verdict"], "{}: {report}", context());
            let verified = check(folder, &["memory", "verify", "run", "--json"], 0);
            assert_eq!(verified["whole"], true, "{}", context());
            after(folder);
        }
    }
    println!("{kills} kills in {runs} runs");
}

#[test]
#[ignore = "takes minutes: 200 kills"]
fn two_hundred_kills_of_the_simulated_body() {
    check_kills("sim", 0, 1500, |_| ());
}

#[test]
#[ignore = "takes minutes: 200 kills"]
fn two_hundred_kills_of_a_program() {
    if has_python() {
        check_kills("program:python3 body.py", 1, 4000, check_nothing_twice);
    } else {
        eprintln!("SKIPPED: there is no python3");
    }
}
