//! Remaining doubts of a run: confidence about what was asked for, coverage of the places where it
//! may be, and undecided probability. Recorded with every plan, new or kept, so that the gain of
//! each observation can be explained later.

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

/// Name of the blob with the doubts, attached to an event of a plan.
pub const BLOB: &str = "in-doubt";
/// Record kind of the facts that explain the end of a run.
pub const RESTS: &str = "rests-on";

/// Doubt about an object, all objects of a kind, or all objects on a surface.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct InDoubt {
    /// Spoken name of the object, kind or surface.
    pub about: String,
    /// Type of the doubt.
    pub of: Of,
    /// Rooms to which the question about a kind is restricted, such as " in the kitchen"; empty
    /// without restriction.
    #[serde(skip_serializing_if = "String::is_empty")]
    pub within: String,
    /// Confidence reached, 0 to 1; `None` in records of earlier versions.
    pub sure: Option<f64>,
    /// Confidence that is required, 0 to 1.
    pub wanted: f64,
    /// Probability that is still undecided, 0 to 1.
    pub left: f64,
    /// Probability that the object (or a further one) is where nothing was seen yet, 0 to 1.
    pub hidden: f64,
    /// Part of `hidden`: probability that the object was lost out of the hand, to where no view of
    /// a surface shows it.
    pub lost: f64,
    /// Coverage of each surface where the object may be.
    pub seen: Vec<Seen>,
}

/// Type of a doubt.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Of {
    /// Place of one object.
    #[default]
    Thing,
    /// Set of the objects of one kind.
    Kind,
    /// Objects on one surface.
    Surface,
}

/// Coverage of one surface.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub struct Seen {
    /// Spoken name of the surface.
    pub on: String,
    /// Share of the surface on which nothing can stand unseen, 0 to 1; `None` if unknown.
    pub share: Option<f64>,
    /// Number of viewpoints whose views of the surface are valid.
    pub places: usize,
    /// Probability that the object stands unseen on this surface, 0 to 1; 0 in records of earlier
    /// versions.
    #[serde(default)]
    pub hidden: f64,
    /// Part of `hidden` at places where measurements are explained by no object.
    #[serde(default)]
    pub measured: f64,
    /// Success probability and duration of a first observation of this surface, if the metric
    /// penalises observations in vain; `None` otherwise and in records of earlier versions.
    #[serde(default)]
    pub first: Option<FirstLook>,
}

/// Facts that explain the end of a run.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Rests {
    /// Reason why the run ended.
    pub ended: End,
    /// Message about the limit, failure or undecided search; empty without one.
    pub said: String,
    /// Reasons why there is no plan.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub no_plan: Vec<NoPlan>,
    /// Doubts that remain at the end.
    pub in_doubt: Vec<InDoubt>,
}

/// Reason why a run ended.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub enum End {
    /// The goal held.
    #[serde(rename = "reached")]
    Reached,
    /// No plan reaches the goal.
    #[serde(rename = "no plan")]
    NoPlan,
    /// Planning ended without a plan and without a proof that there is none.
    #[serde(rename = "undecided")]
    Undecided,
    /// A limit on views, plans or time was reached.
    #[serde(rename = "limit")]
    Limit,
    /// A step failed for good.
    #[serde(rename = "failed")]
    Failed,
}

/// Collects the facts that explain the end of a run, for the record.
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

/// Doubts of a round as a data blob for an event.
///
/// # Errors
/// [`CommandError::Bug`] if it cannot be written as JSON.
pub fn blob(round: &Round) -> Result<Blob<'static>, CommandError> {
    let data = serde_json::to_vec(&in_doubt(round)).map_err(|e| CommandError::Bug(e.to_string()))?;
    Ok(Blob { name: BLOB.into(), form: Form::Bytes, layout: Value::Null, data: data.into() })
}

/// Remaining doubts about what was asked for.
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
