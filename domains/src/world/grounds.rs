//! Parts of a world and its rounds: places, things, priors and recalled objects.

use descry_memory::belief::Belief;
use descry_robots::{PoseEstimate, Robot};

use crate::abilities;
use crate::error::WorldError;
use crate::known::{self, Known, KnownDoor, Thing};
use crate::lexicon::{Lexicon, Named};
use crate::load::Domain;
use crate::objective::Goal;
use crate::past::Past;
use crate::situation::Situation;
use crate::states::States;
use crate::surface::KnownSurface;
use crate::symbol::{SENSE, symbol};
use crate::viewpoint::Candidate;

/// Maximum probability of a remembered object, as a share of the required confidence.
const RECALLED: f64 = 0.9;
/// Distances from a door at which the body may open it, metres, in order of preference.
const BEFORE_DOOR_M: [f64; 4] = [0.8, 0.9, 0.7, 1.0];

/// Objects of the problem, by type.
pub(super) fn objects(s: &Situation, lexicon: &Lexicon, domain: &Domain) -> Vec<(String, Vec<String>)> {
    let mut objects: Vec<(String, Vec<String>)> = vec![
        ("pose".into(), s.candidates.iter().map(|c| c.symbol.clone()).collect()),
        ("surface".into(), s.surfaces.iter().map(|k| k.symbol.clone()).collect()),
        ("thing".into(), s.things.iter().map(|t| t.symbol.clone()).collect()),
        ("kind".into(), s.kinds.iter().map(|t| t.symbol.clone()).collect()),
    ];
    let own = abilities::ALL.iter().filter_map(|ability| ability.objects).flat_map(|objects| objects(s));
    objects.extend(own.map(|(of, symbols)| (of.to_string(), symbols)));
    objects.extend([
        ("door".into(), s.doors.iter().map(|d| d.symbol.clone()).collect()),
        (SENSE.into(), lexicon.of_type(SENSE).iter().map(|n| n.symbol.clone()).collect()),
        ("room".into(), lexicon.of_type("room").iter().map(|n| n.symbol.clone()).collect()),
    ]);
    for (of, names) in &domain.config.objects {
        objects.push((of.clone(), names.iter().map(|n| symbol(n)).collect()));
    }
    objects
}

/// Requested things, each restricted to the surfaces of its places.
pub(super) fn things(
    domain: &Domain,
    goal: &Goal,
    states: &States,
    rooms: &[Named],
    surfaces: &[KnownSurface],
) -> Result<Vec<Thing>, WorldError> {
    let of = |(name, on): &(String, Option<Vec<String>>)| {
        let on = on.as_ref().map(|places| places_of(places, rooms, surfaces)).transpose()?;
        Ok(Thing { on, ..asked_for(domain, states, name)? })
    };
    goal.asked.things.iter().map(of).collect()
}

/// Requested thing: one of the domain's objects or kinds, or a learned object.
fn asked_for(domain: &Domain, states: &States, name: &str) -> Result<Thing, WorldError> {
    let known = known::thing(domain, name);
    let learned = abilities::ALL.iter().filter_map(|ability| ability.thing).find_map(|of| of(states, name));
    match learned {
        None => Ok(known),
        Some(learned) if known.models.is_empty() => Ok(learned),
        Some(_) => Err(WorldError::Domain(format!(
            "\"{name}\" is an object of the domain {}, and something that was learned is called so\n  give that another name: descry name STORE \"{name}\" \"…\"",
            domain.config.name
        ))),
    }
}

/// Remembered objects of earlier runs at their last places, with probability below certainty, so
/// that they are looked at again.
pub(super) fn recalled(past: Option<&Past>, goal: &Goal, surfaces: &[KnownSurface]) -> Belief {
    let mut belief = Belief::default();
    if let Some(past) = past {
        let aged = past.remembered.aged(past.now_unix_s, RECALLED * goal.threshold);
        belief.adopt(aged.into_iter().filter(|t| surfaces.iter().any(|s| s.symbol == t.on)));
    }
    belief
}

/// Indices of the surfaces named directly or by their rooms.
fn places_of(
    places: &[String],
    rooms: &[Named],
    surfaces: &[KnownSurface],
) -> Result<Vec<usize>, WorldError> {
    let mut on = Vec::new();
    for place in places {
        let is_there =
            |n: &usize| surfaces[*n].symbol == *place || surfaces[*n].is_in(std::slice::from_ref(place));
        let there: Vec<usize> = (0..surfaces.len()).filter(is_there).collect();
        if there.is_empty() && rooms.iter().all(|room| room.symbol != *place) {
            return Err(no_surface(place, surfaces));
        }
        on.extend(there.into_iter().filter(|n| !on.contains(n)).collect::<Vec<_>>());
    }
    Ok(on)
}

/// Kinds requested completely, each restricted to the surfaces of its rooms.
pub(super) fn kinds(domain: &Domain, goal: &Goal, surfaces: &[KnownSurface]) -> Vec<Thing> {
    let of = |(kind, rooms): &(String, Option<Vec<String>>)| {
        let of_rooms =
            |rooms: &Vec<String>| (0..surfaces.len()).filter(|&n| surfaces[n].is_in(rooms)).collect();
        let on = rooms.as_ref().map(of_rooms);
        Thing { on, ..known::thing(domain, kind) }
    };
    goal.asked.kinds.iter().map(of).collect()
}

/// Seen objects that may belong to a requested kind, as things of their own.
pub(super) fn members(known: &Known) -> Vec<Thing> {
    let of = |kind: &Thing| -> Vec<Thing> {
        let is = |t: &&descry_memory::belief::Track| t.probability_of(&kind.name) > 0.5;
        let member = |t: &descry_memory::belief::Track| Thing {
            symbol: format!("{}-{}", kind.symbol, t.id),
            track: Some(t.id),
            ..kind.clone()
        };
        known.belief.tracks.iter().filter(is).map(member).collect()
    };
    known.kinds.iter().flat_map(of).collect()
}

/// Prior weight of each thing, then of each kind, on each surface, relative to other places.
pub(super) fn expected(domain: &Domain, known: &Known) -> Vec<Vec<f64>> {
    let weight = |what: &Thing, on: usize| -> f64 {
        let surface = &known.surfaces[on];
        let is_it = |e: &&crate::config::Expectation| {
            let there = symbol(&e.at) == surface.symbol
                || surface.room.as_ref().is_some_and(|r| symbol(r) == symbol(&e.at));
            let kinds =
                || what.models.iter().any(|m| e.what.as_ref().is_some_and(|w| symbol(w) == symbol(&m.kind)));
            there && e.what.as_ref().is_none_or(|w| symbol(w) == what.symbol || kinds())
        };
        domain.config.expect.iter().filter(is_it).map(|e| e.weight).product()
    };
    let surfaces = 0..known.surfaces.len();
    known
        .things
        .iter()
        .chain(&known.kinds)
        .map(|what| surfaces.clone().map(|on| weight(what, on)).collect())
        .collect()
}

/// Checks that the surfaces named by the domain are known to the body, and that a body without a map has
/// one surface only.
pub(super) fn known_by_map(domain: &Domain, surfaces: &[KnownSurface]) -> Result<(), WorldError> {
    if let [first, second, ..] = surfaces
        && surfaces.iter().all(|s| !s.whole)
    {
        return Err(WorldError::Domain(format!(
            "nothing tells the {} from the {} here: the body has no map of them\n  name one surface in domain.toml, or say where each is: [[surface]] in the recording's recording.toml",
            first.name, second.name
        )));
    }
    domain.config.surfaces.iter().try_for_each(|name| {
        match surfaces.iter().any(|s| s.symbol == symbol(name)) {
            true => Ok(()),
            false => Err(no_surface(name, surfaces)),
        }
    })
}

pub(super) fn no_surface(name: &str, surfaces: &[KnownSurface]) -> WorldError {
    let known: Vec<&str> = surfaces.iter().map(|s| s.name.as_str()).collect();
    let known = if known.is_empty() { "none".into() } else { known.join(", ") };
    WorldError::Domain(format!(
        "there is no surface \"{name}\" here\n  the map has: {known}\n  name one of these, or give the scene a [[surface]] of that name"
    ))
}

/// Doors of the map; adds poses on both sides of each to the candidates.
pub(super) fn doors(robot: &dyn Robot, here: &PoseEstimate, poses: &mut Vec<Candidate>) -> Vec<KnownDoor> {
    let mut known = Vec::new();
    for door in robot.doors() {
        let symbol = symbol(&door.name);
        let across = descry_perception::nalgebra::Vector2::new(-door.along_rad.sin(), door.along_rad.cos());
        for (side, sign) in [(1, 1.0), (2, -1.0)] {
            let tries: Vec<descry_robots::Place> = BEFORE_DOOR_M
                .iter()
                .map(|d| {
                    let at = door.centre_m + across * (sign * d);
                    descry_robots::Place::Pose(descry_robots::Pose2::facing(at.x, at.y, &door.centre_m))
                })
                .collect();
            let fits = robot.travel(&here.place(), &tries, &[]).iter().position(Result::is_ok);
            poses.extend(
                fits.map(|n| Candidate { symbol: format!("{symbol}-side-{side}"), place: tries[n].clone() }),
            );
        }
        known.push(KnownDoor { symbol, door: door.clone() });
    }
    known
}
