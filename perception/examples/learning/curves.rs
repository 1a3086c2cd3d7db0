//! Recognition against coverage (Fig. 5): models learned by the robot beside models made from perfect poses.

use crate::household::{Room, bodies};
use crate::knowing::{Model, Scene, is_right, learned_steps, library, offline, scene, some};
use crate::measure::median;
use crate::plot::{Line, curves, sheet};
use crate::runs::RunOptions;
use crate::tabletop::Draws;
use descry_perception::Cloud;
use descry_perception::calibration::reliability;
use descry_perception::learning::KnowOptions;
use descry_perception::voxel;
use std::path::Path;
use std::time::Instant;

/// Side of the voxels that coverage is counted in, metres.
const COVERAGE_M: f32 = 0.005;

/// Answers about one model in all scenes.
#[derive(Default)]
struct Tally {
    right: usize,
    wrong: usize,
    missed: usize,
}

impl Tally {
    fn f_score(&self) -> f64 {
        2.0 * self.right as f64 / (2 * self.right + self.wrong + self.missed).max(1) as f64
    }
}

fn voxels(cloud: &Cloud) -> f64 {
    voxel::assign(&cloud.points, COVERAGE_M).map_or(0.0, |a| a.voxels as f64)
}

/// What is asked of all models.
struct Asked {
    scenes: Vec<Scene>,
    surfaces: Vec<Cloud>,
    offline: Vec<Model>,
    seconds: Vec<f64>,
    claims: Vec<(f64, bool)>,
}

impl Asked {
    /// Looks for one model, the others of its library being made from perfect poses.
    fn tally(&mut self, model: &Model) -> Result<Tally, String> {
        let mut models = vec![model];
        models.extend(self.offline.iter().filter(|m| m.body != model.body));
        let library = library(&models);
        let mut tally = Tally::default();
        for scene in &self.scenes {
            let start = Instant::now();
            let found = library.recognise(&scene.view, &KnowOptions::default()).map_err(|e| e.to_string())?;
            self.seconds.push(start.elapsed().as_secs_f64());
            let there = scene.things.iter().any(|t| t.0 == model.body);
            let own: Vec<bool> = found
                .iter()
                .filter(|f| f.model == 0)
                .map(|f| is_right(scene, &self.surfaces, model.body, f))
                .collect();
            let right = own.iter().filter(|r| **r).count();
            tally.right += right;
            tally.wrong += own.len() - right;
            tally.missed += usize::from(there && right == 0);
            for f in &found {
                self.claims.push((f.confidence, is_right(scene, &self.surfaces, models[f.model].body, f)));
            }
        }
        Ok(tally)
    }
}

/// Prints and draws; `objects` and `scenes` bound the work.
pub fn print(seed: u64, objects: usize, scenes: usize, out: &Path) -> Result<(), String> {
    let bodies = bodies();
    let mut draws = Draws(seed ^ 0x5c);
    let offline: Vec<Model> = (0..bodies.len())
        .map(|i| offline(&bodies, i, seed * 500 + 40 * i as u64))
        .collect::<Result<_, _>>()?;
    let named: Vec<(&str, &Cloud)> = offline.iter().map(|m| (bodies[m.body].name, &m.cloud)).collect();
    sheet(&named, &out.join("models-from-perfect-poses.png"))?;
    let mut asked = Asked {
        scenes: (0..scenes)
            .map(|k| scene(&bodies, &some(&mut draws, bodies.len(), 4), seed * 90_000 + k as u64))
            .collect(),
        surfaces: bodies.iter().map(|b| Room::surface(b, 0.004)).collect(),
        offline,
        seconds: Vec::new(),
        claims: Vec::new(),
    };
    println!(
        "\n| object | model | coverage | f-score | right | wrong | missed |\n|---|---|---|---|---|---|---|"
    );
    let mut lines = Vec::new();
    let mut learned_models = Vec::new();
    for i in 0..objects.min(bodies.len()) {
        let options = RunOptions {
            controlled: true,
            noise: (0.005, 0.5_f64.to_radians()),
            registered: true,
            touching: false,
            step_rad: 15_f64.to_radians(),
            seed: seed * 300 + i as u64,
        };
        let whole = voxels(&asked.offline[i].cloud);
        let mut line = Vec::new();
        for model in learned_steps(&bodies, i, options, &[1, 3, 100])? {
            let tally = asked.tally(&model)?;
            let coverage = (voxels(&model.cloud) / whole).min(1.0);
            row(bodies[i].name, "learned", coverage, &tally);
            line.push((coverage, tally.f_score()));
            learned_models.push((bodies[i].name, model.cloud));
        }
        lines.push(Line {
            name: format!("{}, learned", bodies[i].name),
            dashed: true,
            colour: i,
            points: line,
        });
        let model = Model { body: i, cloud: asked.offline[i].cloud.clone() };
        let tally = asked.tally(&model)?;
        row(bodies[i].name, "perfect poses", 1.0, &tally);
        let points = vec![(1.0, tally.f_score())];
        lines.push(Line {
            name: format!("{}, perfect poses", bodies[i].name),
            dashed: false,
            colour: i,
            points,
        });
    }
    let named: Vec<(&str, &Cloud)> = learned_models.iter().map(|(n, c)| (*n, c)).collect();
    sheet(&named, &out.join("models-learned.png"))?;
    curves(&lines, &out.join("coverage.svg"))?;
    println!(
        "\nmedian of a recognition among {} models: {:.2} s (paper: 5 s)",
        bodies.len(),
        median(&mut asked.seconds)
    );
    let told = reliability(&asked.claims, 5);
    println!(
        "confidence: {} answers, Brier {:.3} (base rate {:.3}), expected error {:.3}",
        told.count, told.brier, told.brier_of_base_rate, told.expected_error
    );
    Ok(())
}

fn row(name: &str, model: &str, coverage: f64, t: &Tally) {
    println!(
        "| {name} | {model} | {coverage:.2} | {:.2} | {} | {} | {} |",
        t.f_score(),
        t.right,
        t.wrong,
        t.missed
    );
}
