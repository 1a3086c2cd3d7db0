#![doc = include_str!("../README.md")]

pub mod abilities;
pub mod ability;
pub mod actions;
pub mod answer;
mod arm;
pub mod asked;
pub mod belief;
pub mod check;
pub mod conclusion;
pub mod config;
pub mod contradiction;
#[doc(hidden)]
pub mod culprit;
pub mod declared;
mod drive;
pub mod english;
pub mod error;
pub mod eyes;
pub mod function;
pub mod geometry;
pub mod goal;
#[doc(hidden)]
pub mod judge;
pub mod known;
pub mod lesson;
pub mod lexicon;
pub mod load;
pub mod looking;
mod mentions;
pub mod mind;
pub mod no_plan;
pub mod note;
pub mod objective;
pub mod origin;
pub mod own_map;
pub mod past;
pub mod program;
mod programs;
#[doc(hidden)]
pub mod range;
pub mod reasons;
pub mod round;
pub mod saying;
pub mod situation;
pub mod slots;
pub mod states;
pub mod surface;
pub mod symbol;
pub mod template;
#[doc(hidden)]
pub mod toml_place;
pub mod viewpoint;
pub mod vocabulary;
#[doc(hidden)]
pub mod walls;
pub mod words;
pub mod world;

pub use descry_planner;
