//! Lexer: turns a text into a tree of lists and words, and repairs unbalanced parentheses.
//!
//! The tree is flat: nodes in the order of the text, each with the index just after its last
//! descendant. Unbalanced parentheses are found here, where the indentation still shows which one
//! is meant, and repaired so that the rest of the file is read as its author intended.

use rustc_hash::{FxHashMap, FxHashSet};

use super::ast::Symbol;
use crate::diagnostic::{Diagnostic, Span};

/// Maximum nesting depth of lists. It bounds the stack of all recursion over the tree.
pub const MAX_DEPTH: usize = 200;

/// Table of case-folded names (interner), shared by the files of a task.
#[derive(Debug, Default)]
pub struct Symbols {
    names: Vec<Box<str>>,
    index: FxHashMap<Box<str>, Symbol>,
    folded: String,
    predicates: FxHashSet<Symbol>,
}

impl Symbols {
    /// Symbol of a name in any case; adds new names.
    pub fn intern(&mut self, name: &str) -> Symbol {
        let name = if name.bytes().any(|byte| byte.is_ascii_uppercase()) {
            self.folded.clear();
            self.folded.extend(name.chars().map(|letter| letter.to_ascii_lowercase()));
            self.folded.as_str()
        } else {
            name
        };
        if let Some(&symbol) = self.index.get(name) {
            return symbol;
        }
        let symbol = Symbol(self.names.len() as u32);
        self.names.push(name.into());
        self.index.insert(name.into(), symbol);
        symbol
    }

    /// Symbol of a case-folded name; `None` if the name has not occurred yet.
    pub fn find(&self, name: &str) -> Option<Symbol> {
        self.index.get(name).copied()
    }

    /// Case-folded name of a symbol.
    pub fn name(&self, symbol: Symbol) -> &str {
        &self.names[symbol.0 as usize]
    }

    /// Records the predicate names that a domain declares, so that these are not taken for misspelt
    /// connectives.
    pub fn declare_predicates(&mut self, tree: &Tree) {
        let head = |list: usize| match tree.children(list).next().map(|first| tree.nodes[first].kind) {
            Some(Kind::Word(symbol)) => Some(symbol),
            _ => None,
        };
        let sections = tree.roots().flat_map(|root| tree.children(root));
        let declaring =
            sections.filter(|&list| head(list).is_some_and(|symbol| self.name(symbol) == ":predicates"));
        let declared: Vec<Symbol> = declaring.flat_map(|list| tree.children(list)).filter_map(head).collect();
        self.predicates.extend(declared);
    }

    /// True if the domain declares a predicate of this case-folded name.
    pub fn is_predicate(&self, name: &str) -> bool {
        self.find(name).is_some_and(|symbol| self.predicates.contains(&symbol))
    }

    /// Number of distinct names.
    pub fn len(&self) -> usize {
        self.names.len()
    }

    /// True if there are no names yet.
    pub fn is_empty(&self) -> bool {
        self.names.is_empty()
    }
}

/// Kind of a node of the tree.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Kind {
    /// `( … )`
    List,
    /// `[ … ]`
    Bracket,
    /// Word: text between delimiters.
    Word(Symbol),
}

/// List or word.
#[derive(Debug, Clone, Copy)]
pub struct Node {
    /// Kind of the node.
    pub kind: Kind,
    /// Byte offset of the first byte.
    pub start: u32,
    /// Byte offset after the last byte.
    pub end: u32,
    /// Index of the first node after this node's descendants.
    pub next: u32,
}

/// Nodes of a file.
#[derive(Debug, Default)]
pub struct Tree {
    /// Nodes in the order of the text; each is followed by its descendants.
    pub nodes: Vec<Node>,
}

impl Tree {
    /// Indices of the nodes directly inside a list; none for a word.
    pub fn children(&self, list: usize) -> Children<'_> {
        let end = self.nodes[list].next as usize;
        let first = if matches!(self.nodes[list].kind, Kind::Word(_)) { end } else { list + 1 };
        Children { nodes: &self.nodes, at: first, end }
    }

    /// Indices of the top-level nodes.
    pub fn roots(&self) -> Children<'_> {
        Children { nodes: &self.nodes, at: 0, end: self.nodes.len() }
    }
}

/// Iterator over the indices of sibling nodes.
#[derive(Debug, Clone)]
pub struct Children<'t> {
    nodes: &'t [Node],
    at: usize,
    end: usize,
}

impl Iterator for Children<'_> {
    type Item = usize;

    fn next(&mut self) -> Option<usize> {
        (self.at < self.end).then(|| {
            let found = self.at;
            self.at = self.nodes[found].next as usize;
            found
        })
    }
}

/// Keywords of sections, which stand only directly inside `(define …)`.
const SECTIONS: &[&str] = &[
    ":requirements",
    ":types",
    ":modules",
    ":constants",
    ":predicates",
    ":functions",
    ":action",
    ":durative-action",
    ":derived",
    ":process",
    ":event",
    ":domain",
    ":moduleoptions",
    ":moduleexitoptions",
    ":objects",
    ":init",
    ":goal",
    ":constraints",
    ":metric",
];

/// Keywords of sections that consist of parts with keywords.
const ACTIONS: &[&str] = &[":action", ":durative-action", ":process", ":event"];

/// Keywords of the parts of an action.
const ACTION_PARTS: &[&str] =
    &[":parameters", ":precondition", ":condition", ":duration", ":effect", ":grounding"];

/// Parses a text of source number `source` into a tree; errors are appended to `findings`.
pub fn read(text: &str, source: u32, symbols: &mut Symbols, findings: &mut Vec<Diagnostic>) -> Tree {
    let mut builder = Builder {
        text,
        bytes: text.as_bytes(),
        source,
        tree: Tree::default(),
        open: Vec::new(),
        last_close: None,
        last_action: None,
        suspect: None,
        suspect_before: None,
        line_start: 0,
        fresh_line: true,
        too_deep: false,
        odd: [false; 3],
        findings,
    };
    builder.tree.nodes.reserve(text.len() / 6);
    builder.run(symbols);
    builder.tree
}

struct Builder<'a> {
    text: &'a str,
    bytes: &'a [u8],
    source: u32,
    tree: Tree,
    /// Indices of the open lists, outermost first.
    open: Vec<usize>,
    /// Byte offset of the last parenthesis that closed a section or the whole definition.
    last_close: Option<u32>,
    /// Section closed last, by node index.
    last_action: Option<usize>,
    /// Innermost open list when a later line began no further right than the list's content should:
    /// probably a closing bracket is missing. Node index, and byte offset of that line's first
    /// word.
    suspect: Option<(usize, u32)>,
    /// Value of `suspect` when the previous section ended.
    suspect_before: Option<(usize, u32)>,
    line_start: usize,
    fresh_line: bool,
    too_deep: bool,
    /// True for each kind of non-PDDL character that was reported already: 0 blanks, 1 hyphens, 2
    /// commas and quotes.
    odd: [bool; 3],
    findings: &'a mut Vec<Diagnostic>,
}

/// True for blanks that PDDL does not know and copied texts contain: no-break, thin, ideographic
/// and zero-width ones.
fn is_odd_blank(sign: char) -> bool {
    !sign.is_ascii() && sign.is_whitespace()
        || matches!(sign, '\u{200b}'..='\u{200d}' | '\u{2060}' | '\u{feff}')
}

/// True if a word is a dash or minus sign, into which word processors turn a hyphen.
fn is_odd_hyphen(word: &str) -> bool {
    matches!(word, "\u{2010}" | "\u{2011}" | "\u{2012}" | "\u{2013}" | "\u{2014}" | "\u{2212}")
}

impl Builder<'_> {
    fn run(&mut self, symbols: &mut Symbols) {
        let mut at = if self.text.starts_with('\u{feff}') { 3 } else { 0 };
        while let Some(&byte) = self.bytes.get(at) {
            match byte {
                b'\n' => {
                    at += 1;
                    self.line_start = at;
                    self.fresh_line = true;
                }
                b' ' | b'\t' | b'\r' | 0x0b | 0x0c => at += 1,
                b';' => {
                    at += self.bytes[at..]
                        .iter()
                        .position(|&byte| byte == b'\n')
                        .unwrap_or(self.bytes.len() - at)
                }
                b'(' | b'[' => {
                    self.open_list(at);
                    at += 1;
                }
                b')' | b']' => {
                    self.close_list(at);
                    at += 1;
                }
                sign @ (b',' | b'"') => {
                    let message = format!("`{}` is no sign of PDDL", char::from(sign));
                    self.odd(2, message, self.span(at, at + 1), "it is read as a blank; leave it out");
                    at += 1;
                }
                _ => at = self.word_or_blank(at, symbols),
            }
        }
        self.finish();
    }

    /// Reads a word, or skips a character that counts as a blank; returns the byte offset after it.
    fn word_or_blank(&mut self, at: usize, symbols: &mut Symbols) -> usize {
        let end = self.word_end(at);
        let word = &self.text[at..end];
        let blank =
            (!word.is_ascii()).then(|| word.char_indices().find(|(_, sign)| is_odd_blank(*sign))).flatten();
        match blank {
            Some((0, sign)) => {
                let end = at + sign.len_utf8();
                let message = format!("this blank is not a plain one, but U+{:04X}", u32::from(sign));
                self.odd(0, message, self.span(at, end), "it is read as a plain blank; type one here");
                return end;
            }
            Some((before, _)) => self.word(at, at + before, symbols),
            None => self.word(at, end, symbols),
        }
        blank.map_or(end, |(before, _)| at + before)
    }

    /// Reports a non-PDDL character, once for each kind; `help` says how the character is read.
    fn odd(&mut self, kind: usize, message: String, span: Span, help: &str) {
        if !std::mem::replace(&mut self.odd[kind], true) {
            let finding = Diagnostic::warning("odd-sign", message, span, "other planners do not read this");
            self.findings.push(finding.with_help(help));
        }
    }

    /// Byte offset of the end of a word: the next delimiter, or a question mark, so that `at?x` is
    /// two words.
    fn word_end(&self, start: usize) -> usize {
        let rest = &self.bytes[start + 1..];
        let delimiter = |byte: &u8| byte.is_ascii_whitespace() || b"\x0b()[];?,\"".contains(byte);
        start + 1 + rest.iter().position(delimiter).unwrap_or(rest.len())
    }

    fn span(&self, start: usize, end: usize) -> Span {
        Span { source: self.source, start: start as u32, end: end as u32 }
    }

    fn open_list(&mut self, at: usize) {
        self.note_layout(at);
        let kind = if self.bytes[at] == b'(' { Kind::List } else { Kind::Bracket };
        if kind == Kind::List && self.begins(at, SECTIONS) {
            self.expect_section(at);
        }
        if self.open.len() == MAX_DEPTH && !self.too_deep {
            self.too_deep = true;
            self.findings.push(Diagnostic::error(
                "too-deep",
                format!("nested more than {MAX_DEPTH} lists deep"),
                self.span(at, at + 1),
                "what is in here is not read",
            ));
        }
        self.open.push(self.tree.nodes.len());
        self.tree.nodes.push(Node { kind, start: at as u32, end: at as u32 + 1, next: u32::MAX });
    }

    fn close_list(&mut self, at: usize) {
        self.note_layout(at);
        let Some(&list) = self.open.last() else {
            self.surplus(at);
            return;
        };
        let wanted = if self.tree.nodes[list].kind == Kind::List { b')' } else { b']' };
        if self.bytes[at] != wanted && !self.mend_mixed(at, list) {
            return;
        }
        self.close_top(at + 1);
        match self.open.len() {
            0 => self.last_close = Some(at as u32),
            1 => {
                self.last_close = Some(at as u32);
                self.last_action = Some(list);
                self.suspect_before = self.suspect.take();
            }
            _ => {}
        }
    }

    /// Reports a closing bracket of the wrong kind; true if the bracket closes the list
    /// nevertheless.
    fn mend_mixed(&mut self, at: usize, list: usize) -> bool {
        let node = self.tree.nodes[list];
        let (open, wanted, got) = if node.kind == Kind::List { ('(', ')', ']') } else { ('[', ']', ')') };
        let opening = self.span(node.start as usize, node.start as usize + 1);
        self.findings.push(
            Diagnostic::error(
                "unbalanced",
                format!("`{got}` where `{wanted}` was expected"),
                self.span(at, at + 1),
                format!("`{wanted}` was expected here"),
            )
            .with_label(opening, format!("to close this `{open}`")),
        );
        let line_end =
            self.bytes[at..].iter().position(|&byte| byte == b'\n').map_or(self.bytes.len(), |n| at + n);
        let line = &self.bytes[self.line_start..line_end];
        let count = |sign: u8| line.iter().filter(|&&byte| byte == sign).count();
        match got {
            // The parentheses of the line are balanced without it: the bracket was forgotten.
            ')' if count(b'(') == count(b')') => {
                self.close_top(at);
                true
            }
            ')' => true,
            _ => count(b']') <= count(b'['),
        }
    }

    fn close_top(&mut self, end: usize) {
        if let Some(list) = self.open.pop() {
            let next = self.tree.nodes.len() as u32;
            let node = &mut self.tree.nodes[list];
            (node.end, node.next) = (end as u32, next);
            if self.open.len() >= MAX_DEPTH {
                // What is too deep is dropped, so that nothing later has to go there.
                self.tree.nodes.truncate(list);
            }
        }
    }

    fn word(&mut self, start: usize, end: usize, symbols: &mut Symbols) {
        self.note_layout(start);
        let text = &self.text[start..end];
        if text.starts_with(':') && ACTION_PARTS.iter().any(|part| part.eq_ignore_ascii_case(text)) {
            self.expect_action_part(start, end);
        }
        let text = if is_odd_hyphen(text) {
            let message = format!("`{text}` is not the hyphen `-` of PDDL");
            self.odd(1, message, self.span(start, end), "it is read as `-`; type one here");
            "-"
        } else {
            text
        };
        let next = self.tree.nodes.len() as u32 + 1;
        if text.len() > 1 && text.starts_with('-') {
            // `?x -block` with its space missing names a type.
            symbols.intern(&text[1..]);
        }
        let kind = Kind::Word(symbols.intern(text));
        self.tree.nodes.push(Node { kind, start: start as u32, end: end as u32, next });
    }

    /// Remembers the innermost open list as suspect if a new line begins left of the list's
    /// content.
    fn note_layout(&mut self, at: usize) {
        if !std::mem::take(&mut self.fresh_line) || self.suspect.is_some() || self.open.len() < 3 {
            return;
        }
        if b")]".contains(&self.bytes[at]) {
            return;
        }
        if let Some(&list) = self.open.last() {
            let start = self.tree.nodes[list].start as usize;
            if start < self.line_start && self.column(at) <= self.edge(start) {
                self.suspect = Some((list, at as u32));
            }
        }
    }

    /// Column right of which the content of a list should stand: that of the opening bracket, or of
    /// the line's first word if the bracket's line holds at most one word after the bracket.
    fn edge(&self, start: usize) -> usize {
        let line = self.text[..start].rfind('\n').map_or(0, |newline| newline + 1);
        let rest = self.text[start + 1..].lines().next().unwrap_or_default();
        let hangs = rest.split(';').next().unwrap_or_default().split_whitespace().count() <= 1;
        let blanks = self.bytes[line..].iter().take_while(|byte| b" \t".contains(byte)).count();
        self.column(if hangs { line + blanks } else { start })
    }

    /// Column of a byte, from 0; a tab extends to the next multiple of eight.
    fn column(&self, at: usize) -> usize {
        let line = self.bytes[..at].iter().rposition(|&byte| byte == b'\n').map_or(0, |newline| newline + 1);
        self.bytes[line..at]
            .iter()
            .fold(0, |column, &byte| if byte == b'\t' { column / 8 * 8 + 8 } else { column + 1 })
    }

    /// True if the list at byte `at` begins with one of these keywords.
    fn begins(&self, at: usize, words: &[&str]) -> bool {
        let rest = &self.bytes[at + 1..];
        let blanks = rest.iter().take_while(|byte| byte.is_ascii_whitespace()).count();
        let start = at + 1 + blanks;
        if self.bytes.get(start) != Some(&b':') {
            return false;
        }
        let word = &self.text[start..self.word_end(start)];
        words.iter().any(|section| section.eq_ignore_ascii_case(word))
    }

    /// Handles the start of a section: all lists except `(define` should have been closed.
    fn expect_section(&mut self, at: usize) {
        if self.open.len() > 1 {
            self.unclosed(1, at, "a new section begins here");
            while self.open.len() > 1 {
                self.close_top(at);
            }
            return;
        }
        let Some(close) = self.last_close.filter(|_| self.open.is_empty()) else { return };
        let Some(define) = self.tree.roots().last().filter(|&root| self.tree.nodes[root].kind == Kind::List)
        else {
            return;
        };
        let close = close as usize;
        let diagnostic = Diagnostic::error(
            "unbalanced",
            "a closing parenthesis too many",
            self.span(close, close + 1),
            "this one closes the whole definition",
        );
        let diagnostic = diagnostic.with_label(self.span(at, at + 1), "but it goes on here");
        self.findings.push(diagnostic.with_help("remove one `)` between here and the section before"));
        self.open.push(define);
    }

    /// Handles the start of an action's part, which should stand directly inside the action.
    fn expect_action_part(&mut self, start: usize, end: usize) {
        let in_action =
            self.open.get(1).is_some_and(|&list| self.begins(self.tree.nodes[list].start as usize, ACTIONS));
        if in_action && self.open.len() > 2 {
            self.unclosed(2, start, "the action's next part begins here");
            while self.open.len() > 2 {
                self.close_top(start);
            }
        } else if self.open.len() < 2 {
            self.reopen_action(start, end);
        }
    }

    /// Reopens an action (and possibly the definition) that a parenthesis closed too early.
    fn reopen_action(&mut self, start: usize, end: usize) {
        let (Some(action), Some(close)) = (self.last_action, self.last_close) else { return };
        // While a list is open its end is not known: only closed ones can be walked.
        let define =
            self.open.first().copied().or_else(|| self.tree.roots().last()).filter(|&root| root < action);
        let (Some(define), true) = (define, self.begins(self.tree.nodes[action].start as usize, ACTIONS))
        else {
            return;
        };
        let surplus = 2 - self.open.len();
        let message = match surplus {
            1 => "a closing parenthesis too many".to_string(),
            _ => "two closing parentheses too many".to_string(),
        };
        let close = close as usize;
        let span = self.span(close + 1 - surplus, close + 1);
        let label = if surplus == 1 { "this one closes the action" } else { "these close the action" };
        let diagnostic = Diagnostic::error("unbalanced", message, span, label);
        let diagnostic = diagnostic.with_label(self.span(start, end), "but the action goes on here");
        let signs = ")".repeat(surplus);
        self.findings
            .push(diagnostic.with_help(format!("remove `{signs}` before the next part of the action")));
        if self.open.is_empty() {
            self.open.push(define);
        }
        self.open.push(action);
    }

    /// Reports which of the lists open beyond `depth` lacks its closing bracket. `there` describes
    /// the text at `at`.
    fn unclosed(&mut self, depth: usize, at: usize, there: &str) {
        let outer = depth.checked_sub(1).map(|parent| self.open[parent]);
        let (list, before, there) = match self.suspect.take().filter(|&(list, _)| Some(list) > outer) {
            Some((list, line)) if line as usize != at => {
                (list, line as usize, "it should be closed before this")
            }
            Some((list, _)) => (list, at, there),
            None => (self.open[self.open.len() - 1], at, there),
        };
        let node = self.tree.nodes[list];
        let (sign, close) = if node.kind == Kind::List { ('(', ')') } else { ('[', ']') };
        let start = node.start as usize;
        let message = match self.open.len() - depth {
            1 => format!("a closing `{close}` is missing"),
            missing => format!("{missing} closing parentheses are missing"),
        };
        let label = format!("this `{sign}` is never closed");
        let mut diagnostic = Diagnostic::error("unbalanced", message, self.span(start, start + 1), label);
        if before < self.text.len() {
            diagnostic = diagnostic.with_label(self.span(before, self.word_end(before)), there);
        }
        self.findings.push(diagnostic.with_help(format!("add `{close}` where this list is to end")));
    }

    fn surplus(&mut self, at: usize) {
        let sign = self.bytes[at] as char;
        self.findings.push(
            Diagnostic::error(
                "unbalanced",
                format!("`{sign}` closes nothing"),
                self.span(at, at + 1),
                "everything was closed before",
            )
            .with_help("remove it, or one of those before it"),
        );
    }

    fn finish(&mut self) {
        let end = self.text.len();
        match (self.open.as_slice(), self.suspect_before) {
            ([], _) => {}
            ([_], Some(suspect)) => {
                self.suspect = Some(suspect);
                self.unclosed(0, end, "");
            }
            ([define], None) => {
                let start = self.tree.nodes[*define].start as usize;
                let label = "this `(` is never closed";
                let span = self.span(start, start + 1);
                let diagnostic = Diagnostic::error("unbalanced", "the last `)` is missing", span, label);
                self.findings.push(diagnostic.with_help("add `)` at the end of the file"));
            }
            _ => self.unclosed(1, end, ""),
        }
        while !self.open.is_empty() {
            self.close_top(end);
        }
    }
}
