//! Diagnostics for an editor.

use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};

use descry_domains::load::error::LoadError;
use descry_domains::load::from_files;
use descry_planner::pddl::lex::Symbols;
use descry_planner::pddl::parse;
use descry_planner::{Diagnostic, Findings, Plan, Severity, Span};
use lsp_types::{
    Diagnostic as Shown, DiagnosticRelatedInformation, DiagnosticSeverity, Location, NumberOrString,
    PublishDiagnosticsParams, Uri,
};

use super::mends;
use super::texts::{Lines, Texts, path_of, uri_of};
use super::units::{self, Unit};

/// Files whose findings the editor shows.
#[derive(Default)]
pub struct Told {
    files: BTreeSet<PathBuf>,
    /// Lines on what states, answers or carries out each predicate, function, call and action of a
    /// domain's folder, as of the last successful read.
    grounded: BTreeMap<PathBuf, Vec<String>>,
}

impl Told {
    /// Findings to publish after a change of a text: those of the text, and of all texts that depend on
    /// it.
    pub fn after(&mut self, texts: &Texts, uri: &Uri) -> Vec<PublishDiagnosticsParams> {
        let path = path_of(uri);
        let text = texts.text(&path).unwrap_or_default();
        let unit = units::of(texts, &path, &text);
        let mut said: BTreeMap<PathBuf, Vec<Shown>> = match &unit {
            Unit::Folder(folder) => self.of_folder(texts, folder),
            _ => of_text(texts, &path, &text),
        };
        if matches!(unit, Unit::Domain | Unit::Folder(_)) {
            for other in texts.paths().filter(|other| **other != path) {
                let text = texts.text(other).unwrap_or_default();
                let depends = units::of(texts, other, &text) == Unit::Problem
                    && units::domain_of(texts, other, &text).as_ref() == Some(&path);
                if depends {
                    said.extend(of_text(texts, other, &text).into_iter().filter(|(file, _)| file == other));
                }
            }
        }
        said.entry(path.clone()).or_default();
        // Of files that nothing was said about before, silence is no news.
        said.retain(|file, list| *file == path || !list.is_empty() || self.files.contains(file));
        for (file, list) in &said {
            if list.is_empty() {
                self.files.remove(file)
            } else {
                self.files.insert(file.clone())
            };
        }
        let publish = |(file, diagnostics): (PathBuf, Vec<Shown>)| {
            Some(PublishDiagnosticsParams { uri: uri_of(&file)?, diagnostics, version: None })
        };
        said.into_iter().filter_map(publish).collect()
    }

    /// Findings of a domain's folder; also updates the grounding of the folder's symbols, for unfinished
    /// texts after closing their open lists.
    fn of_folder(&mut self, texts: &Texts, folder: &Path) -> BTreeMap<PathBuf, Vec<Shown>> {
        let (said, grounding) = of_folder(texts, folder);
        let is_known = self.grounded.contains_key(folder);
        let grounding =
            grounding.or_else(|| if is_known { None } else { grounding_once_closed(texts, folder) });
        self.grounded.extend(grounding.map(|grounding| (folder.to_path_buf(), grounding)));
        said
    }

    /// Grounding of the symbols of a folder, one line each, as of the last successful read; empty
    /// without one.
    pub fn grounding(&self, folder: &Path) -> &[String] {
        self.grounded.get(folder).map_or(&[], Vec::as_slice)
    }

    /// Clears the findings of a closed text.
    pub fn forget(&mut self, uri: &Uri) -> PublishDiagnosticsParams {
        self.files.remove(&path_of(uri));
        PublishDiagnosticsParams { uri: uri.clone(), diagnostics: Vec::new(), version: None }
    }
}

/// Findings of a text and of the unit that it belongs to, by file.
fn of_text(texts: &Texts, path: &Path, text: &str) -> BTreeMap<PathBuf, Vec<Shown>> {
    match units::of(texts, path, text) {
        Unit::Folder(folder) => of_folder(texts, &folder).0,
        Unit::Other => BTreeMap::new(),
        Unit::Domain => match units::source(texts, path) {
            Some(domain) => by_file(&descry_planner::check(&domain, None)),
            None => BTreeMap::new(),
        },
        Unit::Problem => of_problem(texts, path, text),
        Unit::Plan => {
            let source = descry_planner::Source::new(path.display().to_string(), text);
            Plan::read(&source).err().map(|findings| by_file(&findings)).unwrap_or_default()
        }
    }
}

/// Findings of a problem with its domain; without the domain, those of the problem alone.
fn of_problem(texts: &Texts, path: &Path, text: &str) -> BTreeMap<PathBuf, Vec<Shown>> {
    let source = descry_planner::Source::new(path.display().to_string(), text);
    let domain = units::domain_of(texts, path, text).and_then(|domain| units::source(texts, &domain));
    let Some(domain) = domain else {
        let mut list = Vec::new();
        let mut symbols = Symbols::default();
        let problem = parse::problem(text, 0, &mut symbols, &mut list);
        if let Some(name) = problem.domain {
            let text =
                format!("no domain `{}` was found beside this problem or above", symbols.name(name.symbol));
            let finding = Diagnostic::warning("no-domain", text, name.span, "this domain");
            list.push(finding.with_help("only what needs no domain is checked"));
        }
        return by_file(&Findings { sources: vec![source], list });
    };
    by_file(&descry_planner::check(&domain, Some(&source)))
}

/// Grounding of the symbols of a folder once the open lists in its PDDL are closed; `None` if none is
/// open.
fn grounding_once_closed(texts: &Texts, folder: &Path) -> Option<Vec<String>> {
    let mut files = units::files(texts, folder);
    let (_, text) = files.get_mut("domain.pddl")?;
    *text = mends::all_closed(text)?;
    let domain = from_files(files, Some(folder.to_path_buf())).ok()?;
    Some(descry_domains::check::grounding(&domain))
}

/// Findings of a domain's folder, as from `descry check DIR`, and the grounding of its symbols if the
/// folder is readable.
fn of_folder(texts: &Texts, folder: &Path) -> (BTreeMap<PathBuf, Vec<Shown>>, Option<Vec<String>>) {
    let files = units::files(texts, folder);
    let mut all: BTreeMap<PathBuf, Vec<Shown>> =
        files.values().map(|(name, _)| (PathBuf::from(name), Vec::new())).collect();
    let loaded = from_files(files.clone(), Some(folder.to_path_buf()));
    let mut known = None;
    match crate::findings::of_folder(loaded) {
        Ok((findings, grounding)) => {
            known = Some(grounding).filter(|grounding| !grounding.is_empty());
            let mut said = by_file(&findings);
            // Beside a fault of `domain.toml` those of the PDDL are worth their place.
            if findings.has_errors()
                && let Some(domain) = units::source(texts, &folder.join("domain.pddl"))
            {
                said.entry(folder.join("domain.pddl")).or_insert_with(|| {
                    by_file(&descry_planner::check(&domain, None)).into_values().flatten().collect()
                });
            }
            all.extend(said);
        }
        Err(error) => {
            let (file, at, said) = of_error(folder, &files, &error);
            let text = files.values().find(|(name, _)| Path::new(name) == file).map_or("", |(_, text)| text);
            let finding = Diagnostic::error("unreadable", said, at, "");
            all.entry(file).or_default().push(shown(&finding, text, None));
            if let Some(domain) = units::source(texts, &folder.join("domain.pddl")) {
                for (file, said) in by_file(&descry_planner::check(&domain, None)) {
                    all.entry(file).or_default().extend(said);
                }
            }
        }
    }
    (all, known)
}

/// Place and message of an error other than a finding.
fn of_error(
    folder: &Path,
    files: &descry_domains::load::Files,
    error: &LoadError,
) -> (PathBuf, Span, String) {
    let whole = |path: &str| (PathBuf::from(path), Span::default());
    let first = folder.join("domain.toml");
    match error {
        LoadError::File { path, because, expected } => {
            let (file, span) = if files.values().any(|(name, _)| name == path) {
                whole(path)
            } else {
                (first, Span::default())
            };
            (file, span, format!("{path}: {because}\nexpected: {expected}"))
        }
        other => (first, Span::default(), other.to_string()),
    }
}

/// Groups findings by file.
fn by_file(findings: &Findings) -> BTreeMap<PathBuf, Vec<Shown>> {
    let mut all: BTreeMap<PathBuf, Vec<Shown>> =
        findings.sources.iter().map(|source| (PathBuf::from(&source.name), Vec::new())).collect();
    for finding in &findings.list {
        let at = finding.labels.first().map_or(0, |label| label.span.source as usize);
        let Some(source) = findings.sources.get(at) else { continue };
        let said = shown(finding, &source.text, Some(findings));
        all.entry(PathBuf::from(&source.name)).or_default().push(said);
    }
    all
}

/// Converts a finding to a diagnostic.
fn shown(finding: &Diagnostic, text: &str, all: Option<&Findings>) -> Shown {
    let first = finding.labels.first();
    let range = Lines::of(text).range(first.map_or(Span::default(), |label| label.span));
    let mut message = finding.message.clone();
    if let Some(label) = first.filter(|label| !matches!(label.text.as_str(), "" | "here")) {
        message += &format!("\n{}", label.text);
    }
    if let Some(help) = &finding.help {
        message += &format!("\nhelp: {help}");
    }
    let related = |label: &descry_planner::Label| {
        let source = all?.sources.get(label.span.source as usize)?;
        let range = Lines::of(&source.text).range(label.span);
        let location = Location { uri: uri_of(Path::new(&source.name))?, range };
        Some(DiagnosticRelatedInformation { location, message: label.text.clone() })
    };
    let related: Vec<_> = finding.labels.iter().skip(1).filter_map(related).collect();
    Shown {
        range,
        severity: Some(match finding.severity {
            Severity::Error => DiagnosticSeverity::ERROR,
            Severity::Warning => DiagnosticSeverity::WARNING,
        }),
        code: Some(NumberOrString::String(finding.code.into())),
        source: Some("descry".into()),
        message,
        related_information: (!related.is_empty()).then_some(related),
        data: mends::of(finding, text),
        ..Shown::default()
    }
}
