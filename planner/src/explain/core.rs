//! Search for a minimal unsolvable subset of a goal's parts.

use crate::task::{Condition, Task};

use super::{Explanation, together};

/// Maximum number of goal parts for which the search is tried.
const MOST_PARTS: usize = 24;

/// Drops goal parts one after the other while `unsolvable` still proves that the rest cannot be
/// reached, and explains with the remaining parts; `None` if the goal is no conjunction or has too
/// many parts.
///
/// The remaining subset is minimal if every call of `unsolvable` comes to a decision. `only_lost`:
/// the goal is reachable under delete relaxation.
pub(crate) fn narrowed(
    task: &Task,
    only_lost: bool,
    unsolvable: &mut dyn FnMut(&Task) -> bool,
) -> Option<Explanation> {
    let Condition::And(parts) = &task.goal.body else { return None };
    if parts.len() > MOST_PARTS {
        return None;
    }
    let mut left = parts.clone();
    for part in parts {
        let others: Vec<Condition> = left.iter().filter(|other| *other != part).cloned().collect();
        let mut without = task.clone();
        without.goal.body = Condition::And(others.clone());
        if !others.is_empty() && unsolvable(&without) {
            left = others;
        }
    }
    let exhausted = left.len() == parts.len();
    let list = vec![together(task, &left.iter().collect::<Vec<_>>(), !exhausted, only_lost)];
    Some(Explanation { exhausted, ..Explanation::new(task, list) })
}
