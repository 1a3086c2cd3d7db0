//! How much of an object is noticed and learned, and how well (section VII-A and Table I).

use crate::household::{Body, bodies};
use crate::measure::{Score, median, score, spread};
use crate::runs::{RunOptions, run};

/// Pose noise of a keyframe: metres and radians.
const NOISES: [(&str, f64, f64); 3] =
    [("0", 0.0, 0.0), ("0.5 cm, 0.5°", 0.005, 0.5), ("1 cm, 1°", 0.01, 1.0)];

/// One row of the table.
struct Row {
    name: String,
    scores: Vec<Score>,
    seconds: Vec<f64>,
    failed: Vec<String>,
}

/// Runs one setting for every object.
fn row(name: String, make: impl Fn(usize) -> RunOptions) -> Row {
    let all = bodies();
    let mut row = Row { name, scores: Vec::new(), seconds: Vec::new(), failed: Vec::new() };
    for (i, body) in all.iter().enumerate() {
        let beside: &Body = &all[(i + 5) % all.len()];
        match run(body, beside, make(i)) {
            Ok(run) => {
                row.scores.push(score(&run, body));
                row.seconds.push(run.learn_s + run.notice_s);
            }
            Err(why) => row.failed.push(format!("{}: {why}", body.name)),
        }
    }
    row
}

fn pair(values: impl Iterator<Item = f64>) -> String {
    let (mean, sigma) = spread(&values.collect::<Vec<f64>>());
    format!("{mean:.2}±{sigma:.2}")
}

fn print_head() {
    println!(
        "| setting | O_0 recall | O_0 precision | model recall | model precision | within 6 mm: recall | precision | point distance, mm | keyframes off, mm, ° | looks used | s an object |"
    );
    println!("|---|---|---|---|---|---|---|---|---|---|---|");
    println!("| paper | 0.80±0.15 | 0.99±0.01 | 0.89 / 0.97 | 0.87 / 0.92 | | | 16 | | | 39 |");
}

fn print(row: &mut Row) {
    let of = |f: fn(&Score) -> f64| pair(row.scores.iter().map(f));
    let mean = |f: fn(&Score) -> f64| spread(&row.scores.iter().map(f).collect::<Vec<_>>()).0;
    println!(
        "| {} | {} | {} | {} | {} | {} | {} | {:.1} | {:.1}, {:.2} | {:.1} of {:.1} | {:.1} |",
        row.name,
        of(|s| s.first.0),
        of(|s| s.first.1),
        of(|s| s.model.0),
        of(|s| s.model.1),
        of(|s| s.strict.0),
        of(|s| s.strict.1),
        1e3 * mean(|s| s.distance_m),
        1e3 * mean(|s| s.poses.0),
        mean(|s| s.poses.1).to_degrees(),
        mean(|s| s.used as f64),
        mean(|s| s.looks as f64),
        median(&mut row.seconds),
    );
    row.failed.iter().for_each(|why| println!("| {}: not learned: {why} | | | | | | | | | | |", row.name));
}

/// Controlled and uncontrolled under each noise; then without registration, and with something else touching.
pub fn tables(seed: u64) {
    print_head();
    let base = |controlled: bool, (_, metres, degrees): (&str, f64, f64)| RunOptions {
        controlled,
        noise: (metres, degrees.to_radians()),
        registered: true,
        touching: false,
        step_rad: 15_f64.to_radians(),
        seed: 0,
    };
    let mut settings: Vec<(String, RunOptions)> = Vec::new();
    for (controlled, word) in [(true, "controlled"), (false, "uncontrolled")] {
        settings.extend(NOISES.map(|noise| (format!("{word}, {}", noise.0), base(controlled, noise))));
    }
    let worst = NOISES[2];
    settings.push((
        format!("controlled, {}, not registered", worst.0),
        RunOptions { registered: false, ..base(true, worst) },
    ));
    settings.push((
        format!("controlled, {}, touching", NOISES[0].0),
        RunOptions { touching: true, ..base(true, NOISES[0]) },
    ));
    for (name, options) in settings {
        print(&mut row(name, |i| RunOptions { seed: seed * 1000 + i as u64, ..options }));
    }
}
