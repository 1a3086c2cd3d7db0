//! Units of checking: a domain's folder, or a single domain, problem or plan.

use std::path::{Path, PathBuf};

use descry_domains::load::Files;
use descry_planner::Source;
use descry_planner::pddl::lex::Symbols;
use descry_planner::pddl::parse;

use super::texts::Texts;

/// Unit of checking that a text belongs to.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Unit {
    /// A file of a domain's folder.
    Folder(PathBuf),
    /// A PDDL domain.
    Domain,
    /// A problem.
    Problem,
    /// A plan.
    Plan,
    /// Text that is not checked.
    Other,
}

/// Subfolders of a domain's folder.
const PARTS: [&str; 3] = ["objects", "scenes", "shapes"];
/// Maximum number of files searched for the domain of a problem.
const MOST_FILES: usize = 200;

/// Finds the unit of the text at a path.
pub fn of(texts: &Texts, path: &Path, text: &str) -> Unit {
    if let Some(folder) = folder_of(texts, path) {
        return Unit::Folder(folder);
    }
    if path.extension().is_some_and(|e| e == "toml" || e == "json") {
        return Unit::Other;
    }
    let words = || crate::layout::words(text);
    match (words().next(), words().nth(1)) {
        (Some(first), Some(second)) if first.eq_ignore_ascii_case("define") => {
            if second.eq_ignore_ascii_case("problem") { Unit::Problem } else { Unit::Domain }
        }
        (Some(first), _) if first.eq_ignore_ascii_case("define") => Unit::Domain,
        (None, _) => Unit::Other,
        _ if path.extension().is_some_and(|e| e == "pddl") => Unit::Domain,
        _ => Unit::Plan,
    }
}

/// The part of a domain's folder that a TOML file belongs to: `domain.toml`, or the name of its folder.
pub fn part_of(path: &Path) -> Option<&str> {
    path.extension().filter(|e| *e == "toml")?;
    let name = path.file_name()?.to_str()?;
    if name == "domain.toml" { Some(name) } else { path.parent()?.file_name()?.to_str() }
}

/// Folder of the domain that a file is a part of.
fn folder_of(texts: &Texts, path: &Path) -> Option<PathBuf> {
    let is_domain =
        |folder: &&Path| ["domain.pddl", "domain.toml"].iter().all(|name| texts.has(&folder.join(name)));
    let (parent, name) = (path.parent()?, path.file_name()?);
    if name == "domain.pddl" || name == "domain.toml" {
        return Some(parent).filter(is_domain).map(Path::to_path_buf);
    }
    let is_part = parent.file_name().is_some_and(|of| PARTS.iter().any(|part| of == *part));
    parent.parent().filter(|_| is_part).filter(is_domain).map(Path::to_path_buf)
}

/// Files of a domain's folder, each named by its path.
pub fn files(texts: &Texts, folder: &Path) -> Files {
    let mut files = Files::new();
    let mut put = |path: PathBuf, key: String| {
        if let Some(text) = texts.text(&path) {
            files.insert(key, (path.display().to_string(), text));
        }
    };
    for name in ["domain.pddl", "domain.toml"] {
        put(folder.join(name), name.into());
    }
    for part in PARTS {
        for path in texts.of_folder(&folder.join(part), &["toml", "json"]) {
            let name = path.file_name().unwrap_or_default().to_string_lossy().into_owned();
            put(path, format!("{part}/{name}"));
        }
    }
    files
}

/// Loads a text as a source named by its path.
pub fn source(texts: &Texts, path: &Path) -> Option<Source> {
    Some(Source::new(path.display().to_string(), texts.text(path)?))
}

/// Domain that a problem names, searched among the files beside it, then above it.
pub fn domain_of(texts: &Texts, path: &Path, problem: &str) -> Option<PathBuf> {
    let mut symbols = Symbols::default();
    let name = parse::problem(problem, 1, &mut symbols, &mut Vec::new()).domain?;
    let wanted = symbols.name(name.symbol).to_string();
    let is_it = |path: &PathBuf| {
        let Some(text) = texts.text(path).filter(|text| named_so(text, &wanted)) else { return false };
        of(texts, path, &text) != Unit::Problem
    };
    beside(texts, path).into_iter().find(is_it)
}

/// True if a text defines a domain of the given name.
fn named_so(text: &str, wanted: &str) -> bool {
    let mut symbols = Symbols::default();
    let name = parse::domain(text, 0, &mut symbols, &mut Vec::new()).name;
    name.is_some_and(|name| symbols.name(name.symbol) == wanted)
}

/// Domain of a plan: the only one beside it or above it.
pub fn domain_of_plan(texts: &Texts, path: &Path) -> Option<PathBuf> {
    let is_domain = |path: &PathBuf| {
        let text = texts.text(path).unwrap_or_default();
        matches!(of(texts, path, &text), Unit::Domain | Unit::Folder(_))
    };
    let mut found = beside(texts, path).into_iter().filter(is_domain);
    found.next().filter(|_| found.next().is_none())
}

/// PDDL files beside a file and in the parent folder, `domain.pddl` first.
fn beside(texts: &Texts, path: &Path) -> Vec<PathBuf> {
    let folders = [path.parent(), path.parent().and_then(Path::parent)];
    let mut all = Vec::new();
    for folder in folders.into_iter().flatten() {
        let mut files = texts.of_folder(folder, &["pddl"]);
        files.retain(|file| file != path);
        files.sort_by_key(|file| !file.file_name().unwrap_or_default().to_string_lossy().contains("domain"));
        all.extend(files.into_iter().take(MOST_FILES));
    }
    all
}
