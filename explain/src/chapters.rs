//! Record of a run, divided by its plans.

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

/// Plan with the events until the next one.
#[derive(Debug, Default)]
pub struct Chapter {
    /// Number of the plan, from 1.
    pub round: usize,
    /// Time at which the plan was made, seconds since the run began.
    pub at_s: f64,
    /// Reason why the plan was made; `None` in records of earlier versions, which hold only a
    /// sentence.
    pub reason: Option<Reason>,
    /// Reason why the plan was made, as a sentence.
    pub because: String,
    /// Greatest of the numbers of which the goal requires at least one to be large enough, with its
    /// name first; `None` if the previous plan did not end because all are too small.
    pub most: Option<(String, f64)>,
    /// Steps of the plan.
    pub steps: Vec<Step>,
    /// Calls of the steps.
    pub calls: Vec<Call>,
    /// Makespan of the plan, seconds.
    pub makespan_s: f64,
    /// State of the run when the plan was made; `None` if it is not in the record.
    pub before: Option<Standing>,
    /// Comparison of the plan with alternatives; `None` if it is not in the record.
    pub weighed: Option<Weighed>,
    /// Events from this plan until the next one, in order.
    pub deeds: Vec<Deed>,
}

/// Event while a plan is executed.
#[derive(Debug)]
pub enum Deed {
    /// A step began.
    Began(Call),
    /// State of the run after a step, or at the next plan or the end.
    Stands(Standing),
    /// A step had an outcome, given as a sentence.
    Ended(Call, String),
    /// A step failed.
    Failed {
        /// Call of the step.
        call: Call,
        /// Reason for the failure, as a sentence.
        because: String,
        /// Violated invariant (`over all` condition) in PDDL; `None` if the failure is another.
        unkept: Option<String>,
        /// Conclusion from the failure, as a sentence.
        therefore: String,
        /// Conclusion as a value; `None` in records of earlier versions.
        lesson: Option<Lesson>,
        /// Facts and numbers that changed with the failure; `None` if they are not in the record.
        changed: Option<Difference>,
    },
    /// The run was interrupted and resumed.
    Resumed,
    /// The world model noted something: a perception, a change of belief or the like.
    Noted(Note),
}

/// Reads the plans of a run with their events, and a message for each lost part. `resumed` lists
/// the interruptions.
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
    /// Calls of the steps that began and did not fail, and calls of the plan's other steps.
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

    /// True if the plan has a step of this action with a duration above `takes_s`, seconds.
    pub fn counts_more(&self, action: &str, takes_s: f64) -> bool {
        self.steps.iter().any(|step| step.action == action && step.duration_s > takes_s + 0.05)
    }

    /// States of the run after the steps of this plan.
    pub fn stood(&self) -> impl Iterator<Item = &Standing> {
        self.deeds.iter().filter_map(|deed| if let Deed::Stands(now) = deed { Some(now) } else { None })
    }

    /// Failed steps, each with the reason as a sentence.
    pub fn failures(&self, saying: &Saying) -> Vec<(&Call, String)> {
        let mut all = Vec::new();
        for deed in &self.deeds {
            if let Deed::Failed { call, because, unkept, .. } = deed {
                all.push((call, failed(because, unkept.as_deref(), saying)));
            }
        }
        all
    }

    /// Obstacle that ended the previous plan; `None` if it ended for another reason.
    pub fn broken(&self) -> Option<&Break> {
        match &self.reason.as_ref()?.trigger {
            Trigger::Broken(broken) => Some(broken),
            _ => None,
        }
    }

    /// True if the plan was made only because a step's duration had changed.
    pub fn is_reckoned(&self) -> bool {
        self.broken().is_some_and(|broken| broken.reckoned().is_some())
    }

    /// Number of states at which the planner's search was ended without a proof, as text; `None` if
    /// it ended by itself.
    pub fn cut(&self) -> Option<String> {
        self.reason.as_ref()?.search_ended_after.map(|states| format!("{states} states"))
    }

    /// True if no plan reaches the goal in the time left.
    pub fn is_late(&self) -> bool {
        self.reason.as_ref().is_some_and(|reason| reason.is_late)
    }
}

/// Beginning that all numbers under an existential comparison share: `(f a ` for `(exists (?x) (>=
/// (f a ?x) …`. `None` if the condition has no such comparison.
fn one_of(condition: &str) -> Option<String> {
    let is_open = |compared: &Compared<'_>| {
        let last = compared.of.last();
        !compared.less && !compared.of_all && last.is_some_and(|last| last.starts_with('?'))
    };
    let Compared { word, of, .. } = compared::all(condition).find(is_open)?;
    Some(format!("({} ", [&[word], &of[..of.len() - 1]].concat().join(" ")))
}

/// Comparison of a plan with alternatives from the plan's document; `None` if it has none. Failures
/// to read it are added to `lost`.
fn weighed(record: &Record, document: &Document, lost: &mut Vec<String>) -> Option<Weighed> {
    document.blobs.iter().find(|blob| blob.name == weigh::BLOB)?;
    let read = record.store().blob(document.id, weigh::BLOB).map_err(|e| e.to_string());
    let read = read.and_then(|data| serde_json::from_slice(&data).map_err(|e| e.to_string()));
    read.map_err(|e| lost.push(format!("what plan {} was weighed against: {e}", document.body["round"]))).ok()
}
