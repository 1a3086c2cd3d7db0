//! Figure 4 of paper 004: precision and recall for a kind of object after each view, from that view alone and
//! from all views merged, by each recogniser.
//!
//! The body drives around the table and looks from each pose in turn. *Single* at k is the k-th view alone,
//! *merged* at k are the first k views in one cloud. A percept classified as the kind is correct if it lies
//! at the true position of an object of the kind, each object counted once. Recall is over all objects of the
//! kind, hidden or not.

use std::collections::BTreeMap;
use std::path::Path;

use descry_agent::body::{self, program};
use descry_agent::stop::Stop;
use descry_domains::load::{DEFAULT, Domain};
use descry_perception::ObjectModel;
use descry_perception::recognise::{Descry, Published, Recogniser};
use descry_robots::sim::SceneSpec;
use serde::Deserialize;
use serde_json::{Value, json};

use crate::error::ExperimentError;
use crate::job::{Job, Numbered, Outcome, Row};
use crate::kinds::kind::{Head, Kind, OtherBody, Summary, parse, refuse};
use crate::source::Source;

mod score;
mod summary;
mod views;

/// Keys of an experiment file of the kind `figure-4`.
#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
struct Text {
    /// The experiment's name.
    name: String,
    /// `figure-4`.
    kind: String,
    /// Purpose of the experiment, in a line.
    #[serde(default)]
    about: String,
    /// Built-in domain or a domain's folder.
    #[serde(default = "default_domain")]
    domain: String,
    /// Scene of the domain, or a file.
    scene: String,
    /// The kind of object to score.
    of_kind: String,
    /// The known objects; all of the domain if left out.
    #[serde(default)]
    known: Vec<String>,
    /// Names of the recognisers, `descry` and `published` (that of the paper); the figures of the first one
    /// lead the summary.
    recognisers: Vec<String>,
    /// Number of views, evenly around the surface.
    #[serde(default = "default_poses")]
    poses: usize,
    /// Distance of the views from the centre of the surface, metres.
    #[serde(default = "default_distance_m")]
    distance_m: f64,
    /// Sets of arrangements.
    #[serde(rename = "set")]
    sets: Vec<Set>,
}

/// Arrangements that are scored together.
#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
struct Set {
    /// Name of the set in tables and plots.
    name: String,
    /// Seed of the first arrangement; each further one has the next.
    first_seed: u64,
    /// Number of arrangements.
    arrangements: u64,
    /// Body instead of the simulator: `program:COMMAND`, whose own world has objects of the same kinds.
    #[serde(default)]
    robot: Option<OtherBody>,
}

fn default_domain() -> String {
    DEFAULT.into()
}

fn default_poses() -> usize {
    5
}

fn default_distance_m() -> f64 {
    1.4
}

/// Constructor of a recogniser.
type Make = fn() -> Box<dyn Recogniser>;

const RECOGNISERS: [(&str, Make); 2] =
    [("descry", || Box::new(Descry::default())), ("published", || Box::new(Published::default()))];

/// Experiment of Figure 4, as read from its file.
struct Figure4 {
    head: Head,
    text: Text,
    inputs: Vec<(String, String)>,
    spec: SceneSpec,
    models: Vec<ObjectModel>,
    recognisers: Vec<Box<dyn Recogniser>>,
    /// Set index and seed of each job.
    jobs: Vec<(usize, u64)>,
}

pub(super) fn read(source: &Source) -> Result<Box<dyn Kind>, ExperimentError> {
    let text: Text = parse(source)?;
    check(source, &text)?;
    let domain = Domain::load(&text.domain)
        .map_err(|e| refuse(source, "domain", e.to_string(), "name another domain"))?;
    let spec = body::scene_spec(Some(&text.scene), &domain)
        .map_err(|e| refuse(source, "scene", e.to_string(), "name another scene"))?;
    let known = |model: &&ObjectModel| text.known.is_empty() || text.known.contains(&model.name);
    let models: Vec<ObjectModel> = domain.objects.iter().filter(known).cloned().collect();
    let names: Vec<&str> = domain.objects.iter().map(|o| o.name.as_str()).collect();
    if let Some(absent) = text.known.iter().find(|name| !names.contains(&name.as_str())) {
        let mend = format!("the domain's objects are: {}", names.join(", "));
        return Err(refuse(source, "known", format!("no object is called \"{absent}\""), mend));
    }
    let kinds: Vec<&str> = models.iter().map(|m| m.kind.as_str()).collect();
    if !kinds.contains(&text.of_kind.as_str()) {
        let problem = format!("no known object is of the kind \"{}\"", text.of_kind);
        return Err(refuse(source, "of_kind", problem, format!("one of: {}", kinds.join(", "))));
    }
    let made = |name: &String| RECOGNISERS.iter().find(|(known, _)| known == name).map(|(_, make)| make());
    let recognisers = text.recognisers.iter().filter_map(made).collect();
    let jobs = text
        .sets
        .iter()
        .enumerate()
        .flat_map(|(at, set)| (0..set.arrangements).map(move |n| (at, set.first_seed.wrapping_add(n))));
    let head = Head { name: text.name.clone(), kind: text.kind.clone(), about: text.about.clone() };
    let jobs = jobs.collect();
    let bodies = text.sets.iter().filter_map(|set| set.robot.as_ref()).flat_map(OtherBody::texts);
    let bodies = bodies.map(|(path, text)| (path.display().to_string(), text));
    let inputs = [("scene".into(), format!("{spec:?}")), ("models".into(), format!("{models:?}"))];
    let inputs = inputs.into_iter().chain(bodies).collect();
    Ok(Box::new(Figure4 { head, inputs, spec, models, recognisers, jobs, text }))
}

fn check(source: &Source, text: &Text) -> Result<(), ExperimentError> {
    let known: Vec<&str> = RECOGNISERS.iter().map(|(name, _)| *name).collect();
    if let Some(absent) = text.recognisers.iter().find(|name| !known.contains(&name.as_str())) {
        let problem = format!("no recogniser is called \"{absent}\"");
        return Err(refuse(source, "recognisers", problem, format!("one of: {}", known.join(", "))));
    }
    let wrong = |holds: bool, key, problem: &str, mend: &str| match holds {
        true => Ok(()),
        false => Err(refuse(source, key, problem, mend)),
    };
    wrong(
        !text.recognisers.is_empty(),
        "recognisers",
        "there is none",
        &format!("one of: {}", known.join(", ")),
    )?;
    wrong((1..=100).contains(&text.poses), "poses", "so many looks cannot be taken", "1 to 100")?;
    let near = text.distance_m.is_finite() && text.distance_m > 0.3 && text.distance_m < 20.0;
    wrong(near, "distance_m", "no body can look from there", "metres, such as 1.4")?;
    let some = text.sets.iter().all(|set| (1..=1_000_000).contains(&set.arrangements));
    wrong(
        some && !text.sets.is_empty(),
        "set",
        "a set holds no arrangement, or too many",
        "1 to 1000000 arrangements",
    )
}

impl Kind for Figure4 {
    fn head(&self) -> &Head {
        &self.head
    }

    fn inputs(&self) -> Vec<(String, String)> {
        self.inputs.clone()
    }

    fn jobs(&self) -> Vec<Job> {
        let job = |&(set, seed): &(usize, u64)| {
            Job::new([("set", json!(self.text.sets[set].name)), ("seed", json!(seed))])
        };
        self.jobs.iter().map(job).collect()
    }

    fn run(&self, number: usize, _scratch: &Path, _stop: &Stop) -> Result<Outcome, String> {
        let (set, seed) = self.jobs[number];
        let started = std::time::Instant::now();
        let staged = match &self.text.sets[set].robot {
            None => views::simulated(&self.spec, seed)?,
            Some(robot) => {
                views::Staged::of(program::open(robot.command(), seed, &[]).map_err(|e| e.to_string())?)
            }
        };
        let taken = views::take(&staged, self.text.poses, self.text.distance_m)?;
        let rows = score::rows(self, &taken);
        let clock = json!({ "arrangement_s": started.elapsed().as_secs_f64() });
        Ok(Outcome { rows, clock: clock.as_object().cloned().unwrap_or_default() })
    }

    fn summarise(&self, finished: &[Numbered<'_>]) -> Summary {
        summary::summarise(self, finished)
    }
}

/// Cell of the figure: the results of one set, recogniser, mode and number of views.
#[derive(Debug, Clone, Default)]
struct Cell {
    /// One entry for each arrangement: its number; correct and wrong percepts of the kind; objects of the
    /// kind found by their own name; all objects of the kind.
    counts: Vec<(u64, [f64; 4])>,
    forecasts: Vec<(f64, bool)>,
    /// Look-alikes with a handle: number classified as the kind, and total; first before, then after
    /// enough of the handle was seen.
    handled: [(usize, usize); 2],
}

/// Groups the rows by set, recogniser, single or merged, and number of views.
fn cells(finished: &[Numbered<'_>]) -> BTreeMap<(String, String, String, u64), Cell> {
    let mut cells = BTreeMap::<_, Cell>::new();
    for &(number, job) in finished {
        let group = number as u64;
        for row in &job.rows {
            let text = |key: &str| row.get(key).and_then(Value::as_str).map(str::to_string);
            let count = |key: &str| row.get(key).and_then(Value::as_f64);
            let (Some(set), Some(recogniser), Some(mode), Some(views)) =
                (text("set"), text("recogniser"), text("mode"), row.get("views").and_then(Value::as_u64))
            else {
                continue;
            };
            let cell = cells.entry((set, recogniser, mode, views)).or_default();
            let numbers = ["right", "wrong", "named", "things"].map(|key| count(key).unwrap_or(0.0));
            cell.counts.push((group, numbers));
            let pairs = row.get("forecasts").and_then(Value::as_array).into_iter().flatten();
            cell.forecasts
                .extend(pairs.filter_map(|pair| Some((pair.get(0)?.as_f64()?, pair.get(1)?.as_bool()?))));
            let handled = row.get("handled").and_then(Value::as_array).into_iter().flatten();
            for one in handled {
                let (Some(seen), Some(called)) =
                    (one.get(0).and_then(Value::as_bool), one.get(1).and_then(Value::as_bool))
                else {
                    continue;
                };
                let slot = &mut cell.handled[usize::from(seen)];
                *slot = (slot.0 + usize::from(called), slot.1 + 1);
            }
        }
    }
    cells
}

/// Converts a JSON object to a row.
fn row(value: Value) -> Row {
    value.as_object().cloned().unwrap_or_default()
}
