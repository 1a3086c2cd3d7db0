//! Direction in which effects move numeric conditions.

use crate::ground::{Change, ComparisonId, GroundExpression, GroundOutcome, Relation};

use super::touch::{Touched, expression_touches};
use super::world::World;

/// True if effects that happen together may help a numeric condition to hold; false if they surely
/// leave the compared difference as it is or move it away from the bound.
pub fn may_help(world: &World, outcomes: &[&GroundOutcome], comparison: ComparisonId) -> bool {
    let comparison = &world.ground.comparisons[comparison as usize];
    let sign = match comparison.relation {
        Relation::AtLeast | Relation::Greater => 1.0,
        Relation::AtMost | Relation::Less => -1.0,
        Relation::Equal | Relation::Unequal => return true,
    };
    let (mut read, mut changed) = (Touched::default(), Touched::default());
    [&comparison.left, &comparison.right]
        .into_iter()
        .for_each(|side| expression_touches(world, side, &mut read));
    outcomes.iter().for_each(|outcome| changed.outcome(world, outcome));
    if !is_sum(world, &comparison.left, &changed) || !is_sum(world, &comparison.right, &changed) {
        return true;
    }
    let weight = |fluent| sign * (comparison.left.weight_of(fluent) - comparison.right.weight_of(fluent));
    let mut moved = 0.0;
    for outcome in outcomes {
        let (fluent, change, amount) = match outcome {
            GroundOutcome::Change { fluent, change, amount } => (*fluent, *change, amount),
            GroundOutcome::Flow { fluent, rate } => (*fluent, Change::Increase, rate),
            GroundOutcome::Set(_) => continue,
            GroundOutcome::Call(_) => return true,
        };
        let by = match change {
            _ if !read.numbers.contains(&fluent) => continue,
            Change::Increase => weight(fluent),
            Change::Decrease => -weight(fluent),
            // It may also give a value to what had none.
            Change::Assign | Change::ScaleUp | Change::ScaleDown => return true,
        };
        match amount {
            GroundExpression::Constant(amount) => moved += by * amount,
            amount if amount.is_never_negative(-by) => {}
            _ => return true,
        }
    }
    moved > 0.0
}

/// True if an expression is a weighted sum of numbers and of attachment answers that do not depend on
/// `changed`.
fn is_sum(world: &World, expression: &GroundExpression, changed: &Touched) -> bool {
    let holds = |part: &GroundExpression| is_sum(world, part, changed);
    match expression {
        GroundExpression::Call(call) => {
            let mut read = Touched::default();
            read.call(world, *call);
            !read.meets(changed)
        }
        GroundExpression::Sum(parts) => parts.iter().all(holds),
        GroundExpression::Difference(left, right) => holds(left) && holds(right),
        GroundExpression::Negative(inner) => holds(inner),
        GroundExpression::Product(parts) => {
            let mut factors = parts.iter().filter(|part| !matches!(part, GroundExpression::Constant(_)));
            factors.next().is_none_or(holds) && factors.next().is_none()
        }
        GroundExpression::Quotient(left, right) => {
            holds(left) && matches!(**right, GroundExpression::Constant(_))
        }
        other => other.is_linear(),
    }
}
