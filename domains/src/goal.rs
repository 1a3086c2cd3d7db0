//! Translation of a person's words into a PDDL goal, by the phrases of the domain.

mod ending;
mod nearest;
mod sentence;

use ending::Wanted;
pub(crate) use ending::{CONFIDENCE, DEADLINE};
use sentence::{Clause, Joint, Miss, Reader, Sentence};

use crate::asked::parsed;
use crate::config::Answers;
use crate::english::{self, bare};
use crate::lexicon::Lexicon;
use crate::load::Domain;
use crate::objective::{Asked, Filled, Goal};
use crate::slots::{put_in, slots_of, type_of_slot};

/// Reason why a goal was not understood, with suggestions.
#[derive(Debug, thiserror::Error)]
pub enum GoalError {
    /// No phrase of the domain matches.
    #[error("\"{said}\" is not a goal that the domain {domain} understands\n{suggestions}")]
    NoPhrase {
        /// Words as given.
        said: String,
        /// Name of the domain.
        domain: String,
        /// Phrases that would have been understood, one line each.
        suggestions: String,
    },
    /// A phrase fits, but a slot holds an unknown name.
    #[error("nothing is called \"{found}\" in the domain {domain}\n{suggestions}")]
    NoSuchName {
        /// Words in the slot.
        found: String,
        /// Name of the domain.
        domain: String,
        /// Names that would have been understood.
        suggestions: String,
    },
    /// The requested confidence is no probability.
    #[error(
        "\"with confidence {found}\" asks for no probability\n  a number above 0.5 and below 1 was expected, as in \"with confidence 0.9\""
    )]
    BadConfidence {
        /// The words after "with confidence".
        found: String,
    },
    /// The requested confidence is at most 0.5.
    #[error(
        "\"with confidence {found}\" asks for a yes that is no likelier than a no\n  a number above 0.5 and below 1 was expected, as in \"with confidence 0.9\""
    )]
    LowConfidence {
        /// The words after "with confidence".
        found: String,
    },
    /// The requested deadline is no duration.
    #[error(
        "\"within {found}\" asks for no time\n  a number of seconds or minutes was expected, as in \"within 60 seconds\""
    )]
    BadDeadline {
        /// The words after "within".
        found: String,
    },
    /// The deadline has no unit.
    #[error(
        "\"within {found}\" does not say of what\n  seconds or minutes were expected, as in \"within {found} seconds\" or \"within {found} minutes\""
    )]
    NoUnit {
        /// The words after "within".
        found: String,
    },
    /// Confidence or deadline is given more than once.
    #[error("\"{condition}\" is said twice\n  expected it once, as in \"find cup A {condition} {example}\"")]
    SaidTwice {
        /// First words of the condition.
        condition: &'static str,
        /// Example of the words that follow.
        example: &'static str,
    },
    /// Ambiguous conjunction: "and" beside "or", two lists of names, or "or" between facts to be
    /// found out.
    #[error("\"{said}\" may be meant in several ways\n  say it with \"and\" alone, or as goals of their own")]
    Several {
        /// Words as given.
        said: String,
    },
    /// A word negates the request, and no phrase of the domain has that word.
    #[error(
        "\"{word}\" in \"{said}\" rules something out, and goals say what to find, know or bring about (Ctrl-C stops a run)\n{suggestions}"
    )]
    Denied {
        /// Words as given.
        said: String,
        /// The word that denies.
        word: String,
        /// Phrases that would have been understood, one line each.
        suggestions: String,
    },
    /// A question is combined with a task.
    #[error(
        "\"{said}\" is a question and a task\n  a question changes nothing: ask first, then say what is to be done"
    )]
    Apart {
        /// Words as given.
        said: String,
    },
    /// One object is requested in two places at once.
    #[error(
        "\"{said}\" has {thing} in two places at once: {places}\n  expected one place for a thing; join places by \"or\" if either will do"
    )]
    TwoPlaces {
        /// Words as given.
        said: String,
        /// Name of the object.
        thing: String,
        /// Names of the places.
        places: String,
    },
    /// The phrase itself is invalid.
    #[error("the phrase \"{phrase}\" in domain.toml: {because}")]
    BadPhrase {
        /// The phrase.
        phrase: String,
        /// The fault, and a remedy.
        because: String,
    },
}

/// Reads a goal in the words of the domain: a phrase, or several joined by "and" or "or".
///
/// # Errors
/// [`GoalError`] names what could have been said instead.
pub fn read(said: &str, domain: &Domain, lexicon: &Lexicon) -> Result<Goal, GoalError> {
    let (words, wanted) = ending::conditions(said)?;
    let mut reader = Reader::new(domain, lexicon);
    let plain = english::plain(&words);
    let literal = reader.literal(&english::unlisted(&words));
    reader.misses.clear();
    let read = literal.or_else(|| reader.sentence(&english::unlisted(&plain)));
    match read.or_else(|| reader.sentence(&plain)) {
        Some(sentence) => goal_of(said, &sentence, wanted, domain, lexicon),
        None if reader.is_mixed => Err(GoalError::Several { said: said.into() }),
        None => Err(not_understood(said, &plain, reader)),
    }
}

/// Error for words without a matching phrase: the nearest goals, and what could be said.
fn not_understood(said: &str, plain: &[String], reader: Reader<'_>) -> GoalError {
    let Reader { domain, lexicon, misses, .. } = reader;
    // The nearest goal would be the opposite.
    if let Some(word) = plain.iter().find(|word| english::is_denial(word)) {
        let suggestions = phrase_suggestions(domain, lexicon);
        return GoalError::Denied { said: said.into(), word: word.clone(), suggestions };
    }
    let near = nearest::nearest(plain, domain, lexicon);
    let goals: Vec<String> = near.goals.iter().map(|goal| format!("\"{goal}\"")).collect();
    let meant = (!goals.is_empty()).then(|| format!("  did you mean {}?", goals.join(", or ")));
    let domain_name = domain.config.name.clone();
    // A word in a slot is a name that is not known, unless there is more in it than a name.
    let is_name = |miss: &&Miss| !nearest::has_name(&miss.found, domain, lexicon);
    match misses.iter().filter(is_name).min_by_key(|miss| miss.found.len()) {
        Some(miss) => GoalError::NoSuchName {
            suggestions: meant
                .into_iter()
                .chain([name_suggestions(lexicon, miss)])
                .collect::<Vec<_>>()
                .join("\n"),
            found: miss.found.clone(),
            domain: domain_name,
        },
        None => {
            let left = (!near.left.is_empty() && !goals.is_empty())
                .then(|| format!("  \"{}\" is not understood here", near.left));
            let all = left.into_iter().chain(meant).chain([phrase_suggestions(domain, lexicon)]);
            GoalError::NoPhrase {
                said: said.into(),
                suggestions: all.collect::<Vec<_>>().join("\n"),
                domain: domain_name,
            }
        }
    }
}

fn goal_of(
    said: &str,
    sentence: &Sentence<'_>,
    wanted: Wanted,
    domain: &Domain,
    lexicon: &Lexicon,
) -> Result<Goal, GoalError> {
    let question = sentence.is_question(said)?;
    sentence.check_places(said, question)?;
    let usual = |c: &Clause<'_>| c.phrase.confidence.unwrap_or(domain.config.thresholds.confidence);
    let threshold =
        wanted.confidence.unwrap_or_else(|| sentence.clauses.iter().map(usual).fold(0.0, f64::max));
    let parts: Vec<String> =
        sentence.clauses.iter().map(|c| condition(c, threshold, domain)).collect::<Result<_, _>>()?;
    let joint = if sentence.joint == Joint::And { "and" } else { "or" };
    // "which cups are in the kitchen or the study": either would do, or both?
    let asked = |condition: &String| -> Result<Asked, GoalError> {
        let task = parsed(condition, domain, lexicon).map_err(|because| GoalError::BadPhrase {
            phrase: sentence.clauses[0].phrase.say.clone(),
            because,
        })?;
        Ok(Asked::of(&task, &domain.vocabulary))
    };
    if sentence.joint == Joint::Or && parts.len() > 1 {
        let parts: Vec<Asked> = parts.iter().map(asked).collect::<Result<_, _>>()?;
        if parts.iter().any(|part| !part.kinds.is_empty() || !part.surfaces.is_empty()) {
            return Err(GoalError::Several { said: said.into() });
        }
    }
    let pddl = match parts.as_slice() {
        [only] => only.clone(),
        several => format!("({joint} {})", several.join(" ")),
    };
    let says: Vec<&str> = sentence.clauses.iter().map(|c| c.phrase.say.as_str()).collect();
    Ok(Goal {
        said: said.into(),
        phrase: says.join(&format!(" {joint} ")),
        asked: asked(&pddl)?,
        pddl,
        slots: sentence.clauses.iter().flat_map(|c| c.slots.clone()).collect(),
        question,
        answer: answers(sentence)?,
        threshold,
        deadline_s: wanted.deadline_s,
    })
}

/// Condition in PDDL that a clause means.
fn condition(clause: &Clause<'_>, threshold: f64, domain: &Domain) -> Result<String, GoalError> {
    let phrase = clause.phrase;
    let bad = |because: String| GoalError::BadPhrase { phrase: phrase.say.clone(), because };
    let means = phrase.means.replace("<threshold>", &threshold.to_string());
    let means = put_in(&means, &clause.slots, |f| f.symbol.clone()).map_err(bad)?;
    let nowhere = || bad("it cannot be restricted to a place".into());
    sentence::restricted(&means, &clause.within, domain).ok_or_else(nowhere)
}

/// Answer texts of a sentence with filled slots. Clauses joined by "and" give their texts in sequence;
/// there is none if a clause has none, or for clauses joined by "or".
fn answers(sentence: &Sentence<'_>) -> Result<Answers, GoalError> {
    let is_joined = sentence.joint == Joint::And;
    let of = |pick: &dyn Fn(&Answers) -> &Option<String>| -> Result<Option<String>, GoalError> {
        let texts = sentence.clauses.iter().map(|clause| {
            let bad = |because| GoalError::BadPhrase { phrase: clause.phrase.say.clone(), because };
            pick(&clause.phrase.answer)
                .as_ref()
                .map(|text| answer_of(text, &clause.slots).map_err(bad))
                .transpose()
        });
        let texts: Option<Vec<String>> = texts.collect::<Result<Vec<_>, _>>()?.into_iter().collect();
        Ok(texts.filter(|texts| is_joined || texts.len() == 1).map(|texts| texts.join("; ")))
    };
    Ok(Answers {
        achieved: of(&|a| &a.achieved)?,
        not_found: of(&|a| &a.not_found)?,
        cannot_tell: of(&|a| &a.cannot_tell)?,
    })
}

/// Answer template with filled slots: symbols inside braces, names elsewhere.
fn answer_of(text: &str, slots: &[Filled]) -> Result<String, String> {
    let mut out = String::new();
    let mut rest = text;
    while let Some((before, behind)) = rest.split_once('{') {
        let (inside, after) = behind.split_once('}').unwrap_or((behind, ""));
        let atom = put_in(inside, slots, |f| f.symbol.clone())?;
        out += &format!("{}{{{atom}}}", put_in(before, slots, |f| f.name.clone())?);
        rest = after;
    }
    Ok(out + &put_in(rest, slots, |f| f.name.clone())?)
}

/// All matches of words with a pattern, each with the content of every slot (one word or more).
pub fn fits<'a>(
    pattern: &[&'a str],
    words: &[String],
    is_same: fn(&str, &str) -> bool,
) -> Vec<Vec<(&'a str, String)>> {
    let Some((&head, rest)) = pattern.split_first() else {
        return if words.is_empty() { vec![Vec::new()] } else { Vec::new() };
    };
    let Some(slot) = head.strip_prefix('<').and_then(|h| h.strip_suffix('>')) else {
        let fits_here = words.first().is_some_and(|word| is_same(word, &head.to_lowercase()));
        return if fits_here { fits(rest, &words[1..], is_same) } else { Vec::new() };
    };
    let with = |n: usize| {
        let held = (slot, words[..n].join(" "));
        fits(rest, &words[n..], is_same).into_iter().map(move |mut found| {
            found.insert(0, held.clone());
            found
        })
    };
    (1..=words.len()).flat_map(with).collect()
}

/// Words and slots of a phrase, without punctuation.
pub fn pattern(say: &str) -> Vec<&str> {
    say.split_whitespace().map(bare).filter(|word| !word.is_empty()).collect()
}

/// Types of the slots in the domain's phrases, `thing` first; without `kind`, whose names are plurals of
/// things, and `threshold`.
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
    let mut lines = Vec::new();
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
