//! Trait of all skills: arguments in the units of the body, cancellation, a time limit.

use async_trait::async_trait;
use descry_robots::perception::laser::Alignment;
use descry_robots::{
    CancellationToken, Driven, Failure, Grasped, Hand, Opened, Placed, Progress, Pushed, Reading, Robot,
    Scanned, Sensed, Watch,
};

use crate::model::Modelled;

/// One action of a plan, with the names of its objects.
#[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord)]
pub struct Call {
    /// The action's name.
    pub action: String,
    /// Its objects.
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
    /// Stops the skill.
    pub cancel: CancellationToken,
    /// Time for it, on the body's clock.
    pub time_limit_s: f64,
    /// Called now and then while it goes on.
    pub progress: &'a (dyn Fn(&Progress) + Send + Sync),
}

impl Context<'_> {
    /// The watch that the body is given.
    pub fn watch(&self) -> Watch<'_> {
        Watch { cancel: self.cancel.clone(), time_limit_s: self.time_limit_s, progress: self.progress }
    }
}

/// Result of a skill.
#[derive(Debug)]
pub enum Outcome {
    /// The body stands somewhere else.
    Driven(Driven),
    /// A view was taken.
    Seen(Box<Sensed>),
    /// The laser has swept.
    Scanned(Box<Scanned>),
    /// A sense has said something.
    Read(Reading),
    /// Scans were brought together.
    Aligned(Box<Alignment>),
    /// Looks at a thing were brought together.
    Modelled(Box<Modelled>),
    /// Something was moved.
    Pushed(Pushed),
    /// A door is open.
    Opened(Opened),
    /// Something was lifted, and what the hand then felt.
    Grasped(Grasped, Hand),
    /// Something was put down.
    Placed(Placed),
    /// A program says that it has done its work.
    Told(String),
}

/// Failure of a skill.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum SkillFailure {
    /// The body could not.
    #[error(transparent)]
    Body(#[from] Failure),
    /// A program could not, and says why.
    #[error("{because}")]
    Program {
        /// In its words.
        because: String,
        /// True if a retry may succeed.
        passing: bool,
    },
    /// The job has no meaning for the body in the present situation.
    #[error("{because}")]
    Meaningless {
        /// Reason.
        because: String,
    },
    /// It was carried out, but not as the domain describes it.
    #[error("it has ended, but not as the domain says: {because}")]
    Unkept {
        /// What the domain's description says instead.
        because: String,
        /// The condition that should have held until the end, in PDDL.
        condition: Option<String>,
    },
    /// It was carried out, and what it should bring about did not come about.
    #[error("it was done, but {condition} does not hold")]
    Unmet {
        /// The condition that should hold afterwards.
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

    /// One word for what kind of failure it is: that of the body ([`Failure::kind`]), `program`, `meaningless` or
    /// `unmet`.
    pub fn kind(&self) -> &'static str {
        match self {
            SkillFailure::Body(failure) => failure.kind(),
            SkillFailure::Program { .. } | SkillFailure::Unkept { .. } => "program",
            SkillFailure::Meaningless { .. } => "meaningless",
            SkillFailure::Unmet { .. } => "unmet",
        }
    }
}

/// A way to bring something about, with its arguments.
#[async_trait]
pub trait Skill: Send + Sync {
    /// Carries it out. Ends within the context's time limit and soon after its token is cancelled.
    ///
    /// # Errors
    /// [`SkillFailure`] says what the body could not do; the world may have changed nevertheless.
    async fn perform(&self, context: &Context<'_>) -> Result<Outcome, SkillFailure>;
}
