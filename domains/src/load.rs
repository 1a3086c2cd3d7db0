//! A domain's folder: the PDDL text, what may be said, the known objects and the scenes.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use descry_perception::recognise::{ObjectModel, check_models};
use descry_planner::Source;
use include_dir::{Dir, include_dir};
use serde::Deserialize;

use crate::goal::symbol;

static BUILT_IN: Dir<'_> = include_dir!("$CARGO_MANIFEST_DIR/tabletop");

/// The domain that is used when none is named.
pub const DEFAULT: &str = "tabletop";

/// A loaded domain folder.
#[derive(Debug, Clone)]
pub struct Domain {
    /// `domain.pddl`.
    pub pddl: Source,
    /// `domain.toml`.
    pub config: Config,
    /// `objects/*.toml`, in the order of their file names.
    pub objects: Vec<ObjectModel>,
    /// `scenes/*.toml`: name and text.
    pub scenes: BTreeMap<String, String>,
    /// The folder, or none for a built-in domain.
    pub folder: Option<PathBuf>,
}

/// `domain.toml`.
#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Config {
    /// The domain's name.
    pub name: String,
    /// What the domain is for, in a line.
    pub about: String,
    /// The surfaces that goals may name.
    pub surfaces: Vec<String>,
    /// The scene of the simulated robot when none is named.
    pub scene: String,
    /// What may be said.
    #[serde(default)]
    pub goal: Vec<GoalPhrase>,
    /// What counts as sure.
    #[serde(default)]
    pub thresholds: Thresholds,
    /// Where to look from.
    #[serde(default)]
    pub candidates: Candidates,
    /// Limits of a run.
    #[serde(default)]
    pub limits: Limits,
    /// Attachments that are programs.
    #[serde(default)]
    pub attachments: BTreeMap<String, Program>,
}

/// A phrase and its meaning.
#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct GoalPhrase {
    /// Words and `<slots>`.
    pub say: String,
    /// The goal condition in PDDL, with the same slots.
    pub means: String,
    /// Whether the answer is yes or no.
    #[serde(default)]
    pub question: bool,
    /// What the agent will do, in a line.
    #[serde(default)]
    pub about: String,
}

/// What counts as sure; all are probabilities.
#[derive(Debug, Clone, Copy, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Thresholds {
    /// Ends a search.
    pub confidence: f64,
    /// No look is worth it where no more than this could be settled.
    pub remaining: f64,
    /// No more than this may hang on places that can be seen from nowhere, for an object to be called not there; and no more than both
    /// on anything.
    pub out_of_sight: f64,
    /// That a sought object is there, before the first look.
    pub prior: f64,
}

impl Default for Thresholds {
    fn default() -> Self {
        Self { confidence: 0.8, remaining: 0.04, out_of_sight: 0.01, prior: 0.75 }
    }
}

/// A ring of poses around each surface.
#[derive(Debug, Clone, Copy, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Candidates {
    /// How many poses the ring holds.
    pub poses: usize,
    /// From the centre of the surface to the robot.
    pub distance_m: f64,
}

impl Default for Candidates {
    fn default() -> Self {
        Self { poses: 8, distance_m: 1.4 }
    }
}

/// Limits of a run, so that none is without end.
#[derive(Debug, Clone, Copy, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Limits {
    /// Looks in a run.
    pub views: usize,
    /// Failed drives to a pose before it is given up.
    pub drive_retries: usize,
    /// Failed looks from a pose before it is given up.
    pub look_retries: usize,
    /// Pushes in a run.
    pub pushes: usize,
    /// Time for one drive.
    pub drive_s: f64,
    /// Time for one look.
    pub look_s: f64,
    /// Time for one push.
    pub push_s: f64,
}

impl Default for Limits {
    fn default() -> Self {
        Self {
            views: 40,
            drive_retries: 2,
            look_retries: 2,
            pushes: 6,
            drive_s: 120.0,
            look_s: 10.0,
            push_s: 30.0,
        }
    }
}

/// An attachment that is a program which answers JSON lines.
#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Program {
    /// The command and its arguments, run in the domain's folder.
    pub program: Vec<String>,
    /// Time for one answer.
    #[serde(default = "default_program_time_s")]
    pub time_limit_s: f64,
    /// Predicates and functions whose values the program wants with every call.
    #[serde(default)]
    pub reads: Vec<String>,
}

fn default_program_time_s() -> f64 {
    5.0
}

/// Why a domain's folder could not be loaded.
#[derive(Debug, thiserror::Error)]
pub enum LoadError {
    /// Neither a built-in name nor a folder.
    #[error(
        "there is no domain \"{name}\"\n  expected a folder that holds domain.pddl and domain.toml, or the built-in domain tabletop"
    )]
    NoDomain {
        /// What was asked for.
        name: String,
    },
    /// A file could not be read.
    #[error("{path}: {because}\n  expected: {expected}")]
    File {
        /// The file.
        path: String,
        /// What the system said.
        because: String,
        /// What should be there.
        expected: &'static str,
    },
    /// A TOML file says what cannot be understood; the drawing points at the place.
    #[error("{path}\n{drawn}")]
    Toml {
        /// The file.
        path: String,
        /// The error under the text.
        drawn: String,
    },
    /// The objects make no sense together or alone.
    #[error("{because}")]
    Objects {
        /// Which, and what was expected.
        because: descry_perception::recognise::ModelError,
    },
    /// A value lies outside what makes sense.
    #[error("{path}: {key} is {found}\n  expected: {expected}")]
    Value {
        /// The file.
        path: String,
        /// The key.
        key: String,
        /// Its value.
        found: String,
        /// What would do.
        expected: &'static str,
    },
}

impl Domain {
    /// Loads a built-in domain by its name, or any other from its folder.
    ///
    /// # Errors
    /// [`LoadError`] names the file, the place in it and what was expected.
    pub fn load(name_or_folder: &str) -> Result<Self, LoadError> {
        if name_or_folder == DEFAULT && !Path::new(name_or_folder).join("domain.toml").exists() {
            return from_files(&embedded(), None);
        }
        let folder = Path::new(name_or_folder);
        if !folder.is_dir() {
            return Err(LoadError::NoDomain { name: name_or_folder.into() });
        }
        from_files(&on_disk(folder)?, Some(folder.to_path_buf()))
    }

    /// What a slot of a phrase can hold: the PDDL symbol with its names, the first of them the usual one.
    pub fn names(&self, slot: &str) -> Vec<(String, Vec<String>)> {
        match slot {
            "thing" => self.things(),
            "kind" => self.things().into_iter().map(in_plural).collect(),
            "surface" => self.config.surfaces.iter().map(|s| (symbol(s), vec![s.clone()])).collect(),
            _ => Vec::new(),
        }
    }

    /// Known objects, and the kinds that no object is called by.
    fn things(&self) -> Vec<(String, Vec<String>)> {
        let named = |o: &ObjectModel| {
            let names = std::iter::once(&o.name).chain(&o.phrases).cloned().collect();
            (symbol(&o.name), names)
        };
        let mut things: Vec<(String, Vec<String>)> = self.objects.iter().map(named).collect();
        for kind in self.objects.iter().map(|o| &o.kind) {
            if things.iter().all(|(known, _)| *known != symbol(kind)) {
                things.push((symbol(kind), vec![kind.clone()]));
            }
        }
        things
    }
}

/// The names of a thing, each with an s too.
fn in_plural((symbol, names): (String, Vec<String>)) -> (String, Vec<String>) {
    let plural = names.iter().map(|name| format!("{name}s"));
    (symbol, plural.chain(names.iter().cloned()).collect())
}

/// The object files (`*.toml`) of a folder, in the order of their names.
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

fn parse_objects(files: &Files) -> Result<Vec<ObjectModel>, LoadError> {
    let of_objects = files.iter().filter(|(key, _)| key.starts_with("objects/"));
    let objects: Vec<ObjectModel> =
        of_objects.map(|(_, (name, text))| parse::<ObjectModel>(name, text)).collect::<Result<_, _>>()?;
    check_models(&objects).map_err(|because| LoadError::Objects { because })?;
    Ok(objects)
}

/// The files of a domain by their path within its folder, each with the name that errors show.
type Files = BTreeMap<String, (String, String)>;

fn embedded() -> Files {
    fn walk(dir: &Dir<'_>, files: &mut Files) {
        for file in dir.files() {
            let path = file.path().display().to_string();
            if let Some(text) = file.contents_utf8() {
                files.insert(path.clone(), (format!("tabletop/{path}"), text.to_string()));
            }
        }
        dir.dirs().for_each(|d| walk(d, files));
    }
    let mut files = Files::new();
    walk(&BUILT_IN, &mut files);
    files
}

fn on_disk(folder: &Path) -> Result<Files, LoadError> {
    let mut files = Files::new();
    for name in ["domain.pddl", "domain.toml"] {
        read_file(&folder.join(name), name.to_string(), &mut files)?;
    }
    for sub in ["objects", "scenes"] {
        if folder.join(sub).is_dir() {
            read_folder(&folder.join(sub), sub, &mut files)?;
        }
    }
    Ok(files)
}

fn read_folder(folder: &Path, key: &str, files: &mut Files) -> Result<(), LoadError> {
    let entries = std::fs::read_dir(folder).map_err(|e| unreadable(folder, &e))?;
    for entry in entries.flatten() {
        if entry.path().extension().is_some_and(|e| e == "toml") {
            read_file(&entry.path(), format!("{key}/{}", entry.file_name().to_string_lossy()), files)?;
        }
    }
    Ok(())
}

fn read_file(path: &Path, key: String, files: &mut Files) -> Result<(), LoadError> {
    let text = std::fs::read_to_string(path).map_err(|e| unreadable(path, &e))?;
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

fn from_files(files: &Files, folder: Option<PathBuf>) -> Result<Domain, LoadError> {
    let file = |name: &str| {
        files.get(name).ok_or_else(|| LoadError::File {
            path: name.into(),
            because: "it is missing".into(),
            expected: "a domain's folder holds domain.pddl and domain.toml",
        })
    };
    let (pddl_name, pddl) = file("domain.pddl")?;
    let (config_name, config) = file("domain.toml")?;
    let config: Config = parse(config_name, config)?;
    check_config(config_name, &config)?;
    let under = |prefix: &'static str| files.iter().filter(move |(key, _)| key.starts_with(prefix));
    let objects = parse_objects(files)?;
    let scenes = under("scenes/")
        .map(|(key, (_, text))| {
            let name = key.trim_start_matches("scenes/").trim_end_matches(".toml");
            (name.to_string(), text.clone())
        })
        .collect();
    let pddl = Source { name: pddl_name.clone(), text: pddl.clone() };
    Ok(Domain { pddl, config, objects, scenes, folder })
}

fn parse<T: for<'de> Deserialize<'de>>(path: &str, text: &str) -> Result<T, LoadError> {
    toml::from_str(text).map_err(|e| LoadError::Toml { path: path.into(), drawn: e.to_string() })
}

fn check_config(path: &str, config: &Config) -> Result<(), LoadError> {
    let t = &config.thresholds;
    let probability = |key: &str, value: f64| {
        check(path, key, value, value > 0.0 && value < 1.0, "a number above 0 and below 1")
    };
    probability("thresholds.confidence", t.confidence)?;
    probability("thresholds.remaining", t.remaining)?;
    probability("thresholds.out_of_sight", t.out_of_sight)?;
    probability("thresholds.prior", t.prior)?;
    let c = &config.candidates;
    check(path, "candidates.poses", c.poses as f64, (1..=1000).contains(&c.poses), "1 to 1000 poses")?;
    check(
        path,
        "candidates.distance_m",
        c.distance_m,
        c.distance_m > 0.0 && c.distance_m < 20.0,
        "metres, above 0 and below 20",
    )?;
    let l = &config.limits;
    check(path, "limits.views", l.views as f64, l.views > 0, "at least one look")?;
    check(path, "limits.drive_s", l.drive_s, l.drive_s > 0.0, "seconds, above 0")?;
    check(path, "limits.look_s", l.look_s, l.look_s > 0.0, "seconds, above 0")?;
    check(path, "limits.push_s", l.push_s, l.push_s > 0.0, "seconds, above 0")
}

fn check(path: &str, key: &str, value: f64, holds: bool, expected: &'static str) -> Result<(), LoadError> {
    let error =
        || LoadError::Value { path: path.into(), key: key.into(), found: value.to_string(), expected };
    if holds { Ok(()) } else { Err(error()) }
}
