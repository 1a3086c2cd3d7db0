//! Names of the objects of every type, from the domain and from the body's map.

use std::collections::BTreeMap;

use descry_perception::recognise::ObjectModel;
use descry_robots::Robot;
use descry_robots::sim::SceneSpec;

use crate::english::plural;
use crate::load::Domain;
use crate::past::Past;
use crate::symbol::{SENSE, symbol};

/// Types whose objects have names in every domain, equal to their symbols.
pub const NAMED: [&str; 6] = ["surface", "room", "door", "kind", "obstacle", SENSE];

/// Remedy for ambiguous names, in error messages.
pub(crate) const TOLD_APART: &str = "give each a name of its own: letters and digits alone tell names apart";

/// Named object: PDDL symbol and spoken names, the usual one first.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Named {
    /// PDDL symbol.
    pub symbol: String,
    /// Spoken names, at least one.
    pub names: Vec<String>,
}

impl Named {
    fn of(name: &str) -> Self {
        Self { symbol: symbol(name), names: vec![name.into()] }
    }
}

/// Spoken names of the body's places and senses.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Places {
    /// Names of surfaces.
    pub surfaces: Vec<String>,
    /// Names of rooms.
    pub rooms: Vec<String>,
    /// Names of doors.
    pub doors: Vec<String>,
    /// Names of the body's senses.
    pub senses: Vec<String>,
}

impl Places {
    /// Names of the places on a body's map and of its senses.
    pub fn of_body(robot: &dyn Robot) -> Self {
        Self {
            surfaces: robot.surfaces().iter().map(|s| s.name.clone()).collect(),
            rooms: robot.rooms().iter().map(|r| r.name.clone()).collect(),
            doors: robot.doors().iter().map(|d| d.name.clone()).collect(),
            senses: robot.description().senses.iter().map(|s| s.name.clone()).collect(),
        }
    }

    /// Names from the domain's default scene; empty if there is no readable one.
    pub fn of_scene(domain: &Domain) -> Self {
        let name = &domain.config.scene;
        let spec = domain.scenes.get(name).and_then(|text| SceneSpec::parse(name, text).ok());
        spec.map_or_else(Self::default, |spec| Self::of_spec(&spec))
    }

    /// Message about places of one type without distinguishing names, if any; only letters and
    /// digits distinguish.
    pub fn unclear(&self) -> Option<String> {
        let all = [
            ("surface", &self.surfaces),
            ("room", &self.rooms),
            ("door", &self.doors),
            (SENSE, &self.senses),
        ];
        all.into_iter().find_map(|(of, names)| {
            let nameless = names.iter().find(|name| symbol(name).is_empty());
            let same = |(n, name): (usize, &String)| {
                let other = names[..n].iter().find(|other| symbol(other) == symbol(name))?;
                Some(format!("nothing tells the {of} \"{name}\" from the {of} \"{other}\""))
            };
            let nameless = nameless.map(|name| format!("\"{name}\" is no name of a {of}"));
            nameless.or_else(|| names.iter().enumerate().find_map(same))
        })
    }

    /// Names from a scene.
    pub fn of_spec(spec: &SceneSpec) -> Self {
        Self {
            surfaces: spec.surfaces.iter().map(|s| s.name.clone()).collect(),
            rooms: spec.rooms.iter().map(|r| r.name.clone()).filter(|name| !name.is_empty()).collect(),
            doors: spec.doors.iter().map(|d| d.name.clone()).collect(),
            senses: Vec::new(),
        }
    }
}

/// Names of all named objects, by type.
#[derive(Debug, Clone, Default)]
pub struct Lexicon {
    by_type: BTreeMap<String, Vec<Named>>,
}

impl Lexicon {
    /// Names of a domain's objects and of the places.
    pub fn new(domain: &Domain, places: &Places) -> Self {
        let mut by_type: BTreeMap<String, Vec<Named>> = BTreeMap::new();
        let mut add = |of: &str, named: Named| {
            let list = by_type.entry(of.to_string()).or_default();
            if list.iter().all(|known| known.symbol != named.symbol) {
                list.push(named);
            }
        };
        for thing in things(&domain.objects) {
            add("kind", in_plural(&thing));
            add("thing", thing);
        }
        let surfaces = if places.surfaces.is_empty() { &domain.config.surfaces } else { &places.surfaces };
        surfaces.iter().for_each(|name| add("surface", Named::of(name)));
        places.rooms.iter().for_each(|name| add("room", Named::of(name)));
        places.doors.iter().for_each(|name| add("door", Named::of(name)));
        places.senses.iter().for_each(|name| add(SENSE, Named::of(name)));
        for (of, names) in &domain.config.objects {
            names.iter().for_each(|name| add(of, Named::of(name)));
        }
        let vocabulary = &domain.vocabulary;
        for declared in &vocabulary.task.types {
            for constant in vocabulary.constants(&declared.name) {
                add(&declared.name, Named { names: vec![constant.replace('-', " ")], symbol: constant });
            }
        }
        // What is of a subtype is of the type, too.
        for declared in &vocabulary.task.types {
            for other in vocabulary.task.types.iter().filter(|t| t.name != declared.name) {
                if vocabulary.is_a(&other.name, &declared.name) {
                    let found = by_type.get(&other.name).cloned().unwrap_or_default();
                    let list = by_type.entry(declared.name.clone()).or_default();
                    list.extend(found.into_iter().filter(|n| n.symbol != declared.name));
                }
            }
        }
        Self { by_type }
    }

    /// Adds the names of objects learned in earlier runs.
    pub fn remembering(mut self, past: Option<&Past>) -> Self {
        past.iter().flat_map(|p| &p.remembered.things).for_each(|thing| self.learn("thing", &thing.name));
        self
    }

    /// Adds a name to a type, unless a name of the type has the same symbol.
    pub fn learn(&mut self, of: &str, name: &str) {
        let list = self.by_type.entry(of.into()).or_default();
        let named = Named::of(name);
        if list.iter().all(|known| known.symbol != named.symbol) {
            list.push(named);
        }
    }

    /// True if a symbol is not empty and no object has it.
    pub fn is_free(&self, symbol: &str) -> bool {
        !symbol.is_empty() && self.by_type.values().flatten().all(|known| known.symbol != symbol)
    }

    /// Named objects of a type.
    pub fn of_type(&self, name: &str) -> &[Named] {
        self.by_type.get(name).map_or(&[], Vec::as_slice)
    }

    /// Types that have named objects.
    pub fn types(&self) -> impl Iterator<Item = &str> {
        self.by_type.keys().map(String::as_str)
    }

    /// Usual name of a symbol; the symbol itself if unnamed.
    pub fn name_of<'a>(&'a self, symbol: &'a str) -> &'a str {
        let all = self.by_type.iter().filter(|(of, _)| *of != "kind").flat_map(|(_, list)| list);
        let found = all.into_iter().find(|n| n.symbol == symbol);
        found.and_then(|n| n.names.first()).map_or(symbol, String::as_str)
    }

    /// Usual names of a type's objects, joined by commas, for suggestions.
    pub fn listed(&self, of: &str) -> String {
        let names: Vec<&str> =
            self.of_type(of).iter().filter_map(|n| n.names.first()).map(String::as_str).collect();
        names.join(", ")
    }
}

/// Names of the known objects, and of the kinds that no object is named after.
fn things(objects: &[ObjectModel]) -> Vec<Named> {
    let named = |o: &ObjectModel| Named {
        symbol: symbol(&o.name),
        names: std::iter::once(&o.name).chain(&o.phrases).cloned().collect(),
    };
    let mut things: Vec<Named> = objects.iter().map(named).collect();
    for kind in objects.iter().map(|o| &o.kind) {
        if things.iter().all(|known| known.symbol != symbol(kind)) {
            things.push(Named::of(kind));
        }
    }
    things
}

/// Names in the plural, followed by those in the singular.
fn in_plural(thing: &Named) -> Named {
    let plurals = thing.names.iter().map(|name| plural(name));
    Named { symbol: thing.symbol.clone(), names: plurals.chain(thing.names.iter().cloned()).collect() }
}
