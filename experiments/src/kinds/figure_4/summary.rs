//! The figure with its tables, and the calibration.

use serde_json::{Value, json};

use super::{Cell, Figure4, cells, row};
use crate::job::Numbered;
use crate::kinds::kind::Summary;
use crate::page::Section;
use crate::plot::{Axis, Plot, Point, Series};
use crate::statistics::{self, Estimate, Pair};
use crate::table::{Table, number, shown};

const MODES: [&str; 2] = ["single", "merged"];
const BINS: usize = 10;
const NOTE: &str = "Shares with 95 % intervals, bootstrapped over arrangements.";

/// Measure of a cell: its name, and the function that estimates it.
type Measure = (&'static str, fn(&Cell) -> Option<Estimate>);

const MEASURES: [Measure; 2] = [("precision", precision), ("recall", recall)];

fn precision(cell: &Cell) -> Option<Estimate> {
    share(cell, |[right, wrong, ..]| (right, right + wrong))
}

fn recall(cell: &Cell) -> Option<Estimate> {
    share(cell, |[right, _, _, things]| (right, things))
}

fn named(cell: &Cell) -> Option<Estimate> {
    share(cell, |[right, _, named, _]| (named, right))
}

fn share(cell: &Cell, parts: impl Fn([f64; 4]) -> (f64, f64)) -> Option<Estimate> {
    let pairs = cell.counts.iter().map(|&(group, counts)| {
        let (a, b) = parts(counts);
        Pair { group, a, b }
    });
    statistics::ratio(&pairs.collect::<Vec<_>>())
}

pub(super) fn summarise(experiment: &Figure4, finished: &[Numbered<'_>]) -> Summary {
    let cells = cells(finished);
    let cell = |set: &str, recogniser: &str, mode: &str, views: usize| {
        cells
            .get(&(set.to_string(), recogniser.to_string(), mode.to_string(), views as u64))
            .cloned()
            .unwrap_or_default()
    };
    let poses = experiment.text.poses;
    let mut summary = Summary::default();
    let mut by_recogniser = serde_json::Map::new();
    for recogniser in &experiment.text.recognisers {
        let mut sets = serde_json::Map::new();
        for set in &experiment.text.sets {
            let curve = |mode: &str| {
                let curve: Vec<Cell> = (1..=poses).map(|k| cell(&set.name, recogniser, mode, k)).collect();
                (mode.to_string(), numbers(&curve))
            };
            sets.insert(set.name.clone(), Value::Object(MODES.into_iter().map(curve).collect()));
        }
        by_recogniser.insert(recogniser.clone(), Value::Object(sets));
    }
    if let Some(Value::Object(first)) =
        experiment.text.recognisers.first().and_then(|name| by_recogniser.get(name))
    {
        summary.values.extend(first.clone());
    }
    summary.values.insert("recognisers".into(), Value::Object(by_recogniser));
    for set in &experiment.text.sets {
        let title = format!("The set \"{}\": {} arrangements", set.name, set.arrangements);
        summary.sections.push(Section::Heading(title));
        let of_set = |recogniser: &str, mode: &str, k: usize| cell(&set.name, recogniser, mode, k);
        summary.sections.extend(figures(experiment, &set.name, &of_set));
        summary.sections.push(Section::Table(table(experiment, &of_set)));
        summary.sections.push(Section::Table(handles(experiment, &of_set)));
        summary.sections.extend(calibration(experiment, &set.name, &of_set));
    }
    summary
}

/// Lookup of the cell of a recogniser, a mode and a number of views.
type OfSet<'a> = dyn Fn(&str, &str, usize) -> Cell + 'a;

fn numbers(curve: &[Cell]) -> Value {
    let mut values = row(json!({ "views": (1..=curve.len()).collect::<Vec<_>>() }));
    for (name, measure) in MEASURES {
        let estimates: Vec<Option<Estimate>> = curve.iter().map(measure).collect();
        values.insert(name.into(), estimates.iter().map(|e| json!(e.map(|e| e.value))).collect());
        let intervals = estimates.iter().map(|e| json!(e.and_then(|e| e.interval)));
        values.insert(format!("{name}_ci95"), intervals.collect());
    }
    let forecasts: Vec<(f64, bool)> = curve.iter().flat_map(|c| c.forecasts.iter().copied()).collect();
    values.insert("brier".into(), json!(statistics::brier(&forecasts)));
    values.insert("ece".into(), json!(statistics::calibration_error(&forecasts, BINS)));
    let handled =
        |seen: usize| curve.iter().map(|c| json!([c.handled[seen].0, c.handled[seen].1])).collect::<Value>();
    values.insert("handled_called_before_handle_seen".into(), handled(0));
    values.insert("handled_called_after_handle_seen".into(), handled(1));
    Value::Object(values)
}

/// Precision and recall by number of views: a plot for each recogniser, in the style of the paper's figure.
fn figures(experiment: &Figure4, set: &str, of_set: &OfSet<'_>) -> Vec<Section> {
    let kind = &experiment.text.of_kind;
    let plot = |recogniser: &String| {
        let series = MEASURES.into_iter().flat_map(|(name, measure)| {
            MODES.into_iter().map(move |mode| {
                let points = (1..=experiment.text.poses).filter_map(|k| {
                    let e = measure(&of_set(recogniser, mode, k))?;
                    Some(Point { at: k as f64, value: e.value, interval: e.interval })
                });
                Series { name: format!("{name}, {mode}"), points: points.collect(), broken: mode == "single" }
            })
        });
        Section::Plot(Box::new(Plot::Lines {
            name: format!("figure-4-{set}-{recogniser}"),
            title: format!("Calling things \"{kind}\": {recogniser}, {set}"),
            x: Axis::free("views"),
            y: Axis::fixed("share", 0.0, 1.0),
            series: series.collect(),
            diagonal: false,
            counts: Vec::new(),
        }))
    };
    experiment.text.recognisers.iter().map(plot).collect()
}

fn table(experiment: &Figure4, of_set: &OfSet<'_>) -> Table {
    let head = ["recogniser", "mode", "views", "precision", "recall", "right name", "Brier"];
    let mut table = Table::new("Precision and recall", NOTE, &head);
    for recogniser in &experiment.text.recognisers {
        for mode in MODES {
            for k in 1..=experiment.text.poses {
                let cell = of_set(recogniser, mode, k);
                table.rows.push(vec![
                    recogniser.clone(),
                    mode.into(),
                    k.to_string(),
                    shown(precision(&cell), 3),
                    shown(recall(&cell), 3),
                    shown(named(&cell), 3),
                    number(statistics::brier(&cell.forecasts), 3),
                ]);
            }
        }
    }
    table
}

fn handles(experiment: &Figure4, of_set: &OfSet<'_>) -> Table {
    let kind = &experiment.text.of_kind;
    let note = format!(
        "How often what has a handle was called \"{kind}\", with Wilson's intervals, by whether enough of the handle had come into view."
    );
    let head = ["recogniser", "mode", "handle unseen", "of", "handle seen", "of"];
    let mut table = Table::new("Look-alikes with a handle", note, &head);
    for recogniser in &experiment.text.recognisers {
        for mode in MODES {
            let sums = (1..=experiment.text.poses).fold([(0, 0); 2], |sums, k| {
                let cell = of_set(recogniser, mode, k);
                [0, 1].map(|s| (sums[s].0 + cell.handled[s].0, sums[s].1 + cell.handled[s].1))
            });
            let [before, after] =
                sums.map(|(called, of)| [shown(statistics::rate(called, of), 3), of.to_string()]);
            table
                .rows
                .push([vec![recogniser.clone(), mode.into()], before.to_vec(), after.to_vec()].concat());
        }
    }
    table
}

fn calibration(experiment: &Figure4, set: &str, of_set: &OfSet<'_>) -> Vec<Section> {
    let Some(recogniser) = experiment.text.recognisers.first() else { return Vec::new() };
    let of_mode = |mode: &str| -> Vec<(f64, bool)> {
        (1..=experiment.text.poses).flat_map(|k| of_set(recogniser, mode, k).forecasts).collect()
    };
    let merged = of_mode("merged");
    let bins = statistics::reliability(&merged, BINS);
    let points = |mode: &str| {
        let bins = statistics::reliability(&of_mode(mode), BINS);
        bins.iter()
            .map(|b| Point { at: b.stated, value: b.observed.value, interval: b.observed.interval })
            .collect()
    };
    let series = ["merged", "single"].map(|mode| Series {
        name: mode.into(),
        points: points(mode),
        broken: mode == "single",
    });
    let plot = Plot::Lines {
        name: format!("reliability-{set}"),
        title: format!(
            "Reliability of \"it is a {}\": {recogniser}, {set}; counts of merged",
            experiment.text.of_kind
        ),
        x: Axis::fixed("stated probability", 0.0, 1.0),
        y: Axis::fixed("share that was one", 0.0, 1.0),
        series: series.into(),
        diagonal: true,
        counts: bins.iter().map(|b| ((b.from + b.to) / 2.0, b.observed.n)).collect(),
    };
    let text = format!(
        "Brier score {} and expected calibration error {} over {} percepts of all numbers of merged views.",
        number(statistics::brier(&merged), 3),
        number(statistics::calibration_error(&merged, BINS), 3),
        merged.len()
    );
    vec![Section::Plot(Box::new(plot)), Section::Text(text)]
}
