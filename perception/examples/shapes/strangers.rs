//! What things that nobody has learned are taken for, and how soon things that are known are named, scan after scan.

use super::lab::{INSTANCES, Lab, NAMES, Outline, Run, map_of_the_lab, object, observed, rounded, seed_of};
use super::options;
use super::scanning::{MOST, Policy, next_bearing};
use super::tabletop::Draws;
use descry_perception::laser::{
    Alignment, KnownShape, NextOptions, Outlook, PosedScan, RecogniseOptions, Verdict, align, recognise_scans,
};
use std::f64::consts::TAU;

/// Things of either sort.
const THINGS: usize = 100;
/// Thresholds of what fits, metres.
const SAME_M: [f64; 3] = [0.01, 0.007, 0.005];
/// Edges of bins of looseness, metres.
const BINS: [f64; 6] = [0.01, 0.02, 0.04, 0.08, 0.16, f64::INFINITY];

/// Verdicts: one name and the right one, several, unknown, one name and the wrong one.
#[derive(Clone, Copy, Default)]
struct Count([usize; 4]);

/// A thing that may be anything between a waste-paper basket and an armchair.
pub fn stranger(draws: &mut Draws) -> Outline {
    let [a, b, r] = [0, 1, 2].map(|_| draws.next());
    let (width, depth) = (25.0 + 50.0 * a, 25.0 + 50.0 * b);
    // A third of them are squares or round.
    let depth = if r < 1.0 / 3.0 { width } else { depth };
    rounded(width, depth, 0.49 * draws.next() * width.min(depth))
}

/// Prints verdicts after each scan, and by how loose the shape still is.
pub fn print(seed: u64, learnt: &[Alignment]) {
    let known: Vec<KnownShape> =
        (0..NAMES.len()).map(|k| KnownShape::new(NAMES[k], learnt[k * INSTANCES].model.clone())).collect();
    println!(
        "\n{THINGS} known things and {THINGS} strangers against 5 models, whatever sides were scanned; poses off by 3 cm and 2°"
    );
    println!(
        "known: right, several, unknown, wrong | strangers: -, several, unknown, named; for what fits within 10, 7, 5 mm a pair of scans"
    );
    let run = Run { pose_sigma_m: 0.03, pose_sigma_rad: 0.035, ..Run::default() };
    let mut by_scans = [[[Count::default(); 2]; SAME_M.len()]; MOST];
    let mut by_looseness = [[[Count::default(); 2]; SAME_M.len()]; BINS.len()];
    let map = map_of_the_lab(&mut Draws(seed));
    for (i, is_known) in (0..THINGS).flat_map(|i| [(i, true), (i, false)]) {
        let mut draws = Draws(seed_of(seed + 6000, i, usize::from(is_known)));
        let outline = if is_known { object(i % NAMES.len()) } else { stranger(&mut draws) };
        let lab = Lab::with(&outline, &mut draws);
        let mut bearing = TAU * draws.next();
        let mut scans: Vec<PosedScan> = Vec::new();
        for by_scans in &mut by_scans {
            let truth = lab.look_from(bearing, &mut draws);
            let stated = run.stated(&truth, &mut draws);
            let sweep = [(lab.sweep(&truth, &stated, &mut draws), truth)];
            scans.extend(observed(&lab, &sweep, &map, &run, &mut draws).scans);
            let Ok(alignment) = align(&scans, &options(0)) else { continue };
            let loose_m = Outlook::new(&alignment.model, &[], &NextOptions::default()).looseness_m(&[]);
            let bin = BINS.iter().position(|edge| loose_m < *edge).unwrap_or(0);
            for (n, same_m) in SAME_M.into_iter().enumerate() {
                let options = RecogniseOptions { same_m, ..RecogniseOptions::default() };
                let verdict = match recognise_scans(&alignment.model, loose_m, &known, &options).verdict {
                    Verdict::Is(name) if is_known && name == NAMES[i % NAMES.len()] => 0,
                    Verdict::OneOf(_) => 1,
                    Verdict::Unknown => 2,
                    Verdict::Is(_) => 3,
                };
                let sort = usize::from(!is_known);
                by_scans[n][sort].0[verdict] += 1;
                by_looseness[bin][n][sort].0[verdict] += 1;
            }
            bearing = next_bearing(Policy::Settling, bearing, bearing, &alignment, &lab, &mut draws);
        }
    }
    let line = |counts: &[[Count; 2]; SAME_M.len()]| {
        counts.iter().map(|[k, s]| format!("   {:>3?} | {:>3?}", k.0, s.0)).collect::<String>()
    };
    for (n, counts) in by_scans.iter().enumerate() {
        println!("{:>2} scans{}", n + 1, line(counts));
    }
    for (edge, counts) in BINS.iter().zip(&by_looseness) {
        println!("loose by less than {:>5.1} cm{}", 100.0 * edge, line(counts));
    }
}
