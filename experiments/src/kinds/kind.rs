//! A kind of experiment: its jobs, and their summary.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use descry_agent::body::program;
use descry_agent::stop::Stop;
use descry_domains::load::{Domain, program_texts};
use descry_robots::input::{self, Objection, Step};
use serde::Deserialize;

use crate::error::ExperimentError;
use crate::job::{Job, Numbered, Outcome, Row};
use crate::page::Section;
use crate::source::Source;

/// Asynchronous runtime for the run of a job.
pub(crate) fn runtime() -> Result<tokio::runtime::Runtime, String> {
    let runtime = tokio::runtime::Builder::new_current_thread().enable_all().build();
    runtime.map_err(|e| format!("the runtime could not be started: {e}"))
}

/// Kind of experiment, with the settings from an experiment file.
pub trait Kind: Send + Sync {
    /// Keys common to all experiment files.
    fn head(&self) -> &Head;

    /// Other texts that the results depend on, by name: scenes, domain, programs. They are part of the
    /// experiment's hash.
    fn inputs(&self) -> Vec<(String, String)>;

    /// All jobs, in a fixed order.
    fn jobs(&self) -> Vec<Job>;

    /// Runs a job. The outcome depends on the file and the number alone. `scratch` is an exclusive path,
    /// removed afterwards.
    ///
    /// # Errors
    /// Reason for people why the job failed; the job gets a row with this reason.
    fn run(&self, number: usize, scratch: &Path, stop: &Stop) -> Result<Outcome, String>;

    /// Summarises finished jobs, all or those so far, in the order of [`Kind::jobs`].
    fn summarise(&self, finished: &[Numbered<'_>]) -> Summary;
}

/// Keys common to all experiment files.
#[derive(Debug, Clone, Deserialize)]
pub struct Head {
    /// The experiment's name.
    pub name: String,
    /// Name of the kind of experiment.
    pub kind: String,
    /// Purpose of the experiment, in a line.
    #[serde(default)]
    pub about: String,
}

/// Texts that runs in a domain depend on, by name.
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

/// A body other than the simulator in an experiment file: `program:COMMAND`. Its runs differ by seed and are
/// compared with the truth, so the command takes both.
#[derive(Debug, Clone, Deserialize)]
#[serde(try_from = "String")]
pub struct OtherBody(String);

impl OtherBody {
    /// The program's command line, with placeholders for seed and truth.
    pub(crate) fn command(&self) -> &str {
        &self.0
    }

    /// Texts of the files that the robot's command line names, by path.
    pub(crate) fn texts(&self) -> BTreeMap<PathBuf, String> {
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

/// Summary of finished jobs.
#[derive(Debug, Clone, Default)]
pub struct Summary {
    /// Values for scripts: `summary.json`.
    pub values: Row,
    /// Tables and plots for people, in reading order.
    pub sections: Vec<Section>,
}

/// Parses an experiment file as TOML.
pub(crate) fn parse<T: serde::de::DeserializeOwned>(source: &Source) -> Result<T, ExperimentError> {
    input::parse_toml(&source.label(), &source.text).map_err(|e| ExperimentError::Input(e.to_string()))
}

/// The error for an invalid value, drawn under its line.
pub(crate) fn refuse(
    source: &Source,
    key: &'static str,
    problem: impl Into<String>,
    mend: impl Into<String>,
) -> ExperimentError {
    let objection = Objection { path: vec![Step::Key(key)], problem: problem.into(), mend: mend.into() };
    ExperimentError::Input(input::draw(&source.label(), &source.text, objection).to_string())
}
