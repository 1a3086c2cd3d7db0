//! Findings about the folder of a domain, common to the command line and the language server.

use descry_domains::check;
use descry_domains::load::Domain;
use descry_domains::load::error::LoadError;
use descry_planner::Findings;

/// Findings in a domain's folder, and a line on what states, answers or carries out each of its
/// predicates, functions, calls and actions; no lines for a folder that cannot be loaded.
///
/// # Errors
/// [`LoadError`] for reasons other than findings.
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
