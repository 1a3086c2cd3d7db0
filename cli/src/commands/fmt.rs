//! `descry fmt FILES…`: formats PDDL and plans; comments stay, and the meaning is unchanged.

use std::io::Read;
use std::path::{Path, PathBuf};

use descry_planner::Source;

use crate::commands::input;
use crate::layout::laid_out;
use descry_agent::exit::{CommandError, Exit};

/// Arguments of `descry fmt`.
#[derive(clap::Args)]
pub struct Arguments {
    /// Domains, problems, plans, or folders of them (*.pddl, *.plan); `-` or nothing: standard input to
    /// standard output
    files: Vec<PathBuf>,
    /// Change nothing: list the files that would be changed, and exit with 1 if there are any
    #[arg(long)]
    check: bool,
}

/// File extensions collected from folders.
const ENDINGS: [&str; 2] = ["pddl", "plan"];

pub(super) fn run(arguments: &Arguments) -> Result<Exit, CommandError> {
    let is_piped = arguments.files.is_empty() || arguments.files == [Path::new("-")];
    if is_piped {
        return piped(arguments.check);
    }
    let mut files = Vec::new();
    for path in &arguments.files {
        gather(path, &mut files)?;
    }
    let mut others = 0;
    let mut broken = Vec::new();
    for path in &files {
        let source = input::source(path)?;
        match laid_out(&source) {
            Ok(text) if text == source.text => {}
            Ok(text) => {
                others += 1;
                input::print_text(&path.display().to_string())?;
                if !arguments.check {
                    replace(path, &text)?;
                }
            }
            Err(findings) => broken.push(input::drawn(&findings)),
        }
    }
    if !broken.is_empty() {
        return Err(CommandError::BadInput(broken.join("\n")));
    }
    Ok(if arguments.check && others > 0 { Exit::No } else { Exit::Done })
}

fn piped(is_check: bool) -> Result<Exit, CommandError> {
    let mut text = String::new();
    let read = std::io::stdin().read_to_string(&mut text);
    read.map_err(|e| CommandError::BadInput(format!("standard input: {e}\n  PDDL or a plan was expected")))?;
    let source = Source::new("standard input", text);
    let text = laid_out(&source).map_err(|findings| CommandError::BadInput(input::drawn(&findings)))?;
    if is_check {
        return Ok(if text == source.text { Exit::Done } else { Exit::No });
    }
    input::print_text(text.trim_end_matches('\n'))?;
    Ok(Exit::Done)
}

/// The files of a path: itself, or every PDDL and plan file below it.
fn gather(path: &Path, files: &mut Vec<PathBuf>) -> Result<(), CommandError> {
    if !path.is_dir() {
        files.push(path.to_owned());
        return Ok(());
    }
    let refused = |e: std::io::Error| CommandError::BadInput(format!("{}: {e}", path.display()));
    let entries: Result<Vec<_>, _> = std::fs::read_dir(path).map_err(refused)?.collect();
    let mut entries: Vec<PathBuf> = entries.map_err(refused)?.into_iter().map(|e| e.path()).collect();
    entries.sort();
    for entry in entries {
        let is_one = entry.extension().is_some_and(|of| ENDINGS.iter().any(|ending| of == *ending));
        if entry.is_dir() && !entry.is_symlink() || is_one && entry.is_file() {
            gather(&entry, files)?;
        }
    }
    Ok(())
}

/// Replaces a file atomically.
fn replace(path: &Path, text: &str) -> Result<(), CommandError> {
    let refused = |e: std::io::Error| CommandError::broken(format!("{}: {e}", path.display()));
    let path = path.canonicalize().map_err(refused)?;
    let name = path.file_name().unwrap_or_default().to_string_lossy();
    let fresh = path.with_file_name(format!(".{name}.{}", std::process::id()));
    let permissions = std::fs::metadata(&path).map_err(refused)?.permissions();
    let written = std::fs::write(&fresh, text)
        .and_then(|()| std::fs::set_permissions(&fresh, permissions))
        .and_then(|()| std::fs::rename(&fresh, &path));
    if written.is_err() {
        let _ = std::fs::remove_file(&fresh);
    }
    written.map_err(refused)
}
