//! Repeating a recorded run from its start: data that the writer gives again is recognised and not written
//! again.

use crate::document::{Document, Draft, Query, RecordId};
use crate::error::Error;
use crate::stores::local::pins::pinned;
use crate::stores::{PIN, Store};
use std::collections::BTreeMap;
use std::sync::{Mutex, PoisonError};

/// Progress of a run that repeats its record, by kind of document.
pub(crate) struct Retrace {
    /// Name of the robot; "" if the store's robots have no names.
    robot: String,
    /// Newest stamp in the record when it was opened, nanoseconds.
    pub newest_ns: i64,
    steps: Mutex<BTreeMap<String, Step>>,
}

#[derive(Clone, Copy)]
enum Step {
    /// The last recognised document has this stamp, in nanoseconds, and number (`None`: none yet); the next
    /// one is compared.
    Behind(Option<(i64, RecordId)>),
    /// All further documents of the kind are new.
    New,
}

impl Retrace {
    pub fn of(store: &dyn Store, robot: &str) -> Result<Self, Error> {
        let newest_ns = store.stats()?.newest_ns.unwrap_or(i64::MIN);
        Ok(Retrace { robot: robot.into(), newest_ns, steps: Mutex::default() })
    }

    /// Number of the next recorded document of the draft's kind, if it equals the draft. After the first
    /// mismatch, all drafts of that kind are new.
    pub fn next(&self, store: &dyn Store, draft: &Draft) -> Result<Option<RecordId>, Error> {
        let same = |found: &Document| Ok(draft.document(found.id, &found.robot)? == *found);
        self.next_like(store, &draft.kind, same)
    }

    /// True if the next recorded document of pins is the one that pins these records on behalf of `by`.
    pub fn next_pins(&self, store: &dyn Store, ids: &[RecordId], by: &str) -> Result<bool, Error> {
        let wanted = pinned(0, ids, by, true).meta.body;
        Ok(self.next_like(store, PIN, |found| Ok(found.body == wanted))?.is_some())
    }

    fn next_like(
        &self,
        store: &dyn Store,
        kind: &str,
        same: impl Fn(&Document) -> Result<bool, Error>,
    ) -> Result<Option<RecordId>, Error> {
        let mut steps = self.steps.lock().unwrap_or_else(PoisonError::into_inner);
        let step = steps.entry(kind.to_owned()).or_insert(Step::Behind(None));
        let Step::Behind(after) = *step else { return Ok(None) };
        let robot = (!self.robot.is_empty()).then(|| self.robot.clone());
        let found = store.find(&Query { robot, after, limit: Some(1), ..Query::of_kind(kind) })?.pop();
        let Some(found) = found else {
            *step = Step::New;
            return Ok(None);
        };
        if !same(&found)? {
            tracing::warn!("record {} ({}) is not what came about this time", found.id, found.kind);
            *step = Step::New;
            return Ok(None);
        }
        *step = Step::Behind(Some((found.stamp_ns, found.id)));
        Ok(Some(found.id))
    }
}
