//! Answers about a symbol: meaning, grounding, declaration, and completions.

use std::path::{Path, PathBuf};

use descry_planner::pddl::parse::{ACTION_PARTS, DOMAIN_SECTIONS, PROBLEM_SECTIONS};
use descry_planner::{Source, Span};
use lsp_types::{
    CompletionItem, CompletionItemKind, CompletionResponse, CompletionTextEdit, DocumentSymbol,
    DocumentSymbolResponse, GotoDefinitionResponse, Hover, HoverContents, Location, MarkupContent,
    MarkupKind, Position, Range, TextDocumentPositionParams, TextEdit, Uri,
};

use super::declared::{self, Declared, Kind, word_at};
use super::findings::Told;
use super::keys;
use super::texts::{Lines, Texts, offset, path_of, uri_of};
use super::units::{self, Unit};

/// Keywords of conditions and effects.
const JOINING: [&str; 13] = [
    "and", "or", "not", "imply", "forall", "exists", "when", "at start", "at end", "over all", "increase",
    "decrease", "assign",
];

/// Declarations in scope of a text, by file: path, text and declarations. A problem has its own and
/// those of its domain in scope, a plan and a file of a folder those of the domain.
fn in_scope(texts: &Texts, path: &Path, text: &str) -> Vec<(PathBuf, String, Vec<Declared>)> {
    let unit = units::of(texts, path, text);
    let mut files: Vec<(PathBuf, bool)> = Vec::new();
    match &unit {
        Unit::Folder(folder) => files.push((folder.join("domain.pddl"), false)),
        Unit::Domain => files.push((path.to_path_buf(), false)),
        Unit::Problem => {
            files.push((path.to_path_buf(), true));
            files.extend(units::domain_of(texts, path, text).map(|domain| (domain, false)));
        }
        Unit::Plan => files.extend(units::domain_of_plan(texts, path).map(|domain| (domain, false))),
        Unit::Other => {}
    }
    let read = |(file, is_problem): (PathBuf, bool)| {
        let text = texts.text(&file)?;
        let declared = declared::of(&text, is_problem);
        Some((file, text, declared))
    };
    files.into_iter().filter_map(read).collect()
}

struct Here {
    path: PathBuf,
    text: String,
    at: usize,
}

fn here(texts: &Texts, at: &TextDocumentPositionParams) -> Option<Here> {
    let path = path_of(&at.text_document.uri);
    let text = texts.text(&path)?;
    let at = offset(&text, at.position);
    Some(Here { path, text, at })
}

/// Hover text of a symbol: its declaration with comments and its grounding in a domain's folder, or the
/// meaning of a TOML heading or key.
pub fn hover(texts: &Texts, told: &Told, at: &TextDocumentPositionParams) -> Option<Hover> {
    let Here { path, text, at } = here(texts, at)?;
    let key = units::part_of(&path).and_then(|part| keys::here(part, &text, at));
    let (start, word) = key.as_ref().map_or_else(|| word_at(&text, at), |key| key.name);
    let meaning = key.as_ref().map(|key| key.meaning.clone()).filter(|meaning| !meaning.is_empty());
    // A key is no word of the domain, however it is called.
    let parts = match meaning {
        Some(meaning) => vec![meaning],
        None => about(texts, told, (&path, &text), &word.to_lowercase()),
    };
    if parts.is_empty() {
        return None;
    }
    let range = Lines::of(&text).range(span(start, start + word.len()));
    let contents = MarkupContent { kind: MarkupKind::Markdown, value: parts.join("\n\n") };
    Some(Hover { contents: HoverContents::Markup(contents), range: Some(range) })
}

/// Documentation of a name in scope.
fn about(texts: &Texts, told: &Told, (path, text): (&Path, &str), name: &str) -> Vec<String> {
    const LONGEST: usize = 2_000;
    let mut parts: Vec<String> = Vec::new();
    for (_, text, declared) in in_scope(texts, path, text) {
        for one in declared.iter().filter(|d| d.name == name) {
            let whole: String =
                text[one.whole.start as usize..one.whole.end as usize].chars().take(LONGEST).collect();
            parts.push(format!("{}\n```pddl\n{whole}\n```", one.kind.word()));
            let comments = declared::comments(&text, one.span);
            parts.extend((!comments.is_empty()).then(|| comments.join("\n")));
        }
    }
    if let Unit::Folder(folder) = units::of(texts, path, text) {
        let is_it = |line: &&String| {
            let line = line.trim_start();
            let named = |open: char, close: char| {
                let rest = line.strip_prefix(open).and_then(|l| l.strip_prefix(name));
                rest.is_some_and(|rest| rest.starts_with([' ', close]))
            };
            named('(', ')') || named('[', ']')
        };
        let said = told.grounding(&folder).iter().filter(is_it);
        parts.extend(said.map(|line| line.split_whitespace().collect::<Vec<_>>().join(" ")));
    }
    parts
}

fn span(start: usize, end: usize) -> Span {
    Span { source: 0, start: start as u32, end: end as u32 }
}

/// Place of the declaration of a symbol, or of the first occurrence of a variable; `None` if there is
/// none.
pub fn definition(texts: &Texts, at: &TextDocumentPositionParams) -> Option<GotoDefinitionResponse> {
    let Here { path, text, at } = here(texts, at)?;
    let (start, word) = word_at(&text, at);
    if word.starts_with('?') {
        let around = section(&text, start);
        let first = variables(&text, around).into_iter().find(|(_, name)| name.eq_ignore_ascii_case(word))?.0;
        let range = Lines::of(&text).range(span(first, first + word.len()));
        return Some(GotoDefinitionResponse::Scalar(Location { uri: uri_of(&path)?, range }));
    }
    let name = word.to_lowercase();
    let mut found = Vec::new();
    for (file, text, declared) in in_scope(texts, &path, &text) {
        let lines = Lines::of(&text);
        for one in declared.iter().filter(|d| d.name == name) {
            found.push(Location { uri: uri_of(&file)?, range: lines.range(one.span) });
        }
    }
    (!found.is_empty()).then_some(GotoDefinitionResponse::Array(found))
}

/// Byte range of the section of a definition around an offset: from a `(:` to the next.
fn section(text: &str, at: usize) -> std::ops::Range<usize> {
    let start = text[..at].rfind("(:").unwrap_or(0);
    let end = text[at..].find("(:").map_or(text.len(), |n| at + n);
    start..end
}

/// Variables in a part of a text, each with the byte offset of its first occurrence.
fn variables(text: &str, part: std::ops::Range<usize>) -> Vec<(usize, &str)> {
    let mut found: Vec<(usize, &str)> = Vec::new();
    for (at, _) in text[part.clone()].match_indices('?') {
        let (_, word) = word_at(text, part.start + at + 1);
        if word.len() > 1 && !found.iter().any(|(_, known)| known.eq_ignore_ascii_case(word)) {
            found.push((part.start + at, word));
        }
    }
    found
}

/// Completions at a position in a text.
pub fn completion(texts: &Texts, at: &TextDocumentPositionParams) -> Option<CompletionResponse> {
    let Here { path, text, at } = here(texts, at)?;
    let (start, _) = word_at(&text, at);
    let typed = &text[start..at];
    let before = text[..start].trim_end();
    let is_toml = path.extension().is_some_and(|e| e == "toml");
    // Said in full, since editors do not agree on whether `?` and `:` belong to a word.
    let typed_at = Lines::of(&text).range(span(start, at));
    let mut items: Vec<CompletionItem> = Vec::new();
    let mut add = |label: &str, kind: CompletionItemKind, detail: &str| {
        if !items.iter().any(|known| known.label == label) {
            let detail = Some(detail.to_string()).filter(|d| !d.is_empty());
            items.push(CompletionItem {
                label: label.into(),
                kind: Some(kind),
                detail,
                text_edit: Some(CompletionTextEdit::Edit(TextEdit {
                    range: typed_at,
                    new_text: label.into(),
                })),
                ..CompletionItem::default()
            });
        }
    };
    if typed.starts_with('?') {
        let all = variables(&text, section(&text, start)).into_iter().filter(|(at, _)| *at != start);
        all.for_each(|(_, name)| add(name, CompletionItemKind::VARIABLE, ""));
        return Some(CompletionResponse::Array(items));
    }
    if typed.starts_with(':') {
        let sections: [&[&str]; 2] = [DOMAIN_SECTIONS, PROBLEM_SECTIONS];
        let parts: &[&[&str]] = if before.ends_with('(') { &sections } else { &[ACTION_PARTS] };
        parts.iter().copied().flatten().for_each(|word| add(word, CompletionItemKind::KEYWORD, ""));
        return Some(CompletionResponse::Array(items));
    }
    let wanted: &[Kind] = match before.chars().last() {
        _ if is_toml => {
            &[Kind::Predicate, Kind::Function, Kind::Module, Kind::Action, Kind::Type, Kind::Object]
        }
        Some('[') => &[Kind::Module],
        Some('-') => &[Kind::Type],
        Some('(') if units::of(texts, &path, &text) == Unit::Plan => &[Kind::Action],
        Some('(') => &[Kind::Predicate, Kind::Function],
        _ => &[Kind::Object, Kind::Type],
    };
    for (_, text, declared) in in_scope(texts, &path, &text) {
        for one in declared.iter().filter(|d| wanted.contains(&d.kind)) {
            let whole = &text[one.whole.start as usize..one.whole.end as usize];
            let first = whole.lines().next().unwrap_or_default();
            add(&one.name, one.kind.item(), &first.split_whitespace().collect::<Vec<_>>().join(" "));
        }
    }
    if is_toml {
        for ability in descry_domains::abilities::ALL {
            add(ability.name, CompletionItemKind::MODULE, ability.about);
            ability.skills.iter().for_each(|s| add(s.name, CompletionItemKind::FUNCTION, s.about));
        }
    } else if before.ends_with('(') {
        JOINING.iter().for_each(|word| add(word, CompletionItemKind::KEYWORD, ""));
    }
    Some(CompletionResponse::Array(items))
}

/// Formatting of a text as one edit; no edit if formatted already, `None` for TOML and JSON files and
/// for texts that cannot be parsed.
pub fn formatting(texts: &Texts, uri: &Uri) -> Option<Vec<TextEdit>> {
    let path = path_of(uri);
    let text = texts.text(&path)?;
    if path.extension().is_some_and(|e| e == "toml" || e == "json") {
        return None;
    }
    let laid_out = crate::layout::laid_out(&Source::new(path.display().to_string(), text.as_str())).ok()?;
    if laid_out == text {
        return Some(Vec::new());
    }
    let range = Range::new(Position::new(0, 0), Lines::of(&text).position(text.len()));
    Some(vec![TextEdit { range, new_text: laid_out }])
}

/// Outline: the declarations of a text, or the tables of a TOML file.
pub fn symbols(texts: &Texts, uri: &Uri) -> Option<DocumentSymbolResponse> {
    let path = path_of(uri);
    let text = texts.text(&path)?;
    let lines = Lines::of(&text);
    // `deprecated` has to be given, and is itself deprecated.
    #[allow(deprecated)]
    let symbol = |name: String, kind, detail: &str, whole: Span, own: Span| DocumentSymbol {
        name,
        detail: Some(detail.to_string()),
        kind,
        tags: None,
        deprecated: None,
        range: lines.range(whole),
        selection_range: lines.range(own),
        children: None,
    };
    let mut all: Vec<DocumentSymbol> = if path.extension().is_some_and(|e| e == "toml") {
        let mut at = 0;
        let tables = text.split_inclusive('\n').filter_map(|line| {
            let start = at;
            at += line.len();
            let name = line.trim_end().strip_prefix('[')?.split(']').next()?.trim_start_matches('[').trim();
            let place = span(start, start + line.trim_end().len());
            Some(symbol(name.to_string(), lsp_types::SymbolKind::NAMESPACE, "", place, place))
        });
        tables.collect()
    } else {
        let is_problem = units::of(texts, &path, &text) == Unit::Problem;
        let declared = declared::of(&text, is_problem);
        declared
            .into_iter()
            .map(|d| symbol(d.name, d.kind.symbol(), d.kind.word(), d.whole, d.span))
            .collect()
    };
    all.sort_by_key(|s| (s.range.start.line, s.range.start.character));
    Some(DocumentSymbolResponse::Nested(all))
}
