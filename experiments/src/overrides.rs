//! Values of an experiment file that the command line replaces.

use std::ops::Range;

use toml::de::{DeArray, DeTable, DeValue};

/// The text with another value at a path such as `first_seed` or `set.1.first_seed`; numbers count tables of
/// a list from 0. A key that its table lacks is added to it.
///
/// # Errors
/// A message for people, if the path leaves the file, or leads to a table.
pub(crate) fn with(text: &str, path: &str, value: &str) -> Result<String, String> {
    let document = DeTable::parse(text).map_err(|e| format!("the file is no TOML: {}", e.message()))?;
    let (mut inner, mut span, mut walked) = (Inner::Table(document.get_ref()), 0..0, Vec::new());
    let mut steps = path.split('.').peekable();
    while let Some(step) = steps.next() {
        let found = match inner {
            Inner::Table(table) => table.get(step),
            Inner::List(list) => step.parse().ok().and_then(|n: usize| list.get(n)),
            Inner::Value => None,
        };
        let Some(found) = found else {
            return match inner {
                Inner::Table(table) if steps.peek().is_none() && is_bare(step) => {
                    Ok(added(text, span, &format!("{step} = {value}"), table.is_empty()))
                }
                _ => Err(inner.has(&walked.join("."))),
            };
        };
        walked.push(step);
        span = found.span();
        inner = match found.get_ref() {
            DeValue::Table(table) => Inner::Table(table),
            DeValue::Array(list) => Inner::List(list),
            _ => Inner::Value,
        };
    }
    // A table under a heading of its own has no single place in the text.
    let is_list_of_tables =
        |list: &DeArray<'_>| matches!(list.first().map(|v| v.get_ref()), Some(DeValue::Table(_)));
    match inner {
        Inner::Value => {}
        Inner::List(list) if !is_list_of_tables(list) => {}
        _ => return Err(inner.has(&walked.join("."))),
    }
    let mut text = text.to_owned();
    text.replace_range(span, value);
    Ok(text)
}

fn is_bare(key: &str) -> bool {
    !key.is_empty() && key.chars().all(|c| c.is_ascii_alphanumeric() || "_-".contains(c))
}

/// The text with an assignment at the beginning of a table: below its heading, within its braces, or at the
/// top of the file.
fn added(text: &str, table: Range<usize>, assignment: &str, is_empty: bool) -> String {
    let line_end = |from: usize| text[from..].find('\n').map_or(text.len(), |n| from + n);
    let (at, assignment) = match text[table.clone()].chars().next() {
        None => (0, format!("{assignment}\n")),
        Some('{') if is_empty => (table.start + 1, format!(" {assignment} ")),
        Some('{') => (table.start + 1, format!(" {assignment}, ")),
        Some(_) => (line_end(table.end), format!("\n{assignment}")),
    };
    [&text[..at], &assignment, &text[at..]].concat()
}

/// Content of a value that a further step of a path may select.
enum Inner<'t> {
    Table(&'t DeTable<'t>),
    List(&'t DeArray<'t>),
    Value,
}

impl Inner<'_> {
    /// Sentence on the keys or entries of the value at a path.
    fn has(&self, path: &str) -> String {
        let path = if path.is_empty() { "the file".to_owned() } else { format!("`{path}`") };
        match self {
            Self::Table(table) => {
                let keys: Vec<&str> = table.keys().map(|key| key.get_ref().as_ref()).collect();
                format!("{path} has the keys {}", keys.join(", "))
            }
            Self::List(list) if list.len() == 1 => format!("{path} has one entry, number 0"),
            Self::List(list) => {
                format!("{path} has {} entries, numbers 0 to {}", list.len(), list.len().saturating_sub(1))
            }
            Self::Value => format!("{path} is a single value"),
        }
    }
}
