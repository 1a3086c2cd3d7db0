//! Files in a run's folder beside its record: settings and report.

use std::path::Path;

use descry_memory::{Draft, Fault, Record};
use descry_robots::input::read_bytes;
use serde::Serialize;
use serde::de::DeserializeOwned;
use serde_json::Value;

use super::beginning::Beginning;
use super::header::Header;
use crate::exit::CommandError;
use crate::keeping::{self, RECORD};
use crate::report::Report;

/// Name of the file with the settings of a run.
pub(super) const HEADER: &str = "run.json";
/// Name of the file with the report of a run.
const REPORT: &str = "report.json";
/// Record kind of a run's report.
const REPORTED: &str = "report";
/// Key of the checksum over the other content of a file.
const CHECKSUM: &str = "crc32";

/// Settings of a run from its folder; from its record if the file is missing or damaged.
///
/// # Errors
/// [`CommandError::BadInput`] if the folder holds no run; [`CommandError::Broken`] if neither the file nor the
/// record of a run can be read.
pub fn header(folder: &Path) -> Result<Header, CommandError> {
    if keeping::is_address(folder) {
        let text = format!(
            "{}: a store does not hold what a run was started with\n  name the run's folder, which says where its record is",
            folder.display()
        );
        return Err(CommandError::BadInput(text));
    }
    let begun = recorded(folder).as_ref().and_then(begun);
    own_header(folder, begun.as_ref()).or_else(|why| {
        let header = begun.ok_or_else(|| match is_run(folder) {
            true => CommandError::Broken(format!(
                "{why}\n  its record does not say what the run was started with either: put back what is missing from a copy"
            )),
            false => CommandError::BadInput(format!(
                "{why}\n  expected the folder of a run; `descry runs` lists them"
            )),
        })?;
        tracing::warn!("{why}; what the run was started with is taken from its record");
        Ok(header)
    })
}

/// Record in a run's folder; `None` if it cannot be opened.
fn recorded(folder: &Path) -> Option<Record> {
    Record::open_shared(&folder.join(RECORD)).ok()
}

/// Settings of a run from its record; `None` if there are none.
fn begun(record: &Record) -> Option<Header> {
    Beginning::of(record).ok().flatten().map(|beginning| beginning.header)
}

/// Settings of a run from its folder; an error if they differ from those in the record (`begun`).
fn own_header(folder: &Path, begun: Option<&Header>) -> Result<Header, String> {
    let path = folder.join(HEADER);
    let header: Header = read_json(&path)?;
    let is_own = begun.is_none_or(|begun| {
        let mut recorded = begun.clone();
        // That it was cut off stands in the folder alone, and which scene is the domain's own in the record.
        recorded.resumed.clone_from(&header.resumed);
        if header.settings.scene.is_none() {
            recorded.settings.scene = None;
        }
        recorded == header
    });
    if is_own { Ok(header) } else { Err(of_another(&path)) }
}

fn of_another(path: &Path) -> String {
    format!("{} is that of another run: it does not say what the record says", path.display())
}

/// True if a folder is that of a run.
pub(super) fn is_run(folder: &Path) -> bool {
    [HEADER, RECORD].iter().any(|name| folder.join(name).exists())
}

/// Message about a missing or damaged settings file; `None` if the file is intact.
pub fn lost_of_header(folder: &Path) -> Option<String> {
    let why = own_header(folder, recorded(folder).as_ref().and_then(begun).as_ref()).err()?;
    Some(format!("whether the run was cut off and gone on with: {why}"))
}

/// Damage report for a started run whose record is empty; `None` otherwise.
///
/// # Errors
/// [`CommandError::Broken`] if the record cannot be read.
pub fn lost_of_record(folder: &Path, record: &Record) -> Result<Option<Fault>, CommandError> {
    let is_empty = record.stats().map_err(CommandError::broken)?.records == 0;
    let what = "holds no record of the run: it was cut off before its first record, or its segments are gone";
    Ok((is_empty && folder.join(HEADER).exists()).then(|| Fault {
        record: None,
        place: folder.join(RECORD).display().to_string(),
        what: what.into(),
    }))
}

/// Writes the settings of a run into its folder.
///
/// # Errors
/// [`CommandError::Broken`] if the folder cannot be written.
pub fn keep_header(folder: &Path, header: &Header) -> Result<(), CommandError> {
    write_json(&folder.join(HEADER), header)
}

/// Report of a run from its folder; from its record if the file is missing or damaged. `None` for
/// an unfinished run.
///
/// # Errors
/// [`CommandError::Broken`] if the file is damaged and the record has no report.
pub fn report(folder: &Path) -> Result<Option<Report>, CommandError> {
    let path = folder.join(REPORT);
    let record = recorded(folder);
    let found = record.as_ref().and_then(|record| record.newest(REPORTED).ok().flatten());
    let kept = found.and_then(|document| serde_json::from_value::<Report>(document.body).ok());
    let told = read_json::<Report>(&path).and_then(|told| {
        let is_own = match &kept {
            Some(kept) => told.as_recorded() == kept.as_recorded(),
            // Earlier versions recorded none.
            None => record.as_ref().and_then(begun).is_none_or(|of| of.goal == told.goal),
        };
        if is_own { Ok(told) } else { Err(of_another(&path)) }
    });
    told.map(Some).or_else(|why| match kept {
        Some(report) => {
            tracing::warn!("{why}; the report is taken from the record");
            Ok(Some(Report { run: folder.display().to_string(), ..report }))
        }
        None if path.exists() => Err(CommandError::Broken(why)),
        None => Ok(None),
    })
}

/// True if the run's folder holds a report.
pub fn has_ended(folder: &Path) -> bool {
    folder.join(REPORT).exists()
}

/// Records the report of a run, without values that differ between repetitions.
///
/// # Errors
/// [`CommandError::Broken`] if the record cannot be written.
pub(super) fn put_report(record: &Record, now_ns: i64, report: &Report) -> Result<(), CommandError> {
    let report = report.as_recorded();
    let mut draft = Draft { kept: true, ..Draft::new(REPORTED, now_ns.max(0)) };
    draft.meta.body = serde_json::to_value(report).map_err(|e| CommandError::Bug(e.to_string()))?;
    record.put(draft).map(|_| ()).map_err(CommandError::broken)
}

/// Writes the report to the run's folder.
///
/// # Errors
/// [`CommandError::Broken`] if the folder cannot be written.
pub fn finish(folder: &Path, report: &Report) -> Result<(), CommandError> {
    write_json(&folder.join(REPORT), report)
}

/// Writes a value with its checksum as a JSON file, atomically.
fn write_json(path: &Path, value: &impl Serialize) -> Result<(), CommandError> {
    let bug = |e: serde_json::Error| CommandError::Bug(e.to_string());
    let mut value = serde_json::to_value(value).map_err(bug)?;
    value[CHECKSUM] = checksum(&value).into();
    let text = serde_json::to_string_pretty(&value).map_err(bug)?;
    let fresh = path.with_extension("json.new");
    let written = std::fs::write(&fresh, text + "\n").and_then(|()| std::fs::rename(&fresh, path));
    written.map_err(|e| CommandError::broken(format!("{}: {e}", path.display())))
}

/// Maximum size of a file in a run's folder, bytes. From: chosen.
const MOST_BYTES: u64 = 1 << 30;

/// Reads a JSON file of a run's folder and verifies its checksum.
fn read_json<T: DeserializeOwned>(path: &Path) -> Result<T, String> {
    let shown = path.display();
    let bytes = read_bytes(path, MOST_BYTES).map_err(|e| format!("{shown}: {e}"))?;
    let mut value: Value = serde_json::from_slice(&bytes).map_err(|e| format!("{shown} is damaged: {e}"))?;
    let written = value.as_object_mut().and_then(|fields| fields.shift_remove(CHECKSUM));
    if written != Some(checksum(&value).into()) {
        return Err(format!("{shown} is damaged: its content does not fit its checksum"));
    }
    serde_json::from_value(value).map_err(|e| format!("{shown}: {e}"))
}

fn checksum(value: &Value) -> String {
    format!("{:08x}", crc32fast::hash(value.to_string().as_bytes()))
}
