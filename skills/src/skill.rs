//! What every skill is: it turns one action of a plan into motion and looking, can be stopped, and ends in time.

use std::collections::BTreeMap;

use async_trait::async_trait;
use descry_robots::nalgebra::Point3;
use descry_robots::{
    CancellationToken, Driven, Failure, Place, Progress, Push, Pushed, Robot, Sensed, Watch,
};

/// One action of a plan, with the names of its objects.
#[derive(Debug, Clone, PartialEq, Eq)]
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

/// What the objects of a call are in the world at this moment.
#[derive(Debug, Clone, Default)]
pub struct Symbols {
    /// Where each pose is.
    pub places: BTreeMap<String, Place>,
    /// The point of each surface that a look is directed at, in the map; none while nothing is known of it.
    pub surfaces: BTreeMap<String, Option<Point3<f64>>>,
    /// How each object that may be pushed is pushed from where the body stands.
    pub pushes: BTreeMap<String, Push>,
}

/// What a skill works with.
pub struct Context<'a> {
    /// The body.
    pub robot: &'a dyn Robot,
    /// The meaning of the call's objects.
    pub symbols: &'a Symbols,
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

    /// Where a pose is.
    ///
    /// # Errors
    /// [`SkillFailure::Unknown`] if nothing of that name is a pose.
    pub fn place(&self, name: &str) -> Result<&Place, SkillFailure> {
        self.symbols
            .places
            .get(name)
            .ok_or_else(|| SkillFailure::Unknown { name: name.into(), expected: "a pose" })
    }

    /// How an object is pushed.
    ///
    /// # Errors
    /// [`SkillFailure::Unknown`] if nothing of that name can be pushed from here.
    pub fn push(&self, name: &str) -> Result<&Push, SkillFailure> {
        self.symbols.pushes.get(name).ok_or_else(|| SkillFailure::Unknown {
            name: name.into(),
            expected: "something to push from here",
        })
    }

    /// The point of a surface that a look is directed at.
    ///
    /// # Errors
    /// [`SkillFailure::Unknown`] if nothing of that name is a surface.
    pub fn surface(&self, name: &str) -> Result<Option<&Point3<f64>>, SkillFailure> {
        self.symbols
            .surfaces
            .get(name)
            .map(Option::as_ref)
            .ok_or_else(|| SkillFailure::Unknown { name: name.into(), expected: "a surface" })
    }
}

/// What a skill brought about.
#[derive(Debug)]
pub enum Outcome {
    /// The body stands somewhere else.
    Driven(Driven),
    /// A view was taken.
    Seen(Box<Sensed>),
    /// Something was moved.
    Pushed(Pushed),
}

/// Why a skill did not do what its action promises.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum SkillFailure {
    /// The body could not.
    #[error(transparent)]
    Body(#[from] Failure),
    /// A call names something that is not there.
    #[error("`{name}` is not {expected}")]
    Unknown {
        /// The name.
        name: String,
        /// What it should be.
        expected: &'static str,
    },
    /// A call has not as many objects as the skill takes.
    #[error("{call} takes {expected} objects")]
    Arity {
        /// The call.
        call: String,
        /// How many it should have.
        expected: usize,
    },
}

/// A way to carry out an action.
#[async_trait]
pub trait Skill: Send + Sync {
    /// The action's name in the domain.
    fn name(&self) -> &'static str;

    /// How many objects the action takes.
    fn arity(&self) -> usize;

    /// Carries the action out. Ends within the context's time limit and soon after its token is cancelled.
    ///
    /// # Errors
    /// [`SkillFailure`] says what the body could not do; the world may have changed nevertheless.
    async fn perform(&self, call: &Call, context: &Context<'_>) -> Result<Outcome, SkillFailure>;
}

/// Every skill there is.
pub const ALL: &[&dyn Skill] = &[&crate::Move, &crate::Observe, &crate::PushAside];

/// The skill that carries out an action.
pub fn named(action: &str) -> Option<&'static dyn Skill> {
    ALL.iter().copied().find(|s| s.name() == action)
}

/// The objects of a call, if they are as many as expected.
pub(crate) fn arguments<const N: usize>(call: &Call) -> Result<[&str; N], SkillFailure> {
    let names: Vec<&str> = call.arguments.iter().map(String::as_str).collect();
    names.try_into().map_err(|_| SkillFailure::Arity { call: call.to_string(), expected: N })
}
