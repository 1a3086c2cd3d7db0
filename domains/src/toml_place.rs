//! Spans of values in `domain.toml`.

use std::ops::Range;

use descry_planner::Span;
use toml::de::{DeTable, DeValue};

/// Index of `domain.toml` among the sources of the findings; the first is `domain.pddl`.
const TOML: usize = 1;

/// Resolves key paths of `domain.toml` to source spans, for diagnostics.
pub struct TomlPlaces<'a> {
    text: &'a str,
}

impl<'a> TomlPlaces<'a> {
    pub fn of(text: &'a str) -> Self {
        Self { text }
    }

    /// Span of a value by its key path (list elements by index), or of the deepest existing prefix;
    /// for a table, the span of its key.
    pub(crate) fn at(&self, path: &[&str]) -> Span {
        let found = DeTable::parse(self.text).ok().and_then(|table| deepest(table.get_ref(), path));
        span(found.unwrap_or_else(|| 0..self.text.lines().next().map_or(0, str::len)))
    }

    /// Span of a part of a value; the whole value if the part is missing.
    pub fn within(&self, path: &[&str], part: &str) -> Span {
        let whole = self.at(path);
        let (start, end) = (whole.start as usize, whole.end as usize);
        match self.text.get(start..end).and_then(|text| text.find(part)) {
            Some(at) if !part.is_empty() => span(start + at..start + at + part.len()),
            _ => whole,
        }
    }
}

pub fn span(at: Range<usize>) -> Span {
    Span { source: TOML as u32, start: at.start as u32, end: at.end as u32 }
}

fn deepest(table: &DeTable<'_>, path: &[&str]) -> Option<Range<usize>> {
    let (first, rest) = path.split_first()?;
    let (key, value) = table.get_key_value(*first)?;
    within(value.get_ref(), rest).or_else(|| {
        let is_table = value.get_ref().is_table();
        Some(if is_table || value.span().is_empty() { key.span() } else { value.span() })
    })
}

pub fn within(value: &DeValue<'_>, path: &[&str]) -> Option<Range<usize>> {
    match value {
        DeValue::Table(table) => deepest(table, path),
        DeValue::Array(list) => {
            let (first, rest) = path.split_first()?;
            let element = list.get(first.parse::<usize>().ok()?)?;
            within(element.get_ref(), rest).or_else(|| Some(element.span()))
        }
        _ => None,
    }
}
