//! What evidence is worth: logistic regression on scenes of other objects than those that are evaluated.

use crate::household::{Body, Room, bodies};
use crate::knowing::{Model, is_right, library, offline, scene, some};
use crate::tabletop::Draws;
use descry_perception::Cloud;
use descry_perception::calibration::reliability;
use descry_perception::learning::{Evidence, Judge, KnowOptions, WEIGHTS};
use descry_perception::nalgebra::{SMatrix, SVector};
use std::path::Path;

const ROUNDS: usize = 30;
/// Pull of the weights towards nothing.
const RIDGE: f64 = 0.02;

/// Other objects of the same sorts.
pub fn others(seed: u64) -> Vec<Body> {
    let mut draws = Draws(seed ^ 0x0de);
    bodies().iter().map(|b| b.varied(0.85 + 0.35 * draws.next(), 1 + (draws.next() * 1e9) as u64)).collect()
}

/// Fits a judge and prints it; what it was fitted to is written to DIR.
pub fn fit(seed: u64, scenes: usize, out: &Path) -> Result<(), String> {
    let bodies = others(seed);
    let surfaces: Vec<Cloud> = bodies.iter().map(|b| Room::surface(b, 0.004)).collect();
    let models: Vec<Model> = (0..bodies.len())
        .map(|i| offline(&bodies, i, seed * 7000 + 50 * i as u64))
        .collect::<Result<_, _>>()?;
    let library = library(&models.iter().collect::<Vec<_>>());
    let mut claims: Vec<(Evidence, bool)> = Vec::new();
    let mut draws = Draws(seed);
    for k in 0..scenes {
        let mut scene = scene(&bodies, &some(&mut draws, bodies.len(), 5), seed * 9000 + k as u64);
        if k % 2 == 1 {
            // What is known without colours has to be judged as well.
            scene.view.cloud.colours = None;
        }
        for found in library.judged(&scene.view, &KnowOptions::default()).map_err(|e| e.to_string())? {
            let right = is_right(&scene, &surfaces, models[found.model].body, &found);
            claims.push((found.evidence, right));
        }
    }
    println!("{} claims, {} right", claims.len(), claims.iter().filter(|c| c.1).count());
    let lines: Vec<String> = claims
        .iter()
        .map(|(e, right)| {
            format!(
                "{},{},{},{},{},{:.4},{:.4},{:.4},{}",
                u8::from(*right),
                e.facing,
                e.explained,
                e.through,
                e.hidden,
                e.colour.unwrap_or(-1.0),
                e.off_sigmas,
                e.beyond,
                e.votes
            )
        })
        .collect();
    let path = out.join("claims.csv");
    std::fs::write(&path, lines.join("\n")).map_err(|e| format!("{}: {e}", path.display()))?;
    let judge = regression(&claims);
    println!("weights {:.2?}", judge.weights);
    let stated: Vec<(f64, bool)> = claims.iter().map(|(e, r)| (judge.confidence(e), *r)).collect();
    println!("on what it was fitted to: {:?}", reliability(&stated, 5));
    Ok(())
}

/// Newton's method.
fn regression(claims: &[(Evidence, bool)]) -> Judge {
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
