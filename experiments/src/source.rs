//! Experiment files.

use std::path::{Path, PathBuf};

use descry_agent::shell;

use crate::error::ExperimentError;
use crate::overrides;

/// Experiment file as read, with assignments of the command line.
#[derive(Debug, Clone)]
pub struct Source {
    /// Path of the file, as given.
    pub path: PathBuf,
    /// Text of the file, with the assignments carried out.
    pub text: String,
    /// Assignments of the command line, as given.
    pub assignments: Vec<String>,
}

impl Source {
    /// Reads an experiment file.
    ///
    /// # Errors
    /// [`ExperimentError::File`] if the file is missing or not a text.
    pub fn read(path: &Path) -> Result<Self, ExperimentError> {
        let text = descry_robots::input::read_text(path).map_err(|e| {
            ExperimentError::file(
                path,
                &format!("{e}\n  expected an experiment: a TOML file, as those in domains/*/experiments"),
            )
        })?;
        Ok(Self { path: path.to_path_buf(), text, assignments: Vec::new() })
    }

    /// Gives a key of the file another value by an assignment `KEY=VALUE`: a path of keys and numbers, and a
    /// TOML value. A key that the file leaves out is added.
    ///
    /// # Errors
    /// [`ExperimentError::Input`] if the path leaves the file, or the text is not an assignment.
    pub fn set(&mut self, assignment: &str) -> Result<(), ExperimentError> {
        let refused = |problem: String| ExperimentError::Input(format!("--set {assignment}: {problem}"));
        let expected = "expected KEY=VALUE, such as first_seed=7 or set.1.arrangements=10";
        let (key, value) =
            assignment.split_once('=').ok_or_else(|| refused(format!("no value\n  {expected}")))?;
        if toml::from_str::<toml::Table>(&format!("value = {value}")).map_or(true, |one| one.len() != 1) {
            let quoted = format!("'{key}=\"{}\"'", value.trim());
            return Err(refused(format!(
                "this is no TOML value\n  {expected}; a text needs quotes: {quoted}"
            )));
        }
        self.text = overrides::with(&self.text, key.trim(), value.trim()).map_err(refused)?;
        self.assignments.push(assignment.to_owned());
        Ok(())
    }

    /// Path of the file for messages, with the assignments.
    pub(crate) fn label(&self) -> String {
        match self.assignments.is_empty() {
            true => self.path.display().to_string(),
            false => format!("{} (with --set {})", self.path.display(), self.assignments.join(" --set ")),
        }
    }

    /// The file with the assignments, as words of a command line.
    pub fn words(&self) -> String {
        let file = shell::word(&self.path.display().to_string());
        let set = self.assignments.iter().map(|assignment| format!(" --set {}", shell::word(assignment)));
        file + &set.collect::<String>()
    }
}
