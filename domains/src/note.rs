//! Notes on world-model updates, for people and for the record.

use std::fmt;

use serde::{Deserialize, Serialize};

use crate::contradiction::Contradiction;
use crate::english::{self, percent};

/// News from an update of the world model.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case", tag = "event")]
pub enum Note {
    /// Views were merged and looked through.
    Perceived {
        /// Name of the surface.
        #[serde(default)]
        on: String,
        /// Number of views in the merged cloud.
        merged: usize,
        /// Views that could not be aligned.
        left_out: Vec<LeftOut>,
        /// Number of points of the merged cloud.
        points: usize,
        /// Greatest alignment residual of a merged view, metres.
        residual_m: f64,
        /// One line on each object on the surface.
        objects: Vec<String>,
        /// Changes of the belief by the last view.
        changed: Vec<BeliefChange>,
    },
    /// A surface outside the map was discovered.
    Surface {
        /// Name given to the surface.
        name: String,
        /// Centre of the observed part, map frame.
        at_m: [f64; 3],
        /// Area of the surface, square metres.
        area_m2: f64,
    },
    /// A laser sweep was taken.
    Swept {
        /// Objects on the floor, with what is known of their shapes.
        things: Vec<OnTheFloor>,
    },
    /// A view was added to the map.
    Charted {
        /// Number of walls of the map.
        walls: usize,
        /// Number of pillars and round walls.
        cylinders: usize,
        /// Total length of the walls, openings left out, metres.
        walls_m: f64,
        /// Open floor, square metres.
        open_m2: f64,
        /// Floor that is unknown and may be seen from somewhere, square metres.
        unseen_m2: f64,
        /// One line on each level supporting surface.
        surfaces: Vec<String>,
        /// Correction of the body's believed position by perception, metres.
        moved_m: f64,
        /// Correction of the body's believed heading, radians.
        turned_rad: f64,
    },
    /// A place was visited.
    Visited {
        /// Symbol of the waypoint.
        waypoint: String,
        /// Number of visits including this one; 0 if this visit could not be compared.
        visits: usize,
        /// Correction of the body's believed position by perception, metres.
        moved_m: f64,
        /// Correction of the body's believed heading, radians.
        turned_rad: f64,
        /// Reason why the visit could not be compared.
        strange: Option<String>,
        /// Texts on the objects that appeared.
        came: Vec<String>,
        /// Texts on the objects that vanished.
        gone: Vec<String>,
    },
    /// A person moved something: observations before the last view are invalid.
    Changed {
        /// The evidence.
        because: String,
    },
    /// The views so far showed no usable scene.
    Nothing {
        /// The reason.
        because: String,
        /// Advice on settings; empty if none.
        #[serde(default, skip_serializing_if = "String::is_empty")]
        advice: String,
        /// True if the view is dropped for good; otherwise, further views may make it usable.
        #[serde(default, skip_serializing_if = "std::ops::Not::not")]
        is_left_out: bool,
        /// Contradiction for which the looks are not believed, if that is the reason.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        contradiction: Option<Contradiction>,
    },
}

/// View that was not merged.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(untagged)]
pub enum LeftOut {
    /// Number of a view with the reason why it was left out.
    View {
        /// Number of the view, from 1.
        view: usize,
        /// Reason, to follow the number.
        why: String,
    },
    /// Text as recorded by earlier versions.
    Said(String),
}

impl fmt::Display for LeftOut {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            LeftOut::View { view, why } => write!(f, "view {view} {why}"),
            LeftOut::Said(text) => f.write_str(text),
        }
    }
}

/// A change of the belief.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(untagged)]
pub enum BeliefChange {
    /// Change of the confidence in an object's place.
    Confidence {
        /// Name of the object.
        of: String,
        /// Confidence before, 0 to 1.
        before: f64,
        /// Confidence after, 0 to 1.
        after: f64,
    },
    /// Text as recorded by earlier versions.
    Said(String),
}

impl fmt::Display for BeliefChange {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            BeliefChange::Confidence { of, before, after } => {
                write!(f, "confidence in {of}: {} -> {}", percent(*before), percent(*after))
            }
            BeliefChange::Said(text) => f.write_str(text),
        }
    }
}

/// Object on the floor, as seen by the laser.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(untagged)]
pub enum OnTheFloor {
    /// Shape knowledge of an object.
    Thing {
        /// Text, one line.
        text: String,
        /// True if no sweep was taken near the object.
        is_far: bool,
    },
    /// Text as recorded by earlier versions.
    Said(String),
}

impl OnTheFloor {
    /// Knowledge of the object's shape, in a line.
    pub fn text(&self) -> &str {
        match self {
            OnTheFloor::Thing { text, .. } | OnTheFloor::Said(text) => text,
        }
    }
}

impl Note {
    /// Heading word of the note.
    pub fn head(&self) -> &'static str {
        match self {
            Note::Perceived { .. } | Note::Surface { .. } | Note::Nothing { .. } => "see",
            Note::Swept { .. } => "sweep",
            Note::Charted { .. } => "map",
            Note::Visited { .. } => "visit",
            Note::Changed { .. } => "changed",
        }
    }
}

impl fmt::Display for Note {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Note::Perceived { on, merged, left_out, points, residual_m, objects, changed } => {
                // A single view is merged with nothing.
                let (views, apart) = match merged {
                    1 => ("1 view".to_string(), String::new()),
                    n => (format!("{n} views merged"), format!(", {:.1} mm apart", residual_m * 1e3)),
                };
                write!(
                    f,
                    "{on}: {views}, {points} points{apart}; {} {}",
                    objects.len(),
                    if objects.len() == 1 { "object" } else { "objects" }
                )?;
                left_out.iter().try_for_each(|view| write!(f, "\n{view}"))?;
                objects.iter().try_for_each(|text| write!(f, "\n{text}"))?;
                changed.iter().try_for_each(|change| write!(f, "\n{change}"))
            }
            Note::Surface { name, at_m, area_m2 } => {
                let at = english::position(*at_m);
                write!(f, "another surface to stand things on, the {name}: {area_m2:.2} m² at {at}")
            }
            Note::Swept { things } => {
                let all = if things.len() == 1 { "thing" } else { "things" };
                write!(f, "{} {all} on the floor", things.len())?;
                things.iter().try_for_each(|thing| write!(f, "\n{}", thing.text()))
            }
            Note::Charted {
                walls,
                cylinders,
                walls_m,
                open_m2,
                unseen_m2,
                surfaces,
                moved_m,
                turned_rad,
            } => {
                let (cm, degrees) = (1e2 * moved_m, turned_rad.to_degrees());
                let round = and_round(*cylinders);
                write!(
                    f,
                    "{walls} walls of {walls_m:.1} m{round}, {open_m2:.1} m² open, {unseen_m2:.1} m² to be seen; the body stood {cm:.1} cm and {:.1}° from where it believed",
                    degrees.abs()
                )?;
                surfaces.iter().try_for_each(|text| write!(f, "\n{text}"))
            }
            Note::Visited { waypoint, visits, moved_m, turned_rad, strange, came, gone } => {
                match (strange, *visits, came.is_empty() && gone.is_empty()) {
                    (Some(why), ..) => write!(f, "{waypoint}: not compared: {why}")?,
                    (_, 0 | 1, _) => write!(f, "{waypoint}: for the first time")?,
                    (_, n, true) => write!(f, "{waypoint}, {n} times so far: as it was")?,
                    (_, n, false) => write!(f, "{waypoint}, {n} times so far")?,
                }
                let (cm, degrees) = (1e2 * moved_m, turned_rad.to_degrees());
                write!(f, "; the body stood {cm:.1} cm and {:.1}° from where it believed", degrees.abs())?;
                came.iter().try_for_each(|text| write!(f, "\ncame: {text}"))?;
                gone.iter().try_for_each(|text| write!(f, "\ngone: {text}"))
            }
            Note::Changed { because } => write!(f, "{because}; only the last view still holds"),
            Note::Nothing { because, advice, .. } if advice.is_empty() => {
                write!(f, "nothing yet: {because}")
            }
            Note::Nothing { because, advice, .. } => write!(f, "nothing yet: {because}: {advice}"),
        }
    }
}

/// Text on pillars and round walls, appended to a number of walls; empty if there are none.
pub(crate) fn and_round(cylinders: usize) -> String {
    match cylinders {
        0 => String::new(),
        1 => ", 1 pillar or round wall".into(),
        n => format!(", {n} pillars or round walls"),
    }
}
