//! Numeric fluents of a domain that express confidence in the answer: those that the goal compares,
//! under the names that plans use.

use descry_agent::compared::{self, words};
use descry_agent::standing::InDoubt;
use descry_agent::weigh::Expected;
use descry_domains::symbol::symbol;

use super::standings::{Standing, certainty};

/// Value below which a number says nothing about an object's position.
const NEXT_TO_NOTHING: f64 = 0.05;

/// Numeric fluent that expresses confidence, with its values.
#[derive(Debug, Clone, PartialEq)]
pub struct Sure {
    /// Name of the number in PDDL, or a description in words.
    pub name: String,
    /// Earlier value; `None` if unknown.
    pub was: Option<f64>,
    /// Present value.
    pub now: f64,
    /// Required value.
    pub wanted: f64,
}

/// Numbers that express the confidence about a doubt: those that the goal compares; otherwise those
/// that the plan is expected to improve; otherwise the recorded confidence. Empty if the record has
/// none.
pub fn of(
    doubt: &InDoubt,
    before: Option<&Standing>,
    after: &Standing,
    goal: &str,
    hoped: &[Expected],
) -> Vec<Sure> {
    let about = symbol(&doubt.about);
    let sure = |name: &str, now: f64, wanted: f64| {
        let was = before.and_then(|before| before.numbers.get(name)).copied();
        Sure { name: name.to_owned(), was, now, wanted }
    };
    let asked =
        compared::all(goal).filter(|compared| !compared.less && compared.of.contains(&about.as_str()));
    let asked = asked.filter_map(|compared| {
        let wanted = compared.wanted?;
        let fitting = || after.numbers.iter().filter(|(name, _)| compared.fits(name));
        let by_value = |a: &(&String, &f64), b: &(&String, &f64)| a.1.total_cmp(b.1);
        let decisive = if compared.of_all { fitting().min_by(by_value) } else { fitting().max_by(by_value) }?;
        // Of many that are next to nothing: the one that the plan was about.
        let is_hoped = |(name, _): &(&String, &f64)| hoped.iter().any(|hoped| hoped.name == **name);
        let (name, now) = if *decisive.1 < NEXT_TO_NOTHING {
            fitting().find(is_hoped).unwrap_or(decisive)
        } else {
            decisive
        };
        Some(sure(name, *now, wanted))
    });
    let asked: Vec<Sure> = asked.collect();
    if !asked.is_empty() {
        return asked;
    }
    let is_about = |number: &&Expected| words(&number.name).skip(1).any(|word| word == about);
    let hoped = hoped.iter().filter(is_about);
    // Of what a plan hoped for in one place, that of the place where it is by now.
    let alike = |number: &str| {
        let word = words(number).next().unwrap_or_default().to_owned();
        let all = after.numbers.iter().filter(move |(name, _)| words(name).next() == Some(&word));
        all.filter(|(name, _)| words(name).skip(1).any(|word| word == about))
    };
    let decisive = |n: &Expected| {
        let best = alike(&n.name).max_by(|a, b| a.1.total_cmp(b.1))?;
        let own = after.numbers.get_key_value(&n.name);
        let (name, now) = if *best.1 < NEXT_TO_NOTHING { own.unwrap_or(best) } else { best };
        Some(sure(name, *now, doubt.wanted))
    };
    let mut all: Vec<Sure> = hoped.filter_map(decisive).collect();
    all.dedup();
    if all.is_empty() {
        let was = before.and_then(|before| before.same(doubt)?.sure);
        let name = certainty(doubt);
        all.extend(doubt.sure.map(|now| Sure { name, was, now, wanted: doubt.wanted }));
    }
    all
}
