//! Values of an experiment file that the command line replaces.

use std::ops::Range;

use toml::de::{DeTable, DeValue};

/// Byte range of the value at a path such as `first_seed` or `set.1.first_seed`; numbers count tables of a
/// list from 0.
///
/// # Errors
/// The existing keys where the path leaves the file; empty if the text is not TOML.
pub(crate) fn value_at(text: &str, path: &str) -> Result<Range<usize>, Vec<String>> {
    let document = DeTable::parse(text).map_err(|_| Vec::new())?;
    let mut inner = Inner::Table(document.get_ref());
    let mut span = document.span();
    for step in path.split('.') {
        let found = match inner {
            Inner::Table(table) => table.get(step),
            Inner::List(list) => step.parse().ok().and_then(|n: usize| list.get(n)),
            Inner::Value => None,
        };
        let Some(value) = found else { return Err(inner.names()) };
        span = value.span();
        inner = match value.get_ref() {
            DeValue::Table(table) => Inner::Table(table),
            DeValue::Array(list) => Inner::List(list),
            _ => Inner::Value,
        };
    }
    match inner {
        // A table under a heading of its own has no single place in the text.
        Inner::Table(_) => Err(inner.names()),
        Inner::List(list) if matches!(list.first().map(|v| v.get_ref()), Some(DeValue::Table(_))) => {
            Err(inner.names())
        }
        _ => Ok(span),
    }
}

/// Content of a value that a further step of a path may select.
enum Inner<'t> {
    Table(&'t DeTable<'t>),
    List(&'t toml::de::DeArray<'t>),
    Value,
}

impl Inner<'_> {
    fn names(&self) -> Vec<String> {
        match self {
            Self::Table(table) => table.keys().map(|key| key.get_ref().to_string()).collect(),
            Self::List(list) => (0..list.len()).map(|n| n.to_string()).collect(),
            Self::Value => Vec::new(),
        }
    }
}
