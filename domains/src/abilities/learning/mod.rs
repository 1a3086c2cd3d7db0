//! *learning*: revisits places, models novel objects from views all around, and recognises them
//! later (Fäulhammer et al., *Autonomous Learning of Object Models on a Mobile Robot*).

#[doc(hidden)]
pub mod again;
mod calls;
mod facts;
pub mod news;
mod stands;
#[doc(hidden)]
pub mod taken;
mod telling;

use std::sync::Arc;

use descry_perception::learning::LearnOptions;
use descry_perception::nalgebra::Unit;
use descry_robots::{Part, Place as Where};
use descry_skills::{Model, Observe, Outcome};
use news::{News, Place};

use crate::ability::{Ability, ActionKind, NOTHING_MORE, SkillWord, Trace};
use crate::error::WorldError;
use crate::eyes::Eyes;
use crate::load::Domain;
use crate::mind::Mind;
use crate::note::Note;
use crate::objective::Goal;
use crate::range::Referent;
use crate::situation::Situation;
use crate::viewpoint::Candidate;

/// Maximum range of returns used for learning, metres.
const RANGE_M: f64 = 2.5;

/// The ability *learning*.
pub const ABILITY: Ability = Ability {
    facts: facts::ALL,
    calls: calls::ALL,
    traces: &[Trace {
        name: "faced",
        types: &["pose", "novelty"],
        of: "face",
        without: "the views of a plan promise the same thing twice",
    }],
    skills: &[
        SkillWord {
            name: "patrol",
            kind: ActionKind::Sensing,
            types: &["pose"],
            about: "looks at a place from its waypoint, and compares with how it was before",
            ground: |s, arguments| {
                let place = s.news().places.iter().find(|p| p.waypoint == arguments[0]);
                let place = place.ok_or_else(|| format!("{} is no waypoint", arguments[0]))?;
                let on = s.surface(&place.on).map_err(|e| e.to_string())?;
                Ok(Box::new(Observe { at: s.surfaces[on].centre() }))
            },
            because: |s, arguments| match s.news().places.iter().find(|p| p.waypoint == arguments[0]) {
                Some(Place { room: Some(room), .. }) => match room.visits {
                    1 => "one visit is remembered".into(),
                    visits => format!("{visits} visits are remembered"),
                },
                _ => "no visit is remembered".into(),
            },
            learn: patrolled,
            failed: NOTHING_MORE,
        },
        SkillWord {
            name: "face",
            kind: ActionKind::Sensing,
            types: &["pose", "novelty"],
            about: "looks at something new from a pose around it",
            ground: |s, arguments| {
                let novelty = s.news().novelty(arguments[1]).ok_or("it is not known where that stands")?;
                Ok(Box::new(Observe { at: Some(novelty.centre) }))
            },
            because: calls::hope,
            learn: faced,
            failed: NOTHING_MORE,
        },
        SkillWord {
            name: "model",
            kind: ActionKind::Sensing,
            types: &["novelty"],
            about: "brings all looks at something new together, and learns it",
            ground: |s, arguments| Ok(Box::new(modelling(s, arguments[0])?)),
            because: |s, arguments| match s.news().novelty(arguments[0]) {
                Some(novelty) => format!("{} looks show it", novelty.looks.len()),
                None => String::new(),
            },
            learn: modelled,
            failed: NOTHING_MORE,
        },
    ],
    needs: &[Part::Camera],
    begins: Some(begins),
    fallback: Some(calls::fallback),
    answers: Some(telling::answer),
    recalls: Some(|_, past, _, states| {
        *states.get_mut() = News::of_past(past);
        None
    }),
    keeps: Some(News::keep),
    others: Some(|s| {
        let places = &s.news().places;
        let is_open = places.is_empty() || places.iter().any(|place| !place.is_visited);
        is_open.then_some(("novelty", Referent::Unseen)).into_iter().collect()
    }),
    objects: Some(|s| vec![("novelty", s.news().novelties.iter().map(|n| n.symbol.clone()).collect())]),
    names: Some(|known| known.news().things.iter().map(|thing| ("thing", thing.name.clone())).collect()),
    thing: Some(news::thing),
    again: Some(again::explain),
    ..Ability::named(
        "learning",
        "visits places, notices what is new there, looks at it from all around and learns it",
    )
};

/// At most two viewpoints of a surface, those farthest apart on its ring of `poses` candidates, so that
/// one sees the space hidden from the other.
fn waypoints(candidates: &[Candidate], surface: &str, poses: usize) -> Vec<Candidate> {
    let number = |c: &Candidate| c.symbol.strip_prefix(&format!("{surface}-"))?.parse::<usize>().ok();
    let ring: Vec<(usize, &Candidate)> = candidates.iter().filter_map(|c| Some((number(c)?, c))).collect();
    let apart = |a: usize, b: usize| {
        let steps = a.abs_diff(b);
        steps.min(poses - steps)
    };
    let pairs = ring.iter().enumerate().flat_map(|(k, a)| ring[k + 1..].iter().map(move |b| (a, b)));
    let best = pairs.fold(None, |best: Option<(usize, [&Candidate; 2])>, (a, b)| {
        let far = apart(a.0, b.0);
        if best.is_none_or(|(most, _)| far > most) { Some((far, [a.1, b.1])) } else { best }
    });
    match best {
        Some((_, pair)) => pair.into_iter().cloned().collect(),
        None => ring.first().map(|(_, only)| (*only).clone()).into_iter().collect(),
    }
}

/// Sets the places to visit in a run, each with what earlier runs know of it; nothing unless the goal
/// asks for visits.
fn begins(mind: &mut Mind, domain: &Domain, goal: &Goal) {
    if goal.asked.of_word(PATROLLED).next().is_none() {
        return;
    }
    let known = &mind.known;
    let before = known.past.as_ref().map(|p| p.remembered.visited.as_slice()).unwrap_or_default();
    let mut places = Vec::new();
    for surface in known.surfaces.iter().filter(|s| s.centre().is_some()) {
        for waypoint in waypoints(&known.candidates, &surface.symbol, domain.config.candidates.poses) {
            let is_it = |at: &[f64; 3]| match &waypoint.place {
                Where::Pose(pose) => (at[0] - pose.x_m).hypot(at[1] - pose.y_m) < SAME_PLACE_M,
                Where::Station(_) => true,
            };
            let room = before.iter().find(|v| v.waypoint == waypoint.symbol && is_it(&v.at));
            places.push(Place {
                waypoint: waypoint.symbol,
                on: surface.symbol.clone(),
                room: room.map(|v| Arc::new(v.room.clone())),
                is_visited: false,
                strange: None,
            });
        }
    }
    mind.known.news_mut().places = places;
}

/// Predicate of a visited place, used by goals that ask for visits.
const PATROLLED: &str = "patrolled";
/// Maximum distance between waypoints of two runs that count as the same, metres.
const SAME_PLACE_M: f64 = 0.02;

/// Modelling task for a novel object; the first view is the one in which the object was detected.
fn modelling(s: &Situation, what: &str) -> Result<Model, String> {
    let novelty = s.news().novelty(what).ok_or_else(|| format!("`{what}` is nothing new"))?;
    Ok(Model {
        views: novelty.looks.iter().map(|l| Arc::clone(&l.view)).collect(),
        mask: novelty.mask.to_vec(),
        up: s.robot.description().up.map(Unit::new_normalize),
        range_m: RANGE_M,
        options: LearnOptions::default(),
    })
}

fn patrolled(
    mind: &mut Mind,
    eyes: Eyes<'_>,
    _: &Situation,
    arguments: &[&str],
    outcome: &Outcome,
    notes: &mut Vec<Note>,
) -> Result<String, WorldError> {
    let Outcome::Seen(sensed) = outcome else { return Err(WorldError::strange(outcome)) };
    notes.push(taken::visit(mind, eyes, arguments[0], sensed)?);
    Ok(String::new())
}

fn faced(
    mind: &mut Mind,
    eyes: Eyes<'_>,
    _: &Situation,
    arguments: &[&str],
    outcome: &Outcome,
    _: &mut Vec<Note>,
) -> Result<String, WorldError> {
    let Outcome::Seen(sensed) = outcome else { return Err(WorldError::strange(outcome)) };
    taken::face(mind, eyes, arguments[0], arguments[1], sensed)
}

fn modelled(
    mind: &mut Mind,
    _: Eyes<'_>,
    _: &Situation,
    arguments: &[&str],
    outcome: &Outcome,
    _: &mut Vec<Note>,
) -> Result<String, WorldError> {
    let Outcome::Modelled(modelled) = outcome else { return Err(WorldError::strange(outcome)) };
    taken::learned(mind, arguments[0], modelled)
}
