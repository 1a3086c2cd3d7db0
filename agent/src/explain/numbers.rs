//! Which numbers of a domain say how sure it is of what was asked for: those that the goal compares, as the plans name them too.

use descry_domains::lexicon::symbol;

use super::standings::{Standing, certainty};
use crate::compared::{self, words};
use crate::standing::InDoubt;
use crate::weigh::Expected;

/// A number that is less says nothing of where something is.
const NEXT_TO_NOTHING: f64 = 0.05;

/// A number that says how sure it is of something.
#[derive(Debug, Clone, PartialEq)]
pub struct Sure {
    /// As it is written in PDDL, or said.
    pub name: String,
    /// What it was; none if that is not known.
    pub was: Option<f64>,
    /// What it is.
    pub now: f64,
    /// What it has to be.
    pub wanted: f64,
}

/// The numbers that say how sure it is of a doubt: those that the goal compares; else those that the plan hopes for; else how
/// sure it is said to be. None of a record that does not say.
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn how_sure_it_is_is_said_by_the_numbers_that_the_goal_compares() {
        let doubt = InDoubt { about: "a ring".into(), wanted: 0.8, ..InDoubt::default() };
        let standing = |numbers: &[(&str, f64)]| {
            let numbers = numbers.iter().map(|(name, value)| (format!("({name})"), *value)).collect();
            Standing { numbers, ..Standing::default() }
        };
        let hoped = |name: &str| vec![Expected { name: format!("({name})"), now: 0.0, then: 0.9 }];
        let check = |goal: &str, hoped: &[Expected], numbers: &[(&str, f64)], said: &[(&str, f64)]| {
            let sure = of(&doubt, None, &standing(numbers), goal, hoped);
            let sure: Vec<(&str, f64)> =
                sure.iter().map(|s| (s.name.trim_matches(['(', ')']), s.now)).collect();
            assert_eq!(sure, said, "{goal}");
        };
        let find = "(and (exists (?s - place) (>= (presence a-ring ?s) 0.8)) (>= (placed a-ring) 0.8))";
        let numbers =
            [("presence a-ring ledge", 0.0), ("presence a-ring shelf", 0.3), ("placed a-ring", 0.5)];
        let on_the_shelf = [("presence a-ring shelf", 0.3), ("placed a-ring", 0.5)];
        check(find, &hoped("presence a-ring ledge"), &numbers, &on_the_shelf);
        let nowhere = [("presence a-ring ledge", 0.0), ("presence a-ring shelf", 0.0)];
        check(find, &hoped("presence a-ring ledge"), &nowhere, &nowhere[..1]);
        let all = "(forall (?s - place) (>= (presence a-ring ?s) 0.8))";
        check(all, &[], &numbers, &numbers[..1]);
        check("(holding a-ring)", &hoped("presence a-ring shelf"), &numbers, &numbers[1..2]);
        let brought = [("presence a-ring ledge", 0.1), ("presence a-ring shelf", 0.9)];
        check("(on a-ring shelf)", &hoped("presence a-ring ledge"), &brought, &brought[1..]);
        check("(holding a-ring)", &[], &numbers, &[]);
        check("(>= (presence stone shelf) 0.8)", &[], &numbers, &[]);
    }
}
