//! *moving*: pose of the body, cost of drives, doors. Part of every domain.

mod at;
mod path_cost;
mod time_left;

use descry_robots::{Answer, Request};
use descry_skills::{Ask, Circle, Move};

use crate::ability::{Ability, ActionKind, Fact, MOVE, Meaning, NOTHING_MORE, Reads, SkillWord, Trace};
use crate::drive;
use crate::error::WorldError;
use crate::situation::Situation;

/// The ability *moving*.
pub const ABILITY: Ability = Ability {
    facts: &[
        Fact {
            name: "at",
            types: &["pose"],
            about: "where the body stands",
            states: at::state,
            bounds: None,
        },
        Fact {
            name: "time-left",
            types: &[],
            about: "the deadline, if there is one, has not passed",
            states: time_left::state,
            bounds: None,
        },
        Fact {
            name: "beside",
            types: &["pose", "door"],
            about: "the door can be opened from there, by the map",
            states: beside,
            bounds: None,
        },
        Fact {
            name: "in",
            types: &["surface", "room"],
            about: "the surface is in the room, by the map",
            states: in_room,
            bounds: None,
        },
    ],
    calls: &[Meaning {
        name: "path-cost",
        reads: &[Reads::all("shut")],
        is_advice: false,
        about: "seconds that the drive takes past shut doors; infinite where no route leads",
        answers: path_cost::answer,
    }],
    traces: &[
        Trace {
            name: "shut",
            types: &["door"],
            of: MOVE,
            without: "a drive through a shut door is tried again and again",
        },
        Trace {
            name: "out-of-reach",
            types: &["pose"],
            of: MOVE,
            without: "a pose that no drive reaches is tried again and again",
        },
    ],
    skills: &[
        SkillWord {
            name: MOVE,
            kind: ActionKind::Moving,
            types: &["pose", "pose"],
            about: "drives from one pose to the other",
            ground: |s, arguments| {
                let to = s.candidate(arguments[1]).map_err(|e| e.to_string())?;
                let to = s.candidates[to].place.clone();
                Ok(match s.own_map.way(&s.candidates[s.at].place, &to) {
                    Some(way) => Box::new(Circle { way }),
                    None => Box::new(Move { to }),
                })
            },
            because: |s, arguments| match (s.candidate(arguments[0]), s.candidate(arguments[1])) {
                (Ok(from), Ok(to)) => {
                    format!("to {}, {:.1} s of driving", s.candidates[to].place, s.travel_s(from, to))
                }
                _ => String::new(),
            },
            learn: drive::has_driven,
            failed: NOTHING_MORE,
        },
        SkillWord {
            name: "open-door",
            kind: ActionKind::Changing,
            types: &["pose", "door"],
            about: "opens a door from beside it",
            ground: |s, arguments| {
                let door = s.door(arguments[1]).map_err(|e| e.to_string())?;
                Ok(Box::new(Ask(Request::OpenDoor(s.doors[door].door.name.clone()))))
            },
            because: |_, _| "it is shut and in the way".into(),
            learn: |_, _, _, _, outcome, _| match outcome.answer() {
                Some(Answer::Opened(opened)) => Ok(format!("it is open after {:.1} s", opened.duration_s)),
                _ => Err(WorldError::strange(outcome)),
            },
            failed: NOTHING_MORE,
        },
    ],
    ..Ability::named("moving", "drives on the map, opens doors")
};

/// States `(beside ?pose ?door)` for the poses before each door.
fn beside(s: &Situation) -> Vec<String> {
    let symbols = |d: &crate::known::KnownDoor| {
        let own = format!("{}-side-", d.symbol);
        let poses = s.candidates.iter().filter(|c| c.symbol.starts_with(&own));
        poses.map(|c| format!("(beside {} {})", c.symbol, d.symbol)).collect::<Vec<_>>()
    };
    s.doors.iter().flat_map(symbols).collect()
}

/// States `(in ?surface ?room)` for the surfaces whose room is in the map.
fn in_room(s: &Situation) -> Vec<String> {
    // Of a room that the map does not have nothing can be said.
    let has = |name: &&String| s.robot.rooms().iter().any(|room| room.name == **name);
    let room = |k: &crate::surface::KnownSurface| {
        let room = k.room.as_ref().filter(has)?;
        Some(format!("(in {} {})", k.symbol, crate::symbol::symbol(room)))
    };
    s.surfaces.iter().filter_map(room).collect()
}
