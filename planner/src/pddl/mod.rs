//! PDDL text: from characters to a tree of names, and the checks that make a [`Task`](crate::Task) of it.

pub mod ast;
