//! First document of a run's record: everything that a replay needs to begin.

use std::path::PathBuf;

use descry_domains::load::{Domain, Files, from_files};
use descry_domains::past::Past;
use descry_memory::{Draft, Query, Record};
use serde::{Deserialize, Serialize};

use super::header::Header;
use crate::exit::CommandError;

/// Everything that a replay of a run needs to begin.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub struct Beginning {
    /// Settings of the run.
    #[serde(flatten)]
    pub header: Header,
    /// Files of the domain, as text.
    pub files: Files,
    /// Working folder for the domain's programs; `None` if there is none.
    pub folder: Option<PathBuf>,
    /// Belief remembered from earlier runs; `None` without one.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub past: Option<Past>,
    /// Name and text of the scene; `None` if the body has none.
    pub scene: Option<(String, String)>,
}

/// Record kind of the document.
const RUN: &str = "run";

impl Beginning {
    /// Beginning of a run in this domain, without a remembered belief.
    pub fn new(header: Header, domain: &Domain, scene: Option<(String, String)>) -> Self {
        Beginning { header, files: domain.files.clone(), folder: domain.folder.clone(), past: None, scene }
    }

    /// Records the beginning; it is never pruned.
    ///
    /// # Errors
    /// [`CommandError::Broken`] if the record cannot be written.
    pub fn put(&self, record: &Record, now_ns: i64) -> Result<(), CommandError> {
        let mut draft = Draft { kept: true, ..Draft::new(RUN, now_ns.max(0)) };
        draft.meta.body = serde_json::to_value(self).map_err(|e| CommandError::Bug(e.to_string()))?;
        record.put(draft).map(|_| ()).map_err(CommandError::broken)
    }

    /// Beginning of the run in a record; `None` if there is none.
    ///
    /// # Errors
    /// [`CommandError::Broken`] if the record cannot be read.
    pub fn of(record: &Record) -> Result<Option<Self>, CommandError> {
        let query = Query { limit: Some(1), ..record.own(RUN) };
        let Some(document) = record.find(&query).map_err(CommandError::broken)?.pop() else {
            return Ok(None);
        };
        let read = serde_json::from_value(document.body);
        let mut beginning: Self = read.map_err(|e| {
            CommandError::broken(format!("record {}: no beginning of a run: {e}", document.id))
        })?;
        // Under that key the record has the text besides.
        beginning.header.settings.scene = beginning.scene.as_ref().map(|(name, _)| name.clone());
        Ok(Some(beginning))
    }

    /// Domain as recorded, with the recorded scene.
    ///
    /// # Errors
    /// [`CommandError::BadInput`] if this version of descry cannot read the domain.
    pub fn domain(&self) -> Result<Domain, CommandError> {
        let mut domain =
            from_files(self.files.clone(), self.folder.clone()).map_err(CommandError::bad_input)?;
        domain.scenes.extend(self.scene.clone());
        Ok(domain)
    }
}
