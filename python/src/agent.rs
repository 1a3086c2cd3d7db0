//! The agent, which pursues a goal given in words with a body.

use std::path::PathBuf;
use std::sync::Arc;
use std::sync::mpsc::{RecvTimeoutError, channel};
use std::time::{Duration, Instant};

use descry_agent::body::{self, Body};
use descry_agent::exit::CommandError;
use descry_agent::keeping::Keeping;
use descry_agent::report::{self, Event};
use descry_agent::run::{self, Folder, Settings, Task, Watcher};
use descry_agent::stop::Stop;
use descry_agent::template::write_domain;
use descry_domains::abilities::searching::policies;
use descry_domains::check;
use descry_domains::load::error::LoadError;
use descry_domains::load::{DEFAULT, Domain};
use descry_robots::conformance;
use pyo3::prelude::*;

use crate::convert::to_python;
use crate::failure;
use crate::function::{self, Given, Raised};

/// Interval between checks for Ctrl-C while no event arrives.
const LOOK_EVERY: Duration = Duration::from_millis(50);

/// Report of a run.
#[pyclass(frozen, module = "descry")]
pub struct Report {
    pub(crate) inner: report::Report,
}

#[pymethods]
impl Report {
    #[getter]
    fn verdict<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        to_python(py, &self.inner.verdict)
    }

    #[getter]
    fn goal(&self) -> &str {
        &self.inner.goal
    }

    #[getter]
    fn why(&self) -> &str {
        &self.inner.why
    }

    #[getter]
    fn confidence(&self) -> f64 {
        self.inner.confidence
    }

    #[getter]
    fn position_m(&self) -> Option<[f64; 3]> {
        self.inner.position_m
    }

    #[getter]
    fn run(&self) -> PathBuf {
        PathBuf::from(&self.inner.run)
    }

    #[getter]
    fn data<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        to_python(py, &self.inner)
    }

    fn __str__(&self) -> String {
        self.inner.to_string().trim_start().to_string()
    }

    fn __repr__(&self) -> String {
        format!("<Report {}: {}>", self.inner.goal, report::words(self.inner.verdict))
    }
}

/// Loads a domain, replaces its programs by the given Python functions, and checks that the domain can run.
fn domain(py: Python<'_>, name: &str, given: [Given; 3], raised: &Arc<Raised>) -> PyResult<Domain> {
    let mut domain = Domain::load(name).map_err(|error| match error {
        LoadError::Findings { findings } => failure::findings(py, &findings),
        other => failure::input(py, &other.to_string()),
    })?;
    function::bind(py, &mut domain, given, raised)?;
    check::runnable(&domain).map_err(|findings| failure::findings(py, &findings))?;
    Ok(domain)
}

/// Inputs of a run except its body: the goal in words, the domain, the folder of the record, and settings.
struct Asked {
    said: String,
    domain: Domain,
    folder: Option<PathBuf>,
    settings: Settings,
}

impl Asked {
    /// Pursues the goal from start to end.
    fn pursue(&self, stop: &Stop, tell: &mut dyn FnMut(&Event)) -> Result<report::Report, CommandError> {
        let started = Instant::now();
        let Settings { robot, scene, seed, policy, .. } = &self.settings;
        let body: Body = body::open(robot, scene.as_deref(), *seed, &self.domain)?;
        let past = run::recall(self.settings.remember.as_deref())?;
        let goal = run::understood(&self.said, &self.domain, &*body.robot, past.as_ref())?;
        let chooser = policies::named(policy, *seed, None).map_err(CommandError::bad_input)?;
        let folder = Folder::of_new_run(self.folder.as_deref(), &goal)?;
        let keeping = Keeping::default().of_new_run(folder.path())?;
        let settings = Settings { keeping, ..self.settings.clone() };
        let watcher = Watcher { stop, tell };
        let task = Task { domain: &self.domain, goal: &goal, past: past.as_ref() };
        let pursued = run::pursue(task, &body, &folder, &settings, chooser, watcher);
        let mut report = runtime()?.block_on(pursued)?;
        report.wall_s = started.elapsed().as_secs_f64();
        run::finish(folder.path(), &report)?;
        Ok(report)
    }
}

/// Pursues a goal, given in words that the domain defines, and returns the report of the run.
#[pyfunction]
#[pyo3(signature = (goal, *, domain, robot, scene, seed, policy, run, remember, attachments, facts, actions, on_event))]
#[expect(clippy::too_many_arguments, reason = "Python names them")]
pub fn pursue(
    py: Python<'_>,
    goal: String,
    domain: String,
    robot: String,
    scene: Option<String>,
    seed: u64,
    policy: String,
    run: Option<PathBuf>,
    remember: Option<String>,
    attachments: Given,
    facts: Given,
    actions: Given,
    on_event: Option<Py<PyAny>>,
) -> PyResult<Report> {
    let raised = Arc::new(Raised::default());
    let loaded = self::domain(py, &domain, [attachments, facts, actions], &raised)?;
    let settings = Settings { robot, scene, seed, domain, policy, keeping: Keeping::default(), remember };
    let asked = Asked { said: goal, domain: loaded, folder: run, settings };
    let run = |stop: &Stop, tell: &mut dyn FnMut(&Event)| asked.pursue(stop, tell);
    carried_out(py, &raised, on_event.as_ref(), run).map(|inner| Report { inner })
}

/// Carries out a run while other Python threads proceed.
///
/// # Errors
/// The cause of an early end: an exception of a function, Ctrl-C, or the error of the run.
pub fn carried_out<T: Send>(
    py: Python<'_>,
    raised: &Raised,
    on_event: Option<&Py<PyAny>>,
    run: impl FnOnce(&Stop, &mut dyn FnMut(&Event)) -> Result<T, CommandError> + Send,
) -> PyResult<T> {
    let stop = Stop::default();
    let ended = py.detach(|| watched(run, &stop, raised, on_event));
    match raised.ended() {
        Some(error) => Err(error),
        None => ended.map_err(|error| raised.behind(py, failure::command(py, &error))),
    }
}

/// Carries out a run on a thread of its own, while the calling thread checks for Ctrl-C and delivers events.
fn watched<T: Send>(
    run: impl FnOnce(&Stop, &mut dyn FnMut(&Event)) -> Result<T, CommandError> + Send,
    stop: &Stop,
    raised: &Raised,
    on_event: Option<&Py<PyAny>>,
) -> Result<T, CommandError> {
    let raise = |error: PyErr| {
        raised.end(error);
    };
    std::thread::scope(|scope| {
        let (tell, events) = channel();
        let running = scope.spawn(move || run(stop, &mut |event| drop(tell.send(event.clone()))));
        loop {
            match events.recv_timeout(LOOK_EVERY) {
                Ok(event) => Python::attach(|py| told(py, on_event, &event)).unwrap_or_else(raise),
                Err(RecvTimeoutError::Timeout) => {}
                Err(RecvTimeoutError::Disconnected) => break,
            }
            Python::attach(|py| py.check_signals()).unwrap_or_else(raise);
            if raised.is_end() {
                stop.ask(2);
            }
        }
        let bug = || CommandError::Bug("the run ended in a panic".into());
        running.join().unwrap_or_else(|_| Err(bug()))
    })
}

fn told(py: Python<'_>, on_event: Option<&Py<PyAny>>, event: &Event) -> PyResult<()> {
    let Some(on_event) = on_event else { return Ok(()) };
    let told = to_python(py, event)?;
    told.set_item("text", event.to_string())?;
    on_event.call1(py, (told,)).map(drop)
}

/// Single-threaded runtime for runs.
pub fn runtime() -> Result<tokio::runtime::Runtime, CommandError> {
    let runtime = tokio::runtime::Builder::new_current_thread().enable_all().build();
    runtime.map_err(|e| CommandError::broken(format!("the runtime could not be started: {e}")))
}

/// Goal phrases that a domain defines.
#[pyfunction]
#[pyo3(signature = (domain="tabletop"))]
pub fn goals(py: Python<'_>, domain: &str) -> PyResult<Vec<String>> {
    let domain = self::domain(py, domain, [None, None, None], &Arc::default())?;
    Ok(domain.config.goal.iter().map(|goal| goal.say.clone()).collect())
}

/// Writes a small working domain into a folder, as a starting point; returns the paths of the files.
#[pyfunction]
pub fn new_domain(py: Python<'_>, folder: PathBuf) -> PyResult<Vec<String>> {
    write_domain(&folder).map_err(|error| failure::command(py, &error))
}

/// Runs the conformance test on a body.
#[pyfunction]
pub fn check_robot(py: Python<'_>, robot: &str) -> PyResult<()> {
    let checked = py.detach(|| -> Result<(), CommandError> {
        let domain = Domain::load(DEFAULT).map_err(CommandError::bad_input)?;
        let body = body::open(robot, None, 1, &domain)?;
        let told = |breaches: conformance::Breaches| {
            let each =
                breaches.0.iter().map(|b| format!("every body: {}\n  this one: {}", b.promise, b.found));
            CommandError::Broken(each.collect::<Vec<_>>().join("\n"))
        };
        runtime()?.block_on(conformance::check(&*body.robot)).map_err(told)
    });
    checked.map_err(|error| failure::command(py, &error))
}
