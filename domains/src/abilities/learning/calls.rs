//! The call that *learning* answers, and what is done where the planner finds no plan.

use std::collections::BTreeSet;

use descry_planner::{Answer, Call, CallError, Plan};

use super::news::{DIRECTIONS, Fate, Novelty};
use crate::abilities::searching::reasons;
use crate::abilities::{Meaning, Reads, argument, one_after_another};
use crate::situation::{Situation, holding};

/// Every call.
pub(super) const ALL: &[Meaning] = &[Meaning {
    name: "expected-sides",
    reads: &[Reads::all("faced")],
    about: "share of the directions around it that a look from there would show beyond those before it",
    answers: expected_sides,
}];

/// What a visit, a look and a model take, as in the domain, seconds.
const PATROL_S: f64 = 2.0;
const FACE_S: f64 = 1.5;
const MODEL_S: f64 = 1.0;

fn expected_sides(s: &Situation, call: &Call) -> Result<Answer, CallError> {
    let (from, what) = (argument(call, 0)?, argument(call, 1)?);
    let novelty =
        s.news.novelty(what).ok_or_else(|| CallError::Failed(format!("`{what}` is nothing new")))?;
    let before: Vec<&str> = holding(call, "faced")
        .filter(|r| r.arguments.get(1).is_some_and(|of| **of == *what))
        .filter_map(|r| r.arguments.first().map(|pose| &**pose))
        .collect();
    Ok(Answer::Number(gain(s, novelty, from, &before)))
}

fn gain(s: &Situation, novelty: &Novelty, from: &str, before: &[&str]) -> f64 {
    let mut seen = novelty.seen();
    seen.extend(before.iter().flat_map(|pose| novelty.shown_from(s, pose)));
    let fresh: BTreeSet<usize> =
        novelty.shown_from(s, from).into_iter().filter(|d| !seen.contains(d)).collect();
    fresh.len() as f64 / DIRECTIONS as f64
}

/// Why it is looked at from there.
pub(super) fn hope(s: &Situation, arguments: &[&str]) -> String {
    let Some(novelty) = s.news.novelty(arguments[1]) else { return String::new() };
    format!(
        "{:.0} % of its sides were seen; this shows {:.0} % more",
        100.0 * novelty.seen().len() as f64 / DIRECTIONS as f64,
        100.0 * gain(s, novelty, arguments[0], &[])
    )
}

/// The quickest of the visits and looks that promise anything; a look that searches where none is asked for.
pub(super) fn fallback(s: &Situation) -> Option<Plan> {
    let symbol = |n: usize| s.candidates[n].symbol.clone();
    let visits = s.news.places.iter().filter(|p| !p.is_visited).map(|p| (p.waypoint.clone(), "patrol", None));
    let open = s.news.novelties.iter().filter(|n| n.fate == Fate::Open);
    let looks = open.flat_map(|n| n.open_stands(s).map(move |pose| (pose.clone(), "face", Some(n))));
    let promising = looks.filter(|(pose, _, n)| n.is_some_and(|n| gain(s, n, pose, &[]) > 0.0));
    let reached = visits.chain(promising).filter_map(|(pose, what, of)| {
        let to = s.candidate(&pose).ok().filter(|to| s.can_drive_to(*to))?;
        let way_s = if to == s.at { 0.0 } else { s.travel_s(s.at, to) };
        Some((way_s, to, what, of.map(|n| n.symbol.clone())))
    });
    let nearest = reached.min_by(|a, b| a.0.total_cmp(&b.0));
    let Some((way_s, to, what, of)) = nearest else {
        let ready = s.news.novelties.iter().find(|n| n.fate == Fate::Open);
        return match ready {
            Some(n) => Some(one_after_another(&[("model", vec![n.symbol.clone()], MODEL_S)])),
            None => reasons::one_look(s),
        };
    };
    let takes_s = if of.is_some() { FACE_S } else { PATROL_S };
    let both = [
        ("move", vec![symbol(s.at), symbol(to)], way_s),
        (what, std::iter::once(symbol(to)).chain(of).collect(), takes_s),
    ];
    Some(one_after_another(if to == s.at { &both[1..] } else { &both }))
}
