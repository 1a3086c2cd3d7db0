//! Parser: turns the tree of lists into the syntax tree of a domain or problem.
//!
//! After a fault, parsing continues, so that all findings of a file are reported at once.

mod declarations;
mod effects;
mod formulas;

use super::ast::{ActionAst, Domain, DurationBoundAst, Formula, MetricAst, Name, ProblemAst, Typed};
use super::lex::{self, Children, Kind, Symbols, Tree};
use crate::diagnostic::{Diagnostic, Span};
use crate::pddl::nearest;

/// Parses a domain file, source number `source`; faults are appended to `findings`.
pub fn domain(text: &str, source: u32, symbols: &mut Symbols, findings: &mut Vec<Diagnostic>) -> Domain {
    let tree = lex::read(text, source, symbols, findings);
    symbols.declare_predicates(&tree);
    let mut parser = Parser { tree: &tree, text, source, symbols, findings };
    let mut domain = Domain::default();
    let sections = parser.definition("domain", &mut domain.name);
    domain.unread = sections.is_none();
    for section in sections.into_iter().flatten() {
        match parser.section_keyword(section, DOMAIN_SECTIONS) {
            Some(keyword) => parser.domain_section(section, keyword, &mut domain),
            None => domain.unread = true,
        }
    }
    domain
}

/// Parses a problem file, source number `source`; faults are appended to `findings`.
pub fn problem(text: &str, source: u32, symbols: &mut Symbols, findings: &mut Vec<Diagnostic>) -> ProblemAst {
    let tree = lex::read(text, source, symbols, findings);
    let mut parser = Parser { tree: &tree, text, source, symbols, findings };
    let mut problem = ProblemAst::default();
    let sections = parser.definition("problem", &mut problem.name);
    problem.unread = sections.is_none();
    for section in sections.into_iter().flatten() {
        match parser.section_keyword(section, PROBLEM_SECTIONS) {
            Some(keyword) => parser.problem_section(section, keyword, &mut problem),
            None => problem.unread = true,
        }
    }
    problem
}

struct Parser<'a> {
    tree: &'a Tree,
    text: &'a str,
    source: u32,
    symbols: &'a Symbols,
    findings: &'a mut Vec<Diagnostic>,
}

/// Keywords of the sections of a domain.
pub const DOMAIN_SECTIONS: &[&str] = &[
    ":requirements",
    ":oplinit",
    ":types",
    ":modules",
    ":constants",
    ":predicates",
    ":functions",
    ":action",
    ":durative-action",
    ":derived",
    ":constraints",
];

/// Keywords of the sections of a problem.
pub const PROBLEM_SECTIONS: &[&str] = &[
    ":domain",
    ":requirements",
    ":moduleoptions",
    ":moduleexitoptions",
    ":objects",
    ":init",
    ":goal",
    ":constraints",
    ":metric",
];

/// Keywords of the parts of an action.
pub const ACTION_PARTS: &[&str] =
    &[":parameters", ":precondition", ":condition", ":effect", ":duration", ":grounding", ":vars"];

impl<'a> Parser<'a> {
    fn span(&self, node: usize) -> Span {
        let node = self.tree.nodes[node];
        Span { source: self.source, start: node.start, end: node.end }
    }

    /// Span of a list's opening bracket and first word, or of a whole word: enough to point at a
    /// long list.
    fn head_span(&self, node: usize) -> Span {
        match self.tree.children(node).next() {
            Some(first) if matches!(self.tree.nodes[first].kind, Kind::Word(_)) => Span {
                source: self.source,
                start: self.tree.nodes[node].start,
                end: self.tree.nodes[first].end,
            },
            _ => self.span(node),
        }
    }

    fn children(&self, node: usize) -> Children<'a> {
        self.tree.children(node)
    }

    /// Case-folded word of a node; `None` for a list.
    fn word(&self, node: usize) -> Option<&'a str> {
        match self.tree.nodes[node].kind {
            Kind::Word(symbol) => Some(self.symbols.name(symbol)),
            _ => None,
        }
    }

    /// Case-folded first word of a list; `None` if the list is empty or begins with another list.
    fn head(&self, list: usize) -> Option<&'a str> {
        let first = self.children(list).next()?;
        self.word(first)
    }

    fn is_list(&self, node: usize) -> bool {
        self.tree.nodes[node].kind == Kind::List
    }

    fn is_bracket(&self, node: usize) -> bool {
        self.tree.nodes[node].kind == Kind::Bracket
    }

    /// Source text of a node, shortened if long.
    fn written(&self, node: usize) -> String {
        let node = self.tree.nodes[node];
        shortened(&self.text[node.start as usize..node.end as usize])
    }

    fn fault(
        &mut self,
        code: &'static str,
        message: impl Into<String>,
        node: usize,
        label: impl Into<String>,
    ) {
        let span = self.span(node);
        self.findings.push(Diagnostic::error(code, message, span, label));
    }

    /// Reports that `what` was expected at a node.
    fn expected(&mut self, what: &str, node: usize, help: impl Into<String>) {
        let span = self.span(node);
        let message = format!("expected {what}, found {}", self.kind_of(node));
        self.findings
            .push(Diagnostic::error("syntax", message, span, format!("expected {what}")).with_help(help));
    }

    fn kind_of(&self, node: usize) -> String {
        match self.tree.nodes[node].kind {
            Kind::Word(_) => format!("`{}`", self.written(node)),
            Kind::Bracket => "a call in square brackets".to_string(),
            Kind::List => match self.head(node) {
                Some(head) => format!("the list `({head} …)`"),
                None if self.children(node).next().is_none() => "an empty list".to_string(),
                None => "a list".to_string(),
            },
        }
    }

    /// Parses a name, which is neither a variable nor a keyword; otherwise reports that `what` was
    /// expected.
    fn name(&mut self, node: usize, what: &str) -> Option<Name> {
        match self.tree.nodes[node].kind {
            Kind::Word(symbol) if !self.symbols.name(symbol).starts_with(['?', ':']) => {
                Some(Name { symbol, span: self.span(node) })
            }
            _ => {
                self.expected(what, node, "a name is a word without `?` or `:` in front");
                None
            }
        }
    }

    /// Sections of `(define (KIND name) …)`, with its name written to `name`; `None` if there is no
    /// such definition.
    fn definition(&mut self, kind: &str, name: &mut Option<Name>) -> Option<Vec<usize>> {
        let roots: Vec<usize> = self.tree.roots().collect();
        let other = if kind == "domain" { "problem" } else { "domain" };
        let is_kind = |parser: &Self, root: usize, kind: &str| {
            let header = parser.children(root).nth(1);
            header.is_some_and(|header| parser.head(header) == Some(kind))
        };
        let defines: Vec<usize> = roots
            .iter()
            .copied()
            .filter(|&root| self.is_list(root) && self.head(root) == Some("define"))
            .collect();
        for &root in &roots {
            // `(in-package …)` is a habit of the first competitions, whose files were read by Lisp.
            if !defines.contains(&root) && self.head(root) != Some("in-package") {
                self.expected("`(define …)`", root, "a file holds one `(define …)` and comments");
            }
        }
        let mut found = defines.iter().copied().find(|&root| is_kind(self, root, kind));
        // One of its first words is misspelt: the rest is read as what is meant.
        found = found.or_else(|| roots.iter().copied().find(|&root| is_kind(self, root, kind)));
        if found.is_none() {
            self.no_definition(kind, other, defines.first().copied(), roots.is_empty());
            let header = |root: usize| self.children(root).nth(1).and_then(|header| self.head(header));
            let meant = |&root: &usize| header(root).is_some_and(|head| nearest(head, [kind]).is_some());
            found = defines.iter().copied().find(meant);
        }
        let define = found?;
        let header = self.children(define).nth(1)?;
        match self.children(header).nth(1) {
            Some(node) => {
                *name = self.name(node, &format!("the {kind}'s name"));
                self.nothing_after_name(header, kind);
            }
            None => self.fault("syntax", format!("the {kind} has no name"), header, "expected a name"),
        }
        Some(self.children(define).skip(2).collect())
    }

    /// Reports anything after the name in a list such as `(domain name)`.
    fn nothing_after_name(&mut self, list: usize, kind: &str) {
        if let Some(extra) = self.children(list).nth(2) {
            self.expected("`)`", extra, format!("a {kind} has one name; join its words with `-`"));
        }
    }

    fn no_definition(&mut self, kind: &str, other: &str, define: Option<usize>, empty: bool) {
        let header = define.and_then(|define| self.children(define).nth(1));
        if let Some(header) = header.filter(|&header| self.head(header) == Some(other)) {
            let message = format!("a {kind} file was expected, this is a {other} file");
            let span = self.span(header);
            let diagnostic = Diagnostic::error("wrong-file", message, span, format!("`{other}` here"));
            self.findings.push(diagnostic.with_help("were the two files given in the wrong order?"));
        } else if let Some(define) = define {
            let span = self.head_span(define);
            let message = format!("`(define` without `({kind} name)`");
            self.findings.push(Diagnostic::error(
                "syntax",
                message,
                span,
                format!("expected `({kind} name)` next"),
            ));
        } else if empty || !self.findings.iter().any(|finding| finding.code == "syntax") {
            let span = Span { source: self.source, start: 0, end: 0 };
            let message = format!("no {kind} in this file");
            let label = format!("expected `(define ({kind} name) …)`");
            self.findings.push(Diagnostic::error("syntax", message, span, label));
        }
    }

    /// Keyword of a section. If the section has none, reports that and returns the keyword that was
    /// probably meant.
    fn section_keyword(&mut self, section: usize, known: &[&'static str]) -> Option<&'a str> {
        let keyword = self.head(section).filter(|_| self.is_list(section));
        if keyword.is_none_or(|keyword| !keyword.starts_with(':')) {
            self.expected("a section", section, "sections look like `(:keyword …)`");
            return nearest(&format!(":{}", keyword?), known.iter().copied());
        }
        keyword
    }

    fn domain_section(&mut self, section: usize, keyword: &str, domain: &mut Domain) {
        match keyword {
            ":requirements" => self.requirements(section, &mut domain.requirements),
            ":types" => domain.types.extend(self.typed_list(section, 1, false)),
            ":constants" | ":objects" => domain.constants.extend(self.typed_list(section, 1, false)),
            ":predicates" => self.predicates(section, &mut domain.predicates),
            ":functions" => self.functions(section, &mut domain.functions),
            ":modules" => self.modules(section, &mut domain.modules),
            ":oplinit" => self.module_setup(section, &mut domain.module_options),
            ":constraints" => domain.constraints.extend(self.constraints(section)),
            ":derived" => domain.derived.extend(self.derived(section)),
            ":action" | ":durative-action" => domain.actions.extend(self.action(section, keyword)),
            _ => match self.unknown_section(section, keyword, "domain", DOMAIN_SECTIONS, PROBLEM_SECTIONS) {
                Some(meant) => self.domain_section(section, meant, domain),
                None => domain.unread |= self.leaves_unread(),
            },
        }
    }

    fn problem_section(&mut self, section: usize, keyword: &str, problem: &mut ProblemAst) {
        match keyword {
            ":domain" if problem.domain.is_some() => self.second(section, keyword),
            ":domain" => match self.children(section).nth(1) {
                Some(node) => {
                    problem.domain = self.name(node, "the domain's name");
                    self.nothing_after_name(section, "domain");
                }
                None => self.fault("syntax", "the domain's name is missing", section, "expected a name"),
            },
            ":requirements" => self.requirements(section, &mut problem.requirements),
            ":objects" => problem.objects.extend(self.typed_list(section, 1, false)),
            ":init" => {
                for node in self.children(section).skip(1) {
                    self.initial(node, &mut problem.initial);
                }
            }
            ":goal" if problem.goal.is_some() => self.second(section, keyword),
            ":goal" => self.goal(section, problem),
            ":constraints" => problem.constraints.extend(self.constraints(section)),
            ":metric" if problem.metric.is_some() => self.second(section, keyword),
            ":metric" => problem.metric = self.metric(section),
            ":moduleoptions" => self.module_options(section, &mut problem.module_options),
            ":moduleexitoptions" => self.module_options(section, &mut problem.module_exit_options),
            // Hints on the length of plans in files of the year 2000; they never bound a plan.
            ":length" => {}
            _ => match self.unknown_section(section, keyword, "problem", PROBLEM_SECTIONS, DOMAIN_SECTIONS) {
                Some(meant) => self.problem_section(section, meant, problem),
                None => problem.unread |= self.leaves_unread(),
            },
        }
    }

    /// True if the last finding was an unknown section, whose declarations may be missing later.
    fn leaves_unread(&self) -> bool {
        self.findings.last().is_some_and(|finding| finding.code == "unknown-section")
    }

    /// Reports an unknown section; returns the keyword that was probably meant, if any.
    fn unknown_section(
        &mut self,
        section: usize,
        keyword: &str,
        here: &str,
        known: &[&'static str],
        elsewhere: &[&str],
    ) -> Option<&'static str> {
        let span = self.head_span(section);
        let mut meant = None;
        let diagnostic = match keyword {
            ":process" | ":event" => refused(keyword, "PDDL+ processes and events", span),
            ":method" | ":methods" | ":task" | ":tasks" | ":htn" | ":ordered-subtasks" | ":expansion" => {
                refused(keyword, "hierarchical task networks", span)
            }
            ":observe" | ":sensing" | ":sense" => refused(keyword, "sensing actions", span),
            ":extends" | ":axiom" | ":timeless" | ":safety" | ":safety-constraint" | ":situation" => {
                refused(keyword, "this section of PDDL 1.2", span)
            }
            _ if elsewhere.contains(&keyword) => {
                let other = if here == "domain" { "problem" } else { "domain" };
                Diagnostic::error(
                    "syntax",
                    format!("`{keyword}` belongs into the {other} file"),
                    span,
                    format!("not in a {here}"),
                )
            }
            _ => {
                let message = format!("no section `{keyword}` is known in a {here}");
                let diagnostic = Diagnostic::error("unknown-section", message, span, "unknown section");
                meant = nearest(keyword, known.iter().copied());
                match meant {
                    Some(near) => diagnostic.with_help(format!("did you mean `{near}`?")),
                    None => diagnostic.with_help(format!("sections of a {here}: {}", known.join(" "))),
                }
            }
        };
        self.findings.push(diagnostic);
        meant
    }

    /// Reports a section that a problem has for the second time.
    fn second(&mut self, section: usize, keyword: &str) {
        let (span, message) = (self.head_span(section), format!("a second `{keyword}`"));
        self.findings.push(
            Diagnostic::error("duplicate", message, span, "the problem has one already")
                .with_help("remove one of them"),
        );
    }

    fn goal(&mut self, section: usize, problem: &mut ProblemAst) {
        let parts: Vec<usize> = self.children(section).skip(1).collect();
        let formulas: Vec<Formula> = parts.iter().filter_map(|&part| self.formula(part, false)).collect();
        if parts.len() > 1 {
            let span = self.span(parts[1]);
            let message = "the goal has more than one formula";
            let diagnostic = Diagnostic::error("syntax", message, span, "only one is allowed");
            self.findings.push(diagnostic.with_help("put them into one `(and …)`"));
        }
        problem.goal = Some(Formula::And(formulas));
        problem.goal_span = self.span(section);
    }

    fn constraints(&mut self, section: usize) -> Vec<Formula> {
        let parts: Vec<usize> = self.children(section).skip(1).collect();
        parts.into_iter().filter_map(|part| self.formula(part, false)).collect()
    }

    fn metric(&mut self, section: usize) -> Option<MetricAst> {
        let parts: Vec<usize> = self.children(section).skip(1).collect();
        let span = self.span(section);
        let minimise = match parts.first().and_then(|&node| self.word(node)) {
            Some("minimize" | "minimise") => true,
            Some("maximize" | "maximise") => false,
            _ => {
                let node = parts.first().copied().unwrap_or(section);
                self.expected(
                    "`minimize` or `maximize`",
                    node,
                    "for example `(:metric minimize (total-time))`",
                );
                return None;
            }
        };
        let Some(&value) = parts.get(1) else {
            self.fault("syntax", "the metric has no expression", section, "expected what to minimise");
            return None;
        };
        if let Some(&extra) = parts.get(2) {
            self.expected("`)`", extra, "a metric has one expression; use `(+ a b)` for a sum");
        }
        let value = self.number(value)?;
        Some(MetricAst { minimise, value, span })
    }

    fn action(&mut self, section: usize, keyword: &str) -> Option<ActionAst> {
        let mut nodes = self.children(section).skip(1).peekable();
        let Some(first) = nodes.next() else {
            self.fault("syntax", "an action without a name", section, "expected a name");
            return None;
        };
        let name = self.name(first, "the action's name")?;
        let mut action = ActionAst {
            name,
            durative: keyword == ":durative-action",
            parameters: Vec::new(),
            grounding: Vec::new(),
            duration: Vec::new(),
            condition: None,
            effect: None,
            span: self.span(section),
        };
        let mut variables: Vec<Typed> = Vec::new();
        let mut seen: Vec<&str> = Vec::new();
        let mut has_duration = false;
        while let Some(node) = nodes.next() {
            let Some(part) = self.word(node).filter(|word| word.starts_with(':')) else {
                self.expected("a part of the action", node, format!("parts: {}", ACTION_PARTS.join(" ")));
                continue;
            };
            if part == ":precondition" && action.durative {
                let message = "a durative action has a `:condition`, not a `:precondition`";
                let span = self.span(node);
                let finding = Diagnostic::warning("odd-keyword", message, span, "it is read as `:condition`");
                self.findings.push(finding.with_help("write `:condition`, as other planners ask for it"));
            }
            // `:condition` is what `:precondition` is called where actions take time.
            let key = if part == ":precondition" { ":condition" } else { part };
            if seen.contains(&key) {
                self.fault(
                    "duplicate",
                    format!("a second `{part}` in one action"),
                    node,
                    "the action has one already",
                );
            }
            seen.push(key);
            let value = nodes.next_if(|&next| self.word(next).is_none_or(|word| !word.starts_with(':')));
            has_duration |= part == ":duration";
            self.action_part(node, part, value, &mut action, &mut variables);
        }
        self.duration_fits(&action, has_duration);
        // PDDL 1.2: parameters under another name.
        action.parameters.extend(variables);
        Some(action)
    }

    fn action_part(
        &mut self,
        keyword: usize,
        part: &str,
        value: Option<usize>,
        action: &mut ActionAst,
        variables: &mut Vec<Typed>,
    ) {
        let known = ACTION_PARTS.contains(&part).then_some(part);
        let Some(part) = known.or_else(|| self.unknown_part(keyword, part)) else { return };
        let Some(value) = value else {
            self.fault("syntax", format!("nothing follows `{part}`"), keyword, "expected a list after this");
            return;
        };
        match part {
            ":parameters" | ":vars" => {
                if !self.is_list(value) {
                    self.expected("a list of parameters", value, "for example `(?x - block ?y - table)`");
                } else if part == ":vars" {
                    variables.extend(self.typed_list(value, 0, true));
                } else {
                    action.parameters = self.typed_list(value, 0, true);
                }
            }
            ":precondition" | ":condition" => action.condition = self.formula(value, action.durative),
            ":effect" => action.effect = self.effect(value, action.durative),
            ":grounding" => action.grounding = self.grounding(value),
            _ => action.duration = self.duration(value),
        }
    }

    /// Reports an unknown part of an action; returns the keyword that was probably meant, if any.
    fn unknown_part(&mut self, keyword: usize, part: &str) -> Option<&'static str> {
        let message = format!("no part `{part}` is known in an action");
        let span = self.span(keyword);
        let diagnostic = Diagnostic::error("syntax", message, span, "unknown part");
        let near = nearest(part, ACTION_PARTS.iter().copied());
        self.findings.push(match near {
            Some(near) => diagnostic.with_help(format!("did you mean `{near}`?")),
            None => diagnostic.with_help(format!("parts of an action: {}", ACTION_PARTS.join(" "))),
        });
        near
    }

    /// Reports a durative action without a duration, or an instantaneous one with a duration.
    fn duration_fits(&mut self, action: &ActionAst, has_duration: bool) {
        let span = action.name.span;
        let name = self.symbols.name(action.name.symbol);
        if action.durative && !has_duration {
            self.findings.push(
                Diagnostic::error(
                    "duration",
                    format!("durative action `{name}` has no duration"),
                    span,
                    "how long?",
                )
                .with_help("add `:duration (= ?duration 1)` after its parameters"),
            );
        } else if !action.durative && has_duration {
            self.findings.push(
                Diagnostic::error(
                    "duration",
                    format!("action `{name}` has a duration but is instantaneous"),
                    span,
                    "",
                )
                .with_help("declare it with `:durative-action`, or remove `:duration`"),
            );
        }
    }

    fn duration(&mut self, node: usize) -> Vec<DurationBoundAst> {
        let mut bounds = Vec::new();
        self.duration_bounds(node, None, &mut bounds);
        bounds
    }
}

/// Error about a keyword whose feature is not supported.
fn refused(keyword: &str, feature: &str, span: Span) -> Diagnostic {
    let message = format!("`{keyword}` is not supported ({feature})");
    Diagnostic::error("not-supported", message, span, "not supported")
}

/// Text on one line, cut after 57 characters if longer than 60, for a message.
pub(super) fn shortened(text: &str) -> String {
    let mut line = text.split_whitespace().collect::<Vec<_>>().join(" ");
    if line.chars().count() > 60 {
        line = line.chars().take(57).chain("…".chars()).collect();
    }
    line
}
