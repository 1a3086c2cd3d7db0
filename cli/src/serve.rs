//! The agent as a service: goals arrive over HTTP, one is pursued at a time, and each ends in a verdict
//! despite interruptions.
//!
//! A goal is pursued by `descry do` in a process of its own. A more urgent goal interrupts at a safe point:
//! the run is stopped as by Ctrl-C, and resumed later from its record.

mod goals;
mod http;

use std::io;
use std::net::SocketAddr;
use std::path::{Path, PathBuf};
use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};
use std::time::Instant;

use descry_agent::exit::Exit;
use rustix::process::{Pid, Signal, kill_process, test_kill_process};
use serde_json::{Value, json};
use tokio::signal::unix::{SignalKind, signal};
use tokio::sync::broadcast;

use crate::child::{Child, Ended, HALT, POLL};
pub(crate) use goals::Goals;
use goals::{Goal, State};

/// Maximum number of events that a slow listener may lag behind.
const NEWS: usize = 1024;

/// Settings of the service.
pub(crate) struct Served {
    /// Absolute path of the folder of goals and their runs.
    pub(crate) folder: PathBuf,
    /// Options of `descry do` for every goal.
    pub(crate) options: Vec<String>,
    /// Access token for callers; `None` for a server reachable from this machine alone.
    pub(crate) token: Option<String>,
}

/// State shared by callers and the worker.
struct Agent {
    served: Served,
    state: Mutex<Inner>,
    changed: Condvar,
    news: broadcast::Sender<String>,
}

struct Inner {
    goals: Goals,
    /// Goal being pursued, and its process.
    current: Option<(Goal, Arc<Child>)>,
    /// True if the current goal is to be cancelled instead of resumed.
    is_cancelled: bool,
    /// True if no further goal will be started.
    is_closing: bool,
}

/// Serves goals at an address until an error; `ready` receives the bound address.
///
/// # Errors
/// The journal cannot be written, or the address cannot be used.
pub(crate) fn serve(
    served: Served,
    mut goals: Goals,
    address: SocketAddr,
    ready: impl FnOnce(SocketAddr),
) -> io::Result<()> {
    let left: Vec<Goal> = goals.all().filter(|goal| goal.state == State::Running).cloned().collect();
    for goal in left {
        outlived(&goal);
        goals.keep(Goal { state: State::Interrupted, process: None, ..goal })?;
    }
    let (news, _) = broadcast::channel(NEWS);
    let state = Mutex::new(Inner { goals, current: None, is_cancelled: false, is_closing: false });
    let agent = Arc::new(Agent { served, state, changed: Condvar::new(), news });
    let runtime = tokio::runtime::Builder::new_current_thread().enable_all().build()?;
    let listener = runtime.block_on(tokio::net::TcpListener::bind(address))?;
    let worker = Arc::clone(&agent);
    let worker = std::thread::Builder::new().name("goals".into()).spawn(move || worker.work())?;
    ready(listener.local_addr()?);
    runtime.block_on(async {
        let mut interrupt = signal(SignalKind::interrupt())?;
        let mut terminate = signal(SignalKind::terminate())?;
        tokio::select! {
            served = http::serve(listener, Arc::clone(&agent)) => served,
            _ = interrupt.recv() => Ok(()),
            _ = terminate.recv() => Ok(()),
        }
    })?;
    // What is pursued is stopped and kept: the next server goes on with it.
    agent.close();
    let _ = worker.join();
    Ok(())
}

/// Stops the process of a goal that outlived a killed server.
fn outlived(goal: &Goal) {
    let Some((process, run)) = goal.process.zip(goal.run.as_ref()) else { return };
    let is_its = || {
        std::fs::read_to_string(format!("/proc/{process}/cmdline"))
            .is_ok_and(|line| line.contains(run.as_str()))
    };
    let Some(pid) = i32::try_from(process).ok().and_then(Pid::from_raw) else { return };
    let began = Instant::now();
    let mut signal = Signal::INT;
    while is_its() && test_kill_process(pid).is_ok() {
        // It may end at this very moment.
        let _ = kill_process(pid, signal);
        std::thread::sleep(POLL * 10);
        signal = if began.elapsed() > HALT { Signal::KILL } else { Signal::INT };
    }
}

impl Agent {
    fn inner(&self) -> MutexGuard<'_, Inner> {
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Stores the state of a goal, and notifies listeners.
    fn keep(&self, inner: &mut Inner, goal: Goal) -> io::Result<Goal> {
        let goal = inner.goals.keep(goal)?;
        // Nobody may listen.
        let _ = self.news.send(json!({ "event": "goal", "goal": goal }).to_string());
        Ok(goal)
    }

    /// Adds a goal; an urgent one interrupts a current goal that is not urgent.
    fn add(&self, goal: String, urgent: bool) -> io::Result<Goal> {
        let mut inner = self.inner();
        let added = inner.goals.add(goal, urgent)?;
        let _ = self.news.send(json!({ "event": "goal", "goal": added }).to_string());
        if let Some((_, child)) = inner.current.as_ref().filter(|(current, _)| urgent && !current.urgent) {
            child.stop();
        }
        self.changed.notify_all();
        Ok(added)
    }

    /// Cancels a goal; `None` if it does not exist. A finished goal stays unchanged.
    fn cancel(&self, id: u64) -> io::Result<Option<Goal>> {
        let mut inner = self.inner();
        let Some(goal) = inner.goals.get(id).cloned() else { return Ok(None) };
        if goal.is_over() {
            return Ok(Some(goal));
        }
        match &inner.current {
            Some((current, child)) if current.id == id => {
                child.stop();
                inner.is_cancelled = true;
                Ok(Some(goal))
            }
            _ => self.keep(&mut inner, Goal { state: State::Cancelled, ..goal }).map(Some),
        }
    }

    /// Stops the current goal, and starts no further one.
    fn close(&self) {
        let mut inner = self.inner();
        inner.is_closing = true;
        if let Some((_, child)) = &inner.current {
            child.stop();
        }
        self.changed.notify_all();
    }

    /// Pursues the goals one after the other.
    fn work(&self) {
        loop {
            let mut inner = self.inner();
            if inner.is_closing {
                return;
            }
            let Some(goal) = inner.goals.next() else {
                drop(self.changed.wait(inner));
                continue;
            };
            let child = Arc::new(Child::default());
            let (goal, words) = self.begun(goal);
            inner.is_cancelled = false;
            inner.current = Some((goal.clone(), Arc::clone(&child)));
            if let Err(e) = self.keep(&mut inner, goal.clone()) {
                let _ = self.news.send(json!({ "event": "broken", "why": e.to_string() }).to_string());
            }
            drop(inner);
            let ended = self.pursue(&goal, &child, &words);
            self.finish(goal, &child, ended);
        }
    }

    /// Goal marked as running, with the command line that starts or resumes it.
    fn begun(&self, goal: Goal) -> (Goal, Vec<String>) {
        let words = |list: &[&str]| list.iter().map(ToString::to_string).collect::<Vec<_>>();
        let is_there = |run: &String| Path::new(run).join("run.json").exists();
        if goal.state == State::Interrupted
            && let Some(run) = goal.run.clone().filter(is_there)
        {
            let line = words(&["do", "--json", "--allow-programs", "--resume", &run]);
            return (Goal { state: State::Running, ..goal }, line);
        }
        let run = fresh(&self.served.folder, goal.id);
        let line = [
            words(&["do", "--json", "--run", &run]),
            self.served.options.clone(),
            words(&["--", &goal.goal]),
        ];
        (Goal { state: State::Running, run: Some(run), ..goal }, line.concat())
    }

    fn pursue(&self, goal: &Goal, child: &Child, words: &[String]) -> Result<Ended, String> {
        let begun = |process| {
            // How it stands is kept before it moves; what cannot be kept is said when it ends.
            let _ = self.inner().goals.keep(Goal { process: Some(process), ..goal.clone() });
        };
        let mut tell = |line: &str| {
            let _ = self.news.send(json!({ "event": "step", "id": goal.id, "step": line }).to_string());
        };
        child.carry_out(words, "", Path::new("."), begun, &mut tell)
    }

    /// Stores the end of a goal: its verdict, or its interruption.
    fn finish(&self, goal: Goal, child: &Child, ended: Result<Ended, String>) {
        let is_stopped = child.end();
        let mut inner = self.inner();
        let was_cut_off = ended.as_ref().is_ok_and(|ended| ended.exit == Exit::Interrupted as i32);
        let state = match (inner.is_cancelled, is_stopped && was_cut_off) {
            (true, true) => State::Cancelled,
            (false, true) => State::Interrupted,
            _ => State::Ended,
        };
        let report = (state == State::Ended).then(|| report(&goal, ended));
        inner.current = None;
        let kept = self.keep(&mut inner, Goal { state, process: None, report, ..goal });
        if let Err(e) = kept {
            let _ = self.news.send(json!({ "event": "broken", "why": e.to_string() }).to_string());
        }
    }
}

/// A folder for a goal's run that does not exist yet.
fn fresh(folder: &Path, id: u64) -> String {
    let names = std::iter::once(format!("goal-{id}")).chain((2..).map(|n| format!("goal-{id}-{n}")));
    let mut paths = names.map(|name| folder.join("runs").join(name));
    paths.find(|path| !path.exists()).unwrap_or_default().display().to_string()
}

/// Report of a goal, as from `descry do --json`; without output, a failure with its reason.
fn report(goal: &Goal, ended: Result<Ended, String>) -> Value {
    let (out, why) = match ended {
        Ok(ended) => (ended.out, ended.told),
        Err(because) => (String::new(), because),
    };
    match serde_json::from_str::<Value>(&out) {
        Ok(report) if report["verdict"].is_string() => report,
        _ => json!({ "goal": goal.goal, "verdict": "failed", "why": why.trim() }),
    }
}
