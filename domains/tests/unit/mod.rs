//! Tests of single modules.

mod abilities_learning_again;
mod abilities_learning_taken;
mod abilities_searching_candidates;
mod abilities_searching_change;
mod abilities_searching_policies;
mod abilities_searching_policies_unseen;
mod abilities_searching_reasons;
mod abilities_searching_unnoticed;
mod abilities_searching_vanished;
mod abilities_shapes_unseen;
mod abilities_surveying_ground;
mod actions;
mod answer;
mod asked;
mod check;
mod check_place;
mod declared;
mod goal;
mod lexicon;
mod load_names;
mod no_plan;
mod program;
mod saying;
mod vocabulary;
mod walls;
mod words;
