//! Definitions that planner, validator and monitor share: comparisons of numbers, traversal of
//! conditions and expressions, trajectory constraints.

#[doc(hidden)]
pub mod agreement;
pub(crate) mod automaton;
#[doc(hidden)]
pub mod between;
pub(crate) mod defeat;
#[doc(hidden)]
pub mod relation;
pub(crate) mod walk;
