//! Constants of perception with the stated origins of their values.
//!
//! The documentation of a constant says what it is, with its unit, and ends with `From: ` and one of [`KINDS`]; after a comma, what it was
//! fitted on, which paper it stands in, or what it was chosen by. A constant on the line after another shares its documentation; a number in
//! `impl Default` of options is documented at its field; a function without arguments that says where its value is from is as good as a
//! constant. Of numbers without a name only those with a point are found: most whole ones count.

use std::fmt::Write;
use std::path::Path;

/// Files and folders of `src` whose constants must state an origin.
pub const PARTS: [&str; 9] =
    ["scale", "quantile", "polygon", "noise", "segment", "recognise", "round", "surface", "merge"];

/// Kinds of origins, and true if the kind needs further words.
const KINDS: [(&str, bool); 8] = [
    // Stated there, for the same purpose.
    ("paper", true),
    // How a camera measures, from who measured it.
    ("sensor", true),
    // It follows from shapes, or from other constants.
    ("derived", true),
    // On which data, by which command.
    ("fitted", true),
    // By judgement: results were looked at, but no series of values was compared.
    ("chosen", false),
    // How work is divided or begun: nothing depends on it but the order of points and the last digits.
    ("work", false),
    // Against dividing by nothing, and for what differs by rounding alone.
    ("rounding", false),
    // It stands for something and has no size.
    ("mark", false),
];

/// Numbers exempt from names: ends, halves and doubles, shares in per cent, metres in millimetres.
const PLAIN: [f64; 6] = [0.0, 0.5, 1.0, 2.0, 100.0, 1000.0];

/// Constant, or default of an option.
#[derive(Clone, Debug)]
pub struct Constant {
    /// Below `src`.
    pub file: String,
    /// Line number, from 1.
    pub line: usize,
    pub name: String,
    pub value: String,
    /// The description, without the source of the value.
    pub what: String,
    /// Origin of the value; empty if none is given.
    pub from: String,
}

/// The contents of a file.
#[derive(Clone, Debug, Default)]
pub struct Found {
    pub constants: Vec<Constant>,
    /// Unnamed numbers: file, line from 1, and number.
    pub nameless: Vec<(String, usize, String)>,
}

impl Constant {
    fn of(file: &str, line: usize, name: &str, value: &str, doc: &str) -> Constant {
        let (what, from) = doc.rsplit_once("From: ").unwrap_or((doc, ""));
        let [what, from] = [what.trim(), from.trim().trim_end_matches('.')].map(str::to_owned);
        Constant { file: file.to_owned(), line, name: name.to_owned(), value: value.to_owned(), what, from }
    }

    /// Kind of the origin, of [`KINDS`], if one is given.
    fn kind(&self) -> &str {
        self.from.split([',', ' ']).next().unwrap_or_default()
    }

    /// The fault in the constant's documentation, if any.
    fn fault(&self) -> Option<String> {
        let further = self.from.split_once(", ").is_some_and(|(_, more)| !more.is_empty());
        let why = match KINDS.iter().find(|(kind, _)| *kind == self.kind()) {
            _ if self.what.is_empty() => "is not documented",
            _ if self.from.is_empty() => "does not say where its value is from",
            None => "has its value from something that is no kind of origin",
            Some((_, true)) if !further => "does not say from which",
            Some(_) => return None,
        };
        Some(format!("{}:{}: {} {why}", self.file, self.line, self.name))
    }

    /// Unit given by the end of the name.
    fn unit(&self) -> &'static str {
        let name = self.name.to_lowercase();
        let units =
            [("_per_m", "1/m"), ("_m", "m"), ("_m2", "m²"), ("_rad", "rad"), ("_deg", "°"), ("_px", "px")];
        units.iter().find(|(end, _)| name.ends_with(end)).map_or("", |(_, unit)| unit)
    }
}

/// The constants and nameless numbers of all parts below `src`, file by file.
pub fn all(src: &Path) -> Found {
    let mut found = Found::default();
    for part in PARTS {
        let folder = std::fs::read_dir(src.join(part)).into_iter().flatten().flatten();
        let mut files: Vec<String> = folder
            .filter_map(|file| file.file_name().into_string().ok().map(|f| format!("{part}/{f}")))
            .collect();
        files.push(format!("{part}.rs"));
        files.sort();
        for file in files {
            let text = std::fs::read_to_string(src.join(&file)).unwrap_or_default();
            let of = read(&file, &text);
            found.constants.extend(of.constants);
            found.nameless.extend(of.nameless);
        }
    }
    found
}

/// Reads the constants of a file above its tests.
pub fn read(file: &str, text: &str) -> Found {
    let lines: Vec<&str> = text.lines().take_while(|line| *line != "#[cfg(test)]").collect();
    let mut found = Found::default();
    let (mut doc, mut shared, mut options) = (String::new(), String::new(), None);
    let mut at = 0;
    while at < lines.len() {
        let line = lines[at].trim();
        let first = at + 1;
        at += 1;
        if let Some(more) = line.strip_prefix("///") {
            doc = format!("{doc} {}", more.trim());
            continue;
        }
        if lines[at - 1] == "}" {
            options = None;
        }
        if let Some(of) = line.strip_prefix("impl Default for ") {
            options = of.split(' ').next();
        }
        let (last_doc, last_shared) = (std::mem::take(&mut doc), std::mem::take(&mut shared));
        if let Some((name, mut value)) = constant(line) {
            while !value.ends_with(';') && at < lines.len() {
                value = format!("{value} {}", lines[at].trim());
                at += 1;
            }
            shared = if last_doc.is_empty() { last_shared } else { last_doc };
            found.constants.push(Constant::of(file, first, name, value.trim_end_matches(';'), &shared));
        } else if let Some((name, _)) = line
            .strip_prefix("fn ")
            .and_then(|rest| rest.split_once("() -> "))
            .filter(|_| last_doc.contains("From: "))
        {
            found.constants.push(Constant::of(file, first, name, lines[at].trim(), &last_doc));
            at += 1;
        } else if let Some(options) = options {
            for (field, value) in fields(line) {
                found.constants.push(Constant::of(
                    file,
                    first,
                    field,
                    value,
                    &field_doc(&lines, options, field),
                ));
            }
        } else if line.starts_with("#[") {
            doc = last_doc;
        } else {
            let numbers = quantities(line).into_iter();
            found.nameless.extend(numbers.map(|number| (file.to_owned(), first, number.to_owned())));
        }
    }
    found
}

/// Name and the beginning of the value, if the line begins a constant.
fn constant(line: &str) -> Option<(&str, String)> {
    let after = ["const ", "pub const ", "pub(crate) const ", "pub(super) const "];
    let rest = after.iter().find_map(|before| line.strip_prefix(before))?;
    let (name, rest) = rest.split_once(": ")?;
    let (_, value) = rest.split_once(" =")?;
    name.chars()
        .all(|c| c.is_ascii_uppercase() || c.is_ascii_digit() || c == '_')
        .then(|| (name, value.trim().to_owned()))
}

/// Fields to which a line assigns a number.
fn fields(line: &str) -> impl Iterator<Item = (&str, &str)> {
    let pairs = line.split(['{', ',', '}']).filter_map(|part| part.trim().split_once(": "));
    pairs.filter(|(_, value)| value.replace('_', "").parse::<f64>().is_ok())
}

/// The documentation of a field of a struct.
fn field_doc(lines: &[&str], of: &str, field: &str) -> String {
    let begin = format!("pub struct {of} {{");
    let within = lines.iter().skip_while(|line| **line != begin).take_while(|line| **line != "}");
    let mut doc = String::new();
    for line in within.map(|line| line.trim()) {
        match line.strip_prefix("///") {
            Some(more) => doc = format!("{doc} {}", more.trim()),
            None if line.starts_with(&format!("pub {field}:")) => return doc,
            None => doc.clear(),
        }
    }
    String::new()
}

/// The floating-point numbers of a line of code that are quantities.
fn quantities(line: &str) -> Vec<&str> {
    // Every other part is a text.
    let code = line.split("//").next().unwrap_or_default();
    code.split('"')
        .step_by(2)
        .flat_map(floats)
        .filter(|(_, value)| !PLAIN.contains(value))
        .map(|(text, _)| text)
        .collect()
}

/// Floating-point literals in code, with their values.
fn floats(code: &str) -> Vec<(&str, f64)> {
    let bytes = code.as_bytes();
    let digit = |at: usize| bytes.get(at).is_some_and(u8::is_ascii_digit);
    let of_word = |at: usize| bytes.get(at).is_some_and(|b| b.is_ascii_alphanumeric() || *b == b'_');
    let digits = |mut at: usize| {
        while digit(at) || bytes.get(at) == Some(&b'_') && digit(at + 1) {
            at += 1;
        }
        at
    };
    let mut found = Vec::new();
    let mut at = 0;
    while at < bytes.len() {
        // Neither within a name nor which part of a tuple.
        let is_part = at > 0 && bytes[at - 1] == b'.' && !(at > 1 && bytes[at - 2] == b'.');
        if !digit(at) || is_part || at > 0 && of_word(at - 1) {
            at += 1;
            continue;
        }
        let begin = at;
        at = digits(at);
        if bytes.get(at) == Some(&b'.') && digit(at + 1) {
            at = digits(at + 1);
        }
        if bytes.get(at) == Some(&b'e') {
            at = digits(at + 1 + usize::from(bytes.get(at + 1) == Some(&b'-')));
        }
        let number = &code[begin..at];
        while of_word(at) {
            at += 1;
        }
        let is_float = number.contains(['.', 'e']) || code[begin + number.len()..at].contains('f');
        if let Some(value) = number.replace('_', "").parse().ok().filter(|_| is_float) {
            found.push((&code[begin..at], value));
        }
    }
    found
}

/// All constants as a Markdown table, with the number of each kind of origin.
pub fn table(found: &Found) -> String {
    let mut table =
        "| file | name | value | unit | what it is | from |\n|---|---|---|---|---|---|\n".to_owned();
    let cell = |text: &str| text.replace('|', "\\|");
    for c in &found.constants {
        let Constant { file, line, name, value, what, from } = c;
        let value = if value.len() > 60 { "…" } else { value };
        let [value, what, from] = [value, what, from].map(cell);
        let _ = writeln!(table, "| {file}:{line} | `{name}` | `{value}` | {} | {what} | {from} |", c.unit());
    }
    let _ = writeln!(table);
    for (kind, _) in KINDS {
        let count = found.constants.iter().filter(|c| c.kind() == kind).count();
        let _ = writeln!(table, "- {kind}: {count}");
    }
    table
}

/// The faults, with file and line.
pub fn faults(found: &Found) -> Vec<String> {
    let nameless =
        found.nameless.iter().map(|(file, line, number)| format!("{file}:{line}: {number} has no name"));
    found.constants.iter().filter_map(Constant::fault).chain(nameless).collect()
}
