//! Exchange with a program, one request at a time: sent, followed while it runs, cancelled if necessary, and
//! answered; or the program is ended.

use crate::body::{Stamp, Watch};
use crate::failure::Failure;
use crate::program::link::{Ended, Lines, Link, Message, start_of};
use crate::program::message::{Arguments, Ask, Cancel, Said, What};
use crate::program::peer::Peer;
use crate::program::robot::Limits;
use std::time::Duration;
use tokio::time::{Instant, timeout_at};

/// Maximum time limit that is sent with a request, seconds: in effect none, but a number in any language.
const LONGEST_S: f64 = 1e9;
/// Time by which a request may exceed its limit on the body's clock before it is cancelled, nanoseconds.
const CLOCK_SLACK_NS: Stamp = 50_000_000;

/// Interval between checks of a silent program.
const GLANCE: Duration = Duration::from_millis(200);

/// Final answer to a request, with the body's clock before and after.
pub(super) struct Done {
    pub said: serde_json::Value,
    pub bytes: Vec<u8>,
    pub before_ns: Stamp,
    pub now_ns: Stamp,
}

impl Done {
    /// Duration of the request on the body's clock, seconds.
    pub fn duration_s(&self) -> f64 {
        (self.now_ns - self.before_ns) as f64 * 1e-9
    }
}

/// Exchange with a program: its connection, its limits, its clock, and the open request.
pub(super) struct Talk {
    line: Option<(Link, Peer)>,
    ended: String,
    limits: Limits,
    pub now_ns: Stamp,
    next_id: u64,
    /// Number of the request that has no final answer yet.
    open: Option<u64>,
}

/// Guard of a request whose answer is awaited; dropping it before the answer cancels the request.
struct Asker {
    id: u64,
    lines: Lines,
    waits: bool,
}

impl Drop for Asker {
    fn drop(&mut self) {
        if self.waits {
            self.lines.send(&Cancel { cancel: self.id });
        }
    }
}

/// Reason for which no message came: the deadline passed, the stream ended, or the program was ended before.
enum Silence {
    Late,
    Ended(Ended),
    Gone,
}

/// A request that was cancelled: the deadline for its end, and the failure to report.
struct Stopping {
    by: Instant,
    failure: Failure,
}

impl Talk {
    pub fn new(link: Link, peer: Peer, limits: Limits, now_ns: Stamp) -> Self {
        Talk { line: Some((link, peer)), ended: String::new(), limits, now_ns, next_id: 1, open: None }
    }

    /// Ends the program after a violation or its exit: kills it, or closes the connection. Every later
    /// request fails.
    pub fn end(&mut self, because: String) -> Failure {
        if let Some((link, mut peer)) = self.line.take() {
            drop(link);
            self.ended = format!("{because}{}", peer.epitaph());
        }
        Failure::Broken { because: self.ended.clone() }
    }

    /// Sends a request and waits for the final answer.
    pub async fn ask(
        &mut self,
        request: &'static str,
        with: Arguments<'_>,
        watch: &Watch<'_>,
        progress: &(dyn Fn(Stamp, f64, f64) + Send + Sync),
    ) -> Result<Done, Failure> {
        self.settle().await?;
        let Some((link, _)) = &self.line else {
            return Err(Failure::Broken { because: self.ended.clone() });
        };
        let id = self.next_id;
        self.next_id += 1;
        let time_limit_s = watch.time_limit_s.clamp(0.0, LONGEST_S);
        link.lines().send(&Ask { id, request, with, time_limit_s });
        self.open = Some(id);
        let mut asker = Asker { id, lines: link.lines(), waits: true };
        let done = self.follow(id, request, watch, progress).await;
        asker.waits = false;
        done
    }

    /// Waits for the end of a request whose caller stopped waiting.
    async fn settle(&mut self) -> Result<(), Failure> {
        let Some(id) = self.open else { return Ok(()) };
        let by = self.within(self.limits.stop_s);
        loop {
            let (said, _) = self.hear(id, by, "an abandoned request did not stop").await?;
            if matches!(said.what, What::Done(_) | What::Failed(_)) {
                self.open = None;
                return Ok(());
            }
        }
    }

    async fn follow(
        &mut self,
        id: u64,
        request: &str,
        watch: &Watch<'_>,
        progress: &(dyn Fn(Stamp, f64, f64) + Send + Sync),
    ) -> Result<Done, Failure> {
        let before_ns = self.now_ns;
        let limit_ns = (watch.time_limit_s.clamp(0.0, LONGEST_S) * 1e9) as Stamp;
        let total = self.within(watch.time_limit_s + self.limits.overrun_s);
        let mut silent = self.within(self.limits.silence_s);
        let mut stopping: Option<Stopping> = None;
        let late = || Failure::TimedOut {
            because: format!("{request} took longer than {:.1} s", watch.time_limit_s),
        };
        let mut heard = 0;
        loop {
            let (by, complaint) = match &stopping {
                Some(stop) => (stop.by, format!("it was told to stop {request} and did not")),
                None => (silent.min(total), String::new()),
            };
            let step = tokio::select! {
                biased;
                () = watch.cancel.cancelled(), if stopping.is_none() => {
                    Err(Failure::Cancelled { because: format!("{request} was stopped") })
                }
                said = self.hear(id, by, &complaint) => match said {
                    Err(Failure::TimedOut { .. }) if stopping.is_none() => {
                        let because = format!("nothing was heard of {request} for {} s", self.limits.silence_s);
                        Err(if silent < total { Failure::TimedOut { because } } else { late() })
                    }
                    said => Ok(said?),
                },
            };
            let (said, bytes) = match step {
                Ok(said) => said,
                Err(failure) => {
                    stopping = Some(self.stop(id, failure));
                    continue;
                }
            };
            silent = self.within(self.limits.silence_s);
            let over = said.now_ns - before_ns > limit_ns.saturating_add(CLOCK_SLACK_NS);
            match said.what {
                What::Accepted(_) | What::Feedback(_) => {
                    heard += 1;
                    if heard > self.limits.feedback {
                        return Err(self.end(format!("{heard} messages of feedback in one request")));
                    }
                    if let What::Feedback(f) = said.what {
                        progress(said.now_ns, f.fraction, f.distance_m);
                    }
                    if over && stopping.is_none() {
                        stopping = Some(self.stop(id, late()));
                    }
                }
                What::Done(said_done) => {
                    self.open = None;
                    let timed_out = stopping.filter(|s| matches!(s.failure, Failure::TimedOut { .. }));
                    return match timed_out {
                        Some(stop) => Err(stop.failure),
                        None if over => Err(late()),
                        None => Ok(Done { said: said_done, bytes, before_ns, now_ns: self.now_ns }),
                    };
                }
                What::Failed(failure) => {
                    self.open = None;
                    return Err(self.failed(failure, stopping));
                }
            }
        }
    }

    fn stop(&self, id: u64, failure: Failure) -> Stopping {
        if let Some((link, _)) = &self.line {
            link.lines().send(&Cancel { cancel: id });
        }
        Stopping { by: self.within(self.limits.stop_s), failure }
    }

    /// Failure to report for one that the program states: for a cancellation, the reason for cancelling, or
    /// [`Failure::Blocked`] if this side did not cancel.
    fn failed(&mut self, failure: Failure, stopping: Option<Stopping>) -> Failure {
        match (failure, stopping) {
            (Failure::Cancelled { .. }, Some(stop)) => stop.failure,
            // Nobody here asked for that: somebody stopped the robot itself.
            (Failure::Cancelled { because }, None) => Failure::Blocked { because, by: None },
            (Failure::Broken { because }, _) => self.end(because),
            (failure, _) => failure,
        }
    }

    fn within(&self, seconds: f64) -> Instant {
        let far = Duration::from_secs(1_000_000);
        Instant::now() + Duration::try_from_secs_f64(seconds.max(0.0)).unwrap_or(far).min(far)
    }

    /// Receives the next message until the deadline `by`. The end of the program is noticed even if one of
    /// its child processes keeps the output open.
    async fn message(&mut self, by: Instant) -> Result<Message, Silence> {
        let Some((link, peer)) = &mut self.line else { return Err(Silence::Gone) };
        let mut gone = false;
        loop {
            match timeout_at(by.min(Instant::now() + GLANCE), link.next()).await {
                Ok(heard) => return heard.map_err(Silence::Ended),
                Err(_) if gone => return Err(Silence::Ended(Ended::Closed)),
                Err(_) if Instant::now() >= by => return Err(Silence::Late),
                // What it said last may still be on its way.
                Err(_) => gone = peer.has_ended(),
            }
        }
    }

    /// Receives the next message about request `id` until the deadline `by`.
    ///
    /// # Errors
    /// [`Failure::TimedOut`] if none arrives and `complaint` is empty; else [`Failure::Broken`], and the
    /// program is ended.
    async fn hear(&mut self, id: u64, by: Instant, complaint: &str) -> Result<(Said, Vec<u8>), Failure> {
        let message = match self.message(by).await {
            Ok(message) => message,
            Err(Silence::Gone) => return Err(Failure::Broken { because: self.ended.clone() }),
            Err(Silence::Ended(Ended::Closed)) => {
                let farewell = self.line.as_ref().map_or("", |(_, peer)| peer.farewell());
                return Err(self.end(farewell.into()));
            }
            Err(Silence::Ended(Ended::Breach(because))) => return Err(self.end(because)),
            Err(Silence::Late) if complaint.is_empty() => {
                return Err(Failure::TimedOut { because: String::new() });
            }
            Err(Silence::Late) => {
                let because = format!("{complaint} within {} s", self.limits.stop_s);
                return Err(self.end(because));
            }
        };
        match read(&message, id, self.now_ns) {
            Ok(said) => {
                self.now_ns = said.now_ns;
                Ok((said, message.bytes))
            }
            Err(because) => Err(self.end(because)),
        }
    }
}

/// Parses and checks a message about the open request `id`.
fn read(message: &Message, id: u64, before_ns: Stamp) -> Result<Said, String> {
    let said: Said = serde_json::from_str(&message.line).map_err(|e| {
        format!(
            "it said {}, expected id, now_ns, and one of accepted, feedback, done, failed ({e})",
            start_of(&message.line)
        )
    })?;
    if said.id != id {
        return Err(format!("it answered request {} while {id} was open", said.id));
    }
    said.check(before_ns)?;
    Ok(said)
}
