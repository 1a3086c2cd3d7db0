//! Benchmark of one round of the main job in the default scene: planning, merging five views from the record,
//! recognising.
//!
//! `cargo bench -p descry-agent`

use std::sync::Arc;

use descry_agent::body::{self, Body};
use descry_domains::abilities::searching::policies;
use descry_domains::abilities::surveying::chart::Chart;
use descry_domains::goal;
use descry_domains::lexicon::{Lexicon, Places};
use descry_domains::load::{DEFAULT, Domain};
use descry_domains::looking::{candidates, perceive};
use descry_domains::objective::Goal;
use descry_domains::round::Round;
use descry_domains::world::{Setting, World};
use descry_memory::{Meta, Options, Record, Sensing};
use descry_perception::View;
use descry_perception::merge::{Merged, merge};
use descry_perception::nalgebra::Point3;
use descry_perception::recognise::{Descry, Recogniser};
use descry_perception::segment::segment;
use descry_robots::{CancellationToken, Progress, Robot, Watch};
use descry_skills::{Call, Context};
use divan::Bencher;
use tempfile::TempDir;

/// The allocator of the program.
#[global_allocator]
static ALLOCATOR: mimalloc::MiMalloc = mimalloc::MiMalloc;

fn main() {
    divan::main();
}

const MAP: &str = "map";

/// The default scene after five looks around the table: the record with the times of its views.
struct Looked {
    domain: Domain,
    body: Body,
    record: Record,
    stamps_ns: Vec<i64>,
    _folder: TempDir,
}

fn looked() -> Looked {
    let domain = Domain::load(DEFAULT).expect("the built-in domain loads");
    let spec = body::scene_spec(None, &domain).expect("the default scene is there");
    let body = body::simulate(&spec, 1, Default::default()).expect("it can be arranged");
    let folder = TempDir::new().expect("a folder can be made");
    let record =
        Record::create(&folder.path().join("record"), Options::default()).expect("a record can be made");
    let runtime = tokio::runtime::Builder::new_current_thread().build().expect("a runtime");
    let robot = Arc::clone(&body.robot);
    let stamps_ns = runtime.block_on(async {
        let surfaces = candidates::surfaces(&domain, &*robot);
        let here = robot.pose().await.expect("it knows where it is");
        let (ring, chart) = (&domain.config.candidates, Chart::default());
        let (poses, _) = candidates::candidates(&*robot, &chart, &surfaces, ring, &here);
        let watch = Watch::default();
        let mut stamps = Vec::new();
        for pose in poses.iter().step_by(2) {
            robot.drive_to(&pose.place, &watch).await.expect("the way is free");
            robot.look_at(&Point3::new(0.0, 0.0, 0.72), &watch).await.expect("the head turns");
            let seen = robot.sense(&watch).await.expect("a frame comes");
            for t in &seen.transforms {
                record
                    .put_transform(t.stamp_ns, &t.parent, &t.child, &t.parent_from_child)
                    .expect("recorded");
            }
            let sensing = Sensing {
                intrinsics: Some(seen.intrinsics),
                pose_sigma_m: seen.pose_sigma_m,
                pose_sigma_rad: seen.pose_sigma_rad,
            };
            record
                .put_cloud(seen.stamp_ns, "camera", &seen.cloud, &sensing, Meta::default())
                .expect("recorded");
            stamps.push(seen.stamp_ns);
        }
        stamps
    });
    record.sync().expect("recorded");
    Looked { domain, body, record, stamps_ns, _folder: folder }
}

impl Looked {
    fn views(&self) -> Vec<View> {
        self.stamps_ns.iter().map(|&stamp| self.record.view_at(stamp, MAP).expect("recorded")).collect()
    }

    fn merged(&self) -> Merged {
        merge(&self.views(), &perceive::options(&*self.body.robot, None).0).expect("the views merge")
    }

    /// Goal of the main job.
    fn goal(&self) -> Goal {
        let lexicon = Lexicon::new(&self.domain, &Places::of_body(&*self.body.robot));
        goal::read("find cup A", &self.domain, &lexicon).expect("the goal is understood")
    }
}

/// The problem of a planning round; after the first look if `seen`.
fn round(looked: &Looked, goal: &Goal, recogniser: &Descry, seen: bool) -> Round {
    let runtime = tokio::runtime::Builder::new_current_thread().build().expect("a runtime");
    let robot: Arc<dyn Robot> = Arc::clone(&looked.body.robot);
    let here = runtime.block_on(robot.pose()).expect("it knows where it is");
    let (domain, record) = (&looked.domain, &looked.record);
    let setting = Setting { domain, goal, robot: Arc::clone(&robot), record, recogniser, past: None };
    let chooser = policies::named(policies::PLAN, 1, None).expect("the planner is there");
    let mut world = World::begin(setting, chooser, &here).expect("the domain can be used");
    if seen {
        let call = Call { action: "observe".into(), arguments: vec!["start".into(), "table".into()] };
        let job = world.ground(&call, 0).expect("it has a meaning").expect("it has a part");
        let (cancel, progress) = (CancellationToken::new(), &|_: &Progress| {});
        let context = Context { robot: &*robot, cancel, time_limit_s: job.limit_s, progress };
        let skill = job.skill.expect("it can be done");
        let outcome = runtime.block_on(skill.perform(&context)).expect("a view");
        world.learn(&call, 0, &outcome, &mut Vec::new()).expect("it is recorded");
    }
    world.round().expect("the problem is right")
}

/// Benchmark of planning from a round's task, with all geometry computed anew.
#[divan::bench(args = [false, true])]
fn plan(bencher: Bencher, after_a_look: bool) {
    let looked = looked();
    let (goal, recogniser) = (looked.goal(), Descry::default());
    bencher.with_inputs(|| round(&looked, &goal, &recogniser, after_a_look)).bench_values(|round| {
        let options = descry_planner::Options::default();
        descry_planner::plan(&round.task, &round.attachments, &options, &|| false, &mut |_| {})
            .expect("planning ends")
    });
}

/// Five views from the record to one cloud.
#[divan::bench(sample_count = 10, sample_size = 1)]
fn merge_five_views_from_the_record(bencher: Bencher) {
    let looked = looked();
    bencher.bench(|| looked.merged());
}

/// Benchmark of recognition from the merged cloud to percepts.
#[divan::bench(sample_count = 10, sample_size = 1)]
fn recognise_the_merged_cloud(bencher: Bencher) {
    let looked = looked();
    let merged = looked.merged();
    let (_, seeking) = perceive::options(&*looked.body.robot, None);
    bencher.bench(|| {
        let scene = segment(&merged.cloud, &merged.visibility, &seeking).expect("there is a table");
        Descry::default().recognise(&scene, &merged.visibility, &looked.domain.objects)
    });
}
