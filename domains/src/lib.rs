#![doc = include_str!("../README.md")]

pub mod abilities;
pub mod actions;
pub mod answer;
pub mod asked;
pub mod check;
pub mod config;
#[doc(hidden)]
#[doc(hidden)]
pub mod culprit;
pub mod declared;
pub mod function;
pub mod geometry;
pub mod goal;
#[doc(hidden)]
pub mod judge;
pub mod lesson;
pub mod lexicon;
pub mod load;
mod mentions;
pub mod mind;
pub mod no_plan;
pub mod note;
pub mod program;
mod programs;
#[doc(hidden)]
pub mod range;
pub mod saying;
pub mod situation;
pub mod template;
pub mod vocabulary;
#[doc(hidden)]
pub mod walls;
pub mod words;
pub mod world;

pub use descry_planner;
