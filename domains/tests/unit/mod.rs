//! Tests of single modules.

mod abilities_learning_again;
mod abilities_learning_taken;
mod abilities_searching_policies;
mod abilities_searching_policies_unseen;
mod abilities_shapes_unseen;
mod abilities_surveying_ground;
mod actions;
mod answer;
mod asked;
mod belief_unnoticed;
mod check;
mod declared;
mod goal;
mod lexicon;
mod load_names;
mod looking_candidates;
mod looking_change;
mod looking_vanished;
mod no_plan;
mod program;
mod reasons;
mod saying;
mod toml_place;
mod vocabulary;
mod walls;
mod words;
