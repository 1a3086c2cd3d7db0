//! Checks of a domain's folder as a whole: every action has an executor, every call an answerer,
//! every phrase a meaning. Findings point at the text.

mod actions;
mod conditions;
mod heard;
mod looks;
mod phrases;
mod scenes;
mod words;

use descry_planner::{Diagnostic, Findings, Severity, Span};

use crate::abilities;
use crate::english;
use crate::lexicon::{Lexicon, Places};
use crate::load::Domain;
use crate::origin::{self, Origin};
use crate::toml_place::TomlPlaces;

/// Checks that a domain can be run.
///
/// # Errors
/// The findings of severity error.
pub fn runnable(domain: &Domain) -> Result<(), Findings> {
    let mut findings = findings(domain);
    findings.list.retain(|f| f.severity == Severity::Error);
    if findings.list.is_empty() { Ok(()) } else { Err(findings) }
}

/// All findings about a domain's folder, errors and warnings.
pub fn findings(domain: &Domain) -> Findings {
    let places = Places::of_scene(domain);
    let lexicon = Lexicon::new(domain, &places);
    let check = Check { domain, toml: TomlPlaces::of(&domain.toml.text), places, lexicon };
    // First what other findings may follow from.
    let mut list = check.abilities();
    list.extend(check.scenes());
    list.extend(check.actions());
    list.extend(check.traces());
    list.extend(check.calls());
    list.extend(check.words());
    list.extend(check.objects());
    list.extend(check.open());
    list.extend(check.minimise());
    list.extend(check.phrases());
    let mut sources = vec![domain.pddl.clone(), domain.toml.clone()];
    sources.extend(scenes::scenes(domain));
    list.extend(check.alike(sources.len()));
    sources.extend(looks::objects(domain));
    Findings { sources, list }
}

/// One line for each predicate, function, call and action of a domain, with what states, answers or
/// carries it out.
pub fn grounding(domain: &Domain) -> Vec<String> {
    let vocabulary = &domain.vocabulary;
    let mut lines = vec!["words:".to_string()];
    for word in vocabulary.words() {
        let how = match origin::of(domain, &word) {
            Origin::Sensed(fact) => format!("sensed: {}", fact.about),
            Origin::SensedByProgram => "sensed: by a program".into(),
            Origin::Remembered => "remembered: changes as carried-out actions say".into(),
            Origin::Fixed => "fixed: as `init` of domain.toml says, false where it says nothing".into(),
            Origin::Planned => "planned: changes within a plan alone".into(),
            Origin::Derived => "derived by the domain's rules".into(),
        };
        let types: String = word.types.iter().map(|t| format!(" {t}")).collect();
        lines.push(format!("  {:32} {how}", format!("({}{types})", word.name)));
    }
    lines.push("calls:".into());
    for module in &vocabulary.task.modules {
        let built_in =
            abilities::used(&domain.config.uses).flat_map(|a| a.calls).find(|c| c.name == module.name);
        let how = match (domain.config.attachments.get(&module.name), built_in) {
            (Some(program), _) => format!("program: {}", program.program.join(" ")),
            (None, Some(meaning)) => meaning.about.into(),
            (None, None) => "nothing answers it".into(),
        };
        lines.push(format!("  {:32} {how}", format!("[{}]", module.name)));
    }
    lines.push("actions:".into());
    for action in &vocabulary.task.actions {
        let config = domain.config.action.get(&action.name).cloned().unwrap_or_default();
        let how = match (&config.program, config.does.texts().as_slice()) {
            (Some(program), _) => format!("program: {}", program.join(" ")),
            (None, []) => abilities::skill(&domain.config.uses, &action.name)
                .map_or_else(|| "nothing carries it out".into(), |s| format!("skill: {}", s.about)),
            (None, steps) => format!("skills: {}", steps.join("; then ")),
        };
        let more = format!(
            "{how} (limit {:.0} s, {} {}{})",
            config.limit_s(),
            config.retries() + 1,
            if config.retries() == 0 { "try" } else { "tries" },
            config.check.as_ref().map(|c| format!(", checked by {c}")).unwrap_or_default()
        );
        lines.push(format!("  {:32} {more}", format!("({})", action.name)));
    }
    lines
}

/// Domain and tables that the checks use.
struct Check<'a> {
    domain: &'a Domain,
    toml: TomlPlaces<'a>,
    places: Places,
    lexicon: Lexicon,
}

impl Check<'_> {
    /// Suggestion for an unknown name: the nearest known name, and all known names.
    fn known<'n>(&self, found: &str, names: impl IntoIterator<Item = &'n str>) -> String {
        let names: Vec<&str> = names.into_iter().collect();
        let hint = english::nearest(found, &names)
            .map(|name| format!("did you mean `{name}`? "))
            .unwrap_or_default();
        format!("{hint}known: {}", if names.is_empty() { "none".into() } else { names.join(", ") })
    }

    /// Checks that a program can be started: its command and script file exist. A function in place of
    /// the program needs neither.
    fn program(&self, path: &[&str], program: &[String]) -> Option<Diagnostic> {
        let here = self.toml.at(path);
        let Some((command, arguments)) = program.split_first() else {
            let told = Diagnostic::error("no-program", "this program is empty", here, "here");
            return Some(told.with_help("name a command and its arguments, as [\"python3\", \"mine.py\"]"));
        };
        if let [table, name, ..] = path
            && self.domain.functions.of(table, name).is_some()
        {
            return None;
        }
        // A run that is lived through again has its answers on tape.
        let folder = self.domain.folder.as_deref().filter(|_| self.domain.tape.is_none())?;
        let is_file = |a: &&String| !a.starts_with('-') && std::path::Path::new(a).extension().is_some();
        if let Some(file) = arguments.first().filter(is_file).filter(|file| !folder.join(file).exists()) {
            let message = format!("there is no file {file} for `{command}` to run");
            let help =
                format!("write {}; programs are run in the domain's folder", folder.join(file).display());
            let place = self.toml.within(path, file);
            return Some(Diagnostic::error("no-program", message, place, "here").with_help(help));
        }
        let is_there = if command.contains('/') {
            folder.join(command).exists()
        } else {
            let paths = std::env::var_os("PATH").unwrap_or_default();
            std::env::split_paths(&paths).any(|place| place.join(command).exists())
        };
        if is_there {
            return None;
        }
        let message = format!("the command `{command}` is not on this machine");
        let place = self.toml.within(path, command);
        Some(
            Diagnostic::error("no-program", message, place, "here")
                .with_help("install it, or name another; a path is taken from the domain's folder"),
        )
    }

    /// Error finding with a suggested remedy.
    fn error(&self, code: &'static str, message: String, at: Span, help: impl Into<String>) -> Diagnostic {
        Diagnostic::error(code, message, at, "here").with_help(help)
    }
}
