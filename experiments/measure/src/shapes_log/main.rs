//! Shapes of objects in robot logs in CARMEN's format with corrected poses: `cargo run --release -p
//! descry-measure --bin shapes_log -- LOG… [--plots DIR]`. Plots are SVG.
//!
//! Objects are isolated clusters scanned from five directions or more. Each has two models from disjoint sets
//! of scans; recognition succeeds if the second is nearest to the first among all.

mod carmen;
#[path = "../shapes/draw.rs"]
mod draw;
mod things;

use descry_perception::laser::{
    Alignment, FitOptions, NextOptions, PosedScan, ScanGain, SolverOptions, align_consistent, fit,
};
use std::path::Path;
use std::process::ExitCode;

/// Residual from which scans contradict each other, metres: twice the precision of the laser.
const CONTRADICTS_M: f64 = 0.02;
/// Maximum number of objects that are drawn.
const DRAWN: usize = 12;

/// An object with two sets of scans and their models.
struct Seen {
    scans: [Vec<PosedScan>; 2],
    models: [Alignment; 2],
}

impl Seen {
    fn agrees(&self) -> bool {
        self.models.iter().all(|m| m.longest_m() <= CONTRADICTS_M)
    }
}

fn run(logs: &[String], out: Option<&Path>) -> Result<(), String> {
    let mut seen: Vec<Seen> = Vec::new();
    for log in logs {
        let scans = carmen::read(Path::new(log))?;
        let found = things::find(&scans).map_err(|e| e.to_string())?;
        println!("{log}: {} scans, {} things that stand apart", scans.len(), found.len());
        for thing in &found {
            let Some(sets) = things::two_sets(&scans, thing).map_err(|e| e.to_string())? else { continue };
            let model = |set: &[PosedScan]| align_consistent(set, CONTRADICTS_M, &SolverOptions::default());
            let models = [model(&sets[0]), model(&sets[1])];
            let [Ok(a), Ok(b)] = models else { continue };
            seen.push(Seen { scans: sets, models: [a, b] });
        }
    }
    table(&seen);
    let sound: Vec<&Seen> = seen.iter().filter(|s| s.agrees()).collect();
    recognition(&sound);
    out.map_or(Ok(()), |dir| draw_all(&sound, dir))
}

fn table(seen: &[Seen]) {
    println!("{} of them scanned from five directions or more; the first model of each:", seen.len());
    println!(
        "   at (m)             scans  BV before   after (m²)  exterior (cm)  opened  out  area (cm²)  around (cm)  loose (cm)"
    );
    for thing in seen {
        let a = &thing.models[0];
        let f = a.model.features();
        let loose_m = ScanGain::new(&a.model, &[], &NextOptions::default()).looseness_m(&[]);
        println!(
            "   ({:>7.2}, {:>7.2})  {:>4}  {:>8.4}  {:>8.6}   {:>5.1} -> {:>4.2}  {:>6}  {:>3}  {:>9.0}  {:>10.1}  {:>9.1}{}",
            f.centre.x,
            f.centre.y,
            a.model.scans().len(),
            a.before.boundary_m2,
            a.after.boundary_m2,
            100.0 * a.before.exterior_m,
            100.0 * a.after.exterior_m,
            a.opened.len(),
            a.left_out.len(),
            1e4 * f.area_m2,
            1e2 * f.perimeter_m,
            1e2 * loose_m,
            if thing.agrees() { "" } else { "  scans of it contradict each other" }
        );
    }
}

/// Prints how often the second model of each object is nearest to its own first, by f_C a pair of scans and
/// by features.
fn recognition(seen: &[&Seen]) {
    let (mut by_fit, mut by_features) = (0, 0);
    let (mut own_mm, mut other_mm): (Vec<f64>, Vec<f64>) = (Vec::new(), Vec::new());
    for (i, thing) in seen.iter().enumerate() {
        let second = &thing.models[1].model;
        let off_mm = |other: &&Seen| {
            1e3 * fit(&other.models[0].model, second, &FitOptions::default()).between.per_pair_m()
        };
        let all: Vec<f64> = seen.iter().map(off_mm).collect();
        let nearest = |all: &[f64]| (0..all.len()).min_by(|&a, &b| all[a].total_cmp(&all[b]));
        by_fit += usize::from(nearest(&all) == Some(i));
        own_mm.push(all[i]);
        other_mm.extend(all.iter().enumerate().filter(|(k, _)| *k != i).map(|(_, mm)| *mm));
        let features = second.features();
        let apart = |other: &&Seen| {
            let f = other.models[0].model.features();
            (f.area_m2 - features.area_m2).abs() / 0.0044
                + (f.perimeter_m - features.perimeter_m).abs() / 0.017
        };
        by_features += usize::from(nearest(&seen.iter().map(apart).collect::<Vec<_>>()) == Some(i));
    }
    let median = |values: &mut Vec<f64>| {
        values.sort_by(f64::total_cmp);
        values.get(values.len() / 2).copied().unwrap_or(f64::NAN)
    };
    println!(
        "{} things of which both models agree with themselves: the second model is nearest to its own first in {by_fit} by f_C, in {by_features} by features",
        seen.len()
    );
    println!(
        "violation a pair of scans, median: {:.1} mm with its own, {:.1} mm with others; own within 5 mm {}, within 10 mm {}",
        median(&mut own_mm),
        median(&mut other_mm),
        own_mm.iter().filter(|mm| **mm <= 5.0).count(),
        own_mm.iter().filter(|mm| **mm <= 10.0).count()
    );
}

fn draw_all(seen: &[&Seen], dir: &Path) -> Result<(), String> {
    std::fs::create_dir_all(dir).map_err(|e| format!("{}: {e}", dir.display()))?;
    for (n, thing) in seen.iter().take(DRAWN).enumerate() {
        let rows = [
            ("as localised", thing.scans[0].clone()),
            ("aligned", thing.models[0].model.scans().to_vec()),
            ("of other scans", thing.models[1].model.scans().to_vec()),
        ];
        let path = dir.join(format!("thing-{}.svg", n + 1));
        std::fs::write(&path, draw::side_by_side(&rows, 1.6, 250.0, false))
            .map_err(|e| format!("{}: {e}", path.display()))?;
    }
    Ok(())
}

fn main() -> ExitCode {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let result = match arguments.as_slice() {
        [] => Err("usage: shapes_log LOG... [--plots DIR]".to_owned()),
        [logs @ .., plots, dir] if plots == "--plots" => run(logs, Some(Path::new(dir))),
        logs => run(logs, None),
    };
    match result {
        Ok(()) => ExitCode::SUCCESS,
        Err(why) => {
            eprintln!("{why}");
            ExitCode::from(2)
        }
    }
}
