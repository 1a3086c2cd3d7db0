//! Summary of the runs by goal, policy and case: shares of right and false answers, means of views, metres
//! and seconds.

use serde_json::{Map, Value, json};

use super::Tasks;
use crate::job::{Numbered, Row};
use crate::kinds::kind::Summary;
use crate::kinds::paired;
use crate::kinds::trial::NOTE;
use crate::page::Section;
use crate::plot::{Axis, Plot, Point, Series};
use crate::statistics::{self, Estimate, Observation};
use crate::table::{Table, counted, shown};

const HEAD: [&str; 11] = [
    "",
    "policy",
    "runs",
    "right",
    "false yes",
    "false not there",
    "views",
    "metres",
    "seconds",
    "replans",
    "greatest error of the right, cm",
];

/// A finished run.
struct Run<'a> {
    goal: usize,
    case: &'a str,
    policy: &'a str,
    group: u64,
    /// Measurements; `None` if the run ended with an error.
    row: Option<&'a Row>,
}

impl Run<'_> {
    fn is(&self, key: &str) -> bool {
        self.row.and_then(|row| row.get(key)).and_then(Value::as_bool).unwrap_or(false)
    }

    fn number(&self, key: &str) -> Option<f64> {
        self.row?.get(key)?.as_f64()
    }
}

/// Statistics of some runs; shares and means in the order of `SHARES` and `MEANS`.
struct Figures {
    runs: usize,
    errors: usize,
    shares: [Option<Estimate>; 3],
    means: [Option<Estimate>; 4],
    error_m: Option<f64>,
}

const SHARES: [&str; 3] = ["right", "false_yes", "false_not_there"];
const MEANS: [&str; 4] = ["views", "metres", "seconds", "replans"];

impl Figures {
    fn of(runs: &[&Run<'_>]) -> Self {
        let share = |key: &str| statistics::rate(runs.iter().filter(|run| run.is(key)).count(), runs.len());
        let mean = |key: &str| {
            let observed =
                runs.iter().filter_map(|r| Some(Observation { group: r.group, value: r.number(key)? }));
            statistics::mean(&observed.collect::<Vec<_>>())
        };
        Self {
            runs: runs.len(),
            errors: runs.iter().filter(|run| run.row.is_none()).count(),
            shares: SHARES.map(share),
            means: MEANS.map(mean),
            error_m: runs
                .iter()
                .filter(|run| run.is("right"))
                .filter_map(|run| run.number("position_error_m"))
                .reduce(f64::max),
        }
    }

    fn json(&self) -> Value {
        let mut values = Map::new();
        values.insert("runs".into(), json!(self.runs));
        values.insert("errors".into(), json!(self.errors));
        let named = SHARES.iter().zip(&self.shares).chain(MEANS.iter().zip(&self.means));
        values.extend(named.map(|(name, estimate)| ((*name).to_string(), json!(estimate))));
        values.insert("greatest_error_m".into(), json!(self.error_m));
        Value::Object(values)
    }

    fn cells(&self, part: &str, policy: &str) -> Vec<String> {
        let mut cells = vec![part.to_string(), policy.to_string(), self.runs.to_string()];
        cells.extend(self.shares.map(|e| shown(e, 3)));
        cells.extend(self.means.map(|e| shown(e, 1)));
        cells.push(crate::table::number(self.error_m.map(|m| m * 100.0), 1));
        cells
    }
}

/// The runs of each policy in each part, as a table and as values.
fn table(title: &str, parts: &[(String, Vec<&Run<'_>>)], policies: &[String]) -> (Table, Map<String, Value>) {
    let (mut table, mut values) = (Table::new(title, NOTE, &HEAD), Map::new());
    for (part, runs) in parts {
        let mut by_policy = Map::new();
        for policy in policies {
            let own: Vec<&Run<'_>> = runs.iter().filter(|run| run.policy == policy).copied().collect();
            let figures = Figures::of(&own);
            table.rows.push(figures.cells(part, policy));
            by_policy.insert(policy.clone(), figures.json());
        }
        values.insert(part.clone(), Value::Object(by_policy));
    }
    (table, values)
}

pub(super) fn summarise(experiment: &Tasks, finished: &[Numbered<'_>]) -> Summary {
    let text = &experiment.text;
    let runs: Vec<Run<'_>> = finished
        .iter()
        .map(|&(n, job)| {
            let setting = experiment.setting(n);
            Run {
                goal: setting.goal,
                case: &setting.case.name,
                policy: setting.policy,
                group: setting.run as u64,
                row: job.rows.first().filter(|_| job.error.is_none()),
            }
        })
        .collect();
    let those = |part: &dyn Fn(&&Run<'_>) -> bool| runs.iter().filter(part).collect::<Vec<_>>();
    let by_goal: Vec<_> =
        text.goals.iter().enumerate().map(|(g, goal)| (goal.say.clone(), those(&|r| r.goal == g))).collect();
    let by_case: Vec<_> =
        text.cases.iter().map(|case| (case.name.clone(), those(&|r| r.case == case.name))).collect();
    let (all, overall) = table("All runs", &[("all".into(), those(&|_| true))], &text.policies);
    let (goals, goal_values) = table("By goal", &by_goal, &text.policies);
    let (cases, case_values) = table("By injected fault", &by_case, &text.policies);
    let parts = [(by_goal.len(), goals), (by_case.len(), cases)];
    // A division into one part says what all runs say.
    let parts = parts.into_iter().filter(|(parts, _)| *parts > 1).map(|(_, table)| table);
    let mut sections: Vec<Section> = std::iter::once(all).chain(parts).map(Section::Table).collect();
    let of_policy = |policy: &'_ String| {
        let own = runs.iter().zip(finished).filter(|(run, _)| run.policy == policy);
        own.filter_map(|(run, (n, _))| Some(((run.group, n / text.policies.len()), run.row?))).collect()
    };
    let settings: Vec<_> = text.policies.iter().map(|policy| (policy.as_str(), of_policy(policy))).collect();
    sections.extend(paired::table("policy", &settings).map(Section::Table));
    sections.extend(stages(experiment, &runs).map(Section::Table));
    sections.extend(plots(&text.policies, &by_goal).map(|plot| Section::Plot(Box::new(plot))));
    let values = json!({ "all": overall["all"], "goals": goal_values, "cases": case_values });
    Summary { values: values.as_object().cloned().unwrap_or_default(), sections }
}

/// Share of runs with a completed execution of each action; `None` if no goal names stages.
fn stages(experiment: &Tasks, runs: &[Run<'_>]) -> Option<Table> {
    let text = &experiment.text;
    let head = ["goal", "policy", "stage", "runs", "carried out"];
    let mut table = Table::new(
        "How far they came",
        "Runs in which the targets were there, and the action was carried out.",
        &head,
    );
    for (g, goal) in text.goals.iter().enumerate() {
        for policy in &text.policies {
            let own: Vec<&Run<'_>> =
                runs.iter().filter(|r| r.goal == g && r.policy == policy && r.is("present")).collect();
            for stage in &goal.stages {
                let done = own.iter().filter(|r| r.is(&format!("{stage} done"))).count();
                let share = shown(statistics::rate(done, own.len()), 3);
                table.rows.push(vec![
                    goal.say.clone(),
                    policy.clone(),
                    stage.clone(),
                    own.len().to_string(),
                    share,
                ]);
            }
        }
    }
    (!table.rows.is_empty()).then_some(table)
}

/// Plots of right answers and of their cost, by goal.
fn plots(policies: &[String], parts: &[(String, Vec<&Run<'_>>)]) -> [Plot; 2] {
    let series = |measure: fn(&Figures) -> Option<Estimate>| -> Vec<Series> {
        let of = |policy: &String| {
            let points = parts.iter().enumerate().filter_map(|(at, (_, runs))| {
                let own: Vec<&Run<'_>> = runs.iter().filter(|r| r.policy == policy).copied().collect();
                let e = measure(&Figures::of(&own))?;
                Some(Point { at: at as f64, value: e.value, interval: e.interval })
            });
            Series { name: policy.clone(), points: points.collect(), broken: false }
        };
        policies.iter().map(of).filter(|series| !series.points.is_empty()).collect()
    };
    let counts = parts.iter().flat_map(|(_, runs)| {
        policies.iter().map(|policy| runs.iter().filter(|r| r.policy == policy).count())
    });
    let n = counted(counts);
    let categories: Vec<String> = parts.iter().map(|(name, _)| name.clone()).collect();
    let dots = |name: &str, title: &str, x, series| Plot::Dots {
        name: name.into(),
        title: title.into(),
        categories: categories.clone(),
        x,
        series,
    };
    [
        dots(
            "right-by-goal",
            &format!("Share of right answers, 95 % interval, {n}"),
            Axis::fixed("share of runs", 0.0, 1.0),
            series(|f| f.shares[0]),
        ),
        dots(
            "seconds-by-goal",
            &format!("Time until the answer, mean, {n}"),
            Axis::free("seconds of the robot's clock"),
            series(|f| f.means[2]),
        ),
    ]
}
