//! The record of a run, plan by plan.

use descry_domains::note::Note;
use descry_memory::{Document, Query, Record, RecordId};

use super::standings::{Standing, Standings};
use super::states::{Difference, States};
use crate::agent::TOO_LATE;
use crate::exit::CommandError;
use crate::report::Event;
use crate::run::Resumed;
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
    /// After how much the planner's search was ended without a proof; none: it ended by itself.
    pub cut: Option<String>,
    /// No plan would have done in the time that was left.
    pub is_late: bool,
    /// The greatest of the numbers of which one would do, and none does.
    pub most: Option<(String, f64)>,
    /// Its steps, as they were said.
    pub steps: Vec<String>,
    /// What it takes to its end, seconds.
    pub makespan_s: f64,
    /// How things stood when it was made; none: the record does not say.
    pub before: Option<Standing>,
    /// What it was weighed against; none: the record does not say.
    pub weighed: Option<Weighed>,
    /// What happened from then on.
    pub deeds: Vec<Deed>,
}

/// Something that happened.
#[derive(Debug)]
pub enum Deed {
    /// A step began.
    Began(String),
    /// How things stand by then.
    Stands(Standing),
    /// What came of a step.
    Ended(String, String),
    /// A step failed.
    Failed {
        /// The call.
        call: String,
        /// Why.
        because: String,
        /// What was concluded.
        therefore: String,
        /// What is taken to be so from then on, and what no longer; none: the record does not say.
        changed: Option<Difference>,
    },
    /// The run was cut off, and gone on with.
    Resumed,
    /// Something was learned.
    Noted(Note),
}

/// The plans of a run, which was gone on with so often, and what of them is lost.
///
/// # Errors
/// [`CommandError::Broken`] if the record cannot be read.
pub fn of(
    record: &Record,
    states: &States,
    resumed: &[Resumed],
) -> Result<(Vec<Chapter>, Vec<String>), CommandError> {
    let found = record.find_whole(&Query::of_kind("event")).map_err(CommandError::broken)?;
    let (documents, faults) = found;
    let standings = Standings::of(record, states)?;
    let mut lost: Vec<String> = faults.iter().map(ToString::to_string).collect();
    let first_ns = documents.first().map_or(0, |d| d.stamp_ns);
    let mut chapters: Vec<Chapter> = Vec::new();
    // What was cut off before there was a plan is told with the first.
    let mut cuts = resumed.iter().filter(|cut| cut.after.is_none()).count();
    for document in &documents {
        let at_s = (document.stamp_ns - first_ns) as f64 * 1e-9;
        let Ok(event) = serde_json::from_value::<Event>(document.body.clone()) else { continue };
        let deed = match event {
            Event::Planned { round, because, steps, makespan_s, .. } => {
                let weighed = weighed(record, document, &mut lost);
                let cut = because.split_once("; the search ended after ").map(|(_, cut)| cut.to_string());
                let is_late = because.ends_with(TOO_LATE);
                let because = because.trim_end_matches(TOO_LATE).split("; the search ended after ").next();
                let because = because.unwrap_or_default().to_string();
                let most = one_of(&because).and_then(|begins| states.most(document.id, &begins));
                let before = standings.at(document);
                if let (Some(chapter), Some(standing)) = (chapters.last_mut(), &before) {
                    chapter.deeds.push(Deed::Stands(standing.clone()));
                }
                let made = Chapter {
                    round,
                    at_s,
                    because,
                    cut,
                    is_late,
                    most,
                    steps,
                    makespan_s,
                    before,
                    weighed,
                    deeds: Vec::new(),
                };
                chapters.push(made);
                None
            }
            Event::Goal { .. } => None,
            Event::Kept { .. } => standings.at(document).map(Deed::Stands),
            Event::Acting { call, .. } => Some(Deed::Began(call)),
            Event::Acted { call, outcome } => Some(Deed::Ended(call, outcome)),
            Event::Failed { call, because, therefore } => {
                Some(Deed::Failed { call, because, therefore, changed: states.across(document.id) })
            }
            Event::Noted(note) => Some(Deed::Noted(note)),
        };
        cuts += resumed.iter().filter(|cut| cut.after.map(RecordId) == Some(document.id)).count();
        if let Some(chapter) = chapters.last_mut() {
            chapter.deeds.extend(deed);
            chapter.deeds.extend((0..std::mem::take(&mut cuts)).map(|_| Deed::Resumed));
        }
    }
    if let Some(chapter) = chapters.last_mut() {
        chapter.deeds.extend(standings.last().map(Deed::Stands));
    }
    Ok((chapters, lost))
}

impl Chapter {
    /// Its steps as they are written in a plan, without their times: those that were carried out to their end, and the others.
    pub fn steps_done(&self) -> (Vec<&str>, Vec<&str>) {
        let mut done: Vec<&str> = Vec::new();
        for deed in &self.deeds {
            match deed {
                Deed::Began(call) => done.push(call),
                Deed::Failed { call, .. } => done.retain(|began| began != call),
                _ => {}
            }
        }
        let mut began = done.clone();
        let is_open = |step: &&str| match began.iter().position(|call| call == step) {
            Some(at) => {
                began.remove(at);
                false
            }
            None => true,
        };
        let open = self.steps.iter().map(|step| bare(step)).filter(is_open).collect();
        (done, open)
    }

    /// Whether a step of an action counts for more seconds in its plan than it takes.
    pub fn counts_more(&self, action: &str, takes_s: f64) -> bool {
        let counted_s = |step: &String| {
            let called = bare(step).trim_start_matches('(').split(' ').next()?;
            let (_, counted) = step.rsplit_once('[')?;
            let counted_s: f64 = counted.trim_end_matches(']').parse().ok()?;
            (called == action).then_some(counted_s)
        };
        self.steps.iter().filter_map(counted_s).any(|counted_s| counted_s > takes_s + 0.05)
    }

    /// How things stood after each of its steps.
    pub fn stood(&self) -> impl Iterator<Item = &Standing> {
        self.deeds.iter().filter_map(|deed| if let Deed::Stands(now) = deed { Some(now) } else { None })
    }

    /// What failed in it.
    pub fn failures(&self) -> impl Iterator<Item = (&str, &str)> {
        self.deeds.iter().filter_map(|deed| match deed {
            Deed::Failed { call, because, .. } => Some((call.as_str(), because.as_str())),
            _ => None,
        })
    }
}

/// A step as it is written in a plan, without its times.
pub fn bare(step: &str) -> &str {
    match (step.find('('), step.find(')')) {
        (Some(from), Some(to)) if from < to => &step[from..=to],
        _ => step,
    }
}

/// How the numbers begin of which one would do: `(f a ` of `(exists (?x) (>= (f a ?x) …`.
fn one_of(because: &str) -> Option<String> {
    let (variable, rest) = because.split_once("(exists (?")?.1.split_once(')')?;
    let number = rest.trim_start().strip_prefix("(>= ")?.split_once(')')?.0;
    number.strip_suffix(&format!("?{variable}")).map(str::to_string)
}

/// What a plan was weighed against, if its document has it.
fn weighed(record: &Record, document: &Document, lost: &mut Vec<String>) -> Option<Weighed> {
    document.blobs.iter().find(|blob| blob.name == weigh::BLOB)?;
    let read = record.store().blob(document.id, weigh::BLOB).map_err(|e| e.to_string());
    let read = read.and_then(|data| serde_json::from_slice(&data).map_err(|e| e.to_string()));
    read.map_err(|e| lost.push(format!("what plan {} was weighed against: {e}", document.body["round"]))).ok()
}
