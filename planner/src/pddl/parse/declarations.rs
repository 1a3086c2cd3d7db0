//! Parsing of requirements, typed lists, predicates, functions, modules, derived predicates and the
//! initial state.

use super::{Parser, refused};
use crate::attachment::CallKind;
use crate::diagnostic::Diagnostic;
use crate::pddl::ast::{
    Derived, FunctionDeclaration, Initial, InitialValue, ModuleDeclaration, ModuleOptionAst, Name, Signature,
    TermAst, Typed,
};
use crate::pddl::lex::Kind;
use crate::pddl::nearest;

/// Supported requirements of PDDL 1.2 to 3.1 and PDDL/M.
const REQUIREMENTS: &[&str] = &[
    ":strips",
    ":typing",
    ":equality",
    ":negative-preconditions",
    ":disjunctive-preconditions",
    ":existential-preconditions",
    ":universal-preconditions",
    ":quantified-preconditions",
    ":conditional-effects",
    ":adl",
    ":fluents",
    ":numeric-fluents",
    ":object-fluents",
    ":durative-actions",
    ":duration-inequalities",
    ":continuous-effects",
    ":derived-predicates",
    ":domain-axioms",
    ":timed-initial-literals",
    ":timed-initial-fluents",
    ":preferences",
    ":constraints",
    ":action-costs",
    ":goal-utilities",
    ":modules",
    ":grounding-modules",
];

/// Requirements whose features change the meaning of everything else and are not supported, with
/// the name of the feature.
const REFUSED: &[(&str, &str)] = &[
    (":time", "PDDL+ processes and events"),
    (":processes", "PDDL+ processes and events"),
    (":events", "PDDL+ processes and events"),
    (":probabilistic-effects", "probabilistic planning"),
    (":mdp", "probabilistic planning"),
    (":rewards", "probabilistic planning"),
    (":non-deterministic", "non-deterministic planning"),
    (":contingent", "contingent planning"),
    (":hierarchy", "hierarchical task networks"),
    (":htn", "hierarchical task networks"),
    (":open-world", "an open world"),
    (":multi-agent", "several agents"),
];

impl Parser<'_> {
    pub(super) fn requirements(&mut self, section: usize, into: &mut Vec<Name>) {
        for node in self.children(section).skip(1) {
            let (Kind::Word(symbol), Some(word)) = (self.tree.nodes[node].kind, self.word(node)) else {
                self.expected("a requirement", node, "requirements look like `:typing`");
                continue;
            };
            let span = self.span(node);
            if !word.starts_with(':') {
                self.expected("a requirement", node, format!("did you mean `:{word}`?"));
                continue;
            }
            if let Some((_, feature)) = REFUSED.iter().find(|(name, _)| *name == word) {
                self.findings.push(refused(word, feature, span));
            } else if !REQUIREMENTS.contains(&word) {
                let diagnostic = Diagnostic::warning(
                    "unknown-requirement",
                    format!("requirement `{word}` is not known"),
                    span,
                    "it changes nothing",
                );
                self.findings.push(match nearest(word, REQUIREMENTS.iter().copied()) {
                    Some(near) => diagnostic.with_help(format!("did you mean `{near}`?")),
                    None => diagnostic,
                });
            }
            into.push(Name { symbol, span });
        }
    }

    /// Parses a typed list, such as `a b - t c - (either t u) d`, from child `skip` of a node on.
    /// `variables`: its names must begin with a question mark.
    pub(super) fn typed_list(&mut self, list: usize, skip: usize, variables: bool) -> Vec<Typed> {
        let mut declared: Vec<Typed> = Vec::new();
        let mut untyped_from = 0;
        let mut nodes = self.children(list).skip(skip).peekable();
        while let Some(node) = nodes.next() {
            let word = self.word(node);
            match (self.tree.nodes[node].kind, word) {
                (_, Some("-")) => {
                    let Some(node) = nodes.next() else {
                        self.fault(
                            "syntax",
                            "`-` without a type after it",
                            node,
                            "expected a type after this",
                        );
                        break;
                    };
                    let types = self.types(node);
                    self.give_types(&mut declared, untyped_from, types);
                    untyped_from = declared.len();
                }
                // A missing space: `?x -block`.
                (Kind::Word(_), Some(glued))
                    if glued.len() > 1 && glued.starts_with('-') && !declared.is_empty() =>
                {
                    let Some(symbol) = self.symbols.find(&glued[1..]) else {
                        self.expected("a type", node, "put a space after the `-`");
                        continue;
                    };
                    let mut span = self.span(node);
                    span.start += 1;
                    self.give_types(&mut declared, untyped_from, vec![Name { symbol, span }]);
                    untyped_from = declared.len();
                }
                (Kind::Word(symbol), Some(word)) => {
                    let name = Name { symbol, span: self.span(node) };
                    if word.starts_with(':') || variables != word.starts_with('?') || word == "?" {
                        let what = if variables { "a variable" } else { "a name" };
                        let help = match word.trim_start_matches(['?', ':']) {
                            "" => "a variable is a `?` with a name behind it".to_string(),
                            bare if variables => format!("did you mean `?{bare}`?"),
                            bare => format!("did you mean `{bare}`?"),
                        };
                        self.expected(what, node, help);
                    }
                    declared.push(Typed { name, types: Vec::new() });
                }
                _ => self.expected("a name or a type", node, "types follow the names, as in `a b - block`"),
            }
        }
        declared
    }

    /// Assigns types to the names from index `from` on.
    fn give_types(&self, declared: &mut [Typed], from: usize, types: Vec<Name>) {
        for typed in &mut declared[from..] {
            typed.types.clone_from(&types);
        }
    }

    /// Parses a type or `(either t u …)`.
    fn types(&mut self, node: usize) -> Vec<Name> {
        if self.is_list(node) && self.head(node) == Some("either") {
            let nodes: Vec<usize> = self.children(node).skip(1).collect();
            return nodes.into_iter().filter_map(|node| self.name(node, "a type")).collect();
        }
        // `(fluent t)` of PDDL 1.2 and a type in needless parentheses.
        if self.is_list(node) && self.children(node).count() == 1 {
            return self
                .children(node)
                .next()
                .and_then(|node| self.name(node, "a type"))
                .into_iter()
                .collect();
        }
        self.name(node, "a type or `(either …)`").into_iter().collect()
    }

    fn signature(&mut self, list: usize, what: &str) -> Option<Signature> {
        let Some(first) = self.children(list).next().filter(|_| self.is_list(list)) else {
            self.expected(what, list, "for example `(on ?x - block ?y - block)`");
            return None;
        };
        let name = self.name(first, what)?;
        Some(Signature { name, parameters: self.typed_list(list, 1, true) })
    }

    pub(super) fn predicates(&mut self, section: usize, into: &mut Vec<Signature>) {
        for node in self.children(section).skip(1) {
            into.extend(self.signature(node, "a predicate"));
        }
    }

    /// Parses the functions of a section, such as `(f ?x) (g) - number (h ?y) - place`.
    pub(super) fn functions(&mut self, section: usize, into: &mut Vec<FunctionDeclaration>) {
        let mut untyped_from = into.len();
        let mut nodes = self.children(section).skip(1);
        while let Some(node) = nodes.next() {
            if self.word(node) == Some("-") {
                let Some(node) = nodes.next() else {
                    self.fault("syntax", "`-` without a type after it", node, "expected a type after this");
                    break;
                };
                let result = self.types(node);
                for function in &mut into[untyped_from..] {
                    function.result.clone_from(&result);
                }
                untyped_from = into.len();
            } else if let Some(signature) = self.signature(node, "a function") {
                into.push(FunctionDeclaration { signature, result: Vec::new() });
            }
        }
    }

    pub(super) fn modules(&mut self, section: usize, into: &mut Vec<ModuleDeclaration>) {
        for node in self.children(section).skip(1) {
            into.extend(self.module(node));
        }
    }

    /// Parses a module, `(name ?a - t … [(f ?a) …] kind fn@lib.so)`.
    fn module(&mut self, list: usize) -> Option<ModuleDeclaration> {
        const SHAPE: &str = "a module is `(name ?a - type … kind function@library)`, \
            its kind cost, conditionchecker, effect (after the fluents that it writes) or grounding";
        let children: Vec<usize> = self.children(list).collect();
        let (Some(&first), true) = (children.first(), self.is_list(list)) else {
            self.expected("a module", list, SHAPE);
            return None;
        };
        let name = self.name(first, "the module's name")?;
        let kind_at = children.iter().enumerate().skip(1).rev().find_map(|(at, &node)| {
            let kind = match self.word(node)? {
                "cost" => CallKind::Cost,
                "conditionchecker" => CallKind::Condition,
                "effect" => CallKind::Effect,
                "grounding" => CallKind::Grounding,
                _ => return None,
            };
            // A type may have one of these names.
            (self.word(children[at - 1]) != Some("-")).then_some((at, kind))
        });
        let Some((at, kind)) = kind_at else {
            let span = self.head_span(list);
            let message = "a module without a kind";
            self.findings.push(Diagnostic::error("syntax", message, span, "which kind?").with_help(SHAPE));
            return None;
        };
        let function = children.get(at + 1).and_then(|&node| self.name(node, "the module's function"));
        if function.is_none() {
            let span = self.span(children[at]);
            let message = "a module without a function";
            let label = "expected `function@library` after this";
            self.findings
                .push(Diagnostic::error("missing-attachment", message, span, label).with_help(SHAPE));
        }
        // Calls of it are looked at all the same.
        let function = function.unwrap_or(name);
        if let Some(&extra) = children.get(at + 2) {
            self.expected("`)`", extra, SHAPE);
        }
        let writes_at =
            children[..at].iter().position(|&node| self.is_list(node) && self.head(node) != Some("either"));
        let end = writes_at.unwrap_or(at);
        let parameters = self.typed_nodes(&children[1..end.max(1)]);
        let writes: Vec<TermAst> =
            children[end..at].iter().filter_map(|&node| self.written_term(node)).collect();
        Some(ModuleDeclaration { signature: Signature { name, parameters }, writes, kind, function })
    }

    /// Parses the typed variables among the children of a module, which has no parameter list of
    /// its own.
    fn typed_nodes(&mut self, nodes: &[usize]) -> Vec<Typed> {
        let mut declared: Vec<Typed> = Vec::new();
        let mut untyped_from = 0;
        let mut nodes = nodes.iter().copied();
        while let Some(node) = nodes.next() {
            match (self.tree.nodes[node].kind, self.word(node)) {
                (_, Some("-")) => {
                    let types = nodes.next().map(|node| self.types(node)).unwrap_or_default();
                    self.give_types(&mut declared, untyped_from, types);
                    untyped_from = declared.len();
                }
                (Kind::Word(symbol), Some(word)) if word.starts_with('?') => {
                    declared.push(Typed { name: Name { symbol, span: self.span(node) }, types: Vec::new() });
                }
                _ => self.expected("a variable", node, "a module's parameters look like `?x - type`"),
            }
        }
        declared
    }

    /// Parses a function or atom that an effect module writes.
    fn written_term(&mut self, node: usize) -> Option<TermAst> {
        if !self.is_list(node) {
            self.expected("a fluent that the module writes", node, "for example `(x ?o)`");
            return None;
        }
        self.object_term(node)
    }

    pub(super) fn module_options(&mut self, section: usize, into: &mut Vec<ModuleOptionAst>) {
        let nodes: Vec<usize> = self.children(section).skip(1).collect();
        self.options_of(&nodes, into);
    }

    fn options_of(&mut self, nodes: &[usize], into: &mut Vec<ModuleOptionAst>) {
        for &node in nodes {
            let words: Vec<usize> = self.children(node).collect();
            let Some((&first, rest)) = words.split_first().filter(|_| self.is_list(node)) else {
                self.expected("an option", node, "for example `(init@libmodule.so argument)`");
                continue;
            };
            let Some(function) = self.name(first, "an option's name") else { continue };
            let arguments = rest.iter().filter_map(|&node| match self.tree.nodes[node].kind {
                Kind::Word(symbol) => Some(Name { symbol, span: self.span(node) }),
                _ => None,
            });
            let arguments: Vec<Name> = arguments.collect();
            if let Some(&list) = rest.iter().find(|&&node| self.word(node).is_none()) {
                self.expected("a word", list, "arguments of options are words");
            }
            into.push(ModuleOptionAst { function, arguments });
        }
    }

    /// Parses `:oplinit`: names such as `init@lib.so`, or options with arguments.
    pub(super) fn module_setup(&mut self, section: usize, into: &mut Vec<ModuleOptionAst>) {
        let (lists, words): (Vec<usize>, Vec<usize>) =
            self.children(section).skip(1).partition(|&node| self.is_list(node));
        for node in words {
            let function = self.name(node, "the function that sets modules up");
            into.extend(function.map(|function| ModuleOptionAst { function, arguments: Vec::new() }));
        }
        self.options_of(&lists, into);
    }

    pub(super) fn derived(&mut self, section: usize) -> Option<Derived> {
        let parts: Vec<usize> = self.children(section).skip(1).collect();
        let [head, body, rest @ ..] = parts.as_slice() else {
            let help = "a derived predicate is `(:derived (head ?x - type) condition)`";
            self.expected("a head and a condition", section, help);
            return None;
        };
        if let Some(&extra) = rest.first() {
            self.expected("`)`", extra, "the condition is one formula; use `(and …)`");
        }
        // Some files write the head without parameters as a bare word.
        let head = match self.word(*head) {
            Some(_) => Signature { name: self.name(*head, "a predicate")?, parameters: Vec::new() },
            None => self.signature(*head, "a predicate")?,
        };
        let body = self.formula(*body, false)?;
        Some(Derived { head, body, span: self.head_span(section) })
    }

    pub(super) fn initial(&mut self, node: usize, into: &mut Vec<Initial>) {
        let help = "facts look like `(at robot kitchen)`, values like `(= (fuel robot) 3)`";
        if !self.is_list(node) {
            self.expected("a fact or value", node, help);
            return;
        }
        match self.head(node) {
            Some("and") => {
                for inner in self.children(node).skip(1) {
                    self.initial(inner, into);
                }
            }
            Some("=") => into.extend(self.initial_value(node)),
            Some("at") if self.is_timed(node) => into.extend(self.timed_initial(node)),
            Some("not") => {
                let atom = self.children(node).nth(1);
                match atom.and_then(|atom| self.initial_literal(atom, true)) {
                    Some(literal) => into.push(literal),
                    None if atom.is_none() => self.expected("a fact in `(not …)`", node, help),
                    None => {}
                }
            }
            Some("oneof" | "unknown" | "or") => {
                let span = self.head_span(node);
                let word = self.head(node).unwrap_or_default();
                self.findings.push(refused(word, "an uncertain initial state", span));
            }
            Some(_) => into.extend(self.initial_literal(node, false)),
            None => self.expected("a fact or value", node, help),
        }
    }

    /// True for a timed literal such as `(at 5 (p a))`, false for a fact of a predicate `at`.
    fn is_timed(&self, node: usize) -> bool {
        let mut children = self.children(node).skip(1);
        let time =
            children.next().and_then(|node| self.word(node)).is_some_and(|word| word.parse::<f64>().is_ok());
        time && children.next().is_some_and(|node| self.is_list(node))
    }

    fn timed_initial(&mut self, node: usize) -> Option<Initial> {
        let children: Vec<usize> = self.children(node).collect();
        let time_s: f64 = self.word(children[1])?.parse().ok()?;
        if !time_s.is_finite() || time_s < 0.0 {
            self.fault(
                "syntax",
                "a time before the beginning of the plan",
                children[1],
                "expected a number from 0",
            );
            return None;
        }
        if let Some(&extra) = children.get(3) {
            self.expected("`)`", extra, "give each fact an `(at time …)` of its own");
        }
        let mut inner = Vec::new();
        self.initial(children[2], &mut inner);
        match inner.len() {
            1 => inner.pop().map(|inner| Initial::At(time_s, Box::new(inner))),
            0 => None,
            _ => {
                self.expected("one fact", children[2], "give each fact an `(at time …)` of its own");
                None
            }
        }
    }

    fn initial_literal(&mut self, node: usize, negated: bool) -> Option<Initial> {
        let mut children = self.children(node);
        let (Some(first), true) = (children.next(), self.is_list(node)) else {
            self.expected("a fact", node, "facts look like `(at robot kitchen)`");
            return None;
        };
        let name = self.name(first, "a predicate")?;
        let nodes: Vec<usize> = children.collect();
        let arguments = self.object_names(&nodes)?;
        Some(Initial::Literal { negated, name, arguments, span: self.span(node) })
    }

    fn object_names(&mut self, nodes: &[usize]) -> Option<Vec<Name>> {
        let names: Vec<Name> = nodes.iter().filter_map(|&node| self.name(node, "an object")).collect();
        (names.len() == nodes.len()).then_some(names)
    }

    fn initial_value(&mut self, node: usize) -> Option<Initial> {
        let children: Vec<usize> = self.children(node).collect();
        let &[_, mut fluent, mut value] = children.as_slice() else {
            self.expected("a function and its value", node, "for example `(= (fuel robot) 3)`");
            return None;
        };
        // Some files have the value first.
        if self.is_list(value)
            && !self.is_list(fluent)
            && self.word(fluent).is_some_and(|word| word.parse::<f64>().is_ok())
        {
            (fluent, value) = (value, fluent);
        }
        let (name, nodes) = if self.is_list(fluent) {
            let mut parts = self.children(fluent);
            let first = parts.next();
            let Some(first) = first else {
                self.expected("a function", fluent, "for example `(= (fuel robot) 3)`");
                return None;
            };
            (self.name(first, "a function")?, parts.collect::<Vec<_>>())
        } else {
            (self.name(fluent, "a function")?, Vec::new())
        };
        let arguments = self.object_names(&nodes)?;
        let value = self.initial_number(value)?;
        Some(Initial::Value { name, arguments, value, span: self.span(node) })
    }

    fn initial_number(&mut self, node: usize) -> Option<InitialValue> {
        if let Some(word) = self.word(node) {
            return match word.parse::<f64>() {
                Ok(number)
                    if number.is_finite() && !word.starts_with(|first: char| first.is_ascii_alphabetic()) =>
                {
                    Some(InitialValue::Number(number, self.name(node, "a value")?))
                }
                _ => self.name(node, "a number or object").map(InitialValue::Object),
            };
        }
        // A constant expression such as `(/ 1 3)` or `(- 5)`.
        let term = self.number(node)?;
        match constant(&term) {
            Some(number) => Some(InitialValue::Number(number, self.first_name(node)?)),
            None => {
                self.expected("a number or object", node, "initial values are constants");
                None
            }
        }
    }

    fn first_name(&self, list: usize) -> Option<Name> {
        let first = self.children(list).next()?;
        match self.tree.nodes[first].kind {
            Kind::Word(symbol) => Some(Name { symbol, span: self.span(list) }),
            _ => None,
        }
    }
}

/// Value of a term that consists of numbers only; `None` for other terms.
fn constant(term: &TermAst) -> Option<f64> {
    use crate::pddl::ast::Arithmetic;
    match term {
        TermAst::Number(number, _) => Some(*number),
        TermAst::Arithmetic { operator, operands, .. } => {
            let values: Vec<f64> = operands.iter().map(constant).collect::<Option<_>>()?;
            let (&first, rest) = values.split_first()?;
            let value = match operator {
                Arithmetic::Add => values.iter().sum(),
                Arithmetic::Multiply => values.iter().product(),
                Arithmetic::Subtract if rest.is_empty() => -first,
                Arithmetic::Subtract => rest.iter().fold(first, |value, other| value - other),
                Arithmetic::Divide => rest.iter().fold(first, |value, other| value / other),
            };
            value.is_finite().then_some(value)
        }
        _ => None,
    }
}
