//! Scoring of runs against the ground truth: achievement of the goal, and truth of the answer.

use descry_agent::report::Report;
use descry_domains::conclusion::Verdict;
use descry_robots::truth::{TrueObject, Truth};
use serde::Deserialize;
use serde_json::json;

use super::GoalText;
use crate::job::Row;
use crate::kinds::trial::{Lived, is_among};

/// Criterion by which a goal is truly achieved.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub(super) enum Truly {
    /// The answer states the target's position: on the right surface, within the tolerance.
    Found,
    /// The answer states the position of every target in the room (or anywhere), and of nothing else.
    AllFound,
    /// The answer to a yes-no question is true: the target stands on the surface, or does not.
    Answered,
    /// The target is in the hand.
    Held,
    /// The target stands on the surface.
    Stands,
    /// All targets stand on the surface.
    AllStand,
}

impl Truly {
    /// True if the criterion is about a surface, which the goal must then name.
    pub fn needs_surface(self) -> bool {
        matches!(self, Self::Answered | Self::Stands | Self::AllStand)
    }
}

/// Row of measurements of one run, with a column for each stage of the goal.
pub(super) fn row(goal: &GoalText, tolerance_m: f64, present: bool, lived: &Lived) -> Row {
    let Lived { report, truth, carried, .. } = lived;
    let scored = Scored::of(goal, tolerance_m, report, truth);
    let near = scored.error_m.filter(|_| report.verdict == Verdict::Achieved);
    let value = json!({
        "present": present,
        "verdict": report.verdict,
        "right": scored.right,
        "false_yes": scored.false_yes,
        "false_not_there": scored.false_not_there,
        "views": report.views,
        "metres": report.distance_m,
        "seconds": report.sim_time_s,
        "replans": report.replans,
        "position_error_m": near,
        "on": report.on,
        "true_on": report.true_on,
        "mishaps": truth.events.len(),
        "arrangement": lived.arrangement,
        "why": report.why,
    });
    let mut row = value.as_object().cloned().unwrap_or_default();
    for stage in &goal.stages {
        row.insert(format!("{stage} done"), json!(carried.get(stage).is_some_and(|n| *n > 0)));
    }
    row
}

/// Comparison of the verdict of a run with the truth.
#[derive(Debug, PartialEq)]
pub(super) struct Scored {
    /// True if the verdict is right: achieved and said so, or impossible and said so.
    pub right: bool,
    /// True if the verdict is a yes that is false.
    pub false_yes: bool,
    /// True if the target is said to be absent (or the condition false), wrongly.
    pub false_not_there: bool,
    /// Maximum distance of the objects from their stated positions, metres; `None` unless all are within
    /// the tolerance.
    pub error_m: Option<f64>,
}

impl Scored {
    pub fn of(goal: &GoalText, tolerance_m: f64, report: &Report, truth: &Truth) -> Self {
        let is_target =
            |o: &&TrueObject| is_among(o, &goal.targets) && (goal.room.is_none() || o.room == goal.room);
        let targets: Vec<&TrueObject> = truth.objects.iter().filter(is_target).collect();
        let stands = |o: &&TrueObject| o.surface.is_some() && o.surface == goal.surface;
        let (yes, no) = (report.verdict == Verdict::Achieved, report.verdict == Verdict::NotFound);
        let named = named(report);
        let nearest = |place: &Place| {
            let distances = targets.iter().filter_map(|o| distance_m(place, o));
            distances.reduce(f64::min).filter(|d| *d <= tolerance_m)
        };
        let errors: Option<Vec<f64>> = named.iter().map(nearest).collect();
        let is_named =
            |o: &&TrueObject| named.iter().any(|p| distance_m(p, o).is_some_and(|d| d <= tolerance_m));
        // Whether it is so as it was said, and whether it could be so at all.
        let so = match goal.truly {
            Truly::Found => !named.is_empty() && errors.is_some(),
            Truly::AllFound => errors.is_some() && targets.iter().all(is_named),
            Truly::Answered | Truly::Stands => targets.iter().any(stands),
            Truly::Held => targets.iter().any(|o| o.in_hand),
            Truly::AllStand => targets.iter().all(stands),
        };
        let could_be = if goal.truly == Truly::Answered { so } else { !targets.is_empty() };
        Self {
            right: if could_be { yes && so } else { no },
            false_yes: yes && !(so && could_be),
            false_not_there: no && could_be,
            error_m: errors.and_then(|errors| errors.into_iter().reduce(f64::max)),
        }
    }
}

/// Stated position of an object: centre of its body in the map frame, metres, and name of its surface.
type Place = ([f64; 3], Option<String>);

/// Positions that the report states for the targets.
fn named(report: &Report) -> Vec<Place> {
    match report.object {
        Some(_) => report.position_m.map(|at| (at, report.on.clone())).into_iter().collect(),
        None => {
            let asked = report.objects.iter().filter(|o| o.asked);
            asked.filter_map(|o| Some((o.position_m?, o.on.clone()))).collect()
        }
    }
}

/// Distance of an object from a position along the floor, metres; `None` if the object stands on another
/// surface.
fn distance_m((at, on): &Place, object: &TrueObject) -> Option<f64> {
    (object.surface == *on).then(|| (object.centre_m.x - at[0]).hypot(object.centre_m.y - at[1]))
}
