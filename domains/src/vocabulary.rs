//! Predicates, functions, types and actions declared by a domain.

use std::collections::BTreeSet;

use descry_planner::task::{
    Action, Assignment, Change, Condition, Expression, Fluent, Task, TypeId, Written,
};
use descry_planner::{Findings, Source, Span};

/// Declarations of a domain's PDDL text.
#[derive(Debug, Clone)]
pub struct Vocabulary {
    /// Parsed domain with an empty problem.
    pub task: Task,
    changed: BTreeSet<String>,
    given: BTreeSet<String>,
}

/// Predicate or numeric function.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Word {
    /// Name of the predicate or function.
    pub name: String,
    /// Argument types by name; for an `either`, the first type.
    pub types: Vec<String>,
    /// True for a numeric function.
    pub is_number: bool,
    /// True for a derived predicate, which rules define.
    pub is_derived: bool,
    /// Span of the declaration.
    pub span: Span,
}

impl Vocabulary {
    /// Reads the declarations of a domain.
    ///
    /// # Errors
    /// All findings in the domain's text.
    pub fn read(pddl: &Source) -> Result<Self, Findings> {
        let name = domain_name(&pddl.text);
        let nothing = format!("(define (problem nothing) (:domain {name}) (:objects) (:init) (:goal (and)))");
        let task = Task::read(pddl, &Source::new("nothing.pddl", nothing))?;
        let rates = task.actions.iter().flat_map(|a| &a.continuous);
        let rates = rates.map(|r| task.function(r.fluent.function).name.clone());
        let changed = changed(&task, |_| true).into_iter().chain(rates).collect();
        let adds = |change: &Change| matches!(change, Change::Number(how, ..) if *how != Assignment::Assign);
        let given = self::changed(&task, |change| !adds(change));
        Ok(Self { task, changed, given })
    }

    /// True if a type is declared.
    pub fn has_type(&self, name: &str) -> bool {
        self.task.types.iter().any(|t| t.name == name)
    }

    /// True if a type equals another or is a subtype of it.
    pub fn is_a(&self, name: &str, other: &str) -> bool {
        let Some(found) = self.task.types.iter().find(|t| t.name == name) else { return false };
        found.ancestors.iter().any(|id| self.task.type_of(*id).name == other)
    }

    /// All predicates and numeric functions.
    pub fn words(&self) -> Vec<Word> {
        let types = |parameters: &[descry_planner::task::Parameter]| {
            parameters.iter().map(|p| self.type_name(&p.types)).collect()
        };
        let predicates = self.task.predicates.iter().map(|p| Word {
            name: p.name.clone(),
            types: types(&p.parameters),
            is_number: false,
            is_derived: p.stratum.is_some(),
            span: p.span,
        });
        let functions = self.task.functions.iter().filter(|f| f.result.is_none()).map(|f| Word {
            name: f.name.clone(),
            types: types(&f.parameters),
            is_number: true,
            is_derived: false,
            span: f.span,
        });
        predicates.chain(functions).collect()
    }

    /// Predicate or numeric function with this name.
    pub fn word(&self, name: &str) -> Option<Word> {
        self.words().into_iter().find(|w| w.name == name)
    }

    /// Parameters of an action: name and type of each; `None` for an unknown action.
    pub fn action(&self, name: &str) -> Option<Vec<(String, String)>> {
        let action = self.task.actions.iter().find(|a| a.name == name)?;
        Some(action.parameters.iter().map(|p| (p.name.clone(), self.type_name(&p.types))).collect())
    }

    /// Parameters of an action, predicate, function or call, in order: name and type; `None` for an
    /// unknown name.
    pub fn parameters(&self, name: &str) -> Option<Vec<(String, String)>> {
        let task = &self.task;
        let action = task.actions.iter().find(|a| a.name == name).map(|a| &a.parameters);
        let predicate = || task.predicates.iter().find(|p| p.name == name).map(|p| &p.parameters);
        let function = || task.functions.iter().find(|f| f.name == name).map(|f| &f.parameters);
        let call = || task.modules.iter().find(|m| m.name == name).map(|m| &m.parameters);
        let found = action.or_else(predicate).or_else(function).or_else(call)?;
        Some(found.iter().map(|p| (p.name.clone(), self.type_name(&p.types))).collect())
    }

    /// Constants of a type or its subtypes.
    pub fn constants(&self, of: &str) -> Vec<String> {
        let is = |types: &[TypeId]| types.iter().any(|id| self.is_a(&self.task.type_of(*id).name, of));
        self.task.objects.iter().filter(|o| is(&o.types)).map(|o| o.name.clone()).collect()
    }

    /// True if an action's effects change a predicate or function.
    pub fn is_changed(&self, word: &str) -> bool {
        self.changed.contains(word)
    }

    /// Names of the actions whose effects change a predicate or function.
    pub fn changers(&self, word: &str) -> Vec<&str> {
        let changes = |action: &Action| {
            let rates =
                action.continuous.iter().any(|rate| self.task.function(rate.fluent.function).name == *word);
            let effects = action.effects.start.iter().chain(&action.effects.end);
            rates
                || effects.flat_map(|effect| changed_by(&self.task, &effect.change)).any(|name| name == word)
        };
        self.task.actions.iter().filter(|action| changes(action)).map(|action| action.name.as_str()).collect()
    }

    /// True if an action's start condition compares a numeric function.
    pub fn is_compared(&self, word: &str) -> bool {
        let is_it = |fluent: &Fluent| self.task.function(fluent.function).name == *word;
        self.task.actions.iter().any(|action| compares(&action.condition.start, &is_it))
    }

    /// True if an action sets a predicate or function regardless of the earlier value.
    pub fn is_given(&self, word: &str) -> bool {
        self.given.contains(word)
    }

    fn type_name(&self, types: &[TypeId]) -> String {
        types.first().map_or_else(|| "object".into(), |id| self.task.type_of(*id).name.clone())
    }
}

/// Name of the domain in `(define (domain …`; a missing name is left to the parser to report.
fn domain_name(text: &str) -> String {
    let lower: String =
        text.lines().map(|l| l.split(';').next().unwrap_or_default()).collect::<Vec<_>>().join(" ");
    let mut tokens =
        lower.split(|c: char| c.is_whitespace() || c == '(' || c == ')').filter(|t| !t.is_empty());
    let found = tokens.by_ref().find(|t| t.eq_ignore_ascii_case("domain")).and_then(|_| tokens.next());
    found.unwrap_or("domain").to_string()
}

/// True if a condition compares a numeric function that `is_it` accepts.
fn compares(condition: &Condition, is_it: &dyn Fn(&Fluent) -> bool) -> bool {
    match condition {
        Condition::And(parts) | Condition::Or(parts) => parts.iter().any(|part| compares(part, is_it)),
        Condition::Not(inner) | Condition::Forall(_, inner) | Condition::Exists(_, inner) => {
            compares(inner, is_it)
        }
        Condition::Compare(_, sides, _) => sides.iter().any(|side| reads(side, is_it)),
        Condition::Atom(_) | Condition::Same(..) | Condition::Call(_) => false,
    }
}

fn reads(expression: &Expression, is_it: &dyn Fn(&Fluent) -> bool) -> bool {
    match expression {
        Expression::Fluent(fluent) => is_it(fluent),
        Expression::Add(parts) | Expression::Multiply(parts) => parts.iter().any(|part| reads(part, is_it)),
        Expression::Subtract(sides) | Expression::Divide(sides) => {
            sides.iter().any(|side| reads(side, is_it))
        }
        Expression::Negative(inner) => reads(inner, is_it),
        _ => false,
    }
}

/// Names of the predicates and functions changed by those action effects that `is_such` accepts.
fn changed(task: &Task, is_such: impl Fn(&Change) -> bool) -> BTreeSet<String> {
    let effects = task.actions.iter().flat_map(|a| a.effects.start.iter().chain(&a.effects.end));
    effects.filter(|effect| is_such(&effect.change)).flat_map(|e| changed_by(task, &e.change)).collect()
}

/// Names of the predicates and functions that an effect changes.
fn changed_by(task: &Task, change: &Change) -> Vec<String> {
    let predicate = |id: descry_planner::task::PredicateId| task.predicate(id).name.clone();
    let function = |id: descry_planner::task::FunctionId| task.function(id).name.clone();
    match change {
        Change::Add(atom) | Change::Delete(atom) => vec![predicate(atom.predicate)],
        Change::Number(_, fluent, _) | Change::Object(fluent, _) => vec![function(fluent.function)],
        Change::Call(call) => {
            let written = |w: &Written| match w {
                Written::Number(f) | Written::Object(f) => function(f.function),
                Written::Truth(atom) => predicate(atom.predicate),
            };
            task.module(call.module).writes.iter().map(written).collect()
        }
    }
}
