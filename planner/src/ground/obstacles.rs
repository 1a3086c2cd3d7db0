//! Explains why a goal is unreachable even under delete relaxation: atoms that nothing can achieve.

use super::atoms::{Atoms, NONE};
use super::normal::{Action_, Change_, Formula, Normal, Pattern, Term};

/// Maximum number of atoms whose obstacles are reported.
const MOST_OBSTACLES: usize = 24;
/// Maximum number of atoms that match one condition for which the missing preconditions are still
/// reported.
const MOST_MATCHES: usize = 4;

/// Atom that holds in no reachable state, with the reasons why none of its achievers can be
/// applied.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Obstacle {
    /// Index of a predicate of the lifted task; indices beyond the predicates continue with the
    /// functions.
    pub predicate: u32,
    /// Argument objects; `None` stands for any object. For a function, the value comes last.
    pub arguments: Vec<Option<u32>>,
    /// Actions that add the atom (by index), each with its unreachable conditions; empty if no
    /// action adds it. Without unreachable conditions, an action's conditions are reachable only
    /// one by one, or are not atoms.
    pub achievers: Vec<(u32, Vec<MissingAtom>)>,
    /// Rules that derive the atom (by index), each with its unreachable conditions.
    pub rules: Vec<(u32, Vec<MissingAtom>)>,
}

/// Predicate and arguments of an unreachable atom; `None` stands for any object.
pub type MissingAtom = (u32, Vec<Option<u32>>);

struct Find<'a> {
    normal: &'a Normal,
    atoms: &'a Atoms,
    reached: &'a [bool],
    found: Vec<Obstacle>,
    queue: Vec<MissingAtom>,
}

/// Obstacles from the goal's atoms down to atoms that nothing achieves; empty if all atoms of the
/// goal are reachable.
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

    /// Positive atoms of a conjunction that no reached atom matches.
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
                let mut missing = self.missing_of(action, &binding);
                if missing.is_empty() {
                    missing = self.missing_together(action, &binding);
                }
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

impl Find<'_> {
    /// Unreachable atoms that explain an action whose conditions are reachable one by one but not
    /// together: for one condition, the atoms that are missing whichever reached atom fulfils it.
    /// Conditions that no action changes are tried first, and those that lead to new atoms.
    fn missing_together(&self, action: &Action_, binding: &[u32]) -> Vec<MissingAtom> {
        let mut literals: Vec<&Pattern> = Vec::new();
        let condition = &action.condition;
        [&condition.start, &condition.over_all, &condition.end]
            .into_iter()
            .for_each(|part| literals_of(part, &mut literals));
        literals.sort_by_key(|pattern| self.is_changed(pattern.predicate));
        let mut explaining =
            literals.into_iter().filter_map(|pattern| self.lacking(action, pattern, binding));
        explaining.find(|missing| missing.iter().any(|atom| !self.queue.contains(atom))).unwrap_or_default()
    }

    /// Atoms that an action lacks for each reached atom that matches the condition `pattern`;
    /// `None` if nothing is lacking for one of these, or if more than [`MOST_MATCHES`] match.
    fn lacking(&self, action: &Action_, pattern: &Pattern, binding: &[u32]) -> Option<Vec<MissingAtom>> {
        let mut lacking: Vec<MissingAtom> = Vec::new();
        let mut matches = 0;
        for &atom in self.atoms.of(pattern.predicate) {
            if self.reached.get(atom as usize) != Some(&true) {
                continue;
            }
            let Some(bound) = extended(pattern, self.atoms.arguments(atom), binding) else { continue };
            matches += 1;
            let missing = self.missing_of(action, &bound);
            if missing.is_empty() || matches > MOST_MATCHES {
                return None;
            }
            lacking.extend(missing);
        }
        lacking.sort_unstable();
        lacking.dedup();
        (!lacking.is_empty()).then_some(lacking)
    }

    fn is_changed(&self, predicate: u32) -> bool {
        let effects = self.normal.actions.iter().flat_map(|a| a.start_effects.iter().chain(&a.end_effects));
        let mut added = effects.filter_map(|effect| match &effect.change {
            Change_::Add(pattern) => Some(pattern.predicate),
            _ => None,
        });
        added.any(|added| added == predicate)
            || self.normal.rules.iter().any(|rule| rule.head.predicate == predicate)
    }
}

/// Appends the positive literals of a conjunction.
fn literals_of<'f>(formula: &'f Formula, into: &mut Vec<&'f Pattern>) {
    match formula {
        Formula::And(parts) => parts.iter().for_each(|part| literals_of(part, into)),
        Formula::Literal(pattern, true) => into.push(pattern),
        _ => {}
    }
}

/// Binding extended so that a pattern becomes an atom; `None` if they do not unify.
fn extended(pattern: &Pattern, arguments: &[u32], binding: &[u32]) -> Option<Vec<u32>> {
    let mut binding = binding.to_vec();
    for (term, &argument) in pattern.terms.iter().zip(arguments) {
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

/// Binding under which a pattern becomes an atom (`None` arguments stay free); `None` if they do
/// not unify.
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
