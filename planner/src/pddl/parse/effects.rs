//! Parsing of effects.

use super::{Parser, refused};
use crate::pddl::ast::{Assignment, EffectAst, TermAst, When};
use crate::pddl::lex::Kind;

fn assignment(word: &str) -> Option<Assignment> {
    Some(match word {
        "assign" | "change" => Assignment::Assign,
        "increase" => Assignment::Increase,
        "decrease" => Assignment::Decrease,
        "scale-up" => Assignment::ScaleUp,
        "scale-down" => Assignment::ScaleDown,
        _ => return None,
    })
}

impl Parser<'_> {
    /// Parses an effect. `timed`: its parts have time specifiers (durative actions).
    pub(super) fn effect(&mut self, node: usize, timed: bool) -> Option<EffectAst> {
        match self.tree.nodes[node].kind {
            Kind::Bracket => return self.call(node).map(EffectAst::Call),
            Kind::Word(_) => {
                let word = self.written(node);
                self.expected("an effect", node, format!("did you mean `({word})`?"));
                return None;
            }
            Kind::List => {}
        }
        let children: Vec<usize> = self.children(node).collect();
        let Some((&first, rest)) = children.split_first() else { return Some(EffectAst::And(Vec::new())) };
        let Some(head) = self.word(first) else {
            if let [only] = children.as_slice() {
                return self.effect(*only, timed);
            }
            self.expected("an effect", first, "several effects go into one `(and …)`");
            return None;
        };
        if let Some((when, body)) = self.timing(node).filter(|_| timed) {
            return self.timed_effect(node, when, body, &children);
        }
        match head {
            "and" => Some(EffectAst::And(rest.iter().filter_map(|&part| self.effect(part, timed)).collect())),
            "forall" => {
                let [variables, body] = self.exactly(node, rest, "(forall (?x - type) effect)")?;
                let variables = self.quantified(variables)?;
                Some(EffectAst::Forall(variables, Box::new(self.effect(body, timed)?)))
            }
            "when" => {
                let [condition, body] = self.exactly(node, rest, "(when condition effect)")?;
                let (condition, body) = (self.formula(condition, timed), self.effect(body, timed));
                Some(EffectAst::When(condition?, Box::new(body?)))
            }
            "not" => {
                let [atom] = self.exactly(node, rest, "(not (predicate arg))")?;
                self.literal(atom, true, node)
            }
            "or" | "imply" | "exists" => {
                self.expected(
                    "an effect",
                    node,
                    format!("`{head}` belongs into conditions: what happens is certain"),
                );
                None
            }
            "probabilistic" | "oneof" => {
                let span = self.head_span(node);
                self.findings.push(refused(head, "uncertain effects", span));
                None
            }
            "=" => {
                self.expected("an effect", node, "to give a fluent a value write `(assign (f ?x) value)`");
                None
            }
            // A predicate may have the old name of `assign`.
            "change" if !self.gives_value(rest) => self.literal(node, false, node),
            _ => match assignment(head) {
                Some(kind) => self.assignment(node, kind, head, rest),
                None => self.literal(node, false, node),
            },
        }
    }

    /// True if these nodes may be a function and its new value.
    fn gives_value(&self, rest: &[usize]) -> bool {
        rest.len() == 2 && self.word(rest[0]).is_none_or(|word| !word.starts_with('?'))
    }

    fn timed_effect(
        &mut self,
        node: usize,
        when: When,
        body: Option<usize>,
        children: &[usize],
    ) -> Option<EffectAst> {
        let Some(body) = body else {
            self.fault("syntax", "a time without an effect", node, "what happens then?");
            return None;
        };
        if let Some(&extra) = children.get(3) {
            self.expected("`)`", extra, "several effects at one time go into one `(and …)`");
        }
        if when == When::OverAll {
            let message = "an effect over all";
            self.fault("duration", message, node, "effects happen `at start` or `at end`");
            return None;
        }
        Some(EffectAst::Timed(when, Box::new(self.effect(body, false)?), self.span(node)))
    }

    fn assignment(
        &mut self,
        node: usize,
        assignment: Assignment,
        head: &str,
        rest: &[usize],
    ) -> Option<EffectAst> {
        let [fluent, value] = self.exactly(node, rest, &format!("({head} (f ?x) value)"))?;
        let fluent = match self.word(fluent) {
            Some(word) if !word.starts_with('?') => Some(TermAst::Name(self.name(fluent, "a fluent")?)),
            Some(_) => {
                self.expected(
                    "a fluent",
                    fluent,
                    "only fluents change, for example `(increase (fuel ?r) 1)`",
                );
                None
            }
            None => self.object_term(fluent),
        };
        let value = self.number(value);
        Some(EffectAst::Assign { assignment, fluent: fluent?, value: value?, span: self.span(node) })
    }

    fn literal(&mut self, node: usize, negated: bool, whole: usize) -> Option<EffectAst> {
        if self.is_bracket(node) {
            self.expected("a fact", node, "what a module does cannot be negated");
            return None;
        }
        let children: Vec<usize> = self.children(node).collect();
        let Some((&first, rest)) = children.split_first() else {
            self.expected("a fact", node, "for example `(at ?robot ?place)`");
            return None;
        };
        if negated && matches!(self.word(first), Some("and" | "or" | "not" | "forall" | "exists")) {
            self.expected("a fact", node, "negate each fact by itself: `(and (not (p)) (not (q)))`");
            return None;
        }
        let name = self.name(first, "a predicate")?;
        let arguments: Option<Vec<TermAst>> = rest.iter().map(|&part| self.object_term(part)).collect();
        Some(EffectAst::Literal { negated, name, arguments: arguments?, span: self.span(whole) })
    }
}
