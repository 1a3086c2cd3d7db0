//! Sentences as people say them: each is understood as its file says, or answered with a goal that is.

use std::collections::BTreeMap;

use descry_domains::goal::{self, GoalError};
use descry_domains::lexicon::{Lexicon, Places};
use descry_domains::load::Domain;
use descry_domains::objective::Goal;
use serde::Deserialize;

/// `phrases.toml`: by domain, what is said and what it comes to.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Said {
    say: String,
    /// Goal in PDDL.
    means: Option<String>,
    /// A goal that means the same.
    same: Option<String>,
    /// Goal that is offered instead.
    offers: Option<String>,
    /// A part of what is answered otherwise.
    tells: Option<String>,
}

struct Speech {
    domain: Domain,
    lexicon: Lexicon,
}

impl Speech {
    fn of(name: &str) -> Self {
        let domain = Domain::load(name).unwrap();
        let lexicon = Lexicon::new(&domain, &Places::of_scene(&domain));
        Self { domain, lexicon }
    }

    fn read(&self, said: &str) -> Result<Goal, GoalError> {
        goal::read(said, &self.domain, &self.lexicon)
    }

    /// A goal with a name in each slot that is left open.
    fn filled(&self, offer: &str) -> String {
        let word = |word: &str| match word.strip_prefix('<').and_then(|word| word.strip_suffix('>')) {
            Some(of) => self.lexicon.of_type(of)[0].names[0].clone(),
            None => word.to_string(),
        };
        offer.split(' ').map(word).collect::<Vec<_>>().join(" ")
    }

    /// The fault in how a sentence is understood, if any.
    fn fault(&self, said: &Said) -> Option<String> {
        let found = self.read(&said.say).map_err(|e| e.to_string());
        let pddl = found.as_ref().map(|goal| goal.pddl.as_str());
        if let Some(same) = &said.same {
            let other = match self.read(same) {
                Ok(other) => other,
                Err(why) => return Some(format!("{same}: {why}")),
            };
            return (pddl != Ok(&other.pddl)).then(|| format!("{found:#?}\n{same}: {}", other.pddl));
        }
        if let Some(means) = &said.means {
            return (pddl != Ok(means)).then(|| format!("{found:#?}"));
        }
        let Err(why) = &found else { return Some(format!("{found:#?}")) };
        // One step: what is offered is understood.
        let offered: Vec<&str> = why
            .lines()
            .filter(|l| l.contains("did you mean"))
            .flat_map(|l| l.split('"').skip(1).step_by(2))
            .collect();
        if let Some(unknown) = offered.iter().find(|offer| self.read(&self.filled(offer)).is_err()) {
            return Some(format!("\"{unknown}\" is offered and not understood\n{why}"));
        }
        let is_offered = said.offers.as_ref().is_none_or(|offer| offered.contains(&offer.as_str()));
        let is_told = said.tells.as_ref().is_none_or(|tells| why.contains(tells.as_str()));
        (!is_offered || !is_told).then(|| why.clone())
    }
}

#[test]
fn sentences_are_understood_or_answered_with_one_that_is() {
    let text = include_str!("phrases.toml");
    let all: BTreeMap<String, Vec<Said>> = toml::from_str(text).unwrap();
    let mut faults = Vec::new();
    for (name, sentences) in &all {
        let speech = Speech::of(name);
        let told = |s: &Said| Some(format!("{name}: \"{}\"\n{}", s.say, speech.fault(s)?));
        faults.extend(sentences.iter().filter_map(told));
    }
    assert!(all.values().map(Vec::len).sum::<usize>() >= 50, "fifty sentences were expected");
    assert!(faults.is_empty(), "{}", faults.join("\n\n"));
}

/// Nothing that is not understood is left out in silence: a sentence with a word more is another, or none.
#[test]
fn no_word_that_counts_is_dropped() {
    let speech = Speech::of("home");
    let said = |more: &str| format!("find cup A {more}");
    for more in ["not", "never", "or not", "but not the mug", "twice", "in the garden", "then the mug", "and"]
    {
        assert!(speech.read(&said(more)).is_err(), "{}", said(more));
    }
    let all = [
        "do not find cup A",
        "don't find cup A",
        "never find cup A",
        "stop finding cup A",
        "stop",
        "find cup A, but not in the kitchen",
        "make sure cup A is not on the desk",
    ];
    for denied in all {
        let why = speech.read(denied).expect_err(denied).to_string();
        assert!(why.contains("rules something out") && !why.contains("did you mean"), "{denied}: {why}");
    }
}

/// Many joints are read in a moment, whether or not they come to a goal.
#[test]
fn long_sentences_are_read_at_once() {
    let speech = Speech::of("home");
    let long = vec!["find cup A and the mug"; 40].join(" and ");
    assert!(speech.read(&long).is_ok());
    assert!(speech.read(&format!("{long} and find nonsense")).is_err());
}

#[test]
fn answers_of_joined_goals_speak_of_each() {
    let goal = Speech::of("home").read("where did you last see cup A and the mug?").unwrap();
    let expected = "cup A was last seen on the {(last-seen cup-a ?)}, {(hours-since cup-a)} hours ago; \
                    mug was last seen on the {(last-seen mug ?)}, {(hours-since mug)} hours ago";
    assert_eq!(goal.answer.achieved.as_deref(), Some(expected));
}
