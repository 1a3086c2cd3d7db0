//! State of a run at each plan and observation: remaining doubts, and the belief about objects.

use std::collections::BTreeMap;

use descry_agent::exit::CommandError;
use descry_agent::standing::{self, InDoubt, Of};
use descry_domains::english::plural;
use descry_domains::symbol::symbol;
use descry_memory::belief::{Belief, Track};
use descry_memory::{Document, Query, Record, RecordId};

use super::states::States;

/// State of a run at one moment.
#[derive(Debug, Clone, Default)]
pub struct Standing {
    /// Time of the state on the body's clock, nanoseconds.
    pub stamp_ns: i64,
    /// Remaining doubts about the goal.
    pub doubts: Vec<InDoubt>,
    /// Belief about objects.
    pub belief: Belief,
    /// Values of the numeric fluents, by name in PDDL.
    pub numbers: BTreeMap<String, f64>,
}

impl Standing {
    /// Doubt with the same subject as `other`; `None` if it is gone.
    pub fn same(&self, other: &InDoubt) -> Option<&InDoubt> {
        self.doubts.iter().find(|doubt| doubt.of == other.of && doubt.about == other.about)
    }

    /// Objects in the rooms that a doubt is about.
    pub fn asked_about<'a>(&'a self, doubt: &'a InDoubt) -> impl Iterator<Item = &'a Track> {
        let is_there = |track: &Track| {
            let mut asked = doubt.seen.iter().filter(|seen| seen.share.is_some());
            doubt.within.is_empty() || asked.any(|seen| symbol(&seen.on) == track.on)
        };
        self.belief.tracks.iter().filter(move |track| is_there(track))
    }

    /// Object that most probably has this name or kind, with the probability; `None` without
    /// objects.
    pub fn best(&self, name: &str) -> Option<(&Track, f64)> {
        let all = self.belief.tracks.iter().map(|track| (track, track.probability_of(name)));
        all.max_by(|a, b| a.1.total_cmp(&b.1))
    }
}

/// States of a run, read from its record when needed.
pub struct Standings<'a> {
    record: &'a Record,
    states: &'a States,
    beliefs: Vec<(RecordId, Belief)>,
}

impl<'a> Standings<'a> {
    /// Prepares reading the states of a run, as far as the record has them.
    ///
    /// # Errors
    /// [`CommandError::Broken`] if the record cannot be read.
    pub fn of(record: &'a Record, states: &'a States) -> Result<Self, CommandError> {
        let (found, _) = record.find_whole(&Query::of_kind("belief")).map_err(CommandError::broken)?;
        let belief = |d: &Document| Some((d.id, serde_json::from_value(d.body.clone()).ok()?));
        Ok(Standings { record, states, beliefs: found.iter().filter_map(belief).collect() })
    }

    /// State of the run at an event; `None` if the record has none (earlier versions) or if it is
    /// damaged.
    pub fn at(&self, event: &Document) -> Option<Standing> {
        event.blobs.iter().find(|blob| blob.name == standing::BLOB)?;
        let data = self.record.store().blob(event.id, standing::BLOB).ok()?;
        Some(self.with(event, serde_json::from_slice(&data).ok()?))
    }

    /// State at the end of the run; `None` if the record has none.
    pub fn last(&self) -> Option<Standing> {
        let rests = self.record.newest(standing::RESTS).ok()??;
        let said: standing::Rests = serde_json::from_value(rests.body.clone()).ok()?;
        let is_said = said.in_doubt.iter().all(|doubt| doubt.sure.is_some());
        is_said.then(|| self.with(&rests, said.in_doubt))
    }

    fn with(&self, document: &Document, doubts: Vec<InDoubt>) -> Standing {
        let belief = self.beliefs.iter().rev().find(|(believed, _)| *believed < document.id);
        Standing {
            stamp_ns: document.stamp_ns,
            doubts,
            belief: belief.map(|(_, belief)| belief.clone()).unwrap_or_default(),
            numbers: self.states.numbers(document.id).cloned().unwrap_or_default(),
        }
    }
}

/// Description of what a doubt's confidence is about, such as `the certainty of where cup A
/// stands`.
pub fn certainty(doubt: &InDoubt) -> String {
    match doubt.of {
        Of::Thing => format!("the certainty of where {} stands", doubt.about),
        Of::Kind => format!("the certainty that all {}{} are found", plural(&doubt.about), doubt.within),
        Of::Surface => format!("the certainty of what stands on the {}", doubt.about),
    }
}
