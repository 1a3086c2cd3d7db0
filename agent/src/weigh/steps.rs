//! Steps with exchanged objects, and steps that can be merged.

use descry_planner::task::{Change, Term};
use descry_planner::{Semantics, Step};

/// Substitution of objects.
pub struct Instead(pub Vec<(String, String)>);

impl Instead {
    /// Substitution of one step's objects by another's.
    pub fn of(old: &Step, new: &Step) -> Self {
        let pairs = old.arguments.iter().zip(&new.arguments).filter(|(old, new)| old != new);
        Instead(pairs.map(|(old, new)| (old.clone(), new.clone())).collect())
    }

    /// Step with the substitution applied.
    pub fn in_step(&self, step: &Step) -> Step {
        self.put(step, |name| self.0.iter().find(|(old, _)| old == name).map(|(_, new)| new))
    }

    /// Step with the substitution applied in both directions, for exchanged order.
    pub fn exchanged(&self, step: &Step) -> Step {
        let back = |name: &str| self.0.iter().find(|(_, new)| new == name).map(|(old, _)| old);
        self.put(step, |name| {
            self.0.iter().find(|(old, _)| old == name).map(|(_, new)| new).or_else(|| back(name))
        })
    }

    fn put<'a>(&self, step: &Step, by: impl Fn(&str) -> Option<&'a String>) -> Step {
        let arguments = step.arguments.iter().map(|name| by(name).unwrap_or(name).clone());
        Step { arguments: arguments.collect(), ..step.clone() }
    }
}

/// Merges consecutive steps of one action that lead from object to object (a to b, b to c) into
/// one; `None` if none can be merged.
pub fn joined(steps: &[Step]) -> Option<Vec<Step>> {
    let mut all: Vec<Step> = Vec::new();
    for step in steps {
        match (all.last_mut(), step.arguments.as_slice()) {
            (Some(Step { action, arguments, .. }), [from, to])
                if *action == step.action && arguments.len() == 2 && arguments[1] == *from =>
            {
                arguments[1] = to.clone();
            }
            _ => all.push(step.clone()),
        }
    }
    all.retain(leads);
    (all.len() < steps.len()).then_some(all)
}

/// True unless a step has exactly two arguments and they are equal, as it then leads nowhere.
pub fn leads(step: &Step) -> bool {
    !matches!(step.arguments.as_slice(), [from, to] if from == to)
}

/// Objects in the atoms that a step adds.
pub fn brought(semantics: &Semantics<'_>, step: &Step) -> Vec<String> {
    let Ok((action, _)) = semantics.bind(step) else { return Vec::new() };
    let effects = &semantics.task.action(action).effects;
    let added = effects.start.iter().chain(&effects.end).filter_map(|effect| match &effect.change {
        Change::Add(atom) => Some(&atom.arguments),
        _ => None,
    });
    let object = |term: &Term| match term {
        Term::Variable(slot) => step.arguments.get(slot.index()).cloned(),
        Term::Object(object) => Some(semantics.task.object(*object).name.clone()),
        Term::Function(_) => None,
    };
    added.flatten().filter_map(object).collect()
}

/// The words of a text in PDDL.
pub fn words(text: &str) -> Vec<&str> {
    text.split(|c: char| c.is_whitespace() || "()".contains(c)).filter(|w| !w.is_empty()).collect()
}
