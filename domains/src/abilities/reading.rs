//! *reading*: the body's other senses. Readings go into the record and to the programs behind
//! facts.

use descry_robots::{Answer, Request};
use descry_skills::Ask;
use serde_json::json;

use crate::ability::{Ability, ActionKind, NOTHING_MORE, SkillWord};
use crate::error::WorldError;
use crate::situation::Situation;
use crate::symbol::{SENSE, symbol};

/// Record kind of a reading.
const READING: &str = "reading";

/// The ability *reading*.
pub const ABILITY: Ability = Ability {
    skills: &[SkillWord {
        name: "read",
        kind: ActionKind::Sensing,
        types: &[SENSE],
        about: "reads a sense of the body: what it says stands in the record and in the questions to facts by programs",
        ground: |s, arguments| {
            let sense =
                called(s, arguments[0]).ok_or_else(|| format!("the body has no sense {}", arguments[0]))?;
            Ok(Box::new(Ask(Request::Read(sense.name.clone()))))
        },
        because: |s, arguments| called(s, arguments[0]).map_or_else(String::new, |sense| sense.about.clone()),
        learn: |mind, eyes, s, arguments, outcome, _| {
            let Some(Answer::Read(reading)) = outcome.answer() else {
                return Err(WorldError::strange(outcome));
            };
            let about = called(s, arguments[0]).map(|sense| &sense.about);
            let body = json!({ "sense": arguments[0], "about": about, "said": reading.said });
            eyes.record.put_document(READING, reading.stamp_ns, body, Vec::new())?;
            mind.readings.insert(arguments[0].into(), reading.said.clone());
            Ok(format!("it says {}", reading.said))
        },
        failed: NOTHING_MORE,
    }],
    ..Ability::named(
        "reading",
        "reads the body's sensors that are neither camera nor laser, for facts by programs",
    )
};

/// Sense of the body with a symbol.
fn called<'a>(s: &'a Situation, sense: &str) -> Option<&'a descry_robots::Sense> {
    s.robot.description().senses.iter().find(|known| symbol(&known.name) == sense)
}
