//! Beginning of a run, the first document of its record, with everything a replay needs.

use std::path::PathBuf;

use descry_domains::load::{Domain, Files, from_files};
use descry_domains::past::Past;
use descry_memory::{Draft, Query, Record};
use serde::{Deserialize, Serialize};

use super::header::Header;
use crate::exit::CommandError;

/// Beginning of a run.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub struct Beginning {
    /// Settings of the run.
    #[serde(flatten)]
    pub header: Header,
    /// The texts of the domain.
    pub files: Files,
    /// Working folder of the domain's programs.
    pub folder: Option<PathBuf>,
    /// Memory of earlier runs.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub past: Option<Past>,
    /// Name and text of the scene, if the body was in one with a text.
    pub scene: Option<(String, String)>,
}

/// Record kind of the beginning.
const RUN: &str = "run";

impl Beginning {
    /// Beginning of a run with this domain.
    pub fn new(header: Header, domain: &Domain, scene: Option<(String, String)>) -> Self {
        Beginning { header, files: domain.files.clone(), folder: domain.folder.clone(), past: None, scene }
    }

    /// Records the beginning, never to be pruned.
    ///
    /// # Errors
    /// [`CommandError::Broken`] if it cannot be kept.
    pub fn put(&self, record: &Record, now_ns: i64) -> Result<(), CommandError> {
        let mut draft = Draft { kept: true, ..Draft::new(RUN, now_ns.max(0)) };
        draft.meta.body = serde_json::to_value(self).map_err(|e| CommandError::Bug(e.to_string()))?;
        record.put(draft).map(|_| ()).map_err(CommandError::broken)
    }

    /// Beginning of a record's run, if any.
    ///
    /// # Errors
    /// [`CommandError::Broken`] if it cannot be read.
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

    /// Domain as recorded, with its scene under the recorded name.
    ///
    /// # Errors
    /// [`CommandError::BadInput`] if this version does not understand it.
    pub fn domain(&self) -> Result<Domain, CommandError> {
        let mut domain =
            from_files(self.files.clone(), self.folder.clone()).map_err(CommandError::bad_input)?;
        domain.scenes.extend(self.scene.clone());
        Ok(domain)
    }
}
