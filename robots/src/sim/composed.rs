//! Objects composed of several solids, painted with patterns: household objects other than cups and boxes.

use crate::sim::shape::{Primitive, Shape};
use nalgebra::{Isometry3, Point3, Translation3, UnitQuaternion, Vector3};
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use std::sync::LazyLock;

/// Several solids as one rigid object.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Composed {
    /// Solids of the object; where they overlap, only the outer surface is visible.
    pub parts: Vec<Piece>,
}

/// One of the solids of a composed object.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Piece {
    /// Shape of the piece, with the origin at the centre of its base.
    pub shape: Shape,
    /// Position of the shape's origin in the frame of the object, metres.
    #[serde(default)]
    pub at_m: [f64; 3],
    /// Rotation of the shape about the object's x, then y, then z axis, degrees.
    #[serde(default)]
    pub turn_deg: [f64; 3],
    /// Red, green, blue; the colour of the object if left out.
    #[serde(default)]
    pub colour: Option<[u8; 3]>,
    /// Printed pattern; plain if left out.
    #[serde(default)]
    pub pattern: Option<Pattern>,
}

/// Random patches of colour around the base colour.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Pattern {
    /// Side of the larger patches, metres; the sides of the smaller ones are two fifths of that.
    pub size_m: f64,
    /// Scale of the deviation of red, green and blue from the base colour, of 255.
    pub spread: f64,
    /// Seed of the pattern.
    #[serde(default)]
    pub seed: u64,
}

/// Colour and pattern of a part.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Paint {
    /// Red, green, blue.
    pub colour: [u8; 3],
    /// Printed pattern.
    pub pattern: Option<Pattern>,
}

/// Weight of the larger patches in the deviation from the base colour.
const LARGER: f64 = 0.7;
/// Side of the smaller patches, relative to the larger ones.
const SMALLER: f64 = 0.5;
const SMALLER_SIDE: f64 = 0.4;

impl Paint {
    /// Colour at a point in the frame of the solid.
    pub fn at(&self, p: &Point3<f64>) -> [u8; 3] {
        let Some(pattern) = self.pattern else { return self.colour };
        let larger = patch(p, pattern.size_m, pattern.seed);
        let smaller = patch(p, SMALLER_SIDE * pattern.size_m, !pattern.seed);
        std::array::from_fn(|k| {
            let off = LARGER * larger[k] + SMALLER * smaller[0];
            (f64::from(self.colour[k]) + pattern.spread * off).clamp(4.0, 250.0) as u8
        })
    }
}

/// Three random values from -1 to 1 that are equal for all points in one cube of side `size_m`.
fn patch(p: &Point3<f64>, size_m: f64, seed: u64) -> [f64; 3] {
    let cell = |key: u64, c: f64| super::noise::mix(key ^ ((c / size_m + 0.37).floor() as i64 as u64));
    let key = p.iter().fold(super::noise::mix(seed), |key, c| cell(key, *c));
    [1, 2, 3].map(|k: u64| 2.0 * super::noise::share(super::noise::mix(key ^ k)) - 1.0)
}

impl Piece {
    fn thing_from_piece(&self) -> Isometry3<f64> {
        let [x, y, z] = self.turn_deg.map(f64::to_radians);
        Isometry3::from_parts(
            Translation3::from(Vector3::from(self.at_m)),
            UnitQuaternion::from_euler_angles(x, y, z),
        )
    }

    /// Minimum and maximum corner of the bounding box in the object's frame, metres.
    fn bounds(&self) -> (Point3<f64>, Point3<f64>) {
        let thing_from_piece = self.thing_from_piece();
        let (low, high) = self.shape.bounds();
        let (middle, half) = (nalgebra::center(&low, &high), 0.5 * (high - low));
        let turn = thing_from_piece.rotation.to_rotation_matrix().into_inner();
        let reach = match &self.shape {
            // How far an ellipsoid reaches along an axis.
            Shape::Ball(_) => Vector3::from_fn(|k, _| turn.row(k).transpose().component_mul(&half).norm()),
            _ => turn.abs() * half,
        };
        let middle = thing_from_piece * middle;
        (middle - reach, middle + reach)
    }
}

impl Composed {
    /// Minimum and maximum corner of the bounding box in the object's frame, metres.
    pub fn bounds(&self) -> (Point3<f64>, Point3<f64>) {
        let all = self.parts.iter().map(Piece::bounds);
        all.reduce(|(low, high), (l, h)| (low.inf(&l), high.sup(&h))).unwrap_or_default()
    }

    /// Radius of a cylinder around the object's z axis that contains the object, metres.
    pub fn radius_m(&self) -> f64 {
        let reach = |(low, high): (Point3<f64>, Point3<f64>)| {
            low.x.abs().max(high.x.abs()).hypot(low.y.abs().max(high.y.abs()))
        };
        self.parts.iter().map(|piece| reach(piece.bounds())).fold(0.0, f64::max)
    }

    /// Copies the object, scaled by a factor.
    pub fn scaled(&self, factor: f64) -> Composed {
        let piece = |p: &Piece| Piece {
            shape: p.shape.scaled(factor),
            at_m: p.at_m.map(|m| m * factor),
            ..p.clone()
        };
        Composed { parts: self.parts.iter().map(piece).collect() }
    }

    /// Surfaces for ray casting, with their colours; `colour` is for pieces without one.
    pub fn painted(&self, colour: [u8; 3]) -> Vec<(Primitive, Paint)> {
        let of = |piece: &Piece| -> Vec<(Primitive, Paint)> {
            let own = piece.colour.unwrap_or(colour);
            let piece_from_thing = piece.thing_from_piece().inverse();
            let turned = |(part, paint): (Primitive, Paint)| {
                let pattern = piece.pattern.or(paint.pattern);
                (part.turned(piece_from_thing), Paint { pattern, ..paint })
            };
            piece.shape.painted(own).into_iter().map(turned).collect()
        };
        self.parts.iter().flat_map(of).collect()
    }
}

/// Rigid household objects by name, in the format of scene files.
pub static HOUSEHOLD: LazyLock<BTreeMap<String, Composed>> =
    LazyLock::new(|| toml::from_str(include_str!("household.toml")).unwrap_or_default());

/// Names of the household objects.
pub fn household() -> impl Iterator<Item = &'static str> {
    HOUSEHOLD.keys().map(String::as_str)
}

/// Household object of this name, if there is one.
pub(crate) fn named(name: &str) -> Option<&'static Composed> {
    HOUSEHOLD.get(name)
}
