//! Background writer of transforms in groups, so that callers that record measurements do not wait for the
//! disk.

use crate::document::{Blob, Draft, Form, Meta};
use crate::error::Error;
use crate::foxglove;
use crate::record::kind;
use crate::stores::Store;
use crate::transforms::Sample;
use serde_json::{Value, json};
use std::sync::mpsc::{Receiver, SyncSender, sync_channel};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::thread::JoinHandle;

/// Transforms between one pair of frames over a time span.
#[derive(Clone, Debug)]
pub(crate) struct Group {
    pub parent: String,
    pub child: String,
    pub samples: Vec<Sample>,
}

impl Group {
    /// Converts the group to a document of a kind, in the child's frame and from the first stamp to the last.
    pub fn draft(&self, kind: &str) -> Draft<'static> {
        let first = self.samples.iter().map(|s| s.stamp_ns).min().unwrap_or(0);
        let last = self.samples.iter().map(|s| s.stamp_ns).max().unwrap_or(0);
        let data = foxglove::frame_transforms(&self.parent, &self.child, &self.samples);
        Draft {
            end_ns: Some(last),
            frame: self.child.clone(),
            meta: Meta {
                body: json!({ "parent": self.parent, "count": self.samples.len() }),
                ..Meta::default()
            },
            blobs: vec![Blob {
                name: "tf".into(),
                form: Form::FrameTransforms,
                layout: Value::Null,
                data: data.into(),
            }],
            ..Draft::new(kind, first)
        }
    }
}

/// Maximum number of batches that wait for the disk, which bounds the memory; further writers block.
const WAITING: usize = 4;

enum Job {
    Write(Vec<Group>),
    Drain(SyncSender<()>),
}

/// Groups that could not be written, kept for a retry, and the reason.
#[derive(Default)]
struct Failed {
    groups: Vec<Group>,
    because: Option<Error>,
}

/// Thread that writes groups of transforms, and its queue.
pub(crate) struct Flusher {
    jobs: Option<SyncSender<Job>>,
    failed: Arc<Mutex<Failed>>,
    store: Arc<dyn Store>,
    thread: Option<JoinHandle<()>>,
}

impl Flusher {
    pub fn start(store: Arc<dyn Store>) -> Self {
        let (jobs, queue) = sync_channel(WAITING);
        let failed = Arc::new(Mutex::new(Failed::default()));
        let (to, left) = (store.clone(), failed.clone());
        let thread = std::thread::Builder::new()
            .name("descry-transforms".into())
            .spawn(move || run(&queue, &*to, &left));
        match thread {
            Ok(thread) => Flusher { jobs: Some(jobs), failed, store, thread: Some(thread) },
            // Without a thread the caller writes.
            Err(_) => Flusher { jobs: None, failed, store, thread: None },
        }
    }

    /// Enqueues groups to be written; blocks only while [`WAITING`] batches are queued.
    pub fn send(&self, groups: Vec<Group>) {
        if groups.is_empty() {
            return;
        }
        let back = match &self.jobs {
            Some(jobs) => jobs.send(Job::Write(groups)).map_err(|e| e.0),
            None => Err(Job::Write(groups)),
        };
        if let Err(Job::Write(groups)) = back {
            write(&*self.store, &self.failed, groups);
        }
    }

    /// True if a write has failed and its groups are still to be written.
    pub fn has_failed(&self) -> bool {
        lock(&self.failed).because.is_some()
    }

    /// Waits until everything is written, and retries failed batches.
    ///
    /// # Errors
    /// The failure of a write; its batch is kept for the next attempt.
    pub fn drain(&self) -> Result<(), Error> {
        if let Some(jobs) = &self.jobs {
            let (done, wait) = sync_channel(1);
            if jobs.send(Job::Drain(done)).is_ok() {
                // An error means that the thread is gone, and then nothing waits any more.
                let _ = wait.recv();
            }
        }
        if self.has_failed() {
            write(&*self.store, &self.failed, Vec::new());
        }
        let mut failed = lock(&self.failed);
        match failed.because.take() {
            None => Ok(()),
            Some(because) => {
                failed.because = Some(Error::Earlier { because: because.to_string() });
                Err(because)
            }
        }
    }
}

impl Drop for Flusher {
    fn drop(&mut self) {
        self.jobs = None;
        if let Some(thread) = self.thread.take() {
            drop(thread.join());
        }
    }
}

fn lock(failed: &Mutex<Failed>) -> MutexGuard<'_, Failed> {
    failed.lock().unwrap_or_else(PoisonError::into_inner)
}

fn run(queue: &Receiver<Job>, store: &dyn Store, failed: &Mutex<Failed>) {
    while let Ok(job) = queue.recv() {
        match job {
            Job::Write(groups) => write(store, failed, groups),
            Job::Drain(done) => drop(done.send(())),
        }
    }
}

/// Writes the groups of failed writes and the new groups as one batch; on a failure, all are kept for a
/// retry.
fn write(store: &dyn Store, failed: &Mutex<Failed>, groups: Vec<Group>) {
    let mut failed = lock(failed);
    failed.groups.extend(groups);
    let drafts: Vec<_> = failed.groups.iter().map(|g| g.draft(kind::TRANSFORMS)).collect();
    match store.append(&drafts) {
        Ok(_) => *failed = Failed::default(),
        Err(because) => failed.because = Some(because),
    }
}
