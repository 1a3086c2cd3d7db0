//! Explains goals that are unreachable even under delete relaxation: atoms without achievers.

use super::atoms::{Atoms, NONE};
use super::normal::{Action_, Change_, Formula, Normal, Pattern, Term};

/// Most links that are told.
const MOST_OBSTACLES: usize = 24;

/// An atom that no state has, and what stands in the way of all that could bring it about.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Obstacle {
    /// Predicate of the lifted task, or (from its number of predicates on) function.
    pub predicate: u32,
    /// Objects; `None` for any. Of a function, the value comes last.
    pub arguments: Vec<Option<u32>>,
    /// Actions that could bring it about, by index, each with the conditions of it that no state has. Empty where no
    /// action could. An empty list of conditions: each of them can be had, but never together, or not in atoms.
    pub achievers: Vec<(u32, Vec<MissingAtom>)>,
    /// Rules that derive it, by index, in the same way.
    pub rules: Vec<(u32, Vec<MissingAtom>)>,
}

/// A predicate with arguments, `None` for any.
pub type MissingAtom = (u32, Vec<Option<u32>>);

struct Find<'a> {
    normal: &'a Normal,
    atoms: &'a Atoms,
    reached: &'a [bool],
    found: Vec<Obstacle>,
    queue: Vec<MissingAtom>,
}

/// The chain of obstacles from the goal on; empty where the goal's atoms can all be had.
pub(super) fn obstacles(normal: &Normal, atoms: &Atoms, reached: &[bool]) -> Vec<Obstacle> {
    let mut find = Find { normal, atoms, reached, found: Vec::new(), queue: Vec::new() };
    let binding = vec![NONE; normal.goal_domains.len()];
    let wanted = find.missing(&normal.goal, &binding);
    find.enqueue(&wanted);
    let mut next = 0;
    while next < find.queue.len() && next < MOST_OBSTACLES {
        let atom = find.queue[next].clone();
        next += 1;
        find.obstacle(atom);
    }
    find.found
}

impl Find<'_> {
    fn enqueue(&mut self, atoms: &[MissingAtom]) {
        for atom in atoms {
            if !self.queue.contains(atom) {
                self.queue.push(atom.clone());
            }
        }
    }

    /// The positive atoms of a conjunction that no reached atom matches.
    fn missing(&self, formula: &Formula, binding: &[u32]) -> Vec<MissingAtom> {
        match formula {
            Formula::And(parts) => parts.iter().flat_map(|p| self.missing(p, binding)).collect(),
            Formula::Exists(_, body) => self.missing(body, binding),
            Formula::Literal(pattern, true) => {
                let arguments: Vec<u32> = pattern.terms.iter().map(|t| t.bound(binding)).collect();
                if self.some_reached(pattern.predicate, &arguments) {
                    return Vec::new();
                }
                let told = arguments.iter().map(|&a| (a != NONE).then_some(a)).collect();
                vec![(pattern.predicate, told)]
            }
            _ => Vec::new(),
        }
    }

    fn some_reached(&self, predicate: u32, arguments: &[u32]) -> bool {
        self.atoms.of(predicate).iter().any(|&atom| {
            self.reached.get(atom as usize) == Some(&true)
                && self.atoms.arguments(atom).iter().zip(arguments).all(|(&a, &b)| b == NONE || a == b)
        })
    }

    fn obstacle(&mut self, (predicate, arguments): MissingAtom) {
        let normal = self.normal;
        let mut obstacle =
            Obstacle { predicate, arguments: arguments.clone(), achievers: Vec::new(), rules: Vec::new() };
        for action in &normal.actions {
            let effects = action.start_effects.iter().chain(&action.end_effects);
            let adds = effects.filter_map(|e| match &e.change {
                Change_::Add(pattern) if pattern.predicate == predicate => Some(pattern),
                _ => None,
            });
            for pattern in adds {
                let Some(binding) = unify(pattern, &arguments, action.domains.len()) else { continue };
                let missing = self.missing_of(action, &binding);
                self.enqueue(&missing);
                obstacle.achievers.push((action.schema, missing));
                break;
            }
        }
        for (index, rule) in normal.rules.iter().enumerate().filter(|(_, r)| r.head.predicate == predicate) {
            let Some(binding) = unify(&rule.head, &arguments, rule.domains.len()) else { continue };
            let missing = self.missing(&rule.body, &binding);
            self.enqueue(&missing);
            obstacle.rules.push((index as u32, missing));
        }
        self.found.push(obstacle);
    }

    fn missing_of(&self, action: &Action_, binding: &[u32]) -> Vec<MissingAtom> {
        let condition = &action.condition;
        [&condition.start, &condition.over_all, &condition.end]
            .into_iter()
            .flat_map(|part| self.missing(part, binding))
            .collect()
    }
}

/// The binding under which the pattern is the atom, as far as the atom is known.
fn unify(pattern: &Pattern, arguments: &[Option<u32>], slots: usize) -> Option<Vec<u32>> {
    let mut binding = vec![NONE; slots];
    for (term, argument) in pattern.terms.iter().zip(arguments) {
        let Some(argument) = *argument else { continue };
        match *term {
            Term::Object(object) if object != argument => return None,
            Term::Object(_) => {}
            Term::Slot(slot) => {
                let held = &mut binding[slot as usize];
                if *held != NONE && *held != argument {
                    return None;
                }
                *held = argument;
            }
        }
    }
    Some(binding)
}
