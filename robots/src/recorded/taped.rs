//! A body whose answers are all stored on a tape; the answers that are on the tape already are replayed
//! first.

use super::tape::{Entry, Known, Question, Reply, Tape};
use crate::body::{
    Door, Driven, Hand, Looked, Place, PoseEstimate, Reading, Robot, Room, Scanned, Sensed, Stamp, Station,
    SurfaceHint, Travel, Watch,
};
use crate::failure::Failure;
use crate::grid::OccupancyGrid;
use crate::parts::Description;
use crate::request::{Answer, Request};
use nalgebra::{Isometry3, Point3};
use std::collections::{BTreeMap, VecDeque};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::Duration;

/// A body whose requests and answers are stored on a tape. Its clock stands still between two answers, so
/// that repeated queries get the same answer.
///
/// | a run | answers on the tape | live body |
/// |---|---|---|
/// | starts | none | yes |
/// | is replayed | all | none |
/// | resumes | those before the interruption | yes: repeats the requests on the tape if it [begins again](Robot::begins_again), else it is asked for its pose |
pub struct TapedRobot {
    known: Known,
    live: Option<Arc<dyn Robot>>,
    tape: Arc<dyn Tape>,
    /// Seconds on the body's clock for each second of a replay; `None` replays as fast as possible.
    speed: Option<f64>,
    state: Mutex<State>,
}

/// Maximum distance from the last pose of the tape at which a body counts as not moved, metres, beyond its
/// localisation error.
const SAME_PLACE_M: f64 = 0.05;
/// Maximum angle from the last pose of the tape at which a body counts as not moved, radians, beyond its
/// localisation error.
const SAME_PLACE_RAD: f64 = 0.05;

struct State {
    now_ns: Stamp,
    played: VecDeque<Entry>,
    /// Replies to queries that were read from the tape or asked of the live body, by the query as JSON.
    replies: BTreeMap<String, Reply>,
    /// Queries since the last answer whose replies are new to the tape.
    pending: Vec<(Question, Reply)>,
    ended: Option<String>,
    /// Last estimated pose of the base, in the map.
    at: Option<Isometry3<f64>>,
    /// Point in the map at which the head was last directed; `None` once another request may have moved the
    /// body.
    gaze: Option<Point3<f64>>,
    /// True once the pose of the live body was compared with the end of the tape, or needs no comparison.
    met: bool,
    /// Time by which the run's clock is ahead of the live body's, nanoseconds.
    ahead_ns: Stamp,
}

impl TapedRobot {
    /// Records the answers of a live body on a new tape.
    pub fn begin(live: Arc<dyn Robot>, tape: Arc<dyn Tape>) -> Self {
        Self::go_on(live, tape, Vec::new())
    }

    /// Resumes a run at the end of its tape. A body that begins again first repeats the requests on the tape.
    /// Any other has its clock shifted to continue the tape; if it is not at the tape's last pose, its first
    /// request (other than for the pose) fails with [`Failure::Lost`].
    pub fn go_on(live: Arc<dyn Robot>, tape: Arc<dyn Tape>, entries: Vec<Entry>) -> Self {
        Self::new(Known::of(&*live), Some(live), tape, entries)
    }

    /// Replays a tape without a live body; requests beyond the end of the tape fail with [`Failure::Broken`].
    pub fn replay(known: Known, tape: Arc<dyn Tape>, entries: Vec<Entry>, speed: Option<f64>) -> Self {
        Self { speed, ..Self::new(known, None, tape, entries) }
    }

    fn new(known: Known, live: Option<Arc<dyn Robot>>, tape: Arc<dyn Tape>, entries: Vec<Entry>) -> Self {
        let mut state = State {
            now_ns: known.now_ns,
            played: entries.into(),
            replies: BTreeMap::new(),
            pending: Vec::new(),
            ended: None,
            at: None,
            gaze: None,
            met: live.as_ref().is_none_or(|live| live.begins_again()),
            ahead_ns: 0,
        };
        state.met |= state.played.is_empty();
        state.hear_replies();
        TapedRobot { known, live, tape, speed: None, state: Mutex::new(state) }
    }

    /// Description and map at the beginning of the run.
    pub fn known(&self) -> &Known {
        &self.known
    }

    /// Reason for which the replay stopped: the tape ended, or held another request. `None` if it did not
    /// stop.
    pub fn ended(&self) -> Option<String> {
        self.lock().ended.clone()
    }

    /// Stores the queries since the last answer, at the end of a run.
    ///
    /// # Errors
    /// [`Failure::Broken`] if the queries cannot be stored.
    pub fn finish(&self) -> Result<(), Failure> {
        let entry = {
            let mut state = self.lock();
            if state.ended.is_some() {
                return Ok(());
            }
            // What the tape has of the end is kept again as it is.
            let played = state.played.pop_front().filter(|e| e.done.is_none());
            let replies = std::mem::take(&mut state.pending);
            played.unwrap_or(Entry { replies, done: None, now_ns: state.now_ns })
        };
        self.keep(&entry)
    }

    fn lock(&self) -> MutexGuard<'_, State> {
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }

    fn keep(&self, entry: &Entry) -> Result<(), Failure> {
        self.tape.keep(entry).map_err(|because| Failure::Broken { because })
    }

    /// Takes the next entry from the tape if it holds this request; `None` if the tape has ended and there is
    /// a live body.
    ///
    /// # Errors
    /// [`Failure::Broken`] if the tape holds another request, or has ended without a live body.
    fn next(&self, request: &Request) -> Result<Option<Entry>, Failure> {
        let mut state = self.lock();
        let on_tape = state.played.front().map(|entry| entry.done.clone());
        let because = match (on_tape, &self.live) {
            (Some(Some((asked, _))), _) if asked == *request => {
                let entry = state.played.pop_front();
                state.hear_replies();
                return Ok(entry);
            }
            // The end of a run that goes on after all.
            (None | Some(None), Some(_)) => {
                state.played.clear();
                return Ok(None);
            }
            (None | Some(None), None) => {
                format!("the record ends before the body was asked to {request}")
            }
            (Some(Some((asked, _))), _) => {
                format!("the record has \"{asked}\" where the body is now asked to {request}")
            }
        };
        drop(state);
        Err(self.end(because))
    }

    /// Stops the replay for a reason, and stores an entry without an answer on the tape.
    fn end(&self, because: String) -> Failure {
        let mut state = self.lock();
        let entry = Entry { replies: Vec::new(), done: None, now_ns: state.now_ns };
        let first = state.ended.is_none();
        state.ended.get_or_insert(because.clone());
        drop(state);
        if first && let Err(failure) = self.keep(&entry) {
            return failure;
        }
        Failure::Broken { because }
    }

    /// Answers a request from the tape or, after the end of the tape, from the live body; stores the answer
    /// in either case.
    async fn ask(&self, request: Request, watch: &Watch<'_>) -> Result<(Answer, Option<Sensed>), Failure> {
        if watch.cancel.is_cancelled() {
            return Err(Failure::Cancelled { because: format!("it was asked to {request}") });
        }
        let (entry, sensed) = match self.next(&request)? {
            Some(entry) => (self.follow(&request, entry, watch).await?, None),
            None => self.live_answer(request, watch).await?,
        };
        self.keep(&entry)?;
        self.wait_until(entry.now_ns).await;
        self.lock().now_ns = entry.now_ns;
        match entry.done {
            Some((request, answer)) => {
                let mut state = self.lock();
                state.at = answer.place().copied().or(state.at);
                match request {
                    Request::LookAt(point) => state.gaze = Some(point),
                    Request::Pose
                    | Request::Sense
                    | Request::Scan
                    | Request::Read(_)
                    | Request::Hand
                    | Request::Wait(_) => {}
                    _ => state.gaze = None,
                }
                Ok((answer, sensed))
            }
            None => Err(Failure::Broken { because: "an answer without its request".into() }),
        }
    }

    async fn live_answer(
        &self,
        request: Request,
        watch: &Watch<'_>,
    ) -> Result<(Entry, Option<Sensed>), Failure> {
        let Some(live) = &self.live else {
            return Err(Failure::Broken { because: "there is no live body".into() });
        };
        let unmet = match self.meet(&**live).await? {
            Met::Here => None,
            Met::Elsewhere(_) if request == Request::Pose => None,
            Met::Elsewhere(lost) => Some(lost),
            // Who was started anew looks elsewhere; the frame that is asked for is one of what it was told to look at.
            Met::Looking(at) if request == Request::Sense => live.look_at(&at, watch).await.err(),
            Met::Looking(_) => None,
        };
        if let Some(failure @ Failure::Cancelled { .. }) = unmet {
            return Err(failure);
        }
        if let Some(failure) = unmet {
            let replies = std::mem::take(&mut self.lock().pending);
            let now_ns = self.lock().now_ns;
            return Ok((Entry { replies, done: Some((request, Answer::Failed(failure))), now_ns }, None));
        }
        let (answer, mut sensed) = request.ask(&**live, watch).await;
        // Where somebody stopped the run, it goes on as if that had not been asked.
        if let Answer::Failed(failure @ Failure::Cancelled { .. }) = answer {
            return Err(failure);
        }
        let replies = std::mem::take(&mut self.lock().pending);
        let ahead_ns = self.lock().ahead_ns;
        if let Some(sensed) = &mut sensed {
            sensed.stamp_ns += ahead_ns;
            sensed.transforms.iter_mut().for_each(|t| t.stamp_ns += ahead_ns);
        }
        let done = Some((request, answer.later(ahead_ns)));
        Ok((Entry { replies, done, now_ns: live.now_ns() + ahead_ns }, sensed))
    }

    /// Checks, once, that the live body is at the last pose of the tape; also sets the lead of the run's
    /// clock.
    async fn meet(&self, live: &dyn Robot) -> Result<Met, Failure> {
        if std::mem::replace(&mut self.lock().met, true) {
            return Ok(Met::Here);
        }
        let here = live.pose().await?;
        let mut state = self.lock();
        state.ahead_ns = (state.now_ns - live.now_ns()).max(0);
        let Some(left) = state.at else { return Ok(Met::Here) };
        let apart_m = (here.map_from_base.translation.vector - left.translation.vector).norm();
        let apart_rad = here.map_from_base.rotation.angle_to(&left.rotation);
        if apart_m < SAME_PLACE_M + 3.0 * here.sigma_m && apart_rad < SAME_PLACE_RAD + 3.0 * here.sigma_rad {
            return Ok(state.gaze.map_or(Met::Here, Met::Looking));
        }
        let because =
            format!("it stands {apart_m:.2} m and {apart_rad:.2} rad from where the record leaves it");
        Ok(Met::Elsewhere(Failure::Lost { because }))
    }

    /// Repeats a replayed request on a live body that begins again.
    ///
    /// # Errors
    /// [`Failure::Broken`] if the clock of that body then differs from the tape.
    async fn follow(&self, request: &Request, entry: Entry, watch: &Watch<'_>) -> Result<Entry, Failure> {
        let Some(live) = self.live.as_ref().filter(|live| live.begins_again()) else { return Ok(entry) };
        request.ask(&**live, watch).await;
        if live.now_ns() == entry.now_ns {
            return Ok(entry);
        }
        let because = format!(
            "asked to {request} again, the body took until {} ns where the record has {} ns: it is not the body of that run",
            live.now_ns(),
            entry.now_ns
        );
        Err(Failure::Broken { because })
    }

    async fn wait_until(&self, now_ns: Stamp) {
        let Some(speed) = self.speed else { return };
        let passes_s = (now_ns - self.lock().now_ns).max(0) as f64 * 1e-9 / speed;
        if let Ok(passes) = Duration::try_from_secs_f64(passes_s) {
            tokio::time::sleep(passes).await;
        }
    }

    /// Answers a query from the tape while a part of it is still to be replayed, or without a live body; else
    /// from the live body. `None` if neither has a reply.
    fn reply(&self, question: Question, live: impl FnOnce(&dyn Robot) -> Reply) -> Option<Reply> {
        let mut state = self.lock();
        let key = serde_json::to_string(&question).unwrap_or_default();
        let on_tape = state.replies.get(&key).cloned();
        let Some(body) = &self.live else {
            drop(state);
            if on_tape.is_none() {
                self.end("the record ends before the body was asked about its map".into());
            }
            return on_tape;
        };
        if !state.played.is_empty() && on_tape.is_some() {
            return on_tape;
        }
        let said = live(&**body);
        if on_tape.as_ref() != Some(&said) {
            state.replies.insert(key, said.clone());
            state.pending.push((question, said.clone()));
        }
        Some(said)
    }
}

impl State {
    /// Reads the replies that the tape holds before its next answer.
    fn hear_replies(&mut self) {
        let Some(next) = self.played.front() else { return };
        for (question, reply) in &next.replies {
            self.replies.insert(serde_json::to_string(question).unwrap_or_default(), reply.clone());
        }
    }
}

/// Result of comparing the live body with the end of the tape.
enum Met {
    /// At the last pose of the tape, or compared before.
    Here,
    /// At the last pose of the tape, at which the head was directed at this point in the map.
    Looking(Point3<f64>),
    /// At another pose; the failure says how far away.
    Elsewhere(Failure),
}

#[async_trait::async_trait]
impl Robot for TapedRobot {
    fn description(&self) -> &Description {
        &self.known.description
    }

    fn now_ns(&self) -> Stamp {
        self.lock().now_ns
    }

    fn map(&self) -> Option<&OccupancyGrid> {
        self.known.map.as_ref()
    }

    fn surfaces(&self) -> &[SurfaceHint] {
        &self.known.surfaces
    }

    fn stations(&self) -> Option<&[Station]> {
        self.known.stations.as_deref()
    }

    fn rooms(&self) -> &[Room] {
        &self.known.rooms
    }

    fn doors(&self) -> &[Door] {
        &self.known.doors
    }

    fn travel(&self, from: &Place, to: &[Place], shut: &[String]) -> Vec<Result<Travel, Failure>> {
        let question = Question::Travel { from: from.clone(), to: to.to_vec(), shut: shut.to_vec() };
        match self.reply(question, |live| Reply::Travel(live.travel(from, to, shut))) {
            Some(Reply::Travel(said)) => said,
            _ => vec![Err(not_on_tape()); to.len()],
        }
    }

    fn camera_at(&self, place: &Place, look_at: Option<&Point3<f64>>) -> Result<Isometry3<f64>, Failure> {
        let question = Question::CameraAt { place: place.clone(), look_at: look_at.copied() };
        match self.reply(question, |live| Reply::CameraAt(live.camera_at(place, look_at))) {
            Some(Reply::CameraAt(said)) => said,
            _ => Err(not_on_tape()),
        }
    }

    async fn pose(&self) -> Result<PoseEstimate, Failure> {
        match self.ask(Request::Pose, &Watch::default()).await? {
            (Answer::Pose(pose), _) => Ok(pose),
            (other, _) => Err(other.strange()),
        }
    }

    async fn drive_to(&self, to: &Place, watch: &Watch<'_>) -> Result<Driven, Failure> {
        match self.ask(Request::DriveTo(to.clone()), watch).await? {
            (Answer::Driven(driven), _) => Ok(driven),
            (other, _) => Err(other.strange()),
        }
    }

    async fn look_at(&self, point: &Point3<f64>, watch: &Watch<'_>) -> Result<Looked, Failure> {
        match self.ask(Request::LookAt(*point), watch).await? {
            (Answer::Looked(looked), _) => Ok(looked),
            (other, _) => Err(other.strange()),
        }
    }

    async fn sense(&self, watch: &Watch<'_>) -> Result<Sensed, Failure> {
        match self.ask(Request::Sense, watch).await? {
            (Answer::Sensed(_), Some(sensed)) => Ok(sensed),
            (Answer::Sensed(exposure), None) => {
                let pixels = self.tape.pixels(exposure.stamp_ns);
                Ok(exposure.with(pixels.map_err(|because| Failure::Broken { because })?))
            }
            (other, _) => Err(other.strange()),
        }
    }

    async fn scan(&self, watch: &Watch<'_>) -> Result<Scanned, Failure> {
        match self.ask(Request::Scan, watch).await? {
            (Answer::Scanned(scanned), _) => Ok(scanned),
            (other, _) => Err(other.strange()),
        }
    }

    async fn read(&self, sense: &str, watch: &Watch<'_>) -> Result<Reading, Failure> {
        match self.ask(Request::Read(sense.into()), watch).await? {
            (Answer::Read(reading), _) => Ok(reading),
            (other, _) => Err(other.strange()),
        }
    }

    async fn manipulate(&self, request: &Request, watch: &Watch<'_>) -> Result<Answer, Failure> {
        match self.ask(request.clone(), watch).await?.0 {
            Answer::Failed(failure) => Err(failure),
            answer => Ok(answer),
        }
    }

    async fn hand(&self) -> Result<Hand, Failure> {
        match self.ask(Request::Hand, &Watch::default()).await? {
            (Answer::Hand(hand), _) => Ok(hand),
            (other, _) => Err(other.strange()),
        }
    }

    async fn wait(&self, seconds: f64, watch: &Watch<'_>) -> Result<(), Failure> {
        // Records of earlier versions hold no waits.
        let next = self.lock().played.front().and_then(|entry| entry.done.clone());
        let is_on_tape = next.map_or(self.live.is_some(), |(asked, _)| matches!(asked, Request::Wait(_)));
        if !is_on_tape {
            return Ok(());
        }
        match self.ask(Request::Wait(seconds), watch).await? {
            (Answer::Waited, _) => Ok(()),
            (other, _) => Err(other.strange()),
        }
    }
}

fn not_on_tape() -> Failure {
    Failure::Unreachable { because: "the record does not say".into() }
}
