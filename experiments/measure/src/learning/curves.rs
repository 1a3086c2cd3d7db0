//! Recognition against coverage (Fig. 5): models learned by the robot compared with models from perfect
//! poses.

use crate::household::{Room, bodies};
use crate::knowing::{Model, Scene, Tally, is_right, learned_steps, library, offline, options, scene, some};
use crate::measure::{median, spread};
use crate::page::{Page, PageTable};
use crate::plot::{BLUE, GREEN, Line, LinePlot, ORANGE, panels, sheet};
use crate::runs::RunOptions;
use crate::tabletop::Draws;
use descry_perception::Cloud;
use descry_perception::calibration::{Claim, reliability};
use descry_perception::learning::{Hypothesis, choose};
use descry_perception::voxel;
use std::time::Instant;

/// Voxel size for measuring coverage, metres.
const COVERAGE_M: f32 = 0.005;
/// Numbers of views from which partial models are learned on the turntable.
const TURNTABLE_STEPS: [usize; 3] = [1, 3, 14];
/// Numbers of views from which partial models are learned by the robot; 100 stands for all.
const ROBOT_STEPS: [usize; 3] = [1, 3, 100];

/// Origin of a model: perfect poses, or learned by the robot in a controlled or an uncontrolled place.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Kind {
    Perfect,
    Controlled,
    Uncontrolled,
}

const KINDS: [(Kind, &str, &str, bool); 3] = [
    (Kind::Perfect, "perfect poses", BLUE, false),
    (Kind::Controlled, "learned, controlled", ORANGE, true),
    (Kind::Uncontrolled, "learned, uncontrolled", GREEN, false),
];

/// A model with its coverage.
struct Variant {
    kind: Kind,
    model: Model,
    coverage: f64,
    /// True for the model of its kind with the most views.
    whole: bool,
}

fn voxels(cloud: &Cloud) -> f64 {
    voxel::assign(&cloud.points, COVERAGE_M).map_or(0.0, |a| a.voxels as f64)
}

/// Models of one body from increasing numbers of views.
fn variants(body: usize, seed: u64, page: &mut Page) -> Vec<Variant> {
    let bodies = bodies();
    let options = |controlled: bool| RunOptions {
        controlled,
        noise: (0.005, 0.5_f64.to_radians()),
        touching: false,
        step_rad: 15_f64.to_radians(),
        seed: seed * 300 + body as u64,
    };
    let mut all = Vec::new();
    let perfect: Result<Vec<Model>, String> = TURNTABLE_STEPS
        .iter()
        .map(|looks| offline(&bodies[body], body, *looks, seed * 500 + 40 * body as u64))
        .collect();
    for (kind, models) in [
        (Kind::Perfect, perfect),
        (Kind::Controlled, learned_steps(&bodies, body, options(true), &ROBOT_STEPS)),
        (Kind::Uncontrolled, learned_steps(&bodies, body, options(false), &[100])),
    ] {
        match models {
            Ok(models) => {
                let last = models.len() - 1;
                all.extend(models.into_iter().enumerate().map(|(k, model)| Variant {
                    kind,
                    model,
                    coverage: 0.0,
                    whole: k == last,
                }));
            }
            Err(why) => page.say(&format!("{}, {kind:?}: not learned: {why}", bodies[body].name)),
        }
    }
    let whole =
        all.iter().find(|v| v.kind == Kind::Perfect && v.whole).map_or(1.0, |v| voxels(&v.model.cloud));
    for variant in &mut all {
        variant.coverage = (voxels(&variant.model.cloud) / whole).min(1.0);
    }
    all
}

/// Prints and plots the curves; `objects` and `scenes` limit the work.
pub fn print(seed: u64, objects: usize, scenes: usize, page: &mut Page) -> Result<Vec<Claim>, String> {
    page.heading("Recognition against coverage");
    let bodies = bodies();
    let mut variants: Vec<Variant> = (0..objects).flat_map(|i| variants(i, seed, page)).collect();
    for (i, body) in bodies.iter().enumerate().skip(objects) {
        let model = offline(body, i, TURNTABLE_STEPS[2], seed * 500 + 40 * i as u64)?;
        variants.push(Variant { kind: Kind::Perfect, model, coverage: 1.0, whole: true });
    }
    for (kind, name, ..) in KINDS {
        let of_kind = variants.iter().filter(|v| v.kind == kind && v.whole);
        let models: Vec<&Cloud> = of_kind.map(|v| &v.model.cloud).collect();
        let file = format!("models-{}.png", name.replace([',', ' '], "-"));
        sheet(&models, &page.file(&file))?;
        page.figure(&file, &format!("Models, {name}: from the front and, below, from behind"));
    }
    let models: Vec<&Model> = variants.iter().map(|v| &v.model).collect();
    let everything = library(&models);
    let surfaces: Vec<Cloud> = bodies.iter().map(|b| Room::surface(b, 0.004)).collect();
    let mut draws = Draws(seed ^ 0x5c);
    let mut tallies: Vec<Tally> = variants.iter().map(|_| Tally::default()).collect();
    let mut claims = Vec::new();
    for k in 0..scenes {
        let scene = scene(&bodies, &some(&mut draws, bodies.len(), 4), seed * 90_000 + k as u64);
        let found = everything.judged(&scene.view, &options()).map_err(|e| e.to_string())?;
        for (i, tally) in tallies.iter_mut().enumerate() {
            look_for(i, &variants, &found, &scene, &surfaces, tally, &mut claims);
        }
    }
    let known: Vec<&Model> =
        variants.iter().filter(|v| v.whole && v.kind == Kind::Perfect).map(|v| &v.model).collect();
    let seconds = seconds(&known, seed)?;
    tables(&variants, &tallies, page);
    page.say(&format!(
        "A recognition among {} models takes {seconds:.2} s in the median (paper: 5 s among 10).",
        known.len()
    ));
    plot(&variants, &tallies, page)?;
    let told = reliability(&claims, 5);
    page.say(&format!(
        "{} answers were given with .8 or more; {:.3} of them are right, {:.3} was stated in the mean.",
        told.count,
        claims.iter().filter(|c| c.1).count() as f64 / claims.len().max(1) as f64,
        claims.iter().map(|c| c.0).sum::<f64>() / claims.len().max(1) as f64,
    ));
    Ok(claims)
}

/// Scores the answers about one variant's body in a scene, for a library of that variant and the complete
/// models of the other bodies.
fn look_for(
    variant: usize,
    variants: &[Variant],
    found: &[Hypothesis],
    scene: &Scene,
    surfaces: &[Cloud],
    tally: &mut Tally,
    claims: &mut Vec<Claim>,
) {
    let body = variants[variant].model.body;
    let rival = |v: &Variant| v.whole && v.kind == Kind::Perfect && v.model.body != body;
    let known =
        found.iter().filter(|c| c.recognised.model == variant || rival(&variants[c.recognised.model]));
    let told = choose(known.cloned().collect(), options().least_confidence);
    let own: Vec<(f64, bool)> = told
        .iter()
        .filter(|f| f.model == variant)
        .map(|f| (f.confidence, is_right(scene, surfaces, body, f)))
        .collect();
    tally.add(scene.things.iter().any(|t| t.0 == body), own.iter().map(|o| o.1));
    claims.extend(own);
}

/// Median time of a recognition among some models, seconds.
fn seconds(models: &[&Model], seed: u64) -> Result<f64, String> {
    let (library, bodies) = (library(models), bodies());
    let mut draws = Draws(seed ^ 0x71);
    let mut seconds = Vec::new();
    for k in 0..5 {
        let scene = scene(&bodies, &some(&mut draws, bodies.len(), 4), seed * 91_000 + k);
        let start = Instant::now();
        library.recognise(&scene.view, &options()).map_err(|e| e.to_string())?;
        seconds.push(start.elapsed().as_secs_f64());
    }
    Ok(median(&mut seconds))
}

fn tables(variants: &[Variant], tallies: &[Tally], page: &mut Page) {
    let names = bodies();
    let mut means = PageTable::new(&["models, all looks", "coverage", "f-score", "right", "wrong", "missed"]);
    let mut table = PageTable::new(&["object", "model", "coverage", "f-score", "right", "wrong", "missed"]);
    for (kind, name, ..) in KINDS {
        let of_kind = || variants.iter().zip(tallies).filter(|(v, _)| v.kind == kind && v.whole);
        let mean =
            |f: fn(&(&Variant, &Tally)) -> f64| spread(&of_kind().map(|v| f(&v)).collect::<Vec<_>>()).0;
        let sum = |f: fn(&Tally) -> usize| of_kind().map(|v| f(v.1)).sum::<usize>().to_string();
        means.row(vec![
            name.to_owned(),
            format!("{:.2}", mean(|v| v.0.coverage)),
            format!("{:.2}", mean(|v| v.1.f_score())),
            sum(|t| t.right),
            sum(|t| t.wrong),
            sum(|t| t.missed),
        ]);
        for (variant, tally) in variants.iter().zip(tallies).filter(|(v, _)| v.kind == kind) {
            table.row(vec![
                names[variant.model.body].name.to_owned(),
                name.to_owned(),
                format!("{:.2}", variant.coverage),
                format!("{:.2}", tally.f_score()),
                tally.right.to_string(),
                tally.wrong.to_string(),
                tally.missed.to_string(),
            ]);
        }
    }
    page.table(&means);
    page.table(&table);
}

fn plot(variants: &[Variant], tallies: &[Tally], page: &mut Page) -> Result<(), String> {
    let all: Vec<LinePlot> = bodies()
        .iter()
        .enumerate()
        .filter(|(i, _)| variants.iter().any(|v| v.model.body == *i && v.kind != Kind::Perfect))
        .map(|(i, body)| {
            let line = |(kind, _, colour, dashed): (Kind, &str, &'static str, bool)| {
                let own = variants.iter().zip(tallies).filter(|(v, _)| v.kind == kind && v.model.body == i);
                Line { dashed, colour, points: own.map(|(v, t)| (v.coverage, t.f_score())).collect() }
            };
            LinePlot { name: body.name.to_owned(), lines: KINDS.map(line).into() }
        })
        .collect();
    panels(&all, ("coverage", "f-score"), &page.file("coverage.svg"))?;
    page.figure(
        "coverage.svg",
        "F-score against coverage (Fig. 5): models from perfect poses (blue), learned controlled (orange, dashed), uncontrolled (green)",
    );
    Ok(())
}
