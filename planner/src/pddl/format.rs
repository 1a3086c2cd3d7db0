//! PDDL formatter. It keeps the author's line breaks between parts, and normalises indentation,
//! blanks and closing parentheses.
//!
//! Comments stay in place. Formatting does not change what the text means, and formatting twice
//! gives the same text as formatting once.

#[doc(hidden)]
pub mod layout;
mod tree;

use super::lex::{self, Symbols};
use crate::diagnostic::{Findings, Source};

/// Maximum number of layout passes in search of a text that a further pass leaves unchanged.
const MOST_PASSES: usize = 6;

/// Formats a domain, a problem, or any text of parenthesised lists.
///
/// # Errors
/// Findings about unbalanced parentheses or unknown characters; such a text is not formatted.
pub fn format(source: &Source) -> Result<String, Findings> {
    let mut list = Vec::new();
    lex::read(&source.text, 0, &mut Symbols::default(), &mut list);
    if !list.is_empty() {
        return Err(Findings { sources: vec![source.clone()], list });
    }
    let mut text = source.text.clone();
    for _ in 0..MOST_PASSES {
        let laid_out = layout::print(&tree::read(&text));
        if laid_out == text {
            break;
        }
        text = laid_out;
    }
    Ok(text)
}
