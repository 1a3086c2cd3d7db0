//! Why there is no plan.

use std::fmt;

use serde::Serialize;

use crate::diagnostic::{Diagnostic, Findings};
use crate::ground::{GroundTask, MissingAtom, Obstacle};
use crate::task::Task;

/// Why a task has no plan: findings that point at the goal, at what nobody achieves, and at who said no.
#[derive(Debug, Clone, Default, PartialEq, Serialize)]
pub struct Explanation {
    /// The reasons, the goal's first.
    pub findings: Findings,
}

impl fmt::Display for Explanation {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        for (index, finding) in self.findings.list.iter().enumerate() {
            if index > 0 {
                f.write_str("\n")?;
            }
            f.write_str(&finding.message)?;
        }
        Ok(())
    }
}

impl Explanation {
    /// From what grounding found out: one finding an atom that nobody achieves, the goal's first. Empty where only the
    /// search could tell that there is no plan.
    pub fn of_obstacles(task: &Task, ground: &GroundTask) -> Explanation {
        let list = ground.obstacles.iter().map(|obstacle| finding(task, obstacle)).collect();
        Explanation { findings: Findings { sources: task.sources.to_vec(), list } }
    }
}

fn finding(task: &Task, obstacle: &Obstacle) -> Diagnostic {
    let atom = named(task, &(obstacle.predicate, obstacle.arguments.clone()));
    let predicates = task.predicates.len();
    let span = match (obstacle.predicate as usize).checked_sub(predicates) {
        None => task.predicates[obstacle.predicate as usize].span,
        Some(function) => task.functions[function].span,
    };
    let nobody = obstacle.achievers.is_empty() && obstacle.rules.is_empty();
    let message = if nobody {
        format!("{atom} never holds: it is not there at first and no action brings it about")
    } else {
        format!("{atom} never holds: nothing that could bring it about can ever be applied")
    };
    let mut finding = Diagnostic::error("out-of-reach", message, span, "declared here");
    let actions = obstacle.achievers.iter().map(|(schema, missing)| {
        let action = &task.actions[*schema as usize];
        (action.span, format!("`{}`", action.name), missing)
    });
    let rules = obstacle
        .rules
        .iter()
        .map(|(rule, missing)| (task.rules[*rule as usize].span, "this rule".to_string(), missing));
    for (span, name, missing) in actions.chain(rules) {
        let lacks: Vec<String> = missing.iter().map(|atom| named(task, atom)).collect();
        let text = if lacks.is_empty() {
            format!("{name} could bring it about, but its conditions never hold together")
        } else {
            format!("{name} could bring it about, but lacks {}", lacks.join(", "))
        };
        finding = finding.with_label(span, text);
    }
    if nobody {
        finding = finding.with_help(format!("add {atom} to `:init`, or an action with this effect"));
    }
    finding
}

/// An atom as it is written; `?` for any object.
fn named(task: &Task, (predicate, arguments): &MissingAtom) -> String {
    let object = |a: &Option<u32>| a.map_or("?", |a| &task.objects[a as usize].name);
    let words: Vec<&str> = arguments.iter().map(object).collect();
    match (*predicate as usize).checked_sub(task.predicates.len()) {
        None => {
            let name = task.predicates[*predicate as usize].name.as_str();
            format!("`({})`", [&[name], &words[..]].concat().join(" "))
        }
        Some(function) => {
            let name = task.functions[function].name.as_str();
            let (value, own) = words.split_last().map_or(("?", &[][..]), |(v, own)| (*v, own));
            format!("`(= ({}) {value})`", [&[name], own].concat().join(" "))
        }
    }
}
