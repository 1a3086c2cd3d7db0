//! Call of *learning*, and the fallback when the planner finds no plan.

use std::collections::BTreeSet;

use descry_planner::{Answer, Call, CallError};

use super::news::{DIRECTIONS, Fate, Novelty};
use crate::ability::{Deed, Meaning, Reads, argument, quickest_first};
use crate::looking::looks;
use crate::situation::{Situation, holding};

/// All calls of *learning*.
pub(super) const ALL: &[Meaning] = &[Meaning {
    name: "expected-sides",
    reads: &[Reads::all("faced")],
    is_advice: false,
    about: "share of the directions around it that a look from there would show beyond those before it",
    answers: expected_sides,
}];

fn expected_sides(s: &Situation, call: &Call) -> Result<Answer, CallError> {
    let (from, what) = (argument(call, 0)?, argument(call, 1)?);
    let novelty =
        s.news().novelty(what).ok_or_else(|| CallError::Failed(format!("`{what}` is nothing new")))?;
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

/// Clause on what a view from a pose would add to the seen sides of a novel object; empty for an unknown
/// object.
pub(super) fn hope(s: &Situation, arguments: &[&str]) -> String {
    let Some(novelty) = s.news().novelty(arguments[1]) else { return String::new() };
    format!(
        "{:.0} % of its sides were seen; this shows {:.0} % more",
        100.0 * novelty.seen().len() as f64 / DIRECTIONS as f64,
        100.0 * gain(s, novelty, arguments[0], &[])
    )
}

/// Fallback when the planner finds no plan, best first: visits and useful views by travel time; if there
/// are none, modelling an open novelty, else search views.
pub(super) fn fallback(s: &Situation) -> Vec<Vec<Deed>> {
    let visits = s.news().places.iter().filter(|p| !p.is_visited).map(|p| (p.waypoint.clone(), None));
    let open = s.news().novelties.iter().filter(|n| n.fate == Fate::Open);
    let looks = open.flat_map(|n| n.open_stands(s).map(move |pose| (pose.clone(), Some(n))));
    let promising = looks.filter(|(pose, n)| n.is_some_and(|n| gain(s, n, pose, &[]) > 0.0));
    let reached = visits.chain(promising).filter_map(|(pose, of)| {
        let to = s.candidate(&pose).ok().filter(|to| s.can_drive_to(*to))?;
        let way_s = if to == s.at { 0.0 } else { s.travel_s(s.at, to) };
        let deed = match of {
            Some(novelty) => Deed::new("face", [&pose, &novelty.symbol]),
            None => Deed::new("patrol", [&pose]),
        };
        Some((way_s, deed.after_drive(s, to)))
    });
    let nearest = quickest_first(reached.collect());
    if !nearest.is_empty() {
        return nearest;
    }
    match s.news().novelties.iter().find(|n| n.fate == Fate::Open) {
        Some(ready) => vec![vec![Deed::new("model", [&ready.symbol])]],
        None => looks::look_deeds(s),
    }
}
