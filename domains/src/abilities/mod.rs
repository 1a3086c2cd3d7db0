//! Abilities, used by domains by name: each is a list of facts, calls and skills, with the
//! functions behind them.

pub mod carrying;
pub mod learning;
pub mod moving;
pub mod pouring;
pub mod reading;
pub mod searching;
pub mod shapes;
pub mod surveying;

use crate::ability::{Ability, Fact, SkillWord};

/// All abilities; the first belongs to every domain and needs no naming.
pub const ALL: &[&Ability] = &[
    &moving::ABILITY,
    &searching::ABILITY,
    &carrying::ABILITY,
    &pouring::ABILITY,
    &reading::ABILITY,
    &shapes::ABILITY,
    &surveying::ABILITY,
    &learning::ABILITY,
];

/// The abilities that a domain uses.
pub fn used(names: &[String]) -> impl Iterator<Item = &'static Ability> + '_ {
    ALL.iter()
        .copied()
        .enumerate()
        .filter(|(n, a)| *n == 0 || names.iter().any(|name| name == a.name))
        .map(|(_, a)| a)
}

/// Description of a call that an ability answers; `None` if no used ability does or the domain answers
/// the call itself.
pub fn meaning(config: &crate::config::Config, call: &str) -> Option<String> {
    let is_own = config.attachments.contains_key(call);
    let mut calls = used(&config.uses).flat_map(|ability| ability.calls);
    calls.find(|c| c.name == call && !is_own).map(|c| c.about.to_string())
}

/// Fact with this name among the abilities that a domain uses.
pub fn fact(uses: &[String], name: &str) -> Option<&'static Fact> {
    used(uses).flat_map(|a| a.facts).find(|f| f.name == name)
}

/// Skill with this name among the abilities that a domain uses.
pub fn skill(uses: &[String], name: &str) -> Option<&'static SkillWord> {
    used(uses).flat_map(|a| a.skills).find(|s| s.name == name)
}
