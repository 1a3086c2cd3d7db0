//! The drive of Viejo and Cazorla in a simulated building, and further experiments: `cargo run --release -p
//! descry-measure --bin rooms -- [SEED] [DIR] [PART]`. Plots are written to DIR as SVG, and the drive as
//! clouds (PART `drive`), on which `peers.py` in this folder runs other programs. PART selects one part by
//! the name of its file.

#[path = "../../../../perception/tests/corridor/mod.rs"]
mod corridor;
mod drive;
mod exploring;
mod pillars;
mod plot;
mod poses;
mod recorded;
#[path = "../../../../perception/tests/tabletop/mod.rs"]
mod tabletop;
mod times;
mod variations;
mod walls;

use std::path::Path;
use std::process::ExitCode;

fn run(seed: u64, out: Option<&Path>, part: Option<&str>) -> Result<(), String> {
    let is_asked = |name: &str| part.is_none_or(|part| part == name);
    if is_asked("poses") {
        poses::pairs(seed);
        poses::loops(seed)?;
    }
    if is_asked("drive") {
        out.map_or(Ok(()), |dir| drive::export(seed, dir))?;
    }
    if is_asked("walls") {
        walls::walls(seed, out)?;
    }
    if is_asked("pillars") {
        pillars::print(seed, out)?;
    }
    if is_asked("variations") {
        variations::print(seed, out)?;
    }
    if is_asked("recorded") {
        recorded::rooms(out)?;
    }
    if is_asked("exploring") {
        exploring::print(seed);
    }
    if is_asked("times") {
        times::print(seed);
    }
    Ok(())
}

fn main() -> ExitCode {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let seed = arguments.first().map_or(Ok(1), |text| text.parse());
    let parts = ["poses", "drive", "walls", "pillars", "variations", "recorded", "exploring", "times"];
    let part = arguments.get(2).map(String::as_str);
    let result = match (seed, arguments.len()) {
        (Ok(seed), 0..=3) if part.is_none_or(|part| parts.contains(&part)) => {
            run(seed, arguments.get(1).map(Path::new), part)
        }
        _ => Err(format!("usage: rooms [SEED] [DIR] [PART]\n  PART is one of {}", parts.join(", "))),
    };
    match result {
        Ok(()) => ExitCode::SUCCESS,
        Err(why) => {
            eprintln!("{why}");
            ExitCode::from(2)
        }
    }
}
