//! Detection and learning of objects (section VII-A and Table I); the doubled wall, and methods against it.

use crate::household::bodies;
use crate::measure::{Score, aligned, doubled, median, pair, score, spread};
use crate::page::{Page, PageTable};
use crate::plot::{Slice, slices};
use crate::runs::{Run, RunOptions, Way, modelled, run, truth};

/// Pose noise of the keyframes: name, metres and degrees.
const NOISES: [(&str, f64, f64); 3] =
    [("exact poses", 0.0, 0.0), ("0.5 cm, 0.5°", 0.005, 0.5), ("1 cm, 1°", 0.01, 1.0)];

/// Setting of the runs in a row of the table.
#[derive(Clone, Copy)]
struct Place {
    name: &'static str,
    controlled: bool,
    touching: bool,
}

const PLACES: [Place; 3] = [
    Place { name: "controlled", controlled: true, touching: false },
    Place { name: "uncontrolled", controlled: false, touching: false },
    Place { name: "controlled, another thing touches it", controlled: true, touching: true },
];

/// Results of the runs in a row of the table.
#[derive(Default)]
struct Row {
    scores: Vec<Score>,
    seconds: Vec<f64>,
    failed: Vec<String>,
    /// Results by modelling method: mean distance from the true surface and its 95th percentile, metres,
    /// and share of doubled surface.
    ways: [Vec<(f64, f64, f64)>; WAYS.len()],
}

/// Modelling methods: with or without registration of the keyframes, and with or without smoothing over all
/// measurements.
const WAYS: [Way; 4] = [
    Way { registered: false, smooth: false, name: "stated poses, the least variance a cube (paper)" },
    Way { registered: false, smooth: true, name: "stated poses, moved to the mean of all measurements" },
    Way { registered: true, smooth: false, name: "registered, the least variance a cube" },
    Way { registered: true, smooth: true, name: "registered, moved to the mean of all measurements" },
];

fn options(place: Place, noise: (&str, f64, f64), seed: u64) -> RunOptions {
    RunOptions {
        controlled: place.controlled,
        noise: (noise.1, noise.2.to_radians()),
        touching: place.touching,
        step_rad: 15_f64.to_radians(),
        seed,
    }
}

/// Runs one setting for `objects` bodies; with all methods if `all_ways`.
fn row(place: Place, noise: (&str, f64, f64), objects: usize, seed: u64, all_ways: bool) -> Row {
    let all = bodies();
    let mut row = Row::default();
    for (i, body) in all.iter().enumerate().take(objects) {
        let beside = &all[(i + 5) % all.len()];
        let run = match run(body, beside, options(place, noise, seed * 1000 + i as u64)) {
            Ok(run) => run,
            Err(why) => {
                row.failed.push(format!("{}: {why}", body.name));
                continue;
            }
        };
        row.scores.push(score(&run, body));
        row.seconds.push(run.learn_s + run.notice_s);
        if all_ways {
            for (way, found) in WAYS.iter().zip(&mut row.ways) {
                if let Ok(model) = modelled(&run, way) {
                    found.push(doubled(&model, way.registered, body, &run));
                }
            }
        }
    }
    row
}

/// Prints the paper's tables, then those of the doubled wall.
pub fn print(seed: u64, objects: usize, page: &mut Page) -> Result<(), String> {
    page.heading("What is noticed, and the models");
    page.say(&format!(
        "{objects} objects a row. Recall and precision as the paper takes them, within 2 cm (means and spreads), and within 6 mm; keyframes: how far the \
         used ones are off among each other."
    ));
    let mut table = PageTable::new(&[
        "setting",
        "O_0 recall",
        "O_0 precision",
        "model recall",
        "model precision",
        "recall, 6 mm",
        "precision, 6 mm",
        "point distance, mm",
        "keyframes off, mm",
        "°",
        "looks used",
        "s an object",
    ]);
    let paper = |name: &str, cells: [&str; 5]| {
        let mut row = vec![name.to_owned()];
        row.extend(cells[..4].iter().map(|c| (*c).to_owned()));
        row.extend(["", ""].map(str::to_owned));
        row.push(cells[4].to_owned());
        row.extend(["", "", ""].map(str::to_owned));
        row
    };
    let mut willow = paper("paper, controlled; Willow", ["0.80±0.15", "0.99±0.01", "0.97", "0.92", "17"]);
    willow.push("39".to_owned());
    let mut tuw = paper("paper, TUW", ["", "", "0.89", "0.87", "16"]);
    tuw.push("39".to_owned());
    table.row(willow);
    table.row(tuw);
    let mut walls =
        PageTable::new(&["setting", "model", "point distance, mm", "95 % within, mm", "doubled, %"]);
    let mut failed = Vec::new();
    for place in PLACES {
        for noise in NOISES {
            let all_ways = place.controlled;
            let mut found = row(place, noise, objects, seed, all_ways);
            let name = format!("{}, {}", place.name, noise.0);
            table.row(cells(&name, &mut found));
            failed.extend(found.failed.iter().map(|why| format!("{name}: not learned: {why}")));
            for (way, found) in WAYS.iter().zip(&found.ways).filter(|_| all_ways) {
                let mean =
                    |f: fn(&(f64, f64, f64)) -> f64| spread(&found.iter().map(f).collect::<Vec<_>>()).0;
                walls.row(vec![
                    name.clone(),
                    way.name.to_owned(),
                    format!("{:.1}", 1e3 * mean(|w| w.0)),
                    format!("{:.1}", 1e3 * mean(|w| w.1)),
                    format!("{:.1}", 100.0 * mean(|w| w.2)),
                ]);
            }
        }
    }
    page.table(&table);
    failed.iter().for_each(|why| page.say(why));
    page.heading("The double wall");
    page.say(
        "Distance of the model's points from the true surface, what 95 % of them keep within, and the share of the surface that is there twice: \
         points turned as it is leave a gap of 5 mm or more along its normal.",
    );
    page.table(&walls);
    let run = run(&bodies()[0], &bodies()[5], options(PLACES[0], NOISES[2], seed * 1000))?;
    section(&run, page)
}

/// Cross-section of one model by every method.
fn section(run: &Run, page: &mut Page) -> Result<(), String> {
    let truth = truth(&bodies()[0], &run.world_from_body);
    let mut cuts = Vec::new();
    for way in &WAYS {
        let model = modelled(run, way).map_err(|e| e.to_string())?;
        let cloud = aligned(&model, way.registered, run, &truth).transformed(&run.world_from_body.inverse());
        let cut = cloud.points.iter().filter(|p| (p.z - 0.14).abs() < 0.004);
        cuts.push(Slice { name: way.name, points: cut.map(|p| (p.x, p.y)).collect() });
    }
    slices(&cuts, &page.file("double-wall.svg"))?;
    page.figure(
        "double-wall.svg",
        "Half-way up through the model of the muesli carton, keyframes 1 cm and 1° off",
    );
    Ok(())
}

fn cells(name: &str, row: &mut Row) -> Vec<String> {
    let of = |f: fn(&Score) -> f64| pair(row.scores.iter().map(f));
    let mean = |f: fn(&Score) -> f64| spread(&row.scores.iter().map(f).collect::<Vec<_>>()).0;
    vec![
        name.to_owned(),
        of(|s| s.first.0),
        of(|s| s.first.1),
        of(|s| s.model.0),
        of(|s| s.model.1),
        of(|s| s.strict.0),
        of(|s| s.strict.1),
        format!("{:.1}", 1e3 * mean(|s| s.distance_m)),
        format!("{:.1}", 1e3 * mean(|s| s.poses.0)),
        format!("{:.2}", mean(|s| s.poses.1).to_degrees()),
        format!("{:.1} of {:.1}", mean(|s| s.used as f64), mean(|s| s.looks as f64)),
        format!("{:.1}", median(&mut row.seconds)),
    ]
}
