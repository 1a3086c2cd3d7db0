//! From a goal and a state to a timed plan.
