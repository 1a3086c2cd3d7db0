//! The mends that findings offer, as an editor carries them out.

use descry_planner::{Diagnostic, Span};
use lsp_types::{
    CodeAction, CodeActionKind, CodeActionOrCommand, CodeActionParams, CodeActionResponse, TextEdit,
    WorkspaceEdit,
};
use serde::{Deserialize, Serialize};

use super::texts::Lines;

/// A mend, as it goes to the editor with a finding and comes back with a question about it.
#[derive(Debug, Serialize, Deserialize)]
struct Mend {
    /// Title of the mend.
    title: String,
    /// Replacements.
    edits: Vec<TextEdit>,
}

/// The mend that a finding about a text offers, for the editor to keep; none if it offers none.
pub fn of(finding: &Diagnostic, text: &str) -> Option<serde_json::Value> {
    let mend = meant(finding, text).or_else(|| closed(finding, text))?;
    serde_json::to_value(mend).ok()
}

/// `did you mean …`: that, wherever the finding points at what was written.
fn meant(finding: &Diagnostic, text: &str) -> Option<Mend> {
    let (_, rest) = finding.help.as_ref()?.split_once("did you mean `")?;
    let meant = rest.split('`').next()?;
    let first = finding.labels.first()?.span;
    let at = |span: Span| text.get(span.start as usize..span.end as usize);
    let written = at(first)?;
    // A finding may point at more than the word that is to be another.
    if written.is_empty() || written.contains(char::is_whitespace) || written.contains('"') {
        return None;
    }
    let lines = Lines::of(text);
    let same = |span: &Span| span.source == first.source && at(*span) == Some(written);
    let places = finding.labels.iter().map(|label| label.span).filter(same);
    let edits = places.map(|span| TextEdit { range: lines.range(span), new_text: meant.into() }).collect();
    Some(Mend { title: format!("Write `{meant}`"), edits })
}

/// A missing sign, before what shows that it is missing.
fn closed(finding: &Diagnostic, text: &str) -> Option<Mend> {
    let (end, signs) = missing(finding, text)?;
    let range = Lines::of(text).range(Span { source: 0, start: end as u32, end: end as u32 });
    let title = format!("Add `{signs}`");
    Some(Mend { title, edits: vec![TextEdit { range, new_text: signs }] })
}

/// A text in PDDL with every list closed that is open; none if none is.
pub fn all_closed(text: &str) -> Option<String> {
    let findings = descry_planner::check(&descry_planner::Source::new("", text), None);
    let mut closed = text.to_string();
    let mut missing: Vec<(usize, String)> = findings.list.iter().filter_map(|f| missing(f, text)).collect();
    missing.sort();
    missing.iter().rev().for_each(|(at, signs)| closed.insert_str(*at, signs));
    (!missing.is_empty()).then_some(closed)
}

/// Place and text of missing signs.
fn missing(finding: &Diagnostic, text: &str) -> Option<(usize, String)> {
    let (_, rest) = finding.help.as_ref()?.split_once("add `")?;
    let sign = rest.split('`').next().filter(|sign| matches!(*sign, ")" | "]"))?;
    let many = finding.message.split(' ').next().and_then(|n| n.parse().ok()).unwrap_or(1);
    let next = finding.labels.get(1).map_or(text.len(), |label| label.span.start as usize);
    let end = end_of_code(text.get(..next)?);
    Some((end, sign.repeat(many)))
}

/// End of the last line of code: the last line that has more than blanks and a comment.
fn end_of_code(text: &str) -> usize {
    let mut end = 0;
    let mut start = 0;
    for line in text.split_inclusive('\n') {
        let code = line.split(';').next().unwrap_or_default().trim_end();
        // What an opening sign follows belongs to what comes next.
        let code = code.strip_suffix('(').map_or(code, str::trim_end);
        if !code.is_empty() {
            end = start + code.len();
        }
        start += line.len();
    }
    end
}

/// Code actions for the findings that an editor asks about.
pub fn actions(params: &CodeActionParams) -> CodeActionResponse {
    let action = |shown: &lsp_types::Diagnostic| {
        let mend: Mend = serde_json::from_value(shown.data.clone()?).ok()?;
        let uri = params.text_document.uri.clone();
        let edit = WorkspaceEdit { changes: Some([(uri, mend.edits)].into()), ..WorkspaceEdit::default() };
        Some(CodeActionOrCommand::CodeAction(CodeAction {
            title: mend.title,
            kind: Some(CodeActionKind::QUICKFIX),
            diagnostics: Some(vec![shown.clone()]),
            edit: Some(edit),
            is_preferred: Some(true),
            ..CodeAction::default()
        }))
    };
    params.context.diagnostics.iter().filter_map(action).collect()
}
