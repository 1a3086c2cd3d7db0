//! What planner, validator and monitor share: numbers and how they compare, and walking over what is said.

pub(crate) mod relation;
pub(crate) mod walk;
