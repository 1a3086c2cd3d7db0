//! Conclusion of a run.

use descry_memory::remember::Remembered;
use descry_planner::NoPlan;
use serde::{Deserialize, Serialize};

/// The reason a run ended.
#[derive(Debug, Clone, PartialEq)]
pub enum Ended {
    /// The goal holds.
    Reached,
    /// There is no plan, and why.
    NoPlan(Vec<NoPlan>),
    /// The search for a plan came to no end, and no single step is surely worth it.
    Undecided(String),
    /// A limit of looks, plans or time was reached.
    Limit(String),
    /// A step fails for good, or steps change nothing.
    Failed(String),
}

/// The verdict on a run.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Verdict {
    /// The goal is reached with the confidence that was asked for.
    Achieved,
    /// Every useful pose has been tried: it is not there.
    NotFound,
    /// Nothing that the body can do would settle it.
    CannotTell,
    /// The requested facts are known, and nothing that the body can do brings about the goal.
    Impossible,
    /// The body or the store failed, or what is done changes nothing.
    Failed,
}

/// An object, as believed at the end.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Believed {
    /// The known object that it most likely is; none: unknown.
    pub label: Option<String>,
    /// Its kind.
    pub kind: Option<String>,
    /// Probability of that.
    pub confidence: f64,
    /// The middle of its body, in the map; none in the hand.
    #[serde(default)]
    pub position_m: Option<[f64; 3]>,
    /// Standard deviation of that, in the direction in which it is known worst; none if nothing is known of it.
    #[serde(default)]
    pub position_sigma_m: Option<f64>,
    /// Sides of its footprint and height.
    pub size_m: [f64; 3],
    /// The surface that it stands on, as people call it.
    #[serde(default)]
    pub on: Option<String>,
    /// The room that this is in.
    #[serde(default, rename = "in")]
    pub room: Option<String>,
    /// True if the goal asks about it.
    #[serde(default)]
    pub asked: bool,
}

/// The conclusion of a run.
#[derive(Debug, Clone, PartialEq)]
pub struct Conclusion {
    /// The verdict.
    pub verdict: Verdict,
    /// The answer with its reason, in a sentence.
    pub why: String,
    /// Confidence of the answer, 0 to 1.
    pub confidence: f64,
    /// Probability that what was looked for is there after all.
    pub remaining: Option<f64>,
    /// The requested object, if the goal is about a single one.
    pub object: Option<String>,
    /// The requested object as it is believed to stand, if it is.
    pub found: Option<Believed>,
    /// Everything that is believed.
    pub objects: Vec<Believed>,
    /// Persistent belief for later runs, if any.
    pub remembered: Option<Remembered>,
}
