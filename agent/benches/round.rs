//! What one round of the main job takes in the default scene: planning, merging five views from the record, recognising.
//!
//! `cargo bench -p descry-agent`

use std::collections::BTreeSet;
use std::sync::Arc;

use descry_agent::agent::look;
use descry_agent::body::{self, Body};
use descry_domains::load::{DEFAULT, Domain};
use descry_domains::situation::{Known, Situation, things};
use descry_domains::{attachments, candidates, goal};
use descry_memory::belief::Belief;
use descry_memory::space::Space;
use descry_memory::{Meta, Options, Record, Sensing};
use descry_perception::View;
use descry_perception::merge::{Merged, merge};
use descry_perception::nalgebra::Point3;
use descry_perception::recognise::{Descry, Recogniser};
use descry_perception::segment::segment;
use descry_perception::visibility::DepthMap;
use descry_planner::{Source, Task};
use descry_robots::{Robot, Watch};
use divan::Bencher;
use tempfile::TempDir;

/// As the program has it.
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
        let (poses, _) = candidates::candidates(&*robot, &surfaces, &domain.config.candidates, &here);
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
        merge(&self.views(), &look::options(&*self.body.robot).0).expect("the views merge")
    }

    /// The situation of a planning round; after the first look if `seen`.
    fn situation(&self, seen: bool) -> Arc<Situation> {
        let robot: Arc<dyn Robot> = Arc::clone(&self.body.robot);
        let surfaces = candidates::surfaces(&self.domain, &*robot);
        let runtime = tokio::runtime::Builder::new_current_thread().build().expect("a runtime");
        let here = runtime.block_on(robot.pose()).expect("it knows where it is");
        let (candidates, at) =
            candidates::candidates(&*robot, &surfaces, &self.domain.config.candidates, &here);
        let mut space = Space::default();
        let mut observed = BTreeSet::new();
        if seen {
            let view = &self.views()[0];
            if let Some(map) = DepthMap::from_view(view, &view.world_from_camera) {
                space.integrate(&map);
            }
            observed.insert((0, 0));
        }
        let known = Known {
            robot,
            belief: Arc::new(Belief::default()),
            space: Arc::new(space),
            candidates,
            at,
            surfaces,
            things: things(&self.domain, &["cup-a".into()]),
            observed,
            out_of_reach: BTreeSet::new(),
            kinds: Vec::new(),
            time_left_s: None,
            stuck: BTreeSet::new(),
            pushes_left: 0,
        };
        Arc::new(Situation::new(known, self.domain.config.thresholds))
    }
}

/// From the problem's text to the plan, geometry answered anew.
#[divan::bench(args = [false, true])]
fn plan(bencher: Bencher, after_a_look: bool) {
    let looked = looked();
    let goal = goal::read("find cup A", &looked.domain).expect("the goal is understood");
    bencher.with_inputs(|| looked.situation(after_a_look)).bench_values(|situation| {
        let problem = Source::new("problem", situation.problem(&looked.domain, "round", &goal.pddl));
        let task = Task::read(&looked.domain.pddl, &problem).expect("the problem is right");
        let attachments = attachments::bind(&situation, &[], || 0.0);
        let options = descry_planner::Options::default();
        descry_planner::plan(&task, &attachments, &options, &|| false, &mut |_| {}).expect("planning ends")
    });
}

/// Five views from the record to one cloud.
#[divan::bench(sample_count = 10, sample_size = 1)]
fn merge_five_views_from_the_record(bencher: Bencher) {
    let looked = looked();
    bencher.bench(|| looked.merged());
}

/// From the merged cloud to percepts.
#[divan::bench(sample_count = 10, sample_size = 1)]
fn recognise_the_merged_cloud(bencher: Bencher) {
    let looked = looked();
    let merged = looked.merged();
    let (_, seeking) = look::options(&*looked.body.robot);
    bencher.bench(|| {
        let scene = segment(&merged.cloud, &merged.visibility, &seeking).expect("there is a table");
        Descry::default().recognise(&scene, &merged.visibility, &looked.domain.objects)
    });
}
