//! Errors of loading a domain's folder.

use descry_planner::Findings;

/// Error of loading a domain's folder.
#[derive(Debug, thiserror::Error)]
pub enum LoadError {
    /// Neither a built-in name nor a folder.
    #[error(
        "there is no domain \"{name}\"{near}\n  expected a folder that holds domain.pddl and domain.toml, or a built-in domain: {known}"
    )]
    NoDomain {
        /// Name of the requested domain.
        name: String,
        /// Names of the built-in domains.
        known: String,
        /// Question whether the nearest built-in domain is meant; empty if none is near.
        near: String,
    },
    /// Unreadable file.
    #[error("{path}: {because}\n  expected: {expected}")]
    File {
        /// Path of the file.
        path: String,
        /// Error of the operating system.
        because: String,
        /// Expected content.
        expected: &'static str,
    },
    /// The PDDL text has errors, or a value in `domain.toml` is out of range.
    #[error("{}", .findings.render(false))]
    Findings {
        /// Findings with their places.
        findings: Findings,
    },
}
