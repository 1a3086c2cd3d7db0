//! Final answer for goals about the map alone.

use crate::conclusion::{Conclusion, Ended, Verdict};
use crate::mind::Mind;
use crate::note::and_round;
use crate::objective::Goal;
use crate::situation::Situation;

/// Answers a goal about the map alone; `None` for other goals.
pub(super) fn answer(_: &Goal, mind: &Mind, s: &Situation, ended: &Ended) -> Option<Conclusion> {
    if !(s.things.is_empty() && s.kinds.is_empty() && s.asked.is_empty()) {
        return None;
    }
    let chart = s.chart();
    let (walls, cylinders) = chart.map.as_ref().map_or((0, 0), |m| (m.walls.len(), m.cylinders.len()));
    let known = format!(
        "{:.1} m² of open floor, {walls} walls{} and {} surfaces, after {} looks and {:.1} m",
        chart.open_m2(),
        and_round(cylinders),
        chart.surfaces.len(),
        mind.views,
        mind.distance_m
    );
    let left = format!("{:.1} m² that may be floor are left", chart.unseen_m2());
    let (verdict, why) = match ended {
        Ended::Reached => (Verdict::Achieved, format!("the room is mapped: {known}")),
        Ended::Limit(why) => {
            (Verdict::CannotTell, format!("the room is not mapped whole: {why}; {known}; {left}"))
        }
        Ended::Failed(why) => (Verdict::Failed, format!("{why}; {known}; {left}")),
        Ended::NoPlan(_) | Ended::Undecided(_) => {
            let because = match s.time_left_s {
                Some(_) => "nothing that is left to be seen can be reached in the time that is left",
                None => "nothing that is left to be seen can be reached",
            };
            (Verdict::CannotTell, format!("the room is not mapped whole: {because}; {known}; {left}"))
        }
    };
    Some(Conclusion {
        confidence: f64::from(u8::from(verdict == Verdict::Achieved)),
        verdict,
        why,
        remaining: None,
        object: None,
        found: None,
        objects: Vec::new(),
        remembered: None,
    })
}
