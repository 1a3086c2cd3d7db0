//! Source files of programs, found from their command lines.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use descry_robots::input::{MOST_TEXT_BYTES, read_bytes};

use super::Domain;

impl Domain {
    /// Source texts of the domain's programs ([`program_texts`]).
    pub fn program_texts(&self) -> BTreeMap<PathBuf, String> {
        let folder = self.folder.as_deref().unwrap_or(Path::new("."));
        let commands = self.programs().into_iter().map(|(_, command)| command);
        commands.flat_map(|command| program_texts(command.iter().map(String::as_str), folder)).collect()
    }
}

/// Files named by a command, relative to a folder, and their neighbours with the same extension,
/// which a program may import; contents by path. Other files that a program reads are unknown.
pub fn program_texts<'c>(command: impl Iterator<Item = &'c str>, folder: &Path) -> BTreeMap<PathBuf, String> {
    let mut texts = BTreeMap::new();
    for named in command.map(|word| folder.join(word)) {
        // An interpreter that is named by its path has no ending, and is not the program.
        let Some(ending) = named.extension().filter(|_| named.is_file()) else { continue };
        let beside = named.parent().and_then(|folder| std::fs::read_dir(folder).ok());
        let beside = beside.into_iter().flatten().flatten().map(|entry| entry.path());
        let alike = beside.filter(|path| path.extension() == Some(ending) && path.is_file());
        for path in alike.chain([named.clone()]) {
            if let Ok(bytes) = read_bytes(&path, MOST_TEXT_BYTES) {
                texts.insert(path, String::from_utf8_lossy(&bytes).into_owned());
            }
        }
    }
    texts
}
