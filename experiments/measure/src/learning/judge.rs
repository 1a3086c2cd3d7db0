//! Weights of evidence: logistic regression on scenes with other objects than those evaluated.

use crate::household::{Body, Room, made::made};
use crate::knowing::{Model, is_right, learned_steps, library, offline, options, scene_among, some};
use crate::page::{Page, PageTable};
use crate::plot::{BLUE, Line, LinePlot, ORANGE, panels};
use crate::runs::RunOptions;
use crate::tabletop::Draws;
use descry_perception::Cloud;
use descry_perception::calibration::{Claim, reliability};
use descry_perception::learning::{Judge, KnowOptions, PoseEvidence, WEIGHTS};
use descry_perception::nalgebra::{SMatrix, SVector};

const ROUNDS: usize = 30;
/// Ridge penalty on the weights.
const RIDGE: f64 = 0.02;
/// Number of learned objects in a set; a set has as many unknown ones.
const KNOWN: usize = 16;
/// Number of scenes for each set of objects.
const SCENES: usize = 20;

/// Numbers of views of the models, in turn: sparse models are confused most easily.
const LOOKS: [usize; 4] = [1, usize::MAX, 2, usize::MAX];
/// Number of leaflets in every second scene: flat prints fit any model known from one side only.
const LEAFLETS: usize = 4;

/// Two models of each body, one after the other: learned from views of the robot, and from views on a turntable.
fn models(bodies: &[Body], seed: u64) -> Vec<Model> {
    let mut models = Vec::new();
    for (i, body) in bodies.iter().enumerate().take(KNOWN) {
        let own = seed * 7000 + 50 * i as u64;
        let options = RunOptions {
            controlled: i % 4 != 3,
            noise: (0.005, 0.5_f64.to_radians()),
            touching: false,
            step_rad: 15_f64.to_radians(),
            seed: own,
        };
        let looks = LOOKS[i / 2 % LOOKS.len()];
        let made = match i % 2 {
            0 => offline(body, i, looks, own),
            _ => learned_steps(std::slice::from_ref(body), 0, options, &[looks])
                .and_then(|mut m| m.pop().ok_or_else(String::new)),
        };
        models.extend(made.into_iter().map(|model| Model { body: i, ..model }));
    }
    models
}

/// Claim as a line of CSV, with its evidence.
pub fn line(scene: usize, model: usize, right: bool, e: &PoseEvidence) -> String {
    format!(
        "{scene},{model},{},{},{},{},{},{:.4},{:.4},{:.4},{:.4},{}",
        u8::from(right),
        e.facing,
        e.explained,
        e.through,
        e.hidden,
        e.colour.unwrap_or(-1.0),
        e.off_sigmas,
        e.turned_rad,
        e.beyond,
        e.votes
    )
}

/// Fits a judge and prints it; the training data is written to the page's folder.
pub fn fit(seed: u64, scenes: usize, page: &mut Page) -> Result<(), String> {
    let mut claims: Vec<(PoseEvidence, bool)> = Vec::new();
    let mut lines = Vec::new();
    let path = page.file("claims.csv");
    for first in (0..scenes).step_by(SCENES) {
        let set = seed + (first / SCENES) as u64;
        for (scene, model, evidence, right) in judged(set, first..scenes.min(first + SCENES))? {
            claims.push((evidence, right));
            lines.push(line(scene, model, right, &evidence));
        }
        std::fs::write(&path, lines.join("\n")).map_err(|e| format!("{}: {e}", path.display()))?;
    }
    let judge = regression(&claims);
    page.heading("What evidence is worth");
    page.say(&format!(
        "{} claims, {} right, weights {:.2?}",
        claims.len(),
        claims.iter().filter(|c| c.1).count(),
        judge.weights
    ));
    let stated: Vec<Claim> = claims.iter().map(|(e, r)| (judge.confidence(e), *r)).collect();
    page.say(&format!("on what it was fitted to: {:?}", reliability(&stated, 5)));
    Ok(())
}

/// Claims in scenes with a set of objects, half of them known: scene, model, evidence, and true if the claim
/// is right.
fn judged(
    set: u64,
    scenes: std::ops::Range<usize>,
) -> Result<Vec<(usize, usize, PoseEvidence, bool)>, String> {
    let bodies: Vec<Body> = (0..2 * KNOWN as u64).map(|k| made(set * 1000 + k)).collect();
    let surfaces: Vec<Cloud> = bodies.iter().map(|b| Room::surface(b, 0.004)).collect();
    let models = models(&bodies, set);
    let library = library(&models.iter().collect::<Vec<_>>());
    // What is hopeless has to be known as such.
    let options = KnowOptions { hopeless: 0.0, ..options() };
    let mut draws = Draws(set);
    let mut judged = Vec::new();
    for k in scenes {
        let things = some(&mut draws, bodies.len(), 5);
        let mut scene = scene_among(&bodies, &things, LEAFLETS * (k % 2), set * 9000 + k as u64);
        if k % 4 == 3 {
            // What is known without colours has to be judged as well.
            scene.view.cloud.colours = None;
        }
        for found in library.judged(&scene.view, &options).map_err(|e| e.to_string())? {
            let found = found.recognised;
            let right = is_right(&scene, &surfaces, models[found.model].body, &found);
            judged.push((k, found.model, found.evidence, right));
        }
    }
    Ok(judged)
}

/// Prints stated against true shares of correct answers.
pub fn print(claims: &[(&str, Vec<Claim>)], page: &mut Page) -> Result<(), String> {
    page.heading("Confidence against truth");
    let mut table = PageTable::new(&[
        "answers of",
        "stated",
        "answers",
        "stated in the mean",
        "right",
        "Brier",
        "of the base rate",
    ]);
    let mut panel = Vec::new();
    for (name, claims) in claims {
        let told = reliability(claims, 10);
        let colour = if panel.is_empty() { BLUE } else { ORANGE };
        let mut points = Vec::new();
        for bin in told.bins.iter().filter(|b| b.count > 0) {
            points.push((bin.stated, bin.came_true));
            table.row(vec![
                (*name).to_owned(),
                format!("{:.1} to {:.1}", bin.low, bin.high),
                bin.count.to_string(),
                format!("{:.3}", bin.stated),
                format!("{:.3}", bin.came_true),
                format!("{:.3}", told.brier),
                format!("{:.3}", told.brier_of_base_rate),
            ]);
        }
        panel.push(Line { dashed: false, colour, points });
    }
    page.table(&table);
    let lines = panel.into_iter().chain([Line {
        dashed: true,
        colour: "#999",
        points: vec![(0.0, 0.0), (1.0, 1.0)],
    }]);
    let panel = LinePlot { name: "reliability".to_owned(), lines: lines.collect() };
    panels(&[panel], ("stated", "right"), &page.file("confidence.svg"))?;
    page.figure("confidence.svg", "Share of right answers against what was stated");
    Ok(())
}

/// Fits the regression by Newton's method.
fn regression(claims: &[(PoseEvidence, bool)]) -> Judge {
    let mut judge = Judge { weights: [0.0; WEIGHTS] };
    for _ in 0..ROUNDS {
        let mut hessian = SMatrix::<f64, WEIGHTS, WEIGHTS>::identity() * RIDGE;
        let mut gradient = -SVector::<f64, WEIGHTS>::from(judge.weights) * RIDGE;
        for (evidence, right) in claims {
            let x = SVector::<f64, WEIGHTS>::from(evidence.measures());
            let p = judge.confidence(evidence);
            gradient += x * (f64::from(u8::from(*right)) - p);
            hessian += x * x.transpose() * (p * (1.0 - p));
        }
        let Some(step) = hessian.cholesky().map(|c| c.solve(&gradient)) else { break };
        for (weight, step) in judge.weights.iter_mut().zip(step.iter()) {
            *weight += step;
        }
    }
    judge
}
