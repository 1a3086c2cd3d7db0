//! Layout of lists, words and comments in lines.

use super::tree::{LayoutNode, What};
use crate::pddl::parse::ACTION_PARTS;

/// Preferred maximum line width, characters.
pub const WIDTH: usize = 120;
/// Indentation of the parts of a list relative to the list, columns.
const STEP: usize = 2;
/// Number of blanks between the longest line of a group and its trailing comments.
const BEFORE_COMMENT: usize = 2;

/// Keywords of lists whose parts each begin on a new line.
const ACTIONS: [&str; 4] = [":action", ":durative-action", ":process", ":event"];

/// First words of lists whose arguments begin on the same line, however long these are.
const STAYING: [&str; 6] = ["not", "at", "over", "preference", ":goal", ":metric"];

/// Sections in which the author's multiple blanks are kept, because they align columns.
const TABLES: [&str; 7] =
    [":modules", ":types", ":objects", ":constants", ":predicates", ":functions", ":init"];

/// Formats a text.
pub fn print(roots: &[LayoutNode<'_>]) -> String {
    let mut page = Page::default();
    for (n, node) in roots.iter().enumerate() {
        if n > 0 && (node.breaks > 0 || !node.is_comment()) {
            page.new_line(0, node.breaks > 1);
        }
        page.node(node, 0);
    }
    page.finish()
}

/// Line that is being laid out.
#[derive(Debug, Default)]
struct Line {
    indent: usize,
    text: String,
    /// Comment at the end of the line, and its column in the original text.
    comment: Option<(String, usize)>,
}

#[derive(Debug, Default)]
struct Page {
    done: Vec<Line>,
    line: Line,
    /// True inside a section of [`TABLES`].
    in_table: bool,
}

impl Page {
    fn new_line(&mut self, indent: usize, is_apart: bool) {
        self.done.push(std::mem::replace(&mut self.line, Line { indent, ..Line::default() }));
        if is_apart {
            self.done.push(std::mem::replace(&mut self.line, Line { indent, ..Line::default() }));
        }
    }

    fn column(&self) -> usize {
        self.line.indent + self.line.text.chars().count()
    }

    /// Appends a node to the present line; `closing` parentheses must fit after it.
    fn node(&mut self, node: &LayoutNode<'_>, closing: usize) {
        match &node.what {
            What::Word(word) => self.line.text.push_str(word),
            What::Comment(text, _) if self.line.text.is_empty() => self.line.text.push_str(text),
            What::Comment(text, column) => self.line.comment = Some(((*text).into(), *column)),
            What::List(open, children, close) => {
                let outside = self.in_table;
                self.in_table |= is_head(children, &TABLES);
                self.list(*open, children, *close, closing);
                self.in_table = outside;
            }
        }
    }

    fn list(&mut self, open: char, children: &[LayoutNode<'_>], close: char, closing: usize) {
        if let Some(flat) = flat(open, children, close, self.in_table)
            && (self.column() + flat.chars().count() + closing <= WIDTH || children.len() < 2)
            && !is_always_broken(children)
        {
            self.line.text.push_str(&flat);
            return;
        }
        let children = &broken(children);
        let begins_at = if self.line.text.is_empty() { self.column() } else { self.line.indent };
        let column = self.column();
        self.line.text.push(open);
        let indent = match indent_of(children) {
            Indent::Body => begins_at + STEP,
            Indent::Aligned(head) => column + 1 + head,
        };
        for (n, child) in children.iter().enumerate() {
            let last = n + 1 == children.len();
            let behind = if last { closing + 1 } else { 0 };
            if n > 0 {
                let width = flat_width(child, self.in_table).map_or(0, |width| width + 1 + behind);
                let stays = child.is_comment() || child.is_list() && is_head(children, &STAYING);
                let is_full = self.column() + width > WIDTH && !stays;
                if child.breaks > 0 || self.line.comment.is_some() || is_full {
                    self.new_line(indent, child.breaks > 1);
                } else if !child.is_comment() {
                    self.line.text.push_str(&blanks(child, self.in_table));
                }
            }
            self.node(child, behind);
        }
        // Nothing but a line break ends a comment.
        if children.last().is_some_and(LayoutNode::is_comment) {
            self.new_line(indent, false);
        }
        self.line.text.push(close);
    }

    fn finish(mut self) -> String {
        self.done.push(std::mem::take(&mut self.line));
        let mut text = String::new();
        let columns = comment_columns(&self.done);
        for (line, column) in self.done.iter().zip(columns) {
            let mut written = String::new();
            if !line.text.is_empty() {
                written += &" ".repeat(line.indent);
                written += &line.text;
            }
            if let Some((comment, _)) = &line.comment {
                let blanks = column.saturating_sub(written.chars().count()).max(1);
                written += &" ".repeat(blanks);
                written += comment;
            }
            text += written.trim_end();
            text.push('\n');
        }
        let text = text.trim_start_matches('\n').trim_end();
        if text.is_empty() { String::new() } else { format!("{text}\n") }
    }
}

/// Indentation of a list's parts that begin on lines of their own.
enum Indent {
    /// One step more than the line in which the list begins.
    Body,
    /// Aligned at this many columns right of the opening bracket.
    Aligned(usize),
}

fn indent_of(children: &[LayoutNode<'_>]) -> Indent {
    let Some(head) = children.first().and_then(LayoutNode::word) else { return Indent::Aligned(0) };
    if head.starts_with(['?', '-']) {
        return Indent::Aligned(0);
    }
    if head.eq_ignore_ascii_case(":requirements") {
        return Indent::Aligned(head.chars().count() + 1);
    }
    let joins = ["and", "or", "imply", "oneof", "+", "*"].iter().any(|word| head.eq_ignore_ascii_case(word));
    let is_beside = children.get(1).is_some_and(|second| second.is_list() && second.breaks == 0);
    if joins && is_beside { Indent::Aligned(head.chars().count() + 1) } else { Indent::Body }
}

fn is_head(children: &[LayoutNode<'_>], words: &[&str]) -> bool {
    let head = children.first().and_then(LayoutNode::word);
    head.is_some_and(|head| words.iter().any(|word| word.eq_ignore_ascii_case(head)))
}

fn is_always_broken(children: &[LayoutNode<'_>]) -> bool {
    is_head(children, &["define"]) || is_head(children, &ACTIONS)
}

/// Text of a list on one line; `None` if the author broke its lines, or if it contains a comment.
fn flat(open: char, children: &[LayoutNode<'_>], close: char, in_table: bool) -> Option<String> {
    let mut text = String::from(open);
    for (n, child) in children.iter().enumerate() {
        if child.breaks > 0 && n > 0 {
            return None;
        }
        if n > 0 {
            text.push_str(&blanks(child, in_table));
        }
        match &child.what {
            What::Word(word) => text.push_str(word),
            What::Comment(..) => return None,
            What::List(open, children, close) => text.push_str(&flat(*open, children, *close, in_table)?),
        }
    }
    text.push(close);
    Some(text)
}

/// Blanks before a node within a line.
fn blanks(node: &LayoutNode<'_>, in_table: bool) -> String {
    " ".repeat(if in_table { node.blanks.max(1) } else { 1 })
}

fn flat_width(node: &LayoutNode<'_>, in_table: bool) -> Option<usize> {
    match &node.what {
        What::Word(word) => Some(word.chars().count()),
        What::Comment(..) => None,
        What::List(open, children, close) => {
            flat(*open, children, *close, in_table).map(|text| text.chars().count())
        }
    }
}

/// Children of a list that takes several lines, with the line breaks that the layout requires.
fn broken<'a>(children: &[LayoutNode<'a>]) -> Vec<LayoutNode<'a>> {
    let mut children = children.to_vec();
    if let Some(first) = children.first_mut() {
        first.breaks = 0;
    }
    if is_head(&children, &["define"]) {
        set_breaks(&mut children, 2);
        children.iter_mut().skip(1).take(1).for_each(|name| name.breaks = 0);
    } else if is_head(&children, &ACTIONS) {
        parts_apart(&mut children);
    } else if children.iter().all(|child| child.breaks == 0 && !child.is_comment()) {
        explode(&mut children);
    }
    children
}

/// Sets at least one line break before each child from index `from` on, except comments.
fn set_breaks(children: &mut [LayoutNode<'_>], from: usize) {
    for child in children.iter_mut().skip(from).filter(|child| !child.is_comment()) {
        child.breaks = child.breaks.max(1);
    }
}

/// Begins each part of an action on a new line, with the value on the line of its keyword.
fn parts_apart(children: &mut [LayoutNode<'_>]) {
    let is_part = |node: &LayoutNode<'_>| {
        node.word().is_some_and(|word| ACTION_PARTS.iter().any(|part| part.eq_ignore_ascii_case(word)))
    };
    for n in 1..children.len() {
        if is_part(&children[n]) {
            children[n].breaks = children[n].breaks.max(1);
        } else if !children[n].is_comment()
            && !children[n - 1].is_comment()
            && (n == 1 || is_part(&children[n - 1]))
        {
            children[n].breaks = 0;
        }
    }
}

/// Sets line breaks in a list that was written on one line and is too long for one.
fn explode(children: &mut [LayoutNode<'_>]) {
    let Some(head) = children.first().and_then(LayoutNode::word).map(str::to_ascii_lowercase) else { return };
    let beside = match head.as_str() {
        staying if STAYING.contains(&staying) => return,
        "forall" | "exists" | "when" | "increase" | "decrease" | "assign" | ":derived" => 1,
        _ => 0,
    };
    let mut after_type = false;
    let mut before: Option<&str> = None;
    for (n, child) in children.iter_mut().enumerate().skip(1) {
        let is_sought = n > beside && child.is_list() && before != Some("-");
        if is_sought || after_type {
            child.breaks = 1;
        }
        after_type = before == Some("-");
        before = child.word();
    }
}

/// Column of the trailing comment of each line. Comments of neighbouring lines are aligned: at the
/// author's column if they all stood there, else behind the longest line.
fn comment_columns(lines: &[Line]) -> Vec<usize> {
    let mut columns = vec![0; lines.len()];
    let mut from = 0;
    while from < lines.len() {
        let to = (from..lines.len()).find(|&n| lines[n].comment.is_none()).unwrap_or(lines.len());
        let run = &lines[from..to];
        let widest = run.iter().map(|line| line.indent + line.text.chars().count()).max().unwrap_or(0);
        let mut stood = run.iter().filter_map(|line| Some(line.comment.as_ref()?.1));
        let first = stood.next();
        let is_one = first.is_some_and(|first| first > widest && stood.all(|column| column == first));
        let column = match first {
            Some(first) if is_one => first,
            _ if run.len() == 1 => widest + 1,
            _ => widest + BEFORE_COMMENT,
        };
        columns[from..to].fill(column);
        from = to.max(from + 1);
    }
    columns
}
