//! Checks of the conditions in `domain.toml`, by the planner's own parser.

use descry_planner::{Diagnostic, Severity, Source};

use super::Check;
use crate::declared;
use crate::mentions::mentions;

impl Check<'_> {
    /// Checks the expression to be minimised.
    pub(super) fn minimise(&self) -> Option<Diagnostic> {
        let expression = &self.domain.config.minimise;
        self.aim(&["minimise"], "", &format!("(:goal (and)) (:metric minimize {expression})"))
    }

    /// Checks a condition over the domain's predicates and functions, its objects and the further
    /// objects `more` (name, type).
    pub(super) fn condition(
        &self,
        path: &[&str],
        condition: &str,
        more: &[(String, String)],
    ) -> Option<Diagnostic> {
        let vocabulary = &self.domain.vocabulary;
        let named = vocabulary.task.types.iter().flat_map(|of| {
            self.lexicon.of_type(&of.name).iter().map(move |n| (n.symbol.as_str(), of.name.as_str()))
        });
        let more = more.iter().map(|(name, of)| (name.as_str(), of.as_str()));
        let mut objects: Vec<(&str, &str)> = more.chain(named).collect();
        // What has its name from the body, as poses have, may be there if a condition names it; so may
        // every place where no scene tells them.
        let is_body_s = |of: &str| {
            of == "pose" || self.places.surfaces.is_empty() && ["surface", "room", "door"].contains(&of)
        };
        let (mentions, words) = (mentions(condition), vocabulary.words());
        for mention in &mentions {
            let Some(word) = words.iter().find(|word| Some(&word.name) == mention.first()) else { continue };
            let named = mention[1..].iter().zip(&word.types).filter(|(_, of)| is_body_s(of));
            for (name, of) in named.filter(|(name, _)| !name.starts_with('?')) {
                if objects.iter().all(|(known, _)| known != name) {
                    objects.push((name.as_str(), of.as_str()));
                }
            }
        }
        let objects = declared::lines(objects, vocabulary).0.join(" ");
        self.aim(path, &objects, &format!("(:goal {condition})"))
    }

    /// Checks a problem's goal or metric over these objects.
    fn aim(&self, path: &[&str], objects: &str, aim: &str) -> Option<Diagnostic> {
        let domain = &self.domain.vocabulary.task.domain;
        let problem = format!("(define (problem p) (:domain {domain}) (:objects {objects}) (:init) {aim})");
        let source = Source::new("condition", problem);
        let findings = descry_planner::check(&self.domain.pddl, Some(&source));
        // Nothing holds in this problem: what could never come about in it says nothing.
        let is_here = |d: &&Diagnostic| {
            let is_about_it = d.labels.first().is_some_and(|l| l.span.source == 1);
            d.severity == Severity::Error && d.code != "unreachable-goal" && is_about_it
        };
        let fault = findings.list.iter().find(is_here)?;
        let label = fault.labels.first()?;
        let part = source.text.get(label.span.start as usize..label.span.end as usize).unwrap_or_default();
        let mut told =
            Diagnostic::error(fault.code, fault.message.clone(), self.toml.within(path, part), &label.text);
        let closed = (fault.code == "unbalanced").then(|| "add it at the end of this text".to_string());
        if let Some(help) = closed.or(fault.help.clone()) {
            told = told.with_help(help);
        }
        Some(told)
    }

    /// Type that a condition requires of an object; `object` if no predicate or function tells.
    pub(super) fn type_where(&self, condition: &str, object: &str) -> String {
        let vocabulary = &self.domain.vocabulary;
        let of = |mention: Vec<String>| {
            let word = vocabulary.word(mention.first()?)?;
            let at = mention[1..].iter().position(|name| name == object)?;
            word.types.get(at).cloned()
        };
        mentions(condition).into_iter().find_map(of).unwrap_or_else(|| "object".into())
    }
}
