//! Declarations of a PDDL text, and the symbols in it.

use descry_planner::Span;
use descry_planner::pddl::ast::{Name, Signature, Typed};
use descry_planner::pddl::lex::Symbols;
use descry_planner::pddl::parse;
use lsp_types::{CompletionItemKind, SymbolKind};

/// Kind of a declaration.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Kind {
    /// A predicate.
    Predicate,
    /// A function.
    Function,
    /// A module, whose calls are answered by attachments.
    Module,
    /// An action.
    Action,
    /// A type.
    Type,
    /// An object or constant.
    Object,
}

impl Kind {
    /// Symbol kind in an outline.
    pub fn symbol(self) -> SymbolKind {
        match self {
            Kind::Predicate => SymbolKind::BOOLEAN,
            Kind::Function => SymbolKind::NUMBER,
            Kind::Module => SymbolKind::INTERFACE,
            Kind::Action => SymbolKind::FUNCTION,
            Kind::Type => SymbolKind::CLASS,
            Kind::Object => SymbolKind::OBJECT,
        }
    }

    /// Item kind in completions.
    pub fn item(self) -> CompletionItemKind {
        match self {
            Kind::Predicate => CompletionItemKind::PROPERTY,
            Kind::Function => CompletionItemKind::FIELD,
            Kind::Module => CompletionItemKind::INTERFACE,
            Kind::Action => CompletionItemKind::FUNCTION,
            Kind::Type => CompletionItemKind::CLASS,
            Kind::Object => CompletionItemKind::CONSTANT,
        }
    }

    /// Name of the kind.
    pub fn word(self) -> &'static str {
        match self {
            Kind::Predicate => "predicate",
            Kind::Function => "function",
            Kind::Module => "module",
            Kind::Action => "action",
            Kind::Type => "type",
            Kind::Object => "object",
        }
    }
}

/// A declaration.
#[derive(Debug, Clone)]
pub struct Declared {
    /// The name, in lower case.
    pub name: String,
    /// Kind of the declaration.
    pub kind: Kind,
    /// Span of the name.
    pub span: Span,
    /// Span of the whole declaration.
    pub whole: Span,
}

/// Declarations of a domain or a problem, in the order of the kinds.
pub fn of(text: &str, is_problem: bool) -> Vec<Declared> {
    let mut symbols = Symbols::default();
    let mut all: Vec<(Kind, Name, Span)> = Vec::new();
    if is_problem {
        let problem = parse::problem(text, 0, &mut symbols, &mut Vec::new());
        all.extend(typed(Kind::Object, &problem.objects));
    } else {
        let domain = parse::domain(text, 0, &mut symbols, &mut Vec::new());
        let whole = |s: &Signature| list_around(text, s.name.span);
        all.extend(domain.predicates.iter().map(|p| (Kind::Predicate, p.name, whole(p))));
        all.extend(domain.derived.iter().map(|d| (Kind::Predicate, d.head.name, d.span)));
        all.extend(domain.functions.iter().map(|f| (Kind::Function, f.signature.name, whole(&f.signature))));
        all.extend(domain.modules.iter().map(|m| (Kind::Module, m.signature.name, whole(&m.signature))));
        all.extend(domain.actions.iter().map(|a| (Kind::Action, a.name, list_around(text, a.name.span))));
        all.extend(typed(Kind::Type, &domain.types));
        all.extend(typed(Kind::Object, &domain.constants));
    }
    let declared = |(kind, name, whole): (Kind, Name, Span)| Declared {
        name: symbols.name(name.symbol).to_string(),
        kind,
        span: name.span,
        whole,
    };
    all.into_iter().map(declared).collect()
}

fn typed(kind: Kind, all: &[Typed]) -> impl Iterator<Item = (Kind, Name, Span)> {
    all.iter().map(move |t| (kind, t.name, t.types.iter().fold(t.name.span, |span, of| span.to(of.span))))
}

/// Span of the innermost parenthesised list around a span.
pub fn list_around(text: &str, span: Span) -> Span {
    let bytes = text.as_bytes();
    let mut depth = 0_i32;
    let start = (0..span.start as usize).rev().find(|&at| match bytes[at] {
        b')' => {
            depth += 1;
            false
        }
        b'(' if depth == 0 => true,
        b'(' => {
            depth -= 1;
            false
        }
        _ => false,
    });
    let Some(start) = start else { return span };
    let mut depth = 0_i32;
    let mut in_comment = false;
    for (at, byte) in bytes.iter().enumerate().skip(start) {
        match byte {
            b'\n' => in_comment = false,
            b';' => in_comment = true,
            b'(' if !in_comment => depth += 1,
            b')' if !in_comment => depth -= 1,
            _ => {}
        }
        if depth == 0 && !in_comment {
            return Span { source: span.source, start: start as u32, end: at as u32 + 1 };
        }
    }
    Span { source: span.source, start: start as u32, end: text.len() as u32 }
}

/// Comment lines right above a span, and the comment at the end of its line.
pub fn comments(text: &str, span: Span) -> Vec<String> {
    let start = text[..span.start as usize].rfind('\n').map_or(0, |at| at + 1);
    let mut above: Vec<String> = Vec::new();
    for line in text[..start].lines().rev() {
        match line.trim_start().strip_prefix(';') {
            Some(comment) => above.push(comment.trim_start_matches(';').trim().to_string()),
            None => break,
        }
    }
    above.reverse();
    let line = text[start..].lines().next().unwrap_or_default();
    above.extend(line.split_once(';').map(|(_, comment)| comment.trim_start_matches(';').trim().to_string()));
    above
}

/// Symbol around a byte offset, between delimiters: its start (byte offset) and text.
pub fn word_at(text: &str, at: usize) -> (usize, &str) {
    let is_part = |c: char| !c.is_whitespace() && !"()[]{};\"'=,<>".contains(c);
    let start =
        text[..at].char_indices().rev().take_while(|(_, c)| is_part(*c)).last().map_or(at, |(n, _)| n);
    let rest = &text[start..];
    let end = rest.find(|c: char| !is_part(c)).unwrap_or(rest.len());
    (start, &rest[..end])
}
