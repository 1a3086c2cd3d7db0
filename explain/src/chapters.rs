//! The record of a run, plan by plan.

use descry_agent::written::call_of;
use descry_domains::lesson::Lesson;
use descry_domains::note::Note;
use descry_domains::saying::Saying;
use descry_memory::{Document, Query, Record, RecordId};

use descry_planner::Step;
use descry_skills::Call;

use super::standings::{Standing, Standings};
use super::states::{Difference, States};
use descry_agent::compared::{self, Compared};
use descry_agent::exit::CommandError;
use descry_agent::reason::{Break, Reason, Trigger};
use descry_agent::report::{Event, failed};
use descry_agent::run::Resumed;
use descry_agent::weigh::{self, Weighed};

/// A plan and what came of it.
#[derive(Debug, Default)]
pub struct Chapter {
    /// Its number.
    pub round: usize,
    /// Seconds since the run began.
    pub at_s: f64,
    /// Why the plan before no longer did; none: a record of an earlier version has a sentence alone.
    pub reason: Option<Reason>,
    /// The same in a sentence.
    pub because: String,
    /// The greatest of the numbers of which one would do, and none does.
    pub most: Option<(String, f64)>,
    /// Its steps.
    pub steps: Vec<Step>,
    /// The calls of its steps.
    pub calls: Vec<Call>,
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
    Began(Call),
    /// How things stand by then.
    Stands(Standing),
    /// What came of a step.
    Ended(Call, String),
    /// A step failed.
    Failed {
        /// The call.
        call: Call,
        /// Why, in a sentence.
        because: String,
        /// The condition in PDDL that should have held until the end, if that is what failed.
        unkept: Option<String>,
        /// What was concluded, in a sentence.
        therefore: String,
        /// The same as a value; none of a record of an earlier version.
        lesson: Option<Lesson>,
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
            Event::Planned { round, because, reason, steps, makespan_s, .. } => {
                let weighed = weighed(record, document, &mut lost);
                let missed = reason.as_ref().and_then(|reason| match &reason.trigger {
                    Trigger::Broken(broken) => broken.missed_goal(),
                    _ => None,
                });
                let begins = missed.and_then(|unmet| one_of(&unmet.condition));
                let most = begins.and_then(|begins| states.most(document.id, &begins));
                let before = standings.at(document);
                if let (Some(chapter), Some(standing)) = (chapters.last_mut(), &before) {
                    chapter.deeds.push(Deed::Stands(standing.clone()));
                }
                let made = Chapter {
                    round,
                    at_s,
                    because,
                    reason,
                    most,
                    calls: steps.iter().map(call_of).collect(),
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
            Event::Failed { call, because, unkept, therefore, lesson } => {
                let changed = states.across(document.id);
                Some(Deed::Failed { call, because, unkept, therefore, lesson, changed })
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
    /// The calls that were carried out to their end, and the others.
    pub fn steps_done(&self) -> (Vec<&Call>, Vec<&Call>) {
        let mut done: Vec<&Call> = Vec::new();
        for deed in &self.deeds {
            match deed {
                Deed::Began(call) => done.push(call),
                Deed::Failed { call, .. } => done.retain(|began| *began != call),
                _ => {}
            }
        }
        let mut began = done.clone();
        let is_open = |step: &&Call| match began.iter().position(|call| call == step) {
            Some(at) => {
                began.remove(at);
                false
            }
            None => true,
        };
        let open = self.calls.iter().filter(is_open).collect();
        (done, open)
    }

    /// Whether a step of an action counts for more seconds in its plan than it takes.
    pub fn counts_more(&self, action: &str, takes_s: f64) -> bool {
        self.steps.iter().any(|step| step.action == action && step.duration_s > takes_s + 0.05)
    }

    /// How things stood after each of its steps.
    pub fn stood(&self) -> impl Iterator<Item = &Standing> {
        self.deeds.iter().filter_map(|deed| if let Deed::Stands(now) = deed { Some(now) } else { None })
    }

    /// The steps that failed, each with why.
    pub fn failures(&self, saying: &Saying) -> Vec<(&Call, String)> {
        let mut all = Vec::new();
        for deed in &self.deeds {
            if let Deed::Failed { call, because, unkept, .. } = deed {
                all.push((call, failed(because, unkept.as_deref(), saying)));
            }
        }
        all
    }

    /// What no longer worked of the plan before.
    pub fn broken(&self) -> Option<&Break> {
        match &self.reason.as_ref()?.trigger {
            Trigger::Broken(broken) => Some(broken),
            _ => None,
        }
    }

    /// Whether the plan before would have done, but counted for more or fewer seconds.
    pub fn is_reckoned(&self) -> bool {
        self.broken().is_some_and(|broken| broken.reckoned().is_some())
    }

    /// States after which the planner's search was ended without a proof.
    pub fn cut(&self) -> Option<String> {
        self.reason.as_ref()?.search_ended_after.map(|states| format!("{states} states"))
    }

    /// Whether no plan would have done in the time that was left.
    pub fn is_late(&self) -> bool {
        self.reason.as_ref().is_some_and(|reason| reason.is_late)
    }
}

/// How the numbers begin of which one would do: `(f a ` of `(exists (?x) (>= (f a ?x) …`.
fn one_of(condition: &str) -> Option<String> {
    let is_open = |compared: &Compared<'_>| {
        let last = compared.of.last();
        !compared.less && !compared.of_all && last.is_some_and(|last| last.starts_with('?'))
    };
    let Compared { word, of, .. } = compared::all(condition).find(is_open)?;
    Some(format!("({} ", [&[word], &of[..of.len() - 1]].concat().join(" ")))
}

/// What a plan was weighed against, if its document has it.
fn weighed(record: &Record, document: &Document, lost: &mut Vec<String>) -> Option<Weighed> {
    document.blobs.iter().find(|blob| blob.name == weigh::BLOB)?;
    let read = record.store().blob(document.id, weigh::BLOB).map_err(|e| e.to_string());
    let read = read.and_then(|data| serde_json::from_slice(&data).map_err(|e| e.to_string()));
    read.map_err(|e| lost.push(format!("what plan {} was weighed against: {e}", document.body["round"]))).ok()
}
