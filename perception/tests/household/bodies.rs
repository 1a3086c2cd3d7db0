//! Hand-made rigid household objects, each with its base on z = 0.

use super::solid::{Paint, Part, Solid};
use descry_perception::nalgebra::{Isometry3, Translation3, UnitQuaternion, Vector3};

/// An object.
#[derive(Clone, Debug)]
pub struct Body {
    pub name: &'static str,
    pub parts: Vec<Part>,
}

pub(super) fn at(x: f64, y: f64, z: f64) -> Isometry3<f64> {
    Translation3::new(x, y, z).into()
}

pub(super) fn tilted(x: f64, y: f64, z: f64, turn: [f64; 3]) -> Isometry3<f64> {
    Isometry3::from_parts(Translation3::new(x, y, z), UnitQuaternion::from_scaled_axis(Vector3::from(turn)))
}

pub(super) fn part(solid: Solid, paint: Paint, here_from_part: Isometry3<f64>) -> Part {
    Part { solid, paint, here_from_part }
}

pub(super) fn cubes(base: [u8; 3], spread: f64, coarse_m: f64, seed: u64) -> Paint {
    Paint::Cubes { base, spread, coarse_m, fine_m: 0.4 * coarse_m, seed }
}

pub(super) fn cone(low_m: f64, high_m: f64, height_m: f64) -> Solid {
    Solid::Cone { low_m, high_m, height_m, wall_m: None }
}

/// A bow of rods in the plane y = 0, out from x.
pub(super) fn bow(x: f64, low: f64, high: f64, out: f64, radius_m: f64, paint: Paint) -> Vec<Part> {
    let knots: Vec<[f64; 3]> = (0..=6)
        .map(|i| {
            let turn = std::f64::consts::PI * f64::from(i) / 6.0;
            [x + out * turn.sin(), 0.0, low + (high - low) * 0.5 * (1.0 - turn.cos())]
        })
        .collect();
    let rod = |pair: &[[f64; 3]]| {
        part(Solid::Rod { from: pair[0], to: pair[1], radius_m }, paint, Isometry3::identity())
    };
    knots.windows(2).map(rod).collect()
}

/// Names in the order of [`bodies`].
pub fn bodies() -> Vec<Body> {
    vec![
        muesli(),
        cooler(),
        head(),
        mug(),
        bottle(),
        bear(),
        truck(),
        kettle(),
        tin(),
        tape(),
        tissues(),
        milk(),
    ]
}

fn muesli() -> Body {
    let paint = cubes([150, 110, 60], 110.0, 0.035, 11);
    Body { name: "muesli", parts: vec![part(Solid::Block([0.095, 0.032, 0.14]), paint, at(0.0, 0.0, 0.14))] }
}

fn cooler() -> Body {
    let body = cubes([50, 90, 160], 70.0, 0.045, 22);
    let lid = Paint::Plain([225, 225, 215]);
    let mut parts = vec![
        part(Solid::Block([0.12, 0.085, 0.075]), body, at(0.0, 0.0, 0.075)),
        part(Solid::Block([0.125, 0.09, 0.02]), lid, at(0.0, 0.0, 0.17)),
    ];
    for (from, to) in [
        ([-0.09, 0.0, 0.19], [-0.09, 0.0, 0.225]),
        ([0.09, 0.0, 0.19], [0.09, 0.0, 0.225]),
        ([-0.09, 0.0, 0.225], [0.09, 0.0, 0.225]),
    ] {
        parts.push(part(Solid::Rod { from, to, radius_m: 0.009 }, lid, Isometry3::identity()));
    }
    Body { name: "cooler", parts }
}

/// A head without any texture.
fn head() -> Body {
    let grey = Paint::Plain([190, 186, 180]);
    let parts = vec![
        part(Solid::Block([0.06, 0.06, 0.02]), grey, at(0.0, 0.0, 0.02)),
        part(cone(0.045, 0.035, 0.08), grey, at(0.0, 0.0, 0.04)),
        part(Solid::Ball([0.075, 0.06, 0.085]), grey, at(0.005, 0.0, 0.175)),
        part(Solid::Ball([0.025, 0.012, 0.02]), grey, at(0.075, 0.0, 0.165)),
        part(Solid::Ball([0.02, 0.012, 0.028]), grey, at(-0.005, 0.06, 0.17)),
        part(Solid::Ball([0.02, 0.012, 0.028]), grey, at(-0.005, -0.06, 0.17)),
        part(Solid::Ball([0.03, 0.04, 0.015]), grey, at(0.045, 0.0, 0.2)),
    ];
    Body { name: "head", parts }
}

fn mug() -> Body {
    let paint = cubes([200, 60, 50], 60.0, 0.03, 44);
    let side = Solid::Cone { low_m: 0.038, high_m: 0.044, height_m: 0.1, wall_m: Some(0.005) };
    let mut parts = vec![part(side, paint, Isometry3::identity())];
    parts.extend(bow(0.038, 0.02, 0.085, 0.035, 0.006, Paint::Plain([200, 60, 50])));
    Body { name: "mug", parts }
}

fn bottle() -> Body {
    let label = cubes([40, 130, 60], 90.0, 0.03, 55);
    let green = Paint::Plain([30, 90, 50]);
    let parts = vec![
        part(cone(0.042, 0.042, 0.15), label, Isometry3::identity()),
        part(cone(0.042, 0.016, 0.06), green, at(0.0, 0.0, 0.15)),
        part(cone(0.016, 0.016, 0.05), green, at(0.0, 0.0, 0.21)),
        part(cone(0.019, 0.019, 0.02), Paint::Plain([230, 200, 40]), at(0.0, 0.0, 0.255)),
    ];
    Body { name: "bottle", parts }
}

fn bear() -> Body {
    let fur = cubes([140, 95, 55], 22.0, 0.02, 66);
    let pale = Paint::Plain([205, 180, 140]);
    let parts = vec![
        part(Solid::Ball([0.06, 0.055, 0.07]), fur, at(0.0, 0.0, 0.068)),
        part(Solid::Ball([0.048, 0.052, 0.048]), fur, at(0.01, 0.0, 0.165)),
        part(Solid::Ball([0.022, 0.024, 0.02]), pale, at(0.055, 0.0, 0.158)),
        part(Solid::Ball([0.012, 0.02, 0.02]), fur, at(0.0, 0.045, 0.205)),
        part(Solid::Ball([0.012, 0.02, 0.02]), fur, at(0.0, -0.045, 0.205)),
        part(Solid::Ball([0.045, 0.022, 0.022]), fur, tilted(0.07, 0.05, 0.024, [0.0, 0.0, 0.5])),
        part(Solid::Ball([0.045, 0.022, 0.022]), fur, tilted(0.07, -0.05, 0.024, [0.0, 0.0, -0.5])),
        part(Solid::Ball([0.018, 0.045, 0.018]), fur, tilted(0.02, 0.065, 0.1, [0.6, 0.0, 0.0])),
        part(Solid::Ball([0.018, 0.045, 0.018]), fur, tilted(0.02, -0.065, 0.1, [-0.6, 0.0, 0.0])),
    ];
    Body { name: "bear", parts }
}

fn truck() -> Body {
    let red = cubes([190, 40, 30], 30.0, 0.05, 77);
    let bed = Paint::Plain([235, 190, 40]);
    let black = Paint::Plain([40, 40, 42]);
    let mut parts = vec![
        part(Solid::Block([0.13, 0.045, 0.012]), black, at(0.0, 0.0, 0.045)),
        part(Solid::Block([0.04, 0.045, 0.045]), red, at(0.085, 0.0, 0.1)),
        part(Solid::Block([0.08, 0.048, 0.025]), bed, at(-0.045, 0.0, 0.085)),
        part(Solid::Block([0.006, 0.048, 0.05]), bed, at(0.03, 0.0, 0.115)),
    ];
    for (x, y) in [(0.085, 0.04), (0.085, -0.04), (-0.07, 0.04), (-0.07, -0.04)] {
        let wheel = cone(0.032, 0.032, 0.02);
        let y = if y > 0.0 { y + 0.02 } else { y };
        parts.push(part(wheel, black, tilted(x, y, 0.032, [std::f64::consts::FRAC_PI_2, 0.0, 0.0])));
    }
    Body { name: "truck", parts }
}

fn kettle() -> Body {
    let steel = cubes([150, 155, 165], 18.0, 0.05, 88);
    let black = Paint::Plain([35, 35, 40]);
    let mut parts = vec![
        part(cone(0.085, 0.062, 0.17), steel, Isometry3::identity()),
        part(cone(0.06, 0.03, 0.02), black, at(0.0, 0.0, 0.17)),
        part(Solid::Ball([0.014, 0.014, 0.012]), black, at(0.0, 0.0, 0.197)),
        part(
            Solid::Rod { from: [-0.07, 0.0, 0.1], to: [-0.125, 0.0, 0.165], radius_m: 0.017 },
            steel,
            Isometry3::identity(),
        ),
    ];
    parts.extend(bow(0.072, 0.03, 0.155, 0.055, 0.011, black));
    Body { name: "kettle", parts }
}

fn tin() -> Body {
    let paint = cubes([170, 150, 40], 100.0, 0.028, 99);
    Body { name: "tin", parts: vec![part(cone(0.052, 0.052, 0.13), paint, Isometry3::identity())] }
}

fn tape() -> Body {
    let teal = Paint::Plain([30, 140, 140]);
    let parts = vec![
        part(Solid::Block([0.08, 0.03, 0.018]), teal, at(0.0, 0.0, 0.018)),
        part(Solid::Block([0.012, 0.03, 0.04]), teal, tilted(0.07, 0.0, 0.06, [0.0, 0.35, 0.0])),
        part(
            cone(0.045, 0.045, 0.036),
            Paint::Plain([225, 215, 190]),
            tilted(-0.02, 0.018, 0.075, [std::f64::consts::FRAC_PI_2, 0.0, 0.0]),
        ),
        part(Solid::Block([0.018, 0.028, 0.03]), teal, at(-0.02, 0.0, 0.06)),
    ];
    Body { name: "tape", parts }
}

fn tissues() -> Body {
    let paint = cubes([160, 120, 170], 80.0, 0.04, 1010);
    let white = Paint::Plain([240, 240, 242]);
    let parts = vec![
        part(Solid::Block([0.115, 0.06, 0.045]), paint, at(0.0, 0.0, 0.045)),
        part(Solid::Ball([0.05, 0.015, 0.04]), white, at(0.0, 0.0, 0.09)),
    ];
    Body { name: "tissues", parts }
}

fn milk() -> Body {
    let paint = cubes([190, 200, 215], 75.0, 0.035, 1111);
    let roof = 0.05 / 2f64.sqrt();
    let parts = vec![
        part(Solid::Block([0.045, 0.045, 0.09]), paint, at(0.0, 0.0, 0.09)),
        part(
            Solid::Block([0.045, roof * 0.9, roof * 0.9]),
            paint,
            tilted(0.0, 0.0, 0.18, [std::f64::consts::FRAC_PI_4, 0.0, 0.0]),
        ),
        part(Solid::Block([0.045, 0.003, 0.02]), paint, at(0.0, 0.0, 0.235)),
    ];
    Body { name: "milk", parts }
}

impl Body {
    /// Variant of the object with another size, pattern and colours.
    pub fn varied(&self, scale: f64, seed: u64) -> Body {
        let solid = |solid: Solid| match solid {
            Solid::Block(half) => Solid::Block(half.map(|v| v * scale)),
            Solid::Ball(half) => Solid::Ball(half.map(|v| v * scale)),
            Solid::Cone { low_m, high_m, height_m, wall_m } => Solid::Cone {
                low_m: low_m * scale,
                high_m: high_m * scale,
                height_m: height_m * scale,
                wall_m,
            },
            Solid::Rod { from, to, radius_m } => Solid::Rod {
                from: from.map(|v| v * scale),
                to: to.map(|v| v * scale),
                radius_m: radius_m * scale,
            },
        };
        let paint = |paint: Paint| match paint {
            Paint::Plain([r, g, b]) => Paint::Plain([g, b, r]),
            Paint::Cubes { base: [r, g, b], spread, coarse_m, fine_m, seed: own } => {
                Paint::Cubes { base: [b, r, g], spread, coarse_m, fine_m, seed: own ^ seed }
            }
        };
        let part = |p: &Part| {
            let mut place = p.here_from_part;
            place.translation.vector *= scale;
            Part { solid: solid(p.solid), paint: paint(p.paint), here_from_part: place }
        };
        Body { name: self.name, parts: self.parts.iter().map(part).collect() }
    }
}
