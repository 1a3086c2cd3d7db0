//! A foreign search task as a domain of text files and a Python program.

use std::path::Path;
use std::process::Command;

use tempfile::TempDir;

/// Lays the household out, tidies it up, and returns the final belief of the program.
fn tidied(folder: &Path, seed: &[&str]) -> serde_json::Value {
    let laid_out =
        Command::new("python3").args(["world.py", "reset"]).args(seed).current_dir(folder).status();
    assert!(laid_out.expect("python3 runs").success());
    let goal = ["do", "tidy up", "--domain", ".", "--json", "--run", &format!("run{}", seed.concat())];
    let output =
        Command::new(env!("CARGO_BIN_EXE_descry")).args(goal).current_dir(folder).output().expect("it runs");
    assert_eq!(output.status.code(), Some(0), "{}", String::from_utf8_lossy(&output.stderr));
    let world = std::fs::read_to_string(folder.join("world.json")).expect("the household was kept");
    serde_json::from_str(&world).expect("it is JSON")
}

#[test]
fn everything_is_found_and_brought_where_it_belongs() {
    if Command::new("python3").arg("--version").output().is_err() {
        eprintln!("skipped: there is no python3");
        return;
    }
    let folder = TempDir::new().expect("a folder can be made");
    let own = Path::new(env!("CARGO_MANIFEST_DIR")).join("../domains/multi-object-search");
    std::fs::create_dir(folder.path().join("scenes")).expect("a folder can be made");
    for file in ["domain.pddl", "domain.toml", "world.py", "scenes/default.toml"] {
        std::fs::copy(own.join(file), folder.path().join(file)).expect("the domain is there");
    }
    for seed in [&[][..], &["3"], &["5"]] {
        let world = tidied(folder.path(), seed);
        let expected = serde_json::json!({
            "knife": "kitchen", "mug": "kitchen", "clock": "bedroom", "pillow": "bedroom", "notebook": "office"
        });
        assert_eq!(world["truth"], expected, "seed {seed:?}");
        assert!(world["clock_s"].as_f64().is_some_and(|s| s < 250.0), "seed {seed:?}: {world}");
    }
}
