//! Evidence for the verdict of a finished run, by record ID: the end of the run, the last belief,
//! and the views that the belief is based on.

use std::collections::{BTreeMap, BTreeSet};
use std::fmt;

use descry_memory::{Document, Query, Record, RecordId};
use serde::Serialize;

use crate::wording::{count, share};
use descry_agent::exit::CommandError;
use descry_agent::standing::{self, End, InDoubt, Of, Rests};

/// Evidence for a verdict.
#[derive(Debug, Clone, Default, PartialEq, Serialize)]
pub struct Basis {
    /// Record that says how the run ended, with the reason; `None` if missing.
    pub ended: Option<(RecordId, End)>,
    /// Doubts that remained at the end.
    pub in_doubt: Vec<InDoubt>,
    /// Record of the last belief; `None` if missing.
    pub belief: Option<RecordId>,
    /// Last recognised objects (percepts) of each surface.
    pub surfaces: Vec<Perceived>,
    /// Damaged or missing parts of the record, one message each.
    pub lost: Vec<String>,
}

/// Last percepts of one surface.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Perceived {
    /// Symbol of the surface.
    pub on: String,
    /// Record of the percepts.
    pub record: RecordId,
    /// Records of the views that were merged to obtain the percepts.
    pub looks: Vec<RecordId>,
}

/// Kinds of the records that count as evidence.
const KINDS: [&str; 4] = [standing::RESTS, "belief", "percepts", "cloud"];

/// Reads the evidence from the record of a run, as far as the record has it.
///
/// # Errors
/// [`CommandError::Broken`] if the record cannot be read.
pub fn of(record: &Record) -> Result<Basis, CommandError> {
    let (mut documents, mut lost) = (Vec::new(), Vec::new());
    for kind in KINDS {
        let (found, faults) = record.find_whole(&Query::of_kind(kind)).map_err(CommandError::broken)?;
        documents.extend(found);
        lost.extend(faults.iter().map(ToString::to_string));
    }
    let basis = Basis::among(&documents);
    lost.extend(basis.lost);
    Ok(Basis { lost, ..basis })
}

impl Basis {
    /// Evidence among undamaged documents of a record, oldest first.
    pub fn among(documents: &[Document]) -> Self {
        let mut lost = Vec::new();
        let [ends, beliefs, percepts, clouds] =
            KINDS.map(|kind| documents.iter().filter(|d| d.kind == kind).collect::<Vec<_>>());
        let end =
            ends.last().and_then(|d| Some((d.id, serde_json::from_value::<Rests>(d.body.clone()).ok()?)));
        if end.is_none() {
            lost.push("what the end of the run rests on is not in the record".into());
        }
        let mut surfaces: BTreeMap<String, Perceived> = BTreeMap::new();
        for perceived in percepts.into_iter().filter_map(perceived) {
            surfaces.insert(perceived.on.clone(), perceived);
        }
        let there: BTreeSet<RecordId> = clouds.iter().map(|d| d.id).collect();
        for perceived in surfaces.values() {
            let gone: Vec<String> =
                perceived.looks.iter().filter(|id| !there.contains(id)).map(ToString::to_string).collect();
            if !gone.is_empty() {
                let (on, gone) = (&perceived.on, gone.join(", "));
                lost.push(format!(
                    "what is believed of {on} rests on views that are not in the record: {gone}"
                ));
            }
        }
        // Where surfaces are not looked at, nothing is believed of what stands on them.
        if beliefs.is_empty() && !surfaces.is_empty() {
            lost.push("what was believed of the objects is not in the record".into());
        }
        let (ended, in_doubt) = match end {
            Some((id, rests)) => (Some((id, rests.ended)), rests.in_doubt),
            None => (None, Vec::new()),
        };
        let belief = beliefs.last().map(|d| d.id);
        Basis { ended, in_doubt, belief, surfaces: surfaces.into_values().collect(), lost }
    }
}

/// Surface, record ID and used views of a percepts document; `None` if the document is malformed.
fn perceived(document: &Document) -> Option<Perceived> {
    let body = &document.body;
    let views: Vec<RecordId> = serde_json::from_value(body["views"].clone()).ok()?;
    let is_used = |n: usize| body["fits"][n]["used"].as_bool().unwrap_or(true);
    let looks = views.into_iter().enumerate().filter(|(n, _)| is_used(*n)).map(|(_, id)| id).collect();
    Some(Perceived { on: body["on"].as_str()?.into(), record: document.id, looks })
}

impl fmt::Display for Basis {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let mut lines = Vec::new();
        let ended = self.ended.as_ref().map(|(id, ended)| {
            let ended = match ended {
                End::Reached => "the goal held",
                End::NoPlan => "no plan",
                End::Undecided => "undecided",
                End::Limit => "limit",
                End::Failed => "failed",
            };
            format!("end {id} ({ended})")
        });
        let belief = self.belief.map(|id| format!("belief {id}"));
        let records: Vec<String> = ended.into_iter().chain(belief).collect();
        if !records.is_empty() {
            lines.push(records.join(", "));
        }
        lines.extend(self.in_doubt.iter().map(chances));
        lines.extend(self.surfaces.iter().map(|seen| {
            let looks: Vec<String> = seen.looks.iter().map(ToString::to_string).collect();
            let (views, looks) = (count(looks.len(), "view"), looks.join(", "));
            format!("{}: percepts {} of {views}: {looks}", seen.on, seen.record)
        }));
        for (n, line) in lines.iter().enumerate() {
            let head = if n == 0 { "rests on" } else { "" };
            let end = if n + 1 < lines.len() { "\n" } else { "" };
            write!(f, "{head:10}{line}{end}")?;
        }
        Ok(())
    }
}

/// One line about a doubt: the confidence reached, the share seen of each surface, and the
/// probability that is left.
fn chances(doubt: &InDoubt) -> String {
    let about = match doubt.of {
        Of::Thing => doubt.about.clone(),
        Of::Kind => format!("all of {}{}", doubt.about, doubt.within),
        Of::Surface => format!("all on the {}", doubt.about),
    };
    let sure =
        doubt.sure.map_or("of an unknown certainty".into(), |sure| format!("sure with {}", share(sure)));
    let seen = doubt.seen.iter().filter(|seen| seen.places > 0).filter_map(|seen| {
        let places = count(seen.places, "place");
        Some(format!("{:.0} % of the {} from {places}", (seen.share? * 100.0).floor(), seen.on))
    });
    let seen: Vec<String> = seen.collect();
    let seen = if seen.is_empty() { "nothing of where it may be".into() } else { seen.join(", ") };
    let (wanted, hidden) = (share(doubt.wanted), share(doubt.hidden));
    // What hangs on the sides of what is known well enough is no doubt about it.
    let open = match doubt.sure.is_some_and(|sure| sure >= doubt.wanted) {
        true if doubt.of == Of::Thing => format!("{hidden} that it is where nothing was seen"),
        true => format!("{hidden} that there is more where nothing was seen"),
        false => format!(
            "{} hangs on what no look has shown, {hidden} of it on places where nothing was seen",
            share(doubt.left)
        ),
    };
    format!("{about}: {sure} ({wanted} is wanted); {open}; seen: {seen}")
}
