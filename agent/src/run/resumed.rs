//! Resuming an interrupted run.

use std::path::Path;
use std::time::Instant;

use descry_domains::abilities::searching::policies;
use descry_domains::load::Domain;
use descry_memory::Record;

use super::{
    Beginning, Folder, Header, Resumed, Task, Watcher, files, go_on, now_unix_s, programs, recall, understood,
};
use crate::body;
use crate::exit::CommandError;
use crate::report::Report;

/// Function that prepares a domain read from a record, for example by binding functions.
pub type Prepare<'a> = dyn Fn(&mut Domain) -> Result<(), CommandError> + Sync + 'a;

/// Options for resuming a run.
pub struct GoingOn<'a> {
    /// The run's folder.
    pub folder: &'a Path,
    /// Expected goal in words; `None`: any.
    pub said: Option<&'a str>,
    /// Body to use, as on the command line; `None`: the recorded one.
    pub robot: Option<&'a str>,
    /// True if the programs that the record names may be run.
    pub allow_programs: bool,
    /// Prepares the domain, for example by binding functions in place of programs.
    pub prepare: &'a Prepare<'a>,
}

/// Resumes an interrupted run to its end, with the recorded goal and settings. `begun` is called
/// once the run's folder is locked and its record open.
///
/// # Errors
/// [`CommandError`] as for [`super::pursue`]; also if the run has another goal, if another process
/// writes it, if its record is damaged, or if it names programs that are not allowed.
pub async fn resume(
    asked: &GoingOn<'_>,
    begun: &mut dyn FnMut() -> Result<(), CommandError>,
    watcher: Watcher<'_>,
) -> Result<Report, CommandError> {
    let started = Instant::now();
    let folder = asked.folder;
    let header = files::header(folder)?;
    if let Some(said) = asked.said.filter(|said| **said != header.goal) {
        let text = format!(
            "{said}: the run in {} has the goal \"{}\"\n  leave the goal out",
            folder.display(),
            header.goal
        );
        return Err(CommandError::BadInput(text));
    }
    let claimed = Folder::locked(folder)?;
    let record = header.settings.keeping.resume(folder)?;
    begun()?;
    let beginning = Beginning::of(&record)?;
    if files::has_ended(folder)
        && let Some(lost) = files::lost_of_record(folder, &record)?
    {
        return Err(CommandError::Broken(format!(
            "{lost}\n  it has ended, and is not begun again in its place"
        )));
    }
    let settings = &header.settings;
    // A run that was cut off before it had recorded anything begins now.
    let mut domain = match &beginning {
        Some(beginning) => beginning.domain()?,
        None => Domain::load(&settings.domain).map_err(CommandError::bad_input)?,
    };
    (asked.prepare)(&mut domain)?;
    let robot = asked.robot.unwrap_or(&settings.robot);
    // A body that is named now is wanted.
    let recorded = if asked.robot.is_some() { "" } else { robot };
    programs::check_allowed(&domain, recorded, &folder.display().to_string(), asked.allow_programs)?;
    let body = body::open(robot, settings.scene.as_deref(), settings.seed, &domain)?;
    // Of a run that begins now nothing else says what was remembered before.
    let past = match &beginning {
        Some(beginning) => beginning.past.clone(),
        None => recall(settings.remember.as_deref())?,
    };
    let past = past.as_ref();
    let goal = understood(&header.goal, &domain, &*body.robot, past)?;
    let chooser = policies::named(&settings.policy, settings.seed, None).map_err(CommandError::bad_input)?;
    keep(folder, &header, &record)?;
    if beginning.is_none() {
        let header = Header { resumed: Vec::new(), ..header.clone() };
        let beginning =
            Beginning { past: past.cloned(), ..Beginning::new(header, &domain, body.scene.clone()) };
        beginning.put(&record, body.robot.now_ns())?;
    }
    let task = Task { domain: &domain, goal: &goal, past };
    let mut report = go_on(task, &body, &claimed, record, settings, chooser, watcher).await?;
    report.wall_s = started.elapsed().as_secs_f64();
    files::finish(folder, &report)?;
    Ok(report)
}

/// Notes in a run's folder that the run was resumed.
fn keep(folder: &Path, header: &Header, record: &Record) -> Result<(), CommandError> {
    let events = record.find(&record.own("event")).map_err(CommandError::broken)?;
    let after = events.last().map(|event| event.id.0);
    let mut header = header.clone();
    header.resumed.push(Resumed { unix_s: now_unix_s() as u64, after });
    files::keep_header(folder, &header)
}
