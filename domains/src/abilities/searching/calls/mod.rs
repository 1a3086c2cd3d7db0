//! Calls of *searching*: one file each, and their list.

mod can_see;
mod expected_clarity;
mod expected_completeness;
mod expected_gain;
mod expected_placing;
mod expected_presence;
mod search_cost;
mod worth_a_look;
mod worth_a_push;

use descry_planner::{Call, CallError};
pub use search_cost::FirstLook;

use crate::ability::{Meaning, Reads, argument};
use crate::belief::doubt::{Doubt, Taken};
use crate::situation::Situation;

/// Read set: the `observed` facts of the surface that the call names; all of them for a call without a
/// surface.
const OBSERVED: Reads = Reads { word: "observed", of: &[None, Some("surface")] };
const PUSHED: Reads = Reads::all("pushed");
const LOOKS: &[Reads] = &[OBSERVED, PUSHED];

/// All calls of *searching*.
pub(super) const ALL: &[Meaning] = &[
    Meaning {
        name: "can-see",
        reads: &[],
        is_advice: false,
        about: "whether a look from a pose shows any of a surface",
        answers: can_see::answer,
    },
    Meaning {
        name: "worth-a-look",
        reads: &[PUSHED],
        is_advice: true,
        about: "whether a look from a pose may settle anything that is in doubt",
        answers: worth_a_look::answer,
    },
    Meaning {
        name: "worth-a-push",
        reads: &[PUSHED],
        is_advice: true,
        about: "whether a push would uncover what no look shows",
        answers: worth_a_push::answer,
    },
    Meaning {
        name: "expected-gain",
        reads: LOOKS,
        is_advice: false,
        about: "how much of the doubt about a thing a look would settle",
        answers: expected_gain::answer,
    },
    Meaning {
        name: "expected-presence",
        reads: LOOKS,
        is_advice: false,
        about: "how much of the doubt about a thing on that surface a look would settle",
        answers: expected_presence::answer,
    },
    Meaning {
        name: "expected-placing",
        reads: LOOKS,
        is_advice: false,
        about: "how much of the doubt about where on its surface a thing stands a look would settle",
        answers: expected_placing::answer,
    },
    Meaning {
        name: "search-cost",
        reads: &[OBSERVED],
        is_advice: false,
        about: "seconds for having looked there in vain; at the first look of a plan there they are (1 - p) / p of those that looking there takes with the shortest drive from where the last look was taken, all doors open, at most 10,000, with p, at most 1, how sure it is that it stands there and what the best look that is left there may settle; for each surface alike, from whichever pose",
        answers: search_cost::answer,
    },
    Meaning {
        name: "expected-clarity",
        reads: LOOKS,
        is_advice: false,
        about: "how much of the doubt about all on a surface a look would settle",
        answers: expected_clarity::answer,
    },
    Meaning {
        name: "expected-completeness",
        reads: LOOKS,
        is_advice: false,
        about: "how much of the doubt about all of a kind a look would settle",
        answers: expected_completeness::answer,
    },
];

/// Share of a doubt that the call's view settles beyond the earlier steps of the plan, 0 to 1. The
/// call's arguments are viewpoint and surface; without a surface (`names_surface` false), views of all
/// surfaces count.
fn settled(situation: &Situation, call: &Call, doubt: &Doubt, names_surface: bool) -> Result<f64, CallError> {
    let from = situation.candidate(argument(call, 0)?)?;
    let surfaces = match names_surface {
        true => {
            let on = situation.surface(argument(call, 1)?)?;
            on..on + 1
        }
        false => 0..situation.surfaces.len(),
    };
    let looks = situation.planned_looks(call);
    let before = Taken { looks: &looks, moved: situation.planned_push(call) };
    Ok(surfaces.map(|on| doubt.share_settled(situation, (from, on), before)).sum())
}
