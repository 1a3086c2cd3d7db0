//! Formatting of PDDL and plans, common to the command line and the language server.

use descry_planner::{Findings, Plan, Source, pddl};

/// Formats a text.
///
/// # Errors
/// The findings that prevent parsing; such a text is left unchanged.
pub fn laid_out(source: &Source) -> Result<String, Findings> {
    if is_plan(&source.text) { Plan::format(source) } else { pddl::format(source) }
}

/// True if a text is a plan: a text without a definition.
fn is_plan(text: &str) -> bool {
    words(text).next().is_some_and(|word| !word.eq_ignore_ascii_case("define"))
}

/// Symbols of a PDDL text, without comments and parentheses.
pub fn words(text: &str) -> impl Iterator<Item = &str> {
    text.lines()
        .map(|line| line.split(';').next().unwrap_or_default())
        .flat_map(|line| line.split(|c: char| c.is_whitespace() || "()".contains(c)))
        .filter(|word| !word.is_empty())
}
