//! Writing of an experiment's results.
//!
//! `jobs.csv`, `summary.json`, `tables.md`, `plots/*.svg` and `index.html` do not depend on the number of
//! threads and shards; wall-clock times, which do, are in `clock.csv` and `clock.md`.

use std::collections::BTreeSet;
use std::path::Path;

use serde_json::{Value, json};

use super::page::{self, Facts, Section};
use super::statistics::{Observation, mean, median};
use super::table::{Table, number};
use crate::error::ExperimentError;
use crate::header::Header;
use crate::job::{Finished, Numbered, Row};
use crate::kinds::kind::Kind;
use crate::source::Source;

/// Results of an experiment, as written to its folder.
#[derive(Debug, Clone)]
pub struct Results {
    /// Content of `summary.json`.
    pub summary: Row,
    /// Content of `tables.md`.
    pub tables: String,
    /// Content of `clock.md`; empty if nothing was timed.
    pub clock: String,
    /// Number of failed jobs.
    pub failed: usize,
}

pub(super) fn results(
    kind: &dyn Kind,
    source: &Source,
    header: &Header,
    finished: &[Finished],
    out: &Path,
) -> Result<Results, ExperimentError> {
    let head = kind.head();
    let numbered: Vec<Numbered<'_>> = finished.iter().enumerate().collect();
    let said = kind.summarise(&numbered);
    let failed = finished.iter().filter(|job| job.error.is_some()).count();
    let command = format!("descry experiment {}", source.words());
    let facts: Facts = vec![
        ("command", command.clone()),
        ("hash of the experiment", header.hash.clone()),
        ("descry", header.version.clone()),
        ("jobs", format!("{} ({failed} failed)", finished.len())),
    ];
    let mut summary = Row::new();
    let about = json!({
        "name": head.name, "kind": head.kind, "command": command, "hash": header.hash, "version": header.version,
        "jobs": finished.len(), "failed": failed,
    });
    summary.extend(about.as_object().cloned().unwrap_or_default());
    summary.extend(said.values);
    let mut sections = said.sections;
    sections.extend(failures(finished));
    let tables = page::markdown(&head.name, &facts, &sections);
    let clock = clock_table(finished);
    let clock_text = clock.as_ref().map_or(String::new(), Table::markdown);
    let summary_text = serde_json::to_string_pretty(&summary).map_err(|e| ExperimentError::file(out, &e))?;
    save(out, "jobs.csv", &csv(finished, |job| job.rows.clone()))?;
    save(out, "summary.json", &(summary_text + "\n"))?;
    save(out, "tables.md", &tables)?;
    save(out, "index.html", &page::html((&head.name, &head.about), &facts, &sections, &source.text, None))?;
    if clock.is_some() {
        save(out, "clock.csv", &csv(finished, |job| vec![job.clock.clone()]))?;
        save(out, "clock.md", &clock_text)?;
    }
    for section in &sections {
        if let Section::Plot(plot) = section {
            save(&out.join("plots"), &format!("{}.svg", plot.name()), &plot.svg())?;
        }
    }
    Ok(Results { summary, tables, clock: clock_text, failed })
}

/// Replaces a file atomically.
fn save(folder: &Path, name: &str, text: &str) -> Result<(), ExperimentError> {
    let (path, draft) = (folder.join(name), folder.join(format!(".{name}.part")));
    std::fs::create_dir_all(folder)
        .and_then(|()| std::fs::write(&draft, text))
        .and_then(|()| std::fs::rename(&draft, &path))
        .map_err(|e| ExperimentError::file(&path, &e))
}

/// Sections on the failed jobs, grouped by reason with a count; empty if none failed.
pub(super) fn failures<'a>(finished: impl IntoIterator<Item = &'a Finished>) -> Vec<Section> {
    let mut reasons = std::collections::BTreeMap::<&str, Vec<&str>>::new();
    for job in finished {
        if let Some(error) = &job.error {
            reasons.entry(error).or_default().push(&job.job);
        }
    }
    if reasons.is_empty() {
        return Vec::new();
    }
    let mut table = Table::new("Jobs that failed", "", &["because", "jobs", "the first of them"]);
    table.rows = reasons
        .iter()
        .map(|(why, jobs)| vec![(*why).into(), jobs.len().to_string(), jobs[0].into()])
        .collect();
    vec![Section::Heading("Failures".into()), Section::Table(table)]
}

/// CSV (RFC 4180), one line for each row; the columns are all names, in the order of their first occurrence.
pub fn csv(finished: &[Finished], rows: impl Fn(&Finished) -> Vec<Row>) -> String {
    let all: Vec<(&Finished, Row)> =
        finished.iter().flat_map(|job| rows(job).into_iter().map(move |row| (job, row))).collect();
    let mut seen = BTreeSet::new();
    let names = all.iter().flat_map(|(_, row)| row.keys());
    let columns: Vec<&String> = names.filter(|name| seen.insert(name.as_str())).collect();
    let mut text = std::iter::once("job")
        .chain(columns.iter().map(|c| c.as_str()))
        .chain(["error"])
        .map(quoted)
        .collect::<Vec<_>>()
        .join(",");
    text.push('\n');
    for (job, row) in &all {
        let values = columns.iter().map(|c| row.get(c.as_str()).map_or(String::new(), cell));
        let line =
            std::iter::once(job.job.clone()).chain(values).chain([job.error.clone().unwrap_or_default()]);
        text += &line.map(|value| quoted(&value)).collect::<Vec<_>>().join(",");
        text.push('\n');
    }
    text
}

fn cell(value: &Value) -> String {
    match value {
        Value::Null => String::new(),
        Value::String(text) => text.clone(),
        other => other.to_string(),
    }
}

fn quoted(text: &str) -> String {
    if text.contains([',', '"', '\n', '\r']) {
        format!("\"{}\"", text.replace('"', "\"\""))
    } else {
        text.to_string()
    }
}

/// Table of wall-clock times over all jobs; `None` if nothing was timed.
fn clock_table(finished: &[Finished]) -> Option<Table> {
    let mut seen = BTreeSet::new();
    let names: Vec<&String> =
        finished.iter().flat_map(|job| job.clock.keys()).filter(|name| seen.insert(name.as_str())).collect();
    let note = "Times on the wall of this machine, with the other jobs running beside.";
    let mut table =
        Table::new("Clock", note, &["what", "jobs", "mean", "median", "95 % are below", "greatest"]);
    for name in names {
        let mut values: Vec<f64> =
            finished.iter().filter_map(|job| job.clock.get(name.as_str())?.as_f64()).collect();
        values.sort_by(f64::total_cmp);
        let observations: Vec<Observation> =
            values.iter().zip(0..).map(|(&value, group)| Observation { group, value }).collect();
        let below = values.get((0.95 * (values.len().max(1) - 1) as f64).round() as usize).copied();
        table.rows.push(vec![
            name.clone(),
            values.len().to_string(),
            number(mean(&observations).map(|e| e.value), 3),
            number(median(&values), 3),
            number(below, 3),
            number(values.last().copied(), 3),
        ]);
    }
    (!table.rows.is_empty()).then_some(table)
}
