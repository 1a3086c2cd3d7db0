//! Fault injection: runs with injected faults, which must all end, with the right verdict.

use std::path::Path;

use descry_agent::body;
use descry_agent::stop::Stop;
use descry_domains::abilities::searching::policies;
use descry_domains::goal;
use descry_domains::lexicon::{Lexicon, Places};
use descry_domains::load::{DEFAULT, Domain};
use descry_domains::objective::Goal;
use descry_robots::sim::{Fault, FaultPlan, SceneSpec};
use serde::Deserialize;
use serde_json::{Map, Value, json};

use super::paired;
use super::trial::{self, Measured, NOTE, Trial};
use crate::error::ExperimentError;
use crate::job::{Job, Numbered, Outcome};
use crate::kinds::kind::{Head, Kind, Summary, inputs_of, parse, refuse};
use crate::page::Section;
use crate::plot::{Axis, Plot, Point, Series};
use crate::source::Source;
use crate::statistics::{self, Observation};
use crate::table::{Table, counted, shown};

/// Keys of an experiment file of the kind `faults`.
#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
struct Text {
    /// The experiment's name.
    name: String,
    /// `faults`.
    kind: String,
    /// Purpose of the experiment, in a line.
    #[serde(default)]
    about: String,
    /// Built-in domain or a domain's folder.
    #[serde(default = "default_domain")]
    domain: String,
    /// Scene of the domain, or a file.
    scene: String,
    /// Goal, in the words of the domain.
    goal: String,
    /// The object to find, by its name or kind in the scene.
    target: String,
    /// Number of runs of each case, each in an arrangement of its own.
    runs: usize,
    /// Seed of the first arrangement; each further one has the next.
    #[serde(default = "default_seed")]
    first_seed: u64,
    /// Share of the runs of each case without the target.
    #[serde(default)]
    absent_share: f64,
    /// Policy that chooses where to look next, from the list above.
    #[serde(default = "default_policy")]
    policy: String,
    /// Maximum distance between the stated and the true position of a found object, metres.
    #[serde(default = "default_tolerance_m")]
    position_tolerance_m: f64,
    /// Cases, each with its injected faults.
    #[serde(rename = "case")]
    cases: Vec<Case>,
}

/// A combination of injected faults.
#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
struct Case {
    /// Name of the case in tables and plots.
    name: String,
    /// Injected faults; empty for a run without any.
    #[serde(default, rename = "fault")]
    faults: Vec<Fault>,
}

fn default_domain() -> String {
    DEFAULT.into()
}

fn default_seed() -> u64 {
    1
}

fn default_policy() -> String {
    policies::PLAN.into()
}

fn default_tolerance_m() -> f64 {
    0.05
}

/// Fault-injection experiment, as read from its file.
struct Faults {
    head: Head,
    text: Text,
    domain: Domain,
    goal: Goal,
    spec: SceneSpec,
}

pub(super) fn read(source: &Source) -> Result<Box<dyn Kind>, ExperimentError> {
    let text: Text = parse(source)?;
    let wrong = |holds: bool, key, problem: &str, mend: &str| match holds {
        true => Ok(()),
        false => Err(refuse(source, key, problem, mend)),
    };
    wrong((1..=1_000_000).contains(&text.runs), "runs", "so many runs make no experiment", "1 to 1000000")?;
    wrong(
        (0.0..1.0).contains(&text.absent_share),
        "absent_share",
        "this is no share",
        "from 0 to below 1, such as 0.25",
    )?;
    wrong(
        text.position_tolerance_m > 0.0,
        "position_tolerance_m",
        "nothing is ever so near",
        "metres, such as 0.05",
    )?;
    wrong(!text.cases.is_empty(), "case", "there is no case", "add a [[case]]")?;
    let known = policies::names();
    wrong(
        known.contains(&text.policy.as_str()),
        "policy",
        "there is no such policy",
        &format!("one of: {}", known.join(", ")),
    )?;
    for case in &text.cases {
        let plan = FaultPlan { faults: case.faults.clone() };
        plan.check()
            .map_err(|o| refuse(source, "case", format!("case \"{}\": {}", case.name, o.problem), o.mend))?;
    }
    let domain = Domain::load(&text.domain)
        .map_err(|e| refuse(source, "domain", e.to_string(), "name another domain"))?;
    let spec = body::scene_spec(Some(&text.scene), &domain)
        .map_err(|e| refuse(source, "scene", e.to_string(), "name another scene"))?;
    let goal = goal::read(&text.goal, &domain, &Lexicon::new(&domain, &Places::of_spec(&spec)))
        .map_err(|e| refuse(source, "goal", e.to_string(), "see descry goals"))?;
    let head = Head { name: text.name.clone(), kind: text.kind.clone(), about: text.about.clone() };
    Ok(Box::new(Faults { head, domain, goal, spec, text }))
}

impl Faults {
    /// Case and run number of a job.
    fn setting(&self, number: usize) -> (&Case, usize) {
        (&self.text.cases[number / self.text.runs], number % self.text.runs)
    }

    fn seed(&self, run: usize) -> u64 {
        self.text.first_seed.wrapping_add(run as u64)
    }
}

impl Kind for Faults {
    fn head(&self) -> &Head {
        &self.head
    }

    fn inputs(&self) -> Vec<(String, String)> {
        inputs_of(&self.domain, format!("{:?}", self.spec), std::iter::empty())
    }

    fn jobs(&self) -> Vec<Job> {
        let settings = (0..self.text.cases.len() * self.text.runs).map(|number| self.setting(number));
        let job = |(case, run): (&Case, usize)| {
            Job::new([("case", json!(case.name)), ("run", json!(run))]).with_seed(self.seed(run))
        };
        settings.map(job).collect()
    }

    fn run(&self, number: usize, scratch: &Path, stop: &Stop) -> Result<Outcome, String> {
        let (case, run) = self.setting(number);
        let (n, share) = (run as f64, self.text.absent_share);
        let trial = Trial {
            domain: &self.domain,
            goal: &self.goal,
            spec: &self.spec,
            program: None,
            targets: std::slice::from_ref(&self.text.target),
            present: ((n + 1.0) * share).floor() <= (n * share).floor(),
            seed: self.seed(run),
            faults: FaultPlan { faults: case.faults.clone() },
            policy: &self.text.policy,
            first_look_here: false,
            tolerance_m: self.text.position_tolerance_m,
        };
        trial::carry_out(&trial, scratch, stop)
    }

    fn summarise(&self, finished: &[Numbered<'_>]) -> Summary {
        let read = |case: &Case| -> (usize, Vec<(Measured, f64)>) {
            let jobs = finished.iter().filter(|(n, _)| self.setting(*n).0.name == case.name);
            let mut failed = 0;
            let runs = jobs.filter_map(|&(n, job)| {
                failed += usize::from(job.error.is_some());
                let row = job.rows.first()?;
                let mishaps = row.get("mishaps").and_then(Value::as_f64).unwrap_or(0.0);
                Some((Measured::read(self.setting(n).1 as u64, row)?, mishaps))
            });
            let runs = runs.collect();
            (failed, runs)
        };
        let head =
            ["case", "runs", "right", "false declarations", "errors", "mishaps a run", "views", "metres"];
        let mut table = Table::new("Verdicts", NOTE, &head);
        let (mut cases, mut points, mut counts) = (Map::new(), Vec::new(), Vec::new());
        let mut all = (0, 0);
        for (at, case) in self.text.cases.iter().enumerate() {
            let (failed, runs) = read(case);
            let n = runs.len() + failed;
            counts.push(n);
            let right = runs.iter().filter(|(run, _)| run.right).count();
            let wrong = runs.iter().filter(|(run, _)| run.false_declaration).count();
            all = (all.0 + right, all.1 + n);
            let mean = |of: fn(&(Measured, f64)) -> f64| {
                let observed = runs.iter().map(|run| Observation { group: run.0.group, value: of(run) });
                statistics::mean(&observed.collect::<Vec<_>>())
            };
            let (views, metres, mishaps) = (mean(|r| r.0.views), mean(|r| r.0.metres), mean(|r| r.1));
            let rate = statistics::rate(right, n);
            let shown_rates = [shown(rate, 3), shown(statistics::rate(wrong, n), 3), failed.to_string()];
            let means = [shown(mishaps, 2), shown(views, 2), shown(metres, 2)];
            table.rows.push(
                [vec![case.name.clone(), n.to_string()], shown_rates.to_vec(), means.to_vec()].concat(),
            );
            points.extend(rate.map(|e| Point { at: at as f64, value: e.value, interval: e.interval }));
            let values = json!({
                "runs": n, "right": rate, "false_declarations": statistics::rate(wrong, n), "errors": failed,
                "mishaps_mean": mishaps, "views_mean": views, "metres_mean": metres,
            });
            cases.insert(case.name.clone(), values);
        }
        let of_case = |case: &Case| {
            let own = finished
                .iter()
                .filter(|(n, job)| self.setting(*n).0.name == case.name && job.error.is_none());
            own.filter_map(|(n, job)| Some(((self.setting(*n).1 as u64, 0), job.rows.first()?))).collect()
        };
        let settings: Vec<_> =
            self.text.cases.iter().map(|case| (case.name.as_str(), of_case(case))).collect();
        let paired = paired::table("case", &settings).map(Section::Table);
        let overall = statistics::rate(all.0, all.1);
        let plot = Plot::Dots {
            name: "right-by-case".into(),
            title: format!(
                "Share of right verdicts by injected fault, 95 % interval, {}",
                counted(counts.into_iter())
            ),
            categories: self.text.cases.iter().map(|case| case.name.clone()).collect(),
            x: Axis::fixed("share of runs", 0.0, 1.0),
            series: vec![Series { name: self.text.policy.clone(), points, broken: false }],
        };
        let text = format!("The right verdict in {} of {} runs.", shown(overall, 3), all.1);
        let values = json!({ "right": overall, "cases": cases });
        Summary {
            values: values.as_object().cloned().unwrap_or_default(),
            sections: [Section::Text(text), Section::Table(table)]
                .into_iter()
                .chain(paired)
                .chain([Section::Plot(Box::new(plot))])
                .collect(),
        }
    }
}
