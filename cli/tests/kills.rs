//! Kills at random moments: the run resumes to the same end, and no completed action is requested again.

use std::path::Path;
use std::time::{Duration, Instant};

use crate::binary::{check, start};
use crate::body::{body_in, check_nothing_twice, has_python};
use serde_json::Value;
use tempfile::TempDir;

const KILLS: u64 = 200;

/// Kills a command at a moment drawn by the seed within the time of an undisturbed one; false if it had ended
/// by then.
fn kill_at_random(folder: &Path, arguments: &[&str], seed: u64, longest: Duration) -> bool {
    let mut child = start(folder, arguments);
    let share = seed.wrapping_mul(0x9e37_79b9_7f4a_7c15) as f64 / u64::MAX as f64;
    std::thread::sleep(longest.mul_f64(share));
    let under_way = child.try_wait().expect("it can be asked").is_none();
    let _ = child.kill();
    child.wait().expect("it is gone");
    under_way
}

/// Pursues a goal with a body, killed again and again; each run ends as an undisturbed one does.
fn check_kills(robot: &str, exit: i32, after: impl Fn(&Path)) {
    let (mut kills, mut runs, mut moments) = (0, 0_u64, 0_u64..);
    // Each start has a moment of its own, also one that came to nothing: the next must not be the same again.
    let mut kill = |folder: &Path, arguments: &[&str], longest: Duration| {
        let moment = moments.next().expect("there is no end of moments");
        kill_at_random(folder, arguments, moment, longest)
    };
    while kills < KILLS {
        runs += 1;
        let folder = TempDir::new().expect("a folder can be made");
        let folder = folder.path();
        body_in(folder);
        let seed = (runs % 5 + 1).to_string();
        let goal = ["find", "cup A", "--robot", robot, "--seed", &seed, "--run"];
        let started = Instant::now();
        let whole: Value = check(folder, &[&goal[..], &["whole", "--json"]].concat(), exit);
        let longest = started.elapsed();
        for of_the_body in ["heard", "stands"] {
            let _ = std::fs::remove_file(folder.join(of_the_body));
        }
        let resume = ["do", "--resume", "run", "--allow-programs"];
        let mut killed = kill(folder, &[&goal[..], &["run"]].concat(), longest);
        // Before anything was kept there is nothing to go on with.
        let has_begun = || folder.join("run/run.json").exists();
        while killed && kills < KILLS && has_begun() {
            kills += 1;
            killed = kill(folder, &resume, longest);
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
#[ignore = "long: takes minutes: 200 kills"]
fn two_hundred_kills_of_the_simulated_body() {
    check_kills("sim", 0, |_| ());
}

#[test]
#[ignore = "long: takes minutes: 200 kills"]
fn two_hundred_kills_of_a_program() {
    if has_python() {
        check_kills("program:python3 body.py", 1, check_nothing_twice);
    } else {
        eprintln!("SKIPPED: there is no python3");
    }
}
