//! Belief report of a run: confidence in the requested objects, coverage of their possible places,
//! and open probability. Recorded with every plan, made or kept, so that the gain of each look can
//! be explained later.

pub use descry_domains::abilities::searching::FirstLook;
use descry_domains::belief::doubt::Doubt;
use descry_domains::conclusion::Ended;
use descry_domains::reasons;
use descry_domains::round::Round;
use descry_domains::surface::KnownSurface;
use descry_memory::{Blob, Form};
use descry_planner::NoPlan;
use serde::{Deserialize, Serialize};
use serde_json::Value;

use crate::exit::CommandError;

/// Name of the blob with the doubts, attached to a plan's event.
pub const BLOB: &str = "in-doubt";
/// Record kind of the facts on which the end of a run rests.
pub const RESTS: &str = "rests-on";

/// Doubtful object, kind or surface.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct InDoubt {
    /// Spoken name of the doubtful object, kind or surface.
    pub about: String,
    /// The type of the doubt.
    pub of: Of,
    /// For a kind: rooms that restrict the question, as in " in the kitchen"; empty: no
    /// restriction.
    #[serde(skip_serializing_if = "String::is_empty")]
    pub within: String,
    /// Confidence reached so far, 0 to 1; absent in records of earlier versions.
    pub sure: Option<f64>,
    /// Confidence that is required, 0 to 1.
    pub wanted: f64,
    /// Probability that is still unsettled, 0 to 1.
    pub left: f64,
    /// Part of the open probability at unseen places.
    pub hidden: f64,
    /// Part of the open probability of having been lost out of the hand, where no look at a surface
    /// shows it.
    pub lost: f64,
    /// Coverage of each place where the object may be.
    pub seen: Vec<Seen>,
}

/// The type of a doubt.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Of {
    /// Doubt about the place of one object.
    #[default]
    Thing,
    /// Doubt about the set of objects of one kind.
    Kind,
    /// Doubt about the objects on one surface.
    Surface,
}

/// Coverage of one place.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub struct Seen {
    /// Spoken name of the place.
    pub on: String,
    /// Share of the place where nothing can be hidden, 0 to 1; `None` for an unknown place.
    pub share: Option<f64>,
    /// Number of viewpoints of the place's valid views.
    pub places: usize,
    /// Probability that the object is in an unseen part of this place, 0 to 1; absent in records of
    /// earlier versions.
    #[serde(default)]
    pub hidden: f64,
    /// Part of the hidden probability at unexplained measurements.
    #[serde(default)]
    pub measured: f64,
    /// Data of a first look at this place, if looks in vain are penalised; absent in records of
    /// earlier versions.
    #[serde(default)]
    pub first: Option<FirstLook>,
}

/// Facts on which the end of a run rests.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Rests {
    /// Reason the run ended.
    pub ended: End,
    /// Message of the limit or failure; empty without one.
    pub said: String,
    /// Reasons for no plan.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub no_plan: Vec<NoPlan>,
    /// Remaining doubts at the end.
    pub in_doubt: Vec<InDoubt>,
}

/// Reason a run ended.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub enum End {
    /// The goal held.
    #[serde(rename = "reached")]
    Reached,
    /// No plan reaches the goal.
    #[serde(rename = "no plan")]
    NoPlan,
    /// Planning was cut off.
    #[serde(rename = "undecided")]
    Undecided,
    /// A limit of looks, plans or time was reached.
    #[serde(rename = "limit")]
    Limit,
    /// A step failed for good.
    #[serde(rename = "failed")]
    Failed,
}

/// Collects the facts on which the end of a run rests, for the record.
pub fn rests(round: &Round, of: &Ended) -> Rests {
    let (ended, said) = match of {
        Ended::Reached => (End::Reached, String::new()),
        Ended::NoPlan(_) => (End::NoPlan, String::new()),
        Ended::Undecided(why) => (End::Undecided, why.clone()),
        Ended::Limit(why) => (End::Limit, why.clone()),
        Ended::Failed(why) => (End::Failed, why.clone()),
    };
    let no_plan = if let Ended::NoPlan(why) = of { why.clone() } else { Vec::new() };
    Rests { ended, said, no_plan, in_doubt: in_doubt(round) }
}

/// Doubts of a round as a blob for an event.
///
/// # Errors
/// [`CommandError::Bug`] if it cannot be written as JSON.
pub fn blob(round: &Round) -> Result<Blob<'static>, CommandError> {
    let data = serde_json::to_vec(&in_doubt(round)).map_err(|e| CommandError::Bug(e.to_string()))?;
    Ok(Blob { name: BLOB.into(), form: Form::Bytes, layout: Value::Null, data: data.into() })
}

/// Remaining doubts of a round about the requested objects.
fn in_doubt(round: &Round) -> Vec<InDoubt> {
    let s = &round.situation;
    let places = |on: usize| s.spaces[on].seen_from().len();
    let told = |about: &str, of: Of, sure: f64, doubt: &Doubt| {
        let on = |(n, surface): (usize, &KnownSurface)| {
            let (share, places) = (doubt.share_seen(n), places(n));
            let (hidden, measured) = doubt.hidden_share(n);
            let on = surface.name.clone();
            let first = s.first_look(n);
            (share.is_some() || places > 0).then_some(Seen { on, share, places, hidden, measured, first })
        };
        InDoubt {
            about: about.into(),
            of,
            within: String::new(),
            sure: Some(sure),
            wanted: s.threshold,
            left: doubt.remaining().max(0.0),
            hidden: doubt.hidden.max(0.0),
            lost: 0.0,
            seen: s.surfaces.iter().enumerate().filter_map(on).collect(),
        }
    };
    // What was seen of a kind is no longer looked for.
    let things = s.things.iter().enumerate().filter(|(_, t)| t.track.is_none());
    let things = things.map(|(n, t)| {
        let doubt = told(&t.name, Of::Thing, s.confidence(n), s.doubt_about(n));
        let on_surfaces: f64 = (0..s.surfaces.len()).map(|on| s.doubt_about(n).hidden_share(on).0).sum();
        let lost = if s.chance_lost(n) > 0.0 { (doubt.hidden - on_surfaces).max(0.0) } else { 0.0 };
        InDoubt { lost, ..doubt }
    });
    let kinds = s.kinds.iter().enumerate();
    let kinds = kinds.map(|(n, t)| InDoubt {
        wanted: s.wanted_of(n),
        within: reasons::in_room(s, t),
        ..told(&t.name, Of::Kind, s.completeness(n), s.doubt_of(n))
    });
    let surfaces = s.asked.iter();
    let surfaces = surfaces.map(|&on| told(&s.surfaces[on].name, Of::Surface, s.clarity(on), s.doubt_on(on)));
    things.chain(kinds).chain(surfaces).collect()
}
