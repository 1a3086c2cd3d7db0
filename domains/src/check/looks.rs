//! Checks of what views can tell: goals that need a looking action the domain lacks, questions that
//! nothing answers, and indistinguishable objects.

use descry_planner::{Diagnostic, Source, Span};

use super::Check;
use crate::ability::OBSERVE;
use crate::asked::parsed;
use crate::config::GoalPhrase;
use crate::known::is_alike;
use crate::load::Domain;
use crate::objective::{Asked, Filled};
use crate::origin::{self, Origin};
use crate::slots::put_in;
use crate::{actions, judge};

/// Texts of the object files, as sources of findings.
pub(super) fn objects(domain: &Domain) -> Vec<Source> {
    let files = domain.files.iter().filter(|(key, _)| key.starts_with("objects/"));
    files.map(|(_, (shown, text))| Source::new(shown.clone(), text.clone())).collect()
}

impl Check<'_> {
    /// Findings on known objects that may have equal shape, size and colour.
    pub(super) fn alike(&self, first_source: usize) -> Vec<Diagnostic> {
        let files = objects(self.domain);
        let mut list = Vec::new();
        for (n, one) in self.domain.objects.iter().enumerate() {
            let Some(other) = self.domain.objects[..n].iter().find(|other| is_alike(other, one)) else {
                continue;
            };
            let message = format!(
                "nothing tells \"{}\" from \"{}\": shape, size and colour may be the same",
                one.name, other.name
            );
            let named = |source: &Source| source.text.find(&format!("\"{}\"", one.name));
            let place = files.iter().enumerate().find_map(|(at, file)| {
                let start = named(file)?;
                let bytes = |at: usize| u32::try_from(at).unwrap_or(u32::MAX);
                let end = start + one.name.len() + 2;
                Some(Span { source: bytes(first_source + at), start: bytes(start), end: bytes(end) })
            });
            let help = "give it other measures, say of both which colours they have, as in colour = \"red\", or leave one of the two out";
            list.push(
                Diagnostic::warning("alike", message, place.unwrap_or_default(), "here").with_help(help),
            );
        }
        list
    }

    /// Faults of a phrase that needs views which no action takes, or that asks for facts which nothing
    /// tells.
    pub(super) fn untellable(&self, n: &str, phrase: &GoalPhrase, filled: &[Filled]) -> Vec<Diagnostic> {
        let means = phrase.means.replace("<threshold>", "0.5");
        let Ok(goal) = put_in(&means, filled, |f| f.symbol.clone()) else { return Vec::new() };
        let Ok(task) = parsed(&goal, self.domain, &self.lexicon) else { return Vec::new() };
        let place = self.toml.at(&["goal", n, "means"]);
        if !task.preferences.is_empty() || !task.constraints.is_empty() {
            let message = "nothing tells whether what is only preferred holds".to_string();
            let help = "say what is to hold, without `preference` and `always`";
            return vec![self.error("unjudged", message, place, help)];
        }
        let asked = Asked::of(&task, &self.domain.vocabulary);
        let planned = self.only_planned(&asked, place);
        let told = self.without_looks(&asked, place).or(planned).or(self.never_told(phrase, &asked, place));
        told.into_iter().collect()
    }

    /// Fault of a goal about seen objects in a domain without an action that takes views.
    fn without_looks(&self, asked: &Asked, place: Span) -> Option<Diagnostic> {
        let is_seen = !(asked.things.is_empty() && asked.kinds.is_empty() && asked.surfaces.is_empty());
        let uses = &self.domain.config.uses;
        let can_look = crate::abilities::skill(uses, OBSERVE).is_some();
        if !is_seen || !can_look || actions::does(self.domain, OBSERVE) {
            return None;
        }
        let message = format!(
            "this is about what is seen on surfaces, and no action looks at one: none does `{OBSERVE}`"
        );
        let help = format!("say so of one in domain.toml: does = \"{OBSERVE} ?from ?on\"");
        Some(Diagnostic::warning("no-look", message, place, "here").with_help(help))
    }

    /// Fault of a goal about a fact that changes within a plan alone, and so never comes about.
    fn only_planned(&self, asked: &Asked, place: Span) -> Option<Diagnostic> {
        let vocabulary = &self.domain.vocabulary;
        let is_planned = |name: &&String| {
            let word = vocabulary.word(name);
            word.is_some_and(|word| matches!(origin::of(self.domain, &word), Origin::Planned))
        };
        let name = asked.words.iter().map(|(name, _)| name).find(is_planned)?;
        let message = format!("`{name}` changes within a plan alone: no run ever brings it about");
        let help = format!("leave `is = \"planned\"` out of [word.{name}]; it is remembered then");
        Some(Diagnostic::warning("only-planned", message, place, "here").with_help(help))
    }

    /// Fault of a question about a fact that neither views nor another source tell.
    fn never_told(&self, phrase: &GoalPhrase, asked: &Asked, place: Span) -> Option<Diagnostic> {
        let (vocabulary, config) = (&self.domain.vocabulary, &self.domain.config);
        let is_told = |name: &String| {
            let Some(word) = vocabulary.word(name) else { return true };
            let is_remembered = matches!(origin::of(self.domain, &word), Origin::Remembered);
            let is_taught =
                config.action.values().any(|action| action.taught().any(|taught| taught == *name));
            !is_remembered || judge::is_own(self.domain, name) || is_taught || self.begins(&word)
        };
        let name = asked
            .words
            .iter()
            .map(|(name, _)| name)
            .find(|name| !is_told(name))
            .filter(|_| phrase.question)?;
        let message = format!(
            "the answer is always that it cannot be told: no look tells `{name}`, and a question changes nothing"
        );
        let is_number = vocabulary.word(name).is_some_and(|word| word.is_number);
        let at_first = match is_number {
            true => format!("[\"(= ({name} …) 0)\"]"),
            false => format!("[\"({name} …)\"] or [\"(not ({name} …))\"]"),
        };
        let help = format!(
            "say how it is at first, init = {at_first}, or who states it: [word.{name}] program = […]"
        );
        Some(Diagnostic::warning("never-told", message, place, "here").with_help(help))
    }
}
