//! What a goal asks about: read off its condition, whatever words a phrase used for it.

use crate::abilities::searching;
use crate::vocabulary::Vocabulary;

/// The objects that a goal's condition speaks of.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Asked {
    /// Things that are looked for, each with the surfaces, or rooms, on which it is asked about; none: wherever it is.
    pub things: Vec<(String, Option<Vec<String>>)>,
    /// Kinds of which all are asked for, each with the rooms in which it is asked about; none: wherever they are.
    pub kinds: Vec<(String, Option<Vec<String>>)>,
    /// Surfaces of which it is asked what stands there.
    pub surfaces: Vec<String>,
    /// What must not be so.
    pub denied: Vec<Denied>,
    /// Whether it asks for more than looking can tell.
    pub more: bool,
}

/// Something that must not be so, such as that a thing stands on a surface. As long as nothing was seen, it is not believed; that it is not so
/// is another thing.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Denied {
    /// What must not be so.
    pub things: Vec<String>,
    /// Or all of these kinds.
    pub kinds: Vec<String>,
    /// On which surfaces, or in which rooms, it must not be so; none: nowhere.
    pub surfaces: Vec<String>,
    /// Which variables stand for whichever objects there are.
    pub variables: Vec<String>,
}

/// The function that says how sure it is that a thing is on a surface: a question about that surface alone.
const PRESENCE: &str = "presence";
/// The function that says how exactly it is known where a thing stands, wherever that is: it asks about no place.
const PLACED: &str = "placed";
/// The function that says how sure it is what stands on a surface.
const CLARITY: &str = "clarity";
/// The predicate that says in which room a surface is.
const IN: &str = "in";
/// What is said of objects that were seen: the less was seen, the less of it holds.
const OF_OBJECTS: [&str; 4] = ["on", "is", "confidence", PRESENCE];

impl Asked {
    /// Reads a condition.
    pub fn of(condition: &str, vocabulary: &Vocabulary) -> Self {
        let mut asked = Self::default();
        let mut placed = Vec::new();
        for Mention { words: mention, is_denied, rooms: within } in signed(condition) {
            let Some(word) = mention.first().and_then(|name| vocabulary.word(name)) else { continue };
            let is_denied = is_denied && OF_OBJECTS.contains(&word.name.as_str());
            let is_seen = searching::ABILITY.facts.iter().any(|fact| fact.name == word.name);
            asked.more |= !is_seen && word.name != IN;
            let arguments = || mention[1..].iter().zip(&word.types);
            let named = |wanted: &'static str| {
                arguments().filter(move |(_, t)| vocabulary.is_a(t, wanted)).map(|(a, _)| a.clone())
            };
            // A variable stands for whichever there are.
            let of = |wanted: &'static str| named(wanted).filter(|a| !a.starts_with('?'));
            let mut surfaces: Vec<String> = of("surface").collect();
            let anywhere = within.is_empty() && named("surface").any(|a| a.starts_with('?'));
            surfaces.extend(within);
            if word.name == PLACED {
                placed.extend(of("thing"));
                continue;
            }
            for thing in of("thing") {
                let restricted = (word.name == PRESENCE || is_denied) && !anywhere && !surfaces.is_empty();
                note(&mut asked.things, thing, restricted.then(|| surfaces.clone()));
            }
            let rooms: Vec<String> = of("room").collect();
            for kind in of("kind") {
                note(&mut asked.kinds, kind, Some(rooms.clone()).filter(|rooms| !rooms.is_empty()));
            }
            if is_denied {
                let variables = mention[1..].iter().filter(|a| a.starts_with('?')).cloned().collect();
                let (things, kinds) = (of("thing").collect(), of("kind").collect());
                asked.denied.push(Denied { things, kinds, surfaces: surfaces.clone(), variables });
            }
            if word.name == CLARITY {
                asked.surfaces.extend(surfaces);
            }
        }
        for thing in placed {
            if asked.things.iter().all(|(known, _)| *known != thing) {
                asked.things.push((thing, None));
            }
        }
        asked
    }
}

/// Notes that something is asked about in some places, or wherever it is.
fn note(all: &mut Vec<(String, Option<Vec<String>>)>, name: String, places: Option<Vec<String>>) {
    match all.iter_mut().find(|(known, _)| *known == name) {
        None => all.push((name, places)),
        Some((_, known)) => {
            *known = known.take().zip(places).map(|(mut known, places)| {
                known.extend(places.into_iter().filter(|p| !known.contains(p)).collect::<Vec<_>>());
                known
            });
        }
    }
}

/// Every list of plain symbols in a condition: `(on cup-a ?s)`, `(confidence cup-a)`.
pub(crate) fn mentions(condition: &str) -> Vec<Vec<String>> {
    signed(condition).into_iter().map(|mention| mention.words).collect()
}

/// A list of plain symbols in a condition.
pub struct Mention {
    words: Vec<String>,
    /// Whether it must not be so for the condition to hold.
    is_denied: bool,
    /// The rooms in which its variables are said to be beside it.
    rooms: Vec<String>,
}

fn signed(condition: &str) -> Vec<Mention> {
    let spaced = condition.to_lowercase().replace('(', " ( ").replace(')', " ) ");
    let mut tokens = spaced.split_whitespace();
    let mut found = Vec::new();
    parts(&mut tokens).0.iter().for_each(|part| collect(part, false, &[], &mut found));
    found
}

/// A word, or a list of parts in brackets.
pub enum Part {
    #[doc(hidden)]
    Word(String),
    #[doc(hidden)]
    List(Vec<Part>),
}

/// The parts up to the bracket that closes them, and whether it is there: a list that is not closed is none.
fn parts<'a>(tokens: &mut impl Iterator<Item = &'a str>) -> (Vec<Part>, bool) {
    let mut all = Vec::new();
    while let Some(token) = tokens.next() {
        match token {
            "(" => match parts(tokens) {
                (list, true) => all.push(Part::List(list)),
                (open, false) => all.extend(open.into_iter().filter(|part| matches!(part, Part::List(_)))),
            },
            ")" => return (all, true),
            word => all.push(Part::Word(word.to_string())),
        }
    }
    (all, false)
}

impl Part {
    /// The words of a list of words alone.
    fn plain(&self) -> Option<Vec<&str>> {
        let Part::List(parts) = self else { return None };
        parts
            .iter()
            .map(|part| if let Part::Word(word) = part { Some(word.as_str()) } else { None })
            .collect()
    }
}

/// A variable, and the room in which it is.
type Within = (String, String);

/// Collects the lists of words alone; `within` is what is said beside them.
pub fn collect(part: &Part, is_denied: bool, within: &[Within], found: &mut Vec<Mention>) {
    let Part::List(parts) = part else { return };
    if let Some(words) = part.plain() {
        let is_there = |(variable, _): &&Within| words.contains(&variable.as_str()) && words[0] != IN;
        let rooms = within.iter().filter(is_there).map(|(_, room)| room.clone()).collect();
        let words: Vec<String> = words.iter().map(ToString::to_string).collect();
        found.extend((!words.is_empty()).then_some(Mention { words, is_denied, rooms }));
        return;
    }
    let head = if let Some(Part::Word(head)) = parts.first() { head.as_str() } else { "" };
    let mut within = within.to_vec();
    match head {
        "and" => within.extend(parts.iter().filter_map(|part| match part.plain()?.as_slice() {
            [IN, variable, room] if variable.starts_with('?') && !room.starts_with('?') => {
                Some((variable.to_string(), room.to_string()))
            }
            _ => None,
        })),
        // A variable that is bound anew is another.
        "forall" | "exists" => {
            let bound = parts.get(1).and_then(Part::plain).unwrap_or_default();
            within.retain(|(variable, _)| !bound.contains(&variable.as_str()));
        }
        _ => {}
    }
    for (n, part) in parts.iter().enumerate() {
        // More of a number is less of what it must not exceed.
        let turns = match head {
            "not" => true,
            "imply" | "<" | "<=" => n == 1,
            ">" | ">=" => n == 2,
            _ => false,
        };
        collect(part, is_denied != turns, &within, found);
    }
}
