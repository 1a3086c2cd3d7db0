//! Conclusion of a run.

use descry_memory::remember::Remembered;
use descry_planner::NoPlan;
use serde::{Deserialize, Serialize};

/// Reason a run ended.
#[derive(Debug, Clone, PartialEq)]
pub enum Ended {
    /// The goal holds.
    Reached,
    /// No plan exists, with reasons.
    NoPlan(Vec<NoPlan>),
    /// Planning was cut off, and no single step is certainly useful.
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
    /// Every useful viewpoint was tried: the object is not there.
    NotFound,
    /// Nothing that the body can do would settle the goal.
    CannotTell,
    /// The requested facts are known, and nothing that the body can do achieves the goal.
    Impossible,
    /// The body or the store failed, or actions have no effect.
    Failed,
}

/// Object as believed at the end.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Believed {
    /// Most likely known object; `None`: unknown.
    pub label: Option<String>,
    /// Kind of the object.
    pub kind: Option<String>,
    /// Probability of the label.
    pub confidence: f64,
    /// Centre of the body in the map; `None` while in the hand.
    #[serde(default)]
    pub position_m: Option<[f64; 3]>,
    /// Standard deviation of the position in its least certain direction; `None` if unknown.
    #[serde(default)]
    pub position_sigma_m: Option<f64>,
    /// Sides of the footprint, and height, metres.
    pub size_m: [f64; 3],
    /// Spoken name of the supporting surface.
    #[serde(default)]
    pub on: Option<String>,
    /// Room that this is in.
    #[serde(default, rename = "in")]
    pub room: Option<String>,
    /// True if the goal asks about the object.
    #[serde(default)]
    pub asked: bool,
}

/// The conclusion of a run.
#[derive(Debug, Clone, PartialEq)]
pub struct Conclusion {
    /// The verdict.
    pub verdict: Verdict,
    /// Answer with its reason, in a sentence.
    pub why: String,
    /// Confidence of the answer, 0 to 1.
    pub confidence: f64,
    /// Probability that the sought object is there after all.
    pub remaining: Option<f64>,
    /// Requested object, if the goal is about a single one.
    pub object: Option<String>,
    /// Requested object as believed to stand, if found.
    pub found: Option<Believed>,
    /// Everything that is believed.
    pub objects: Vec<Believed>,
    /// Persistent belief for later runs, if any.
    pub remembered: Option<Remembered>,
}
