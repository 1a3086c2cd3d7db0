//! Template of a small working domain, to be written to a folder and changed there.

use std::path::Path;

use descry_domains::template;

use crate::exit::CommandError;

/// Writes a small working domain into a folder; returns its files.
///
/// # Errors
/// [`CommandError::BadInput`] if the folder holds something already, or cannot be written.
pub fn write_domain(folder: &Path) -> Result<Vec<String>, CommandError> {
    free(folder)?;
    let absolute = std::path::absolute(folder).map_err(|e| unwritable(folder, &e))?;
    let name = absolute.file_name().unwrap_or_default().to_string_lossy().into_owned();
    let mut written = Vec::new();
    for (path, text) in template::files(&name) {
        let path = folder.join(path);
        let parent = path.parent().unwrap_or(folder);
        std::fs::create_dir_all(parent).map_err(|e| unwritable(parent, &e))?;
        std::fs::write(&path, text).map_err(|e| unwritable(&path, &e))?;
        written.push(path.display().to_string());
    }
    Ok(written)
}

/// Checks that the folder is missing or empty.
fn free(folder: &Path) -> Result<(), CommandError> {
    let bad = |because: &str, mend: &str| {
        Err(CommandError::BadInput(format!("{}: {because}\n  {mend}", folder.display())))
    };
    match std::fs::read_dir(folder) {
        Err(e) if e.kind() == std::io::ErrorKind::NotFound => Ok(()),
        Err(e) => bad(&e.to_string(), "expected the name of a folder that is not there yet, or is empty"),
        Ok(mut entries) => match entries.next() {
            None => Ok(()),
            Some(_) => bad("it holds something already", "name another folder; nothing was written"),
        },
    }
}

fn unwritable(path: &Path, error: &std::io::Error) -> CommandError {
    CommandError::BadInput(format!(
        "{}: {error}\n  a folder that can be written was expected",
        path.display()
    ))
}
