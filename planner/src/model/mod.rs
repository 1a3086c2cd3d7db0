//! What planner, validator and monitor share: numbers and how they compare.

pub(crate) mod relation;
