//! Readers of external bytes, each with a judge of its results, and inputs mutated from valid ones.
//!
//! A judge panics where a reader has a fault: by itself, or since what it read contradicts itself. Bad input is no fault.

mod corpus;
mod judges;
mod mutate;

pub use mutate::{Draw, mutate};

/// A reader under test.
#[derive(Clone, Copy)]
pub struct Target {
    /// Name, also of the program in `fuzz/`.
    pub name: &'static str,
    /// Reads an input and judges the result.
    pub judge: fn(&[u8]),
    /// Good inputs, and bad ones that once mattered.
    pub corpus: fn() -> Vec<Vec<u8>>,
}

/// Every reader of bytes from outside.
pub const TARGETS: &[Target] = &[
    Target { name: "pddl", judge: judges::pddl, corpus: corpus::pddl },
    Target { name: "domain", judge: judges::domain, corpus: corpus::domains },
    Target { name: "scene", judge: judges::scene, corpus: corpus::scenes },
    Target { name: "phrase", judge: judges::phrase, corpus: corpus::phrases },
    Target { name: "cloud", judge: judges::cloud, corpus: corpus::clouds },
    Target { name: "depth", judge: judges::depth, corpus: corpus::depths },
    Target { name: "record", judge: judges::record, corpus: corpus::records },
    Target { name: "body", judge: judges::body, corpus: corpus::bodies },
];

/// The target of a name.
///
/// # Panics
/// If there is none.
pub fn target(name: &str) -> &'static Target {
    TARGETS.iter().find(|target| target.name == name).expect("a target's name")
}
