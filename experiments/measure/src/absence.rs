//! Calibration of the stated probability of presence as views accumulate: `cargo run --release -p
//! descry-measure --bin absence -- COUNT SEED HOLES [PLOT.svg]`.
//!
//! Half of the arrangements contain cup A, nearly hidden from the start; the others lack it. Each is viewed
//! from the start and then from three random poses of the ring; the camera loses a share of its returns in
//! patches.

mod searching;

use std::process::ExitCode;

use descry_agent::body::scene_spec;
use descry_domains::load::Domain;
use descry_domains::reasons;
use descry_domains::situation::Situation;
use descry_experiments::plot::{Axis, Plot, Point, Series};
use descry_perception::calibration::{Bin, Claim, Reliability, reliability};
use descry_robots::sim::{DepthNoise, SceneSpec, SimOptions, arrange};
use searching::Search;

const LOOKS: usize = 4;
const TARGET: &str = "cup A";
/// Maximum distance between stated and true position for a found cup, metres.
const FOUND_M: f64 = 0.05;

/// Statements about the target after one view.
#[derive(Clone, Copy, Default)]
struct Said {
    there: f64,
    yes: bool,
    yes_is_right: bool,
    not_there: bool,
}

fn main() -> ExitCode {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let numbers = || {
        Some((
            arguments.first()?.parse().ok()?,
            arguments.get(1)?.parse().ok()?,
            arguments.get(2)?.parse().ok()?,
        ))
    };
    let Some((count, seed, holes)) = numbers() else {
        eprintln!("usage: absence COUNT SEED HOLES [PLOT.svg]");
        return ExitCode::from(2);
    };
    match run(count, seed, holes, arguments.get(3)) {
        Ok(()) => ExitCode::SUCCESS,
        Err(why) => {
            eprintln!("{why}");
            ExitCode::from(2)
        }
    }
}

fn run(count: u64, first_seed: u64, holes: f64, plot: Option<&String>) -> Result<(), String> {
    let domain = Domain::load("tabletop").map_err(|e| e.to_string())?;
    let spec = scene_spec(Some("clutter"), &domain).map_err(|e| e.to_string())?;
    let runtime =
        tokio::runtime::Builder::new_current_thread().enable_all().build().map_err(|e| e.to_string())?;
    let mut said: Vec<(bool, Vec<Said>)> = Vec::new();
    for seed in first_seed..first_seed + count {
        for present in [true, false] {
            match runtime.block_on(one(&domain, &spec, seed, present, holes)) {
                Ok(each) => {
                    tell_wrong(seed, present, &each);
                    said.push((present, each));
                }
                Err(why) => eprintln!("seed {seed}, there {present}: {why}"),
            }
        }
    }
    println!(
        "{:>5} {:>5} {:>6} {:>6} {:>6} {:>5} {:>9} {:>9} {:>15}",
        "looks", "runs", "Brier", "base", "ECE", "yes", "false yes", "not there", "false not there"
    );
    for look in 0..LOOKS {
        row(&(look + 1).to_string(), said.iter().map(|(present, each)| (*present, each[look])).collect());
    }
    let all: Vec<(bool, Said)> =
        said.iter().flat_map(|(present, each)| each.iter().map(|s| (*present, *s))).collect();
    let half = row("half", all.clone());
    let expected = row("prior", as_often_as(domain.config.thresholds.prior, &all));
    for (name, told) in [("half", &half), ("prior", &expected)] {
        for bin in told.bins.iter().filter(|b| b.count > 0) {
            println!(
                "  {name:>5} {:.2}-{:.2}: {:5} said, {:.3} stated, {:.3} came true",
                bin.low, bin.high, bin.count, bin.stated, bin.came_true
            );
        }
    }
    match plot {
        Some(path) => std::fs::write(path, drawn(&half, &expected)).map_err(|e| format!("{path}: {e}")),
        None => Ok(()),
    }
}

/// Statements reweighted so that the target is present as often as the prior says.
fn as_often_as(prior: f64, said: &[(bool, Said)]) -> Vec<(bool, Said)> {
    let times = (prior / (1.0 - prior)).round() as usize;
    said.iter().flat_map(|s| std::iter::repeat_n(*s, if s.0 { times } else { 1 })).collect()
}

/// Prints the false statements about an arrangement.
fn tell_wrong(seed: u64, present: bool, each: &[Said]) {
    for (n, s) in each.iter().enumerate() {
        let what = match (s.not_there && present, s.yes && !s.yes_is_right) {
            (true, _) => "false not there",
            (_, true) => "false yes",
            _ => continue,
        };
        eprintln!("seed {seed}, there {present}, look {}: {what}, {:.3}", n + 1, s.there);
    }
}

fn row(name: &str, said: Vec<(bool, Said)>) -> Reliability {
    let claims: Vec<Claim> = said.iter().map(|(present, s)| (s.there, *present)).collect();
    let told = reliability(&claims, 20);
    let count = |is: &dyn Fn(bool, &Said) -> bool| said.iter().filter(|(present, s)| is(*present, s)).count();
    println!(
        "{name:>5} {:>5} {:>6.4} {:>6.4} {:>6.4} {:>5} {:>9} {:>9} {:>15}",
        said.len(),
        told.brier,
        told.brier_of_base_rate,
        told.expected_error,
        count(&|_, s| s.yes),
        count(&|_, s| s.yes && !s.yes_is_right),
        count(&|_, s| s.not_there),
        count(&|present, s| s.not_there && present),
    );
    told
}

/// Statements after each view of one arrangement.
async fn one(
    domain: &Domain,
    spec: &SceneSpec,
    seed: u64,
    present: bool,
    holes: f64,
) -> Result<Vec<Said>, String> {
    let mut scene = (0..20).find_map(|n| arrange(spec, seed + n * 1_000_003).ok()).ok_or("no arrangement")?;
    let cup = scene.objects.iter().position(|o| o.name == TARGET).ok_or("no cup")?;
    if !present {
        scene.objects.remove(cup);
        scene.target = None;
    }
    let true_m = scene.object(TARGET).map(|o| [o.centre_m().x, o.centre_m().y]);
    let noise = DepthNoise { holes, ..DepthNoise::default() };
    let options = SimOptions { seed, noise, ..SimOptions::default() };
    let mut draws = seed;
    let choose = |poses: &[String]| {
        draws = draws.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (draws >> 33) as usize % poses.len()
    };
    let search = Search { domain, scene, options, goal: "find cup A", looks: LOOKS };
    search.run(choose, |situation| (heard(situation, true_m), false)).await
}

fn heard(s: &Situation, true_m: Option<[f64; 2]>) -> Said {
    let yes = s.confidence(0) >= s.threshold;
    let p = |t: &&descry_memory::belief::Track| s.things[0].probability(t, &s.surfaces);
    let best = s.belief.tracks.iter().max_by(|a, b| p(a).total_cmp(&p(b)));
    let off_m = best.zip(true_m).map(|(t, [x, y])| (t.position_m.x - x).hypot(t.position_m.y - y));
    Said {
        there: s.chance_there(0),
        yes,
        yes_is_right: off_m.is_some_and(|m| m < FOUND_M),
        not_there: !yes && reasons::left_about(s, 0).is_none(),
    }
}

/// Reliability plot: stated against true shares, with the target present in half of the cases, and as often
/// as the prior says.
fn drawn(half: &Reliability, expected: &Reliability) -> String {
    let filled = |told: &Reliability| told.bins.iter().filter(|b| b.count > 0).copied().collect::<Vec<Bin>>();
    let spread = |b: &Bin| 2.0 * (b.came_true * (1.0 - b.came_true) / b.count as f64).sqrt();
    // What is counted several times would seem surer than it is.
    let interval = |b: &Bin, counted_once: bool| {
        counted_once.then(|| [b.came_true - spread(b), b.came_true + spread(b)])
    };
    let series = |name: &str, told: &Reliability, counted_once: bool| Series {
        name: name.into(),
        points: filled(told)
            .iter()
            .map(|b| Point { at: b.stated, value: b.came_true, interval: interval(b, counted_once) })
            .collect(),
        broken: !counted_once,
    };
    let counts = filled(half).iter().map(|b| (0.5 * (b.low + b.high), b.count)).collect();
    let plot = Plot::Lines {
        name: "absence".into(),
        title: "Reliability of \"it is there\"".into(),
        x: Axis::fixed("stated probability", 0.0, 1.0),
        y: Axis::fixed("share that was there", 0.0, 1.0),
        series: vec![series("half have it", half, true), series("as expected", expected, false)],
        diagonal: true,
        counts,
    };
    plot.svg()
}
