//! Trait of all skills: arguments in SI units, cancellation, a time limit.

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
    /// Names of its arguments.
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

/// Surroundings of a skill: robot, cancellation, time limit, progress.
pub struct Context<'a> {
    /// The body.
    pub robot: &'a dyn Robot,
    /// Token that stops the skill.
    pub cancel: CancellationToken,
    /// Time limit, seconds on the body's clock.
    pub time_limit_s: f64,
    /// Receives progress reports.
    pub progress: &'a (dyn Fn(&Progress) + Send + Sync),
}

impl Context<'_> {
    /// The watch to pass to the body.
    pub fn watch(&self) -> Watch<'_> {
        Watch { cancel: self.cancel.clone(), time_limit_s: self.time_limit_s, progress: self.progress }
    }
}

/// Result of a skill.
#[derive(Debug)]
pub enum Outcome {
    /// The body has moved.
    Driven(Driven),
    /// A view was taken.
    Seen(Box<Sensed>),
    /// The body has answered a request.
    Answered(Box<Answer>),
    /// Scans were registered.
    Aligned(Box<Alignment>),
    /// Views of an object were registered, and a model learned.
    Modelled(Box<Modelled>),
    /// An object was lifted, with the state of the hand.
    Grasped(Grasped, Hand),
    /// An external program succeeded, with its message.
    Told(String),
}

impl Outcome {
    /// Answer of the body, where the skill was one request.
    pub fn answer(&self) -> Option<&Answer> {
        match self {
            Outcome::Answered(answer) => Some(answer),
            _ => None,
        }
    }
}

/// Failure of a skill.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum SkillFailure {
    /// The body failed.
    #[error(transparent)]
    Body(#[from] Failure),
    /// An external program failed.
    #[error("{because}")]
    Program {
        /// Reason, as the program states it.
        because: String,
        /// True if a retry may succeed.
        passing: bool,
    },
    /// The request makes no sense for the body in its current state.
    #[error("{because}")]
    Meaningless {
        /// Reason.
        because: String,
    },
    /// The action was carried out, but its execution violates the action as the domain describes it.
    #[error("it has ended, but not as the domain says: {because}")]
    Unkept {
        /// Reason: the part of the description that was violated.
        because: String,
        /// The violated invariant (`over all` condition), in PDDL.
        condition: Option<String>,
    },
    /// The action was carried out, but an expected effect is missing.
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

    /// Name of the failure's kind: that of the body ([`Failure::kind`]), `program`, `meaningless` or `unmet`.
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
