//! Sources of the values of predicates and functions: abilities, programs, the domain itself.

use crate::abilities;
use crate::ability::Fact;
use crate::actions;
use crate::config::{ActionKind, Source as Kept};
use crate::load::Domain;
use crate::vocabulary::Word;

/// Source of the values of a predicate or function in a run.
#[derive(Debug, Clone, Copy)]
pub enum Origin {
    /// Stated by an ability's fact from the current belief.
    Sensed(&'static Fact),
    /// Stated by a program.
    SensedByProgram,
    /// Initialised by the domain or the store, and changed by the effects of completed actions.
    Remembered,
    /// Never changed.
    Fixed,
    /// Changed within a plan only.
    Planned,
    /// Derived by the domain's rules.
    Derived,
}

/// Source of the values of a predicate or function.
pub fn of(domain: &Domain, word: &Word) -> Origin {
    let config = &domain.config;
    let configured = config.word.get(&word.name);
    if word.is_derived {
        return Origin::Derived;
    }
    if configured.is_some_and(|c| c.program.is_some()) {
        return Origin::SensedByProgram;
    }
    match (configured.and_then(|c| c.is), abilities::fact(&config.uses, &word.name)) {
        (Some(Kept::Remembered), _) => Origin::Remembered,
        (Some(Kept::Fixed), _) => Origin::Fixed,
        (Some(Kept::Planned), _) => Origin::Planned,
        (None, Some(fact)) => Origin::Sensed(fact),
        (None, None) if domain.vocabulary.is_changed(&word.name) => Origin::Remembered,
        (None, None) if config.action.values().any(|a| a.taught().any(|t| t == word.name)) => {
            Origin::Remembered
        }
        (None, None) => Origin::Fixed,
    }
}

/// Names of the domain's remembered predicates and functions.
pub fn remembered(domain: &Domain) -> Vec<String> {
    let vocabulary = &domain.vocabulary;
    let is_remembered = |w: &Word| matches!(of(domain, w), Origin::Remembered);
    vocabulary.words().into_iter().filter(is_remembered).map(|w| w.name).collect()
}

/// True if a program states the values of a predicate or function, and they are unknown until an action
/// has been taken that sets them: one that may find them out.
pub fn is_revealed(domain: &Domain, word: &Word) -> bool {
    let may_sense = |kind: Option<ActionKind>| kind.is_none_or(|kind| kind == ActionKind::Sensing);
    set_by(domain, word, may_sense)
}

/// True if a program states the values of a predicate or function, and a sensing action reveals them.
pub fn is_found_out(domain: &Domain, word: &Word) -> bool {
    set_by(domain, word, |kind| kind == Some(ActionKind::Sensing))
}

/// Action of a program that sets a predicate or function stated by a program, if it is left unsaid
/// whether the action finds the values out or brings them about, and no other finds them out.
pub fn unsaid<'a>(domain: &'a Domain, word: &Word) -> Option<&'a str> {
    let is_open = is_revealed(domain, word) && !is_found_out(domain, word);
    let mut setters = domain.vocabulary.changers(&word.name).into_iter().filter(|_| is_open);
    setters.find(|action| actions::stated_kind(&domain.config, action).is_none())
}

/// True if a program states the values of a predicate or function, and an action sets them whose stated
/// kind, `None` for that of a program without one, is such.
fn set_by(domain: &Domain, word: &Word, is_such: impl Fn(Option<ActionKind>) -> bool) -> bool {
    let sets = |action: &str| is_such(actions::stated_kind(&domain.config, action));
    matches!(of(domain, word), Origin::SensedByProgram)
        && domain.vocabulary.changers(&word.name).into_iter().any(sets)
}

/// True if an ability or a program states the values of a predicate or function.
pub fn is_sensed(domain: &Domain, word: &Word) -> bool {
    matches!(of(domain, word), Origin::Sensed(_) | Origin::SensedByProgram)
}
