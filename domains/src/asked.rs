//! Things, kinds and surfaces that a goal asks about, collected by a visitor of its parsed condition.

use descry_planner::Source;
use descry_planner::task::{Comparison, Condition, Expression, PredicateId, Quantified, Task, Term};

use crate::abilities::searching;
use crate::declared;
use crate::lexicon::Lexicon;
use crate::load::Domain;
use crate::mentions::mentions;
use crate::objective::{Asked, VARIABLE};
use crate::vocabulary::Vocabulary;

/// Function for the certainty that a thing is on a surface; a goal with it asks about that surface
/// alone.
const PRESENCE: &str = "presence";
/// Function for the certainty of a thing's position; a goal with it asks about no particular surface.
const PLACED: &str = "placed";
/// Function for the certainty of what the objects on a surface are.
const CLARITY: &str = "clarity";
/// Predicate for the room of a surface.
const IN: &str = "in";
/// Predicates and functions about objects that need sightings to hold.
const OF_OBJECTS: [&str; 4] = ["on", "is", "confidence", PRESENCE];

/// Parses a condition over the domain's predicates, functions and the lexicon's names. An unknown name,
/// such as a pose of the body, becomes an object of the expected type.
///
/// # Errors
/// The findings of the planner as text, drawn under the condition.
pub fn parsed(condition: &str, domain: &Domain, lexicon: &Lexicon) -> Result<Task, String> {
    let vocabulary = &domain.vocabulary;
    let types = &vocabulary.task.types;
    let named = types
        .iter()
        .flat_map(|of| lexicon.of_type(&of.name).iter().map(move |n| (n.symbol.as_str(), of.name.as_str())));
    let mut objects: Vec<(&str, &str)> = named.collect();
    let mentioned: Vec<(Vec<String>, Vec<String>)> = mentions(condition)
        .into_iter()
        .filter_map(|m| Some((vocabulary.parameters(m.first()?)?.into_iter().map(|(_, of)| of).collect(), m)))
        .collect();
    for (types, mention) in &mentioned {
        for (name, of) in mention[1..].iter().zip(types).filter(|(name, _)| !name.starts_with('?')) {
            if objects.iter().all(|(known, _)| known != name) {
                objects.push((name.as_str(), of.as_str()));
            }
        }
    }
    let objects = declared::lines(objects, vocabulary).0.join(" ");
    let name = &vocabulary.task.domain;
    let problem =
        format!("(define (problem asked) (:domain {name}) (:objects {objects}) (:init) (:goal {condition}))");
    Task::read(&domain.pddl, &Source::new("condition", problem)).map_err(|found| found.render(false))
}

impl Asked {
    /// Collects what the goal of a task asks about.
    pub fn of(task: &Task, vocabulary: &Vocabulary) -> Self {
        let mut visit = Visit::new(task, vocabulary);
        let mut scope = visit.scope(task.goal.slots);
        visit.condition(&task.goal.body, Wanted::MORE, &mut scope, &[]);
        let Visit { mut asked, placed, whole, .. } = visit;
        asked.plain = is_plain(&task.goal.body);
        for thing in placed {
            if asked.things.iter().all(|(known, _)| *known != thing) {
                asked.things.push((thing, None));
            }
        }
        // What is said of whichever things there are is asked of the surface, where no kind says which they are.
        if asked.things.is_empty() && asked.kinds.is_empty() {
            for surface in whole.into_iter().filter(|s| !asked.surfaces.contains(s)).collect::<Vec<_>>() {
                asked.surfaces.push(surface);
            }
        }
        asked
    }
}

/// True if a condition is a single atom, or a single function required to exceed or reach a number.
fn is_plain(own: &Condition) -> bool {
    match own {
        Condition::And(parts) => matches!(parts.as_slice(), [only] if is_plain(only)),
        Condition::Atom(_) => true,
        Condition::Compare(Comparison::Greater | Comparison::GreaterOrEqual, sides, _) => {
            matches!(&**sides, [Expression::Fluent(_), Expression::Number(_)])
        }
        _ => false,
    }
}

/// Argument of an atom or a function.
#[derive(Debug, Clone, PartialEq, Eq)]
enum Argument {
    Name(String),
    /// A variable, numbered across all scopes.
    Variable(usize),
}

/// Arguments bound to the slots of a condition, by slot.
type Scope = Vec<Argument>;

/// Variable with the room that an `in` atom restricts it to.
type Within = (Argument, String);

/// Polarity of a part of a condition: true or greater is wanted (`more`), false or smaller (`less`), or
/// both.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
struct Wanted {
    more: bool,
    less: bool,
}

impl Wanted {
    const MORE: Wanted = Wanted { more: true, less: false };
    const BOTH: Wanted = Wanted { more: true, less: true };

    fn turned(self) -> Wanted {
        Wanted { more: self.less, less: self.more }
    }
}

struct Visit<'t> {
    task: &'t Task,
    vocabulary: &'t Vocabulary,
    asked: Asked,
    /// Things whose positional certainty the goal asks about.
    placed: Vec<String>,
    /// Surfaces that the goal asks about for arbitrary things.
    whole: Vec<String>,
    /// Derived predicates whose rules are being visited.
    open: Vec<PredicateId>,
    variables: usize,
}

impl<'t> Visit<'t> {
    fn new(task: &'t Task, vocabulary: &'t Vocabulary) -> Self {
        let (asked, placed, whole, open) = Default::default();
        Self { task, vocabulary, asked, placed, whole, open, variables: 0 }
    }

    /// Scope of `slots` fresh variables.
    fn scope(&mut self, slots: usize) -> Scope {
        let first = self.variables;
        self.variables += slots;
        (first..self.variables).map(Argument::Variable).collect()
    }

    fn bind(&mut self, variables: &[Quantified], scope: &mut Scope) {
        for variable in variables {
            scope[variable.slot.index()] = Argument::Variable(self.variables);
            self.variables += 1;
        }
    }

    fn condition(&mut self, own: &Condition, wanted: Wanted, scope: &mut Scope, within: &[Within]) {
        match own {
            Condition::And(parts) | Condition::Or(parts) => {
                let mut within = within.to_vec();
                let rooms = parts.iter().filter_map(|part| match (own, part) {
                    (Condition::And(_), Condition::Atom(_)) => self.room(part, scope),
                    (Condition::Or(_), Condition::Not(inner)) => self.room(inner, scope),
                    _ => None,
                });
                within.extend(rooms.collect::<Vec<_>>());
                parts.iter().for_each(|part| self.condition(part, wanted, scope, &within));
            }
            Condition::Not(inner) => match &**inner {
                Condition::Compare(..) => self.condition(inner, Wanted::BOTH, scope, within),
                _ => self.condition(inner, wanted.turned(), scope, within),
            },
            Condition::Forall(variables, inner) | Condition::Exists(variables, inner) => {
                self.bind(variables, scope);
                self.condition(inner, wanted, scope, within);
            }
            Condition::Atom(atom) => {
                let arguments = self.arguments(&atom.arguments, scope);
                if self.task.predicate(atom.predicate).stratum.is_some() {
                    self.rules(atom.predicate, &arguments, wanted, within);
                } else {
                    let name = self.task.predicate(atom.predicate).name.clone();
                    self.mention(&name, &arguments, wanted, within);
                }
            }
            Condition::Compare(comparison, sides, _) => {
                let left = match comparison {
                    Comparison::Equal => Wanted::BOTH,
                    Comparison::Greater | Comparison::GreaterOrEqual => wanted,
                    Comparison::Less | Comparison::LessOrEqual => wanted.turned(),
                };
                self.expression(&sides[0], left, scope, within);
                self.expression(&sides[1], left.turned(), scope, within);
            }
            Condition::Same(..) | Condition::Call(_) => {}
        }
    }

    /// Visits the rules of a derived predicate with its arguments; a recursive use is skipped.
    fn rules(&mut self, predicate: PredicateId, arguments: &[Argument], wanted: Wanted, within: &[Within]) {
        if self.open.contains(&predicate) {
            return;
        }
        self.open.push(predicate);
        let task = self.task;
        for rule in task.rules.iter().filter(|rule| rule.predicate == predicate) {
            let mut scope = self.scope(rule.slots);
            scope[..arguments.len()].clone_from_slice(arguments);
            self.condition(&rule.body, wanted, &mut scope, within);
        }
        self.open.pop();
    }

    fn expression(&mut self, own: &Expression, wanted: Wanted, scope: &Scope, within: &[Within]) {
        match own {
            Expression::Fluent(fluent) => {
                let name = self.task.function(fluent.function).name.clone();
                let arguments = self.arguments(&fluent.arguments, scope);
                self.mention(&name, &arguments, wanted, within);
            }
            Expression::Add(parts) => parts.iter().for_each(|p| self.expression(p, wanted, scope, within)),
            Expression::Subtract(sides) => {
                self.expression(&sides[0], wanted, scope, within);
                self.expression(&sides[1], wanted.turned(), scope, within);
            }
            Expression::Negative(inner) => self.expression(inner, wanted.turned(), scope, within),
            // The sign of a factor is not known.
            Expression::Multiply(parts) => {
                parts.iter().for_each(|part| self.expression(part, Wanted::BOTH, scope, within));
            }
            Expression::Divide(sides) => {
                sides.iter().for_each(|side| self.expression(side, Wanted::BOTH, scope, within));
            }
            Expression::Number(_)
            | Expression::Duration
            | Expression::TotalTime
            | Expression::Violated(_)
            | Expression::Call(_) => {}
        }
    }

    fn arguments(&self, terms: &[Term], scope: &Scope) -> Vec<Argument> {
        let argument = |term: &Term| match term {
            Term::Variable(slot) => scope[slot.index()].clone(),
            Term::Object(id) => Argument::Name(self.task.object(*id).name.clone()),
            // Which object it is changes.
            Term::Function(_) => Argument::Variable(usize::MAX),
        };
        terms.iter().map(argument).collect()
    }

    /// Variable and room of an atom `(in ?variable room)`; `None` for any other condition.
    fn room(&self, atom: &Condition, scope: &Scope) -> Option<Within> {
        let Condition::Atom(atom) = atom else { return None };
        let arguments = self.arguments(&atom.arguments, scope);
        match (self.task.predicate(atom.predicate).name.as_str(), arguments.as_slice()) {
            (IN, [variable @ Argument::Variable(_), Argument::Name(room)]) => {
                Some((variable.clone(), room.clone()))
            }
            _ => None,
        }
    }

    fn mention(&mut self, name: &str, arguments: &[Argument], wanted: Wanted, within: &[Within]) {
        let Some(word) = self.vocabulary.word(name) else { return };
        let text = |argument: &Argument| match argument {
            Argument::Name(name) => name.clone(),
            Argument::Variable(_) => VARIABLE.into(),
        };
        self.asked.words.push((word.name.clone(), arguments.iter().map(text).collect()));
        let is_denied = wanted.less && OF_OBJECTS.contains(&word.name.as_str());
        self.asked.denies |= is_denied;
        let is_seen = searching::ABILITY.facts.iter().any(|fact| fact.name == word.name);
        self.asked.more |= !is_seen && word.name != IN;
        let vocabulary = self.vocabulary;
        let of_type = |wanted: &'static str| {
            arguments.iter().zip(&word.types).filter(move |(_, t)| vocabulary.is_a(t, wanted)).map(|(a, _)| a)
        };
        let is_variable = |a: &Argument| matches!(a, Argument::Variable(_));
        let of = |wanted: &'static str| -> Vec<String> {
            of_type(wanted).filter(|a| !is_variable(a)).map(text).collect()
        };
        let rooms: Vec<String> = within
            .iter()
            .filter(|(v, _)| word.name != IN && arguments.contains(v))
            .map(|(_, room)| room.clone())
            .collect();
        let anywhere = rooms.is_empty() && of_type("surface").any(is_variable);
        let (things, kinds, named, asked_rooms) = (of("thing"), of("kind"), of("surface"), of("room"));
        let is_of_all = OF_OBJECTS.contains(&word.name.as_str()) && of_type("thing").any(is_variable);
        if is_denied && is_of_all {
            self.asked.clears.extend(of_type("surface").map(text));
        }
        let surfaces: Vec<String> = named.iter().cloned().chain(rooms).collect();
        if word.name == PLACED {
            self.placed.extend(things);
            return;
        }
        for thing in things {
            let restricted = (word.name == PRESENCE || is_denied) && !anywhere && !surfaces.is_empty();
            note(&mut self.asked.things, thing, restricted.then(|| surfaces.clone()));
        }
        for kind in kinds {
            note(&mut self.asked.kinds, kind, Some(asked_rooms.clone()).filter(|rooms| !rooms.is_empty()));
        }
        if is_of_all {
            self.whole.extend(named);
        }
        if word.name == CLARITY {
            self.asked.surfaces.extend(surfaces);
        }
    }
}

/// Notes that the goal asks about something in some places; `None`: anywhere.
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
