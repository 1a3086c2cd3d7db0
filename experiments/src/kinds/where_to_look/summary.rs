//! Summary of the runs of all policies: rates, means, savings, calibration.

use serde_json::{Map, Value, json};

use super::{Setting, WhereToLook};
use crate::job::Numbered;
use crate::kinds::kind::Summary;
use crate::kinds::trial::Measured;
use crate::page::Section;
use crate::plot::{Axis, Plot, Point, Series};
use crate::statistics::{self, Estimate, Observation, Pair};
use crate::table::{Table, number, shown};

const BINS: usize = 10;
const NOTE: &str = "Shares with Wilson's intervals; means with intervals bootstrapped over scenes, where there are 8 or more; 95 % \
                    each. Seconds are those of the robot's clock. A run without the right verdict counts with the views that it took.";

/// Setting and measurements of a run.
type Run<'a> = (&'a Setting, Measured);

/// Statistics of some runs of one policy.
struct Figures {
    runs: usize,
    success: Option<Estimate>,
    false_declarations: Option<Estimate>,
    views: Option<Estimate>,
    views_median: Option<f64>,
    metres: Option<Estimate>,
    seconds: Option<Estimate>,
    brier: Option<f64>,
    ece: Option<f64>,
}

fn figures(runs: &[&Measured]) -> Figures {
    let n = runs.len();
    let count = |of: fn(&Measured) -> bool| runs.iter().filter(|run| of(run)).count();
    let mean = |of: fn(&Measured) -> f64| {
        let observed = runs.iter().map(|run| Observation { group: run.group, value: of(run) });
        statistics::mean(&observed.collect::<Vec<_>>())
    };
    let views: Vec<f64> = runs.iter().map(|run| run.views).collect();
    let forecasts: Vec<(f64, bool)> = runs.iter().filter_map(|run| run.forecast).collect();
    Figures {
        runs: n,
        success: statistics::rate(count(|run| run.right), n),
        false_declarations: statistics::rate(count(|run| run.false_declaration), n),
        views: mean(|run| run.views),
        views_median: statistics::median(&views),
        metres: mean(|run| run.metres),
        seconds: mean(|run| run.seconds),
        brier: statistics::brier(&forecasts),
        ece: statistics::calibration_error(&forecasts, BINS),
    }
}

impl Figures {
    fn json(&self) -> Map<String, Value> {
        let value = |e: Option<Estimate>| json!(e.map(|e| e.value));
        let interval = |e: Option<Estimate>| json!(e.and_then(|e| e.interval));
        let all = json!({
            "runs": self.runs,
            "success": value(self.success),
            "success_ci95": interval(self.success),
            "false_declarations": value(self.false_declarations),
            "false_declarations_ci95": interval(self.false_declarations),
            "views_mean": value(self.views),
            "views_ci95": interval(self.views),
            "views_median": self.views_median,
            "metres_mean": value(self.metres),
            "metres_ci95": interval(self.metres),
            "seconds_mean": value(self.seconds),
            "seconds_ci95": interval(self.seconds),
            "brier": self.brier,
            "ece": self.ece,
        });
        all.as_object().cloned().unwrap_or_default()
    }

    fn cells(&self, first: Vec<String>) -> Vec<String> {
        let rest = vec![
            self.runs.to_string(),
            shown(self.success, 3),
            shown(self.false_declarations, 3),
            shown(self.views, 2),
            number(self.views_median, 1),
            shown(self.metres, 2),
            shown(self.seconds, 1),
            number(self.brier, 3),
            number(self.ece, 3),
        ];
        [first, rest].concat()
    }
}

const HEAD: [&str; 10] = [
    "policy",
    "runs",
    "success",
    "false declarations",
    "views",
    "median",
    "metres",
    "seconds",
    "Brier",
    "ECE",
];

/// A part of the runs: the name of the criterion, the name of the part, and its filter.
type Part<'a> = (&'static str, String, Box<dyn Fn(&Run<'_>) -> bool + 'a>);

fn parts(experiment: &WhereToLook) -> Vec<Part<'_>> {
    let mut parts: Vec<Part<'_>> = Vec::new();
    for (n, level) in experiment.text.occlusions.iter().enumerate() {
        parts.push(("by_occlusion", level.name.clone(), Box::new(move |run| run.0.occlusion == n)));
    }
    for &poses in &experiment.text.poses {
        parts.push(("by_poses", poses.to_string(), Box::new(move |run| run.0.poses == poses)));
    }
    for (name, present) in [("present", true), ("absent", false)] {
        parts.push(("by_target", name.into(), Box::new(move |run| run.0.present == present)));
    }
    parts
}

pub(super) fn summarise(experiment: &WhereToLook, finished: &[Numbered<'_>]) -> Summary {
    let runs: Vec<Run<'_>> = finished
        .iter()
        .filter_map(|&(n, job)| {
            let setting = &experiment.jobs[n];
            Some((setting, Measured::read(setting.scene as u64, job.rows.first()?)?))
        })
        .collect();
    let of = |policy: &str, part: &dyn Fn(&Run<'_>) -> bool| {
        let those: Vec<&Measured> =
            runs.iter().filter(|run| run.0.policy == policy && part(run)).map(|run| &run.1).collect();
        figures(&those)
    };
    let parts = parts(experiment);
    let mut summary = Summary::default();
    let mut overall = Table::new("All runs", NOTE, &HEAD);
    let mut policies = Map::new();
    for policy in &experiment.text.policies {
        let all = of(policy, &|_| true);
        overall.rows.push(all.cells(vec![policy.clone()]));
        let mut values = all.json();
        for (by, name, part) in &parts {
            let group = values.entry(*by).or_insert_with(|| json!({}));
            group[name] = Value::Object(of(policy, part).json());
        }
        policies.insert(policy.clone(), Value::Object(values));
    }
    summary.values.insert("policies".into(), Value::Object(policies));
    let comparisons = comparisons(experiment, &runs);
    summary.values.insert("comparisons".into(), comparisons.1);
    let ours = of(&experiment.text.ours, &|_| true);
    summary.sections.extend([Section::Heading("Overall".into()), Section::Text(in_words(experiment, &ours))]);
    summary.sections.extend([Section::Table(overall), Section::Table(comparisons.0)]);
    summary.sections.extend(plots(experiment, &of));
    summary.sections.push(Section::Plot(Box::new(reliability(experiment, &runs))));
    summary.sections.push(Section::Heading("In parts".into()));
    for (_, name, part) in &parts {
        let mut table = Table::new(part_title(name), "", &HEAD);
        let figures = experiment.text.policies.iter().map(|policy| (policy, of(policy, part)));
        let figures = figures.filter(|(_, figures)| figures.runs > 0);
        table.rows = figures.map(|(policy, figures)| figures.cells(vec![policy.clone()])).collect();
        if !table.rows.is_empty() {
            summary.sections.push(Section::Table(table));
        }
    }
    summary
}

fn part_title(name: &str) -> String {
    match name.parse::<usize>() {
        Ok(poses) => format!("{poses} poses"),
        Err(_) => format!("Target {name}"),
    }
}

fn in_words(experiment: &WhereToLook, ours: &Figures) -> String {
    let text = &experiment.text;
    let none_absent = match text.absent_share > 0.0 && experiment.jobs.iter().all(|setting| setting.present) {
        true => format!(
            " None of the scenes is without the target: an absent_share of {} takes {:.0} scenes or more.",
            text.absent_share,
            ((1.0 / text.absent_share).ceil() - 1.0) * text.occlusions.len() as f64 + 1.0,
        ),
        false => String::new(),
    };
    format!(
        "\"{}\" in {} scenes, {} poses to look from. {}: the right verdict in {} of the runs after {} views in the mean.{none_absent}",
        text.goal,
        text.scenes,
        text.poses.iter().map(ToString::to_string).collect::<Vec<_>>().join(", "),
        text.ours,
        shown(ours.success, 3),
        shown(ours.views, 2)
    )
}

/// Our policy against others in the same scenes with the same viewpoints: differences and savings.
fn comparisons(experiment: &WhereToLook, runs: &[Run<'_>]) -> (Table, Value) {
    let note = "Runs in the same scene with the same poses in pairs; intervals of 95 % bootstrapped over scenes; p is that of the \
                two-sided sign-flip permutation test of the views over scenes. Saved is one less the ratio of the means.";
    let head = ["against", "pairs", "views more", "p", "views saved", "metres saved", "seconds saved"];
    let ours = &experiment.text.ours;
    let mut table = Table::new(format!("{ours} against others"), note, &head);
    let mut values = Map::new();
    for other in &experiment.text.against {
        let pairs = |of: fn(&Measured) -> f64| -> Vec<Pair> {
            let mine = runs.iter().filter(|run| run.0.policy == *ours);
            let partner = |run: &Run<'_>| {
                let same = |r: &&Run<'_>| {
                    r.0.policy == *other && r.0.scene == run.0.scene && r.0.poses == run.0.poses
                };
                runs.iter().find(same).map(|r| of(&r.1))
            };
            mine.filter_map(|run| Some(Pair { group: run.1.group, a: of(&run.1), b: partner(run)? }))
                .collect()
        };
        let views = pairs(|run| run.views);
        let (more, p) = (statistics::difference(&views), statistics::sign_flip(&views));
        let saved = [
            statistics::saving(&views),
            statistics::saving(&pairs(|r| r.metres)),
            statistics::saving(&pairs(|r| r.seconds)),
        ];
        let cells = vec![other.clone(), views.len().to_string(), shown(more, 2), number(p, 3)];
        table.rows.push(cells.into_iter().chain(saved.map(|s| shown(s, 3))).collect());
        let json = json!({ "views_more": more, "views_more_p": p, "views_saved": saved[0], "metres_saved": saved[1], "seconds_saved": saved[2] });
        values.insert(other.clone(), json);
    }
    (table, Value::Object(values))
}

/// Lookup of the statistics of a policy in a part of the runs.
type Of<'a> = dyn Fn(&str, &dyn Fn(&Run<'_>) -> bool) -> Figures + 'a;

fn plots(experiment: &WhereToLook, of: &Of<'_>) -> Vec<Section> {
    let text = &experiment.text;
    let dots = |name: &str, title: &str, x: Axis, measure: fn(&Figures) -> Option<Estimate>| {
        let of_level = |(n, level): (usize, &super::Occlusion)| {
            let points = text.policies.iter().enumerate().filter_map(|(at, policy)| {
                let e = measure(&of(policy, &|run: &Run<'_>| run.0.occlusion == n && run.0.present))?;
                Some(Point { at: at as f64, value: e.value, interval: e.interval })
            });
            Series { name: level.name.clone(), points: points.collect(), broken: false }
        };
        let absent = text.policies.iter().enumerate().filter_map(|(at, policy)| {
            let e = measure(&of(policy, &|run: &Run<'_>| !run.0.present))?;
            Some(Point { at: at as f64, value: e.value, interval: e.interval })
        });
        let absent = Series { name: "not there".into(), points: absent.collect(), broken: false };
        let series =
            text.occlusions.iter().enumerate().map(of_level).chain([absent]).filter(|s| !s.points.is_empty());
        let (categories, series) = (text.policies.clone(), series.collect());
        Section::Plot(Box::new(Plot::Dots { name: name.into(), title: title.into(), categories, x, series }))
    };
    let over_poses = |name: &str, title: &str, y: Axis, measure: fn(&Figures) -> Option<Estimate>| {
        let series = text.policies.iter().map(|policy| {
            let points = text.poses.iter().filter_map(|&poses| {
                let e = measure(&of(policy, &|run: &Run<'_>| run.0.poses == poses))?;
                Some(Point { at: poses as f64, value: e.value, interval: e.interval })
            });
            Series { name: policy.clone(), points: points.collect(), broken: policy == "oracle" }
        });
        let (x, series) = (Axis::free("poses to look from"), series.collect());
        let (name, title) = (name.into(), title.into());
        Section::Plot(Box::new(Plot::Lines { name, title, x, y, series, diagonal: false, counts: vec![] }))
    };
    let mut plots = vec![
        dots(
            "views-by-policy",
            "Views until the verdict, by what can be seen from the start",
            Axis::free("views"),
            |f| f.views,
        ),
        dots("metres-by-policy", "Driven until the verdict", Axis::free("metres"), |f| f.metres),
        dots("success-by-policy", "Right verdicts", Axis::fixed("share of runs", 0.0, 1.0), |f| f.success),
    ];
    if text.poses.len() > 1 {
        let seconds = Axis::free("seconds of the robot's clock");
        plots.extend([
            over_poses("views-by-poses", "Views until the verdict", Axis::free("views"), |f| f.views),
            over_poses("seconds-by-poses", "Time until the verdict", seconds, |f| f.seconds),
        ]);
    }
    plots
}

fn reliability(experiment: &WhereToLook, runs: &[Run<'_>]) -> Plot {
    let ours = &experiment.text.ours;
    let forecasts = |policy: &dyn Fn(&str) -> bool| -> Vec<(f64, bool)> {
        runs.iter().filter(|run| policy(&run.0.policy)).filter_map(|run| run.1.forecast).collect()
    };
    let mine = forecasts(&|policy| policy == ours);
    let points = |forecasts: &[(f64, bool)]| {
        let bins = statistics::reliability(forecasts, BINS);
        bins.iter()
            .map(|b| Point { at: b.stated, value: b.observed.value, interval: b.observed.interval })
            .collect()
    };
    let series = vec![
        Series { name: ours.clone(), points: points(&mine), broken: false },
        Series { name: "all policies".into(), points: points(&forecasts(&|_| true)), broken: true },
    ];
    let counts =
        statistics::reliability(&mine, BINS).iter().map(|b| ((b.from + b.to) / 2.0, b.observed.n)).collect();
    Plot::Lines {
        name: "reliability".into(),
        title: format!("Reliability of what is stated in the end; counts of {ours}"),
        x: Axis::fixed("stated probability that it is there", 0.0, 1.0),
        y: Axis::fixed("share where it was", 0.0, 1.0),
        series,
        diagonal: true,
        counts,
    }
}
