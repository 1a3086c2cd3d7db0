//! What the belief says in the words of a domain: one file per fact, and the list of them.

mod at;
mod clarity;
mod completeness;
mod confidence;
mod observed;
mod out_of_reach;
mod time_left;

use crate::situation::Situation;

/// Writes the instances of one predicate or function that hold now, a line of PDDL each.
type States = fn(&Situation) -> Vec<String>;

/// Every fact that is built in, by the name of its predicate or function.
pub(crate) const ALL: &[(&str, States)] = &[
    ("at", at::state),
    ("clarity", clarity::state),
    ("completeness", completeness::state),
    ("confidence", confidence::state),
    ("observed", observed::state),
    ("out-of-reach", out_of_reach::state),
    ("time-left", time_left::state),
];
