//! Judges of the readers: each reads an input and checks invariants of the result.

use std::collections::BTreeMap;
use std::io::{Read, Write};
use std::net::{Shutdown, TcpListener};
use std::sync::atomic::{AtomicU32, Ordering};
use std::time::Duration;

use descry_domains::goal::{self, GoalError};
use descry_domains::lexicon::{Lexicon, Places};
use descry_domains::load::{Domain, Files, from_files};
use descry_domains::objective::Goal;
use descry_memory::stores::Store;
use descry_memory::{LocalStore, Query};
use descry_perception::files::{depth as depth_image, pcd, read_cloud};
use descry_perception::nalgebra::Point3;
use descry_planner::{
    Attachments, Options, Outcome, PlanError, Source, Task, check, pddl as language, plan, validate,
};
use descry_robots::program::{Limits, ProgramRobot};
use descry_robots::sim::SceneSpec;
use descry_robots::{Place, Pose2, Robot, Watch};

/// Separator between the files of a multi-file input: a line with the next file's name.
pub const FILE: &str = ";;; file ";

/// Files of an input, by name.
fn files(text: &str) -> BTreeMap<&str, &str> {
    text.split(FILE)
        .filter_map(|part| part.split_once('\n'))
        .map(|(name, text)| (name.trim(), text))
        .collect()
}

/// PDDL domain and problem: findings can be rendered, formatting is idempotent, and found plans are
/// valid.
pub fn pddl(input: &[u8]) {
    let text = String::from_utf8_lossy(input);
    let files = files(&text);
    let source = |name: &str| Source::new(name, files.get(name).copied().unwrap_or_default());
    let (domain, problem) = (source("domain.pddl"), source("problem.pddl"));
    check(&domain, Some(&problem)).render(false);
    if let Ok(once) = language::format(&domain) {
        let again = language::format(&Source::new("domain.pddl", once.clone()));
        assert_eq!(again.ok().as_ref(), Some(&once), "what was formatted is formatted otherwise");
    }
    let task = match Task::read(&domain, &problem) {
        Ok(task) => task,
        Err(findings) => return assert!(!findings.render(true).is_empty(), "an error without a word"),
    };
    let limits =
        Options { evaluation_limit: Some(300), memory_limit_bytes: Some(64 << 20), ..Options::default() };
    let asked = AtomicU32::new(0);
    let stop = || asked.fetch_add(1, Ordering::Relaxed) > 20_000;
    let calls = Attachments::new();
    match plan(&task, &calls, &limits, &stop, &mut |_| {}) {
        Ok(Outcome::Solved { plan, .. }) => {
            let verdict = validate(&task, &calls, &plan);
            assert!(verdict.valid, "a plan that was found is not valid: {plan}\n{verdict:?}");
        }
        Err(error @ PlanError::Internal { .. }) => panic!("{error}"),
        Ok(_) | Err(_) => {}
    }
}

/// Domain folder: a loaded domain can be checked, and its findings rendered.
pub fn domain(input: &[u8]) {
    let text = String::from_utf8_lossy(input);
    let owned = |(name, text): (&str, &str)| (name.to_string(), (name.to_string(), text.to_string()));
    let files: Files = files(&text).into_iter().map(owned).collect();
    match from_files(files, None) {
        Ok(domain) => drop(descry_domains::check::findings(&domain).render(false)),
        Err(error) => assert!(!error.to_string().is_empty(), "an error without a word"),
    }
}

/// Scene: a readable scene is arranged, or the reason for failing is given.
pub fn scene(input: &[u8]) {
    let text = String::from_utf8_lossy(input);
    match SceneSpec::parse("scene.toml", &text) {
        Ok(spec) => drop(descry_robots::sim::arrange(&spec, 1)),
        Err(error) => assert!(!error.to_string().is_empty(), "an error without a word"),
    }
}

thread_local! {
    /// Domain and lexicon that sentences are read in.
    static SPOKEN: (Domain, Lexicon) = {
        let domain = Domain::load("home").expect("it is built in");
        let lexicon = Lexicon::new(&domain, &Places::of_scene(&domain));
        (domain, lexicon)
    };
}

/// Sentence: suggested alternatives are understood with a name in each open slot.
pub fn phrase(input: &[u8]) {
    let said = String::from_utf8_lossy(input);
    let read = |said: &str| -> Result<Goal, GoalError> {
        SPOKEN.with(|(domain, lexicon)| goal::read(said, domain, lexicon))
    };
    let Err(why) = read(&said) else { return };
    let why = why.to_string();
    let meant = why.lines().find_map(|line| line.trim_start().strip_prefix("did you mean "));
    // A slot that is left open takes any name.
    let filled = |offered: &str| {
        let name = |of: &str| SPOKEN.with(|(_, lexicon)| lexicon.of_type(of)[0].names[0].clone());
        let word = |word: &str| match word.strip_prefix('<').and_then(|word| word.strip_suffix('>')) {
            Some(of) => name(of),
            None => word.to_owned(),
        };
        offered.split(' ').map(word).collect::<Vec<_>>().join(" ")
    };
    for offered in meant.into_iter().flat_map(|line| line.split('"').skip(1).step_by(2)) {
        assert!(read(&filled(offered)).is_ok(), "{offered:?} is offered for {said:?}, and is not understood");
    }
}

/// Cloud: writing and reading again keeps the number of points.
pub fn cloud(input: &[u8]) {
    match read_cloud(input) {
        Ok(loaded) => {
            let written = pcd::write(&loaded.cloud, pcd::PcdEncoding::Binary);
            let again = read_cloud(&written).expect("what was written is read");
            assert_eq!(again.cloud.points.len(), loaded.cloud.points.len());
        }
        Err(error) => assert!(!error.to_string().is_empty(), "an error without a word"),
    }
}

/// A depth image: as many depths as pixels.
pub fn depth(input: &[u8]) {
    if let Ok(image) = depth_image::read(input, 0.001) {
        assert_eq!(image.depths_m.len(), image.width * image.height);
    }
}

/// Single segment of a record: readable, and unchanged by verification.
pub fn record(input: &[u8]) {
    let folder = tempfile::tempdir().expect("a folder can be made");
    let segment = folder.path().join("segments/00000001.mcap");
    std::fs::create_dir(folder.path().join("segments")).expect("a folder can be made");
    std::fs::write(&segment, input).expect("a file can be written");
    if let Ok(store) = LocalStore::open_shared(folder.path()) {
        for document in store.find(&Query::default()).unwrap_or_default() {
            for blob in &document.blobs {
                let _ = store.blob(document.id, &blob.name);
            }
        }
        let _ = store.verify();
    }
    assert_eq!(std::fs::read(&segment).expect("it is there"), input, "reading has changed a segment");
}

/// Messages of a body: every request ends, whatever they are.
pub fn body(input: &[u8]) {
    let listener = TcpListener::bind("127.0.0.1:0").expect("a port is free");
    let address = listener.local_addr().expect("it is bound").to_string();
    let limits = Limits { hello_s: 2.0, silence_s: 2.0, stop_s: 0.1, overrun_s: 0.1, ..Limits::default() };
    std::thread::scope(|scope| {
        scope.spawn(|| {
            let Ok((mut client, _)) = listener.accept() else { return };
            let _ = client.write_all(input);
            let _ = client.shutdown(Shutdown::Write);
            let _ = client.set_read_timeout(Some(Duration::from_secs(4)));
            let _ = std::io::copy(&mut (&mut client).take(1 << 20), &mut std::io::sink());
        });
        let Ok(robot) = ProgramRobot::connect(&address, limits) else { return };
        let runtime = tokio::runtime::Builder::new_current_thread().enable_all().build().expect("a runtime");
        let watch = Watch { time_limit_s: 1.0, ..Watch::default() };
        runtime.block_on(async {
            let _ = robot.pose().await;
            let _ = robot.drive_to(&Place::Pose(Pose2::new(1.0, 0.0, 0.0)), &watch).await;
            let _ = robot.look_at(&Point3::new(1.0, 0.0, 0.7), &watch).await;
            let _ = robot.sense(&watch).await;
            let _ = robot.scan(&watch).await;
            let _ = robot.hand().await;
        });
    });
}
