//! *searching*: viewpoints, views of surfaces, the doubt about objects and how much of it a view
//! settles, and pushing obstacles aside.

mod calls;
mod facts;
pub mod policies;

pub use calls::FirstLook;
use descry_robots::{Answer, Part, Request};
use descry_skills::{Ask, Observe, Outcome, SkillFailure};

use crate::ability::{Ability, ActionKind, OBSERVE, SkillWord, Trace};
use crate::belief::doubt::{Doubt, Taken};
use crate::belief::obstacle;
use crate::english::{percent, plural, the};
use crate::error::WorldError;
use crate::eyes::Eyes;
use crate::looking::{perceive, recording};
use crate::mind::Mind;
use crate::note::Note;
use crate::range::Referent;
use crate::situation::Situation;

/// PDDL type of sought objects.
const THING: &str = "thing";
/// PDDL type of the surfaces that objects stand on.
const SURFACE: &str = "surface";

/// The ability *searching*.
pub const ABILITY: Ability = Ability {
    facts: facts::ALL,
    calls: calls::ALL,
    traces: &[
        Trace {
            name: "observed",
            types: &["pose", "surface"],
            of: OBSERVE,
            without: "the looks of a plan promise the same thing twice, and a look in vain is taken again",
        },
        Trace { name: "pushed", types: &["obstacle"], of: "push-aside", without: "nothing is pushed aside" },
    ],
    skills: &[
        SkillWord {
            name: OBSERVE,
            kind: ActionKind::Sensing,
            types: &["pose", "surface"],
            about: "turns to the surface, takes a view, believes what all its views show",
            ground: |s, arguments| {
                let on = s.surface(arguments[1]).map_err(|e| e.to_string())?;
                Ok(Box::new(Observe { at: s.surfaces[on].centre() }))
            },
            because: |s, arguments| match (s.candidate(arguments[0]), s.surface(arguments[1])) {
                (Ok(from), Ok(on)) => hope(s, from, on),
                _ => String::new(),
            },
            learn: seen,
            failed: |_, _, _, _, _| Ok(None),
        },
        SkillWord {
            name: "push-aside",
            kind: ActionKind::Changing,
            types: &["pose", "obstacle"],
            about: "pushes an object aside, so that what is behind it can be seen",
            ground: |s, arguments| {
                let from = s.candidate(arguments[0]).map_err(|e| e.to_string())?;
                let what = s.obstacle(arguments[1]).map_err(|e| e.to_string())?;
                let push = obstacle::push(s, from, &s.obstacles()[what]);
                Ok(Box::new(Ask(Request::PushAside(push.ok_or("the arm does not reach it")?))))
            },
            because: |s, arguments| match s.obstacle(arguments[1]) {
                Ok(what) => {
                    let [x, y, z] = s.obstacles()[what].at.into();
                    format!("no look can settle what is left; it hides it, at ({x:.2}, {y:.2}, {z:.2}) m")
                }
                Err(_) => String::new(),
            },
            learn: pushed,
            failed: push_failed,
        },
    ],
    needs: &[Part::Camera],
    objects: Some(|s| vec![("obstacle", s.obstacles().iter().map(|o| o.symbol.clone()).collect())]),
    others: Some(others),
    ..Ability::named(
        "searching",
        "looks for things on surfaces until it is sure, pushes aside what hides them",
    )
};

/// Objects beyond those of the problem: seen ones that nobody asked for, an unseen thing and, for a body
/// without a map, an unseen surface.
fn others(s: &Situation) -> Vec<(&'static str, Referent<'_>)> {
    let seen = s.strangers().map(|track| (THING, Referent::Seen(track)));
    let unmapped = s.robot.surfaces().is_empty().then_some((SURFACE, Referent::Unseen));
    seen.chain([(THING, Referent::Unseen)]).chain(unmapped).collect()
}

/// Handles a view of a surface: records it and updates the belief from all views of that surface.
fn seen(
    mind: &mut Mind,
    eyes: Eyes<'_>,
    s: &Situation,
    arguments: &[&str],
    outcome: &Outcome,
    notes: &mut Vec<Note>,
) -> Result<String, WorldError> {
    let Outcome::Seen(sensed) = outcome else { return Err(WorldError::strange(outcome)) };
    let on = mind.known.surfaces.iter().position(|s| s.symbol == arguments[1]);
    let on = on.ok_or_else(|| WorldError::Bug(format!("`{}` is no surface", arguments[1])))?;
    // Without a map a view is one of every surface in it.
    let at = mind.known.at;
    let is_mapped = |n: usize| s.surfaces[n].whole || s.own_map.has(&s.surfaces[n].symbol);
    let is_shown = |&n: &usize| n == on || !is_mapped(on) && !is_mapped(n) && s.sees(at, n);
    let shown: Vec<usize> = (0..s.surfaces.len()).filter(is_shown).collect();
    recording::view(mind, eyes, &shown, sensed)?;
    let here = mind.known.candidates[at].symbol.clone();
    let shown: Vec<String> = shown.into_iter().map(|n| s.surfaces[n].symbol.clone()).collect();
    for surface in &shown {
        mind.words.set("observed", vec![here.clone(), surface.clone()], Some(1.0));
    }
    mind.attend();
    for surface in shown {
        // Of those without a map two may turn out to be one.
        if let Some(n) = mind.known.surfaces.iter().position(|s| s.symbol == surface) {
            perceive::perceive(mind, eyes, n, notes)?;
        }
    }
    Ok(String::new())
}

fn pushed(
    mind: &mut Mind,
    eyes: Eyes<'_>,
    situation: &Situation,
    arguments: &[&str],
    outcome: &Outcome,
    _: &mut Vec<Note>,
) -> Result<String, WorldError> {
    let Some(Answer::Pushed(pushed)) = outcome.answer() else { return Err(WorldError::strange(outcome)) };
    perceive::pushed(mind, eyes, situation, arguments[1], pushed.moved_m)?;
    Ok(format!("the hand moved {:.2} m with it", pushed.moved_m))
}

/// Handles a failed push: the object may have moved nevertheless, and the same push is not tried again
/// from there.
fn push_failed(
    mind: &mut Mind,
    eyes: Eyes<'_>,
    situation: &Situation,
    arguments: &[&str],
    failure: &SkillFailure,
) -> Result<Option<String>, WorldError> {
    let obstacle = situation.obstacle(arguments[1]).map(|n| situation.obstacles()[n].track);
    mind.known.stuck.extend(obstacle.ok().map(|track| (track, situation.at)));
    let moved_m = match failure {
        SkillFailure::Body(descry_robots::Failure::Slipped { moved_m, .. }) => *moved_m,
        _ => 0.0,
    };
    perceive::pushed(mind, eyes, situation, arguments[1], moved_m)?;
    Ok(Some(format!("{} is not pushed from there again", arguments[1])))
}

/// Clause on the doubt that a view from a candidate would settle.
fn hope(s: &Situation, from: usize, on: usize) -> String {
    let own = s.things.iter().enumerate().filter(|(_, t)| t.track.is_none());
    let own = own.map(|(what, t)| (the(&t.name), s.doubt_about(what)));
    let kinds = s.kinds.iter().enumerate().map(|(of, kind)| (plural(&kind.name), s.doubt_of(of)));
    let surface = |on: usize| (format!("what is on the {}", s.surfaces[on].name), s.doubt_on(on));
    let mut doubts: Vec<(String, &Doubt)> =
        own.chain(kinds).chain(s.asked.iter().map(|&on| surface(on))).collect();
    if doubts.is_empty() {
        doubts = (0..s.surfaces.len()).map(surface).collect();
    }
    let said = |(name, doubt): (String, &Doubt)| {
        if doubt.anywhere {
            return format!("nothing is known yet of where {name} could be");
        }
        let share = doubt.share_settled(s, (from, on), Taken::default());
        format!("would settle {} of the doubt about {name}", percent(share))
    };
    doubts.into_iter().map(said).collect::<Vec<_>>().join(", ")
}
