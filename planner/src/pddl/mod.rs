//! PDDL text: parsing to a syntax tree, and checks that turn the tree into a [`Task`](crate::Task).

pub mod ast;
mod check;
#[doc(hidden)]
pub mod format;
pub mod lex;
pub mod parse;

pub use check::check;
pub(crate) use check::{defeated, without_value};
pub use format::format;

/// Known name that is most similar to `name`; `None` if in all of them more than a third of the
/// letters differ.
pub fn nearest<'a>(name: &str, known: impl IntoIterator<Item = &'a str>) -> Option<&'a str> {
    let limit = (name.chars().count() / 3).max(1);
    known
        .into_iter()
        .map(|candidate| (distance(name, candidate, limit), candidate))
        .filter(|&(distance, _)| distance <= limit)
        .min_by_key(|&(distance, _)| distance)
        .map(|(_, candidate)| candidate)
}

/// Edit distance of two names (insertion, deletion, replacement, transposition of neighbours).
/// Distances above `limit` are returned as some number above `limit`.
fn distance(from: &str, to: &str, limit: usize) -> usize {
    let (from, to): (Vec<char>, Vec<char>) = (from.chars().collect(), to.chars().collect());
    if from.len().abs_diff(to.len()) > limit {
        return limit + 1;
    }
    let mut before: Vec<usize> = vec![0; to.len() + 1];
    let mut above: Vec<usize> = (0..=to.len()).collect();
    for row in 1..=from.len() {
        let mut line = vec![row; to.len() + 1];
        for column in 1..=to.len() {
            let same = usize::from(from[row - 1] != to[column - 1]);
            line[column] = (above[column - 1] + same).min(above[column] + 1).min(line[column - 1] + 1);
            let swapped =
                row > 1 && column > 1 && from[row - 1] == to[column - 2] && from[row - 2] == to[column - 1];
            if swapped {
                line[column] = line[column].min(before[column - 2] + 1);
            }
        }
        before = std::mem::replace(&mut above, line);
    }
    above[to.len()]
}
