//! Runs of the agent in a simulated room, in this process.

use descry_agent::body;
use descry_agent::exit::CommandError;
use descry_agent::keeping::Keeping;
use descry_agent::report::{Event, Report};
use descry_agent::run::{self, Folder, Settings, Task, Watcher};
use descry_agent::stop::Stop;
use descry_domains::abilities::searching::policies;
use descry_domains::load::Domain;
use descry_robots::truth::Truth;
use descry_skills::Call;

/// A run that came to its end.
pub struct Lived {
    pub report: Report,
    /// Calls that were carried out, each with its success.
    pub done: Vec<(Call, bool)>,
    /// Truth of the scene before and after.
    pub truth: [Truth; 2],
}

/// Pursues what is said in a scene of the domain.
pub fn lived(
    domain: &Domain,
    said: &str,
    scene: &str,
    seed: u64,
    policy: &str,
) -> Result<Lived, CommandError> {
    lived_after(None, domain, said, scene, seed, policy)
}

/// The same after other runs, if any, that left what is in a store.
pub fn lived_after(
    store: Option<&str>,
    domain: &Domain,
    said: &str,
    scene: &str,
    seed: u64,
    policy: &str,
) -> Result<Lived, CommandError> {
    let scratch = tempfile::TempDir::new().expect("a folder can be made");
    let body = body::open("sim", Some(scene), seed, domain)?;
    let past = run::recall(store)?;
    let understood = run::understood(said, domain, &*body.robot, past.as_ref())?;
    let settings = Settings {
        robot: "sim".into(),
        scene: Some(scene.into()),
        seed,
        domain: domain.config.name.clone(),
        policy: policy.into(),
        keeping: Keeping::default(),
        remember: store.map(str::to_string),
    };
    let folder = Folder::of_new_run(Some(&scratch.path().join("run")), &understood)?;
    let mut done: Vec<(Call, bool)> = Vec::new();
    let mut hear = |event: &Event| match event {
        Event::Acting { call, .. } => done.push((call.clone(), true)),
        Event::Failed { call, .. } => {
            done.iter_mut()
                .rev()
                .filter(|(begun, _)| begun == call)
                .take(1)
                .for_each(|(_, is_well)| *is_well = false);
        }
        _ => {}
    };
    let truth = || body.truth().expect("it can be read").expect("the simulator knows it");
    let before = truth();
    let watcher = Watcher { stop: &Stop::default(), tell: &mut hear };
    let chooser = policies::named(policy, seed, None).expect("a policy");
    let task = Task { domain, goal: &understood, past: past.as_ref() };
    let runtime = tokio::runtime::Builder::new_current_thread().enable_all().build().expect("a runtime");
    let report = runtime.block_on(run::pursue(task, &body, &folder, &settings, chooser, watcher))?;
    Ok(Lived { report, done, truth: [before, truth()] })
}
