//! Everything that is to be said about the whole folder of a domain: the same on the command line and in an editor.

use descry_domains::check;
use descry_domains::load::{Domain, LoadError};
use descry_planner::Findings;

/// The findings in a domain's folder, and how each of its words is grounded.
///
/// # Errors
/// [`LoadError`] where it cannot be loaded for a reason that no finding tells.
pub fn of_folder(loaded: Result<Domain, LoadError>) -> Result<(Findings, Vec<String>), LoadError> {
    let domain = match loaded {
        Ok(domain) => domain,
        Err(LoadError::Findings { findings }) => return Ok((findings, Vec::new())),
        Err(other) => return Err(other),
    };
    let mut findings = descry_planner::check(&domain.pddl, None);
    let own = check::findings(&domain);
    findings.list.extend(own.list);
    findings.sources = own.sources;
    Ok((findings, check::grounding(&domain)))
}
