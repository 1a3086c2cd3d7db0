//! The evaluation of Fäulhammer et al. in a simulated room, and on recordings:
//! `cargo run --release -p descry-perception --example learning -- SEED DIR [PART] [SCENES]`. Plots and pictures are written to DIR. PART is one of
//! them alone, by the name of its file; SCENES is how many scenes `curves` and `judge` look at.

mod curves;
#[path = "../evaluate/frames.rs"]
mod frames;
#[path = "../../tests/household/mod.rs"]
mod household;
mod judge;
mod knowing;
mod measure;
mod modelling;
mod plot;
mod recorded;
mod runs;
#[path = "../../tests/tabletop/mod.rs"]
mod tabletop;

use std::path::Path;
use std::process::ExitCode;

const PARTS: [&str; 4] = ["modelling", "curves", "recorded", "judge"];
/// Objects whose learned models are recognised, and in how many scenes.
const OBJECTS: usize = 10;
const SCENES: usize = 12;

fn run(seed: u64, out: &Path, part: Option<&str>, scenes: usize) -> Result<(), String> {
    std::fs::create_dir_all(out).map_err(|e| format!("{}: {e}", out.display()))?;
    let is_asked = |name: &str| part.map_or(name != "judge", |part| part == name);
    if is_asked("modelling") {
        modelling::tables(seed);
    }
    if is_asked("curves") {
        curves::print(seed, OBJECTS, scenes, out)?;
    }
    if is_asked("recorded") {
        recorded::print(out)?;
    }
    if is_asked("judge") {
        judge::fit(seed, scenes, out)?;
    }
    Ok(())
}

fn main() -> ExitCode {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let seed = arguments.first().and_then(|text| text.parse().ok());
    let scenes = arguments.get(3).map_or(Some(SCENES), |text| text.parse().ok());
    let part = arguments.get(2).map(String::as_str);
    let result = match (seed, arguments.get(1), scenes) {
        (Some(seed), Some(out), Some(scenes)) if part.is_none_or(|part| PARTS.contains(&part)) => {
            run(seed, Path::new(out), part, scenes)
        }
        _ => Err(format!("usage: learning SEED DIR [PART] [SCENES]\n  PART is one of {}", PARTS.join(", "))),
    };
    match result {
        Ok(()) => ExitCode::SUCCESS,
        Err(why) => {
            eprintln!("{why}");
            ExitCode::from(2)
        }
    }
}
