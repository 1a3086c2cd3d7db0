//! The experiment of Modayil and Kuipers in a simulated lab, with the figures of their paper for comparison,
//! and further experiments: `cargo run --release -p descry-measure --bin shapes -- [SEED] [DIR]`. Plots are
//! written to DIR as SVG.

mod draw;
#[path = "../../../../perception/tests/lab/mod.rs"]
mod lab;
mod plot;
mod scanning;
mod strangers;
mod tables;
#[path = "../../../../perception/tests/tabletop/mod.rs"]
mod tabletop;
mod times;
mod variations;

use descry_perception::laser::{Objective, Solver, SolverOptions};
use lab::{Run, models};
use std::path::Path;
use std::process::ExitCode;

/// Methods of alignment: short name, solver, and objective (`None`: the default).
const METHODS: [(&str, Solver, Option<Objective>); 4] = [
    ("centred, least squares", Solver::LeastSquares, None),
    ("centred, simplex", Solver::Simplex, None),
    ("BV alone, least squares", Solver::LeastSquares, Some(Objective::Violation)),
    ("BV alone, simplex (paper)", Solver::Simplex, Some(Objective::Violation)),
];

/// Solver options of a method, given its index in [`METHODS`].
fn options(method: usize) -> SolverOptions {
    let (_, solver, objective) = METHODS[method];
    SolverOptions { solver, objective: objective.unwrap_or_default(), ..SolverOptions::default() }
}

fn run(seed: u64, out: Option<&Path>) -> Result<(), String> {
    let learnt = models(seed, &Run::default(), &options(0));
    out.map_or(Ok(()), |dir| plot::write(seed, &learnt, dir))?;
    tables::alignment(seed);
    tables::features(&learnt);
    tables::f_c(&learnt);
    tables::recycle_bins(seed, &learnt);
    tables::localisation(seed, &learnt);
    tables::single_scans(&learnt);
    variations::print(seed, &learnt);
    scanning::print(seed, &learnt);
    strangers::print(seed, &learnt);
    times::print(seed, &learnt);
    Ok(())
}

fn main() -> ExitCode {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let seed = arguments.first().map_or(Ok(1), |text| text.parse());
    let result = match (seed, arguments.len()) {
        (Ok(seed), 0..=2) => run(seed, arguments.get(1).map(Path::new)),
        _ => Err("usage: shapes [SEED] [DIR]".to_owned()),
    };
    match result {
        Ok(()) => ExitCode::SUCCESS,
        Err(why) => {
            eprintln!("{why}");
            ExitCode::from(2)
        }
    }
}
