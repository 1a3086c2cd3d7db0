//! Checks of the declarations of types, objects, predicates, functions and modules.

use std::sync::Arc;

use super::{Checker, Scope, Variable};
use crate::attachment::CallKind;
use crate::diagnostic::{Diagnostic, Span};
use crate::pddl::ast::{self, Name, Symbol};
use crate::pddl::nearest;
use crate::task::{
    Atom, Function, FunctionId, Module, ModuleOption, Object, ObjectId, Parameter, Predicate, PredicateId,
    Slot, Type, TypeId, Written,
};

/// Type `object`, the supertype of all types.
const OBJECT: TypeId = TypeId(0);

impl Checker<'_> {
    pub(super) fn declare_types(&mut self, declared: &[ast::Typed]) {
        self.add_type("object", Span::default(), self.symbols.find("object"));
        for typed in declared {
            self.type_id(typed.name);
        }
        for typed in declared {
            let own = self.type_id(typed.name);
            for &parent in &typed.types {
                // A supertype needs no declaration of its own.
                let parent = self.type_id(parent);
                let parents = &mut self.task.types[own.index()].parents;
                if own != OBJECT && !parents.contains(&parent) && !(own == parent && typed.types.len() == 1) {
                    parents.push(parent);
                }
            }
        }
        for index in 1..self.task.types.len() {
            if self.task.types[index].parents.is_empty() {
                self.task.types[index].parents.push(OBJECT);
            }
        }
        self.type_cycles(declared);
        for index in 0..self.task.types.len() {
            self.task.types[index].ancestors = self.ancestors(TypeId(index as u32));
        }
    }

    fn add_type(&mut self, name: &str, span: Span, symbol: Option<Symbol>) -> TypeId {
        let id = TypeId(self.task.types.len() as u32);
        let name = name.to_string();
        self.task.types.push(Type {
            name,
            parents: Vec::new(),
            ancestors: Vec::new(),
            objects: Vec::new(),
            span,
        });
        if let Some(symbol) = symbol {
            self.types.insert(symbol, id);
        }
        id
    }

    fn type_id(&mut self, name: Name) -> TypeId {
        match self.types.get(&name.symbol) {
            Some(&id) => id,
            None => self.add_type(self.name(name.symbol), name.span, Some(name.symbol)),
        }
    }

    fn ancestors(&self, id: TypeId) -> Vec<TypeId> {
        let mut found = vec![id];
        let mut next = 0;
        while let Some(&own) = found.get(next) {
            next += 1;
            for &parent in &self.task.type_of(own).parents {
                if !found.contains(&parent) {
                    found.push(parent);
                }
            }
        }
        if !found.contains(&OBJECT) {
            found.push(OBJECT);
        }
        found
    }

    /// Reports each cycle of types once, and breaks the cycle.
    fn type_cycles(&mut self, declared: &[ast::Typed]) {
        for index in 1..self.task.types.len() {
            let start = TypeId(index as u32);
            let Some(path) = self.path_to_itself(start) else { continue };
            let names: Vec<&str> = path.iter().map(|&id| self.task.type_of(id).name.as_str()).collect();
            let circle = format!("{} - {}", names.join(" - "), names[0]);
            let place = |id: TypeId| {
                let of = |typed: &&ast::Typed| {
                    self.types.get(&typed.name.symbol) == Some(&id) && !typed.types.is_empty()
                };
                declared.iter().find(of).map_or(self.task.type_of(id).span, |typed| typed.name.span)
            };
            let message = format!("types are their own supertypes: {circle}");
            let label = format!("`{}` is a `{}`", names[0], names.get(1).unwrap_or(&names[0]));
            let mut finding = Diagnostic::error("cyclic-types", message, place(start), label);
            for (position, &id) in path.iter().enumerate().skip(1) {
                let parent = names.get(position + 1).unwrap_or(&names[0]);
                finding = finding.with_label(place(id), format!("`{}` is a `{parent}`", names[position]));
            }
            self.push(finding.with_help("remove one of these supertypes"));
            for id in path {
                self.task.types[id.index()].parents = vec![OBJECT];
            }
        }
    }

    fn path_to_itself(&self, start: TypeId) -> Option<Vec<TypeId>> {
        let mut paths = vec![vec![start]];
        let mut seen = vec![false; self.task.types.len()];
        while let Some(path) = paths.pop() {
            let last = path.last().copied()?;
            for &parent in &self.task.type_of(last).parents {
                if parent == start {
                    return Some(path);
                }
                if !std::mem::replace(&mut seen[parent.index()], true) {
                    let mut longer = path.clone();
                    longer.push(parent);
                    paths.push(longer);
                }
            }
        }
        None
    }

    pub(super) fn declare_objects(&mut self, declared: &[ast::Typed]) {
        for typed in declared {
            let types = self.type_ids(&typed.types);
            let Some(first) = self.objects[typed.name.symbol.0 as usize] else {
                let id = ObjectId(self.task.objects.len() as u32);
                let name = self.name(typed.name.symbol).to_string();
                self.task.objects.push(Object { name, types, span: typed.name.span });
                self.objects[typed.name.symbol.0 as usize] = Some(id);
                continue;
            };
            let known = &mut self.task.objects[first.index()];
            if types.iter().all(|own| known.types.contains(own)) {
                // Many problems list the constants of their domain again.
                if known.span.source == typed.name.span.source {
                    let (message, place) = (format!("object `{}` is declared twice", known.name), known.span);
                    self.push(
                        Diagnostic::warning("duplicate", message, typed.name.span, "declared again here")
                            .with_label(place, "first declared here")
                            .with_help("remove one of them; if two objects are meant, rename one"),
                    );
                }
                continue;
            }
            // Several competitions give an object more than one type like this.
            let (name, place) = (known.name.clone(), known.span);
            known.types.extend(types.iter().copied());
            known.types.sort_unstable();
            known.types.dedup();
            let message = format!("object `{name}` is declared twice, with different types");
            let label = format!("a `{}` here", self.types_text(&types));
            self.push(
                Diagnostic::warning("duplicate", message, typed.name.span, label)
                    .with_label(place, "first declared here")
                    .with_help("it is taken to be of both types; if two objects are meant, rename one"),
            );
        }
    }

    pub(super) fn fill_types(&mut self) {
        for (index, object) in self.task.objects.iter().enumerate() {
            let id = ObjectId(index as u32);
            let mut all: Vec<TypeId> = object
                .types
                .iter()
                .flat_map(|own| self.task.types[own.index()].ancestors.iter().copied())
                .collect();
            all.sort_unstable();
            all.dedup();
            for own in all {
                self.task.types[own.index()].objects.push(id);
            }
        }
        let names = self.task.objects.iter().enumerate();
        self.task.objects_by_name =
            Arc::new(names.map(|(index, own)| (own.name.clone(), ObjectId(index as u32))).collect());
    }

    /// Types of these names; `object` if none is given or declared.
    fn type_ids(&mut self, names: &[Name]) -> Vec<TypeId> {
        let mut types: Vec<TypeId> = names.iter().filter_map(|&name| self.find_type(name)).collect();
        if types.is_empty() {
            types.push(OBJECT);
        }
        types
    }

    pub(super) fn parameter(&mut self, typed: &ast::Typed) -> Parameter {
        let types = self.type_ids(&typed.types);
        self.parameter_of(typed.name, types)
    }

    fn parameter_of(&mut self, name: Name, types: Vec<TypeId>) -> Parameter {
        let objects = self.fitting(&types);
        Parameter { name: self.name(name.symbol).to_string(), types, objects, span: name.span }
    }

    pub(super) fn parameters(&mut self, declared: &[ast::Typed]) -> Vec<Parameter> {
        declared.iter().map(|typed| self.parameter(typed)).collect()
    }

    /// Checks the parameters of an action, rule or module and opens them in `scope`; reports
    /// duplicates.
    pub(super) fn scoped_parameters(&mut self, declared: &[ast::Typed], scope: &mut Scope) -> Vec<Parameter> {
        for (index, typed) in declared.iter().enumerate() {
            let Some(first) = declared[..index].iter().find(|first| first.name.symbol == typed.name.symbol)
            else {
                continue;
            };
            let message = format!("parameter `{}` is declared twice", self.name(typed.name.symbol));
            self.push(
                Diagnostic::error("duplicate", message, typed.name.span, "declared again here")
                    .with_label(first.name.span, "first declared here")
                    .with_help("rename one of them"),
            );
        }
        let parameters = self.parameters(declared);
        for (typed, parameter) in declared.iter().zip(&parameters) {
            let slot = Slot(scope.slots as u32);
            scope.slots += 1;
            scope.variables.push(Variable {
                symbol: typed.name.symbol,
                slot,
                types: parameter.types.clone(),
            });
        }
        parameters
    }

    pub(super) fn declare_predicates(&mut self, declared: &[ast::Signature]) {
        for signature in declared {
            let parameters = self.parameters(&signature.parameters);
            self.declare_predicate(signature.name, parameters);
        }
    }

    fn declare_predicate(&mut self, name: Name, parameters: Vec<Parameter>) {
        let id = self.task.predicates.len();
        let known = self.predicates.get(&name.symbol).map(|&known| &self.task.predicates[known as usize]);
        if let Some(known) = known {
            let types = |all: &[Parameter]| all.iter().map(|one| one.types.clone()).collect::<Vec<_>>();
            if types(&known.parameters) == types(&parameters) {
                let first = known.span;
                let message = format!("predicate `{}` is declared twice in the same way", known.name);
                self.push(
                    Diagnostic::warning("duplicate", message, name.span, "declared again here")
                        .with_label(first, "first declared here"),
                );
                return;
            }
        }
        let first = known.map(|known| known.span);
        if self.declare("predicate", name, first, |checker| &mut checker.predicates, id) {
            let span = name.span;
            let name = self.name(name.symbol).to_string();
            self.task.predicates.push(Predicate { name, parameters, stratum: None, span });
        }
    }

    /// Declares derived predicates that `:predicates` lacks, by the heads of their rules.
    pub(super) fn declare_derived(&mut self, derived: &[ast::Derived]) {
        for rule in derived {
            let name = rule.head.name;
            match self.predicates.get(&name.symbol) {
                None => {
                    let parameters = self.parameters(&rule.head.parameters);
                    self.declare_predicate(name, parameters);
                }
                Some(&known) => {
                    let (wanted, found) =
                        (self.task.predicates[known as usize].parameters.len(), rule.head.parameters.len());
                    if wanted != found {
                        let declared = self.task.predicates[known as usize].span;
                        let message = format!(
                            "`{}` takes {wanted} arguments, this rule has {found}",
                            self.name(name.symbol)
                        );
                        self.push(
                            Diagnostic::error("arity", message, name.span, format!("{found} here"))
                                .with_label(declared, "declared here"),
                        );
                    }
                }
            }
            if let Some(&id) = self.predicates.get(&name.symbol) {
                self.task.predicates[id as usize].stratum = Some(0);
            }
        }
    }

    pub(super) fn declare_functions(&mut self, declared: &[ast::FunctionDeclaration]) {
        for function in declared {
            let name = function.signature.name;
            let parameters = self.parameters(&function.signature.parameters);
            let is_number =
                |of: &Self| function.result.iter().all(|result| of.name(result.symbol) == "number");
            let result = (!is_number(self)).then(|| self.type_ids(&function.result));
            let id = self.task.functions.len();
            let known = self.functions.get(&name.symbol).map(|&known| &self.task.functions[known as usize]);
            if let Some(known) = known {
                let types = |all: &[Parameter]| all.iter().map(|one| one.types.clone()).collect::<Vec<_>>();
                if types(&known.parameters) == types(&parameters) && known.result == result {
                    let (first, message) =
                        (known.span, format!("function `{}` is declared twice in the same way", known.name));
                    self.push(
                        Diagnostic::warning("duplicate", message, name.span, "declared again here")
                            .with_label(first, "first declared here"),
                    );
                    continue;
                }
            }
            let first = known.map(|known| known.span);
            if self.declare("function", name, first, |checker| &mut checker.functions, id) {
                let (span, name) = (name.span, self.name(name.symbol).to_string());
                self.task.functions.push(Function { name, parameters, result, span });
            }
        }
    }

    pub(super) fn declare_modules(&mut self, declared: &[ast::ModuleDeclaration]) {
        for module in declared {
            let name = module.signature.name;
            let mut scope = Scope::default();
            let parameters: Vec<ast::Typed> =
                module.signature.parameters.iter().map(|typed| self.known_types(typed)).collect();
            let parameters = self.scoped_parameters(&parameters, &mut scope);
            let writes: Vec<Written> =
                module.writes.iter().filter_map(|term| self.written_place(term, &scope)).collect();
            if module.kind == CallKind::Effect && module.writes.is_empty() {
                let message = format!("effect module `{}` writes nothing", self.written(name.span));
                let help =
                    "list the fluents that it writes before `effect`, as in `(x ?o) (y ?o) effect f@lib.so`";
                self.push(
                    Diagnostic::warning("module", message, name.span, "no fluents listed").with_help(help),
                );
            } else if module.kind != CallKind::Effect && !module.writes.is_empty() {
                let message = format!("module `{}` lists fluents but is no effect", self.written(name.span));
                self.push(Diagnostic::error(
                    "module",
                    message,
                    name.span,
                    "only effect modules write fluents",
                ));
            }
            let id = self.task.modules.len();
            let first = self.modules.get(&name.symbol).map(|&known| self.task.modules[known as usize].span);
            if self.declare("module", name, first, |checker| &mut checker.modules, id) {
                let module = Module {
                    name: self.written(name.span).to_string(),
                    kind: module.kind,
                    parameters,
                    writes,
                    function: self.written(module.function.span).to_string(),
                    span: name.span,
                };
                self.task.modules.push(module);
            }
        }
    }

    /// Declared types of a module's parameter. Unknown types are reported and dropped (all unknown:
    /// `object`), as the planners that such files were written for do not check types.
    fn known_types(&mut self, typed: &ast::Typed) -> ast::Typed {
        let mut known = typed.clone();
        known.types.retain(|name| self.types.contains_key(&name.symbol));
        for name in typed.types.iter().filter(|name| !self.types.contains_key(&name.symbol)) {
            let written = self.name(name.symbol);
            let message = format!("type `{written}` is not declared");
            let finding =
                Diagnostic::warning("undeclared-type", message, name.span, "any object will do here");
            self.findings.push(match nearest(written, self.task.types.iter().map(|own| own.name.as_str())) {
                Some(near) => finding.with_help(format!("did you mean `{near}`?")),
                None => finding,
            });
        }
        known
    }

    /// Term that an effect module writes: a number, an object function or the truth of an atom.
    fn written_place(&mut self, term: &ast::TermAst, scope: &Scope) -> Option<Written> {
        let ast::TermAst::Apply { name, arguments, span } = term else { return None };
        if !self.functions.contains_key(&name.symbol)
            && let Some(&predicate) = self.predicates.get(&name.symbol)
        {
            let predicate = PredicateId(predicate);
            let arguments = self.predicate_arguments(predicate, *name, arguments, *span, scope)?;
            return Some(Written::Truth(Atom { predicate, arguments, span: *span }));
        }
        let fluent = self.fluent(*name, arguments, *span, scope)?;
        let FunctionId(index) = fluent.function;
        Some(match self.task.functions[index as usize].result {
            None => Written::Number(fluent),
            Some(_) => Written::Object(fluent),
        })
    }

    pub(super) fn options(&self, options: &[ast::ModuleOptionAst]) -> Vec<ModuleOption> {
        let option = |option: &ast::ModuleOptionAst| ModuleOption {
            function: self.written(option.function.span).to_string(),
            arguments: option.arguments.iter().map(|name| self.written(name.span).to_string()).collect(),
            span: option.function.span,
        };
        options.iter().map(option).collect()
    }
}
