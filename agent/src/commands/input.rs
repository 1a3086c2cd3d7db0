//! What several commands read and print in the same way.

use std::io::{IsTerminal, Write};
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::Instant;

use descry_domains::config::Program;
use descry_domains::program::ProgramAttachment;
use descry_planner::{Attachment, Attachments, Findings, Source};
use serde::Serialize;

use crate::exit::CommandError;

/// Reads a text file.
pub fn source(path: &Path) -> Result<Source, CommandError> {
    let name = path.display().to_string();
    let bytes = std::fs::read(path)
        .map_err(|e| CommandError::BadInput(format!("{name}: {e}\n  a PDDL file was expected")))?;
    let text = String::from_utf8(bytes).map_err(|e| {
        let at = e.utf8_error().valid_up_to();
        CommandError::BadInput(format!("{name}: byte {at} is not UTF-8 text\n  a PDDL file was expected"))
    })?;
    Ok(Source { name, text })
}

/// Findings as people read them: drawn under the text, in colour on a terminal.
pub fn drawn(findings: &Findings) -> String {
    findings.render(std::io::stderr().is_terminal())
}

/// Prints one JSON object on standard output. A reader that has gone away is no fault.
pub fn print_json(value: &impl Serialize) -> Result<(), CommandError> {
    let text = serde_json::to_string(value).map_err(|e| CommandError::Bug(e.to_string()))?;
    print_text(&text)
}

/// Prints a text and a line end on standard output. A reader that has gone away is no fault.
pub fn print_text(text: &str) -> Result<(), CommandError> {
    match writeln!(std::io::stdout(), "{text}") {
        Err(e) if e.kind() != std::io::ErrorKind::BrokenPipe => {
            Err(CommandError::broken(format!("standard output: {e}")))
        }
        _ => Ok(()),
    }
}

/// Where the programs behind a domain's attachments are named.
#[derive(clap::Args)]
pub struct AttachmentArguments {
    /// TOML file that names the programs of attachments, as `domain.toml` does [default: domain.toml beside the domain]
    #[arg(long, value_name = "FILE")]
    attachments: Option<PathBuf>,
    /// A program that answers the calls of one module, such as 'path-cost=python3 cost.py' (may be given several times)
    #[arg(long, value_name = "NAME=COMMAND")]
    attach: Vec<String>,
}

/// The part of a TOML file that names programs; what else it says is another command's.
#[derive(serde::Deserialize)]
struct Programs {
    #[serde(default)]
    attachments: std::collections::BTreeMap<String, Program>,
}

impl AttachmentArguments {
    /// The attachments of a planning task.
    pub fn bind(&self, domain: &Path) -> Result<Attachments, CommandError> {
        let started = Instant::now();
        let mut attachments = Attachments::new().with_clock(move || started.elapsed().as_secs_f64());
        let beside = domain.with_file_name("domain.toml");
        let file = self.attachments.clone().or_else(|| beside.is_file().then_some(beside));
        if let Some(file) = file {
            let text = std::fs::read_to_string(&file)
                .map_err(|e| CommandError::BadInput(format!("{}: {e}", file.display())))?;
            let programs: Programs = toml::from_str(&text)
                .map_err(|e| CommandError::BadInput(format!("{}\n{e}", file.display())))?;
            let folder = file.parent().filter(|f| !f.as_os_str().is_empty()).map(Path::to_path_buf);
            for (name, program) in programs.attachments {
                add(&mut attachments, name, program, folder.clone());
            }
        }
        for given in &self.attach {
            let Some((name, command)) = given.split_once('=') else {
                let expected = "expected NAME=COMMAND, as in --attach 'path-cost=python3 cost.py'";
                return Err(CommandError::BadInput(format!("--attach '{given}'\n  {expected}")));
            };
            let program = command.split_whitespace().map(str::to_string).collect();
            add(&mut attachments, name.into(), Program { program, time_limit_s: 5.0, reads: vec![] }, None);
        }
        Ok(attachments)
    }
}

fn add(attachments: &mut Attachments, name: String, program: Program, folder: Option<PathBuf>) {
    attachments.insert_shared(name, Arc::new(ProgramAttachment::new(program, folder)) as Arc<dyn Attachment>);
}
