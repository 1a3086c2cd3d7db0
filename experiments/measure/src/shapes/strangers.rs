//! False recognition of unknown objects, and number of scans until known ones are named.

use super::lab::{INSTANCES, Lab, NAMES, Outline, Run, map_of_the_lab, object, observed, rounded, seed_of};
use super::scanning::{MOST, Policy, next_bearing};
use super::tabletop::Draws;
use super::variations::CONTRADICTS_M;
use descry_perception::laser::{
    Alignment, KnownShape, NextOptions, Objective, Occupancy, PosedScan, RecogniseOptions, ScanGain,
    SolverOptions, Verdict, align_consistent, recognise_scans,
};
use std::f64::consts::TAU;

/// Number of known objects, and of unknown ones.
const THINGS: usize = 100;
/// Thresholds of the fit, metres; the middle one is the default of [`RecogniseOptions`].
const SAME_M: [f64; 3] = [0.005, 0.0025, 0.002];
/// Edges of the bins of shape uncertainty, metres.
const BINS: [f64; 6] = [0.01, 0.02, 0.04, 0.08, 0.16, f64::INFINITY];

/// Counts of verdicts by threshold, for known and unknown objects: one correct name, several names, unknown,
/// one wrong name.
type Counts = [[[usize; 4]; 2]; SAME_M.len()];
const SEVERAL: usize = 1;

/// Verdicts on an object after one more scan, for each threshold.
struct Told {
    loose_m: f64,
    verdicts: [usize; SAME_M.len()],
}

/// A random object between the sizes of a waste-paper basket and an armchair.
pub fn stranger(draws: &mut Draws) -> Outline {
    let [a, b, r] = [0, 1, 2].map(|_| draws.next());
    let (width, depth) = (25.0 + 50.0 * a, 25.0 + 50.0 * b);
    // A third of them are squares or round.
    let depth = if r < 1.0 / 3.0 { width } else { depth };
    rounded(width, depth, 0.49 * draws.next() * width.min(depth))
}

/// Prints verdicts after each scan by the remaining shape uncertainty, and those of a policy that scans until
/// that uncertainty is small.
pub fn print(seed: u64, learnt: &[Alignment]) {
    let known: Vec<KnownShape> =
        (0..NAMES.len()).map(|k| KnownShape::new(NAMES[k], learnt[k * INSTANCES].model.clone())).collect();
    println!(
        "\n{THINGS} known things and {THINGS} strangers against 5 models, whatever sides were scanned; poses off by 3 cm and 2°"
    );
    println!(
        "known: right, several, unknown, wrong | strangers: -, several, unknown, named; for what fits within 5, 2.5, 2 mm a pair of scans"
    );
    let map = map_of_the_lab(&mut Draws(seed));
    let mut by_scans = [Counts::default(); MOST];
    let mut by_looseness = [Counts::default(); BINS.len()];
    let mut until = [Counts::default(); BINS.len()];
    for (i, is_known) in (0..THINGS).flat_map(|i| [(i, true), (i, false)]) {
        let mut draws = Draws(seed_of(seed + 6000, i, usize::from(is_known)));
        let name = is_known.then(|| NAMES[i % NAMES.len()]);
        let outline = if is_known { object(i % NAMES.len()) } else { stranger(&mut draws) };
        let told = scan_after_scan(&outline, name, &known, &map, &mut draws);
        let count = |counts: &mut Counts, n: usize, told: &Told| {
            counts[n][usize::from(!is_known)][told.verdicts[n]] += 1;
        };
        for n in 0..SAME_M.len() {
            for (scans, told) in told.iter().enumerate() {
                count(&mut by_scans[scans], n, told);
                let bin = BINS.iter().position(|edge| told.loose_m < *edge).unwrap_or(0);
                count(&mut by_looseness[bin], n, told);
            }
            for (edge, counts) in BINS.iter().zip(&mut until) {
                let decided = told.iter().find(|t| t.loose_m < *edge && t.verdicts[n] != SEVERAL);
                decided.or(told.last()).into_iter().for_each(|told| count(counts, n, told));
            }
        }
    }
    for (n, counts) in by_scans.iter().enumerate() {
        println!("{:>2} scans{}", n + 1, line(counts));
    }
    for (edge, counts) in BINS.iter().zip(&by_looseness) {
        println!("loose by less than {:>5.1} cm{}", 100.0 * edge, line(counts));
    }
    println!("each scanned until it is no looser, and as long as several names are left:");
    for (edge, counts) in BINS.iter().zip(&until) {
        println!("until less than {:>5.1} cm{}", 100.0 * edge, line(counts));
    }
}

fn line(counts: &Counts) -> String {
    counts.iter().map(|[known, strangers]| format!("   {known:>3?} | {strangers:>3?}")).collect()
}

/// Scans an object from the most informative bearing each time and recognises it; `name` is its true name, if
/// it is known.
fn scan_after_scan(
    outline: &Outline,
    name: Option<&str>,
    known: &[KnownShape],
    map: &Occupancy,
    draws: &mut Draws,
) -> Vec<Told> {
    let run = Run { pose_sigma_m: 0.03, pose_sigma_rad: 0.035, ..Run::default() };
    let objective = Objective::Centred { pose_sigma_m: run.pose_sigma_m, pose_sigma_rad: run.pose_sigma_rad };
    let solver = SolverOptions { objective, ..SolverOptions::default() };
    let lab = Lab::with(outline, draws);
    let mut bearing = TAU * draws.next();
    let mut scans: Vec<PosedScan> = Vec::new();
    let mut all = Vec::new();
    for _ in 0..MOST {
        let truth = lab.look_from(bearing, draws);
        let stated = run.stated(&truth, draws);
        let sweep = [(lab.sweep(&truth, &stated, draws), truth)];
        scans.extend(observed(&lab, &sweep, map, &run, draws).scans);
        let Ok(alignment) = align_consistent(&scans, CONTRADICTS_M, &solver) else { continue };
        let loose_m = ScanGain::new(&alignment.model, &[], &NextOptions::default()).looseness_m(&[]);
        let verdicts = SAME_M.map(|same_m| verdict(&alignment, loose_m, name, known, same_m));
        all.push(Told { loose_m, verdicts });
        bearing = next_bearing(Policy::Settling, bearing, bearing, &alignment, &lab, draws);
    }
    all
}

/// Verdict on an object after some scans, as an index in [`Counts`].
fn verdict(
    alignment: &Alignment,
    loose_m: f64,
    name: Option<&str>,
    known: &[KnownShape],
    same_m: f64,
) -> usize {
    // What contradicts itself is not told from anything.
    if alignment.longest_m() > CONTRADICTS_M {
        return SEVERAL;
    }
    let options = RecogniseOptions { same_m, ..RecogniseOptions::default() };
    match recognise_scans(&alignment.model, loose_m, known, &options).verdict {
        Verdict::Is(is) if Some(is.as_str()) == name => 0,
        Verdict::OneOf(_) => SEVERAL,
        Verdict::Unknown => 2,
        Verdict::Is(_) => 3,
    }
}
