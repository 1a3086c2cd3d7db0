//! Programs as bodies: the template conforms; whatever a program does that it must not is a failure with its reason.

use descry_robots::conformance;
use descry_robots::program::{Limits, ProgramRobot};
use std::path::{Path, PathBuf};

fn python_folder() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("python")
}

fn has_python() -> bool {
    let found = std::process::Command::new("python3").arg("--version").output().is_ok_and(|o| o.status.success());
    if !found {
        println!("SKIPPED: python3 is not here");
    }
    found
}

#[tokio::test]
async fn the_template_conforms() {
    if !has_python() {
        return;
    }
    let command = format!("python3 '{}'", python_folder().join("template.py").display());
    let robot = ProgramRobot::start(&command, Limits::default()).unwrap();
    conformance::check(&robot).await.unwrap();
}
