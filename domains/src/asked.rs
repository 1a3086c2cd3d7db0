//! What a goal asks about: read off its condition, whatever words a phrase used for it.

use crate::abilities::searching;
use crate::vocabulary::Vocabulary;

/// The objects that a goal's condition speaks of.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Asked {
    /// Things that are looked for, each with the surfaces on which it is asked about; none: wherever it is.
    pub things: Vec<(String, Option<Vec<String>>)>,
    /// Kinds of which all are asked for, each with the room in which it is asked about; none: wherever they are.
    pub kinds: Vec<(String, Option<String>)>,
    /// Surfaces of which it is asked what stands there.
    pub surfaces: Vec<String>,
    /// Whether it asks for more than looking can tell.
    pub more: bool,
}

/// The function that says how sure it is that a thing is on a surface: a question about that surface alone.
const PRESENCE: &str = "presence";
/// The function that says how sure it is what stands on a surface.
const CLARITY: &str = "clarity";

impl Asked {
    /// Reads a condition.
    pub fn of(condition: &str, vocabulary: &Vocabulary) -> Self {
        let mut asked = Self::default();
        for mention in mentions(condition) {
            let Some(word) = mention.first().and_then(|name| vocabulary.word(name)) else { continue };
            asked.more |= searching::ABILITY.facts.iter().all(|fact| fact.name != word.name);
            let arguments = || mention[1..].iter().zip(&word.types);
            let named = |wanted: &'static str| {
                arguments().filter(move |(_, t)| vocabulary.is_a(t, wanted)).map(|(a, _)| a.clone())
            };
            // A variable stands for whichever there are.
            let of = |wanted: &'static str| named(wanted).filter(|a| !a.starts_with('?'));
            let surfaces: Vec<String> = of("surface").collect();
            let anywhere = named("surface").any(|a| a.starts_with('?'));
            for thing in of("thing") {
                let restricted = word.name == PRESENCE && !anywhere;
                asked.note_thing(thing, restricted.then(|| surfaces.clone()));
            }
            let room = of("room").next();
            for kind in of("kind") {
                match asked.kinds.iter_mut().find(|(known, _)| *known == kind) {
                    None => asked.kinds.push((kind, room.clone())),
                    Some((_, known)) => *known = known.take().filter(|known| Some(known) == room.as_ref()),
                }
            }
            if word.name == CLARITY {
                asked.surfaces.extend(surfaces);
            }
        }
        asked
    }

    fn note_thing(&mut self, thing: String, on: Option<Vec<String>>) {
        match self.things.iter_mut().find(|(known, _)| *known == thing) {
            None => self.things.push((thing, on)),
            Some((_, known)) => {
                *known = known.take().zip(on).map(|(mut known, on)| {
                    known.extend(on.into_iter().filter(|s| !known.contains(s)).collect::<Vec<_>>());
                    known
                });
            }
        }
    }
}

/// Every list of plain symbols in a condition: `(on cup-a ?s)`, `(confidence cup-a)`.
pub(crate) fn mentions(condition: &str) -> Vec<Vec<String>> {
    let mut found = Vec::new();
    let mut open: Vec<Option<Vec<String>>> = Vec::new();
    let spaced = condition.to_lowercase().replace('(', " ( ").replace(')', " ) ");
    for token in spaced.split_whitespace() {
        match token {
            "(" => {
                // A list that holds another is no mention.
                if let Some(outer) = open.last_mut() {
                    *outer = None;
                }
                open.push(Some(Vec::new()));
            }
            ")" => {
                found.extend(open.pop().flatten().filter(|l| !l.is_empty()));
            }
            word => {
                if let Some(Some(list)) = open.last_mut() {
                    list.push(word.to_string());
                }
            }
        }
    }
    found
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::load::Domain;

    #[test]
    fn what_is_asked_is_read_off_the_condition() {
        let domain = Domain::load("tabletop").unwrap();
        let check =
            |condition: &str, things: &[(&str, Option<&[&str]>)], kinds: &[&str], surfaces: &[&str]| {
                let own = |list: &[&str]| list.iter().map(|s| s.to_string()).collect::<Vec<_>>();
                let expected = Asked {
                    things: things.iter().map(|(t, on)| (t.to_string(), on.map(own))).collect(),
                    kinds: own(kinds).into_iter().map(|kind| (kind, None)).collect(),
                    surfaces: own(surfaces),
                    more: condition.contains("observed"),
                };
                assert_eq!(Asked::of(condition, &domain.vocabulary), expected, "{condition}");
            };
        check("(>= (confidence cup-a) 0.8)", &[("cup-a", None)], &[], &[]);
        check("(>= (presence cup-a table) 0.8)", &[("cup-a", Some(&["table"]))], &[], &[]);
        check(
            "(and (>= (presence cup-a table) 0.8) (>= (presence mug shelf) 0.8))",
            &[("cup-a", Some(&["table"])), ("mug", Some(&["shelf"]))],
            &[],
            &[],
        );
        check(
            "(and (>= (confidence cup-a) 0.8) (>= (presence cup-a table) 0.8))",
            &[("cup-a", None)],
            &[],
            &[],
        );
        check("(exists (?s - surface) (>= (presence cup-a ?s) 0.8))", &[("cup-a", None)], &[], &[]);
        check("(>= (completeness cup) 0.8)", &[], &["cup"], &[]);
        check("(>= (clarity table) 0.8)", &[], &[], &["table"]);
        check("(observed table-3 table)", &[], &[], &[]);
        check("(and (observed table-3 table) (on cup-a table))", &[("cup-a", None)], &[], &[]);
    }
}
