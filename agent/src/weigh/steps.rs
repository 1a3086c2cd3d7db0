//! Steps with other objects, and merging of consecutive steps.

use descry_planner::task::{Change, Term};
use descry_planner::{Semantics, Step};

/// Substitution of objects: pairs of an old and a new name.
pub struct Instead(pub Vec<(String, String)>);

impl Instead {
    /// Substitution that turns the arguments of `old` into those of `new`.
    pub fn of(old: &Step, new: &Step) -> Self {
        let pairs = old.arguments.iter().zip(&new.arguments).filter(|(old, new)| old != new);
        Instead(pairs.map(|(old, new)| (old.clone(), new.clone())).collect())
    }

    /// Copy of a step with old names replaced by new ones.
    pub fn in_step(&self, step: &Step) -> Step {
        self.put(step, |name| self.0.iter().find(|(old, _)| old == name).map(|(_, new)| new))
    }

    /// Copy of a step with old and new names exchanged in both directions.
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

/// Merges consecutive steps of one action that lead from object to object (a to b, then b to c)
/// into one; `None` if there are none.
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

/// False if a step leads nowhere: it has two arguments, and these are equal.
pub fn leads(step: &Step) -> bool {
    !matches!(step.arguments.as_slice(), [from, to] if from == to)
}

/// Objects in the atoms that a step adds; empty if the step does not fit the task.
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

/// Words of a PDDL text, without parentheses.
pub fn words(text: &str) -> Vec<&str> {
    text.split(|c: char| c.is_whitespace() || "()".contains(c)).filter(|w| !w.is_empty()).collect()
}
