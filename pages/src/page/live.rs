//! Page of a run under way, rendered from the run's record alone.

use std::path::{Path, PathBuf};
use std::sync::{Mutex, PoisonError};

use descry_memory::Record;

use super::laid_out;
use super::story::{self, Looks};
use crate::live::{Found, Shown};
use descry_agent::exit::CommandError;

/// Live content of a run that is under way or has not begun.
pub struct Running {
    folder: PathBuf,
    told: Mutex<Told>,
}

/// Parts of the record read so far.
#[derive(Default)]
struct Told {
    record: Option<Record>,
    /// True if the run had ended when the record was opened.
    has_ended: bool,
    looks: Looks,
    /// Story as JSON, with the revision number that it shows.
    story: Option<(u64, String)>,
}

impl Running {
    /// Creates the content of the run that writes its record into a folder.
    pub fn of(folder: &Path) -> Self {
        Self { folder: folder.to_owned(), told: Mutex::default() }
    }

    fn told<T>(&self, read: impl FnOnce(&mut Told) -> Result<T, CommandError>) -> Result<T, CommandError> {
        let mut told = self.told.lock().unwrap_or_else(PoisonError::into_inner);
        let has_ended = descry_agent::run::has_ended(&self.folder);
        if told.record.is_none() || told.has_ended != has_ended {
            told.record = Some(descry_agent::keeping::open_written(&self.folder)?);
            told.has_ended = has_ended;
        }
        read(&mut told)
    }

    fn revision_of(told: &Told) -> Result<u64, CommandError> {
        let records = told.record.as_ref().map_or(Ok(0), |record| record.stats().map(|stats| stats.records));
        Ok(records.map_err(CommandError::broken)? + u64::from(told.has_ended))
    }

    /// Story as JSON, without points; readers fetch the points of each observation from a path of its own.
    fn story(&self, told: &mut Told) -> Result<String, CommandError> {
        let revision = Self::revision_of(told)?;
        if let Some((_, story)) = told.story.as_ref().filter(|(of, _)| *of == revision) {
            return Ok(story.clone());
        }
        let report = if told.has_ended { descry_agent::run::report(&self.folder)? } else { None };
        let Told { record: Some(record), looks, .. } = told else { return Ok("null".into()) };
        let story = story::of(record, report.as_ref(), looks)?.under_way();
        let text = serde_json::to_string(&story).map_err(|e| CommandError::Bug(e.to_string()))?;
        told.story = Some((revision, text.clone()));
        Ok(text)
    }
}

impl Shown for Running {
    fn revision(&self) -> u64 {
        self.told(|told| Self::revision_of(told)).unwrap_or(0)
    }

    fn at(&self, path: &str) -> Result<Option<Found>, CommandError> {
        if path == "/" {
            return Ok(Some(Found::html(laid_out("descry", "null"))));
        }
        if path == "/story" {
            return self.told(|told| self.story(told)).map(|story| Some(Found::json(story)));
        }
        let Some(key) = path.strip_prefix("/points/") else { return Ok(None) };
        let points = self.told(|told| Ok(told.looks.points(key)))?;
        let text = points.map(|points| serde_json::to_string(&*points)).transpose();
        text.map(|text| text.map(Found::json)).map_err(|e| CommandError::Bug(e.to_string()))
    }
}
