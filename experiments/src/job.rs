//! Jobs of an experiment, and their outcomes.

use serde::{Deserialize, Serialize};
use serde_json::{Map, Value};

/// Named values, in display order.
pub type Row = Map<String, Value>;

/// Job: one combination of the experiment's variables.
#[derive(Debug, Clone, PartialEq)]
pub struct Job {
    /// ID, unique in the experiment, the same on every machine: `scene=0012 poses=8 policy=plan`.
    pub id: String,
    /// Factors of the experiment, with their values in this job.
    pub factors: Row,
}

impl Job {
    /// A job from its factors, which make up its ID.
    pub fn new<const N: usize>(factors: [(&str, Value); N]) -> Self {
        let shown = |value: &Value| value.as_str().map_or_else(|| value.to_string(), str::to_string);
        let id: Vec<String> =
            factors.iter().map(|(name, value)| format!("{name}={}", shown(value))).collect();
        Self {
            id: id.join(" "),
            factors: factors.into_iter().map(|(name, value)| (name.to_string(), value)).collect(),
        }
    }

    /// Adds the seed of the run as a column; it follows from the factors and is no part of the ID.
    pub fn with_seed(mut self, seed: u64) -> Self {
        self.factors.insert("seed".into(), seed.into());
        self
    }
}

/// Result of a job: rows of measurements, the same on every machine, and wall-clock times.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Outcome {
    /// Measurements; usually one row.
    pub rows: Vec<Row>,
    /// Wall-clock times, which differ between runs and are reported separately.
    pub clock: Row,
}

/// A line of the journal: a finished job.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Finished {
    /// ID of the job.
    pub job: String,
    /// Rows of measurements, each with the factors of the job.
    pub rows: Vec<Row>,
    /// Wall-clock times.
    #[serde(default)]
    pub clock: Row,
    /// Error, if there are no measurements.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub error: Option<String>,
}

impl Finished {
    pub(crate) fn new(job: &Job, outcome: Result<Outcome, String>) -> Self {
        let with_factors = |row: Row| job.factors.clone().into_iter().chain(row).collect();
        let (outcome, error) = match outcome {
            Ok(outcome) => (outcome, None),
            Err(error) => (Outcome { rows: vec![Row::new()], clock: Row::new() }, Some(error)),
        };
        let rows = outcome.rows.into_iter().map(with_factors).collect();
        Self { job: job.id.clone(), rows, clock: outcome.clock, error }
    }
}

/// Finished job, with its index among all jobs.
pub type Numbered<'a> = (usize, &'a Finished);
