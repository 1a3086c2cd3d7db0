//! From a goal and a state to a timed plan.
//!
//! ```
//! use descry_planner::{Attachments, Options, Outcome, Source, Task, plan, validate};
//!
//! let domain = "(define (domain rooms) (:requirements :typing :durative-actions)
//!   (:types room) (:predicates (at ?r - room) (joined ?a ?b - room))
//!   (:durative-action go :parameters (?a ?b - room) :duration (= ?duration 4)
//!     :condition (and (at start (at ?a)) (over all (joined ?a ?b)))
//!     :effect (and (at start (not (at ?a))) (at end (at ?b)))))";
//! let problem = "(define (problem two) (:domain rooms) (:objects hall study attic - room)
//!   (:init (at hall) (joined hall study) (joined study attic)) (:goal (at attic)))";
//! let task = Task::read(&Source::new("rooms.pddl", domain), &Source::new("two.pddl", problem))
//!     .map_err(|findings| findings.render(false))?;
//!
//! let calls = Attachments::new(); // what a domain asks in square brackets; this one asks nothing
//! let found = plan(&task, &calls, &Options::default(), &|| false, &mut |_| {})?;
//! let Outcome::Solved { plan, .. } = found else { panic!("{found:?}") };
//! assert_eq!(plan.steps.len(), 2);
//! assert!(plan.makespan_s().is_some_and(|seconds| seconds > 8.0));
//! assert!(validate(&task, &calls, &plan).valid);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

#[doc(hidden)]
pub mod attachment;
#[doc(hidden)]
pub mod calls;
#[doc(hidden)]
pub mod classical;
#[doc(hidden)]
pub mod clauses;
pub mod diagnostic;
mod explain;
pub mod ground;
mod grouped;
#[doc(hidden)]
pub mod heuristics;
#[doc(hidden)]
pub mod memory;
#[doc(hidden)]
pub mod model;
mod outcome;
pub mod pddl;
pub mod plan;
#[doc(hidden)]
pub mod search;
pub mod semantics;
mod solve;
pub mod state;
pub mod task;
#[doc(hidden)]
pub mod temporal;
#[doc(hidden)]
pub mod validate;

pub use attachment::{
    Answer, Attachment, AttachmentError, Attachments, Call, CallError, CallKind, CallStatistics, FactValue,
    Level, Read, Reading,
};
pub use diagnostic::{Diagnostic, Findings, Label, Severity, Source, Span};
pub use explain::Explanation;
pub use outcome::{Options, Outcome, PlanError, Statistics};
pub use pddl::check;
pub use plan::{EPSILON_S, Plan, Step, number_text};
pub use semantics::Semantics;
pub use solve::plan;
pub use state::State;
pub use task::Task;
pub use validate::{Broken, SEPARATION_S, Verdict, after, endless, monitor, validate};
