//! Ranking of views by the doubt that they would settle.

use std::collections::BTreeSet;
use std::sync::OnceLock;

use descry_planner::{Plan, Step};

use crate::ability::{Deed, OBSERVE, best_first};
use crate::belief::doubt::{Doubt, Taken};
use crate::situation::{Situation, cells};

/// Assumed duration of a view, seconds, as in the domain.
pub(crate) const LOOK_S: f64 = 2.0;

/// Useful views (candidate, surface) that fit into the remaining time, by settled doubt per second, best
/// first.
pub fn looks(s: &Situation) -> Vec<(usize, usize)> {
    // Where all of a kind are wanted, what else is in doubt of each of them is not asked about.
    let is_open = |&of: &usize| s.completeness(of) < s.wanted_of(of);
    let kinds: Vec<&Doubt> = (0..s.kinds.len()).filter(is_open).map(|of| s.doubt_of(of)).collect();
    let doubts = if kinds.is_empty() { s.doubts() } else { kinds };
    let takes_s = |from: usize| s.travel_s(s.at, from) + LOOK_S;
    let is_in_time = |from: usize| s.time_left_s.is_none_or(|left_s| takes_s(from) <= left_s);
    let open = s
        .all_looks()
        .into_iter()
        .filter(|&(from, on)| !s.observed.contains(&(from, on)) && s.can_drive_to(from) && is_in_time(from));
    let settles = |look: (usize, usize)| -> f64 {
        doubts.iter().map(|doubt| doubt.settled(s, look, Taken::default())).sum()
    };
    let rated = open.map(|look| (look, settles(look)));
    let worth = rated.filter(|(_, settles)| *settles >= s.thresholds.remaining);
    best_first(worth.map(|(look, settles)| (settles / takes_s(look.0), look)).collect())
}

/// Useful views as sequences of drive and view, best first.
pub(crate) fn look_deeds(s: &Situation) -> Vec<Vec<Deed>> {
    looks(s).into_iter().map(|(from, on)| look(s, from, on).after_drive(s, from)).collect()
}

/// Skill that views a surface from a candidate.
pub(crate) fn look(s: &Situation, from: usize, on: usize) -> Deed {
    Deed::new(OBSERVE, [s.candidates[from].symbol.as_str(), s.surfaces[on].symbol.as_str()])
}

/// Concatenation of two plans; the second starts when the first has ended.
pub fn one_then(mut first: Plan, second: Plan) -> Plan {
    let ends_s = first.makespan_s().unwrap_or(0.0);
    let later = |step: Step| Step { start_s: step.start_s.map(|start_s| start_s + ends_s), ..step };
    first.steps.extend(second.steps.into_iter().map(later));
    Plan { cost: None, ..first }
}

impl Situation {
    /// Time to drive to a surface and view it, as if all doors were open, seconds. The drive starts at
    /// the place of the last view, so that the value stays constant while the body moves.
    pub fn going_there_s(&self, on: usize) -> f64 {
        let kept: &GoingThere = self.derived.get(&|| GoingThere(cells(self.surfaces.len())));
        *kept.0[on].get_or_init(|| {
            let to = self.viewers(on).iter().copied().filter(|&n| !self.observed.contains(&(n, on)));
            let way_s = |n| match n == self.looked_from {
                true => 0.0,
                false => self.travel_past_s(self.looked_from, n, &BTreeSet::new()),
            };
            let way_s = to.map(way_s).filter(|s| s.is_finite()).reduce(f64::min);
            LOOK_S + way_s.unwrap_or_default()
        })
    }
}

/// Cache of the times to go to each surface and view it, seconds.
struct GoingThere(Vec<OnceLock<f64>>);
