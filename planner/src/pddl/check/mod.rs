//! Checks that turn syntax trees into a [`Task`]: every name is looked up, every argument counted
//! and typed, and all findings are collected.

mod actions;
mod between;
mod conditions;
mod declarations;
mod expressions;
mod goals;
mod initial;
mod lints;
mod names;
mod rates;
mod requirements;
mod strata;
mod usage;

pub(crate) use lints::defeated;
pub(crate) use usage::without_value;

use std::sync::Arc;

use rustc_hash::{FxHashMap, FxHashSet};

use super::ast::{self, Symbol};
use super::lex::Symbols;
use super::parse;
use crate::diagnostic::{Diagnostic, Findings, Severity, Source, Span};
use crate::task::{Condition, Init, Object, ObjectId, Quantified, Scoped, Slot, Task, Type, TypeId};

/// All findings, errors and warnings, in a domain (and a problem), in text order.
pub fn check(domain: &Source, problem: Option<&Source>) -> Findings {
    read_all(domain, problem, true).1
}

impl Task {
    /// Reads and checks a domain and a problem.
    ///
    /// # Errors
    /// All findings, if at least one is an error.
    pub fn read(domain: &Source, problem: &Source) -> Result<Task, Findings> {
        let (task, findings) = read_all(domain, Some(problem), false);
        if findings.has_errors() { Err(findings) } else { Ok(task) }
    }
}

fn read_all(domain: &Source, problem: Option<&Source>, lints: bool) -> (Task, Findings) {
    let _span = tracing::debug_span!("read", domain = domain.name).entered();
    let sources: Vec<Source> = [Some(domain), problem].into_iter().flatten().cloned().collect();
    let mut symbols = Symbols::default();
    let mut list = Vec::new();
    let domain_tree = parse::domain(&domain.text, 0, &mut symbols, &mut list);
    let problem_tree = problem.map(|problem| parse::problem(&problem.text, 1, &mut symbols, &mut list));
    let torn: Vec<Span> =
        list.iter().filter(|finding| is_torn(finding)).map(|finding| finding.labels[0].span).collect();
    let mut checker = Checker::new(&sources, &symbols, list);
    checker.domain(&domain_tree, problem_tree.as_ref());
    if let Some(problem) = &problem_tree {
        checker.problem(problem, &domain_tree);
    }
    checker.told_between();
    let readable = checker.findings.iter().all(|finding| finding.severity != Severity::Error);
    if lints && readable {
        checker.requirements(&domain_tree, problem_tree.as_ref());
        checker.findings.extend(defeated(&checker.task));
        if problem_tree.is_some() {
            checker.lints();
        }
    }
    let Checker { task, mut findings, .. } = checker;
    if domain_tree.unread || problem_tree.as_ref().is_some_and(|problem| problem.unread) {
        findings.retain(|finding| !is_missed(finding));
    }
    // What follows from a missing parenthesis, or from what is not read, is no finding of its own; a misspelt name is.
    findings.retain(|finding| {
        let place = finding.labels.first().map_or(Span::default(), |label| label.span);
        is_torn(finding)
            || is_misspelt(finding)
            || !torn.iter().any(|&span| same_section(&sources, span, place))
    });
    // Stable: findings at one place stay in the order in which they were made.
    findings.sort_by_key(|finding: &Diagnostic| finding.labels.first().map(|label| label.span));
    (task, Findings { sources, list: findings })
}

/// True if a finding is about parentheses that could not be read as intended.
fn is_torn(finding: &Diagnostic) -> bool {
    matches!(finding.code, "unbalanced" | "too-deep")
}

/// True if a finding reports a missing name that a part which could not be parsed may declare.
fn is_missed(finding: &Diagnostic) -> bool {
    let names = ["undeclared-type", "undeclared-predicate", "undeclared-function", "undeclared-object"];
    let is_near = finding.help.as_ref().is_some_and(|help| help.starts_with("did you mean"));
    matches!(finding.code, "no-goal" | "no-domain") || names.contains(&finding.code) && !is_near
}

/// True if a finding reports an undeclared name and suggests a declared one.
fn is_misspelt(finding: &Diagnostic) -> bool {
    let is_near = finding.help.as_ref().is_some_and(|help| help.starts_with("did you mean"));
    matches!(finding.code, "undeclared-predicate" | "undeclared-function") && is_near
}

/// True if no section (a line that begins with `(:`) starts between two spans.
fn same_section(sources: &[Source], one: Span, other: Span) -> bool {
    if one.source != other.source {
        return false;
    }
    let (from, to) = (one.start.min(other.start) as usize, one.start.max(other.start) as usize);
    let between = sources.get(one.source as usize).and_then(|source| source.text.get(from..to)).unwrap_or("");
    !between.lines().skip(1).any(|line| line.trim_start().starts_with("(:"))
}

/// Variable in scope.
struct Variable {
    symbol: Symbol,
    slot: Slot,
    types: Vec<TypeId>,
}

/// Variables in scope, innermost last, and the number of slots assigned so far.
#[derive(Default)]
struct Scope {
    variables: Vec<Variable>,
    slots: usize,
}

impl Scope {
    fn find(&self, symbol: Symbol) -> Option<&Variable> {
        self.variables.iter().rev().find(|variable| variable.symbol == symbol)
    }
}

struct Checker<'a> {
    symbols: &'a Symbols,
    task: Task,
    findings: Vec<Diagnostic>,
    types: FxHashMap<Symbol, TypeId>,
    objects: Vec<Option<ObjectId>>,
    predicates: FxHashMap<Symbol, u32>,
    functions: FxHashMap<Symbol, u32>,
    modules: FxHashMap<Symbol, u32>,
    actions: FxHashMap<Symbol, Span>,
    preferences: FxHashMap<Symbol, u32>,
    /// Objects of any of these types, by list of types (cache).
    fitting: FxHashMap<Vec<TypeId>, Arc<[ObjectId]>>,
    /// Undeclared names already reported, by code of the finding and name: the index of the
    /// finding, which collects further uses, and the nearest declared name.
    reported: FxHashMap<(&'static str, Symbol), (usize, Option<String>)>,
    /// Undeclared functions and objects in initial values that were reported and dropped.
    left_out: FxHashSet<Symbol>,
}

impl<'a> Checker<'a> {
    fn new(sources: &[Source], symbols: &'a Symbols, findings: Vec<Diagnostic>) -> Self {
        let task = Task {
            sources: sources.to_vec().into(),
            domain: String::new(),
            problem: String::new(),
            types: Vec::new(),
            objects: Vec::new(),
            predicates: Vec::new(),
            functions: Vec::new(),
            modules: Vec::new(),
            rules: Vec::new(),
            actions: Vec::new(),
            init: Init::default(),
            goal: Scoped { slots: 0, body: Condition::TRUE },
            goal_span: Span::default(),
            constraints: Vec::new(),
            preferences: Vec::new(),
            metric: None,
            module_options: Vec::new(),
            module_exit_options: Vec::new(),
            objects_by_name: Arc::default(),
        };
        Checker {
            symbols,
            task,
            findings,
            types: FxHashMap::default(),
            objects: vec![None; symbols.len()],
            predicates: FxHashMap::default(),
            functions: FxHashMap::default(),
            modules: FxHashMap::default(),
            actions: FxHashMap::default(),
            preferences: FxHashMap::default(),
            fitting: FxHashMap::default(),
            reported: FxHashMap::default(),
            left_out: FxHashSet::default(),
        }
    }

    fn name(&self, symbol: Symbol) -> &'a str {
        self.symbols.name(symbol)
    }

    /// Source text at a span.
    fn written(&self, span: Span) -> &str {
        let text = self.task.sources.get(span.source as usize).map_or("", |source| source.text.as_str());
        text.get(span.start as usize..span.end as usize).unwrap_or("")
    }

    fn push(&mut self, finding: Diagnostic) {
        self.findings.push(finding);
    }

    fn domain(&mut self, domain: &ast::Domain, problem: Option<&ast::ProblemAst>) {
        self.task.domain = domain.name.map(|name| self.name(name.symbol).to_string()).unwrap_or_default();
        self.declare_types(&domain.types);
        self.declare_objects(&domain.constants);
        if let Some(problem) = problem {
            self.declare_objects(&problem.objects);
        }
        self.fill_types();
        self.declare_predicates(&domain.predicates);
        self.declare_functions(&domain.functions);
        self.declare_derived(&domain.derived);
        self.declare_modules(&domain.modules);
        self.derived_rules(&domain.derived);
        self.order_strata();
        for action in &domain.actions {
            self.action(action);
        }
        self.steady_rates();
        for constraint in &domain.constraints {
            self.constraint(constraint);
        }
        self.task.module_options = self.options(&domain.module_options);
    }

    fn problem(&mut self, problem: &ast::ProblemAst, domain: &ast::Domain) {
        self.task.problem = problem.name.map(|name| self.name(name.symbol).to_string()).unwrap_or_default();
        self.same_domain(problem, domain);
        self.initial(&problem.initial);
        self.task.goal_span = problem.goal_span;
        match &problem.goal {
            Some(goal) => self.goal(goal),
            None if problem.name.is_some() => self.no_goal(problem),
            None => {}
        }
        for constraint in &problem.constraints {
            self.constraint(constraint);
        }
        if let Some(metric) = &problem.metric {
            self.metric(metric);
        }
        self.task.module_options.extend(self.options(&problem.module_options));
        self.task.module_exit_options = self.options(&problem.module_exit_options);
    }

    fn same_domain(&mut self, problem: &ast::ProblemAst, domain: &ast::Domain) {
        let Some(is) = domain.name else { return };
        let Some(said) = problem.domain else { return self.no_domain(problem, is) };
        if said.symbol != is.symbol {
            let (said_name, is_name) = (self.name(said.symbol), self.name(is.symbol));
            let message =
                format!("the problem belongs to domain `{said_name}`, the domain is called `{is_name}`");
            self.push(
                Diagnostic::warning("other-domain", message, said.span, "another domain is named here")
                    .with_label(is.span, "this is the domain that was read"),
            );
        }
    }

    fn no_domain(&mut self, problem: &ast::ProblemAst, is: ast::Name) {
        if let Some(name) = problem.name {
            let message = "the problem does not say which domain it belongs to";
            self.push(
                Diagnostic::warning("no-domain", message, name.span, "this problem")
                    .with_help(format!("add `(:domain {})`", self.name(is.symbol))),
            );
        }
    }

    fn no_goal(&mut self, problem: &ast::ProblemAst) {
        if let Some(name) = problem.name {
            self.push(
                Diagnostic::error("no-goal", "the problem has no goal", name.span, "this problem")
                    .with_help("add `(:goal (and …))`"),
            );
        }
    }

    /// Objects of at least one of the types.
    fn fitting(&mut self, types: &[TypeId]) -> Arc<[ObjectId]> {
        if let Some(objects) = self.fitting.get(types) {
            return objects.clone();
        }
        let objects: Arc<[ObjectId]> = match types {
            [one] => self.task.type_of(*one).objects.as_slice().into(),
            _ => {
                let mut all: Vec<ObjectId> =
                    types.iter().flat_map(|&id| self.task.type_of(id).objects.iter().copied()).collect();
                all.sort_unstable();
                all.dedup();
                all.into()
            }
        };
        self.fitting.insert(types.to_vec(), objects.clone());
        objects
    }

    /// Adds quantified variables to a scope. To close their scope, truncate `scope.variables` to
    /// the returned length.
    fn quantify(&mut self, variables: &[ast::Typed], scope: &mut Scope) -> (usize, Vec<Quantified>) {
        let before = scope.variables.len();
        let mut quantified = Vec::with_capacity(variables.len());
        for typed in variables {
            let parameter = self.parameter(typed);
            let slot = Slot(scope.slots as u32);
            scope.slots += 1;
            scope.variables.push(Variable {
                symbol: typed.name.symbol,
                slot,
                types: parameter.types.clone(),
            });
            quantified.push(Quantified { slot, parameter });
        }
        (before, quantified)
    }

    /// Types as text: `block`, `car or truck`.
    fn types_text(&self, types: &[TypeId]) -> String {
        types.iter().map(|&id| self.task.type_of(id).name.as_str()).collect::<Vec<_>>().join(" or ")
    }

    /// True if some object may be of a type of `one` and of a type of `other`.
    fn overlap(&self, one: &[TypeId], other: &[TypeId]) -> bool {
        let is = |own: &Type, types: &[TypeId]| own.ancestors.iter().any(|ancestor| types.contains(ancestor));
        self.task.types.iter().any(|own| is(own, one) && is(own, other))
            || self.task.objects.iter().any(|Object { types, .. }| {
                types.len() > 1
                    && types.iter().any(|&own| is(self.task.type_of(own), one))
                    && types.iter().any(|&own| is(self.task.type_of(own), other))
            })
    }
}
