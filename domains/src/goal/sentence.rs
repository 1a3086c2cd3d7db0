//! A sentence over the phrases of a domain: clauses joined by "and" or "or", names joined in a slot, and
//! places that restrict the objects meant.

use std::collections::BTreeSet;
use std::rc::Rc;

use descry_perception::recognise::colour::basic;

use super::{GoalError, fits, pattern};
use crate::config::GoalPhrase;
use crate::english;
use crate::known::thing;
use crate::lexicon::{Lexicon, Named};
use crate::load::Domain;
use crate::objective::Filled;
use crate::slots::type_of_slot;
use crate::symbol::symbol;

/// Maximum number of words of a name; more are a clause.
pub(super) const NAME_WORDS: usize = 4;

/// Conjunction that joins clauses.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Joint {
    And,
    Or,
}

/// Phrase with its slot values and place restrictions.
#[derive(Debug, Clone)]
pub(super) struct Clause<'a> {
    pub(super) phrase: &'a GoalPhrase,
    pub(super) slots: Vec<Filled>,
    pub(super) within: Vec<Restriction>,
}

/// Place restriction, such as "in the kitchen": preposition, type and symbol.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct Restriction {
    preposition: String,
    of_type: String,
    symbol: String,
}

/// Clauses joined by one conjunction.
#[derive(Debug, Clone)]
pub(super) struct Sentence<'a> {
    pub(super) joint: Joint,
    pub(super) clauses: Vec<Clause<'a>>,
}

/// Slot content that is no known name.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Miss {
    pub(super) of_type: String,
    pub(super) found: String,
}

/// Meaning of a name in a slot, with its place restriction.
#[derive(Clone)]
struct Noun {
    symbol: String,
    name: String,
    within: Option<Restriction>,
}

/// Conjunction between clauses or names; `Some(None)` for a comma, `None` for any other word.
fn joint(word: &str) -> Option<Option<Joint>> {
    match word {
        "and" => Some(Some(Joint::And)),
        "or" => Some(Some(Joint::Or)),
        "," => Some(None),
        _ => None,
    }
}

/// Reads sentences in the words of a domain.
pub(super) struct Reader<'a> {
    pub(super) domain: &'a Domain,
    pub(super) lexicon: &'a Lexicon,
    /// Slot contents that are no known names, in phrases that fit otherwise.
    pub(super) misses: Vec<Miss>,
    /// True if "and" and "or" were found side by side.
    pub(super) is_mixed: bool,
    /// All forms of all phrases, in plain words.
    forms: Rc<Vec<(&'a GoalPhrase, Vec<String>)>>,
    /// Parts of the sentence that are known not to match.
    dead: BTreeSet<String>,
}

impl<'a> Reader<'a> {
    pub(super) fn new(domain: &'a Domain, lexicon: &'a Lexicon) -> Self {
        let of = |phrase: &'a GoalPhrase, say: &str| {
            let own: Vec<String> = pattern(say).iter().map(|word| word.to_lowercase()).collect();
            english::forms(&english::joined(&own)).into_iter().map(move |form| (phrase, form))
        };
        let phrases = domain.config.goal.iter();
        let forms = phrases.flat_map(|phrase| phrase.ways().flat_map(move |say| of(phrase, say))).collect();
        let (misses, dead) = Default::default();
        Self { domain, lexicon, misses, is_mixed: false, forms: Rc::new(forms), dead }
    }

    /// Matches words with one phrase, word for word.
    pub(super) fn literal(&mut self, words: &[String]) -> Option<Sentence<'a>> {
        let said = self.domain.config.goal.iter().flat_map(|p| p.ways().map(move |say| (p, say)));
        for (phrase, say) in said {
            for slots in fits(&pattern(say), words, |a, b| a == b) {
                if let Some(clause) = self.filled(phrase, &slots) {
                    return Some(Sentence { joint: Joint::And, clauses: vec![clause] });
                }
            }
        }
        None
    }

    /// Matches plain words with one phrase, or with several joined by conjunctions.
    pub(super) fn sentence(&mut self, words: &[String]) -> Option<Sentence<'a>> {
        let text = words.join(" ");
        if self.dead.contains(&text) {
            return None;
        }
        if let Some(clause) = self.clause(words) {
            return Some(clause);
        }
        for at in 1..words.len() {
            let Some(between) = joint(&words[at]) else { continue };
            let Some(head) = self.clause(&words[..at]) else { continue };
            let more = words[at..].iter().take_while(|word| joint(word).is_some()).count();
            let between = words[at..at + more].iter().filter_map(|word| joint(word)?).next().or(between);
            let tail = resolved(&words[at + more..], &head);
            // "… and the mug on the counter" leaves the verb out.
            let again = || [&words[..1], &tail].concat();
            let Some(tail) = self.sentence(&tail).or_else(|| self.sentence(&again())) else { continue };
            if let Some(joined) = self.joined(head, between, tail) {
                return Some(joined);
            }
        }
        self.dead.insert(text);
        None
    }

    fn joined(
        &mut self,
        head: Sentence<'a>,
        between: Option<Joint>,
        tail: Sentence<'a>,
    ) -> Option<Sentence<'a>> {
        let of = |s: &Sentence<'a>| (s.clauses.len() > 1).then_some(s.joint);
        let mut joints = [of(&head), between, of(&tail)].into_iter().flatten();
        let joint = joints.next().unwrap_or(Joint::And);
        if joints.any(|other| other != joint) {
            self.is_mixed = true;
            return None;
        }
        Some(Sentence { joint, clauses: head.clauses.into_iter().chain(tail.clauses).collect() })
    }

    /// Matches words with one phrase, of which one slot may hold several names. The domain's own words
    /// take precedence over synonyms.
    fn clause(&mut self, words: &[String]) -> Option<Sentence<'a>> {
        self.clause_in(words, |own, said| own == said).or_else(|| self.clause_in(words, english::is_same))
    }

    fn clause_in(&mut self, words: &[String], is_same: fn(&str, &str) -> bool) -> Option<Sentence<'a>> {
        for (phrase, form) in Rc::clone(&self.forms).iter() {
            let form: Vec<&str> = form.iter().map(String::as_str).collect();
            for slots in fits(&form, words, is_same) {
                if let Some(clause) = self.filled(phrase, &slots) {
                    return Some(Sentence { joint: Joint::And, clauses: vec![clause] });
                }
                if let Some(several) = self.several(phrase, &slots) {
                    return Some(several);
                }
            }
        }
        None
    }

    /// Clause of a phrase with one name per slot; `None` if a slot holds no known name, which is noted
    /// in `misses`.
    fn filled(&mut self, phrase: &'a GoalPhrase, slots: &[(&str, String)]) -> Option<Clause<'a>> {
        let mut filled = Vec::new();
        for (slot, found) in slots {
            let words: Vec<String> = found.split(' ').map(str::to_string).collect();
            match self.called(type_of_slot(slot), &words) {
                Some(noun) => fill(&mut filled, slot, &noun),
                None => {
                    let name = english::without_determiners(&words);
                    let miss = Miss { of_type: type_of_slot(slot).into(), found: name.join(" ") };
                    let is_news = name.len() <= NAME_WORDS && !self.misses.contains(&miss);
                    self.misses.extend(is_news.then_some(miss));
                    return None;
                }
            }
        }
        Some(Clause { phrase, slots: filled, within: Vec::new() })
    }

    /// Clauses of a phrase in which one slot holds several names, or a name with a place.
    fn several(&mut self, phrase: &'a GoalPhrase, slots: &[(&str, String)]) -> Option<Sentence<'a>> {
        let mut lists = Vec::new();
        for (slot, found) in slots {
            let words: Vec<String> = found.split(' ').map(str::to_string).collect();
            lists.push(self.nouns(type_of_slot(slot), &words)?);
        }
        // Which goes with which would be a guess.
        if lists.iter().filter(|(_, nouns)| nouns.len() > 1).count() > 1 {
            self.is_mixed = true;
            return None;
        }
        let joint = lists.iter().find(|(_, nouns)| nouns.len() > 1).map_or(Joint::And, |(joint, _)| *joint);
        let count = lists.iter().map(|(_, nouns)| nouns.len()).max().unwrap_or(1);
        let of = |n: usize| {
            let mut clause = Clause { phrase, slots: Vec::new(), within: Vec::new() };
            for ((slot, _), (_, nouns)) in slots.iter().zip(&lists) {
                let noun = &nouns[n.min(nouns.len() - 1)];
                fill(&mut clause.slots, slot, noun);
                clause.within.extend(noun.within.clone());
            }
            clause
        };
        let clauses: Vec<Clause<'a>> = (0..count).map(of).collect();
        let can_be = |c: &Clause<'a>| restricted(&c.phrase.means, &c.within, self.domain).is_some();
        clauses.iter().all(can_be).then_some(Sentence { joint, clauses })
    }

    /// Names joined by "and" or "or"; a place after the last applies to earlier names without a
    /// place.
    fn nouns(&mut self, of_type: &str, words: &[String]) -> Option<(Joint, Vec<Noun>)> {
        if let Some(noun) = self.noun(of_type, words) {
            return Some((Joint::And, vec![noun]));
        }
        let is_joint = |word: &String| joint(word).is_some();
        if words.first().is_some_and(is_joint) || words.last().is_some_and(is_joint) {
            return None;
        }
        let joints: Vec<Joint> = words.iter().filter_map(|word| joint(word)?).collect();
        let parts: Vec<&[String]> = words.split(is_joint).filter(|part| !part.is_empty()).collect();
        let mut nouns: Vec<Noun> = Vec::new();
        for part in parts {
            let noun = self.noun(of_type, part).or_else(|| self.elsewhere(of_type, part, nouns.last()?))?;
            nouns.push(noun);
        }
        let first = joints.first().copied().unwrap_or(Joint::And);
        if joints.iter().any(|joint| *joint != first) {
            self.is_mixed = true;
            return None;
        }
        let last = nouns.last()?.within.clone();
        nouns.iter_mut().for_each(|noun| noun.within = noun.within.take().or_else(|| last.clone()));
        Some((first, nouns))
    }

    /// Known name, alone or followed by its place.
    fn noun(&self, of_type: &str, words: &[String]) -> Option<Noun> {
        self.called(of_type, words).or_else(|| {
            (1..words.len().saturating_sub(1)).find_map(|at| {
                let within = self.restriction(&words[at], &words[at + 1..])?;
                Some(Noun { within: Some(within), ..self.called(of_type, &words[..at])? })
            })
        })
    }

    /// Meaning of the words after a conjunction, given the noun before: another place ("in the
    /// kitchen or the study"), or a name after a repeated preposition ("on the desk or on the
    /// counter").
    fn elsewhere(&self, of_type: &str, words: &[String], before: &Noun) -> Option<Noun> {
        let (first, rest) = words.split_first()?;
        let is_again = ["in", "on", "to", "inside"].contains(&first.as_str());
        let place = if is_again { rest } else { words };
        match &before.within {
            Some(within) => {
                let preposition = if is_again { first } else { &within.preposition };
                Some(Noun { within: Some(self.restriction(preposition, place)?), ..before.clone() })
            }
            None if is_again => self.called(of_type, rest),
            None => None,
        }
    }

    fn restriction(&self, preposition: &str, place: &[String]) -> Option<Restriction> {
        if !["in", "on", "inside"].contains(&preposition) {
            return None;
        }
        let is_place =
            |of: &&str| *of != "thing" && *of != "kind" && named(self.lexicon.of_type(of), place).is_some();
        // Of the types that have the name, the narrowest has the fewest.
        let of = self.lexicon.types().filter(is_place).min_by_key(|of| self.lexicon.of_type(of).len())?;
        let symbol = named(self.lexicon.of_type(of), place)?.symbol.clone();
        let preposition = if preposition == "inside" { "in" } else { preposition }.to_string();
        Some(Restriction { preposition, of_type: of.into(), symbol })
    }

    fn called(&self, of_type: &str, words: &[String]) -> Option<Noun> {
        if let Some(named) = named(self.lexicon.of_type(of_type), words) {
            let name = self.lexicon.name_of(&named.symbol).to_string();
            return Some(Noun { symbol: named.symbol.clone(), name, within: None });
        }
        if let Some(noun) = self.coloured(of_type, words) {
            return Some(noun);
        }
        let name = crate::english::without_article(&words.join(" ")).to_string();
        let is_open = self.domain.config.open.iter().any(|of| of == of_type);
        let is_free = is_open && self.lexicon.is_free(&symbol(&name));
        is_free.then(|| Noun { symbol: symbol(&name), name, within: None })
    }
}

impl Reader<'_> {
    /// Colour before the name of an object or a kind that has models: "red cup".
    fn coloured(&self, of_type: &str, words: &[String]) -> Option<Noun> {
        let (first, rest) = english::without_determiners(words).split_first()?;
        let colour = basic(&first.to_lowercase()).filter(|_| ["thing", "kind"].contains(&of_type))?;
        let known = named(self.lexicon.of_type(of_type), rest)?;
        let is_seen = !thing(self.domain, &known.symbol).models.is_empty();
        let name = format!("{colour} {}", self.lexicon.name_of(&known.symbol));
        is_seen.then(|| Noun { symbol: format!("{colour}-{}", known.symbol), name, within: None })
    }
}

fn fill(filled: &mut Vec<Filled>, slot: &str, noun: &Noun) {
    let number = filled.iter().filter(|f| f.slot == *slot).count();
    filled.push(Filled { slot: slot.into(), number, symbol: noun.symbol.clone(), name: noun.name.clone() });
}

/// Object with a name, ignoring determiners, punctuation and blanks between letters and digits.
pub(super) fn named<'l>(all: &'l [Named], words: &[String]) -> Option<&'l Named> {
    let letters = |name: &str| -> String {
        name.chars().filter(|c| c.is_alphanumeric()).flat_map(char::to_lowercase).collect()
    };
    let (whole, bare) = (letters(&words.concat()), letters(&english::without_determiners(words).concat()));
    let is = |wanted: &str| all.iter().find(|n| n.names.iter().any(|name| letters(name) == *wanted));
    if bare.is_empty() { None } else { is(&whole).or_else(|| is(&bare)) }
}

/// Words with "it" replaced by the previous clause's object.
fn resolved(words: &[String], before: &Sentence<'_>) -> Vec<String> {
    let last = before.clauses.last().and_then(|clause| clause.slots.first()).map(|f| f.name.to_lowercase());
    let is_one = before.clauses.len() == 1;
    let of = |word: &String| match &last {
        Some(name) if word == "it" && is_one => name.split(' ').map(str::to_string).collect(),
        _ => vec![word.clone()],
    };
    words.iter().flat_map(of).collect()
}

/// Goal condition restricted to some places: the first object quantified over is such a place, or is
/// related to one by the domain's predicate for the preposition. `None` if the condition has no such
/// object.
pub(super) fn restricted(means: &str, within: &[Restriction], domain: &Domain) -> Option<String> {
    within.iter().try_fold(means.to_string(), |means, place| {
        let (before, behind) = means.split_once("(exists (?")?;
        let (bound, body) = behind.split_once(')')?;
        let (variable, of) = bound.split_once(" - ").map(|(v, of)| (v.trim(), of.trim()))?;
        let end = closing(body)?;
        let (inside, after) = (body[..end].trim(), &body[end + 1..]);
        if domain.vocabulary.is_a(&place.of_type, of) {
            let inside = inside.replace(&format!("?{variable})"), &format!("{})", place.symbol));
            let inside = inside.replace(&format!("?{variable} "), &format!("{} ", place.symbol));
            return Some(format!("{before}{inside}{after}"));
        }
        let word = domain.vocabulary.word(&place.preposition).filter(|w| !w.is_number)?;
        let [subject, object] = word.types.as_slice() else { return None };
        let fits = domain.vocabulary.is_a(of, subject) && domain.vocabulary.is_a(&place.of_type, object);
        let is_there = format!("({} ?{variable} {})", word.name, place.symbol);
        fits.then(|| format!("{before}(exists (?{bound}) (and {is_there} {inside})){after}"))
    })
}

/// Byte position of the bracket that closes the one opened just before a text.
fn closing(text: &str) -> Option<usize> {
    let mut open = 1;
    text.char_indices().find_map(|(at, c)| {
        match c {
            '(' => open += 1,
            ')' => open -= 1,
            _ => {}
        }
        (open == 0).then_some(at)
    })
}

impl Sentence<'_> {
    /// True for a yes-no question.
    ///
    /// # Errors
    /// [`GoalError::Apart`] for a question beside a task: a question changes nothing.
    pub(super) fn is_question(&self, said: &str) -> Result<bool, GoalError> {
        let questions = self.clauses.iter().filter(|c| c.phrase.question).count();
        match questions {
            0 => Ok(false),
            all if all == self.clauses.len() => Ok(true),
            _ => Err(GoalError::Apart { said: said.into() }),
        }
    }

    /// Checks that no thing is requested in two places at once.
    ///
    /// # Errors
    /// [`GoalError::TwoPlaces`] with the thing and its places.
    pub(super) fn check_places(&self, said: &str, question: bool) -> Result<(), GoalError> {
        if question || self.joint == Joint::Or {
            return Ok(());
        }
        let placed = |c: &Clause<'_>| match c.slots.as_slice() {
            [thing, place] if type_of_slot(&thing.slot) == "thing" && is_place(&place.slot) => {
                Some((c.phrase.say.clone(), thing.name.clone(), place.name.clone()))
            }
            _ => None,
        };
        let all: Vec<(String, String, String)> = self.clauses.iter().filter_map(placed).collect();
        let twice = all.iter().enumerate().find_map(|(n, (phrase, thing, place))| {
            let other = |(p, t, o): &&(String, String, String)| p == phrase && t == thing && o != place;
            all[..n].iter().find(other).map(|(_, _, before)| (thing.clone(), format!("{before} and {place}")))
        });
        let said = said.to_string();
        twice.map_or(Ok(()), |(thing, places)| Err(GoalError::TwoPlaces { said, thing, places }))
    }
}

fn is_place(slot: &str) -> bool {
    ["surface", "room"].contains(&type_of_slot(slot))
}
