//! Single-threaded times, least of several repetitions: alignment by each method, recognition against few and
//! many known models.

use super::lab::{INSTANCES, NAMES, Run, circled, map_of_the_lab, object, rounded, seed_of};
use super::tabletop::Draws;
use super::{METHODS, options};
use descry_perception::laser::{
    Alignment, FitOptions, KnownShape, RecogniseOptions, Solver, SolverOptions, Start, Verdict, align,
    localise, recognise,
};
use std::time::Instant;

/// Maximum number of repetitions.
const REPETITIONS: usize = 5;
/// Duration beyond which a run is not repeated, milliseconds.
const LONG_MS: f64 = 500.0;

/// Minimum time of several repetitions, milliseconds.
fn least_ms<T>(mut run: impl FnMut() -> T) -> f64 {
    let mut least = f64::INFINITY;
    for _ in 0..REPETITIONS {
        let start = Instant::now();
        std::hint::black_box(run());
        least = least.min(start.elapsed().as_secs_f64() * 1e3);
        if least > LONG_MS {
            break;
        }
    }
    least
}

/// Prints the times of modelling, with the number of error evaluations, and those of recognition.
pub fn print(seed: u64, learnt: &[Alignment]) {
    let map = map_of_the_lab(&mut Draws(seed));
    println!("\ntimes, ms: a model of 7 or 8 scans, and of 30; times that the errors were computed");
    for (method, (name, ..)) in METHODS.iter().enumerate() {
        print!("{name:<27}");
        for scans in [(7, 8), (30, 30)] {
            let run = Run { scans, ..Run::default() };
            let options = options(method);
            let all: Vec<_> = (0..NAMES.len())
                .map(|k| circled(&object(k), &run, &map, seed_of(seed + 3000, k, 0)).1.scans)
                .collect();
            let ms = least_ms(|| all.iter().map(|scans| align(scans, &options)).collect::<Vec<_>>());
            let evaluations: usize =
                all.iter().filter_map(|s| align(s, &options).ok()).map(|a| a.evaluations).sum();
            let n = NAMES.len();
            print!("   {:>8.2} {:>6}", ms / n as f64, evaluations / n);
        }
        println!();
    }
    let mut known: Vec<KnownShape> =
        (0..NAMES.len()).map(|k| KnownShape::new(NAMES[k], learnt[k * INSTANCES].model.clone())).collect();
    let instances: Vec<usize> = (0..learnt.len()).filter(|i| i % INSTANCES != 0).collect();
    println!(
        "times, ms: naming one of {} models (and how many were named right, unsure, wrong)",
        instances.len()
    );
    for count in [5, 100] {
        let mut draws = Draws(seed + 4000);
        while known.len() < count {
            let [a, b, r] = [0, 1, 2].map(|_| draws.next());
            let (width, depth) = (25.0 + 50.0 * a, 25.0 + 50.0 * b);
            let outline = rounded(width, depth, r * 0.45 * width.min(depth));
            let seen = circled(&outline, &Run::default(), &map, seed + 5000 + known.len() as u64).1;
            let model = align(&seen.scans, &options(0)).expect("the object was seen").model;
            known.push(KnownShape::new(format!("thing {}", known.len()), model));
        }
        for (name, solver, everything) in [
            ("features, then f_C by least squares", Solver::LeastSquares, false),
            ("features, then f_C by simplex", Solver::Simplex, false),
            ("f_C with all by least squares", Solver::LeastSquares, true),
            ("f_C with all by simplex", Solver::Simplex, true),
        ] {
            let fit = FitOptions { solver: SolverOptions { solver, ..options(0) }, ..FitOptions::default() };
            let gate = if everything { f64::INFINITY } else { RecogniseOptions::default().gate };
            let options = RecogniseOptions { fit, gate, ..RecogniseOptions::default() };
            let (mut found, mut ms) = ((0, 0, 0), 0.0);
            for &i in &instances {
                let name = || recognise(&learnt[i].model, &known, &options);
                match name().verdict {
                    Verdict::Is(name) if name == NAMES[i / INSTANCES] => found.0 += 1,
                    Verdict::Is(_) => found.2 += 1,
                    _ => found.1 += 1,
                }
                ms += least_ms(name) / instances.len() as f64;
            }
            println!("  {count:>3} known, {name:<36} {ms:>8.2}   {found:?}");
        }
    }
    let scan = &learnt[1].model.scans()[0].scan;
    let one = |start| least_ms(|| localise(&learnt[0].model, scan, start, &FitOptions::default()));
    let near = learnt[1].model.scans()[0].model_from_laser;
    println!(
        "  localising one scan from a pose {:.2}, from all angles {:.2}",
        one(Start::Near(near)),
        one(Start::AllAngles)
    );
}
