//! Types of abilities: lists of facts, calls and skills, with the functions behind them.

use std::sync::Arc;

use descry_memory::remember::Remembered;
use descry_planner::{Answer, Call, CallError, Read};
use descry_robots::{Part, Robot};
use descry_skills::{Outcome, Skill, SkillFailure};

use crate::conclusion::{Conclusion, Ended};
pub use crate::config::ActionKind;
use crate::error::WorldError;
use crate::eyes::{Eyes, KnowsAgain};
use crate::known::{Known, Thing};
use crate::load::Domain;
use crate::mind::Mind;
use crate::note::Note;
use crate::objective::Goal;
use crate::own_map::OwnMap;
use crate::past::Past;
use crate::range::{Bounds, Referent};
use crate::situation::Situation;
use crate::states::States;
use crate::vocabulary::Vocabulary;

/// Ability of a body that domains can use: facts, calls and skills.
#[derive(Debug)]
pub struct Ability {
    /// Name used by domains.
    pub name: &'static str,
    /// Purpose of the ability, in a line.
    pub about: &'static str,
    /// Facts that the ability states.
    pub facts: &'static [Fact],
    /// Calls that the ability answers.
    pub calls: &'static [Meaning],
    /// Skills that the ability carries out.
    pub skills: &'static [SkillWord],
    /// Predicates, remembered by the domain, that the ability reads by name.
    pub traces: &'static [Trace],
    /// Parts of a body that the ability needs.
    pub needs: &'static [Part],
    /// Preparation of the ability's state at the beginning of a run, if any.
    pub begins: Option<Begins>,
    /// Fallback plan of this ability when the planner finds none, if it has its own.
    pub fallback: Option<Fallback>,
    /// Function for the final answer, if the ability has one of its own.
    pub answers: Option<Concludes>,
    /// Initial state of a run, if the ability has state.
    pub recalls: Option<Recalls>,
    /// Contribution to the persistent belief, if any.
    pub keeps: Option<Keeps>,
    /// Function for the objects that the ability adds to the problem, by type, if any.
    pub objects: Option<fn(&Situation) -> Vec<(&'static str, Vec<String>)>>,
    /// Names learned by the ability, each with its type, if any.
    pub names: Option<fn(&Known) -> Vec<(&'static str, String)>>,
    /// Function for objects that are not in the problem, with their types, if any: seen ones without a
    /// name, and unseen ones that may exist.
    pub others: Option<Others>,
    /// Learned object with a symbol, if the ability learns objects.
    pub thing: Option<fn(&States, &str) -> Option<Thing>>,
    /// Recognition of learned objects among percepts, in any domain, if any.
    pub again: Option<KnowsAgain>,
    /// Update after a finished drive, if any.
    pub has_driven: Option<fn(&mut Mind, &Situation)>,
    /// Update after a failed drive to a pose; returns a sentence if a retry is pointless.
    pub drive_failed: Option<DriveFailed>,
}

/// Sets an ability's state at the beginning of a run; returns the body's own map if the ability makes
/// one.
pub type Recalls = fn(&Domain, Option<&Past>, &dyn Robot, &mut States) -> Option<Arc<dyn OwnMap>>;

/// Lists objects that quantified conditions range over though no name denotes them, with their types.
pub type Others = for<'a> fn(&'a Situation) -> Vec<(&'static str, Referent<'a>)>;

/// Adds an ability's state to the persistent belief.
pub type Keeps = fn(&Known, &Past, &mut Remembered);

/// Handles a failed drive to a pose; returns a sentence if a retry is pointless.
pub type DriveFailed = fn(&mut Mind, &dyn Robot, &Situation, &str, &SkillFailure) -> Option<String>;

impl Ability {
    /// Ability with a name and a description, without any facts, calls, skills or state.
    pub const fn named(name: &'static str, about: &'static str) -> Self {
        Self {
            name,
            about,
            facts: &[],
            calls: &[],
            skills: &[],
            traces: &[],
            needs: &[],
            begins: None,
            fallback: None,
            answers: None,
            recalls: None,
            keeps: None,
            objects: None,
            names: None,
            others: None,
            thing: None,
            again: None,
            has_driven: None,
            drive_failed: None,
        }
    }
}

/// Predicate or function whose value an ability states.
#[derive(Debug)]
pub struct Fact {
    /// Name of the predicate or function.
    pub name: &'static str,
    /// Argument types.
    pub types: &'static [&'static str],
    /// Meaning of the fact, in a line.
    pub about: &'static str,
    /// Lists the instances that hold now, one line of PDDL each.
    pub states: fn(&Situation) -> Vec<String>,
    /// Bounds on the value after further views; `None`: the value is known for each object that was
    /// seen.
    pub bounds: Option<Bounds>,
}

/// Predicate, remembered by the domain, that a skill's outcome sets and an ability reads by name.
#[derive(Debug)]
pub struct Trace {
    /// Name of the predicate.
    pub name: &'static str,
    /// Argument types.
    pub types: &'static [&'static str],
    /// Name of the skill.
    pub of: &'static str,
    /// Consequence, in a line, for a domain that does not remember the predicate.
    pub without: &'static str,
}

/// Facts, besides the arguments, on which the answer of a call depends.
#[derive(Debug)]
pub struct Reads {
    /// Name of the predicate.
    pub word: &'static str,
    /// Types of the relevant arguments, each the call's only argument of that type; `None`: any
    /// object.
    pub of: &'static [Option<&'static str>],
}

impl Reads {
    /// All instances of a predicate.
    pub const fn all(word: &'static str) -> Reads {
        Reads { word, of: &[] }
    }

    /// Read set for the planner, for a call with these parameter types; a type that is ambiguous or
    /// missing is left open.
    pub fn of_call(&self, vocabulary: &Vocabulary, types: &[String]) -> Read {
        let one = |wanted: &str| {
            let mut fitting = (0..types.len()).filter(|&n| vocabulary.is_a(&types[n], wanted));
            fitting.next().filter(|_| fitting.next().is_none())
        };
        let at = |wanted: &Option<&str>| match wanted {
            None => Some(None),
            Some(wanted) => one(wanted).map(Some),
        };
        let positions: Option<Vec<Option<usize>>> = self.of.iter().map(at).collect();
        match positions.filter(|positions| !positions.is_empty()) {
            Some(positions) => Read::At(self.word.into(), positions),
            None => Read::All(self.word.into()),
        }
    }
}

/// A call that an ability answers.
#[derive(Debug)]
pub struct Meaning {
    /// Name of the call in a domain.
    pub name: &'static str,
    /// Facts, besides the arguments, on which the answer depends.
    pub reads: &'static [Reads],
    /// True if the answer is advice about usefulness, not about possibility.
    pub is_advice: bool,
    /// Meaning of the call, in a line.
    pub about: &'static str,
    /// Computes the answer in a situation.
    pub answers: fn(&Situation, &Call) -> Result<Answer, CallError>,
}

/// Skill of an ability, as named in a domain.
#[derive(Debug)]
pub struct SkillWord {
    /// Name used by actions.
    pub name: &'static str,
    /// Effect on the world.
    pub kind: ActionKind,
    /// Argument types.
    pub types: &'static [&'static str],
    /// Effect of the skill, in a line.
    pub about: &'static str,
    /// Grounds the skill for the body's current state, or states why that is impossible.
    pub ground: Grounding,
    /// Reason for the skill in a situation, as a clause: its cost and expected gain.
    pub because: fn(&Situation, &[&str]) -> String,
    /// Updates the world model from the outcome; returns a sentence, empty without news.
    pub learn: Learn,
    /// Updates the world model from a failure, besides the domain's own lessons; returns a sentence
    /// if a retry is pointless.
    pub failed: Failed,
}

/// Grounds a skill for the body's current state, or states why that is impossible.
pub type Grounding = fn(&Situation, &[&str]) -> Result<Box<dyn Skill>, String>;

/// Updates the world model from the outcome of a skill; returns a sentence, empty without news.
pub type Learn =
    fn(&mut Mind, Eyes<'_>, &Situation, &[&str], &Outcome, &mut Vec<Note>) -> Result<String, WorldError>;

/// Updates the world model from the failure of a skill; returns a sentence if a retry is pointless.
pub type Failed =
    fn(&mut Mind, Eyes<'_>, &Situation, &[&str], &SkillFailure) -> Result<Option<String>, WorldError>;

/// Failure handler that updates nothing.
pub(crate) const NOTHING_MORE: Failed = |_, _, _, _, _| Ok(None);

/// Prepares an ability's state at the beginning of a run.
pub type Begins = fn(&mut Mind, &Domain, &Goal);

/// Lists fallback plans that are certainly useful, best first; each is one skill, preceded by a drive if
/// needed.
pub type Fallback = fn(&Situation) -> Vec<Vec<Deed>>;

/// Gives the final answer from the last round's situation; `None` leaves the answer to *searching*.
pub type Concludes = fn(&Goal, &Mind, &Situation, &Ended) -> Option<Conclusion>;

/// Skill with its arguments, to be carried out by an action of the domain.
#[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord)]
pub struct Deed {
    /// Name of the skill.
    pub skill: &'static str,
    /// Arguments in the skill's order.
    pub arguments: Vec<String>,
}

impl Deed {
    /// Skill with its arguments.
    pub(crate) fn new(skill: &'static str, arguments: impl IntoIterator<Item = impl Into<String>>) -> Self {
        Self { skill, arguments: arguments.into_iter().map(Into::into).collect() }
    }

    /// Sequence of the drive to a candidate, unless the body is there, and this skill.
    pub(crate) fn after_drive(self, s: &Situation, to: usize) -> Vec<Deed> {
        let symbol = |n: usize| s.candidates[n].symbol.as_str();
        let drive = (to != s.at).then(|| Deed::new(MOVE, [symbol(s.at), symbol(to)]));
        drive.into_iter().chain([self]).collect()
    }
}

/// Values with ratings, sorted from the greatest rating to the least; of equals the later first.
pub(crate) fn best_first<T>(mut all: Vec<(f64, T)>) -> Vec<T> {
    all.reverse();
    all.sort_by(|a, b| b.0.total_cmp(&a.0));
    all.into_iter().map(|(_, value)| value).collect()
}

/// Values with durations, sorted from the shortest to the longest; equals keep their order.
pub(crate) fn quickest_first<T>(mut all: Vec<(f64, T)>) -> Vec<T> {
    all.sort_by(|a, b| a.0.total_cmp(&b.0));
    all.into_iter().map(|(_, value)| value).collect()
}

/// The `n`-th argument of a call, from 0; an error if it is missing.
pub(crate) fn argument(call: &Call, n: usize) -> Result<&str, CallError> {
    call.arguments
        .get(n)
        .map(|a| &**a)
        .ok_or_else(|| CallError::Failed(format!("{call} lacks argument {}", n + 1)))
}

/// Skill that drives from one pose to another.
pub(crate) const MOVE: &str = "move";

/// Skill that takes a view of a surface.
pub(crate) const OBSERVE: &str = "observe";
