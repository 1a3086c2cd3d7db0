//! Words and meanings: PDDL text, what may be said, and the Rust that grounds the symbols.

pub mod abilities;
pub mod actions;
pub mod answer;
pub mod asked;
pub mod check;
pub mod config;
pub mod function;
pub mod goal;
pub mod lexicon;
pub mod load;
pub mod mind;
pub mod note;
pub mod program;
mod programs;
pub mod situation;
pub mod template;
pub mod vocabulary;
pub mod words;
pub mod world;

pub use descry_planner;
