//! Atoms and values named in a PDDL text that may have errors; for findings, without evaluating the
//! text.

/// Every list of plain symbols in a text: `(on cup-a ?s)`, `(confidence cup-a)`.
pub(crate) fn mentions(text: &str) -> Vec<Vec<String>> {
    let spaced = text.to_lowercase().replace('(', " ( ").replace(')', " ) ");
    let (mut found, mut open): (Vec<Vec<String>>, Option<Vec<String>>) = (Vec::new(), None);
    for token in spaced.split_whitespace() {
        match token {
            "(" => open = Some(Vec::new()),
            ")" => found.extend(open.take().filter(|words| !words.is_empty())),
            word => open.iter_mut().for_each(|words| words.push(word.to_string())),
        }
    }
    found
}
