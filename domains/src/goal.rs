//! From what a person says to a PDDL goal, by the phrases of the domain.

use crate::asked::Asked;
use crate::config::{Answers, GoalPhrase};
use crate::lexicon::{Lexicon, Named, symbol};
use crate::load::Domain;

/// A goal that a person gave, with what it means in the planner's language.
#[derive(Debug, Clone, PartialEq)]
pub struct Goal {
    /// The words as they were given.
    pub said: String,
    /// The phrase of `domain.toml` that they matched.
    pub phrase: String,
    /// The goal condition in PDDL.
    pub pddl: String,
    /// What the condition asks about.
    pub asked: Asked,
    /// What the slots hold.
    pub slots: Vec<Filled>,
    /// Whether the answer is yes or no.
    pub question: bool,
    /// What is answered.
    pub answer: Answers,
    /// The confidence that ends the search, 0 to 1.
    pub threshold: f64,
    /// Seconds on the body's clock after which it must be over.
    pub deadline_s: Option<f64>,
}

/// A slot of a phrase and what fills it.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Filled {
    /// As it stands in the phrase: `thing`, or `first:thing`.
    pub slot: String,
    /// Which of several of the same name, from 0.
    pub number: usize,
    /// The PDDL symbol.
    pub symbol: String,
    /// The usual name.
    pub name: String,
}

/// Why a goal was not understood, with what could have been said.
#[derive(Debug, thiserror::Error)]
pub enum GoalError {
    /// No phrase of the domain fits.
    #[error("\"{said}\" is not a goal that the domain {domain} understands\n{suggestions}")]
    NoPhrase {
        /// The words as they were given.
        said: String,
        /// The domain's name.
        domain: String,
        /// The phrases that would have been understood, a line each.
        suggestions: String,
    },
    /// A phrase fits, but a slot holds a word that nothing is called.
    #[error("nothing is called \"{found}\" in the domain {domain}\n{suggestions}")]
    NoSuchName {
        /// What stood in the slot.
        found: String,
        /// The domain's name.
        domain: String,
        /// The names that would have been understood.
        suggestions: String,
    },
    /// The confidence that was asked for is no probability.
    #[error(
        "\"with confidence {found}\" asks for no probability\n  a number above 0.5 and below 1 was expected, as in \"with confidence 0.9\""
    )]
    BadConfidence {
        /// What followed "with confidence".
        found: String,
    },
    /// With the confidence that was asked for, a yes would be no likelier than a no.
    #[error(
        "\"with confidence {found}\" asks for a yes that is no likelier than a no\n  a number above 0.5 and below 1 was expected, as in \"with confidence 0.9\""
    )]
    LowConfidence {
        /// What followed "with confidence".
        found: String,
    },
    /// The deadline that was asked for is no time.
    #[error(
        "\"within {found}\" asks for no time\n  a number of seconds or minutes was expected, as in \"within 60 seconds\""
    )]
    BadDeadline {
        /// What followed "within".
        found: String,
    },
    /// The deadline that was asked for is a number of nothing.
    #[error(
        "\"within {found}\" does not say of what\n  seconds or minutes were expected, as in \"within {found} seconds\" or \"within {found} minutes\""
    )]
    NoUnit {
        /// What followed "within".
        found: String,
    },
    /// How sure, or how soon, is said more than once.
    #[error("\"{condition}\" is said twice\n  expected it once, as in \"find cup A {condition} {example}\"")]
    SaidTwice {
        /// What begins it.
        condition: &'static str,
        /// What may follow.
        example: &'static str,
    },
    /// The phrase itself cannot be used.
    #[error("the phrase \"{phrase}\" in domain.toml: {because}")]
    BadPhrase {
        /// The phrase.
        phrase: String,
        /// What is wrong with it, and a mend.
        because: String,
    },
}

/// Reads a goal in the words of the domain.
///
/// # Errors
/// [`GoalError`] names what could have been said instead.
pub fn read(said: &str, domain: &Domain, lexicon: &Lexicon) -> Result<Goal, GoalError> {
    let (words, wanted) = conditions(said)?;
    let mut nearest_miss = None;
    for phrase in &domain.config.goal {
        for slots in fits(&phrase.say, &words) {
            match fill(lexicon, &domain.config.open, &slots) {
                Ok(filled) => return goal_of(said, phrase, filled, wanted, domain),
                Err(found) => nearest_miss = nearest_miss.or(Some(found)),
            }
        }
    }
    let domain_name = domain.config.name.clone();
    Err(match nearest_miss {
        Some(miss) => GoalError::NoSuchName {
            suggestions: name_suggestions(lexicon, &miss),
            found: miss.found,
            domain: domain_name,
        },
        None => GoalError::NoPhrase {
            said: said.into(),
            suggestions: phrase_suggestions(domain, lexicon),
            domain: domain_name,
        },
    })
}

/// A slot that holds a word which nothing is called.
struct Miss {
    of_type: String,
    found: String,
}

/// The type that fills a slot: `thing` of `thing` and of `first:thing`.
pub fn type_of_slot(slot: &str) -> &str {
    slot.rsplit(':').next().unwrap_or(slot)
}

/// The slots of a text in their order.
pub fn slots_of(text: &str) -> Vec<&str> {
    let mut slots = Vec::new();
    let mut rest = text;
    while let Some((_, behind)) = rest.split_once('<') {
        let Some((slot, after)) = behind.split_once('>') else { break };
        // A comparison is no slot.
        if !slot.is_empty() && slot.chars().all(|c| c.is_alphanumeric() || "-_:".contains(c)) {
            slots.push(slot);
        }
        rest = if slots.last() == Some(&slot) { after } else { behind };
    }
    slots
}

/// Puts what fills the slots into a text: the first of a name in the place of its first mention, and so on; where the text mentions
/// it more or less often than the phrase has it, each mention stands for the only one.
///
/// # Errors
/// A slot that the phrase does not have, or of which it has several and the text not as many.
pub fn put_in(text: &str, slots: &[Filled], with: impl Fn(&Filled) -> String) -> Result<String, String> {
    let mut out = text.to_string();
    let mentioned = slots_of(text);
    for (n, slot) in mentioned.iter().enumerate().filter(|(n, slot)| !mentioned[..*n].contains(slot)) {
        let fitting: Vec<&Filled> = slots.iter().filter(|f| f.slot == *slot).collect();
        let mentions = mentioned[n..].iter().filter(|m| *m == slot).count();
        let tag = format!("<{slot}>");
        match fitting.as_slice() {
            [] => {
                let known: Vec<String> = slots.iter().map(|f| format!("<{}>", f.slot)).collect();
                let known = if known.is_empty() { "none".into() } else { known.join(", ") };
                return Err(format!("there is no slot {tag}; it has {known}"));
            }
            [only] => out = out.replace(&tag, &with(only)),
            several if several.len() == mentions => {
                for one in several {
                    out = out.replacen(&tag, &with(one), 1);
                }
            }
            several => {
                return Err(format!(
                    "it says {tag} {} times and \"{text}\" {mentions} times; name them, as <first:{slot}> and <second:{slot}>",
                    several.len()
                ));
            }
        }
    }
    Ok(out)
}

fn goal_of(
    said: &str,
    phrase: &GoalPhrase,
    slots: Vec<Filled>,
    wanted: Wanted,
    domain: &Domain,
) -> Result<Goal, GoalError> {
    let bad = |because: String| GoalError::BadPhrase { phrase: phrase.say.clone(), because };
    let usual = phrase.confidence.unwrap_or(domain.config.thresholds.confidence);
    let threshold = wanted.confidence.unwrap_or(usual);
    let means = phrase.means.replace("<threshold>", &threshold.to_string());
    let pddl = put_in(&means, &slots, |f| f.symbol.clone()).map_err(bad)?;
    let asked = Asked::of(&pddl, &domain.vocabulary);
    Ok(Goal {
        said: said.into(),
        phrase: phrase.say.clone(),
        pddl,
        asked,
        slots,
        question: phrase.question,
        answer: phrase.answer.clone(),
        threshold,
        deadline_s: wanted.deadline_s,
    })
}

/// How sure, and how soon.
#[derive(Clone, Copy)]
pub struct Wanted {
    confidence: Option<f64>,
    deadline_s: Option<f64>,
}

/// Behind these words a goal says how sure it must be.
pub(crate) const CONFIDENCE: [&str; 2] = ["with", "confidence"];
/// Behind this word a goal says how soon it must be.
pub(crate) const DEADLINE: [&str; 1] = ["within"];

/// Takes "with confidence 0.9" and "within 60 seconds" off the end of a goal, in either order.
pub fn conditions(said: &str) -> Result<(Vec<String>, Wanted), GoalError> {
    let mut words: Vec<String> =
        said.split_whitespace().map(|w| bare(w).to_lowercase()).filter(|w| !w.is_empty()).collect();
    let mut wanted = Wanted { confidence: None, deadline_s: None };
    loop {
        let confidence = words.windows(2).rposition(|w| w == CONFIDENCE);
        let within = words.windows(1).rposition(|w| w == DEADLINE);
        match (confidence, within) {
            (Some(at), within) if within.is_none_or(|w| w < at) => {
                let found = words.split_off(at)[2..].join(" ");
                let other = wanted.confidence.replace(confidence_of(found)?);
                once(other, "with confidence", "0.9")?;
            }
            (_, Some(at)) => {
                let found = words.split_off(at)[1..].join(" ");
                let other = wanted.deadline_s.replace(seconds(found)?);
                once(other, "within", "60 seconds")?;
            }
            _ => return Ok((words, wanted)),
        }
    }
}

/// That nothing was said of a condition before.
fn once(other: Option<f64>, condition: &'static str, example: &'static str) -> Result<(), GoalError> {
    other.map_or(Ok(()), |_| Err(GoalError::SaidTwice { condition, example }))
}

/// "0.9": a yes must be likelier than a no.
fn confidence_of(found: String) -> Result<f64, GoalError> {
    match found.parse::<f64>() {
        Ok(c) if c > 0.5 && c < 1.0 => Ok(c),
        Ok(c) if c > 0.0 && c < 1.0 => Err(GoalError::LowConfidence { found }),
        _ => Err(GoalError::BadConfidence { found }),
    }
}

/// A word without the signs around it.
pub(crate) fn bare(word: &str) -> &str {
    word.trim_matches(|c: char| "\"'.,!?".contains(c))
}

/// "60 s", "60s", "60 seconds", "1.5 minutes"; a number alone may be meant as either.
pub fn seconds(found: String) -> Result<f64, GoalError> {
    let end = found.find(|c: char| c.is_alphabetic()).unwrap_or(found.len());
    let (number, unit) = (found[..end].trim().parse::<f64>().ok(), &found[end..]);
    let factor = match unit {
        "s" | "second" | "seconds" => 1.0,
        "min" | "minute" | "minutes" => 60.0,
        "" if number.is_some_and(|n| n > 0.0) => return Err(GoalError::NoUnit { found }),
        _ => return Err(GoalError::BadDeadline { found }),
    };
    let wanted_s = number.map(|n| n * factor).filter(|s| *s > 0.0 && s.is_finite());
    wanted_s.ok_or(GoalError::BadDeadline { found })
}

/// The ways in which words fit a phrase with slots, each slot with what it holds; a slot takes one word or more.
pub fn fits<'a>(say: &'a str, words: &[String]) -> Vec<Vec<(&'a str, String)>> {
    fn step<'a>(pattern: &[&'a str], words: &[String]) -> Vec<Vec<(&'a str, String)>> {
        let Some((&head, rest)) = pattern.split_first() else {
            return if words.is_empty() { vec![Vec::new()] } else { Vec::new() };
        };
        let Some(slot) = head.strip_prefix('<').and_then(|h| h.strip_suffix('>')) else {
            let fits = words.first().is_some_and(|word| *word == head.to_lowercase());
            return if fits { step(rest, &words[1..]) } else { Vec::new() };
        };
        let with = |n: usize| {
            let held = (slot, words[..n].join(" "));
            step(rest, &words[n..]).into_iter().map(move |mut found| {
                found.insert(0, held.clone());
                found
            })
        };
        (1..=words.len()).flat_map(with).collect()
    }
    step(&pattern(say), words)
}

/// The words and slots of a phrase, without the signs around them.
pub(crate) fn pattern(say: &str) -> Vec<&str> {
    say.split_whitespace().map(bare).filter(|word| !word.is_empty()).collect()
}

fn fill(lexicon: &Lexicon, open: &[String], slots: &[(&str, String)]) -> Result<Vec<Filled>, Miss> {
    let mut filled: Vec<Filled> = Vec::new();
    for (slot, found) in slots {
        let (of_type, wanted) = (type_of_slot(slot), without_article(found));
        let is_called = |n: &&Named| n.names.iter().any(|name| symbol(name) == symbol(wanted));
        let is_free = || open.iter().any(|of| of == of_type) && lexicon.is_free(&symbol(wanted));
        let (called, name) = match lexicon.of_type(of_type).iter().find(is_called) {
            Some(named) => (named.symbol.clone(), lexicon.name_of(&named.symbol).to_string()),
            None if is_free() => (symbol(wanted), wanted.to_string()),
            None => return Err(Miss { of_type: of_type.into(), found: wanted.into() }),
        };
        filled.push(Filled {
            slot: (*slot).into(),
            number: filled.iter().filter(|f| f.slot == *slot).count(),
            symbol: called,
            name,
        });
    }
    Ok(filled)
}

pub(crate) fn without_article(name: &str) -> &str {
    ["the ", "any ", "an ", "a "].iter().find_map(|article| name.strip_prefix(article)).unwrap_or(name)
}

/// The types that the phrases of a domain speak of, things first; the kinds are the things, in the plural.
pub fn spoken_types(domain: &Domain) -> Vec<&str> {
    let slots = domain.config.goal.iter().flat_map(|g| slots_of(&g.say)).map(type_of_slot);
    let mut types: Vec<&str> = slots.filter(|of| *of != "kind" && *of != "threshold").collect();
    types.sort_unstable_by_key(|of| (*of != "thing", *of));
    types.dedup();
    types
}

fn phrase_suggestions(domain: &Domain, lexicon: &Lexicon) -> String {
    let mut lines = vec!["  what could be said:".to_string()];
    for phrase in &domain.config.goal {
        lines.push(format!("    {:40} {}", phrase.say, phrase.about));
    }
    for of in spoken_types(domain) {
        lines.push(format!("  {of}s: {}", lexicon.listed(of)));
    }
    lines.join("\n")
}

fn name_suggestions(lexicon: &Lexicon, miss: &Miss) -> String {
    let names: Vec<&String> = lexicon.of_type(&miss.of_type).iter().flat_map(|n| &n.names).collect();
    let distance = |name: &str| strsim::levenshtein(&name.to_lowercase(), &miss.found);
    let nearest = names.iter().min_by_key(|n| distance(n));
    let mut lines = Vec::new();
    if let Some(nearest) = nearest.filter(|n| distance(n) <= 2) {
        lines.push(format!("  did you mean \"{nearest}\"?"));
    }
    lines.push(match names.is_empty() {
        true => {
            format!("  the body knows no {} beforehand, and of this type the domain has none", miss.of_type)
        }
        false => format!("  known: {}", lexicon.listed(&miss.of_type)),
    });
    if miss.of_type == "thing" || miss.of_type == "kind" {
        lines.push("  a new object is a file in the domain's folder objects/".into());
    }
    lines.join("\n")
}
