//! Parsing of conditions, goals, constraints, terms and durations.

use super::{Parser, refused};
use crate::diagnostic::Diagnostic;
use crate::pddl::ast::{
    Arithmetic, CallAst, Comparison, DurationBoundAst, Formula, Modal, Name, TermAst, When,
};
use crate::pddl::lex::Kind;
use crate::pddl::nearest;

/// Connectives: words that begin a formula and name no predicate.
const CONNECTIVES: &[&str] = &["and", "or", "not", "imply", "forall", "exists"];
/// Operators for "not equal" in other languages, which PDDL does not have.
const UNEQUAL: &[&str] = &["!=", "/=", "<>", "~="];

pub(super) fn comparison(word: &str) -> Option<Comparison> {
    Some(match word {
        "<" => Comparison::Less,
        "<=" => Comparison::LessOrEqual,
        "=" => Comparison::Equal,
        ">=" => Comparison::GreaterOrEqual,
        ">" => Comparison::Greater,
        _ => return None,
    })
}

fn arithmetic(word: &str) -> Option<Arithmetic> {
    Some(match word {
        "+" => Arithmetic::Add,
        "-" => Arithmetic::Subtract,
        "*" => Arithmetic::Multiply,
        "/" => Arithmetic::Divide,
        _ => return None,
    })
}

/// Modal operator of this name, with the number of its times and of its conditions.
fn modal(word: &str) -> Option<(Modal, usize, usize)> {
    Some(match word {
        "always" => (Modal::Always, 0, 1),
        "sometime" => (Modal::Sometime, 0, 1),
        "within" => (Modal::Within, 1, 1),
        "at-most-once" => (Modal::AtMostOnce, 0, 1),
        "sometime-after" => (Modal::SometimeAfter, 0, 2),
        "sometime-before" => (Modal::SometimeBefore, 0, 2),
        "always-within" => (Modal::AlwaysWithin, 1, 2),
        "hold-during" => (Modal::HoldDuring, 2, 1),
        "hold-after" => (Modal::HoldAfter, 1, 1),
        _ => return None,
    })
}

impl Parser<'_> {
    /// Time specifier of `(at start …)`, `(over all …)` or `(at end …)`, with the node inside if
    /// there is one; `None` for other lists.
    pub(super) fn timing(&self, node: usize) -> Option<(When, Option<usize>)> {
        let mut children = self.children(node);
        let first = self.word(children.next()?)?;
        let second = self.word(children.next()?)?;
        let when = match (first, second) {
            ("at", "start") => When::Start,
            ("at", "end") => When::End,
            ("over", "all") => When::OverAll,
            _ => return None,
        };
        let body = children.next();
        // A fact of a predicate `at` about an object called `start`.
        if body.is_some_and(|body| self.word(body).is_some()) { None } else { Some((when, body)) }
    }

    /// Parses a condition, goal or constraint. `timed`: its parts have time specifiers (durative
    /// actions).
    pub(super) fn formula(&mut self, node: usize, timed: bool) -> Option<Formula> {
        match self.tree.nodes[node].kind {
            Kind::Bracket => return self.call(node).map(Formula::Call),
            Kind::Word(_) => {
                let word = self.written(node);
                self.expected("a condition", node, format!("did you mean `({word})`?"));
                return None;
            }
            Kind::List => {}
        }
        let children: Vec<usize> = self.children(node).collect();
        let Some((&first, rest)) = children.split_first() else { return Some(Formula::And(Vec::new())) };
        let Some(head) = self.word(first) else {
            // `([call a])` and needless parentheses.
            if let [only] = children.as_slice() {
                return self.formula(*only, timed);
            }
            self.expected("a predicate or connective", first, "several conditions go into one `(and …)`");
            return None;
        };
        if let Some((when, body)) = self.timing(node).filter(|(when, _)| timed || *when == When::End) {
            return self.timed_formula(node, when, body, timed, &children);
        }
        match head {
            "and" | "or" => {
                let parts = rest.iter().filter_map(|&part| self.formula(part, timed)).collect();
                Some(if head == "and" { Formula::And(parts) } else { Formula::Or(parts) })
            }
            "not" => {
                let body = self.exactly::<1>(node, rest, "(not condition)")?;
                Some(Formula::Not(Box::new(self.formula(body[0], timed)?)))
            }
            "imply" | "implies" => {
                let [left, right] = self.exactly(node, rest, "(imply condition condition)")?;
                let (left, right) = (self.formula(left, timed), self.formula(right, timed));
                Some(Formula::Imply(Box::new(left?), Box::new(right?)))
            }
            "forall" | "exists" => {
                let [variables, body] = self.exactly(node, rest, "(forall (?x - type) condition)")?;
                let variables = self.quantified(variables)?;
                let body = Box::new(self.formula(body, timed)?);
                Some(if head == "forall" {
                    Formula::Forall(variables, body)
                } else {
                    Formula::Exists(variables, body)
                })
            }
            "preference" => self.preference(node, rest, timed),
            "when" => {
                self.expected(
                    "a condition",
                    node,
                    "`when` belongs into effects; in a condition it is `imply`",
                );
                None
            }
            _ if comparison(head).is_some() => self.comparison(node, head, rest),
            _ => match modal(head) {
                Some((operator, times, formulas)) if self.is_modal(rest) => {
                    self.modal(node, operator, rest, times, formulas)
                }
                _ => self.atom(node, first, rest),
            },
        }
    }

    /// True if the arguments are those of a modal operator (formulas), not of a predicate with the
    /// same name.
    fn is_modal(&self, rest: &[usize]) -> bool {
        rest.last().is_some_and(|&last| self.word(last).is_none())
    }

    /// The nodes `rest` if there are `N`; otherwise `None`, and a finding that shows the right form
    /// `shape`.
    pub(super) fn exactly<const N: usize>(
        &mut self,
        node: usize,
        rest: &[usize],
        shape: &str,
    ) -> Option<[usize; N]> {
        if let Ok(parts) = <[usize; N]>::try_from(rest) {
            return Some(parts);
        }
        let head = self.head(node).unwrap_or_default();
        let message = format!("`{head}` takes {}, found {}", parts_text(N), rest.len());
        let span = rest.get(N).map_or_else(|| self.head_span(node), |&extra| self.span(extra));
        let label = if rest.len() > N { "this one is too many" } else { "something is missing here" };
        let help = match (head, rest.len() > N) {
            ("not", true) => "negate one condition at a time, or use `(not (and …))`".to_string(),
            ("forall" | "exists" | "when", true) => "several of them go into one `(and …)`".to_string(),
            _ => format!("it looks like `{shape}`"),
        };
        self.findings.push(Diagnostic::error("syntax", message, span, label).with_help(help));
        None
    }

    pub(super) fn quantified(&mut self, node: usize) -> Option<Vec<crate::pddl::ast::Typed>> {
        if !self.is_list(node) {
            self.expected("a list of variables", node, "for example `(?x - block)`");
            return None;
        }
        Some(self.typed_list(node, 0, true))
    }

    fn timed_formula(
        &mut self,
        node: usize,
        when: When,
        body: Option<usize>,
        timed: bool,
        children: &[usize],
    ) -> Option<Formula> {
        let Some(body) = body else {
            self.fault("syntax", "a time without a condition", node, "what must hold then?");
            return None;
        };
        if let Some(&extra) = children.get(3) {
            self.expected("`)`", extra, "several conditions at one time go into one `(and …)`");
        }
        let inner = self.formula(body, false)?;
        let span = self.span(node);
        Some(if timed {
            Formula::Timed(when, Box::new(inner), span)
        } else {
            Formula::Modal { operator: Modal::AtEnd, times_s: Vec::new(), formulas: vec![inner], span }
        })
    }

    fn preference(&mut self, node: usize, rest: &[usize], timed: bool) -> Option<Formula> {
        let span = self.span(node);
        let (name, body) = match rest {
            [name, body] => (Some(self.name(*name, "the preference's name")?), *body),
            [body] if self.word(*body).is_none() => (None, *body),
            _ => {
                self.expected("a name and a condition", node, "it looks like `(preference name condition)`");
                return None;
            }
        };
        Some(Formula::Preference(name, Box::new(self.formula(body, timed)?), span))
    }

    fn modal(
        &mut self,
        node: usize,
        operator: Modal,
        rest: &[usize],
        times: usize,
        formulas: usize,
    ) -> Option<Formula> {
        if rest.len() != times + formulas {
            let head = self.head(node).unwrap_or_default();
            let message = format!("`{head}` takes {} and {}", numbers_text(times), parts_text(formulas));
            let span = self.head_span(node);
            self.findings.push(Diagnostic::error(
                "syntax",
                message,
                span,
                format!("found {} parts", rest.len()),
            ));
            return None;
        }
        let mut times_s = Vec::new();
        for &time in &rest[..times] {
            match self.word(time).and_then(|word| word.parse::<f64>().ok()).filter(|time| time.is_finite()) {
                Some(time) => times_s.push(time),
                None => {
                    self.expected("a time", time, "times are numbers");
                    return None;
                }
            }
        }
        let formulas: Option<Vec<Formula>> =
            rest[times..].iter().map(|&part| self.formula(part, false)).collect();
        Some(Formula::Modal { operator, times_s, formulas: formulas?, span: self.span(node) })
    }

    fn comparison(&mut self, node: usize, head: &str, rest: &[usize]) -> Option<Formula> {
        let comparison = comparison(head)?;
        let [left, right] = self.exactly(node, rest, &format!("({head} a b)"))?;
        let (left, right) = (self.number(left), self.number(right));
        Some(Formula::Compare { comparison, sides: Box::new([left?, right?]), span: self.span(node) })
    }

    fn atom(&mut self, node: usize, first: usize, rest: &[usize]) -> Option<Formula> {
        let head = self.word(first)?;
        if matches!(head, "assign" | "increase" | "decrease" | "scale-up" | "scale-down") {
            self.expected("a condition", node, format!("`{head}` belongs into effects"));
            return None;
        }
        if UNEQUAL.contains(&head) {
            let sides: Vec<&str> = rest.iter().filter_map(|&part| self.word(part)).collect();
            let help = format!("that two things differ is written `(not (= {}))`", sides.join(" "));
            self.expected("a condition", node, help);
            return None;
        }
        // A misspelt connective: its parts are formulas, which no predicate takes.
        if !self.symbols.is_predicate(head)
            && rest.iter().any(|&part| self.is_list(part) && self.looks_like_formula(part))
            && let Some(near) = nearest(head, CONNECTIVES.iter().copied())
        {
            self.expected("a connective", first, format!("did you mean `{near}`?"));
            return None;
        }
        let name = self.name(first, "a predicate")?;
        let arguments: Option<Vec<TermAst>> = rest.iter().map(|&part| self.object_term(part)).collect();
        Some(Formula::Atom { name, arguments: arguments?, span: self.span(node) })
    }

    fn looks_like_formula(&self, node: usize) -> bool {
        self.head(node).is_none_or(|head| CONNECTIVES.contains(&head) || self.children(node).count() > 0)
    }

    /// Parses a call of a module, `[name arg …]`.
    pub(super) fn call(&mut self, node: usize) -> Option<CallAst> {
        let children: Vec<usize> = self.children(node).collect();
        let Some((&first, rest)) = children.split_first() else {
            self.fault("syntax", "an empty call", node, "expected the name of a module");
            return None;
        };
        let name = self.name(first, "the name of a module")?;
        let arguments: Option<Vec<TermAst>> = rest.iter().map(|&part| self.object_term(part)).collect();
        Some(CallAst { name, arguments: arguments?, span: self.span(node) })
    }

    pub(super) fn grounding(&mut self, node: usize) -> Vec<CallAst> {
        if self.is_bracket(node) {
            return self.call(node).into_iter().collect();
        }
        let mut calls = Vec::new();
        for part in self.children(node) {
            if self.is_bracket(part) || self.is_list(part) {
                calls.extend(self.grounding(part));
            } else if self.word(part) != Some("and") {
                self.expected("a call of a grounding module", part, "for example `([drive-pose])`");
            }
        }
        calls
    }

    /// Parses an argument of a predicate, function or call.
    pub(super) fn object_term(&mut self, node: usize) -> Option<TermAst> {
        let span = self.span(node);
        match self.tree.nodes[node].kind {
            Kind::Word(symbol) => {
                let name = Name { symbol, span };
                let word = self.symbols.name(symbol);
                if word.starts_with(':') {
                    self.expected("an object or variable", node, "is a parenthesis missing before this?");
                    return None;
                }
                Some(if word.starts_with('?') { TermAst::Variable(name) } else { TermAst::Name(name) })
            }
            Kind::List => self.apply(node),
            Kind::Bracket => {
                self.expected("an object", node, "the answer of a call is no object");
                None
            }
        }
    }

    fn apply(&mut self, node: usize) -> Option<TermAst> {
        let children: Vec<usize> = self.children(node).collect();
        let Some((&first, rest)) = children.split_first() else {
            self.expected("an object or number", node, "a function looks like `(fuel ?robot)`");
            return None;
        };
        let name = self.name(first, "a function")?;
        let arguments: Option<Vec<TermAst>> = rest.iter().map(|&part| self.object_term(part)).collect();
        Some(TermAst::Apply { name, arguments: arguments?, span: self.span(node) })
    }

    /// Parses a term that may be a number: a side of a comparison, an assigned value, a duration or
    /// a metric.
    pub(super) fn number(&mut self, node: usize) -> Option<TermAst> {
        let span = self.span(node);
        match self.tree.nodes[node].kind {
            Kind::Bracket => self.call(node).map(TermAst::Call),
            Kind::Word(symbol) => Some(match self.symbols.name(symbol) {
                "?duration" => TermAst::Duration(span),
                "#t" => TermAst::ContinuousTime(span),
                "total-time" => TermAst::TotalTime(span),
                word => match number(word) {
                    Some(number) => TermAst::Number(number, Name { symbol, span }),
                    None => return self.object_term(node),
                },
            }),
            Kind::List => self.compound(node),
        }
    }

    fn compound(&mut self, node: usize) -> Option<TermAst> {
        let children: Vec<usize> = self.children(node).collect();
        let span = self.span(node);
        let Some((&first, rest)) = children.split_first() else { return self.apply(node) };
        let Some(head) = self.word(first) else {
            // `([cost a b])` and needless parentheses.
            if let [only] = children.as_slice() {
                return self.number(*only);
            }
            return self.apply(node);
        };
        if let Some(operator) = arithmetic(head) {
            let operands: Option<Vec<TermAst>> = rest.iter().map(|&part| self.number(part)).collect();
            let operands = operands?;
            let fits = match operator {
                Arithmetic::Add | Arithmetic::Multiply => !operands.is_empty(),
                Arithmetic::Subtract => (1..=2).contains(&operands.len()),
                Arithmetic::Divide => operands.len() == 2,
            };
            if !fits {
                let label = format!("`{head}` of {}", parts_text(operands.len()));
                self.fault("syntax", format!("`{head}` with the wrong number of operands"), node, label);
                return None;
            }
            return Some(TermAst::Arithmetic { operator, operands, span });
        }
        match (head, rest) {
            ("total-time", []) => Some(TermAst::TotalTime(span)),
            ("is-violated", [name]) => self.name(*name, "the name of a preference").map(TermAst::Violated),
            ("at", [time, inner])
                if matches!(self.word(*time), Some("start" | "end")) && self.is_list(*inner) =>
            {
                let span = self.head_span(node);
                self.findings.push(refused("at start", "a time inside an expression", span));
                None
            }
            _ if number(head).is_some() && rest.is_empty() => self.number(first),
            _ => self.apply(node),
        }
    }

    /// Parses bounds on a duration: `(= ?duration e)`, `(and (>= ?duration e) (<= ?duration f))`,
    /// `(at start (…))` or `()`.
    pub(super) fn duration_bounds(
        &mut self,
        node: usize,
        when: Option<When>,
        into: &mut Vec<DurationBoundAst>,
    ) {
        const SHAPE: &str = "a duration looks like `(= ?duration 5)`";
        let children: Vec<usize> = self.children(node).collect();
        let Some((&first, rest)) = children.split_first().filter(|_| self.is_list(node)) else {
            if !self.is_list(node) {
                self.expected("a duration constraint", node, SHAPE);
            }
            return;
        };
        match (self.word(first), rest) {
            (Some("and"), _) => rest.iter().for_each(|&part| self.duration_bounds(part, when, into)),
            (Some("at"), [time, body]) if matches!(self.word(*time), Some("start" | "end")) => {
                let when = if self.word(*time) == Some("start") { When::Start } else { When::End };
                self.duration_bounds(*body, Some(when), into);
            }
            (Some(word), _) if comparison(word).is_some() => {
                into.extend(self.duration_bound(node, word, rest, when.unwrap_or(When::Start)));
            }
            (None, []) => self.duration_bounds(first, when, into),
            _ => self.expected("a duration constraint", node, SHAPE),
        }
    }

    fn duration_bound(
        &mut self,
        node: usize,
        word: &str,
        rest: &[usize],
        when: When,
    ) -> Option<DurationBoundAst> {
        let [left, right] = self.exactly(node, rest, "(= ?duration 5)")?;
        let span = self.span(node);
        let written = comparison(word)?;
        let (value, comparison) = match (self.word(left), self.word(right)) {
            (Some("?duration"), _) => (right, written),
            (_, Some("?duration")) => (left, mirrored(written)),
            _ => {
                let help = "`?duration` stands alone on one side: `(<= ?duration 3)` in place of `(<= (* ?duration ?duration) 9)`";
                self.expected("`?duration`", left, help);
                return None;
            }
        };
        let value = self.number(value)?;
        Some(DurationBoundAst { when, comparison, value, span })
    }
}

fn mirrored(comparison: Comparison) -> Comparison {
    match comparison {
        Comparison::Less => Comparison::Greater,
        Comparison::LessOrEqual => Comparison::GreaterOrEqual,
        Comparison::Equal => Comparison::Equal,
        Comparison::GreaterOrEqual => Comparison::LessOrEqual,
        Comparison::Greater => Comparison::Less,
    }
}

/// Parses a finite number; `None` for other words (`inf`, `nan` and `infinity` are names).
fn number(word: &str) -> Option<f64> {
    let first = word.trim_start_matches(['+', '-', '.']).chars().next()?;
    first.is_ascii_digit().then(|| word.parse::<f64>().ok()).flatten().filter(|number| number.is_finite())
}

fn parts_text(count: usize) -> String {
    match count {
        1 => "one part".to_string(),
        2 => "two parts".to_string(),
        _ => format!("{count} parts"),
    }
}

fn numbers_text(count: usize) -> String {
    match count {
        0 => "no number".to_string(),
        1 => "one number".to_string(),
        _ => format!("{count} numbers"),
    }
}
