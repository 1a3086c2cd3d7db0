//! Directions in which effects move numeric conditions.

use crate::ground::{Change, ComparisonId, Expression, Outcome, Relation};

use super::touch::Touched;
use super::world::World;

/// True if effects that happen together may bring a numeric condition nearer to being true: not if they move
/// a sum away from its bound by a fixed length.
pub(super) fn may_help(world: &World, outcomes: &[&Outcome], comparison: ComparisonId) -> bool {
    let mut touched = Touched::default();
    touched.comparison(world, comparison);
    let comparison = &world.ground.comparisons[comparison as usize];
    let sign = match comparison.relation {
        Relation::AtLeast | Relation::Greater => 1.0,
        Relation::AtMost | Relation::Less => -1.0,
        Relation::Equal | Relation::Unequal => return true,
    };
    if !comparison.left.is_linear() || !comparison.right.is_linear() {
        return true;
    }
    let mut moved = 0.0;
    for outcome in outcomes {
        let mut changed = Touched::default();
        changed.outcome(world, outcome);
        if !changed.numbers.iter().any(|number| touched.numbers.contains(number)) {
            continue;
        }
        let Outcome::Change { fluent, change, amount: Expression::Constant(amount) } = outcome else {
            return true;
        };
        let amount = match change {
            Change::Increase => *amount,
            Change::Decrease => -amount,
            Change::Assign | Change::ScaleUp | Change::ScaleDown => return true,
        };
        moved += amount * (comparison.left.weight_of(*fluent) - comparison.right.weight_of(*fluent));
    }
    moved * sign > 0.0
}
