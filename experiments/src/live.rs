//! Live page of a batch. It is rendered from the journals in its folder, so it also shows the work of other
//! machines that share the folder.

use std::path::PathBuf;
use std::time::Instant;

use descry_agent::exit::CommandError;
use descry_pages::live::{Found, Shown};

use super::page::{Facts, Progress, Section, html};
use super::{gather, header, journal, kinds, write};
use crate::error::ExperimentError;
use crate::header::Header;
use crate::job::{Job, Numbered};
use crate::kinds::kind::Kind;
use crate::source::Source;

/// Batch under way, as shown on its live page.
pub struct Batch {
    kind: Box<dyn Kind>,
    jobs: Vec<Job>,
    header: Header,
    source: Source,
    out: PathBuf,
    begun: Instant,
    /// Number of jobs finished before the page was opened.
    before: usize,
}

impl Batch {
    /// Batch of an experiment file, with its results in a folder.
    ///
    /// # Errors
    /// [`ExperimentError`] if the file or the folder cannot be used.
    pub fn of(source: &Source, out: PathBuf) -> Result<Self, ExperimentError> {
        let kind = kinds::read(source)?;
        let jobs = kind.jobs();
        let header = header(source, &*kind, jobs.len());
        let before = gather(&out, &[], &header)?.len();
        Ok(Self { kind, jobs, header, source: source.clone(), out, begun: Instant::now(), before })
    }

    fn page(&self) -> Result<String, ExperimentError> {
        let done = gather(&self.out, &[], &self.header)?;
        let finished: Vec<Numbered<'_>> =
            self.jobs.iter().enumerate().filter_map(|(n, job)| Some((n, done.get(&job.id)?))).collect();
        let progress = Progress { done: finished.len(), all: self.jobs.len() };
        let failed = finished.iter().filter(|(_, job)| job.error.is_some()).count();
        let mut sections = Vec::new();
        if progress.done < progress.all {
            let so_far = "What is done so far. Jobs are done in their order: what comes late may be missing altogether, and figures \
                          of what is cut off in the middle are no results yet.";
            sections.push(Section::Text(so_far.into()));
        }
        if !finished.is_empty() {
            sections.extend(self.kind.summarise(&finished).sections);
            sections.extend(write::failures(finished.iter().map(|(_, job)| *job)));
        }
        let facts: Facts = vec![
            ("jobs", format!("{} of {} ({failed} failed)", progress.done, progress.all)),
            ("time", self.time(progress)),
            ("folder", self.out.display().to_string()),
        ];
        let head = self.kind.head();
        Ok(html((&head.name, &head.about), &facts, &sections, &self.source.text, Some(progress)))
    }

    /// Time since the page was opened, and remaining time at this rate.
    fn time(&self, Progress { done, all }: Progress) -> String {
        let since_s = self.begun.elapsed().as_secs_f64();
        match done.saturating_sub(self.before) {
            0 => format!("{since_s:.0} s"),
            new => format!("{since_s:.0} s, about {:.0} s left", since_s / new as f64 * (all - done) as f64),
        }
    }
}

impl Shown for Batch {
    fn revision(&self) -> u64 {
        let inner = std::fs::read_dir(&self.out).into_iter().flatten().flatten().map(|entry| entry.path());
        let journals =
            std::iter::once(self.out.clone()).chain(inner).map(|folder| folder.join(journal::FILE));
        journals.filter_map(|journal| Some(std::fs::metadata(journal).ok()?.len())).sum()
    }

    fn at(&self, path: &str) -> Result<Option<Found>, CommandError> {
        match path {
            "/" => self.page().map(|page| Some(Found::html(page))).map_err(CommandError::broken),
            _ => Ok(None),
        }
    }
}
