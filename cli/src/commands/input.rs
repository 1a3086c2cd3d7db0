//! Input and output common to several commands.

use std::io::{IsTerminal, Read, Write};
use std::os::unix::fs::FileTypeExt;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::Instant;

use descry_agent::run::Beginning;
use descry_domains::check;
use descry_domains::config::Program;
use descry_domains::load::Domain;
use descry_domains::program::ProgramAttachment;
use descry_domains::saying::Saying;
use descry_memory::Fault;
use descry_planner::task::{Module, Written};
use descry_planner::{Attachment, Attachments, Findings, Source, Task};
use descry_robots::input::{read_bytes, read_text};
use serde::Serialize;

use crate::commands::fitted;
use descry_agent::exit::{CommandError, Exit};

/// Maximum size of a text file, bytes.
const MOST_TEXT_BYTES: u64 = 256 << 20;

/// Reads a text file.
pub fn source(path: &Path) -> Result<Source, CommandError> {
    let name = path.display().to_string();
    let expected = |e: CommandError| CommandError::BadInput(format!("{e}\n  a PDDL file was expected"));
    let bytes = read(path, MOST_TEXT_BYTES).map_err(expected)?;
    let text = String::from_utf8(bytes).map_err(|e| {
        let at = e.utf8_error().valid_up_to();
        CommandError::BadInput(format!("{name}: byte {at} is not UTF-8 text\n  a PDDL file was expected"))
    })?;
    Ok(Source::new(name, text))
}

/// Parses a seed.
pub fn seed(text: &str) -> Result<u64, String> {
    text.parse().map_err(|_| "a whole number from 0 was expected".into())
}

/// Single-threaded runtime for robots and runs.
pub fn runtime() -> Result<tokio::runtime::Runtime, CommandError> {
    let runtime = tokio::runtime::Builder::new_current_thread().enable_all().build();
    runtime.map_err(|e| CommandError::broken(format!("the runtime could not be started: {e}")))
}

/// Loads a domain by its name or folder, and checks it as a whole.
pub fn domain(name: &str) -> Result<Domain, CommandError> {
    let domain = Domain::load(name).map_err(CommandError::bad_input)?;
    check::runnable(&domain).map_err(|findings| CommandError::BadInput(drawn(&findings)))?;
    Ok(domain)
}

/// Wording of the domain of a run; PDDL as written if the record cannot be read.
pub fn saying(run: &Path) -> Saying {
    let record = descry_agent::keeping::open_written(run);
    let beginning = record.ok().and_then(|record| Beginning::of(&record).ok().flatten());
    beginning.as_ref().map(descry_explain::saying_of).unwrap_or_default()
}

/// Renders findings under the text, in colour on a terminal.
pub fn drawn(findings: &Findings) -> String {
    findings.render(is_coloured())
}

/// Prints findings as a result, on standard output.
pub fn print_findings(findings: &Findings) -> Result<(), CommandError> {
    print_text(findings.render(shows_colours(&std::io::stdout())).trim_end())
}

/// Prints one JSON object on standard output. A reader that has gone away is not an error.
pub fn print_json(value: &impl Serialize) -> Result<(), CommandError> {
    let text = serde_json::to_string(value).map_err(|e| CommandError::Bug(e.to_string()))?;
    print_text(&text)
}

/// Prints a text and a newline on standard output. A reader that has gone away is not an error.
pub fn print_text(text: &str) -> Result<(), CommandError> {
    match writeln!(std::io::stdout(), "{text}") {
        Err(e) if e.kind() != std::io::ErrorKind::BrokenPipe => {
            Err(CommandError::broken(format!("standard output: {e}")))
        }
        _ => Ok(()),
    }
}

/// Prints narration on standard error; failures are ignored.
pub fn narrate(text: &str) {
    let _ = writeln!(std::io::stderr(), "{text}");
}

/// Prints narration, wrapped to the terminal; control characters are escaped.
pub fn narrate_fitted(text: &str) {
    narrate(&fitted::fitted(&fitted::harmless(text), fitted::width(&std::io::stderr())));
}

/// [`print_text`], wrapped to the terminal; control characters are escaped.
pub fn print_fitted(text: &str) -> Result<(), CommandError> {
    print_text(&fitted::fitted(&fitted::harmless(text), fitted::width(&std::io::stdout())))
}

/// Reports the lost parts of a record; returns the exit code of a command that showed the rest.
pub fn lost(faults: &[Fault]) -> Exit {
    faults.iter().for_each(|fault| narrate(&format!("descry: lost: {fault}")));
    if faults.is_empty() { Exit::Done } else { Exit::No }
}

/// True if standard error shows colours.
pub fn is_coloured() -> bool {
    shows_colours(&std::io::stderr())
}

/// True if a stream shows colours: a terminal, without [`NO_COLOR`](https://no-color.org).
fn shows_colours(stream: &impl IsTerminal) -> bool {
    stream.is_terminal() && std::env::var_os("NO_COLOR").is_none_or(|set| set.is_empty())
}

/// Maximum number of bytes read from streams without a known length, such as standard input.
const MOST_STREAM_BYTES: u64 = 256 << 20;

/// Reads a file of at most `most` bytes, or an open pipe or terminal of this process. Named pipes, which may
/// have no writer, and devices, which may have no end, are refused.
pub fn read(path: &Path, most: u64) -> Result<Vec<u8>, CommandError> {
    let name = path.display();
    let refused = |e: std::io::Error| CommandError::BadInput(format!("{name}: {e}"));
    let kind = std::fs::metadata(path).map_err(refused)?.file_type();
    if kind.is_file() || !is_given(path, kind) {
        return read_bytes(path, most).map_err(refused);
    }
    let file = std::fs::File::open(path).map_err(refused)?;
    let most = most.min(MOST_STREAM_BYTES);
    let too_much = || {
        let text = format!("{name}: it has more than {} MB, the most that is read", most / 1_000_000);
        CommandError::BadInput(text)
    };
    let mut bytes = Vec::new();
    file.take(most + 1).read_to_end(&mut bytes).map_err(refused)?;
    if bytes.len() as u64 > most { Err(too_much()) } else { Ok(bytes) }
}

/// True for an open pipe of this process (`/dev/stdin`, `<(command)`), which has no place in a folder, or for
/// its terminal.
fn is_given(path: &Path, kind: std::fs::FileType) -> bool {
    let is_pipe = kind.is_fifo() && std::fs::canonicalize(path).is_err();
    let is_terminal = || std::fs::File::open(path).is_ok_and(|file| file.is_terminal());
    is_pipe || (kind.is_char_device() && is_terminal())
}

/// Options that name the programs behind a domain's attachments.
#[derive(clap::Args)]
pub struct AttachmentArguments {
    /// TOML file that names the programs of attachments, as `domain.toml` does [default: domain.toml beside the domain]
    #[arg(long, value_name = "FILE")]
    attachments: Option<PathBuf>,
    /// A program that answers the calls of one module, such as 'path-cost=python3 cost.py' (may be given several times)
    #[arg(long, value_name = "NAME=COMMAND")]
    attach: Vec<String>,
    /// Predicates and functions whose values go with every call of a module given by --attach, such as 'drain=battery,at'
    /// [default: what an effect module writes, nothing for others]
    #[arg(long, value_name = "NAME=SYMBOL,…")]
    attach_reads: Vec<String>,
    /// Seconds that a program given by --attach has for one answer
    #[arg(long, value_name = "S", default_value_t = 5.0)]
    attach_time_limit: f64,
}

/// The part of a TOML file that names programs; other parts are ignored.
#[derive(serde::Deserialize)]
struct Programs {
    #[serde(default)]
    attachments: std::collections::BTreeMap<String, Program>,
}

impl AttachmentArguments {
    /// Binds the attachments of a planning task.
    pub fn bind(&self, domain: &Path, task: &Task) -> Result<Attachments, CommandError> {
        let started = Instant::now();
        let mut attachments = Attachments::new().with_clock(move || started.elapsed().as_secs_f64());
        let beside = domain.with_file_name("domain.toml");
        let file = self.attachments.clone().or_else(|| beside.is_file().then_some(beside));
        if let Some(file) = file {
            let text =
                read_text(&file).map_err(|e| CommandError::BadInput(format!("{}: {e}", file.display())))?;
            let programs: Programs = toml::from_str(&text)
                .map_err(|e| CommandError::BadInput(format!("{}\n{e}", file.display())))?;
            let folder = file.parent().filter(|f| !f.as_os_str().is_empty()).map(Path::to_path_buf);
            for (name, program) in programs.attachments {
                add(&mut attachments, name, program, folder.clone());
            }
        }
        if self.attach_time_limit.is_nan() || self.attach_time_limit <= 0.0 {
            return Err(CommandError::BadInput("--attach-time-limit takes seconds, above 0".into()));
        }
        for given in &self.attach {
            let (name, command) =
                named("--attach", given, "NAME=COMMAND, as in --attach 'path-cost=python3 cost.py'")?;
            let module = called(task, "--attach", name)?;
            let program = command.split_whitespace().map(str::to_string).collect();
            let reads = self.reads(task, name, module)?;
            add(
                &mut attachments,
                name.into(),
                Program { program, time_limit_s: self.attach_time_limit, reads },
                None,
            );
        }
        for given in &self.attach_reads {
            let (name, _) = named("--attach-reads", given, READS)?;
            if !self.attach.iter().any(|own| own.split_once('=').is_some_and(|(own, _)| own == name)) {
                return Err(CommandError::BadInput(format!(
                    "--attach-reads '{given}'\n  no --attach names `{name}`"
                )));
            }
        }
        Ok(attachments)
    }

    /// Predicates and functions sent with every call of a module: the requested ones, or else those that
    /// the module writes.
    fn reads(&self, task: &Task, name: &str, module: &Module) -> Result<Vec<String>, CommandError> {
        let mut asked: Option<Vec<String>> = None;
        for given in &self.attach_reads {
            let (own, symbols) = named("--attach-reads", given, READS)?;
            if own != name {
                continue;
            }
            let known: Vec<&str> = task
                .predicates
                .iter()
                .map(|p| &*p.name)
                .chain(task.functions.iter().map(|f| &*f.name))
                .collect();
            for symbol in symbols.split(',').map(|symbol| symbol.trim().to_lowercase()) {
                if !known.contains(&symbol.as_str()) {
                    let what = format!("--attach-reads '{given}'\n  `{symbol}` is no predicate or function");
                    return Err(misspelt(&what, &symbol, known));
                }
                asked.get_or_insert_default().push(symbol);
            }
        }
        let written = module.writes.iter().map(|written| match written {
            Written::Number(fluent) | Written::Object(fluent) => &task.function(fluent.function).name,
            Written::Truth(atom) => &task.predicate(atom.predicate).name,
        });
        Ok(asked.unwrap_or_else(|| written.cloned().collect()))
    }
}

const READS: &str = "NAME=SYMBOL,…, as in --attach-reads 'drain=battery,at'";

/// Name and value on the two sides of `=` in an option's argument; an error without `=`.
fn named<'g>(option: &str, given: &'g str, expected: &str) -> Result<(&'g str, &'g str), CommandError> {
    let message = || CommandError::BadInput(format!("{option} '{given}'\n  expected {expected}"));
    given.split_once('=').ok_or_else(message)
}

/// Module with a name: its own name, or that of its function.
fn called<'t>(task: &'t Task, option: &str, name: &str) -> Result<&'t Module, CommandError> {
    let function = |module: &'t Module| module.function.split('@').next().unwrap_or_default();
    let names = |module: &&Module| {
        let own = [&*module.function, &*module.name, module.function.split('@').next().unwrap_or_default()];
        own.iter().any(|own| own.eq_ignore_ascii_case(name))
    };
    task.modules.iter().find(names).ok_or_else(|| {
        let known: Vec<&str> =
            task.modules.iter().flat_map(|module| [module.name.as_str(), function(module)]).collect();
        misspelt(&format!("{option} '{name}=…'\n  no module of the domain is called `{name}`"), name, known)
    })
}

/// Error of an unknown name, with the nearest known one or all of them.
fn misspelt(what: &str, name: &str, known: Vec<&str>) -> CommandError {
    let help = match descry_planner::nearest(name, known.iter().copied()) {
        Some(near) => format!("did you mean `{near}`?"),
        None if known.is_empty() => "there is none at all".to_string(),
        None => format!("known are: {}", known.join(", ")),
    };
    CommandError::BadInput(format!("{what}: {help}"))
}

fn add(attachments: &mut Attachments, name: String, program: Program, folder: Option<PathBuf>) {
    attachments.insert_shared(name, Arc::new(ProgramAttachment::new(program, folder)) as Arc<dyn Attachment>);
}
