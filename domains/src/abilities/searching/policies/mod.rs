//! Ways to choose where to look next: one file each behind one interface, and the list of them.
//!
//! `plan`, the way that descry goes by default, is not among them: it is the planner, which weighs gain against cost over
//! several looks. The others choose one look after another; they are what it is measured against. All act on the same belief
//! and declare by the same thresholds. All but the sweep stop when no look would settle anything that is worth a look.

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

/// The planner's name among the policies.
pub const PLAN: &str = "plan";

/// Who chooses in a run.
pub struct Chooser {
    /// Who it is.
    pub by: By,
    /// True if the first look is taken from where the body stands, without a choice.
    pub first_look_here: bool,
}

/// Who chooses where to look next.
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

/// Makes a policy for a run: the seed of the run, and foresight where there is any.
type Make = fn(u64, Option<Foresight>) -> Option<Box<dyn Policy>>;

/// Every policy by its name, and what it does.
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

/// The reason there is no such policy.
#[derive(Debug, thiserror::Error, PartialEq, Eq)]
pub enum PolicyError {
    /// No policy has that name.
    #[error("no policy is called \"{name}\"\n  expected one of: {known}")]
    Unknown {
        /// The requested name.
        name: String,
        /// The names that there are.
        known: String,
    },
    /// It needs to know in advance what looks show, as only experiments can.
    #[error(
        "the policy \"{name}\" knows in advance what each look shows and is for experiments in simulation only\n  take another, such as plan"
    )]
    NeedsForesight {
        /// The requested name.
        name: String,
    },
}

/// The names of all policies, the planner's first.
pub fn names() -> Vec<&'static str> {
    std::iter::once(PLAN).chain(ALL.iter().map(|(name, ..)| *name)).collect()
}

/// Description of a policy, said after its name; none if there is none of that name.
pub fn about(name: &str) -> Option<&'static str> {
    ALL.iter().find(|(known, ..)| *known == name).map(|(_, about, _)| *about)
}

/// The policy of a name.
///
/// # Errors
/// [`PolicyError`] says what there is.
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

/// True if the policy chooses the next step: something requested is still being searched for, and the hands
/// are free. All else is left to the planner.
pub fn is_asked(s: &Situation) -> bool {
    let own: Vec<usize> = (0..s.things.len()).filter(|&n| s.things[n].track.is_none()).collect();
    let unsure = own.iter().any(|&n| s.confidence(n) < s.threshold)
        || (0..s.kinds.len()).any(|n| s.completeness(n) < s.wanted_of(n))
        || s.asked.iter().any(|&on| s.clarity(on) < s.threshold);
    s.held.is_none() && (unsure || own.is_empty() && s.kinds.is_empty() && s.asked.is_empty())
}

/// The next look of a policy, but for those that cannot be taken; none if it gives up.
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

/// The look that is expected to settle most a second of those to which the body cannot drive before it has opened something; none if
/// there is none that is not barred.
pub fn behind(situation: &Situation, is_barred: &dyn Fn(&Look) -> bool) -> Option<Look> {
    let is_behind = |look: &Look| !situation.can_drive_to(look.from) && !is_barred(look);
    let looks: Vec<Look> =
        open(situation).into_iter().filter(|look| look.gain > 0.0 && is_behind(look)).collect();
    gain_per_second::GainPerSecond.choose(situation, &looks)
}

/// The look from where the body stands that is expected to settle most; none if it can take none there.
pub fn here(situation: &Situation) -> Option<Look> {
    let looks: Vec<Look> = open(situation).into_iter().filter(|look| look.from == situation.at).collect();
    best(&looks, |look| look.gain)
}

/// Every look that can be taken, if need be by opening doors on the way, and has not been, in the order of the candidates.
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

/// Seconds of driving to a candidate, through doors that would have to be opened first where no other way leads.
pub fn travel_s(situation: &Situation, to: usize) -> f64 {
    let through_all = || situation.travel_past_s(situation.at, to, &BTreeSet::new());
    match situation.travel_s(situation.at, to) {
        _ if to == situation.at => 0.0,
        now if now.is_finite() => now,
        _ => through_all(),
    }
}

/// The share of what the goal leaves in doubt that a look would settle.
pub fn gain(situation: &Situation, from: usize, on: usize) -> f64 {
    let doubts = situation.doubts();
    let shares = doubts.iter().map(|doubt| doubt.share_settled(situation, (from, on), Taken::default()));
    shares.sum::<f64>() / doubts.len() as f64
}
