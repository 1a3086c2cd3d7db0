//! Numbers that are linear in the times of happenings, and linear programs over these times.

use microlp::{ComparisonOp, LinearExpr, OptimizationDirection, Problem, Variable};

use crate::ground::{GroundExpression, Relation};

/// Margin of a strict comparison, in the unit of the compared numbers: well above the tolerance
/// (1e-7) of linear programs and comparisons.
const STRICTLY: f64 = 1e-6;

/// Number that is linear in the variables of a [`Program`].
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Linear {
    constant: f64,
    /// Variables with their factors, in ascending order; no factor is zero.
    terms: Vec<(u32, f64)>,
}

impl Linear {
    /// Linear number without variables.
    pub fn constant(constant: f64) -> Linear {
        Linear { constant, terms: Vec::new() }
    }

    /// Linear number that equals a variable.
    pub fn variable(variable: u32) -> Linear {
        Linear { constant: 0.0, terms: vec![(variable, 1.0)] }
    }

    /// Value of a number without variables; `None` if it has any.
    pub fn as_constant(&self) -> Option<f64> {
        self.terms.is_empty().then_some(self.constant)
    }

    /// False if the number's value is undefined or infinite.
    pub fn is_finite(&self) -> bool {
        self.constant.is_finite()
    }

    /// Sum of this number and `factor` times another one.
    pub fn plus(&self, factor: f64, other: &Linear) -> Linear {
        let mut terms = self.terms.clone();
        for &(variable, other) in &other.terms {
            match terms.binary_search_by_key(&variable, |&(own, _)| own) {
                Ok(place) => terms[place].1 += factor * other,
                Err(place) => terms.insert(place, (variable, factor * other)),
            }
        }
        terms.retain(|&(_, factor)| factor != 0.0);
        Linear { constant: self.constant + factor * other.constant, terms }
    }

    /// This number times a factor.
    pub fn times(&self, factor: f64) -> Linear {
        Linear::constant(0.0).plus(factor, self)
    }

    /// Value under an assignment of the variables.
    pub fn value(&self, values: &[f64]) -> f64 {
        self.terms
            .iter()
            .fold(self.constant, |sum, &(variable, factor)| sum + factor * values[variable as usize])
    }

    /// Linear form of an expression; `None` if the expression is nonlinear or calls an attachment.
    pub fn of(
        expression: &GroundExpression,
        numbers: &[Linear],
        duration: Option<&Linear>,
        total_time: Option<&Linear>,
    ) -> Option<Linear> {
        let inner = |inner: &GroundExpression| Linear::of(inner, numbers, duration, total_time);
        Some(match expression {
            GroundExpression::Constant(number) => Linear::constant(*number),
            GroundExpression::Fluent(fluent) => numbers[*fluent as usize].clone(),
            GroundExpression::Duration => duration?.clone(),
            GroundExpression::TotalTime => total_time?.clone(),
            GroundExpression::Call(_) | GroundExpression::Violated(_) => return None,
            GroundExpression::Sum(parts) => {
                let mut sum = Linear::constant(0.0);
                for part in parts {
                    sum = sum.plus(1.0, &inner(part)?);
                }
                sum
            }
            GroundExpression::Product(parts) => {
                let mut product = Linear::constant(1.0);
                for part in parts {
                    let part = inner(part)?;
                    product = match (product.as_constant(), part.as_constant()) {
                        (Some(factor), _) => part.times(factor),
                        (None, Some(factor)) => product.times(factor),
                        (None, None) => return None,
                    };
                }
                product
            }
            GroundExpression::Difference(left, right) => inner(left)?.plus(-1.0, &inner(right)?),
            GroundExpression::Quotient(left, right) => {
                let divisor = inner(right)?.as_constant().filter(|divisor| *divisor != 0.0)?;
                inner(left)?.times(1.0 / divisor)
            }
            GroundExpression::Negative(operand) => inner(operand)?.times(-1.0),
        })
    }
}

/// Linear program: bounds on variables, and comparisons of linear numbers.
#[derive(Debug, Clone, Default)]
pub(super) struct Program {
    bounds: Vec<(f64, f64)>,
    rows: Vec<(Vec<(u32, f64)>, ComparisonOp, f64)>,
}

impl Program {
    /// Adds a variable between two bounds; returns its index.
    pub fn variable(&mut self, least: f64, most: f64) -> u32 {
        self.bounds.push((least, most));
        self.bounds.len() as u32 - 1
    }

    /// Number of comparisons in the program.
    pub fn rows(&self) -> usize {
        self.rows.len()
    }

    /// Adds a comparison as a constraint; false if it cannot hold or is `Unequal`, which no linear
    /// program expresses.
    pub fn ask(&mut self, left: &Linear, relation: Relation, right: &Linear) -> bool {
        let difference = left.plus(-1.0, right);
        if !difference.constant.is_finite() {
            return false;
        }
        if let Some(constant) = difference.as_constant() {
            return relation.holds(constant, 0.0);
        }
        let bound = -difference.constant;
        let (comparison, bound) = match relation {
            Relation::Less => (ComparisonOp::Le, bound - STRICTLY),
            Relation::AtMost => (ComparisonOp::Le, bound),
            Relation::Equal => (ComparisonOp::Eq, bound),
            Relation::AtLeast => (ComparisonOp::Ge, bound),
            Relation::Greater => (ComparisonOp::Ge, bound + STRICTLY),
            // Two ranges are no linear program.
            Relation::Unequal => return false,
        };
        self.rows.push((difference.terms, comparison, bound));
        true
    }

    /// Values of all variables that minimise a number; `None` if the program is infeasible or
    /// unbounded.
    pub fn minimised(&self, objective: &Linear) -> Option<Vec<f64>> {
        let mut factors = vec![0.0; self.bounds.len()];
        objective.terms.iter().for_each(|&(variable, factor)| factors[variable as usize] = factor);
        let mut problem = Problem::new(OptimizationDirection::Minimize);
        let own = self.bounds.iter().zip(factors);
        let variables: Vec<Variable> = own.map(|(&bounds, factor)| problem.add_var(factor, bounds)).collect();
        for (terms, comparison, bound) in &self.rows {
            let terms: LinearExpr =
                terms.iter().map(|&(variable, factor)| (variables[variable as usize], factor)).collect();
            problem.add_constraint(terms, *comparison, *bound);
        }
        let solution = problem.solve().ok()?.into_solution().ok()?;
        Some(variables.iter().map(|&variable| solution.var_value(variable)).collect())
    }
}
