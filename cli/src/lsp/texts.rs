//! Open texts of an editor, and positions in them.

use std::collections::HashMap;
use std::path::{Path, PathBuf};
use std::str::FromStr;

use descry_planner::Span;
use lsp_types::{Position, Range, TextDocumentContentChangeEvent, Uri};

/// Maximum size of a file to be read, bytes.
const MOST_BYTES: u64 = 16 << 20;

/// Open texts; all others are read from the disk.
#[derive(Default)]
pub struct Texts {
    open: HashMap<PathBuf, String>,
}

impl Texts {
    /// Stores an opened text.
    pub fn open(&mut self, uri: &Uri, text: String) {
        self.open.insert(path_of(uri), text);
    }

    /// Applies a change to a text: all of it, or a part.
    pub fn change(&mut self, uri: &Uri, change: TextDocumentContentChangeEvent) {
        let text = self.open.entry(path_of(uri)).or_default();
        match change.range {
            None => *text = change.text,
            Some(range) => {
                let (from, to) = (offset(text, range.start), offset(text, range.end));
                text.replace_range(from..to.max(from), &change.text);
            }
        }
    }

    /// Forgets a closed text; the file on the disk counts again.
    pub fn close(&mut self, uri: &Uri) {
        self.open.remove(&path_of(uri));
    }

    /// Text of a file, open or on the disk.
    pub fn text(&self, path: &Path) -> Option<String> {
        if let Some(text) = self.open.get(path) {
            return Some(text.clone());
        }
        let is_small = std::fs::metadata(path).is_ok_and(|m| m.is_file() && m.len() <= MOST_BYTES);
        is_small.then(|| std::fs::read_to_string(path).ok()).flatten()
    }

    /// True if the file is open or exists on the disk.
    pub fn has(&self, path: &Path) -> bool {
        self.open.contains_key(path) || path.is_file()
    }

    /// The paths of open texts.
    pub fn paths(&self) -> impl Iterator<Item = &PathBuf> {
        self.open.keys()
    }

    /// Files of a folder with these extensions, open or on the disk, sorted by name.
    pub fn of_folder(&self, folder: &Path, endings: &[&str]) -> Vec<PathBuf> {
        let on_disk = std::fs::read_dir(folder).into_iter().flatten().flatten().map(|entry| entry.path());
        let open = self.open.keys().filter(|path| path.parent() == Some(folder)).cloned();
        let is_one =
            |path: &PathBuf| path.extension().is_some_and(|e| endings.iter().any(|ending| e == *ending));
        let mut all: Vec<PathBuf> = on_disk.chain(open).filter(is_one).collect();
        all.sort();
        all.dedup();
        all
    }
}

/// The path of a URI; for other URIs than files, its text.
pub fn path_of(uri: &Uri) -> PathBuf {
    let text = uri.as_str();
    let Some(path) = text.strip_prefix("file://") else { return PathBuf::from(text) };
    let bytes = path.as_bytes();
    let mut decoded = Vec::with_capacity(bytes.len());
    let mut at = 0;
    while let Some(&byte) = bytes.get(at) {
        let hex = path.get(at + 1..at + 3).and_then(|hex| u8::from_str_radix(hex, 16).ok());
        match (byte, hex) {
            (b'%', Some(value)) => {
                decoded.push(value);
                at += 3;
            }
            _ => {
                decoded.push(byte);
                at += 1;
            }
        }
    }
    PathBuf::from(String::from_utf8_lossy(&decoded).into_owned())
}

/// URI of a path; `None` if the path has no valid URI.
pub fn uri_of(path: &Path) -> Option<Uri> {
    let text = path.to_str()?;
    if !text.starts_with('/') {
        return Uri::from_str(text).ok();
    }
    let plain = |byte: u8| byte.is_ascii_alphanumeric() || b"/-._~".contains(&byte);
    let encoded: String = text
        .bytes()
        .map(|byte| if plain(byte) { char::from(byte).to_string() } else { format!("%{byte:02X}") })
        .collect();
    Uri::from_str(&format!("file://{encoded}")).ok()
}

/// Byte offset of a position whose columns count UTF-16 units. A position beyond the end of a line is
/// clamped to that end.
pub fn offset(text: &str, position: Position) -> usize {
    let mut start = 0;
    for _ in 0..position.line {
        match text[start..].find('\n') {
            Some(end) => start += end + 1,
            None => return text.len(),
        }
    }
    let line = text[start..].split('\n').next().unwrap_or_default();
    let mut units = 0;
    for (at, letter) in line.char_indices() {
        if units >= position.character as usize {
            return start + at;
        }
        units += letter.len_utf16();
    }
    start + line.len()
}

/// Line index for converting many positions in a text.
pub struct Lines<'a> {
    text: &'a str,
    starts: Vec<usize>,
}

impl<'a> Lines<'a> {
    /// Builds the index.
    pub fn of(text: &'a str) -> Self {
        let starts = std::iter::once(0).chain(text.match_indices('\n').map(|(at, _)| at + 1)).collect();
        Lines { text, starts }
    }

    /// Position of a byte offset.
    pub fn position(&self, at: usize) -> Position {
        let at = at.min(self.text.len());
        let line = self.starts.partition_point(|&start| start <= at) - 1;
        let before = self.text.get(self.starts[line]..at).unwrap_or_default();
        Position::new(line as u32, before.encode_utf16().count() as u32)
    }

    /// Range of a span, in lines and columns as editors count them.
    pub fn range(&self, span: Span) -> Range {
        Range::new(self.position(span.start as usize), self.position(span.end as usize))
    }
}
