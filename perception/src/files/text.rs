//! Clouds as lines of numbers: XYZ, CSV with or without a header line, and PTS with a leading point
//! count.

use super::columns::Columns;
use super::error::{FileError, Place};
use super::loaded::{Loaded, finish};
use nalgebra::Isometry3;

/// Maximum number of bytes examined to recognise the format. From: chosen.
const FIRST_LINE: usize = 1 << 12;

/// Words of a line, separated by commas, semicolons or blanks; quotes are removed.
fn words(line: &str) -> impl Iterator<Item = &str> {
    let split = line.split(|c: char| c == ',' || c == ';' || c.is_whitespace());
    split.map(|word| word.trim_matches('"')).filter(|word| !word.is_empty())
}

/// Lower-case column names of a header line, and their meaning; a comment marker before them is skipped. `None` unless
/// x, y and z are among them.
fn names(line: &str) -> Option<(Vec<String>, Columns)> {
    let names: Vec<String> =
        words(line.trim().trim_start_matches(['#', '/'])).map(str::to_ascii_lowercase).collect();
    // The header of a PCD has such a line too, behind its keyword.
    let keyword = matches!(names.first().map(String::as_str), Some("fields" | "columns"));
    let columns = Columns::named(&names).filter(|_| !keyword)?;
    Some((names, columns))
}

fn is_comment(line: &str) -> bool {
    line.trim().is_empty() || line.trim_start().starts_with(['#', '/'])
}

/// True if the first line that is no comment has only numbers, or column names with x, y and z.
pub(super) fn is(bytes: &[u8]) -> bool {
    let start = &bytes[..bytes.len().min(FIRST_LINE)];
    let text = String::from_utf8_lossy(start);
    let first = text.lines().find(|line| !is_comment(line) || names(line).is_some());
    first.is_some_and(|line| {
        let numbers = words(line).map(|word| word.parse::<f64>());
        names(line).is_some() || words(line).next().is_some() && numbers.into_iter().all(|n| n.is_ok())
    })
}

/// Reads a cloud from lines of numbers.
///
/// # Errors
/// If a line contains something other than numbers, or not as many numbers as the first.
pub fn read(bytes: &[u8]) -> Result<Loaded, FileError> {
    let text = std::str::from_utf8(bytes).map_err(|e| {
        FileError::new(
            Place::Byte(e.valid_up_to()),
            "text",
            "a byte that is not UTF-8",
            "is this a text file?",
        )
    })?;
    let (mut named, mut declared, mut values, mut width) = (None, None, Vec::new(), None);
    for (number, line) in (1..).zip(text.lines()) {
        if values.is_empty() && named.is_none() {
            named = names(line);
            if named.is_some() {
                continue;
            }
        }
        if is_comment(line) {
            continue;
        }
        let place = Place::Line(number);
        let row = row(line, place)?;
        if let (&[count], true) = (&row[..], values.is_empty() && declared.is_none() && named.is_none()) {
            declared = Some((place, count));
            continue;
        }
        let columns = *width.get_or_insert(row.len());
        let expected = named.as_ref().map_or(columns, |(names, _)| names.len());
        if row.len() != expected || expected < 3 {
            return Err(FileError::new(
                place,
                format!(
                    "{} numbers, as {}",
                    expected.max(3),
                    if named.is_some() { "there are names" } else { "the first line has" }
                ),
                row.len().to_string(),
                "one line holds one point, x y z first where no names are given",
            ));
        }
        values.extend(row);
    }
    let width = width.unwrap_or(3);
    let rows = values.len() / width;
    if let Some((place, count)) = declared.filter(|(_, count)| *count != rows as f64) {
        let mend = "the first line of a PTS file is the number of its points";
        return Err(FileError::new(place, format!("{count} points"), rows.to_string(), mend));
    }
    let columns = named.as_ref().map_or_else(|| Columns::unnamed(&values, width), |(_, columns)| *columns);
    let mut notes = Vec::new();
    let cloud = columns.cloud(&values, width, None, &mut notes);
    if columns.used() < width {
        notes.push(format!("{} of {width} columns are left out", width - columns.used()));
    }
    finish(cloud, Isometry3::identity(), notes, Place::Line(1))
}

fn row(line: &str, place: Place) -> Result<Vec<f64>, FileError> {
    let number = |word: &str| {
        let mend = "a line holds numbers, separated by blanks, commas or semicolons";
        word.parse::<f64>().map_err(|_| FileError::new(place, "a number", format!("{word:?}"), mend))
    };
    words(line).map(number).collect()
}
