//! Conclusion of a run.

use descry_memory::remember::Remembered;
use descry_planner::NoPlan;
use serde::{Deserialize, Serialize};

/// Reason a run ended.
#[derive(Debug, Clone, PartialEq)]
pub enum Ended {
    /// The goal holds.
    Reached,
    /// No plan exists, for these reasons.
    NoPlan(Vec<NoPlan>),
    /// Planning was cut off, and no single step is certainly useful; with the reason.
    Undecided(String),
    /// A limit of views, plans or time was reached; with the limit.
    Limit(String),
    /// A step fails for good, or steps change nothing; with the reason.
    Failed(String),
}

/// Verdict on the goal of a run.
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
    /// Kind of the object; `None`: unknown.
    pub kind: Option<String>,
    /// Probability of the label, 0 to 1.
    pub confidence: f64,
    /// Centre of the body in the map, metres; `None` while in the hand.
    #[serde(default)]
    pub position_m: Option<[f64; 3]>,
    /// Standard deviation of the position in its least certain direction, metres; `None` if unknown.
    #[serde(default)]
    pub position_sigma_m: Option<f64>,
    /// Sides of the footprint, and height, metres.
    pub size_m: [f64; 3],
    /// Spoken name of the supporting surface.
    #[serde(default)]
    pub on: Option<String>,
    /// Name of the room that the object is in, if known.
    #[serde(default, rename = "in")]
    pub room: Option<String>,
    /// True if the goal asks about the object.
    #[serde(default)]
    pub asked: bool,
}

/// Conclusion of a run: the verdict, with the beliefs behind it.
#[derive(Debug, Clone, PartialEq)]
pub struct Conclusion {
    /// Verdict on the goal.
    pub verdict: Verdict,
    /// Answer with its reason, in a sentence.
    pub why: String,
    /// Confidence of the answer, 0 to 1.
    pub confidence: f64,
    /// Probability that the sought object is there after all; `None` unless the goal is about a single
    /// object.
    pub remaining: Option<f64>,
    /// Name of the requested object, if the goal is about a single one.
    pub object: Option<String>,
    /// Requested object as believed at the end, if found.
    pub found: Option<Believed>,
    /// All objects as believed at the end, requested ones first.
    pub objects: Vec<Believed>,
    /// Persistent belief for later runs, if any.
    pub remembered: Option<Remembered>,
}
