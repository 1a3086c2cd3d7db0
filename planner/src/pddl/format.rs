//! PDDL formatter: keeps the author's line breaks between parts; normalises indentation, blanks and
//! closing parentheses.
//!
//! Comments are kept where they stand. What is read is the same before and after, and laying out twice changes nothing.

#[doc(hidden)]
pub mod layout;
mod tree;

use super::lex::{self, Symbols};
use crate::diagnostic::{Findings, Source};

/// Maximum number of layout passes until a fixed point.
const MOST_PASSES: usize = 6;

/// Lays out a domain, a problem, or any text of lists.
///
/// # Errors
/// What is wrong with its parentheses: such a text is not touched.
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
