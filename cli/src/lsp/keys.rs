//! Documentation of the headings and keys in a domain's TOML files, from the tables of the reference, which
//! are generated from the types that read these files.

/// Reference page of each file or folder of a domain.
const PAGES: [(&str, &str); 3] = [
    ("domain.toml", include_str!("reference/domain.md")),
    ("objects", include_str!("reference/objects.md")),
    ("scenes", include_str!("reference/scenes.md")),
];

/// TOML heading in force at a byte offset: its start (byte offset), and the names between its dots;
/// `None` before the first heading.
fn heading(text: &str, at: usize) -> Option<(usize, Vec<&str>)> {
    let mut start = 0;
    let mut found = None;
    for line in text.split_inclusive('\n') {
        if start > at {
            break;
        }
        if line.starts_with('[') {
            let names = line.trim_start_matches('[').split(']').next().unwrap_or_default();
            found = Some((start, names.split('.').map(str::trim).collect()));
        }
        start += line.len();
    }
    found
}

/// Name of a heading or key at a byte of a TOML file, with its meaning.
pub struct Here<'t> {
    /// Start of the name, byte offset, and the name.
    pub name: (usize, &'t str),
    /// Entry of the reference; empty for names that a domain defines.
    pub meaning: String,
}

/// Finds the name at a byte offset, in a heading or before an equals sign; `part` is the file or folder of
/// the text.
pub fn here<'t>(part: &str, text: &'t str, at: usize) -> Option<Here<'t>> {
    let page = PAGES.iter().find(|(of, _)| *of == part)?.1;
    let line = text[..at].rfind('\n').map_or(0, |n| n + 1);
    let is_part = |c: char| c.is_alphanumeric() || "-_".contains(c);
    let start =
        text[..at].char_indices().rev().take_while(|(_, c)| is_part(*c)).last().map_or(at, |(n, _)| n);
    let name = &text[start..start + text[start..].find(|c| !is_part(c)).unwrap_or(text.len() - start)];
    let behind = text[start + name.len()..].trim_start_matches([' ', '\t']);
    let in_heading = text[line..].starts_with('[');
    let is_key = !in_heading && behind.starts_with('=') && text[line..start].trim().is_empty();
    if name.is_empty() || !(in_heading || is_key) {
        return None;
    }
    let names = heading(text, at).map(|(_, names)| names).unwrap_or_default();
    let meaning = match (is_key, names.as_slice()) {
        (true, []) => row(section(page, None)?, name),
        (true, [table, ..]) => section(page, Some(table)).and_then(|section| row(section, name)),
        (false, [table, ..]) if *table == name => row(section(page, None)?, name),
        (false, _) => None,
    };
    Some(Here { name: (start, name), meaning: meaning.unwrap_or_default() })
}

/// Section of a page on a table; `None`: the part before the first section.
fn section<'p>(page: &'p str, table: Option<&str>) -> Option<&'p str> {
    let mut parts = page.split("\n## ");
    let Some(table) = table else { return parts.next() };
    let of = |part: &&str| {
        let title = part.lines().next().unwrap_or_default().trim_start_matches(['`', '[']);
        title
            .strip_prefix(table)
            .is_some_and(|rest| rest.starts_with(['`', ']', '.', ':']) || rest.is_empty())
    };
    parts.skip(1).find(of)
}

/// Entry for a key in the first table of a section.
fn row(part: &str, key: &str) -> Option<String> {
    let rows = part.lines().filter(|line| line.starts_with('|'));
    let mut cells = rows.map(|line| line.trim_matches('|').split(" | ").map(str::trim).collect::<Vec<_>>());
    let found = cells.find(|cells| cells.first() == Some(&format!("`{key}`").as_str()))?;
    let [_, what, left_out, meaning] = found.as_slice() else { return None };
    Some(format!("{meaning}\n\n{what}; if left out: {left_out}"))
}
