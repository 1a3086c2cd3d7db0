//! Abilities as types: lists of facts, calls and skills, with the functions behind them.

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
use crate::range::Bounds;
use crate::situation::Situation;
use crate::states::States;
use crate::vocabulary::Vocabulary;

/// An ability of a body, in the words of a domain.
#[derive(Debug)]
pub struct Ability {
    /// The name by which a domain uses it.
    pub name: &'static str,
    /// Its purpose, in a line.
    pub about: &'static str,
    /// The words that it states.
    pub facts: &'static [Fact],
    /// The calls that it answers.
    pub calls: &'static [Meaning],
    /// Skills that it can carry out.
    pub skills: &'static [SkillWord],
    /// The words that it reads by name and a domain remembers.
    pub traces: &'static [Trace],
    /// The parts of a body without which it can do nothing.
    pub needs: &'static [Part],
    /// Preparation at the beginning of a run, if any.
    pub begins: Option<Begins>,
    /// Fallback plan of this ability when the planner finds none, if it has its own.
    pub fallback: Option<Fallback>,
    /// Final answer of this ability, if it has its own.
    pub answers: Option<Concludes>,
    /// State with which a run begins, if it has any.
    pub recalls: Option<Recalls>,
    /// Contribution to what later runs remember, if any.
    pub keeps: Option<Keeps>,
    /// Objects that it adds to the problem, if any.
    pub objects: Option<fn(&Situation) -> Vec<(&'static str, Vec<String>)>>,
    /// Names that it has come to know, each with its type, if any.
    pub names: Option<fn(&Known) -> Vec<(&'static str, String)>>,
    /// The thing of a symbol that it has learned, if it learns things.
    pub thing: Option<fn(&States, &str) -> Option<Thing>>,
    /// Recognition among percepts, in any domain, if any.
    pub again: Option<KnowsAgain>,
    /// Update from a drive that has come to its end, if it makes use of drives.
    pub has_driven: Option<fn(&mut Mind, &Situation)>,
    /// Update from a drive to a pose that has failed; in words, if a second try is not worthwhile.
    pub drive_failed: Option<DriveFailed>,
}

/// State of an ability at the beginning of a run, and the map that the body has made itself, if any.
pub type Recalls = fn(&Domain, Option<&Past>, &dyn Robot, &mut States) -> Option<Arc<dyn OwnMap>>;

/// Adds to what later runs remember.
pub type Keeps = fn(&Known, &Past, &mut Remembered);

/// Takes in that a drive to a pose has failed.
pub type DriveFailed = fn(&mut Mind, &dyn Robot, &Situation, &str, &SkillFailure) -> Option<String>;

impl Ability {
    /// An ability of a name without any facts, calls, skills or state.
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
            thing: None,
            again: None,
            has_driven: None,
            drive_failed: None,
        }
    }
}

/// A word whose value an ability states.
#[derive(Debug)]
pub struct Fact {
    /// The predicate or function.
    pub name: &'static str,
    /// The types of its arguments.
    pub types: &'static [&'static str],
    /// Its meaning, in a line.
    pub about: &'static str,
    /// The instances that hold now, a line of PDDL each.
    pub states: fn(&Situation) -> Vec<String>,
    /// Bounds on the value that looks may still reveal; none: its value is known.
    pub bounds: Option<Bounds>,
}

/// A word that is remembered of what a skill has done, read by its name.
#[derive(Debug)]
pub struct Trace {
    /// The predicate.
    pub name: &'static str,
    /// The types of its arguments.
    pub types: &'static [&'static str],
    /// The skill.
    pub of: &'static str,
    /// The consequence for a domain that does not remember it, in a line.
    pub without: &'static str,
}

/// Facts on which the answer of a call depends besides its arguments.
#[derive(Debug)]
pub struct Reads {
    /// The predicate.
    pub word: &'static str,
    /// Types of the arguments that matter, if not all do: each is the call's only argument of that type;
    /// `None`: any.
    pub of: &'static [Option<&'static str>],
}

impl Reads {
    /// All of a predicate.
    pub const fn all(word: &'static str) -> Reads {
        Reads { word, of: &[] }
    }

    /// The same for the planner, of a call with parameters of these types; where a type is not that of one parameter, all of them.
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
    /// The module's name.
    pub name: &'static str,
    /// The facts that its answer depends on besides its arguments.
    pub reads: &'static [Reads],
    /// True if its answer is advice about usefulness, not about possibility.
    pub is_advice: bool,
    /// Its meaning, in a line.
    pub about: &'static str,
    /// The answer.
    pub answers: fn(&Situation, &Call) -> Result<Answer, CallError>,
}

/// Something that an ability can carry out.
#[derive(Debug)]
pub struct SkillWord {
    /// The name by which actions use it.
    pub name: &'static str,
    /// Effect on the world.
    pub kind: ActionKind,
    /// The types of its arguments.
    pub types: &'static [&'static str],
    /// Its effect, in a line.
    pub about: &'static str,
    /// Its meaning for the body now, or why it has none.
    pub ground: Grounding,
    /// Its cost and expected gain, in words.
    pub because: fn(&Situation, &[&str]) -> String,
    /// Update of the world model from its outcome; in words, if there is anything to say.
    pub learn: Learn,
    /// Update of the world model from its failure, besides what the domain says; in words, if a second try is
    /// not worthwhile.
    pub failed: Failed,
}

/// Finds the meaning of a skill for the body now, or why it has none.
pub type Grounding = fn(&Situation, &[&str]) -> Result<Box<dyn Skill>, String>;

/// Takes the outcome of a skill in.
pub type Learn =
    fn(&mut Mind, Eyes<'_>, &Situation, &[&str], &Outcome, &mut Vec<Note>) -> Result<String, WorldError>;

/// Takes the failure of a skill in.
pub type Failed =
    fn(&mut Mind, Eyes<'_>, &Situation, &[&str], &SkillFailure) -> Result<Option<String>, WorldError>;

/// Nothing more follows from a failure.
pub(crate) const NOTHING_MORE: Failed = |_, _, _, _, _| Ok(None);

/// Prepares a run.
pub type Begins = fn(&mut Mind, &Domain, &Goal);

/// Fallback plans that are surely useful, the best first. Each is a deed, with the drive to it where one is
/// needed.
pub type Fallback = fn(&Situation) -> Vec<Vec<Deed>>;

/// Answers in the end, by the situation of the last round; none where searching answers.
pub type Concludes = fn(&Goal, &Mind, &Situation, &Ended) -> Option<Conclusion>;

/// A skill with its arguments, for an action of the domain to do.
#[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord)]
pub struct Deed {
    /// Name of the skill.
    pub skill: &'static str,
    /// Its arguments, in its own order.
    pub arguments: Vec<String>,
}

impl Deed {
    /// A skill on some objects.
    pub(crate) fn new(skill: &'static str, arguments: impl IntoIterator<Item = impl Into<String>>) -> Self {
        Self { skill, arguments: arguments.into_iter().map(Into::into).collect() }
    }

    /// The drive to a candidate, and a deed there.
    pub(crate) fn after_drive(self, s: &Situation, to: usize) -> Vec<Deed> {
        let symbol = |n: usize| s.candidates[n].symbol.as_str();
        let drive = (to != s.at).then(|| Deed::new(MOVE, [symbol(s.at), symbol(to)]));
        drive.into_iter().chain([self]).collect()
    }
}

/// Values in the order of a rating, the greatest first; of equals the later first.
pub(crate) fn best_first<T>(mut all: Vec<(f64, T)>) -> Vec<T> {
    all.reverse();
    all.sort_by(|a, b| b.0.total_cmp(&a.0));
    all.into_iter().map(|(_, value)| value).collect()
}

/// Values in the order of what they take, the least first; of equals the earlier first.
pub(crate) fn quickest_first<T>(mut all: Vec<(f64, T)>) -> Vec<T> {
    all.sort_by(|a, b| a.0.total_cmp(&b.0));
    all.into_iter().map(|(_, value)| value).collect()
}

/// The `n`-th argument of a call, by name.
pub(crate) fn argument(call: &Call, n: usize) -> Result<&str, CallError> {
    call.arguments
        .get(n)
        .map(|a| &**a)
        .ok_or_else(|| CallError::Failed(format!("{call} lacks argument {}", n + 1)))
}

/// The skill that drives from one pose to another.
pub(crate) const MOVE: &str = "move";

/// The skill that looks at a surface.
pub(crate) const OBSERVE: &str = "observe";
