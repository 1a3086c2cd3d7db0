//! From what a person says to a PDDL goal, by the phrases of the domain.

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
    /// The known objects that are asked for, by PDDL symbol.
    pub things: Vec<String>,
    /// The surfaces that are asked about, by PDDL symbol.
    pub surfaces: Vec<String>,
    /// The kinds of which all are asked for, by PDDL symbol.
    pub kinds: Vec<String>,
    /// Whether the answer is yes or no.
    pub question: bool,
    /// The confidence that ends the search, 0 to 1.
    pub threshold: f64,
    /// Seconds on the body's clock after which it must be over.
    pub deadline_s: Option<f64>,
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
        "\"with confidence {found}\" asks for no probability\n  a number above 0 and below 1 was expected, as in \"with confidence 0.9\""
    )]
    BadConfidence {
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
}

/// The PDDL symbol of a name: lower case, with hyphens for everything that is no letter or digit.
pub fn symbol(name: &str) -> String {
    let words: Vec<String> = name
        .split(|c: char| !c.is_alphanumeric())
        .filter(|word| !word.is_empty())
        .map(str::to_lowercase)
        .collect();
    words.join("-")
}

/// Reads a goal in the words of the domain.
///
/// # Errors
/// [`GoalError`] names what could have been said instead.
pub fn read(said: &str, domain: &Domain) -> Result<Goal, GoalError> {
    let (words, asked) = conditions(said, domain.config.thresholds.confidence)?;
    let mut nearest_miss = None;
    for phrase in &domain.config.goal {
        let Some(slots) = match_phrase(&phrase.say, &words) else { continue };
        match fill(domain, &slots) {
            Ok(filled) => return Ok(goal_of(said, phrase, filled, asked)),
            Err(found) => nearest_miss = nearest_miss.or(Some(found)),
        }
    }
    let domain_name = domain.config.name.clone();
    Err(match nearest_miss {
        Some(miss) => GoalError::NoSuchName {
            suggestions: name_suggestions(domain, &miss),
            found: miss.found,
            domain: domain_name,
        },
        None => GoalError::NoPhrase {
            said: said.into(),
            suggestions: phrase_suggestions(domain),
            domain: domain_name,
        },
    })
}

/// A slot of a phrase and the symbol that fills it.
struct Filled {
    slot: String,
    symbol: String,
}

/// A slot that holds a word which nothing is called.
struct Miss {
    slot: String,
    found: String,
}

fn goal_of(said: &str, phrase: &crate::load::GoalPhrase, filled: Vec<Filled>, asked: Asked) -> Goal {
    let mut pddl = phrase.means.replace("<threshold>", &asked.confidence.to_string());
    for f in &filled {
        pddl = pddl.replace(&format!("<{}>", f.slot), &f.symbol);
    }
    let of = |slot: &str| filled.iter().filter(|f| f.slot == slot).map(|f| f.symbol.clone()).collect();
    Goal {
        said: said.into(),
        phrase: phrase.say.clone(),
        pddl,
        things: of("thing"),
        surfaces: of("surface"),
        kinds: of("kind"),
        question: phrase.question,
        threshold: asked.confidence,
        deadline_s: asked.deadline_s,
    }
}

/// How sure, and how soon.
#[derive(Clone, Copy)]
struct Asked {
    confidence: f64,
    deadline_s: Option<f64>,
}

/// Takes "with confidence 0.9" and "within 60 seconds" off the end of a goal, in either order.
fn conditions(said: &str, default: f64) -> Result<(Vec<String>, Asked), GoalError> {
    let mut words: Vec<String> = said
        .split_whitespace()
        .map(|w| w.trim_matches(|c: char| "\"'.,!?".contains(c)).to_lowercase())
        .filter(|w| !w.is_empty())
        .collect();
    let mut asked = Asked { confidence: default, deadline_s: None };
    loop {
        let confidence = words.windows(2).rposition(|w| w[0] == "with" && w[1] == "confidence");
        let within = words.iter().rposition(|w| w == "within");
        match (confidence, within) {
            (Some(at), within) if within.is_none_or(|w| w < at) => {
                let found = words.split_off(at)[2..].join(" ");
                let probability = found.parse::<f64>().ok().filter(|c| *c > 0.0 && *c < 1.0);
                asked.confidence = probability.ok_or(GoalError::BadConfidence { found })?;
            }
            (_, Some(at)) => {
                let found = words.split_off(at)[1..].join(" ");
                asked.deadline_s = Some(seconds(&found).ok_or(GoalError::BadDeadline { found })?);
            }
            _ => return Ok((words, asked)),
        }
    }
}

/// "60", "60 s", "60 seconds", "1.5 minutes".
fn seconds(said: &str) -> Option<f64> {
    let (number, unit) = said.split_once(' ').unwrap_or((said, "s"));
    let factor = match unit {
        "s" | "second" | "seconds" => 1.0,
        "min" | "minute" | "minutes" => 60.0,
        _ => return None,
    };
    number.parse::<f64>().ok().map(|n| n * factor).filter(|s| *s > 0.0 && s.is_finite())
}

/// Matches words against a phrase with slots; a slot takes one word or more.
fn match_phrase<'a>(say: &'a str, words: &[String]) -> Option<Vec<(&'a str, String)>> {
    fn step<'a>(pattern: &[&'a str], words: &[String]) -> Option<Vec<(&'a str, String)>> {
        let Some((&head, rest)) = pattern.split_first() else { return words.is_empty().then(Vec::new) };
        if let Some(slot) = head.strip_prefix('<').and_then(|h| h.strip_suffix('>')) {
            return (1..=words.len()).find_map(|n| {
                let mut found = step(rest, &words[n..])?;
                found.insert(0, (slot, words[..n].join(" ")));
                Some(found)
            });
        }
        (words.first()? == &head.to_lowercase()).then(|| step(rest, &words[1..]))?
    }
    step(&say.split_whitespace().collect::<Vec<_>>(), words)
}

fn fill(domain: &Domain, slots: &[(&str, String)]) -> Result<Vec<Filled>, Miss> {
    slots
        .iter()
        .map(|(slot, found)| {
            let wanted = without_article(found);
            domain
                .names(slot)
                .into_iter()
                .find(|(_, names)| names.iter().any(|n| symbol(n) == symbol(wanted)))
                .map(|(symbol, _)| Filled { slot: (*slot).into(), symbol })
                .ok_or_else(|| Miss { slot: (*slot).into(), found: wanted.into() })
        })
        .collect()
}

fn without_article(name: &str) -> &str {
    ["the ", "any ", "an ", "a "].iter().find_map(|article| name.strip_prefix(article)).unwrap_or(name)
}

fn phrase_suggestions(domain: &Domain) -> String {
    let mut lines = vec!["  what could be said:".to_string()];
    for phrase in &domain.config.goal {
        lines.push(format!("    {:40} {}", phrase.say, phrase.about));
    }
    lines.push(format!("  things: {}", listed(domain, "thing")));
    lines.push(format!("  surfaces: {}", listed(domain, "surface")));
    lines.join("\n")
}

fn name_suggestions(domain: &Domain, miss: &Miss) -> String {
    let names = domain.names(&miss.slot);
    let all = names.iter().flat_map(|(_, names)| names.iter());
    let nearest = all.min_by_key(|n| edit_distance(&n.to_lowercase(), &miss.found));
    let mut lines = Vec::new();
    if let Some(nearest) = nearest.filter(|n| edit_distance(&n.to_lowercase(), &miss.found) <= 2) {
        lines.push(format!("  did you mean \"{nearest}\"?"));
    }
    lines.push(format!("  known: {}", listed(domain, &miss.slot)));
    lines.push("  a new object is a file in the domain's folder objects/".into());
    lines.join("\n")
}

fn listed(domain: &Domain, slot: &str) -> String {
    let names = domain.names(slot);
    names.iter().filter_map(|(_, names)| names.first().cloned()).collect::<Vec<_>>().join(", ")
}

/// Levenshtein's distance between two words, in letters.
fn edit_distance(a: &str, b: &str) -> usize {
    let b: Vec<char> = b.chars().collect();
    let mut row: Vec<usize> = (0..=b.len()).collect();
    for (i, ca) in a.chars().enumerate() {
        let mut diagonal = row[0];
        row[0] = i + 1;
        for (j, cb) in b.iter().enumerate() {
            let replaced = diagonal + usize::from(ca != *cb);
            diagonal = row[j + 1];
            row[j + 1] = replaced.min(row[j] + 1).min(diagonal + 1);
        }
    }
    row[b.len()]
}
