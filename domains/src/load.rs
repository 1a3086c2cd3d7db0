//! Domain folder: PDDL text, phrases, known objects and scenes.

pub mod error;
#[doc(hidden)]
pub mod names;
mod program_texts;

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use descry_perception::laser::KnownShape;
use descry_perception::recognise::ObjectModel;
use descry_planner::{Diagnostic, Findings, Source, Span};
use descry_robots::input::{clipped, read_text, toml_problem};
use include_dir::{Dir, include_dir};
pub use program_texts::program_texts;
use serde::Deserialize;

use crate::config::{self, Config};
use crate::english;
use crate::function::Functions;
use crate::load::error::LoadError;
use crate::program::Tape;
use crate::vocabulary::Vocabulary;

/// The domains that come with the program.
static BUILT_IN: [(&str, Dir<'_>); 5] = [
    ("tabletop", include_dir!("$CARGO_MANIFEST_DIR/tabletop")),
    ("home", include_dir!("$CARGO_MANIFEST_DIR/home")),
    ("shapes", include_dir!("$CARGO_MANIFEST_DIR/shapes")),
    ("survey", include_dir!("$CARGO_MANIFEST_DIR/survey")),
    ("learning", include_dir!("$CARGO_MANIFEST_DIR/learning")),
];

/// Default domain.
pub const DEFAULT: &str = "tabletop";

/// A loaded domain folder.
#[derive(Debug, Clone)]
pub struct Domain {
    /// Text of `domain.pddl`.
    pub pddl: Source,
    /// Declarations of `domain.pddl`.
    pub vocabulary: Vocabulary,
    /// Text of `domain.toml`.
    pub toml: Source,
    /// Contents of `domain.toml`.
    pub config: Config,
    /// Models of `objects/*.toml`, in file order.
    pub objects: Vec<ObjectModel>,
    /// Shapes of `shapes/*.json`, in file order.
    pub shapes: Vec<KnownShape>,
    /// Texts of `scenes/*.toml` by name; each later visit of a scene has an entry of its own.
    pub scenes: BTreeMap<String, String>,
    /// Folder of the domain; `None` for a built-in domain.
    pub folder: Option<PathBuf>,
    /// Texts that the domain was read from.
    pub files: Files,
    /// In-process functions that replace programs.
    pub functions: Functions,
    /// Tape of the programs' answers, for recording and replay.
    pub tape: Option<Arc<dyn Tape>>,
}

impl Domain {
    /// Loads a built-in domain by name, or another domain from its folder.
    ///
    /// # Errors
    /// [`LoadError`] names the file, the place in it and what was expected.
    pub fn load(name_or_folder: &str) -> Result<Self, LoadError> {
        let built_in = BUILT_IN.iter().find(|(name, _)| *name == name_or_folder);
        if let Some((name, files)) =
            built_in.filter(|_| !Path::new(name_or_folder).join("domain.toml").exists())
        {
            return from_files(embedded(name, files), None);
        }
        let folder = Path::new(name_or_folder);
        if !folder.is_dir() {
            let known: Vec<&str> = BUILT_IN.iter().map(|(name, _)| *name).collect();
            let near = english::nearest(name_or_folder, &known);
            let near = near.map(|near| format!(": did you mean `{near}`?")).unwrap_or_default();
            return Err(LoadError::NoDomain { name: name_or_folder.into(), known: known.join(", "), near });
        }
        from_files(on_disk(folder)?, Some(folder.to_path_buf()))
    }

    /// Programs named by the domain: name of the call, fact or action, and command.
    pub fn programs(&self) -> Vec<(&str, &[String])> {
        let calls = self.config.attachments.iter().map(|(name, p)| (name.as_str(), p.program.as_slice()));
        let words = self.config.word.iter().map(|(name, word)| (name.as_str(), &word.program));
        let actions = self.config.action.iter().map(|(name, action)| (name.as_str(), &action.program));
        let optional = words.chain(actions).filter_map(|(name, p)| Some((name, p.as_deref()?)));
        calls.chain(optional).collect()
    }
}

/// Object models (`*.toml`) of a folder, in file order.
///
/// # Errors
/// [`LoadError`] names the file, the place in it and what was expected.
pub fn objects(folder: &Path) -> Result<Vec<ObjectModel>, LoadError> {
    let mut files = Files::new();
    read_folder(folder, "objects", &mut files)?;
    if files.is_empty() {
        return Err(LoadError::File {
            path: folder.display().to_string(),
            because: "no object file there".into(),
            expected: "a folder with a TOML file an object, as domains/tabletop/objects",
        });
    }
    parse_objects(&files)
}

#[doc(hidden)]
pub fn parse_objects(files: &Files) -> Result<Vec<ObjectModel>, LoadError> {
    let of_objects = files.iter().filter(|(key, _)| key.starts_with("objects/"));
    let read: Vec<names::Read<'_>> = of_objects
        .map(|(_, file)| Ok((file, parse::<ObjectModel>(&file.0, &file.1)?)))
        .collect::<Result<_, LoadError>>()?;
    names::check(&read)?;
    Ok(read.into_iter().map(|(_, object)| object).collect())
}

/// Files of a domain by relative path, each with its name for errors and its text.
pub type Files = BTreeMap<String, (String, String)>;

fn embedded(domain: &str, folder: &Dir<'_>) -> Files {
    fn walk(domain: &str, dir: &Dir<'_>, files: &mut Files) {
        for file in dir.files() {
            let path = file.path().display().to_string();
            if let Some(text) = file.contents_utf8() {
                files.insert(path.clone(), (format!("{domain}/{path}"), text.to_string()));
            }
        }
        dir.dirs().for_each(|d| walk(domain, d, files));
    }
    let mut files = Files::new();
    walk(domain, folder, &mut files);
    files
}

fn on_disk(folder: &Path) -> Result<Files, LoadError> {
    let mut files = Files::new();
    for name in ["domain.pddl", "domain.toml"] {
        read_file(&folder.join(name), name.to_string(), &mut files)?;
    }
    for sub in ["objects", "scenes", "shapes"] {
        if folder.join(sub).is_dir() {
            read_folder(&folder.join(sub), sub, &mut files)?;
        }
    }
    Ok(files)
}

fn read_folder(folder: &Path, key: &str, files: &mut Files) -> Result<(), LoadError> {
    let entries = std::fs::read_dir(folder).map_err(|e| unreadable(folder, &e))?;
    for entry in entries.flatten() {
        if entry.path().extension().is_some_and(|e| e == "toml" || e == "json") {
            read_file(&entry.path(), format!("{key}/{}", entry.file_name().to_string_lossy()), files)?;
        }
    }
    Ok(())
}

fn read_file(path: &Path, key: String, files: &mut Files) -> Result<(), LoadError> {
    let text = read_text(path).map_err(|e| unreadable(path, &e))?;
    files.insert(key, (path.display().to_string(), text));
    Ok(())
}

fn unreadable(path: &Path, error: &std::io::Error) -> LoadError {
    LoadError::File {
        path: path.display().to_string(),
        because: error.to_string(),
        expected: "the text files of a domain: domain.pddl, domain.toml, objects/*.toml, scenes/*.toml",
    }
}

/// Reads a domain from its texts; its programs run in `folder`.
///
/// # Errors
/// [`LoadError`] names the file, the place in it and what was expected.
pub fn from_files(files: Files, folder: Option<PathBuf>) -> Result<Domain, LoadError> {
    let file = |name: &str| {
        files.get(name).ok_or_else(|| LoadError::File {
            path: name.into(),
            because: "it is missing".into(),
            expected: "a domain's folder holds domain.pddl and domain.toml",
        })
    };
    let (pddl_name, pddl) = file("domain.pddl")?;
    let (config_name, config) = file("domain.toml")?;
    let toml = Source { name: config_name.clone(), text: config.clone() };
    let config: Config = toml::from_str(config)
        .map_err(|e| LoadError::Findings { findings: no_config(config_name, config, &e) })?;
    config::check(&toml, &config)?;
    let under = |prefix: &'static str| files.iter().filter(move |(key, _)| key.starts_with(prefix));
    let objects = parse_objects(&files)?;
    let scenes = under("scenes/")
        .flat_map(|(key, (_, text))| {
            visits(key.trim_start_matches("scenes/").trim_end_matches(".toml"), text)
        })
        .collect();
    let shapes = under("shapes/").map(|(_, (name, text))| shape(name, text)).collect::<Result<_, _>>()?;
    let pddl = Source::new(pddl_name.clone(), pddl.clone());
    let vocabulary = Vocabulary::read(&pddl).map_err(|findings| LoadError::Findings { findings })?;
    let functions = Functions::default();
    Ok(Domain {
        pddl,
        vocabulary,
        toml,
        config,
        objects,
        shapes,
        scenes,
        folder,
        files,
        functions,
        tape: None,
    })
}

/// Scene and its later visits, each under a name of its own: `room-visit-2`.
fn visits(name: &str, text: &str) -> Vec<(String, String)> {
    let count = text.parse::<toml::Table>().ok().and_then(|t| t.get("visits")?.as_integer()).unwrap_or(1);
    let later = (2..=count).map(|n| (format!("{name}-visit-{n}"), format!("visit = {n}\n{text}")));
    std::iter::once((name.to_string(), text.to_string())).chain(later).collect()
}

/// Parses a shape as learned by a run.
fn shape(path: &str, text: &str) -> Result<KnownShape, LoadError> {
    serde_json::from_str(text).map_err(|e| LoadError::File {
        path: path.into(),
        because: e.to_string(),
        expected: "a shape with its name, as `descry memory query STORE --kind remembered` prints those that were learned",
    })
}

fn parse<T: for<'de> Deserialize<'de>>(path: &str, text: &str) -> Result<T, LoadError> {
    toml::from_str(text).map_err(|e| LoadError::Findings { findings: no_toml(path, text, &e) })
}

/// Finding for a `domain.toml` that cannot be read; keys of the whole domain stand above its tables.
fn no_config(path: &str, text: &str, error: &toml::de::Error) -> Findings {
    let mut findings = no_toml(path, text, error);
    let nothing = toml::from_str::<Config>("\"\" = 0").err();
    let keys = nothing.as_ref().map(|nothing| quoted(nothing.message())).unwrap_or_default();
    let unknown = quoted(error.message()).into_iter().next().unwrap_or_default();
    let is_above =
        keys.iter().skip(1).any(|key| *key == unknown) && error.message().starts_with("unknown field");
    for finding in findings.list.iter_mut().filter(|_| is_above) {
        finding.help = Some(format!("`{unknown}` is of the whole domain: write it above the first [table]"));
    }
    findings
}

/// Words in backquotes.
fn quoted(text: &str) -> Vec<&str> {
    text.split('`').skip(1).step_by(2).collect()
}

/// Finding for a TOML text that cannot be read, with the nearest of the names that could stand there.
fn no_toml(path: &str, text: &str, error: &toml::de::Error) -> Findings {
    let at = error.span().unwrap_or_default();
    let span = Span { source: 0, start: at.start as u32, end: at.end as u32 };
    let (problem, mend) = toml_problem(error);
    let quoted = quoted(error.message());
    let near = quoted.split_first().and_then(|(found, known)| english::nearest(found, known));
    let mut finding = Diagnostic::error("unreadable", clipped(&problem), span, "here");
    finding.help = near.map(|near| format!("did you mean `{near}`?")).or(mend.map(str::to_string));
    Findings { sources: vec![Source::new(path, text)], list: vec![finding] }
}
