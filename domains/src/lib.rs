//! Words and meanings: PDDL text, what may be said, and the Rust that grounds the symbols.
//!
//! ```
//! use descry_domains::goal;
//! use descry_domains::lexicon::{Lexicon, Places};
//! use descry_domains::load::Domain;
//!
//! let domain = Domain::load("tabletop")?; // built in; or the path of a folder
//! let lexicon = Lexicon::new(&domain, &Places::default());
//! let goal = goal::read("find cup A with confidence 0.9", &domain, &lexicon)?;
//! assert_eq!(goal.pddl, "(>= (confidence cup-a) 0.9)");
//!
//! let refused = goal::read("find cap A", &domain, &lexicon).unwrap_err().to_string();
//! assert!(refused.contains("cup A"), "{refused}");
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

pub mod abilities;
pub mod actions;
pub mod answer;
pub mod asked;
pub mod check;
pub mod config;
#[doc(hidden)]
pub mod declared;
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
#[doc(hidden)]
pub mod walls;
pub mod words;
pub mod world;

pub use descry_planner;
