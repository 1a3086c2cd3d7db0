//! From a PDDL action to motion and looking.
