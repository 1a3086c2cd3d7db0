//! Parallel execution of jobs. The result of a job does not depend on the thread or the time.

use std::any::Any;
use std::io::IsTerminal;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::Path;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::sync::mpsc::{Receiver, Sender, channel};
use std::time::{Duration, Instant};

use descry_agent::stop::Stop;
use indicatif::{ProgressBar, ProgressStyle};

use super::journal::Journal;
use crate::error::ExperimentError;
use crate::job::{Finished, Job};
use crate::kinds::kind::Kind;

/// Stack size of worker threads, bytes: planning and rendering recurse deeper than the default allows.
const STACK_BYTES: usize = 16 << 20;
/// Interval between lines of progress where there is no terminal.
const LINE_EVERY: Duration = Duration::from_secs(15);

/// Runs the jobs `todo` (indices) and appends each to the journal; `before` other jobs are done already.
/// Jobs record into `scratch`, which is emptied afterwards. On a stop, jobs under way do not count.
/// Returns the finished jobs in the order in which they ended.
///
/// # Errors
/// [`ExperimentError::File`] if the journal cannot be written, [`ExperimentError::NoRoom`] if a job fails
/// with less than `least_free_bytes` free; no further job starts then.
pub fn run(
    kind: &dyn Kind,
    jobs: &[Job],
    (todo, before): (&[usize], usize),
    threads: usize,
    (scratch, least_free_bytes): (&Path, u64),
    (stop, tell): (&Stop, fn(&str)),
    journal: &mut Journal,
) -> Result<Vec<Finished>, ExperimentError> {
    let (next, ended) = (AtomicUsize::new(0), AtomicBool::new(false));
    let (send, receive) = channel();
    let work = |send: Sender<Finished>| {
        while !ended.load(Ordering::Relaxed) {
            let Some(&number) = todo.get(next.fetch_add(1, Ordering::Relaxed)) else { break };
            let finished = finish(kind, jobs, number, scratch, stop);
            // A job that was under way when the batch was stopped is not done.
            if stop.is_asked() || send.send(finished).is_err() {
                break;
            }
        }
    };
    let result = std::thread::scope(|scope| {
        let started = (0..threads.clamp(1, todo.len().max(1))).try_for_each(|n| {
            let (work, send) = (&work, send.clone());
            let named = std::thread::Builder::new().name(format!("jobs-{n}")).stack_size(STACK_BYTES);
            named.spawn_scoped(scope, move || work(send)).map(drop)
        });
        drop(send);
        let result = match started {
            Ok(()) => {
                let counts = (before, before + todo.len());
                collect(&receive, counts, journal, tell, |job| lacks_room(job, scratch, least_free_bytes))
            }
            Err(e) => Err(ExperimentError::Threads { because: e.to_string() }),
        };
        ended.store(true, Ordering::Relaxed);
        result
    });
    // What a run has left behind is of no more use; that it cannot be removed is no reason to lose the results.
    let _ = std::fs::remove_dir_all(scratch);
    result
}

/// Runs one job. A panic is recorded as a failed row.
fn finish(kind: &dyn Kind, jobs: &[Job], number: usize, scratch: &Path, stop: &Stop) -> Finished {
    let scratch = scratch.join(number.to_string());
    // What a batch that was cut off has left there is no run that could go on.
    let _ = std::fs::remove_dir_all(&scratch);
    let outcome = catch_unwind(AssertUnwindSafe(|| kind.run(number, &scratch, stop)));
    let _ = std::fs::remove_dir_all(&scratch);
    let outcome = outcome.unwrap_or_else(|panic| Err(format!("panic: {}", said(&*panic))));
    Finished::new(&jobs[number], outcome)
}

fn said(panic: &(dyn Any + Send)) -> String {
    let text = panic.downcast_ref::<&str>().map(ToString::to_string);
    text.or_else(|| panic.downcast_ref::<String>().cloned()).unwrap_or_else(|| "without a word".into())
}

/// The error for a job that failed on a full disk; such a failure says nothing about the job.
fn lacks_room(job: &Finished, scratch: &Path, least_free_bytes: u64) -> Option<ExperimentError> {
    let because = job.error.clone()?;
    let folder = scratch.parent()?;
    let free = descry_memory::free_bytes(folder).ok()?;
    (free < least_free_bytes).then(|| ExperimentError::NoRoom {
        folder: folder.display().to_string(),
        job: job.job.clone(),
        because,
    })
}

fn collect(
    done: &Receiver<Finished>,
    (before, all): (usize, usize),
    journal: &mut Journal,
    tell: fn(&str),
    lacks_room: impl Fn(&Finished) -> Option<ExperimentError>,
) -> Result<Vec<Finished>, ExperimentError> {
    let mut progress = Progress::new(before, all, tell);
    let mut finished = Vec::with_capacity(all - before);
    for job in done {
        if let Some(full) = lacks_room(&job) {
            return Err(full);
        }
        journal.append(&job)?;
        progress.one_more(job.error.is_some());
        finished.push(job);
    }
    progress.end();
    Ok(finished)
}

/// Progress on standard error: a bar on a terminal, occasional lines elsewhere.
struct Progress {
    bar: Option<ProgressBar>,
    /// Number of all jobs.
    all: usize,
    /// Number of jobs done before.
    before: usize,
    /// Number of jobs done by now.
    done: usize,
    failed: usize,
    began: Instant,
    last_line: Instant,
    tell: fn(&str),
}

impl Progress {
    fn new(before: usize, all: usize, tell: fn(&str)) -> Self {
        if before > 0 {
            tell(&format!("{before} of {all} jobs are done already"));
        }
        let bar = std::io::stderr().is_terminal().then(|| {
            let bar = ProgressBar::new(all as u64);
            let style = ProgressStyle::with_template("{bar:40} {pos}/{len} jobs, {eta} left {msg}");
            style.map(|style| bar.set_style(style)).ok();
            bar.set_position(before as u64);
            bar.reset_eta();
            bar.enable_steady_tick(Duration::from_millis(500));
            bar
        });
        let now = Instant::now();
        Self { bar, all, before, done: before, failed: 0, began: now, last_line: now, tell }
    }

    fn one_more(&mut self, failed: bool) {
        self.done += 1;
        self.failed += usize::from(failed);
        if let Some(bar) = &self.bar {
            if self.failed > 0 {
                bar.set_message(format!("({} failed)", self.failed));
            }
            bar.inc(1);
        } else if self.last_line.elapsed() > LINE_EVERY || self.done == self.all {
            self.last_line = Instant::now();
            let each_s = self.began.elapsed().as_secs_f64() / (self.done - self.before) as f64;
            let left_s = each_s * (self.all - self.done) as f64;
            let (done, all, failed) = (self.done, self.all, self.failed);
            (self.tell)(&format!("{done} of {all} jobs, {failed} failed, about {left_s:.0} s left"));
        }
    }

    fn end(self) {
        if let Some(bar) = self.bar {
            bar.finish();
        }
    }
}
