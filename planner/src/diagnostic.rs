//! Diagnostics: faults found in a text, each with its place and, where known, a remedy.

mod excerpt;

use serde::Serialize;

/// Named source text (domain, problem or plan); messages use the name, usually the path.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct Source {
    /// Name of the text in messages.
    pub name: String,
    /// Source text.
    pub text: String,
}

impl Source {
    /// Creates a source. A lone carriage return in the text counts as a line end.
    pub fn new(name: impl Into<String>, text: impl Into<String>) -> Self {
        Self { name: name.into(), text: with_line_feeds(text.into()) }
    }
}

/// Text with lone carriage returns replaced by line feeds; byte positions are unchanged.
fn with_line_feeds(text: String) -> String {
    if !text.contains('\r') {
        return text;
    }
    let mut parts = text.split('\r');
    let mut mended = parts.next().unwrap_or_default().to_string();
    for part in parts {
        mended.push(if part.starts_with('\n') { '\r' } else { '\n' });
        mended.push_str(part);
    }
    mended
}

/// Byte range `start..end` in source number `source` of a task (0 is the domain, 1 the problem).
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Default, Serialize)]
pub struct Span {
    /// Index of the source in the list of sources.
    pub source: u32,
    /// Byte offset of the first byte.
    pub start: u32,
    /// Byte offset after the last byte.
    pub end: u32,
}

impl Span {
    /// Smallest span that covers both; the two must lie in the same source.
    pub fn to(self, other: Span) -> Span {
        Span { source: self.source, start: self.start.min(other.start), end: self.end.max(other.end) }
    }
}

/// Severity of a finding.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Severity {
    /// Error: the text has no meaning, or certainly not the intended one.
    Error,
    /// Warning: the text is usable, but probably not as intended.
    Warning,
}

/// Span with a message.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct Label {
    /// Span of the label.
    pub span: Span,
    /// Message at the span.
    pub text: String,
}

/// Finding: message, spans that show the fault, and a remedy if one is known.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct Diagnostic {
    /// Error or warning.
    pub severity: Severity,
    /// Stable code of the finding's kind, such as `undeclared-predicate`.
    pub code: &'static str,
    /// The fault in one sentence, without the place.
    pub message: String,
    /// Places with messages; the finding is reported at the first.
    pub labels: Vec<Label>,
    /// Suggested remedy, if one is known.
    pub help: Option<String>,
}

impl Diagnostic {
    /// Creates an error with one labelled span.
    pub fn error(
        code: &'static str,
        message: impl Into<String>,
        span: Span,
        label: impl Into<String>,
    ) -> Self {
        Self::new(Severity::Error, code, message, span, label)
    }

    /// Creates a warning with one labelled span.
    pub fn warning(
        code: &'static str,
        message: impl Into<String>,
        span: Span,
        label: impl Into<String>,
    ) -> Self {
        Self::new(Severity::Warning, code, message, span, label)
    }

    fn new(
        severity: Severity,
        code: &'static str,
        message: impl Into<String>,
        span: Span,
        label: impl Into<String>,
    ) -> Self {
        let labels = vec![Label { span, text: label.into() }];
        Self { severity, code, message: message.into(), labels, help: None }
    }

    /// Adds a span with a message.
    pub fn with_label(mut self, span: Span, text: impl Into<String>) -> Self {
        self.labels.push(Label { span, text: text.into() });
        self
    }

    /// Adds a suggested remedy.
    pub fn with_help(mut self, help: impl Into<String>) -> Self {
        self.help = Some(help.into());
        self
    }
}

/// All findings of one reading of a task, in text order, with the sources that the spans point
/// into.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Findings {
    /// Source texts; a span's `source` is the index here.
    pub sources: Vec<Source>,
    /// Findings in text order.
    pub list: Vec<Diagnostic>,
}

impl Findings {
    /// True if there is at least one error; warnings do not count.
    pub fn has_errors(&self) -> bool {
        self.list.iter().any(|finding| finding.severity == Severity::Error)
    }

    /// True if there are no findings.
    pub fn is_empty(&self) -> bool {
        self.list.is_empty()
    }
}

impl Findings {
    /// Renders the findings under their source text, with or without colour; very long lines are
    /// cut around the span.
    pub fn render(&self, colour: bool) -> String {
        let mut drawn = Vec::new();
        let names: Vec<String> = self.sources.iter().map(|source| source.name.clone()).collect();
        let (short, long): (Vec<&Diagnostic>, Vec<&Diagnostic>) =
            self.list.iter().partition(|finding| !excerpt::is_needed(&self.sources, finding));
        let wanted = |index: usize| {
            short.iter().any(|finding| finding.labels.iter().any(|label| label.span.source as usize == index))
        };
        let texts = self.sources.iter().enumerate().filter(|(index, _)| wanted(*index));
        let texts: Vec<_> = texts.map(|(_, source)| (source.name.clone(), source.text.clone())).collect();
        let mut cache = ariadne::sources(texts);
        for finding in &self.list {
            if !drawn.is_empty() {
                drawn.push(b'\n');
            }
            if long.iter().any(|other| std::ptr::eq(*other, finding)) {
                drawn.extend(excerpt::draw(&self.sources, finding).bytes());
            } else {
                // Writing to memory does not fail.
                let _ = report(finding, &names, colour).write(&mut cache, &mut drawn);
            }
        }
        let text = String::from_utf8_lossy(&drawn);
        text.lines().map(|line| format!("{}\n", line.trim_end())).collect()
    }

    /// File name, line and column (both from 1) of a span's start; `("", 1, 1)` if the source is
    /// unknown.
    pub fn place(&self, span: Span) -> (&str, usize, usize) {
        let Some(source) = self.sources.get(span.source as usize) else { return ("", 1, 1) };
        let (line, column) = excerpt::line_and_column(&source.text, span.start as usize);
        (&source.name, line, column)
    }
}

/// Serialises findings as a list, each span with file, line and column (from 1) and byte range.
impl Serialize for Findings {
    fn serialize<S: serde::Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        #[derive(Serialize)]
        struct Place<'f> {
            file: &'f str,
            line: usize,
            column: usize,
            start: u32,
            end: u32,
            text: &'f str,
        }
        #[derive(Serialize)]
        struct One<'f> {
            severity: Severity,
            code: &'static str,
            message: &'f str,
            labels: Vec<Place<'f>>,
            help: Option<&'f str>,
        }
        serializer.collect_seq(self.list.iter().map(|finding| {
            One {
                severity: finding.severity,
                code: finding.code,
                message: &finding.message,
                labels: finding
                    .labels
                    .iter()
                    .map(|label| {
                        let (file, line, column) = self.place(label.span);
                        Place {
                            file,
                            line,
                            column,
                            start: label.span.start,
                            end: label.span.end,
                            text: &label.text,
                        }
                    })
                    .collect(),
                help: finding.help.as_deref(),
            }
        }))
    }
}

impl std::fmt::Display for Findings {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(&self.render(false))
    }
}

impl std::error::Error for Findings {}

type Place = (String, std::ops::Range<usize>);

fn report(finding: &Diagnostic, names: &[String], colour: bool) -> ariadne::Report<'static, Place> {
    use ariadne::{Color, Config, IndexType, ReportKind};
    let place = |span: Span| -> Place {
        let name = names.get(span.source as usize).cloned().unwrap_or_default();
        (name, span.start as usize..span.end as usize)
    };
    let (kind, hue) = match finding.severity {
        Severity::Error => (ReportKind::Error, Color::Red),
        Severity::Warning => (ReportKind::Warning, Color::Yellow),
    };
    let first = finding.labels.first().map_or(Span::default(), |label| label.span);
    let mut report = ariadne::Report::build(kind, place(first))
        .with_config(Config::default().with_color(colour).with_index_type(IndexType::Byte))
        .with_code(finding.code)
        .with_message(&finding.message);
    let mut labels: Vec<(usize, &Label)> = finding.labels.iter().enumerate().collect();
    labels.sort_by_key(|(_, label)| (label.span.source != first.source, label.span));
    for (number, label) in labels {
        let hue = if number == 0 { hue } else { Color::Cyan };
        let mut drawn = ariadne::Label::new(place(label.span)).with_color(hue);
        if !label.text.is_empty() {
            drawn = drawn.with_message(&label.text);
        }
        report = report.with_label(drawn);
    }
    if let Some(help) = &finding.help {
        report = report.with_help(help);
    }
    report.finish()
}
