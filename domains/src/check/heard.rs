//! Checks the wording of phrases: it can be spoken, differs from other phrases, and uses its slots.

use descry_planner::{Diagnostic, Span};

use super::Check;
use crate::config::GoalPhrase;
use crate::goal::{CONFIDENCE, DEADLINE, pattern};
use crate::mentions::mentions;
use crate::slots::{slots_of, type_of_slot};

impl Check<'_> {
    /// Faults of the `n`-th phrase by which some part of it would never be understood.
    pub(super) fn unheard(&self, n: usize, phrase: &GoalPhrase) -> Vec<Diagnostic> {
        let unused = slots_of(&phrase.say).into_iter().filter(|slot| !is_used(phrase, slot));
        let unused = unused.map(|slot| {
            let tag = format!("<{slot}>");
            let message = format!(
                "neither the meaning nor an answer has {tag}: whatever it holds, the goal is the same"
            );
            let help = format!("speak of {tag} in `means`, or leave it out of `say`");
            self.error("unused-slot", message, self.toml.within(&["goal", &n.to_string(), "say"], &tag), help)
        });
        let otherwise =
            [self.asks_for_nothing(n, phrase), self.never_said(n, phrase), self.said_before(n, phrase)];
        unused.chain(otherwise.into_iter().flatten()).collect()
    }

    /// Fault of a phrase whose meaning names no predicate or function, so that it holds at once.
    fn asks_for_nothing(&self, n: usize, phrase: &GoalPhrase) -> Option<Diagnostic> {
        let place = self.toml.at(&["goal", &n.to_string(), "means"]);
        let message = "this asks for nothing: it holds before anything is done".to_string();
        let help = "say what is to hold, as in (>= (confidence <thing>) <threshold>)";
        let is_word = |mention: &Vec<String>| self.domain.vocabulary.word(&mention[0]).is_some();
        let is_empty = !mentions(&phrase.means).iter().any(is_word);
        is_empty.then(|| self.error("no-goal", message, place, help))
    }

    /// Fault of a phrase without words, or with the words that introduce confidence and deadline, which
    /// may end every goal.
    fn never_said(&self, n: usize, phrase: &GoalPhrase) -> Option<Diagnostic> {
        let ends = |say: &str| {
            let words = shape(say);
            let is_there = |ending: &&[&str]| words.windows(ending.len()).any(|part| part == *ending);
            [&CONFIDENCE[..], &DEADLINE[..]].into_iter().find(is_there).map(|ending| ending.join(" "))
        };
        if let Some(way) = phrase.ways().position(|say| pattern(say).is_empty()) {
            let message = "this phrase has no words: whatever is said, it is not that".to_string();
            return Some(self.error("unsayable", message, self.way(n, way, ""), "say it in words"));
        }
        let (way, ending) = phrase.ways().enumerate().find_map(|(way, say)| Some((way, ends(say)?)))?;
        let message =
            format!("this phrase cannot be said: behind \"{ending}\" every goal says how sure or how soon");
        let place = self.way(n, way, &ending);
        Some(self.error("unsayable", message, place, "say it in other words"))
    }

    /// Fault of a phrase with the words and slots of an earlier one.
    fn said_before(&self, n: usize, phrase: &GoalPhrase) -> Option<Diagnostic> {
        let all = self.domain.config.goal[..n].iter().flat_map(GoalPhrase::ways);
        let mut earlier: Vec<&str> = all.collect();
        for (way, say) in phrase.ways().enumerate() {
            if let Some(other) = earlier.iter().find(|other| shape(other) == shape(say)) {
                let message = format!("\"{other}\" is said above already, and means that");
                let help = "leave one of the two out, or say it in other words";
                return Some(self.error("same-phrase", message, self.way(n, way, ""), help));
            }
            earlier.push(say);
        }
        None
    }

    /// Span of a wording of the `n`-th phrase (`way` 0: the usual one), or of a part of that wording.
    fn way(&self, n: usize, way: usize, part: &str) -> Span {
        let n = n.to_string();
        match way.checked_sub(1) {
            None => self.toml.within(&["goal", &n, "say"], part),
            Some(other) => self.toml.within(&["goal", &n, "also", &other.to_string()], part),
        }
    }
}

/// Words of a phrase, with slots replaced by their types.
fn shape(say: &str) -> Vec<String> {
    let word = |word: &str| match word.strip_prefix('<').and_then(|word| word.strip_suffix('>')) {
        Some(slot) => format!("<{}>", type_of_slot(slot)),
        None => word.to_lowercase(),
    };
    pattern(say).into_iter().map(word).collect()
}

fn is_used(phrase: &GoalPhrase, slot: &str) -> bool {
    let answer = &phrase.answer;
    let answers = [&answer.achieved, &answer.not_found, &answer.cannot_tell];
    let mut texts = answers.into_iter().flatten().chain([&phrase.means]);
    texts.any(|text| slots_of(text).contains(&slot))
}
