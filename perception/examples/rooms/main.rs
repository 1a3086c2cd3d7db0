//! The drive of Viejo and Cazorla in a simulated building, and what they did not try:
//! `cargo run --release -p descry-perception --example rooms -- [SEED] [DIR]`. Plots are written to DIR as SVG,
//! and the drive as clouds, on which `peers.py` beside this file runs what others offer.

#[path = "../../tests/corridor/mod.rs"]
mod corridor;
mod exploring;
mod plot;
mod poses;
mod recorded;
#[path = "../../tests/tabletop/mod.rs"]
mod tabletop;
mod times;
mod variations;
mod walls;

use std::path::Path;
use std::process::ExitCode;

fn run(seed: u64, out: Option<&Path>) -> Result<(), String> {
    poses::pairs(seed);
    poses::loops(seed)?;
    walls::walls(seed, out)?;
    variations::print(seed)?;
    recorded::rooms(out)?;
    out.map_or(Ok(()), |dir| poses::export(seed, dir))?;
    exploring::print(seed);
    times::print(seed);
    Ok(())
}

fn main() -> ExitCode {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let seed = arguments.first().map_or(Ok(1), |text| text.parse());
    let result = match (seed, arguments.len()) {
        (Ok(seed), 0..=2) => run(seed, arguments.get(1).map(Path::new)),
        _ => Err("usage: rooms [SEED] [DIR]".to_owned()),
    };
    match result {
        Ok(()) => ExitCode::SUCCESS,
        Err(why) => {
            eprintln!("{why}");
            ExitCode::from(2)
        }
    }
}
