//! Comparison of policies: views, metres and seconds until the right verdict on a target that is more or less
//! hidden, or absent, with more or fewer viewpoints.

use std::path::Path;

use descry_agent::body;
use descry_agent::stop::Stop;
use descry_domains::abilities::searching::policies;
use descry_domains::goal;
use descry_domains::lexicon::{Lexicon, Places};
use descry_domains::load::{DEFAULT, Domain};
use descry_domains::objective::Goal;
use descry_robots::sim::{FaultPlan, SceneSpec};
use serde::Deserialize;
use serde_json::json;

use super::trial::{self, Trial};
use crate::error::ExperimentError;
use crate::job::{Job, Numbered, Outcome};
use crate::kinds::kind::{Head, Kind, Summary, inputs_of, parse, refuse};
use crate::source::Source;

mod summary;

/// Keys of an experiment file of the kind `where-to-look`.
#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
struct Text {
    /// The experiment's name.
    name: String,
    /// `where-to-look`.
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
    /// Number of arrangements; each has one level of occlusion, in turn.
    scenes: usize,
    /// Seed of the first arrangement; each further one has the next.
    #[serde(default = "default_seed")]
    first_seed: u64,
    /// Share of the scenes of each level from which the target is removed.
    #[serde(default)]
    absent_share: f64,
    /// True if every policy, the oracle too, takes its first view from the start, by which the
    /// levels of occlusion are defined.
    #[serde(default)]
    first_look_from_start: bool,
    /// Numbers of viewpoints around the surface.
    poses: Vec<usize>,
    /// Policies that choose where to look next, from the list above.
    policies: Vec<String>,
    /// Policy that is compared with others.
    ours: String,
    /// Policies with which `ours` is compared.
    #[serde(default)]
    against: Vec<String>,
    /// Maximum distance between the stated and the true position of a found object, metres.
    #[serde(default = "default_tolerance_m")]
    position_tolerance_m: f64,
    /// Levels of occlusion, in turn.
    #[serde(rename = "occlusion")]
    occlusions: Vec<Occlusion>,
}

/// Level of occlusion: share of the target that is visible from the start.
#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
struct Occlusion {
    /// Name of the level in tables and plots.
    name: String,
    /// Minimum and maximum share of the target that is visible from the start.
    visible_from_start: [f64; 2],
}

fn default_domain() -> String {
    DEFAULT.into()
}

fn default_seed() -> u64 {
    1
}

fn default_tolerance_m() -> f64 {
    0.05
}

/// Comparison of policies, as read from its file.
struct WhereToLook {
    head: Head,
    text: Text,
    domain: Domain,
    goal: Goal,
    /// Scene, once for each level of occlusion.
    specs: Vec<SceneSpec>,
    jobs: Vec<Setting>,
}

/// Setting of a job: one combination of the variables.
#[derive(Debug, Clone)]
struct Setting {
    scene: usize,
    occlusion: usize,
    present: bool,
    poses: usize,
    policy: String,
}

pub(super) fn read(source: &Source) -> Result<Box<dyn Kind>, ExperimentError> {
    let text: Text = parse(source)?;
    check(source, &text)?;
    let domain = Domain::load(&text.domain)
        .map_err(|e| refuse(source, "domain", e.to_string(), "name another domain"))?;
    let spec = body::scene_spec(Some(&text.scene), &domain)
        .map_err(|e| refuse(source, "scene", e.to_string(), "name another scene"))?;
    let goal = goal::read(&text.goal, &domain, &Lexicon::new(&domain, &Places::of_spec(&spec)))
        .map_err(|e| refuse(source, "goal", e.to_string(), "see descry goals"))?;
    let Some(target) = spec.target.clone().filter(|_| has(&spec, &text.target)) else {
        let problem = format!("the scene has no [target], or nothing in it is called \"{}\"", text.target);
        return Err(refuse(
            source,
            "target",
            problem,
            "name an object of the scene, and give the scene a [target]",
        ));
    };
    let hidden = |level: &Occlusion| {
        let mut spec = spec.clone();
        let object =
            spec.objects.iter().find(|o| o.name == text.target || o.kind.as_deref() == Some(&text.target));
        let object = object.map_or_else(|| target.object.clone(), |o| o.name.clone());
        let visible_from_start = level.visible_from_start;
        spec.target =
            Some(descry_robots::sim::scene::TargetSpec { object, visible_from_start, ..target.clone() });
        spec
    };
    let specs: Vec<SceneSpec> = text.occlusions.iter().map(hidden).collect();
    if let Some(objection) = specs.iter().find_map(|spec| spec.check().err()) {
        return Err(refuse(source, "occlusion", objection.problem, objection.mend));
    }
    let head = Head { name: text.name.clone(), kind: text.kind.clone(), about: text.about.clone() };
    let jobs = settings(&text);
    Ok(Box::new(WhereToLook { head, domain, goal, specs, jobs, text }))
}

fn has(spec: &SceneSpec, target: &str) -> bool {
    spec.objects.iter().any(|o| o.name == target || o.kind.as_deref() == Some(target))
}

fn check(source: &Source, text: &Text) -> Result<(), ExperimentError> {
    let known = policies::names();
    let asked = text.policies.iter().map(|p| ("policies", p));
    if let Some((key, absent)) = asked.clone().find(|(_, p)| !known.contains(&p.as_str())) {
        let problem = format!("no policy is called \"{absent}\"");
        return Err(refuse(source, key, problem, format!("one of: {}", known.join(", "))));
    }
    let compared = text.against.iter().map(|p| ("against", p)).chain([("ours", &text.ours)]);
    if let Some((key, absent)) = compared.clone().find(|(_, p)| !text.policies.contains(p)) {
        let problem = format!("\"{absent}\" is not among the policies of this file");
        return Err(refuse(source, key, problem, format!("one of: {}", text.policies.join(", "))));
    }
    let wrong = |holds: bool, key, problem: &str, mend: &str| match holds {
        true => Ok(()),
        false => Err(refuse(source, key, problem, mend)),
    };
    wrong(
        (1..=1_000_000).contains(&text.scenes),
        "scenes",
        "so many scenes make no experiment",
        "1 to 1000000",
    )?;
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
    let poses = !text.poses.is_empty() && text.poses.iter().all(|n| (1..=1000).contains(n));
    wrong(poses, "poses", "there must be poses to look from", "numbers from 1 to 1000, such as [5, 8, 16]")?;
    wrong(!text.occlusions.is_empty(), "occlusion", "there is no level of occlusion", "add an [[occlusion]]")
}

/// All combinations, scenes outermost, so that neighbours share a scene.
fn settings(text: &Text) -> Vec<Setting> {
    let levels = text.occlusions.len();
    let mut settings = Vec::new();
    for scene in 0..text.scenes {
        // Of the scenes of each level every so many-th is without the target.
        let n = (scene / levels) as f64;
        let present = ((n + 1.0) * text.absent_share).floor() <= (n * text.absent_share).floor();
        for &poses in &text.poses {
            for policy in &text.policies {
                settings.push(Setting {
                    scene,
                    occlusion: scene % levels,
                    present,
                    poses,
                    policy: policy.clone(),
                });
            }
        }
    }
    settings
}

impl WhereToLook {
    fn seed(&self, setting: &Setting) -> u64 {
        self.text.first_seed.wrapping_add(setting.scene as u64)
    }
}

impl Kind for WhereToLook {
    fn head(&self) -> &Head {
        &self.head
    }

    fn inputs(&self) -> Vec<(String, String)> {
        inputs_of(&self.domain, format!("{:?}", self.specs), std::iter::empty())
    }

    fn jobs(&self) -> Vec<Job> {
        let job = |s: &Setting| {
            Job::new([
                ("scene", json!(s.scene)),
                ("occlusion", json!(self.text.occlusions[s.occlusion].name)),
                ("poses", json!(s.poses)),
                ("policy", json!(s.policy)),
            ])
            .with_seed(self.seed(s))
        };
        self.jobs.iter().map(job).collect()
    }

    fn run(&self, number: usize, scratch: &Path, stop: &Stop) -> Result<Outcome, String> {
        let setting = &self.jobs[number];
        let mut domain = self.domain.clone();
        domain.config.candidates.poses = setting.poses;
        let trial = Trial {
            domain: &domain,
            goal: &self.goal,
            spec: &self.specs[setting.occlusion],
            program: None,
            targets: std::slice::from_ref(&self.text.target),
            present: setting.present,
            seed: self.seed(setting),
            faults: FaultPlan::default(),
            policy: &setting.policy,
            first_look_here: self.text.first_look_from_start,
            tolerance_m: self.text.position_tolerance_m,
        };
        trial::carry_out(&trial, scratch, stop)
    }

    fn summarise(&self, finished: &[Numbered<'_>]) -> Summary {
        summary::summarise(self, finished)
    }
}
