//! Quick fixes for findings.

use descry_planner::{Diagnostic, Span};
use lsp_types::{
    CodeAction, CodeActionKind, CodeActionOrCommand, CodeActionParams, CodeActionResponse, TextEdit,
    WorkspaceEdit,
};
use serde::{Deserialize, Serialize};

use super::texts::Lines;

/// A quick fix; travels to the editor within the diagnostic and returns with a request for code actions.
#[derive(Debug, Serialize, Deserialize)]
struct Mend {
    /// Title of the fix.
    title: String,
    /// Edits of the text in which the finding is.
    edits: Vec<TextEdit>,
}

/// Fix for a finding, as data of its diagnostic; `None` if there is no fix.
pub fn of(finding: &Diagnostic, text: &str) -> Option<serde_json::Value> {
    let mend = meant(finding, text).or_else(|| closed(finding, text))?;
    serde_json::to_value(mend).ok()
}

/// Fix for `did you mean …`, at every place that the finding points at.
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

/// Fix for missing closing brackets, inserted at the end of the code before the place that reveals them.
fn closed(finding: &Diagnostic, text: &str) -> Option<Mend> {
    let (end, signs) = missing(finding, text)?;
    let range = Lines::of(text).range(Span { source: 0, start: end as u32, end: end as u32 });
    let title = format!("Add `{signs}`");
    Some(Mend { title, edits: vec![TextEdit { range, new_text: signs }] })
}

/// PDDL text with every open list closed; `None` if all are closed.
pub fn all_closed(text: &str) -> Option<String> {
    let findings = descry_planner::check(&descry_planner::Source::new("", text), None);
    let mut closed = text.to_string();
    let mut missing: Vec<(usize, String)> = findings.list.iter().filter_map(|f| missing(f, text)).collect();
    missing.sort();
    missing.iter().rev().for_each(|(at, signs)| closed.insert_str(*at, signs));
    (!missing.is_empty()).then_some(closed)
}

/// Byte offset and text of the closing brackets that a finding reports missing.
fn missing(finding: &Diagnostic, text: &str) -> Option<(usize, String)> {
    let (_, rest) = finding.help.as_ref()?.split_once("add `")?;
    let sign = rest.split('`').next().filter(|sign| matches!(*sign, ")" | "]"))?;
    let many = finding.message.split(' ').next().and_then(|n| n.parse().ok()).unwrap_or(1);
    let next = finding.labels.get(1).map_or(text.len(), |label| label.span.start as usize);
    let end = end_of_code(text.get(..next)?);
    Some((end, sign.repeat(many)))
}

/// End of the last line with more than blanks and a comment, byte offset.
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

/// Code actions for the diagnostics in a request.
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
