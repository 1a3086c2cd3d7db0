//! Description of a known object, as read from an object file.

use super::colour::{self, Colour};
use serde::{Deserialize, Serialize};

/// Least and greatest value of a measure. Reads from one number or from `[low, high]`.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(from = "NumberOrPair")]
pub struct Range {
    /// Least value.
    pub low: f64,
    /// Greatest value.
    pub high: f64,
}

#[derive(Deserialize)]
#[serde(untagged, expecting = "a number, or [least, greatest]")]
enum NumberOrPair {
    Number(f64),
    Pair([f64; 2]),
}

impl From<NumberOrPair> for Range {
    fn from(value: NumberOrPair) -> Range {
        match value {
            NumberOrPair::Number(x) => Range { low: x, high: x },
            NumberOrPair::Pair([low, high]) => Range { low, high },
        }
    }
}

impl Range {
    /// The middle of the range.
    pub fn middle(&self) -> f64 {
        0.5 * (self.low + self.high)
    }
}

/// The form of the body.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Shape {
    /// A solid or vessel of revolution about its upright axis; `diameter_m` is its greatest diameter.
    #[default]
    Round,
    /// A cuboid; `width_m` is the longer and `depth_m` the shorter side of its footprint.
    Box,
}

/// Kind of upper end of the upright object.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Top {
    /// A rim with an inside behind it.
    Open,
    /// A lid or a solid face.
    Closed,
    /// Either.
    #[default]
    Any,
}

/// Presence of a handle at the object's side.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Handle {
    /// It has none.
    None,
    /// It has one.
    One,
    /// Some have, some have not.
    #[default]
    Any,
}

/// A known object ("cup A") or a kind of objects ("mug"): one file of a domain's `objects/`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ObjectModel {
    /// What it is called; unique among the models given to a recogniser.
    pub name: String,
    /// The kind it belongs to ("cup").
    pub kind: String,
    /// Further words for it in a goal.
    #[serde(default)]
    pub phrases: Vec<String>,
    /// Form of the body.
    #[serde(default)]
    pub shape: Shape,
    /// Height of the upright object, metres.
    pub height_m: Range,
    /// Greatest diameter of a round body without its handle, metres.
    #[serde(default)]
    pub diameter_m: Option<Range>,
    /// Longer side of a box's footprint, metres.
    #[serde(default)]
    pub width_m: Option<Range>,
    /// Shorter side of a box's footprint, metres.
    #[serde(default)]
    pub depth_m: Option<Range>,
    /// Diameter at the base over diameter at the top of a round body; 1 is a cylinder.
    #[serde(default = "any_taper")]
    pub taper: Range,
    /// Open or closed at the top.
    #[serde(default)]
    pub top: Top,
    /// Handle or none.
    #[serde(default)]
    pub handle: Handle,
    /// Colours of the body; any if left out. One may be given as `colour`.
    #[serde(default, alias = "colour", deserialize_with = "colour::one_or_more")]
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub colours: Vec<Colour>,
}

impl ObjectModel {
    /// Width, depth and height of a box; `None` for other shapes.
    pub(super) fn box_sides_m(&self) -> Option<[Range; 3]> {
        let (width, depth) = self.width_m.zip(self.depth_m).filter(|_| self.shape == Shape::Box)?;
        Some([width, depth, self.height_m])
    }

    /// Models of a box on its other sides; empty if the object is open at the top, has a handle or
    /// is no box.
    pub(super) fn on_other_sides(&self) -> Vec<ObjectModel> {
        let sides = self.box_sides_m().filter(|_| self.top != Top::Open && self.handle != Handle::One);
        let Some([width, depth, height]) = sides else { return Vec::new() };
        let turned = |(up, one, other): (Range, Range, Range)| {
            let (width, depth) = if one.middle() < other.middle() { (other, one) } else { (one, other) };
            ObjectModel { height_m: up, width_m: Some(width), depth_m: Some(depth), ..self.clone() }
        };
        [(width, height, depth), (depth, height, width)].map(turned).into()
    }
}

/// Maximum length that is not a mistake, metres. From: chosen.
const LONGEST_M: f64 = 5.0;
/// Maximum taper that is not a mistake. From: chosen.
const WIDEST_TAPER: f64 = 10.0;

/// Range of tapers of a model that states none. From: chosen.
fn any_taper() -> Range {
    Range { low: 0.7, high: 1.05 }
}

/// Reason an object model is invalid.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum ModelError {
    /// A measure that the shape needs is not given.
    #[error("object `{object}`: a {shape} needs `{field}`; give a number of metres or [least, greatest]")]
    Missing {
        /// Name of the object.
        object: String,
        /// Its shape.
        shape: &'static str,
        /// The field that is missing.
        field: &'static str,
    },
    /// A range that holds no sensible value.
    #[error("object `{object}`: `{field}` = [{low}, {high}] holds no {expected}; write [least, greatest]")]
    Range {
        /// Name of the object.
        object: String,
        /// Name of the field.
        field: &'static str,
        /// Least value that was given.
        low: f64,
        /// Greatest value that was given.
        high: f64,
        /// What was expected, with its unit.
        expected: &'static str,
    },
    /// Two models of one name.
    #[error("two objects are called `{object}`: names are what goals speak of, give each its own")]
    Twice {
        /// Name that both models have.
        object: String,
    },
}

impl ObjectModel {
    /// Checks that the ranges are sensible and that the shape has its measures.
    pub fn check(&self) -> Result<(), ModelError> {
        let needed: &[(&'static str, Option<Range>)] = match self.shape {
            Shape::Round => &[("diameter_m", self.diameter_m)],
            Shape::Box => &[("width_m", self.width_m), ("depth_m", self.depth_m)],
        };
        let shape = match self.shape {
            Shape::Round => "round body",
            Shape::Box => "box",
        };
        for &(field, given) in needed {
            let Some(range) = given else {
                return Err(ModelError::Missing { object: self.name.clone(), shape, field });
            };
            self.check_range(field, range, LONGEST_M, "length in metres between 0 and 5 (not millimetres)")?;
        }
        self.check_range(
            "height_m",
            self.height_m,
            LONGEST_M,
            "length in metres between 0 and 5 (not millimetres)",
        )?;
        self.check_range("taper", self.taper, WIDEST_TAPER, "ratio of base to top diameter between 0 and 10")
    }

    fn check_range(
        &self,
        field: &'static str,
        r: Range,
        most: f64,
        expected: &'static str,
    ) -> Result<(), ModelError> {
        let sensible = r.low > 0.0 && r.low <= r.high && r.high <= most;
        let (object, low, high) = (self.name.clone(), r.low, r.high);
        if sensible { Ok(()) } else { Err(ModelError::Range { object, field, low, high, expected }) }
    }
}

/// Checks each model and that no two share a name.
pub fn check_models(models: &[ObjectModel]) -> Result<(), ModelError> {
    for (i, model) in models.iter().enumerate() {
        model.check()?;
        if models[..i].iter().any(|m| m.name == model.name) {
            return Err(ModelError::Twice { object: model.name.clone() });
        }
    }
    Ok(())
}
