//! What planner, validator and monitor share: numbers and how they compare, walking over what is said, and what is asked of
//! the states on the way.

pub(crate) mod agreement;
pub(crate) mod automaton;
pub(crate) mod between;
pub(crate) mod relation;
pub(crate) mod walk;
