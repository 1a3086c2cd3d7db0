//! *carrying*: picks up one object and puts it down on free space. Needs *searching* for the
//! objects' places.

mod spot;

use std::sync::Arc;

use descry_memory::belief::Track;
use descry_perception::nalgebra::Point3;
use descry_planner::{Call, CallError};
use descry_robots::{Answer, Failure, Grasp, Part, Placing};
use descry_skills::{Outcome, PickUp, PutDown, SkillFailure};

use crate::ability::{Ability, ActionKind, Deed, Fact, Meaning, SkillWord, argument, quickest_first};
use crate::arm;
use crate::error::WorldError;
use crate::eyes::Eyes;
use crate::known::Held;
use crate::looking::change::Change;
use crate::looking::{looks, perceive};
use crate::mind::Mind;
use crate::note::Note;
use crate::range::{Range, Referent};
use crate::situation::Situation;

/// Margin around the picked-up object within which the hand may touch its neighbours, metres.
const TOUCHED_M: f64 = 0.03;
/// Radius around the original place within which an object that slipped out of the hand may lie,
/// metres.
const SLIPPED_M: f64 = 0.15;

/// Skill that puts down the held object.
const PUT_DOWN: &str = "put-down";

/// The ability *carrying*.
pub const ABILITY: Ability = Ability {
    facts: &[
        Fact {
            name: "holding",
            types: &["thing"],
            about: "the thing is in the hand",
            states: holding,
            bounds: Some(is_in_hand),
        },
        Fact {
            name: "hand-free",
            types: &[],
            about: "nothing is in the hand",
            states: hand_free,
            bounds: None,
        },
    ],
    calls: &[
        Meaning {
            name: "can-grasp",
            reads: &[],
            is_advice: false,
            about: "whether the hand reaches the thing from there and is wide enough for it",
            answers: can_grasp,
        },
        Meaning {
            name: "can-put",
            reads: &[],
            is_advice: false,
            about: "whether the hand reaches a place on the surface from there that is free as far as is known",
            answers: can_put,
        },
    ],
    skills: &[
        SkillWord {
            name: "pick-up",
            kind: ActionKind::Changing,
            types: &["pose", "thing", "surface"],
            about: "takes the thing into the hand and lifts it",
            ground: |s, arguments| {
                let track =
                    s.standing(arguments[1], arguments[2]).ok_or("it is not known where that stands")?;
                let object = s.as_localised(&s.on_axis(track, 0.5));
                let grasp = Grasp { object, width_m: track.size_m[0].min(track.size_m[1]) };
                Ok(Box::new(PickUp { grasp }))
            },
            because: |s, arguments| format!("{} is to be elsewhere", s.thing_name(arguments[1])),
            learn: picked_up,
            failed: pick_up_failed,
        },
        SkillWord {
            name: PUT_DOWN,
            kind: ActionKind::Changing,
            types: &["pose", "thing", "surface"],
            about: "puts what is in the hand down where there is room on the surface",
            ground: |s, arguments| {
                let foot = s.as_localised(&place(s, arguments)?);
                Ok(Box::new(PutDown { placing: Placing { foot } }))
            },
            because: |s, arguments| {
                let on = s.surface(arguments[2]).map_or(arguments[2], |on| &s.surfaces[on].name);
                format!("{} is to be on the {on}", s.thing_name(arguments[1]))
            },
            learn: put_down,
            failed: put_down_failed,
        },
    ],
    needs: &[Part::Hand],
    fallback: Some(fallback),
    ..Ability::named("carrying", "takes one thing into the hand and puts it down elsewhere")
};

/// Fallback: the view with the highest gain per second; a held object is first put down where that
/// is quickest.
fn fallback(s: &Situation) -> Vec<Vec<Deed>> {
    let Some(track) = s.in_hand() else { return looks::look_deeds(s) };
    let Some(thing) = s.things.iter().find(|thing| s.is_taken_for(thing, track)) else { return Vec::new() };
    let poses = (0..s.candidates.len()).filter(|&from| s.can_drive_to(from));
    let spots = poses.flat_map(|from| (0..s.surfaces.len()).map(move |on| (from, on)));
    let free = spots.filter(|&(from, on)| spot::free(s, from, on, spot::USUAL_RADIUS_M, true).is_some());
    let deed = |(from, on): (usize, usize)| {
        let (from_symbol, on) = (&s.candidates[from].symbol, &s.surfaces[on].symbol);
        Deed::new(PUT_DOWN, [from_symbol, &thing.symbol, on]).after_drive(s, from)
    };
    quickest_first(free.map(|spot| (s.travel_s(s.at, spot.0), deed(spot))).collect())
}

/// States `(holding ?thing)` for every thing that the object in the hand is taken for.
fn holding(s: &Situation) -> Vec<String> {
    let Some(track) = s.in_hand() else { return Vec::new() };
    let held = s.things.iter().filter(|thing| s.is_taken_for(thing, track));
    held.map(|thing| format!("(holding {})", thing.symbol)).collect()
}

/// Bounds on `(holding ?thing)`: exactly 1 or 0, since the object in the hand is always a known one.
fn is_in_hand(s: &Situation, of: &[Referent<'_>]) -> Range {
    let is_it = |track: &Track| match of {
        [Referent::Named(name)] => s.things.iter().any(|t| t.symbol == **name && s.is_taken_for(t, track)),
        [Referent::Seen(seen)] => seen.id == track.id,
        _ => false,
    };
    Range::exactly(f64::from(u8::from(s.in_hand().is_some_and(is_it))))
}

/// States `(hand-free)` while nothing is held, also for a body without a hand, which can still look;
/// `[can-grasp]` excludes picking up.
fn hand_free(s: &Situation) -> Vec<String> {
    if s.held.is_none() { vec!["(hand-free)".into()] } else { Vec::new() }
}

/// Answers `[can-grasp ?from ?what ?on]`; an object not found yet is assumed to be at the centre of the
/// surface.
fn can_grasp(s: &Situation, call: &Call) -> Result<descry_planner::Answer, CallError> {
    let from = s.candidate(argument(call, 0)?)?;
    let body = s.robot.description();
    let within = |p: Point3<f64>| s.reaches(from, &p);
    let can = match s.standing(argument(call, 1)?, argument(call, 2)?) {
        Some(track) => {
            let width_m = track.size_m[0].min(track.size_m[1]);
            within(s.on_axis(track, 0.5)) && body.hand().is_some_and(|hand| width_m <= hand.opening_m)
        }
        None => {
            let on = s.surface(argument(call, 2)?)?;
            body.has(Part::Hand) && s.surfaces[on].centre().is_some_and(within)
        }
    };
    Ok(descry_planner::Answer::Truth(can))
}

/// Answers `[can-put ?from ?on]`; space that was not observed counts as free.
fn can_put(s: &Situation, call: &Call) -> Result<descry_planner::Answer, CallError> {
    let (from, on) = (s.candidate(argument(call, 0)?)?, s.surface(argument(call, 1)?)?);
    Ok(descry_planner::Answer::Truth(spot::free(s, from, on, spot::USUAL_RADIUS_M, true).is_some()))
}

/// Position at which the held object is put down, map frame; an error if no observed free space is
/// within reach.
fn place(s: &Situation, arguments: &[&str]) -> Result<Point3<f64>, String> {
    let from = s.candidate(arguments[0]).map_err(|e| e.to_string())?;
    let on = s.surface(arguments[2]).map_err(|e| e.to_string())?;
    let radius_m = s.in_hand().map_or(spot::USUAL_RADIUS_M, |t| 0.5 * t.size_m[0].max(t.size_m[1]));
    spot::free(s, from, on, radius_m, false)
        .ok_or_else(|| format!("there is no free place within reach on {}", arguments[2]))
}

/// Invalidates the observed space around an object's place, up to `more_m` metres and the localisation
/// error beyond the object.
fn void(mind: &mut Mind, eyes: Eyes<'_>, track: &Track, more_m: f64) -> Result<(), WorldError> {
    let Some(on) = mind.known.surfaces.iter().position(|k| k.symbol == track.on) else { return Ok(()) };
    let body = eyes.robot.description();
    let change = Change {
        stamp_ns: eyes.robot.now_ns(),
        foot: track.position_m,
        up: mind.known.surfaces[on].up,
        // Where the hand was, and where a view was taken from, localisation says.
        radius_m: 0.5 * track.size_m[0].max(track.size_m[1]) + more_m + arm::astray_m(body),
        height_m: track.size_m[2] + TOUCHED_M,
    };
    perceive::something_moved(mind, eyes.record, on, change)
}

fn picked_up(
    mind: &mut Mind,
    eyes: Eyes<'_>,
    s: &Situation,
    arguments: &[&str],
    outcome: &Outcome,
    _: &mut Vec<Note>,
) -> Result<String, WorldError> {
    let Outcome::Grasped(grasped, _) = outcome else { return Err(WorldError::strange(outcome)) };
    let track = s.standing(arguments[1], arguments[2]).cloned();
    let track = track.ok_or_else(|| WorldError::Bug(format!("`{}` was taken from nowhere", arguments[1])))?;
    void(mind, eyes, &track, TOUCHED_M)?;
    let belief = Arc::make_mut(&mut mind.known.belief);
    belief.tracks.iter_mut().filter(|t| t.id == track.id).for_each(|t| t.on = String::new());
    mind.known.held = Some(Held { track: track.id });
    Ok(format!("the hand is closed to {:.3} m around it", grasped.width_m))
}

/// Handles a failed pick-up: a grasp that slipped may have moved the object, so its place is forgotten.
fn pick_up_failed(
    mind: &mut Mind,
    eyes: Eyes<'_>,
    s: &Situation,
    arguments: &[&str],
    failure: &SkillFailure,
) -> Result<Option<String>, WorldError> {
    if let (SkillFailure::Body(Failure::Slipped { .. }), Some(track)) =
        (failure, s.standing(arguments[1], arguments[2]))
    {
        void(mind, eyes, track, SLIPPED_M)?;
        // Where it stands now, the next look will say.
        Arc::make_mut(&mut mind.known.belief).mislay(track.id);
    }
    Ok(None)
}

fn put_down(
    mind: &mut Mind,
    eyes: Eyes<'_>,
    s: &Situation,
    arguments: &[&str],
    outcome: &Outcome,
    _: &mut Vec<Note>,
) -> Result<String, WorldError> {
    let Some(Answer::Placed(placed)) = outcome.answer() else { return Err(WorldError::strange(outcome)) };
    let foot = place(s, arguments).map_err(WorldError::Bug)?;
    if let Some(held) = mind.known.held.take() {
        let belief = Arc::make_mut(&mut mind.known.belief);
        let found = belief.tracks.iter_mut().find(|t| t.id == held.track);
        let moved = found.map(|t| {
            (t.on, t.position_m) = (arguments[2].to_string(), foot);
            t.clone()
        });
        if let Some(track) = moved {
            void(mind, eyes, &track, TOUCHED_M)?;
        }
    }
    Ok(format!(
        "it was put down at ({:.2}, {:.2}, {:.2}) m in {:.1} s",
        foot.x, foot.y, foot.z, placed.duration_s
    ))
}

/// Handles a failed put-down: an object that slipped from the hand counts as lost.
fn put_down_failed(
    mind: &mut Mind,
    _: Eyes<'_>,
    _: &Situation,
    _: &[&str],
    failure: &SkillFailure,
) -> Result<Option<String>, WorldError> {
    if let (SkillFailure::Body(Failure::Slipped { .. }), Some(held)) = (failure, mind.known.held.clone()) {
        mind.known.held = None;
        Arc::make_mut(&mut mind.known.belief).mislay(held.track);
        return Ok(Some("what it held was lost".into()));
    }
    Ok(None)
}
