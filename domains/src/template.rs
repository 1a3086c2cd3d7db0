//! Template of a new domain.

use std::path::PathBuf;

use include_dir::{Dir, include_dir};

use crate::symbol::symbol;

static TEMPLATE: Dir<'_> = include_dir!("$CARGO_MANIFEST_DIR/template");

/// Name of the domain in the template's files, replaced by that of the new domain.
const NAME: &str = "new-domain";

/// Files of a new domain: relative path and text of each.
pub fn files(name: &str) -> Vec<(PathBuf, String)> {
    fn walk(dir: &Dir<'_>, name: &str, files: &mut Vec<(PathBuf, String)>) {
        for file in dir.files() {
            let text = file.contents_utf8().unwrap_or_default().replace(NAME, name);
            files.push((file.path().to_path_buf(), text));
        }
        dir.dirs().for_each(|dir| walk(dir, name, files));
    }
    let name = match symbol(name) {
        empty if empty.is_empty() => NAME.to_string(),
        name => name,
    };
    let mut files = Vec::new();
    walk(&TEMPLATE, &name, &mut files);
    files
}
