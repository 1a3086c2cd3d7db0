//! Trait of all skills: arguments in SI units, cancellation, and a time limit.

use async_trait::async_trait;
use descry_robots::perception::laser::Alignment;
use descry_robots::{
    Answer, CancellationToken, Driven, Failure, Grasped, Hand, Progress, Robot, Sensed, Watch,
};

use crate::model::Modelled;

/// Grounded action of a plan.
#[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord)]
pub struct Call {
    /// Name of the action.
    pub action: String,
    /// Arguments of the action, by name.
    pub arguments: Vec<String>,
}

impl std::fmt::Display for Call {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "({}", self.action)?;
        for argument in &self.arguments {
            write!(f, " {argument}")?;
        }
        f.write_str(")")
    }
}

/// Resources and limits of a skill: robot, cancellation, time limit, and progress reports.
pub struct Context<'a> {
    /// Body that carries out the skill.
    pub robot: &'a dyn Robot,
    /// Token that stops the skill.
    pub cancel: CancellationToken,
    /// Time limit, seconds on the body's clock.
    pub time_limit_s: f64,
    /// Function that receives progress reports.
    pub progress: &'a (dyn Fn(&Progress) + Send + Sync),
}

impl Context<'_> {
    /// Cancellation, time limit and progress reports in the form that a request to the body takes.
    pub fn watch(&self) -> Watch<'_> {
        Watch { cancel: self.cancel.clone(), time_limit_s: self.time_limit_s, progress: self.progress }
    }
}

/// Result of a skill.
#[derive(Debug)]
pub enum Outcome {
    /// The body has driven.
    Driven(Driven),
    /// A view was taken.
    Seen(Box<Sensed>),
    /// The body has answered a single request.
    Answered(Box<Answer>),
    /// Scans were registered.
    Aligned(Box<Alignment>),
    /// Views of an object were registered, and a model was learned if possible.
    Modelled(Box<Modelled>),
    /// An object was lifted; with the state of the hand afterwards.
    Grasped(Grasped, Hand),
    /// An external program succeeded, with its message.
    Told(String),
}

impl Outcome {
    /// Answer of the body if the skill was a single request; `None` otherwise.
    pub fn answer(&self) -> Option<&Answer> {
        match self {
            Outcome::Answered(answer) => Some(answer),
            _ => None,
        }
    }
}

/// Reason why a skill failed.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum SkillFailure {
    /// The body reported a failure.
    #[error(transparent)]
    Body(#[from] Failure),
    /// An external program reported a failure.
    #[error("{because}")]
    Program {
        /// Reason, as the program states it.
        because: String,
        /// True if a retry may succeed.
        passing: bool,
    },
    /// The skill makes no sense with its arguments.
    #[error("{because}")]
    Meaningless {
        /// Reason.
        because: String,
    },
    /// The action was executed, but its execution violated the domain's description of the action.
    #[error("it has ended, but not as the domain says: {because}")]
    Unkept {
        /// Reason: the part of the description that was violated.
        because: String,
        /// The violated invariant (`over all` condition), in PDDL.
        condition: Option<String>,
    },
    /// The action was executed, but an expected effect is missing.
    #[error("it was done, but {condition} does not hold")]
    Unmet {
        /// The missing effect, in PDDL.
        condition: String,
    },
}

impl SkillFailure {
    /// True if a retry may succeed.
    pub fn is_passing(&self) -> bool {
        match self {
            SkillFailure::Body(failure) => failure.is_passing(),
            SkillFailure::Program { passing, .. } => *passing,
            SkillFailure::Meaningless { .. } => false,
            SkillFailure::Unkept { .. } | SkillFailure::Unmet { .. } => true,
        }
    }

    /// Kind of the failure: that of the body ([`Failure::kind`]), `program`, `meaningless` or `unmet`.
    pub fn kind(&self) -> &'static str {
        match self {
            SkillFailure::Body(failure) => failure.kind(),
            SkillFailure::Program { .. } | SkillFailure::Unkept { .. } => "program",
            SkillFailure::Meaningless { .. } => "meaningless",
            SkillFailure::Unmet { .. } => "unmet",
        }
    }
}

/// Executable action with its arguments.
#[async_trait]
pub trait Skill: Send + Sync {
    /// Carries out the action. Ends within the context's time limit, and soon after its token is cancelled.
    ///
    /// # Errors
    /// [`SkillFailure`] if the action failed; the world may have changed nevertheless.
    async fn perform(&self, context: &Context<'_>) -> Result<Outcome, SkillFailure>;
}
