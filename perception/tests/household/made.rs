//! Generated household objects: sorts with random sizes, colours and patterns.

use super::bodies::{Body, at, bow, cone, cubes, part, tilted};
use super::solid::{Paint, Part, Solid};
use crate::tabletop::Draws;
use descry_perception::nalgebra::Isometry3;
use std::f64::consts::FRAC_PI_4;

/// Between two values.
fn between(draws: &mut Draws, low: f64, high: f64) -> f64 {
    low + (high - low) * draws.next()
}

fn colour(draws: &mut Draws) -> [u8; 3] {
    [0; 3].map(|_| between(draws, 35.0, 225.0) as u8)
}

/// Printed two times in three.
fn paint(draws: &mut Draws) -> Paint {
    let (base, printed) = (colour(draws), draws.next() < 0.67);
    let (spread, coarse_m) = (between(draws, 35.0, 100.0), between(draws, 0.025, 0.05));
    let seed = (draws.next() * 1e12) as u64;
    if printed { cubes(base, spread, coarse_m, seed) } else { Paint::Plain(base) }
}

/// Name and generator of a sort of object.
type Sort = (&'static str, fn(&mut Draws) -> Vec<Part>);

/// Random object of one of ten sorts.
pub fn made(seed: u64) -> Body {
    let mut draws = Draws(seed ^ 0x0b1ec7);
    let sorts: [Sort; 10] = [
        ("carton", carton),
        ("can", can),
        ("cup", cup),
        ("flask", flask),
        ("bowl", bowl),
        ("figure", figure),
        ("lamp", lamp),
        ("bricks", bricks),
        ("pan", pan),
        ("house", house),
    ];
    let (name, sort) = sorts[(draws.next() * sorts.len() as f64) as usize % sorts.len()];
    Body { name, parts: sort(&mut draws) }
}

fn carton(draws: &mut Draws) -> Vec<Part> {
    let half = [between(draws, 0.04, 0.12), between(draws, 0.025, 0.07), between(draws, 0.03, 0.14)];
    vec![part(Solid::Block(half), paint(draws), at(0.0, 0.0, half[2]))]
}

fn can(draws: &mut Draws) -> Vec<Part> {
    let (r, h) = (between(draws, 0.03, 0.065), between(draws, 0.07, 0.2));
    vec![part(cone(r, r, h), paint(draws), Isometry3::identity())]
}

fn cup(draws: &mut Draws) -> Vec<Part> {
    let (low, high, h) =
        (between(draws, 0.03, 0.045), between(draws, 0.036, 0.055), between(draws, 0.08, 0.13));
    let outside = paint(draws);
    let side = Solid::Cone { low_m: low, high_m: high, height_m: h, wall_m: Some(0.005) };
    let mut parts = vec![part(side, outside, Isometry3::identity())];
    if draws.next() < 0.6 {
        let handle = Paint::Plain(colour(draws));
        parts.extend(bow(low, 0.2 * h, 0.85 * h, between(draws, 0.03, 0.045), 0.007, handle));
    }
    parts
}

fn flask(draws: &mut Draws) -> Vec<Part> {
    let (r, h) = (between(draws, 0.03, 0.055), between(draws, 0.1, 0.18));
    let (neck, long) = (between(draws, 0.012, 0.022), between(draws, 0.03, 0.08));
    let (label, glass) = (paint(draws), Paint::Plain(colour(draws)));
    vec![
        part(cone(r, r, h), label, Isometry3::identity()),
        part(cone(r, neck, 0.05), glass, at(0.0, 0.0, h)),
        part(cone(neck, neck, long), glass, at(0.0, 0.0, h + 0.05)),
    ]
}

fn bowl(draws: &mut Draws) -> Vec<Part> {
    let (low, high, h) = (between(draws, 0.03, 0.05), between(draws, 0.07, 0.11), between(draws, 0.05, 0.09));
    let side = Solid::Cone { low_m: low, high_m: high, height_m: h, wall_m: Some(0.006) };
    vec![part(side, paint(draws), Isometry3::identity())]
}

fn figure(draws: &mut Draws) -> Vec<Part> {
    let (fur, wide) = (paint(draws), between(draws, 0.045, 0.07));
    let tall = between(draws, 0.05, 0.08);
    let head = between(draws, 0.03, 0.05);
    let (arm, turn) = (between(draws, 0.03, 0.06), between(draws, -0.6, 0.6));
    let pale = Paint::Plain(colour(draws));
    vec![
        part(Solid::Ball([wide, 0.9 * wide, tall]), fur, at(0.0, 0.0, tall)),
        part(Solid::Ball([head, head, 1.1 * head]), fur, at(0.01, 0.0, 2.0 * tall + 0.7 * head)),
        part(
            Solid::Ball([0.4 * head, 0.5 * head, 0.4 * head]),
            pale,
            at(0.01 + head, 0.0, 2.0 * tall + 0.7 * head),
        ),
        part(Solid::Ball([arm, 0.02, 0.02]), fur, tilted(0.5 * wide, 0.9 * wide, tall, [0.0, turn, 0.4])),
        part(Solid::Ball([arm, 0.02, 0.02]), fur, tilted(0.5 * wide, -0.9 * wide, tall, [0.0, -turn, -0.4])),
    ]
}

fn lamp(draws: &mut Draws) -> Vec<Part> {
    let (foot, tall, shade) =
        (between(draws, 0.045, 0.07), between(draws, 0.12, 0.2), between(draws, 0.05, 0.08));
    let (base, cloth) = (Paint::Plain(colour(draws)), paint(draws));
    vec![
        part(cone(foot, 0.8 * foot, 0.025), base, Isometry3::identity()),
        part(
            Solid::Rod { from: [0.0, 0.0, 0.02], to: [0.0, 0.0, tall], radius_m: 0.012 },
            base,
            Isometry3::identity(),
        ),
        part(cone(shade, 0.6 * shade, between(draws, 0.06, 0.09)), cloth, at(0.0, 0.0, tall)),
    ]
}

fn bricks(draws: &mut Draws) -> Vec<Part> {
    let mut parts = Vec::new();
    let mut low = 0.0;
    for _ in 0..3 {
        let half = [between(draws, 0.025, 0.08), between(draws, 0.025, 0.06), between(draws, 0.018, 0.035)];
        let (x, y, turn) =
            (between(draws, -0.03, 0.03), between(draws, -0.02, 0.02), between(draws, -0.7, 0.7));
        parts.push(part(Solid::Block(half), paint(draws), tilted(x, y, low + half[2], [0.0, 0.0, turn])));
        low += 2.0 * half[2];
    }
    parts
}

fn pan(draws: &mut Draws) -> Vec<Part> {
    let (r, h, long) = (between(draws, 0.06, 0.1), between(draws, 0.04, 0.09), between(draws, 0.08, 0.15));
    let (steel, grip) = (paint(draws), Paint::Plain(colour(draws)));
    let side = Solid::Cone { low_m: 0.9 * r, high_m: r, height_m: h, wall_m: Some(0.005) };
    let handle = Solid::Rod { from: [r, 0.0, 0.8 * h], to: [r + long, 0.0, h + 0.01], radius_m: 0.011 };
    vec![part(side, steel, Isometry3::identity()), part(handle, grip, Isometry3::identity())]
}

fn house(draws: &mut Draws) -> Vec<Part> {
    let (x, y, z) = (between(draws, 0.03, 0.07), between(draws, 0.03, 0.055), between(draws, 0.04, 0.09));
    let (walls, roof) = (paint(draws), paint(draws));
    let edge = y / 2_f64.sqrt();
    vec![
        part(Solid::Block([x, y, z]), walls, at(0.0, 0.0, z)),
        part(Solid::Block([x, edge, edge]), roof, tilted(0.0, 0.0, 2.0 * z, [FRAC_PI_4, 0.0, 0.0])),
    ]
}

/// Random piece of furniture (cupboard, shelf, large box), larger than learned objects: half depth,
/// width and height between two bounds, metres.
pub fn furniture(low: [f64; 3], high: [f64; 3], seed: u64) -> Body {
    let mut draws = Draws(seed ^ 0xf0e1);
    let half: [f64; 3] = std::array::from_fn(|k| between(&mut draws, low[k], high[k]));
    let parts = vec![part(Solid::Block(half), paint(&mut draws), at(0.0, 0.0, half[2]))];
    Body { name: "furniture", parts }
}
