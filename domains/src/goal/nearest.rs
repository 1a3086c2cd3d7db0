//! Suggestions for unmatched words: the domain's nearest phrases, with the given names; other slots stay open.

use std::ops::Range;

use super::{pattern, sentence, spoken_types};
use crate::english;
use crate::lexicon::Lexicon;
use crate::load::Domain;
use crate::slots::type_of_slot;

/// Maximum number of suggestions.
const SHOWN: usize = 2;
/// Number of leading words considered in a long sentence.
const HEARD: usize = 24;
/// Score penalty of a slot that no given name fills. From: fitted, `domains/tests/phrases.toml`.
const UNFILLED: f64 = 0.8;
/// Maximum share of differing letters in a mistyped word.
const MISTYPED: f64 = 0.34;

/// A name that occurs among the words.
#[derive(Clone)]
struct Mention {
    of_type: String,
    name: String,
    /// Positions of the name among the words said.
    at: Range<usize>,
    is_exact: bool,
    /// True if the name is a source: "from the desk".
    is_left: bool,
}

/// Phrase with its similarity to the words.
struct Candidate {
    text: String,
    /// Words said that occur neither in the phrase nor in a name.
    left: Vec<String>,
    /// True if the phrase has names and all of them were given.
    is_named: bool,
    score: f64,
}

/// Suggestions for words without a matching phrase.
pub(super) struct Nearest {
    /// Suggested goals, nearest first.
    pub(super) goals: Vec<String>,
    /// Words said that the nearest suggestion lacks.
    pub(super) left: String,
}

/// Goals of the domain that are nearest to the words said.
pub(super) fn nearest(words: &[String], domain: &Domain, lexicon: &Lexicon) -> Nearest {
    let words = &words[..words.len().min(HEARD)];
    let exact = mentions(words, domain, lexicon, true);
    // The kitchen of "kitchen table" is not spoken of.
    let is_part = |m: &&Mention| exact.iter().any(|o| o.at.len() > m.at.len() && contains(&o.at, &m.at));
    let whole = exact.iter().filter(|m| !is_part(m)).cloned();
    let mentions: Vec<Mention> = whole.chain(self::mentions(words, domain, lexicon, false)).collect();
    let mut all: Vec<Candidate> = Vec::new();
    for phrase in &domain.config.goal {
        let ways = phrase.ways().map(|say| candidate(say, words, &mentions));
        // Other wordings of one phrase are no further suggestions.
        let best = ways.reduce(|a, b| if b.score > a.score { b } else { a });
        let text = candidate(&phrase.say, words, &mentions).text;
        let best = best.map(|best| Candidate { text, ..best });
        all.extend(best.filter(|c| all.iter().all(|known| known.text != c.text)));
    }
    all.sort_by(|a, b| b.score.total_cmp(&a.score));
    let least = all.first().map_or(0.0, |best| best.score - 1.0).max(0.5);
    // Of a name alone everything may be meant that can be said of it and nothing else.
    let is_near = all.first().is_some_and(|best| best.score >= least);
    let is_meant = |c: &Candidate| if is_near { c.score >= least } else { c.is_named };
    let shown: Vec<Candidate> = all.into_iter().filter(is_meant).take(SHOWN).collect();
    let left = shown.first().map(|c| c.left.join(" ")).unwrap_or_default();
    Nearest { goals: shown.into_iter().map(|c| c.text).collect(), left }
}

/// Known names among the words, the longest first: exactly as said, or mistyped if not `is_exact`.
fn mentions(words: &[String], domain: &Domain, lexicon: &Lexicon, is_exact: bool) -> Vec<Mention> {
    let mut types = spoken_types(domain);
    types.push("kind");
    let mut found = Vec::new();
    for length in (1..=words.len().min(sentence::NAME_WORDS)).rev() {
        for from in 0..=words.len() - length {
            let at = from..from + length;
            for of in &types {
                let (names, span) = (lexicon.of_type(of), &words[at.clone()]);
                let name = match is_exact {
                    true => sentence::named(names, span).map(|n| n.names[0].clone()),
                    false => mistyped(names.iter().flat_map(|n| &n.names), &span.join(" ")),
                };
                found.extend(name.map(|name| Mention {
                    of_type: of.to_string(),
                    name,
                    at: at.clone(),
                    is_exact,
                    is_left: english::is_left(&words[..from]),
                }));
            }
        }
    }
    found
}

fn contains(outer: &Range<usize>, inner: &Range<usize>) -> bool {
    outer.start <= inner.start && inner.end <= outer.end
}

/// True if a known name occurs among words.
pub(super) fn has_name(words: &str, domain: &Domain, lexicon: &Lexicon) -> bool {
    let words: Vec<String> = words.split(' ').map(str::to_string).collect();
    !mentions(&words, domain, lexicon, true).is_empty()
}

/// Known name that mistyped words probably mean.
fn mistyped<'n>(names: impl Iterator<Item = &'n String>, found: &str) -> Option<String> {
    let distance = |name: &String| strsim::damerau_levenshtein(&name.to_lowercase(), found);
    let nearest = names.min_by_key(|name| distance(name))?;
    is_mistyped(found, &nearest.to_lowercase()).then(|| nearest.clone())
}

/// True if at most a share of [`MISTYPED`] of the letters differ.
fn is_mistyped(found: &str, wanted: &str) -> bool {
    let letters = wanted.chars().count().max(found.chars().count());
    strsim::damerau_levenshtein(found, wanted) as f64 <= MISTYPED * letters as f64
}

/// Index of the unused given word that is most similar to a phrase's word, and their similarity, up to
/// 2.
fn likeness(wanted: &str, words: &[String], used: &[bool]) -> Option<(usize, f64)> {
    let of = |word: &str| match word {
        same if english::is_same(same, wanted) => 2.0,
        related if english::is_related(related, wanted) => 1.2,
        other if is_mistyped(other, wanted) => 1.5,
        _ => 0.0,
    };
    let free = words.iter().enumerate().filter(|(n, _)| !used[*n]).map(|(n, word)| (n, of(word)));
    free.filter(|(_, like)| *like > 0.0).reduce(|a, b| if b.1 > a.1 { b } else { a })
}

fn candidate(say: &str, words: &[String], mentions: &[Mention]) -> Candidate {
    let own: Vec<String> = pattern(say).iter().map(|word| word.to_lowercase()).collect();
    let mut used = vec![false; words.len()];
    let (mut score, mut text) = (0.0, Vec::new());
    let slot_of = |word: &str| word.strip_prefix('<')?.strip_suffix('>').map(|s| type_of_slot(s).to_string());
    let (mut names, mut is_named) = (Vec::new(), true);
    for of in own.iter().filter_map(|word| slot_of(word)) {
        // What something leaves is nowhere that it is brought to.
        let is_free = |m: &&Mention| m.of_type == of && !m.is_left && !used[m.at.clone()].contains(&true);
        match mentions.iter().find(is_free) {
            Some(mention) => {
                used[mention.at.clone()].fill(true);
                score += if mention.is_exact { 2.0 } else { 1.5 };
                names.push(mention.name.clone());
            }
            None => {
                score -= UNFILLED;
                is_named = false;
                names.push(format!("<{of}>"));
            }
        }
    }
    is_named &= !names.is_empty();
    let mut names = names.into_iter();
    for word in english::joined(&own) {
        if slot_of(&word).is_some() {
            text.extend(names.next());
            continue;
        }
        match likeness(&word, words, &used) {
            Some((n, like)) => {
                used[n] = true;
                // The first word of a phrase says what is asked for.
                score += if text.is_empty() { 1.5 * like } else { like };
            }
            None if text.is_empty() => score -= 3.0,
            None => score -= 0.3,
        }
        text.push(word);
    }
    let left: Vec<String> = words
        .iter()
        .zip(&used)
        .filter(|(w, used)| !**used && *w != "," && *w != "the")
        .map(|(w, _)| w.clone())
        .collect();
    score -= 0.25 * left.len() as f64;
    Candidate { text: text.join(" "), left, is_named, score }
}
