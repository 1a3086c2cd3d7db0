//! *pouring*: empties the vessel in the hand into another one. Needs *searching* for the vessels' places,
//! and something that brings a vessel into the hand, such as *carrying*.

mod contents;

use descry_planner::{Call, CallError};
use descry_robots::{Answer, Failure, Part, Pouring, Request};
use descry_skills::{Ask, Outcome, SkillFailure};

use self::contents::{Contents, Litres, capacity_l};
use crate::ability::{Ability, ActionKind, Fact, Meaning, SkillWord, argument};
use crate::error::WorldError;
use crate::eyes::Eyes;
use crate::known::Thing;
use crate::mind::Mind;
use crate::note::Note;
use crate::range::{Range, Referent};
use crate::situation::Situation;

/// The ability *pouring*.
pub const ABILITY: Ability = Ability {
    facts: &[
        Fact {
            name: "filled",
            types: &["thing"],
            about: "there is surely something in the thing: this run or a recent one poured it",
            states: |s| {
                let filled = s.things.iter().filter(|thing| Contents::of(s, thing).least > 0.0);
                filled.map(|thing| format!("(filled {})", thing.symbol)).collect()
            },
            bounds: Some(is_filled),
        },
        Fact {
            name: "level",
            types: &["thing"],
            about: "litres in the thing, where they are known",
            states: |s| {
                let known = |thing: &Thing| match Contents::of(s, thing) {
                    Litres { least, most } if most == Some(least) => Some((thing.symbol.clone(), least)),
                    _ => None,
                };
                let known = s.things.iter().filter_map(known);
                known.map(|(symbol, litres)| format!("(= (level {symbol}) {litres})")).collect()
            },
            bounds: Some(litres),
        },
    ],
    calls: &[Meaning {
        name: "can-pour",
        reads: &[],
        is_advice: false,
        about: "whether the hand reaches over the second thing from there, and what is surely in both has room in it",
        answers: can_pour,
    }],
    skills: &[SkillWord {
        name: "pour",
        kind: ActionKind::Changing,
        types: &["pose", "thing", "thing", "surface"],
        about: "pours all that is in the thing in the hand into another one, which stands on the surface",
        ground: |s, arguments| {
            let into = s.standing(arguments[2], arguments[3]).ok_or("it is not known where that stands")?;
            let over = s.as_localised(&s.on_axis(into, 1.0));
            Ok(Box::new(Ask(Request::Pour(Pouring { over }))))
        },
        because: |s, arguments| {
            let [what, into] = [1, 2].map(|n| s.thing_name(arguments[n]));
            format!("what is in {what} is to be in {into}")
        },
        learn: poured,
        failed: not_poured,
    }],
    needs: &[Part::Hand],
    recalls: Some(|_, past, _, states| {
        Contents::recall(past, states);
        None
    }),
    begins: Some(|mind, _, _| Contents::assign(mind)),
    keeps: Some(Contents::keep),
    ..Ability::named(
        "pouring",
        "pours what is in the held vessel into another one, and remembers what is in which",
    )
};

/// Range of the content of a referent.
fn content(s: &Situation, of: &[Referent<'_>]) -> Litres {
    let named = |name: &str| s.thing(name).map(|n| Contents::of(s, &s.things[n]));
    match of {
        [Referent::Named(name)] => named(name).unwrap_or_default(),
        [Referent::Seen(track)] => Contents::of(s, &Thing { track: Some(track.id), ..Thing::default() }),
        _ => Litres::default(),
    }
}

/// Bounds on `(filled ?thing)`: no look shows what is in a vessel.
fn is_filled(s: &Situation, of: &[Referent<'_>]) -> Range {
    match content(s, of) {
        Litres { least, .. } if least > 0.0 => Range::exactly(1.0),
        Litres { most: Some(0.0), .. } => Range::exactly(0.0),
        _ => Range::UNKNOWN,
    }
}

/// Bounds on `(level ?thing)`, litres.
fn litres(s: &Situation, of: &[Referent<'_>]) -> Range {
    match content(s, of) {
        Litres { least, most: Some(most) } => Range { believed: least, least, greatest: most, sure: 1.0 },
        Litres { least, most: None } => Range { least, ..Range::UNDEFINED },
    }
}

/// Answers `[can-pour ?from ?what ?into ?on]`; a vessel not found yet is assumed to be at the centre of the
/// surface.
fn can_pour(s: &Situation, call: &Call) -> Result<descry_planner::Answer, CallError> {
    let (from, on) = (s.candidate(argument(call, 0)?)?, s.surface(argument(call, 3)?)?);
    let [what, into] = [s.thing(argument(call, 1)?)?, s.thing(argument(call, 2)?)?].map(|n| &s.things[n]);
    let needed_l = Contents::of(s, what).least + Contents::of(s, into).least;
    let has_room = capacity_l(into).is_none_or(|most_l| most_l > 0.0 && needed_l <= most_l);
    let over = s.standing(&into.symbol, &s.surfaces[on].symbol).map(|track| s.on_axis(track, 1.0));
    let over = over.or_else(|| s.surfaces[on].centre());
    let can = s.robot.description().has(Part::Hand) && has_room && over.is_some_and(|p| s.reaches(from, &p));
    Ok(descry_planner::Answer::Truth(can))
}

/// Sets the contents of both vessels, as they follow from what was in them before.
fn set_contents(mind: &mut Mind, s: &Situation, arguments: &[&str], [what_l, into_l]: [Litres; 2]) {
    let vessels =
        [(s.in_hand(), arguments[1], what_l), (s.standing(arguments[2], arguments[3]), arguments[2], into_l)];
    for (track, thing, litres) in vessels {
        if let Some(track) = track {
            Contents::set(mind, track, s.thing_name(thing), litres);
        }
    }
}

fn poured(
    mind: &mut Mind,
    _: Eyes<'_>,
    s: &Situation,
    arguments: &[&str],
    outcome: &Outcome,
    _: &mut Vec<Note>,
) -> Result<String, WorldError> {
    let Some(Answer::Poured(poured)) = outcome.answer() else { return Err(WorldError::strange(outcome)) };
    let before = content(s, &[Referent::Named(arguments[2])]);
    set_contents(mind, s, arguments, [Litres::exactly(0.0), before.with(poured.litres)]);
    Ok(format!("{:.2} l went over", poured.litres))
}

/// Handles a failed pour: unless nothing was poured, it is not known any more what is in either vessel.
fn not_poured(
    mind: &mut Mind,
    _: Eyes<'_>,
    s: &Situation,
    arguments: &[&str],
    failure: &SkillFailure,
) -> Result<Option<String>, WorldError> {
    let SkillFailure::Body(failure) = failure else { return Ok(None) };
    let not_begun =
        matches!(failure, Failure::Unable { .. } | Failure::Unreachable { .. } | Failure::Blocked { .. });
    if !not_begun {
        set_contents(mind, s, arguments, [Litres::default(); 2]);
    }
    Ok(None)
}
