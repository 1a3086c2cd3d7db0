//! Kinds of experiments: one file each, and their list.

mod faults;
mod figure_4;
pub mod kind;
mod paired;
mod tasks;
#[doc(hidden)]
pub mod trial;
mod where_to_look;

use crate::error::ExperimentError;
use crate::source::Source;
use kind::{Head, Kind, parse, refuse};

/// Reader of experiment files of a kind.
type Reader = fn(&Source) -> Result<Box<dyn Kind>, ExperimentError>;

/// All kinds by their names in experiment files.
pub const ALL: &[(&str, Reader)] = &[
    ("figure-4", figure_4::read),
    ("where-to-look", where_to_look::read),
    ("faults", faults::read),
    ("tasks", tasks::read),
];

/// Reads and checks an experiment file.
///
/// # Errors
/// [`ExperimentError::Input`] with the place of the fault.
pub fn read(source: &Source) -> Result<Box<dyn Kind>, ExperimentError> {
    let head: Head = parse(source)?;
    let known: Vec<&str> = ALL.iter().map(|(name, _)| *name).collect();
    match ALL.iter().find(|(name, _)| *name == head.kind) {
        Some((_, reader)) => reader(source),
        None => Err(refuse(
            source,
            "kind",
            format!("no kind of experiment is called \"{}\"", head.kind),
            format!("one of: {}", known.join(", ")),
        )),
    }
}
