//! Checks that every phrase means a goal of the domain, and that its answers use its slots.

use descry_planner::Diagnostic;

use super::Check;
use crate::abilities::{self, learning};
use crate::answer::CHANGES;
use crate::config::GoalPhrase;
use crate::mentions::mentions;
use crate::objective::Filled;
use crate::slots::{put_in, slots_of, type_of_slot};
use crate::symbol::SENSE;

impl Check<'_> {
    /// Checks every phrase of the domain.
    pub(super) fn phrases(&self) -> Vec<Diagnostic> {
        let phrases = self.domain.config.goal.iter().enumerate();
        let all = phrases.flat_map(|(n, phrase)| {
            let mut found = self.phrase(&n.to_string(), phrase);
            found.extend(self.other_slots(&n.to_string(), phrase));
            if found.is_empty() {
                found = self.unheard(n, phrase);
            }
            found
        });
        all.collect()
    }

    /// Findings on alternative wordings whose slots differ from the phrase's.
    fn other_slots(&self, n: &str, phrase: &GoalPhrase) -> Vec<Diagnostic> {
        let sorted = |say: &str| {
            let mut slots: Vec<String> = slots_of(say).into_iter().map(str::to_string).collect();
            slots.sort_unstable();
            slots
        };
        let others = phrase.also.iter().enumerate().filter(|(_, say)| sorted(say) != sorted(&phrase.say));
        let told = others.map(|(at, say)| {
            let message = format!("\"{say}\" does not have the slots of \"{}\"", phrase.say);
            let place = self.toml.at(&["goal", n, "also", &at.to_string()]);
            self.error(
                "other-slots",
                message,
                place,
                "give it the same slots, or make it a phrase of its own",
            )
        });
        told.collect()
    }

    fn phrase(&self, n: &str, phrase: &GoalPhrase) -> Vec<Diagnostic> {
        let filled = match self.filled(n, phrase) {
            Ok(filled) => filled,
            Err(list) => return list,
        };
        let mut list = self.unnamed(n, &filled);
        let objects: Vec<(String, String)> =
            filled.iter().map(|f| (f.symbol.clone(), type_of_slot(&f.slot).to_string())).collect();
        let means = phrase.means.replace("<threshold>", "0.5");
        match put_in(&means, &filled, |f| f.symbol.clone()) {
            Ok(goal) => list.extend(self.condition(&["goal", n, "means"], &goal, &objects)),
            Err(because) => list.push(self.slots(&["goal", n, "means"], because)),
        }
        if list.is_empty() {
            list.extend(self.untellable(n, phrase, &filled));
        }
        let answers = [
            ("achieved", &phrase.answer.achieved),
            ("not_found", &phrase.answer.not_found),
            ("cannot_tell", &phrase.answer.cannot_tell),
        ];
        for (key, answer) in answers {
            let Some(text) = answer else { continue };
            list.extend(self.answer(&["goal", n, "answer", key], text, &filled, &objects));
        }
        list
    }

    /// Example values for the slots of a phrase, or the faults of its slots.
    fn filled(&self, n: &str, phrase: &GoalPhrase) -> Result<Vec<Filled>, Vec<Diagnostic>> {
        let mut filled: Vec<Filled> = Vec::new();
        let mut faults = Vec::new();
        let place = |part: &str| self.toml.within(&["goal", n, "say"], part);
        if phrase.say.matches('<').count() != phrase.say.matches('>').count() {
            let message = "a slot is opened and not closed, or closed and not opened".to_string();
            faults.push(self.error("slots", message, place(&phrase.say), "a slot is written as <surface>"));
        }
        for slot in slots_of(&phrase.say) {
            let (of, tag) = (type_of_slot(slot), format!("<{slot}>"));
            let named = self.lexicon.of_type(of).first();
            if !self.domain.vocabulary.has_type(of) {
                let types = self.domain.vocabulary.task.types.iter().map(|t| t.name.as_str());
                let message = format!("the slot {tag} wants a type `{of}`, which there is not");
                faults.push(self.error("unknown-slot", message, place(&tag), self.known(of, types)));
            }
            if !phrase.say.split_whitespace().any(|word| crate::english::bare(word) == tag) {
                let message = format!("the slot {tag} is a part of a word");
                let help = "leave a space before and behind it";
                faults.push(self.error("glued-slot", message, place(&tag), help));
            }
            filled.push(Filled {
                slot: slot.into(),
                number: filled.iter().filter(|f| f.slot == slot).count(),
                symbol: named.map_or_else(|| format!("some-{of}"), |n| n.symbol.clone()),
                name: String::new(),
            });
        }
        if faults.is_empty() { Ok(filled) } else { Err(faults) }
    }

    /// Warnings about slots that no object can fill, whatever the body.
    fn unnamed(&self, n: &str, filled: &[Filled]) -> Vec<Diagnostic> {
        let is_body_s = |of: &str| {
            of == SENSE || ["surface", "room", "door"].contains(&of) && self.places.surfaces.is_empty()
        };
        let is_empty = |f: &&Filled| {
            let of = type_of_slot(&f.slot);
            let may_be_learned = of == "thing"
                && abilities::used(&self.domain.config.uses).any(|a| a.name == learning::ABILITY.name);
            self.lexicon.of_type(of).is_empty() && !is_body_s(of) && !may_be_learned
        };
        let told = |f: &Filled| {
            let of = type_of_slot(&f.slot);
            let tag = format!("<{}>", f.slot);
            let help = match of {
                "thing" | "kind" => "write a file into objects/, as for a mug".to_string(),
                "pose" | "obstacle" => "poses and obstacles have no names that can be said".to_string(),
                "surface" | "room" | "door" => format!("give the scene a [[{of}]]"),
                _ => format!("name them in domain.toml: [objects] {of} = [\"…\"]"),
            };
            let message = format!("nothing can fill the slot {tag}: no {of} has a name");
            let place = self.toml.within(&["goal", n, "say"], &tag);
            Diagnostic::warning("empty-slot", message, place, "here").with_help(help)
        };
        filled.iter().filter(is_empty).map(told).collect()
    }

    fn slots(&self, path: &[&str], because: String) -> Diagnostic {
        let slot = because.split('<').nth(1).and_then(|rest| rest.split('>').next()).unwrap_or_default();
        let place = self.toml.within(path, &format!("<{slot}>"));
        self.error("slots", because, place, "a slot is one of those of `say`")
    }

    /// Checks an answer text: slots of the phrase, and atoms in braces with at most one queried
    /// argument.
    fn answer(
        &self,
        path: &[&str],
        text: &str,
        filled: &[Filled],
        objects: &[(String, String)],
    ) -> Vec<Diagnostic> {
        if let Err(because) = put_in(text, filled, |f| f.symbol.clone()) {
            return vec![self.slots(path, because)];
        }
        let mut list = Vec::new();
        let mut rest = text;
        while let Some((_, behind)) = rest.split_once('{') {
            let Some((atom, after)) = behind.split_once('}') else {
                let message = "a brace is opened and not closed".to_string();
                let help = "as in {(on <thing> ?)}";
                list.push(self.error("answer", message, self.toml.at(path), help));
                break;
            };
            list.extend(self.atom(path, atom, filled, objects));
            rest = after;
        }
        list
    }

    fn atom(
        &self,
        path: &[&str],
        atom: &str,
        filled: &[Filled],
        objects: &[(String, String)],
    ) -> Option<Diagnostic> {
        if atom.split_whitespace().next() == Some(CHANGES) {
            return None;
        }
        let symbols = put_in(atom, filled, |f| f.symbol.clone()).ok()?;
        let mentions = mentions(&symbols);
        let [mention] = mentions.as_slice() else {
            let message = format!("`{atom}` is no atom");
            let help = "expected an atom with at most one question mark, as in {(on <thing> ?)}";
            return Some(self.error("answer", message, self.toml.within(path, atom), help));
        };
        if mention.iter().filter(|argument| *argument == "?").count() > 1 {
            let message = format!("`{atom}` asks for two objects at once");
            let help = "leave one question mark, as in {(on <thing> ?)}";
            return Some(self.error("answer", message, self.toml.within(path, atom), help));
        }
        let vocabulary = &self.domain.vocabulary;
        let Some(word) = vocabulary.word(&mention[0]) else {
            let words: Vec<String> = vocabulary.words().into_iter().map(|w| w.name).collect();
            let help = self.known(&mention[0], words.iter().map(String::as_str));
            let message = format!("there is no word `{}`", mention[0]);
            return Some(self.error("answer", message, self.toml.within(path, atom), help));
        };
        // What is asked for is some object of the type that belongs there.
        let mut objects = objects.to_vec();
        let arguments = mention[1..].iter().enumerate().map(|(n, argument)| match argument.as_str() {
            "?" => {
                let of = word.types.get(n).cloned().unwrap_or_else(|| "object".into());
                objects.push((format!("whichever-{n}"), of));
                format!("whichever-{n}")
            }
            named => named.into(),
        });
        let arguments: Vec<String> = arguments.collect();
        let plain = format!("({} {})", word.name, arguments.join(" "));
        let condition = if word.is_number { format!("(>= {plain} 0)") } else { plain };
        let mut fault = self.condition(path, &condition, &objects)?;
        if let Some(label) = fault.labels.first_mut() {
            label.span = self.toml.within(path, atom);
        }
        Some(fault)
    }
}
