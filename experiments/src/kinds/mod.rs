//! Kinds of experiments: one file each, and their list.

mod faults;
mod figure_4;
mod tasks;
#[doc(hidden)]
pub mod trial;
mod where_to_look;

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use descry_agent::stop::Stop;
use descry_domains::load::{Domain, program_texts};
use descry_robots::input::{self, Objection, Step};
use serde::Deserialize;

use super::page::Section;
use super::{ExperimentError, Job, Numbered, Outcome, Row, Source};
use descry_agent::body::program;

/// Runtime on which the run of a job goes on.
fn runtime() -> Result<tokio::runtime::Runtime, String> {
    let runtime = tokio::runtime::Builder::new_current_thread().enable_all().build();
    runtime.map_err(|e| format!("the runtime could not be started: {e}"))
}

/// A kind of experiment, bound to what a file says of it.
pub trait Kind: Send + Sync {
    /// Keys that every experiment file has.
    fn head(&self) -> &Head;

    /// Other texts that the results depend on, by name: scenes, domain, programs. They count in the experiment's hash.
    fn inputs(&self) -> Vec<(String, String)>;

    /// Every combination, in an order that is always the same.
    fn jobs(&self) -> Vec<Job>;

    /// Does the job of this number. The outcome depends on nothing but the file and the number. `scratch` is a path that
    /// nothing else uses; what is there afterwards is removed.
    ///
    /// # Errors
    /// A text for people; it becomes a row.
    fn run(&self, number: usize, scratch: &Path, stop: &Stop) -> Result<Outcome, String>;

    /// Summarises finished jobs, all or those done so far, in the order of [`Kind::jobs`].
    fn summarise(&self, finished: &[Numbered<'_>]) -> Summary;
}

/// Keys that every experiment file has.
#[derive(Debug, Clone, Deserialize)]
pub struct Head {
    /// The experiment's name.
    pub name: String,
    /// One of the kinds.
    pub kind: String,
    /// Purpose of the experiment, in a line.
    #[serde(default)]
    pub about: String,
}

/// What runs in a domain depend on, by name.
pub fn inputs_of<'b>(
    domain: &Domain,
    scenes: String,
    bodies: impl Iterator<Item = &'b OtherBody>,
) -> Vec<(String, String)> {
    let Domain { pddl, config, objects, shapes, .. } = domain;
    let read = format!("{}{config:?}{objects:?}{shapes:?}", pddl.text);
    let programs = domain.program_texts().into_iter().chain(bodies.flat_map(OtherBody::texts));
    let programs = programs.map(|(path, text)| (path.display().to_string(), text));
    [("scene".into(), scenes), ("domain".into(), read)].into_iter().chain(programs).collect()
}

/// A body other than our simulator, as an experiment file names it: `program:COMMAND`. Its runs differ by seed and are held against
/// the truth, so the command takes both.
#[derive(Debug, Clone, Deserialize)]
#[serde(try_from = "String")]
pub struct OtherBody(String);

impl OtherBody {
    /// The program's command line, with places for seed and truth.
    fn command(&self) -> &str {
        &self.0
    }

    /// Texts that the robot's program is made of, by path.
    fn texts(&self) -> BTreeMap<PathBuf, String> {
        program_texts(self.0.split_whitespace(), Path::new("."))
    }
}

impl TryFrom<String> for OtherBody {
    type Error = String;

    fn try_from(text: String) -> Result<Self, String> {
        let command = text.strip_prefix("program:").ok_or("expected program:COMMAND")?;
        match [program::SEED, program::TRUTH].into_iter().find(|place| !command.contains(place)) {
            Some(place) => {
                Err(format!("the command has no {place}, such as --seed {{seed}} --truth {{truth}}"))
            }
            None => Ok(Self(command.to_string())),
        }
    }
}

/// Summary of all jobs.
#[derive(Debug, Clone, Default)]
pub struct Summary {
    /// For scripts: `summary.json`.
    pub values: Row,
    /// For people: tables and plots in the order in which they are read.
    pub sections: Vec<Section>,
}

/// Reads what a file says of its kind.
type Reader = fn(&Source) -> Result<Box<dyn Kind>, ExperimentError>;

/// Every kind by its name in experiment files.
pub const ALL: &[(&str, Reader)] = &[
    ("figure-4", figure_4::read),
    ("where-to-look", where_to_look::read),
    ("faults", faults::read),
    ("tasks", tasks::read),
];

/// The kind of an experiment file, with everything that the file says checked.
///
/// # Errors
/// [`ExperimentError::Input`] points at the place.
pub fn read(source: &Source) -> Result<Box<dyn Kind>, ExperimentError> {
    let head: Head = parse(source)?;
    let known: Vec<&str> = ALL.iter().map(|(name, _)| *name).collect();
    match ALL.iter().find(|(name, _)| *name == head.kind) {
        Some((_, reader)) => reader(source),
        None => Err(refuse(
            source,
            "kind",
            format!("no kind of experiment is called \"{}\"", head.kind),
            format!("one of: {}", known.join(", ")),
        )),
    }
}

/// Reads an experiment file as TOML.
fn parse<T: serde::de::DeserializeOwned>(source: &Source) -> Result<T, ExperimentError> {
    input::parse_toml(&source.path.display().to_string(), &source.text)
        .map_err(|e| ExperimentError::Input(e.to_string()))
}

/// A value that the format allows and the meaning does not, drawn under its line.
fn refuse(
    source: &Source,
    key: &'static str,
    problem: impl Into<String>,
    mend: impl Into<String>,
) -> ExperimentError {
    let objection = Objection { path: vec![Step::Key(key)], problem: problem.into(), mend: mend.into() };
    ExperimentError::Input(
        input::draw(&source.path.display().to_string(), &source.text, objection).to_string(),
    )
}
