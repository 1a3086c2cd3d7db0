//! *shapes*: a laser detects objects on the floor, models them from scans all around and recognises
//! them (Modayil and Kuipers, *Autonomous Shape Model Learning for Object Localization and
//! Recognition*).

mod calls;
mod facts;
pub mod floor;
mod poses;
mod taken;
mod telling;
#[doc(hidden)]
pub mod unseen;

use std::sync::Arc;

use descry_perception::laser::{KnownShape, Verdict};
use descry_robots::{Answer, Part, Request};
use descry_skills::{Align, Ask, Circle, Outcome};
use floor::{Floor, Outline, thing};
use unseen::UnseenFloor;

use crate::ability::{Ability, ActionKind, NOTHING_MORE, SkillWord, Trace};
use crate::drive;
use crate::english::percent;
use crate::error::WorldError;
use crate::eyes::Eyes;
use crate::load::Domain;
use crate::mind::Mind;
use crate::note::Note;
use crate::objective::{Goal, VARIABLE};
use crate::range::Referent;
use crate::situation::Situation;
use crate::slots::type_of_slot;
use crate::symbol::symbol;

/// The ability *shapes*.
pub const ABILITY: Ability = Ability {
    facts: facts::ALL,
    calls: calls::ALL,
    traces: &[Trace {
        name: "scanned",
        types: &["pose"],
        of: "scan",
        without: "the sweeps of a plan promise the same thing twice",
    }],
    skills: &[
        SkillWord {
            name: "scan",
            kind: ActionKind::Sensing,
            types: &["pose", "spot"],
            about: "sweeps the laser from a pose around it",
            ground: |_, _| Ok(Box::new(Ask(Request::Scan))),
            because: calls::hope_of_scan,
            learn: scanned,
            failed: NOTHING_MORE,
        },
        SkillWord {
            name: "survey",
            kind: ActionKind::Sensing,
            types: &["pose"],
            about: "sweeps the laser over floor that was not seen yet",
            ground: |_, _| Ok(Box::new(Ask(Request::Scan))),
            because: |s, _| match s.floor().room.len() {
                1 => "there is one place left where it may stand".into(),
                places => format!("there are {places} places left where it may stand"),
            },
            learn: scanned,
            failed: NOTHING_MORE,
        },
        SkillWord {
            name: "circle",
            kind: ActionKind::Moving,
            types: &["pose", "pose", "spot"],
            about: "drives around it from one pose to another",
            ground: |s, arguments| Ok(Box::new(Circle { way: way(s, arguments)? })),
            because: |s, arguments| match way(s, arguments) {
                Ok(way) if way.len() == 1 => format!("around {}, by one of the poses there", arguments[2]),
                Ok(way) => format!("around {}, by {} of the poses there", arguments[2], way.len()),
                Err(because) => because,
            },
            learn: drive::has_driven,
            failed: NOTHING_MORE,
        },
        SkillWord {
            name: "align",
            kind: ActionKind::Sensing,
            types: &["spot"],
            about: "brings all scans of it together, and takes the shape for one of those known, or for none",
            ground: |s, arguments| Ok(Box::new(aligning(s, arguments[0])?)),
            because: |s, _| format!("{} shapes are known", s.floor().known.len()),
            learn: aligned,
            failed: NOTHING_MORE,
        },
        SkillWord {
            name: "learn",
            kind: ActionKind::Sensing,
            types: &["spot", "shape"],
            about: "brings all scans of it together, and keeps the shape under that name",
            ground: |s, arguments| Ok(Box::new(aligning(s, arguments[0])?)),
            because: |_, arguments| format!("its outline is known well enough to be {}", arguments[1]),
            learn: learned,
            failed: NOTHING_MORE,
        },
    ],
    needs: &[Part::Laser],
    begins: Some(begins),
    fallback: Some(calls::fallback),
    answers: Some(telling::answer),
    keeps: Some(|known, _, later| later.shapes.extend(known.floor().learned.iter().cloned())),
    others: Some(|s| s.floor().may_hide_more().then_some(("spot", Referent::Unseen)).into_iter().collect()),
    objects: Some(|s| {
        let spots = s.floor().things.iter().map(|t| t.symbol.clone()).collect();
        vec![("spot", spots), (SHAPE, s.floor().names.iter().map(|(symbol, _)| symbol.clone()).collect())]
    }),
    names: Some(|known| known.floor().names.iter().map(|(_, name)| (SHAPE, name.clone())).collect()),
    ..Ability::named(
        "shapes",
        "scans what stands on the floor with a laser, learns its shape, names it by its shape",
    )
};

/// PDDL type of shape names.
const SHAPE: &str = "shape";

/// Sets the named shapes and the requested ones at the beginning of a run; for a search, also poses over
/// the floor.
fn begins(mind: &mut Mind, domain: &Domain, goal: &Goal) {
    let robot = Arc::clone(&mind.known.robot);
    let remembered = mind.known.past.as_ref().map(|p| p.remembered.shapes.clone()).unwrap_or_default();
    let known: Vec<KnownShape> = domain.shapes.iter().cloned().chain(remembered).collect();
    let listed = domain.config.objects.get(SHAPE).into_iter().flatten();
    let said = goal.slots.iter().filter(|f| type_of_slot(&f.slot) == SHAPE).map(|f| &f.name);
    let mut names: Vec<(String, String)> = Vec::new();
    for name in listed.chain(known.iter().map(|k| &k.name)).chain(said) {
        if names.iter().all(|(listed, _)| *listed != symbol(name)) {
            names.push((symbol(name), name.clone()));
        }
    }
    let asked = ["found", "may-be"].into_iter().flat_map(|word| goal.asked.of_word(word));
    let asked: Vec<&String> = asked.filter_map(|objects| objects.last()).collect();
    let is_asked = |shape: &String| asked.iter().any(|name| *name == shape || *name == VARIABLE);
    let sought: Vec<String> = names.iter().map(|(symbol, _)| symbol.clone()).filter(is_asked).collect();
    if !sought.is_empty() {
        poses::survey(mind, &*robot);
    }
    *mind.known.floor_mut() = Floor {
        known,
        names,
        unseen: robot.map().map(UnseenFloor::of).unwrap_or_default(),
        promising: mind
            .known
            .candidates
            .iter()
            .filter(|_| !sought.is_empty())
            .map(|c| c.symbol.clone())
            .collect(),
        sought,
        poses: domain.config.candidates,
        ..Floor::default()
    };
}

/// Places along the route around an object.
fn way(s: &Situation, arguments: &[&str]) -> Result<Vec<descry_robots::Place>, String> {
    let from = s.candidate(arguments[0]).map_err(|e| e.to_string())?;
    let to = s.candidate(arguments[1]).map_err(|e| e.to_string())?;
    let around = thing(s, arguments[2])?.ok_or("it is not known where that stands")?;
    let way = poses::way(s, from, to, around).ok_or("no way leads around it")?;
    Ok(way.into_iter().map(|n| s.candidates[n].place.clone()).collect())
}

/// Alignment task over all scans of an object; an error if there are none.
fn aligning(s: &Situation, name: &str) -> Result<Align, String> {
    let thing = thing(s, name)?.filter(|t| !t.scans.is_empty());
    let thing = thing.ok_or_else(|| format!("no scan shows both ends of {name}"))?;
    Ok(Align {
        scans: thing.scans.iter().map(|(_, posed)| posed.clone()).collect(),
        longest_m: taken::LONGEST_M,
        options: taken::solver(s.robot.description()),
    })
}

/// Handles a laser sweep: updates the objects on the floor.
fn scanned(
    mind: &mut Mind,
    eyes: Eyes<'_>,
    _: &Situation,
    arguments: &[&str],
    outcome: &Outcome,
    notes: &mut Vec<Note>,
) -> Result<String, WorldError> {
    let Some(Answer::Scanned(scanned)) = outcome.answer() else { return Err(WorldError::strange(outcome)) };
    notes.push(taken::take(mind, eyes, arguments[0], scanned)?);
    Ok(String::new())
}

/// Handles an alignment: updates the recognition result; returns a sentence.
fn aligned(
    mind: &mut Mind,
    _: Eyes<'_>,
    s: &Situation,
    arguments: &[&str],
    outcome: &Outcome,
    _: &mut Vec<Note>,
) -> Result<String, WorldError> {
    let Outcome::Aligned(alignment) = outcome else { return Err(WorldError::strange(outcome)) };
    let loose_m = s.floor().thing(arguments[0]).map_or(floor::NOTHING_KNOWN_M, |t| t.looseness_m());
    let recognition = taken::recognise(s, alignment, loose_m);
    let known = s.floor().known.len();
    let of = mind.known.floor_mut().things.iter_mut().find(|t| t.symbol == arguments[0]);
    let thing = of.ok_or_else(|| WorldError::Bug(format!("`{}` is gone", arguments[0])))?;
    let best = recognition.candidates.first().map(|c| c.fit.between.per_pair_m());
    let fits =
        best.map_or(String::new(), |m| format!(" (the best fits to {:.1} mm a pair of scans)", 1e3 * m));
    let said = match &recognition.verdict {
        Verdict::Is(name) => format!("it fits {name} alone{fits}"),
        Verdict::OneOf(names) => format!("it fits {}{fits}", names.join(" and ")),
        Verdict::Unknown => format!("it fits none of the {known} known shapes{fits}"),
    };
    if let Some(outline) = &thing.outline {
        let outlook = outline.outlook.clone();
        thing.outline = Some(Arc::new(Outline { alignment: (**alignment).clone(), outlook }));
    }
    thing.taken_for = Some(Arc::new(recognition));
    let contradict = taken::contradict(alignment);
    Ok(format!("{said}: {} sure{contradict}", percent(thing.sureness(known))))
}

/// Handles learning: stores the aligned shape under a name; returns a sentence.
fn learned(
    mind: &mut Mind,
    eyes: Eyes<'_>,
    s: &Situation,
    arguments: &[&str],
    outcome: &Outcome,
    notes: &mut Vec<Note>,
) -> Result<String, WorldError> {
    let Outcome::Aligned(alignment) = outcome else { return Err(WorldError::strange(outcome)) };
    let before = aligned(mind, eyes, s, arguments, outcome, notes)?;
    let floor = mind.known.floor_mut();
    let name = floor.names.iter().find(|(symbol, _)| symbol == arguments[1]);
    let name = name.map_or(arguments[1], |(_, name)| name.as_str());
    let shape = KnownShape::new(name, alignment.model.clone());
    let f = *shape.features();
    floor.learned.push(shape.clone());
    floor.known.push(shape);
    Ok(format!(
        "{name} is learned from {} scans: {:.0} cm², {:.0} cm around; before, {before}",
        alignment.model.scans().len(),
        1e4 * f.area_m2,
        1e2 * f.perimeter_m
    ))
}
