//! The continual loop, and runs: begun, kept, resumed, replayed, explained. The command line is a crate above.
//!
//! A run on the simulated robot from beginning to end; the example `own_body` of this crate does the same with a body of its own.
//!
//! ```
//! use descry_agent::keeping::Keeping;
//! use descry_agent::run::{self, Folder, Settings, Task, Watcher};
//! use descry_agent::{body, stop::Stop};
//! use descry_domains::abilities::searching::policies;
//! use descry_domains::load::Domain;
//!
//! let (said, folder) = ("find cup A", tempfile::tempdir()?);
//! let domain = Domain::load("tabletop")?;
//! let body = body::open("sim", None, 3, &domain)?;
//! let goal = run::understood(said, &domain, &*body.robot, None)?;
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
//! # let runtime = tokio::runtime::Builder::new_current_thread().enable_all().build()?;
//! # let pursued = async {
//! let report = run::pursue(task, &body, &folder, &settings, chooser, watcher).await?;
//! # Ok::<_, descry_agent::exit::CommandError>(report)
//! # };
//! # let report = runtime.block_on(pursued)?;
//! assert_eq!(report.verdict, descry_domains::answer::Verdict::Achieved, "{said:?}");
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

pub mod agent;
pub mod basis;
pub mod body;
#[doc(hidden)]
pub mod compared;
pub mod exit;
pub mod explain;
pub mod keeping;
pub mod replay;
pub mod report;
pub mod run;
pub mod saying;
pub mod shell;
pub mod standing;
pub mod stop;
pub mod template;
pub mod weigh;
pub mod why_not;
