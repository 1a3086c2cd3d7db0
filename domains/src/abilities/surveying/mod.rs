//! *surveying*: a body without a map builds one, view by view (Viejo and Cazorla, *Construcción de
//! mapas 3D y extracción de primitivas geométricas del entorno*): walls, surfaces and open floor,
//! on which routes are planned.

mod calls;
pub mod chart;
mod facts;
#[doc(hidden)]
pub mod ground;
mod picture;
mod taken;
mod telling;

use std::sync::Arc;

use descry_robots::nalgebra::Point3;
use descry_robots::{Part, Place};
use descry_skills::{Observe, Outcome};

use crate::ability::{Ability, ActionKind, NOTHING_MORE, SkillWord, Trace};
use crate::error::WorldError;
use crate::eyes::Eyes;
use crate::load::Domain;
use crate::mind::Mind;
use crate::note::Note;
use crate::objective::Goal;
use crate::situation::Situation;

/// Target of a mapping view, metres ahead and metres high, so that the floor near the body and walls up
/// to a man's height are visible.
const AHEAD_M: (f64, f64) = (3.0, 0.35);

/// Skill that takes a view for the map.
const CHART: &str = "chart";

/// The ability *surveying*.
pub const ABILITY: Ability = Ability {
    facts: facts::ALL,
    calls: calls::ALL,
    traces: &[Trace {
        name: "charted",
        types: &["pose"],
        of: "chart",
        without: "the views of a plan promise the same thing twice",
    }],
    skills: &[SkillWord {
        name: CHART,
        kind: ActionKind::Sensing,
        types: &["pose"],
        about: "looks straight ahead, and takes what it sees into the map",
        ground: |s, _| Ok(Box::new(Observe { at: ahead(s) })),
        because: calls::hope,
        learn: charted,
        failed: NOTHING_MORE,
    }],
    needs: &[Part::Camera],
    begins: Some(begins),
    fallback: Some(calls::fallback),
    answers: Some(telling::answer),
    recalls: Some(chart::recall),
    keeps: Some(|known, _, later| later.surveyed = known.chart().kept().or(later.surveyed.take())),
    has_driven: Some(ground::has_driven),
    drive_failed: Some(ground::drive_failed),
    ..Ability::named(
        chart::NAME,
        "maps the room that it is in: walls, surfaces and open floor, and drives on that map",
    )
};

/// Finds exploration poses at the beginning of a run with a map from an earlier run.
fn begins(mind: &mut Mind, _: &Domain, _: &Goal) {
    let robot = Arc::clone(&mind.known.robot);
    taken::look_out(mind, &*robot, "");
}

/// Target point of a mapping view, map frame; `None` at a station.
fn ahead(s: &Situation) -> Option<Point3<f64>> {
    let Place::Pose(pose) = &s.candidates[s.at].place else { return None };
    let (ahead_m, height_m) = AHEAD_M;
    let (sin, cos) = pose.yaw_rad.sin_cos();
    Some(Point3::new(pose.x_m + ahead_m * cos, pose.y_m + ahead_m * sin, height_m))
}

/// Handles a mapping view: adds it to the map.
fn charted(
    mind: &mut Mind,
    eyes: Eyes<'_>,
    _: &Situation,
    arguments: &[&str],
    outcome: &Outcome,
    notes: &mut Vec<Note>,
) -> Result<String, WorldError> {
    let Outcome::Seen(sensed) = outcome else { return Err(WorldError::strange(outcome)) };
    notes.push(taken::take(mind, eyes, arguments[0], sensed)?);
    Ok(String::new())
}
