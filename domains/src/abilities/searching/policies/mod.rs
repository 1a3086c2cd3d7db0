//! Policies that choose the next view: one file each behind one trait, and their list.
//!
//! The default, `plan`, is no policy but the planner, which weighs gain against cost over several views.
//! A policy chooses one view after another and serves as a baseline. All use the same belief and the
//! same thresholds for declaring a result. All but the sweep stop when no view is expected to settle any
//! doubt.

mod gain_per_second;
mod most_unknown;
mod nearest;
mod nearest_surface;
mod oracle;
mod policy;
mod random;
mod rear_side;
mod sweep;
#[doc(hidden)]
pub mod unseen;

use std::collections::BTreeSet;

pub use policy::{Foresight, Look, Policy, best};

use crate::belief::doubt::Taken;
use crate::situation::Situation;

/// Name that stands for the planner in the list of policies.
pub const PLAN: &str = "plan";

/// Choice of the next view in a run, by the planner or by a policy.
pub struct Chooser {
    /// Planner or policy that chooses.
    pub by: By,
    /// True if the first view is taken from the body's initial pose, without a choice.
    pub first_look_here: bool,
}

/// Planner or policy that chooses where to look next.
pub enum By {
    /// The planner.
    Planner,
    /// A policy.
    Policy(Box<dyn Policy>),
}

impl From<By> for Chooser {
    fn from(by: By) -> Self {
        Self { by, first_look_here: false }
    }
}

/// Makes a policy from the run's seed and foresight; `None` if the policy needs foresight and there is
/// none.
type Make = fn(u64, Option<Foresight>) -> Option<Box<dyn Policy>>;

/// All policies: name, description, constructor.
const ALL: [(&str, &str, Make); 8] = [
    ("sweep", "goes all around from the nearest pose, whatever is seen", |_, _| Some(Box::new(sweep::Sweep))),
    ("nearest", "looks from the nearest pose that it has not looked from", |_, _| {
        Some(Box::new(nearest::Nearest))
    }),
    (
        "nearest-surface",
        "goes to the nearest surface with something in doubt, looks until no look there is worth it, and then to the next",
        |_, _| Some(Box::<nearest_surface::NearestSurface>::default()),
    ),
    ("random", "takes any look", |seed, _| Some(Box::new(random::Random::new(seed)))),
    ("most-unknown", "takes the look that shows most of the space that no view has shown", |_, _| {
        Some(Box::new(most_unknown::MostUnknown))
    }),
    ("rear-side", "takes the look that shows most of the unseen space behind what was seen", |_, _| {
        Some(Box::new(rear_side::RearSide))
    }),
    ("gain-per-second", "takes the look that is expected to settle most of the doubt a second", |_, _| {
        Some(Box::new(gain_per_second::GainPerSecond))
    }),
    ("oracle", "knows in advance what each look shows", |_, foresight| {
        Some(Box::new(oracle::Oracle::new(foresight?)))
    }),
];

/// Error of an unavailable policy.
#[derive(Debug, thiserror::Error, PartialEq, Eq)]
pub enum PolicyError {
    /// No policy has this name.
    #[error("no policy is called \"{name}\"\n  expected one of: {known}")]
    Unknown {
        /// The requested name.
        name: String,
        /// Names of all policies.
        known: String,
    },
    /// The policy needs foresight, knowledge of what each view shows, which only simulated experiments
    /// have.
    #[error(
        "the policy \"{name}\" knows in advance what each look shows and is for experiments in simulation only\n  take another, such as plan"
    )]
    NeedsForesight {
        /// The requested name.
        name: String,
    },
}

/// Names of all policies, the planner's first.
pub fn names() -> Vec<&'static str> {
    std::iter::once(PLAN).chain(ALL.iter().map(|(name, ..)| *name)).collect()
}

/// Description of a policy, to follow its name; `None` for an unknown name.
pub fn about(name: &str) -> Option<&'static str> {
    ALL.iter().find(|(known, ..)| *known == name).map(|(_, about, _)| *about)
}

/// Chooser for the planner or a policy with this name.
///
/// # Errors
///
/// [`PolicyError`] for an unknown name, or if the policy needs foresight and there is none.
pub fn named(name: &str, seed: u64, foresight: Option<Foresight>) -> Result<Chooser, PolicyError> {
    if name == PLAN {
        return Ok(By::Planner.into());
    }
    let Some((.., make)) = ALL.iter().find(|(known, ..)| *known == name) else {
        return Err(PolicyError::Unknown { name: name.into(), known: names().join(", ") });
    };
    make(seed, foresight)
        .map(|policy| By::Policy(policy).into())
        .ok_or_else(|| PolicyError::NeedsForesight { name: name.into() })
}

/// True if the next view is a policy's choice: the hand is empty, and either something requested is
/// still uncertain or nothing is requested. Other steps are left to the planner.
pub fn is_asked(s: &Situation) -> bool {
    let own: Vec<usize> = (0..s.things.len()).filter(|&n| s.things[n].track.is_none()).collect();
    let unsure = own.iter().any(|&n| s.confidence(n) < s.threshold)
        || (0..s.kinds.len()).any(|n| s.completeness(n) < s.wanted_of(n))
        || s.asked.iter().any(|&on| s.clarity(on) < s.threshold);
    s.held.is_none() && (unsure || own.is_empty() && s.kinds.is_empty() && s.asked.is_empty())
}

/// Next view that a policy chooses among those not barred; `None` if the policy gives up or nothing is
/// left.
pub fn next(
    policy: &mut dyn Policy,
    situation: &Situation,
    is_barred: &dyn Fn(&Look) -> bool,
) -> Option<Look> {
    let all = policy.looks_at_all();
    let is_offered = |look: &Look| (all || look.gain > 0.0) && !is_barred(look);
    let looks: Vec<Look> = open(situation).into_iter().filter(is_offered).collect();
    if looks.is_empty() { None } else { policy.choose(situation, &looks) }
}

/// View with the highest gain per second among those behind closed doors, except barred ones;
/// `None` if there is none.
pub fn behind(situation: &Situation, is_barred: &dyn Fn(&Look) -> bool) -> Option<Look> {
    let is_behind = |look: &Look| !situation.can_drive_to(look.from) && !is_barred(look);
    let looks: Vec<Look> =
        open(situation).into_iter().filter(|look| look.gain > 0.0 && is_behind(look)).collect();
    gain_per_second::GainPerSecond.choose(situation, &looks)
}

/// View from the current pose that settles the greatest share of the doubt; `None` if there is none.
pub fn here(situation: &Situation) -> Option<Look> {
    let looks: Vec<Look> = open(situation).into_iter().filter(|look| look.from == situation.at).collect();
    best(&looks, |look| look.gain)
}

/// Feasible views not yet taken, including those behind doors that can be opened, in candidate
/// order.
fn open(situation: &Situation) -> Vec<Look> {
    let looks = situation.all_looks().into_iter();
    looks
        .filter(|look| situation.can_reach(look.0) && !situation.observed.contains(look))
        .map(|(from, on)| Look {
            from,
            on,
            travel_s: travel_s(situation, from),
            gain: gain(situation, from, on),
        })
        .collect()
}

/// Driving time to a candidate, through closed doors where no other route leads, seconds.
pub fn travel_s(situation: &Situation, to: usize) -> f64 {
    let through_all = || situation.travel_past_s(situation.at, to, &BTreeSet::new());
    match situation.travel_s(situation.at, to) {
        _ if to == situation.at => 0.0,
        now if now.is_finite() => now,
        _ => through_all(),
    }
}

/// Share of the goal's doubts that a view would settle, averaged over the doubts, 0 to 1.
pub fn gain(situation: &Situation, from: usize, on: usize) -> f64 {
    let doubts = situation.doubts();
    let shares = doubts.iter().map(|doubt| doubt.share_settled(situation, (from, on), Taken::default()));
    shares.sum::<f64>() / doubts.len() as f64
}
