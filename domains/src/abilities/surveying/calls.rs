//! Calls of *surveying*, and the fallback when the planner finds no plan.

use descry_perception::mapping::Unseen;
use descry_planner::{Answer, Call, CallError};

use super::CHART;
use super::chart::{LOOK_S, NOTHING_SEEN_M2};
use crate::ability::{Deed, Meaning, Reads, argument, best_first};
use crate::looking::looks;
use crate::situation::{Situation, holding};

/// All calls of *surveying*.
pub(super) const ALL: &[Meaning] = &[
    Meaning {
        name: "expected-view",
        reads: &[Reads::all("charted")],
        is_advice: false,
        about: "unknown floor that a look from there is expected to show beyond those before it, square metres",
        answers: expected_view,
    },
    Meaning {
        name: "expected-discovery",
        reads: &[Reads::all("charted")],
        is_advice: false,
        about: "by how much it would raise the confidence in a thing if that stood on what is not known yet",
        answers: expected_discovery,
    },
    Meaning {
        name: "expected-discoveries",
        reads: &[Reads::all("charted")],
        is_advice: false,
        about: "by how much it would raise the certainty of having found all of a kind if more stood on what is not known yet",
        answers: expected_discoveries,
    },
];

fn expected_view(s: &Situation, call: &Call) -> Result<Answer, CallError> {
    gain_m2(s, call).map(Answer::Number)
}

/// Expected gain of confidence in a thing from floor that a view would newly show: the confidence that
/// is missing, times that floor's share of all unknown visible floor.
fn expected_discovery(s: &Situation, call: &Call) -> Result<Answer, CallError> {
    let what = s.thing(argument(call, 1)?)?;
    Ok(Answer::Number((1.0 - s.confidence(what)) * share_shown(s, call)?))
}

/// Expected gain of completeness of a kind from floor that a view would newly show.
fn expected_discoveries(s: &Situation, call: &Call) -> Result<Answer, CallError> {
    let of = s.kind(argument(call, 1)?)?;
    Ok(Answer::Number((1.0 - s.completeness(of)) * share_shown(s, call)?))
}

fn share_shown(s: &Situation, call: &Call) -> Result<f64, CallError> {
    let all_m2 = s.chart().unseen_m2();
    Ok(if all_m2 > 0.0 { (gain_m2(s, call)? / all_m2).min(1.0) } else { 0.0 })
}

fn gain_m2(s: &Situation, call: &Call) -> Result<f64, CallError> {
    let from = argument(call, 0)?;
    if s.chart().map.is_none() {
        return Ok(if from == s.candidates[s.at].symbol { NOTHING_SEEN_M2 } else { 0.0 });
    }
    let Some(look) = s.chart().outlook(from) else { return Ok(0.0) };
    let mut unseen = Unseen::default();
    for earlier in holding(call, "charted").filter_map(|r| s.chart().outlook(r.arguments.first()?)) {
        unseen.look(earlier);
    }
    Ok(unseen.gain_m2(look))
}

/// Clause on the unknown floor that a view from a pose would show.
pub(super) fn hope(s: &Situation, arguments: &[&str]) -> String {
    match s.chart().outlook(arguments[0]) {
        Some(look) => format!(
            "{:.1} m² of floor that is unknown may be seen from there, of {:.1}",
            Unseen::default().gain_m2(look),
            s.chart().unseen_m2()
        ),
        None => "nothing was seen yet".into(),
    }
}

/// Fallback when the planner finds no plan: mapping views, those with the most unknown floor per second
/// first; if there are none, views of surfaces.
pub(super) fn fallback(s: &Situation) -> Vec<Vec<Deed>> {
    let rate = |(symbol, look): &(String, descry_perception::mapping::Outlook)| {
        let to = s.candidate(symbol).ok().filter(|to| s.can_drive_to(*to))?;
        let way_s = if to == s.at { 0.0 } else { s.travel_s(s.at, to) };
        Some((
            Unseen::default().gain_m2(look) / (way_s + LOOK_S),
            Deed::new(CHART, [symbol]).after_drive(s, to),
        ))
    };
    let all = best_first(s.chart().open.iter().filter_map(rate).collect());
    if all.is_empty() { looks::look_deeds(s) } else { all }
}
