//! Lookup of names. An undeclared name is reported once, with the nearest declared name.

use rustc_hash::FxHashMap;

use super::{Checker, Scope};
use crate::diagnostic::{Diagnostic, Span};
use crate::pddl::ast::{Name, Symbol};
use crate::pddl::nearest;
use crate::task::{FunctionId, ModuleId, ObjectId, PredicateId, Task, Term, TypeId};

/// Maximum number of further uses of an undeclared name that are shown.
const MORE_USES: usize = 2;

impl Checker<'_> {
    pub(super) fn find_type(&mut self, name: Name) -> Option<TypeId> {
        if let Some(&id) = self.types.get(&name.symbol) {
            return Some(id);
        }
        let known = |task: &Task| task.types.iter().map(|own| own.name.clone()).collect();
        let near = self.undeclared("undeclared-type", "type", ":types", name, known)?;
        self.types.get(&self.symbols.find(&near)?).copied()
    }

    pub(super) fn find_object(&mut self, name: Name) -> Option<ObjectId> {
        if let Some(id) = self.objects[name.symbol.0 as usize] {
            return Some(id);
        }
        let known = |task: &Task| task.objects.iter().map(|own| own.name.clone()).collect();
        let section = if name.span.source == 0 { ":constants" } else { ":objects" };
        let near = self.undeclared("undeclared-object", "object", section, name, known)?;
        self.task.find_object(&near)
    }

    pub(super) fn find_predicate(&mut self, name: Name) -> Option<PredicateId> {
        if let Some(&id) = self.predicates.get(&name.symbol) {
            return Some(PredicateId(id));
        }
        let known = |task: &Task| task.predicates.iter().map(|own| own.name.clone()).collect();
        let near = self.undeclared("undeclared-predicate", "predicate", ":predicates", name, known)?;
        self.task.find_predicate(&near)
    }

    pub(super) fn find_function(&mut self, name: Name) -> Option<FunctionId> {
        if let Some(&id) = self.functions.get(&name.symbol) {
            return Some(FunctionId(id));
        }
        if self.predicates.contains_key(&name.symbol) {
            let message = format!("`{}` is a predicate, a function was expected", self.name(name.symbol));
            let label = "true or false, not a value";
            self.push(Diagnostic::error("wrong-kind", message, name.span, label));
            return None;
        }
        let known = |task: &Task| task.functions.iter().map(|own| own.name.clone()).collect();
        let near = self.undeclared("undeclared-function", "function", ":functions", name, known)?;
        self.task.find_function(&near)
    }

    pub(super) fn find_module(&mut self, name: Name) -> Option<ModuleId> {
        if let Some(&id) = self.modules.get(&name.symbol) {
            return Some(ModuleId(id));
        }
        let known = |task: &Task| task.modules.iter().map(|own| own.name.to_ascii_lowercase()).collect();
        let near = self.undeclared("missing-attachment", "module", ":modules", name, known)?;
        let at = self.task.modules.iter().position(|own| own.name.eq_ignore_ascii_case(&near))?;
        Some(ModuleId(at as u32))
    }

    pub(super) fn unknown_variable(&mut self, name: Name, scope: &Scope) {
        let variable = self.name(name.symbol);
        let message = format!("variable `{variable}` is not a parameter and not quantified here");
        let known: Vec<&str> = scope.variables.iter().map(|variable| self.name(variable.symbol)).collect();
        let near = nearest(variable, known.iter().copied());
        let finding = Diagnostic::error("undeclared-variable", message, name.span, "unknown variable");
        let finding = match near {
            Some(near) => finding.with_help(format!("did you mean `{near}`?")),
            None if known.is_empty() => finding.with_help("no variable is declared here"),
            None => finding.with_help(format!("variables here: {}", known.join(" "))),
        };
        self.push(finding);
    }

    /// Variable that a name stands for whose question mark was forgotten; reports the mistake.
    /// `None` if the name is an object, or if no such variable is in scope.
    pub(super) fn without_question_mark(&mut self, name: Name, scope: &Scope) -> Option<(Term, Vec<TypeId>)> {
        if self.objects[name.symbol.0 as usize].is_some() {
            return None;
        }
        let written = self.name(name.symbol);
        let variable = scope.find(self.symbols.find(&format!("?{written}"))?)?;
        let meant = (Term::Variable(variable.slot), variable.types.clone());
        let message = format!("object `{written}` is not declared");
        let finding = Diagnostic::error("undeclared-object", message, name.span, "unknown object");
        let help = format!("did you mean `?{written}`?");
        self.push(finding.with_help(help));
        Some(meant)
    }

    /// Remedy for an undeclared name that resembles no declared one.
    fn help_for(&self, kind: &str, section: &str, name: Name) -> String {
        let written = self.name(name.symbol);
        match kind {
            "module" if self.predicates.contains_key(&name.symbol) => {
                format!("a predicate has this name, and is written `({written} …)`")
            }
            "module" if self.functions.contains_key(&name.symbol) => {
                format!("a function has this name, and is written `({written} …)`")
            }
            "predicate" if ["at", "over"].contains(&written) => format!(
                "declare it in `({section} …)`; `({written} …)` as a time stands in a `:durative-action` alone"
            ),
            _ => format!("declare it in `({section} …)`"),
        }
    }

    /// Reports an undeclared name; returns the declared name that was probably meant, if any.
    fn undeclared(
        &mut self,
        code: &'static str,
        kind: &str,
        section: &str,
        name: Name,
        known: impl Fn(&Task) -> Vec<String>,
    ) -> Option<String> {
        let written = self.name(name.symbol);
        if let Some((finding, near)) = self.reported.get(&(code, name.symbol)) {
            let finding = &mut self.findings[*finding];
            if finding.labels.len() <= MORE_USES {
                finding
                    .labels
                    .push(crate::diagnostic::Label { span: name.span, text: "used here too".into() });
            }
            return near.clone();
        }
        let known = known(&self.task);
        let near = nearest(written, known.iter().map(String::as_str)).map(str::to_string);
        let message = format!("{kind} `{written}` is not declared");
        let finding = Diagnostic::error(code, message, name.span, format!("unknown {kind}"));
        let finding = match &near {
            Some(near) => {
                let finding = finding.with_help(format!("did you mean `{near}`?"));
                match self.declaration(kind, near) {
                    Some(span) => finding.with_label(span, format!("`{near}` is declared here")),
                    None => finding,
                }
            }
            None => finding.with_help(self.help_for(kind, section, name)),
        };
        self.reported.insert((code, name.symbol), (self.findings.len(), near.clone()));
        self.push(finding);
        near
    }

    /// Span of the declaration of a name; `None` for built-in names.
    fn declaration(&self, kind: &str, name: &str) -> Option<Span> {
        let task = &self.task;
        match kind {
            "type" => task.types.iter().find(|own| own.name == name).map(|own| own.span),
            "object" => task.objects.iter().find(|own| own.name == name).map(|own| own.span),
            "predicate" => task.predicates.iter().find(|own| own.name == name).map(|own| own.span),
            "function" => task.functions.iter().find(|own| own.name == name).map(|own| own.span),
            _ => task.modules.iter().find(|own| own.name.eq_ignore_ascii_case(name)).map(|own| own.span),
        }
        .filter(|span| span.end > 0)
    }

    /// Registers a declared name under `id`, or reports that it was declared before (at `first`);
    /// true if the name is new.
    pub(super) fn declare(
        &mut self,
        kind: &str,
        name: Name,
        first: Option<Span>,
        index: impl FnOnce(&mut Self) -> &mut FxHashMap<Symbol, u32>,
        id: usize,
    ) -> bool {
        if let Some(first) = first {
            let message = format!("{kind} `{}` is declared twice", self.name(name.symbol));
            self.push(
                Diagnostic::error("duplicate", message, name.span, "declared again here")
                    .with_label(first, "first declared here")
                    .with_help("remove or rename one of them"),
            );
            return false;
        }
        index(self).insert(name.symbol, id as u32);
        true
    }
}
