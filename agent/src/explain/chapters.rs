//! The record of a run, plan by plan.

use descry_domains::note::Note;
use descry_memory::{Document, Query, Record};

use crate::exit::CommandError;
use crate::report::Event;
use crate::weigh::{self, Weighed};

/// A plan and what came of it.
#[derive(Debug, Default)]
pub struct Chapter {
    /// Its number.
    pub round: usize,
    /// Seconds since the run began.
    pub at_s: f64,
    /// Why the plan before no longer did, as it was said.
    pub because: String,
    /// Its steps, as they were said.
    pub steps: Vec<String>,
    /// What it was weighed against; none: the record does not say.
    pub weighed: Option<Weighed>,
    /// What happened from then on.
    pub deeds: Vec<Deed>,
}

/// Something that happened.
#[derive(Debug)]
pub enum Deed {
    /// A step began.
    Began,
    /// What came of a step.
    Ended(String, String),
    /// A step failed, why, and what was concluded.
    Failed(String, String, String),
    /// Something was learned.
    Noted(Note),
}

/// The plans of a run, and what of them is lost.
///
/// # Errors
/// [`CommandError::Broken`] if the record cannot be read.
pub fn of(record: &Record) -> Result<(Vec<Chapter>, Vec<String>), CommandError> {
    let found = record.find_whole(&Query::of_kind("event")).map_err(CommandError::broken)?;
    let (documents, faults) = found;
    let mut lost: Vec<String> = faults.iter().map(ToString::to_string).collect();
    let first_ns = documents.first().map_or(0, |d| d.stamp_ns);
    let mut chapters: Vec<Chapter> = Vec::new();
    for document in &documents {
        let at_s = (document.stamp_ns - first_ns) as f64 * 1e-9;
        let Ok(event) = serde_json::from_value::<Event>(document.body.clone()) else { continue };
        let deed = match event {
            Event::Planned { round, because, steps, .. } => {
                let weighed = weighed(record, document, &mut lost);
                chapters.push(Chapter { round, at_s, because, steps, weighed, deeds: Vec::new() });
                continue;
            }
            Event::Goal { .. } | Event::Kept { .. } => continue,
            Event::Acting { .. } => Deed::Began,
            Event::Acted { call, outcome } => Deed::Ended(call, outcome),
            Event::Failed { call, because, therefore } => Deed::Failed(call, because, therefore),
            Event::Noted(note) => Deed::Noted(note),
        };
        if let Some(chapter) = chapters.last_mut() {
            chapter.deeds.push(deed);
        }
    }
    Ok((chapters, lost))
}

/// What a plan was weighed against, if its document has it.
fn weighed(record: &Record, document: &Document, lost: &mut Vec<String>) -> Option<Weighed> {
    document.blobs.iter().find(|blob| blob.name == weigh::BLOB)?;
    let read = record.store().blob(document.id, weigh::BLOB).map_err(|e| e.to_string());
    let read = read.and_then(|data| serde_json::from_slice(&data).map_err(|e| e.to_string()));
    read.map_err(|e| lost.push(format!("what plan {} was weighed against: {e}", document.body["round"]))).ok()
}
