//! What planner, validator and monitor share: numbers and how they compare, walking over what is said, and what is asked of
//! the states on the way.

#[doc(hidden)]
pub mod agreement;
pub(crate) mod automaton;
#[doc(hidden)]
pub mod between;
#[doc(hidden)]
pub mod relation;
pub(crate) mod walk;
