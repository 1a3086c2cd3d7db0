//! `descry find` and `descry do`: pursues a goal with a body.

use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::Instant;

use descry_agent::body;
use descry_agent::exit::{CommandError, Exit};
use descry_agent::report::{Event, Report};
use descry_agent::run::{self, Folder, GoingOn, Settings, Task, Watcher};
use descry_agent::stop::Stop;
use descry_domains::abilities::searching::policies;
use descry_domains::conclusion::Verdict;
use descry_domains::lexicon::Places;
use descry_domains::load::DEFAULT;
use descry_domains::saying::Saying;
use descry_pages::page::Running;

use crate::commands::input;
use crate::commands::keeping::KeepingArguments;
use crate::commands::live::{self, Window};

/// Arguments of `descry find`.
#[derive(clap::Args)]
pub struct FindArguments {
    /// The object to find, such as "cup A"
    #[arg(required_unless_present = "resume")]
    thing: Vec<String>,
    #[command(flatten)]
    with: With,
}

/// Arguments of `descry do`.
#[derive(clap::Args)]
pub struct DoArguments {
    /// The goal, such as "identify all objects on the table"
    #[arg(required_unless_present = "resume")]
    goal: Vec<String>,
    #[command(flatten)]
    with: With,
}

/// Options common to `find` and `do`.
#[derive(clap::Args)]
pub struct With {
    /// Built-in domain or a domain's folder
    #[arg(long, default_value = DEFAULT)]
    domain: String,
    /// Scene of the simulated robot: a name of the domain or a TOML file
    #[arg(long)]
    scene: Option<String>,
    /// The body: sim; recorded:DIR for a folder of depth frames or of an earlier run (also
    /// recorded:mongodb://HOST/DATABASE#RUN); program:COMMAND to start a robot program; socket:HOST:PORT or
    /// socket:PATH for a running one
    #[arg(long, default_value = "sim")]
    robot: String,
    /// Seed of the arrangement, the noise and every choice
    #[arg(long, default_value_t = 1, value_parser = input::seed, allow_negative_numbers = true)]
    seed: u64,
    /// Policy that chooses where to look next: plan (weighs gain against cost over several looks), sweep,
    /// nearest, random, most-unknown, rear-side or gain-per-second
    #[arg(long, default_value = policies::PLAN)]
    policy: String,
    /// Folder of this run [default: a new one under runs/]
    #[arg(long, value_name = "DIR")]
    run: Option<PathBuf>,
    /// Resume an interrupted run from its record, with its goal and settings
    #[arg(long, value_name = "RUN", conflicts_with_all = ["run", "domain", "scene", "robot", "seed", "policy", "remember", "KeepingArguments"])]
    resume: Option<PathBuf>,
    /// With --resume: run the programs that the record names for the calls of its domain
    #[arg(long, requires = "resume")]
    allow_programs: bool,
    /// Start from the last sightings of earlier runs, and store those of this one: a folder, or
    /// mongodb://HOST/DATABASE
    #[arg(long, value_name = "STORE")]
    remember: Option<String>,
    /// No narration during the run: print the result alone
    #[arg(long, short)]
    quiet: bool,
    #[command(flatten)]
    live: live::LiveArguments,
    #[command(flatten)]
    keeping: KeepingArguments,
    /// Print the result as one JSON object, even on failure
    #[arg(long)]
    json: bool,
}

pub(super) fn find(arguments: &FindArguments, stop: &Stop) -> Result<Exit, CommandError> {
    carry_out(&arguments.thing, "find ", &arguments.with, stop)
}

pub(super) fn pursue(arguments: &DoArguments, stop: &Stop) -> Result<Exit, CommandError> {
    carry_out(&arguments.goal, "", &arguments.with, stop)
}

fn carry_out(words: &[String], verb: &str, with: &With, stop: &Stop) -> Result<Exit, CommandError> {
    let said = format!("{verb}{}", words.join(" "));
    let mut window = with.live.window()?;
    let ended = match &with.resume {
        Some(folder) => {
            let said = (!words.is_empty()).then_some(&said);
            go_on(folder, said, with, &mut window, stop)
        }
        None => begin(&said, with, &mut window, stop),
    };
    window.close();
    match &ended {
        Ok(report) if with.json => {
            if !with.quiet {
                input::narrate_fitted(&report.to_string());
            }
            input::print_json(report)?;
        }
        Ok(report) => {
            input::narrate("");
            input::print_fitted(report.to_string().trim())?;
        }
        Err(failed) if with.json => input::print_json(&Unended::of(&said, failed))?,
        Err(_) => {}
    }
    Ok(match ended?.verdict {
        Verdict::Achieved => Exit::Done,
        Verdict::NotFound | Verdict::CannotTell | Verdict::Impossible => Exit::No,
        Verdict::Failed => Exit::Broken,
    })
}

/// Result of an unfinished run for `--json`, with the keys that every result has.
#[derive(serde::Serialize)]
struct Unended<'a> {
    goal: &'a str,
    verdict: Verdict,
    why: String,
    exit: u8,
}

impl<'a> Unended<'a> {
    fn of(said: &'a str, failed: &CommandError) -> Self {
        let why = failed.to_string();
        Self { goal: said, verdict: Verdict::Failed, why, exit: failed.exit() as u8 }
    }
}

/// Prints the `--json` result for a command line of `find` or `do` that cannot be parsed; `words` are the
/// arguments after the program's name.
pub(super) fn refuse(words: &[String], because: &str) -> Result<(), CommandError> {
    let (options, verb) = match words.split_first() {
        Some((command, rest)) if command == "find" => (rest, "find "),
        Some((command, rest)) if command == "do" => (rest, ""),
        _ => return Ok(()),
    };
    let options = options.split(|word| word == "--").next().unwrap_or_default();
    if options.iter().all(|word| word != "--json") {
        return Ok(());
    }
    let said: Vec<&str> =
        options.iter().map(String::as_str).take_while(|word| !word.starts_with('-')).collect();
    let failed = CommandError::bad_input(because.trim().trim_start_matches("error: "));
    input::print_json(&Unended::of(format!("{verb}{}", said.join(" ")).trim_end(), &failed))
}

/// Stores the final report of a run.
fn end(mut report: Report, folder: &Folder, started: Instant) -> Result<Report, CommandError> {
    report.wall_s = started.elapsed().as_secs_f64();
    run::finish(folder.path(), &report)?;
    Ok(report)
}

/// Receiver of events that narrates them on standard error.
fn narrator(saying: Saying, is_quiet: bool) -> impl FnMut(&Event) {
    move |event| {
        if !is_quiet {
            input::narrate_fitted(&event.told(&saying));
        }
    }
}

fn begin(said: &str, with: &With, window: &mut Window, stop: &Stop) -> Result<Report, CommandError> {
    let started = Instant::now();
    let domain = input::domain(&with.domain)?;
    let body = body::open(&with.robot, with.scene.as_deref(), with.seed, &domain)?;
    let past = run::recall(with.remember.as_deref())?;
    let goal = run::understood(said, &domain, &*body.robot, past.as_ref())?;
    let chooser = policies::named(&with.policy, with.seed, None).map_err(CommandError::bad_input)?;
    let folder = Folder::of_new_run(with.run.as_deref(), &goal)?;
    window.open(Arc::new(Running::of(folder.path())))?;
    let settings = Settings {
        robot: with.robot.clone(),
        scene: with.scene.clone(),
        seed: with.seed,
        domain: with.domain.clone(),
        policy: with.policy.clone(),
        keeping: with.keeping.keeping().of_new_run(folder.path())?,
        remember: with.remember.clone(),
    };
    let mut tell = narrator(Saying::of(&domain, &Places::of_body(&*body.robot)), with.quiet);
    let watcher = Watcher { stop, tell: &mut tell };
    let task = Task { domain: &domain, goal: &goal, past: past.as_ref() };
    let pursued = run::pursue(task, &body, &folder, &settings, chooser, watcher);
    let report = input::runtime()?.block_on(pursued)?;
    end(report, &folder, started)
}

fn go_on(
    folder: &Path,
    said: Option<&String>,
    with: &With,
    window: &mut Window,
    stop: &Stop,
) -> Result<Report, CommandError> {
    let said = said.map(String::as_str);
    let allow_programs = with.allow_programs;
    let asked = GoingOn { folder, said, robot: None, allow_programs, prepare: &|_| Ok(()) };
    let mut begun = || window.open(Arc::new(Running::of(folder)));
    let mut tell = narrator(input::saying(folder), with.quiet);
    let watcher = Watcher { stop, tell: &mut tell };
    input::runtime()?.block_on(run::resume(&asked, &mut begun, watcher))
}
