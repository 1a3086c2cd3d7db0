//! Facts about the belief: one file per predicate or function, and their list.

mod clarity;
mod completeness;
mod completeness_in;
mod confidence;
mod is;
mod last_seen;
mod on;
mod placed;
mod presence;
mod sure;

use crate::ability::Fact;

/// All facts of *searching*.
pub(super) const ALL: &[Fact] = &[
    Fact {
        name: "confidence",
        types: &["thing"],
        about: "how sure it is where the thing stands, 0 to 1",
        states: confidence::state,
        bounds: Some(confidence::bounds),
    },
    Fact {
        name: "presence",
        types: &["thing", "surface"],
        about: "how sure it is that the thing stands on the surface, 0 to 1",
        states: presence::state,
        bounds: Some(presence::bounds),
    },
    Fact {
        name: "placed",
        types: &["thing"],
        about: "how sure it is that the thing, where one is believed in, stands where on its surface it is believed to, 0 to 1",
        states: placed::state,
        bounds: Some(placed::bounds),
    },
    Fact {
        name: "on",
        types: &["thing", "surface"],
        about: "the thing surely stands on the surface",
        states: on::state,
        bounds: Some(on::bounds),
    },
    Fact {
        name: "last-seen",
        types: &["thing", "surface"],
        about: "an earlier run that is remembered saw the thing there last",
        states: last_seen::place,
        bounds: None,
    },
    Fact {
        name: "hours-since",
        types: &["thing"],
        about: "hours since an earlier run saw the thing last",
        states: last_seen::hours,
        bounds: None,
    },
    Fact {
        name: "is",
        types: &["thing", "kind"],
        about: "the thing is surely of the kind",
        states: is::state,
        bounds: Some(is::bounds),
    },
    Fact {
        name: "completeness",
        types: &["kind"],
        about: "how sure it is that all of the kind are found, 0 to 1",
        states: completeness::state,
        bounds: Some(completeness::bounds),
    },
    Fact {
        name: "completeness-in",
        types: &["kind", "room"],
        about: "how sure it is that all of the kind are found that are in the room that is asked about, 0 to 1",
        states: completeness_in::state,
        bounds: Some(completeness_in::bounds),
    },
    Fact {
        name: "sure",
        types: &[],
        about: "the confidence that was asked for",
        states: sure::state,
        bounds: None,
    },
    Fact {
        name: "clarity",
        types: &["surface"],
        about: "how sure it is what each object on the surface is, 0 to 1",
        states: clarity::state,
        bounds: Some(clarity::bounds),
    },
];
