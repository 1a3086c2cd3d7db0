//! Minimal unsolvable subset of a goal: a smallest set of its parts that cannot be had together.

use crate::task::{Condition, Task};

use super::{Explanation, together};

/// Goals with more parts than this are not taken apart.
const MOST_PARTS: usize = 24;

/// Leaves out what need not be in the goal for it to stay out of reach, as far as `unsolvable` proves; and tells what
/// is left; `only_lost` where all of it could be had if nothing were ever taken away. Nothing of it can be left out, where every question is answered.
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
