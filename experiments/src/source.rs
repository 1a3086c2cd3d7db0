//! Experiment files.

use std::path::{Path, PathBuf};

use crate::error::ExperimentError;
use crate::overrides;

/// An experiment file as it was read.
#[derive(Debug, Clone)]
pub struct Source {
    /// Path, as given.
    pub path: PathBuf,
    /// Text.
    pub text: String,
}

impl Source {
    /// Reads an experiment file.
    ///
    /// # Errors
    /// [`ExperimentError::File`] if it is missing or not a text.
    pub fn read(path: &Path) -> Result<Self, ExperimentError> {
        let text = descry_robots::input::read_text(path).map_err(|e| {
            ExperimentError::file(
                path,
                &format!("{e}\n  expected an experiment: a TOML file, as those in domains/*/experiments"),
            )
        })?;
        Ok(Self { path: path.to_path_buf(), text })
    }

    /// Replaces one value of the file by an assignment `KEY=VALUE`: a path of keys and numbers, and a TOML
    /// value.
    ///
    /// # Errors
    /// [`ExperimentError::Input`] if the file has no such key, or the text is not an assignment.
    pub fn set(&mut self, assignment: &str) -> Result<(), ExperimentError> {
        let refused = |problem: &str, mend: String| {
            ExperimentError::Input(format!("--set {assignment}: {problem}\n  {mend}"))
        };
        let expected = || "expected KEY=VALUE, such as first_seed=7 or set.1.arrangements=10".to_owned();
        let (key, value) = assignment.split_once('=').ok_or_else(|| refused("no value", expected()))?;
        if toml::from_str::<toml::Table>(&format!("value = {value}")).map_or(true, |one| one.len() != 1) {
            return Err(refused("this is no TOML value", expected()));
        }
        match overrides::value_at(&self.text, key.trim()) {
            Ok(span) => self.text.replace_range(span, value.trim()),
            Err(known) => {
                let mend = format!("{} has: {}", self.path.display(), known.join(", "));
                return Err(refused("the file has no such key", mend));
            }
        }
        Ok(())
    }
}
