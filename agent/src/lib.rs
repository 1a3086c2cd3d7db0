//! The continual loop and the command line.
//!
//! A run on the simulated robot from beginning to end; the example `own_body` of this crate does the same with a body of its own.
//!
//! ```
//! use descry_agent::keeping::Keeping;
//! use descry_agent::run::{self, Folder, Settings, Task, Watcher};
//! use descry_agent::{body, stop::Stop};
//! use descry_domains::abilities::searching::policies;
//! use descry_domains::goal;
//! use descry_domains::lexicon::{Lexicon, Places};
//! use descry_domains::load::Domain;
//!
//! let (said, folder) = ("find cup A", tempfile::tempdir()?);
//! let domain = Domain::load("tabletop")?;
//! let body = body::open("sim", None, 3, &domain)?;
//! let goal = goal::read(said, &domain, &Lexicon::new(&domain, &Places::of_body(&*body.robot)))?;
//! let settings = Settings {
//!     robot: "sim".into(),
//!     scene: None,
//!     seed: 3,
//!     domain: "tabletop".into(),
//!     policy: policies::PLAN.into(),
//!     keeping: Keeping::default(),
//!     remember: None,
//! };
//! let folder = Folder::of_new_run(Some(&folder.path().join("run")), &goal)?;
//! let mut said = Vec::new();
//! let watcher = Watcher { stop: &Stop::default(), tell: &mut |event| said.push(event.to_string()) };
//! let chooser = policies::named(policies::PLAN, 3, None)?;
//! let task = Task { domain: &domain, goal: &goal, past: None };
//! let report = run::pursue(task, &body, &folder, &settings, chooser, watcher)?;
//! assert_eq!(report.verdict, descry_domains::answer::Verdict::Achieved, "{said:?}");
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

pub mod agent;
pub mod body;
pub mod commands;
pub mod exit;
pub mod experiment;
pub mod explain;
pub mod findings;
pub mod gantt;
pub mod keeping;
pub mod layout;
pub mod live;
pub mod lsp;
pub mod page;
pub mod picture;
pub mod report;
pub mod run;
pub mod saying;
pub mod stop;
pub mod weigh;
