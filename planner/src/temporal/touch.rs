//! Variables and numbers that conditions and expressions read, or effects change.

use crate::ground::{
    CallId, ComparisonId, Conjunction, GroundExpression, GroundOutcome, NumericId, Place, VariableId,
};

use super::world::World;

/// Set of variables and numbers, possibly with duplicates.
#[derive(Debug, Clone, Default)]
pub(crate) struct Touched {
    /// Indices of finite-domain variables.
    pub variables: Vec<VariableId>,
    /// Indices of numbers.
    pub numbers: Vec<NumericId>,
}

impl Touched {
    /// Variables and numbers as indices of resources, in ascending order, each once: number `n` has
    /// index `n` plus the number of `variables` in the task.
    pub fn resources(&self, variables: usize) -> Vec<u32> {
        let numbers = self.numbers.iter().map(|&number| number + variables as u32);
        let mut resources: Vec<u32> = self.variables.iter().copied().chain(numbers).collect();
        resources.sort_unstable();
        resources.dedup();
        resources
    }

    /// True if the two sets have a variable or number in common.
    pub fn meets(&self, other: &Touched) -> bool {
        self.variables.iter().any(|variable| other.variables.contains(variable))
            || self.numbers.iter().any(|number| other.numbers.contains(number))
    }

    /// Empties the set and keeps its memory.
    pub fn clear(&mut self) {
        self.variables.clear();
        self.numbers.clear();
    }

    /// Adds the variables and numbers that the answer of a call depends on.
    pub fn call(&mut self, world: &World, call: CallId) {
        let (variables, numbers) = world.calls.reads(call);
        self.variables.extend(variables);
        self.numbers.extend(numbers);
    }

    /// Adds the variables and numbers that a numeric condition reads.
    pub fn comparison(&mut self, world: &World, comparison: ComparisonId) {
        let comparison = &world.ground.comparisons[comparison as usize];
        expression_touches(world, &comparison.left, self);
        expression_touches(world, &comparison.right, self);
    }

    /// Adds the variables and numbers that a condition reads.
    pub fn condition(&mut self, world: &World, condition: &Conjunction) {
        self.variables.extend(condition.facts.iter().map(|fact| fact.variable));
        condition.comparisons.iter().for_each(|&comparison| self.comparison(world, comparison));
        condition.calls.iter().for_each(|&(call, _)| self.call(world, call));
    }

    /// Adds the variables and numbers that the outcome of an effect changes.
    pub fn outcome(&mut self, world: &World, outcome: &GroundOutcome) {
        match outcome {
            GroundOutcome::Set(fact) => self.variables.push(fact.variable),
            GroundOutcome::Change { fluent, .. } | GroundOutcome::Flow { fluent, .. } => {
                self.numbers.push(*fluent)
            }
            GroundOutcome::Call(call) => {
                for place in &world.ground.calls[*call as usize].writes {
                    match place {
                        Place::Number(number) => self.numbers.push(*number),
                        Place::Truth(variable) | Place::Object(variable) => self.variables.push(*variable),
                        Place::Nowhere => {}
                    }
                }
            }
        }
    }
}

/// Adds the variables and numbers that an expression reads.
pub(crate) fn expression_touches(world: &World, expression: &GroundExpression, touched: &mut Touched) {
    match expression {
        GroundExpression::Fluent(fluent) => touched.numbers.push(*fluent),
        GroundExpression::Call(call) => touched.call(world, *call),
        GroundExpression::Sum(parts) | GroundExpression::Product(parts) => {
            parts.iter().for_each(|part| expression_touches(world, part, touched));
        }
        GroundExpression::Difference(left, right) | GroundExpression::Quotient(left, right) => {
            expression_touches(world, left, touched);
            expression_touches(world, right, touched);
        }
        GroundExpression::Negative(inner) => expression_touches(world, inner, touched),
        GroundExpression::Constant(_)
        | GroundExpression::Duration
        | GroundExpression::TotalTime
        | GroundExpression::Violated(_) => {}
    }
}
