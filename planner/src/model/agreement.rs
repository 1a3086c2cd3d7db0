//! Agreement of simultaneous changes of one number or one object function. PDDL 2.1 (section 8.1)
//! defines a result only if the order does not matter: all changes increase or decrease, all scale,
//! or all assign the same value. Otherwise the action is inapplicable.

use std::hash::Hash;

use rustc_hash::FxHashMap;

use super::relation::Relation;
use crate::task::Assignment;

impl Assignment {
    /// Applies a change by `amount` to a number.
    pub(crate) fn apply(self, number: &mut f64, amount: f64) {
        match self {
            Assignment::Assign => *number = amount,
            Assignment::Increase => *number += amount,
            Assignment::Decrease => *number -= amount,
            Assignment::ScaleUp => *number *= amount,
            Assignment::ScaleDown => *number /= amount,
        }
    }
}

/// True if two changes of one number, each with its amount, give the same result in either order.
/// Assignments of unknown amounts (NaN) do not agree.
fn agree((one, amount): (Assignment, f64), (other, other_amount): (Assignment, f64)) -> bool {
    let adds = |change: Assignment| matches!(change, Assignment::Increase | Assignment::Decrease);
    let scales = |change: Assignment| matches!(change, Assignment::ScaleUp | Assignment::ScaleDown);
    match (one, other) {
        (Assignment::Assign, Assignment::Assign) => Relation::Equal.holds(amount, other_amount),
        _ => adds(one) && adds(other) || scales(one) && scales(other),
    }
}

/// Contradicting changes of one number, as pairs of indices into `changes`: the first change of the
/// number and a later one. A change is a number's id, the kind of change and the amount (NaN if
/// unknown).
pub fn contradictions<N: Hash + Eq>(
    changes: impl Iterator<Item = (N, Assignment, f64)>,
) -> Vec<(usize, usize)> {
    let mut first: FxHashMap<N, (usize, Assignment, f64)> = FxHashMap::default();
    let mut found = Vec::new();
    for (place, (number, change, amount)) in changes.enumerate() {
        let &mut (earlier, other, other_amount) = first.entry(number).or_insert((place, change, amount));
        if earlier != place && !agree((other, other_amount), (change, amount)) {
            found.push((earlier, place));
        }
    }
    found
}

/// First two entries (indices) that give one name different values; `None` if all agree.
pub fn reset<N: Hash + Eq, V: PartialEq + Copy>(
    values: impl Iterator<Item = (N, V)>,
) -> Option<(usize, usize)> {
    let mut first: FxHashMap<N, (usize, V)> = FxHashMap::default();
    values.enumerate().find_map(|(place, (named, value))| {
        let &mut (earlier, other) = first.entry(named).or_insert((place, value));
        (other != value).then_some((earlier, place))
    })
}
