//! Object declarations of a problem: one symbol is one object, of every type it is used with. A
//! table, an object called "table", and a kind with an object's name may share a symbol.

use crate::vocabulary::Vocabulary;

/// Declaration lines (symbol and type) and the declared symbols. Types unknown to the domain are
/// skipped; supertypes are implied, and domain constants are already declared.
pub fn lines<'a>(
    objects: impl IntoIterator<Item = (&'a str, &'a str)>,
    vocabulary: &Vocabulary,
) -> (Vec<String>, Vec<String>) {
    let mut types: Vec<(&str, Vec<&str>)> = Vec::new();
    let is_constant = |symbol: &str| vocabulary.task.find_object(symbol).is_some();
    for (symbol, of) in objects {
        if !vocabulary.has_type(of) || is_constant(symbol) {
            continue;
        }
        match types.iter_mut().find(|(known, _)| *known == symbol) {
            None => types.push((symbol, vec![of])),
            Some((_, known)) if known.iter().any(|narrow| vocabulary.is_a(narrow, of)) => {}
            Some((_, known)) => {
                known.retain(|wide| !vocabulary.is_a(of, wide));
                known.push(of);
            }
        }
    }
    let mut lines: Vec<(Vec<&str>, String)> = Vec::new();
    for (symbol, of) in &types {
        match lines.iter_mut().find(|(known, _)| known == of) {
            Some((_, line)) => *line += &format!(" {symbol}"),
            None => lines.push((of.clone(), (*symbol).to_string())),
        }
    }
    let declared = |(of, symbols): &(Vec<&str>, String)| match of.as_slice() {
        [one] => format!("{symbols} - {one}"),
        several => format!("{symbols} - (either {})", several.join(" ")),
    };
    (lines.iter().map(declared).collect(), types.iter().map(|(symbol, _)| (*symbol).to_string()).collect())
}
