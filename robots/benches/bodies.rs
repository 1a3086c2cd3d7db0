//! Cost of a frame and of a table of routes: `cargo bench -p descry-robots`.

use descry_robots::nalgebra::Point3;
use descry_robots::program::{Limits, ProgramRobot};
use descry_robots::route::Router;
use descry_robots::sim::noise::{DepthNoise, observe};
use descry_robots::sim::render::render;
use descry_robots::sim::scene::SurfaceSpec;
use descry_robots::sim::{Scene, SceneSpec, arrange, body};
use descry_robots::{Pose2, Robot, Watch, head};
use divan::Bencher;

const DEFAULT_SCENE: &str =
    include_str!(concat!(env!("CARGO_MANIFEST_DIR"), "/../domains/tabletop/scenes/default.toml"));

const FLAT: &str = include_str!(concat!(env!("CARGO_MANIFEST_DIR"), "/../domains/home/scenes/default.toml"));

fn main() {
    // One core: what a batch run has for each of its runs.
    let _ = rayon::ThreadPoolBuilder::new().num_threads(1).build_global();
    divan::main();
}

fn scene() -> Option<Scene> {
    arrange(&SceneSpec::parse("default.toml", DEFAULT_SCENE).ok()?, 1).ok()
}

fn flat() -> Option<Scene> {
    arrange(&SceneSpec::parse("flat.toml", FLAT).ok()?, 1).ok()
}

/// Poses in front of the surfaces of the flat.
fn stands(scene: &Scene) -> Vec<Pose2> {
    let router = Router::new(&scene.map(), 0.3, body::SPEEDS);
    let pose = |s: &SurfaceSpec, k: usize| {
        let (centre, angle) = (s.centre_m(), std::f64::consts::TAU * k as f64 / 8.0);
        Pose2::facing(centre.x + 1.2 * angle.cos(), centre.y + 1.2 * angle.sin(), &centre)
    };
    let all = scene.surfaces.iter().flat_map(|s| (0..8).map(move |k| pose(s, k)));
    all.filter(|p| router.travel(&scene.start, p).is_ok()).collect()
}

fn ring(count: usize) -> Vec<Pose2> {
    let pose = |k: usize| {
        let angle = std::f64::consts::TAU * k as f64 / count as f64;
        Pose2::facing(1.5 * angle.cos(), 1.5 * angle.sin(), &[0.0, 0.0].into())
    };
    (0..count).map(pose).collect()
}

#[divan::bench]
fn render_frame(bencher: Bencher) {
    let (Some(scene), head) = (scene(), body::HEAD) else { return };
    let solids = scene.solids();
    let look_at = Point3::new(0.0, 0.0, 0.75);
    let camera = head::camera_towards(&head, &ring(5)[1].isometry(), Some(&look_at));
    bencher.bench_local(|| render(&scene.room, &solids, &camera, &body::intrinsics(), 0));
}

/// Renders a view from the centre of the flat's hall through a door.
#[divan::bench]
fn render_flat_frame(bencher: Bencher) {
    let (Some(scene), head) = (flat(), body::HEAD) else { return };
    let solids = scene.solids();
    let look_at = Point3::new(-2.7, 1.3, 0.75);
    let camera = head::camera_towards(&head, &Pose2::new(0.4, 1.2, 3.1).isometry(), Some(&look_at));
    bencher.bench_local(|| render(&scene.room, &solids, &camera, &body::intrinsics(), 0));
}

#[divan::bench]
fn noise_on_a_frame(bencher: Bencher) {
    let (Some(scene), head) = (scene(), body::HEAD) else { return };
    let look_at = Point3::new(0.0, 0.0, 0.75);
    let camera = head::camera_towards(&head, &ring(5)[1].isometry(), Some(&look_at));
    let frame = render(&scene.room, &scene.solids(), &camera, &body::intrinsics(), 0);
    bencher.bench_local(|| observe(&frame, &DepthNoise::default(), (0.45, 5.0), 1, 1));
}

#[divan::bench]
fn arrange_the_default_scene(bencher: Bencher) {
    let Ok(spec) = SceneSpec::parse("default.toml", DEFAULT_SCENE) else { return };
    bencher.bench_local(|| arrange(&spec, 1));
}

/// All routes between `poses` poses, including the construction of the visibility graph.
#[divan::bench(args = [5, 16, 100])]
fn routes_between(bencher: Bencher, poses: usize) {
    let Some(scene) = scene() else { return };
    let (map, speeds, poses) = (scene.map(), body::SPEEDS, ring(poses));
    bencher.bench_local(|| Router::new(&map, 0.3, speeds).travel_table(&poses));
}

/// Protocol overhead of a Python program that holds its frames ready.
fn program(bencher: Bencher, ask: impl AsyncFn(&ProgramRobot)) {
    let file = concat!(env!("CARGO_MANIFEST_DIR"), "/tests/programs/frames.py");
    let Ok(robot) = ProgramRobot::start(&format!("python3 '{file}'"), Limits::default()) else {
        println!("SKIPPED: python3 is not here");
        return;
    };
    let Ok(runtime) = tokio::runtime::Builder::new_current_thread().enable_time().build() else { return };
    bencher.bench_local(|| runtime.block_on(ask(&robot)));
}

#[divan::bench]
fn ask_a_program_where_it_is(bencher: Bencher) {
    program(bencher, async |robot| {
        let _ = divan::black_box(robot.pose().await);
    });
}

/// Converts 640x480 depths of 16 bits to a cloud.
#[divan::bench]
fn take_a_frame_of_a_program(bencher: Bencher) {
    program(bencher, async |robot| {
        let _ = divan::black_box(robot.sense(&Watch::default()).await);
    });
}

/// All routes between the poses in front of the flat's surfaces, with a new router for each table if `anew`.
#[divan::bench(args = [true, false])]
fn routes_in_the_flat(bencher: Bencher, anew: bool) {
    let Some(scene) = flat() else { return };
    let (map, speeds, poses) = (scene.map(), body::SPEEDS, stands(&scene));
    let router = Router::new(&map, 0.3, speeds);
    bencher.bench_local(|| match anew {
        true => Router::new(&map, 0.3, speeds).travel_table(&poses),
        false => router.travel_table(&poses),
    });
}

/// Routes from one pose to each pose in front of the flat's surfaces, in one query.
#[divan::bench]
fn routes_from_one_pose_in_the_flat(bencher: Bencher) {
    let Some(scene) = flat() else { return };
    let (map, speeds, poses) = (scene.map(), body::SPEEDS, stands(&scene));
    let router = Router::new(&map, 0.3, speeds);
    bencher.bench_local(|| router.travel_to_each(&scene.start, &poses));
}

/// Routes from one pose to 16 poses around the table of the tabletop, in one query.
#[divan::bench]
fn routes_from_one_pose(bencher: Bencher) {
    let Some(scene) = scene() else { return };
    let (map, speeds, poses) = (scene.map(), body::SPEEDS, ring(16));
    let router = Router::new(&map, 0.3, speeds);
    bencher.bench_local(|| router.travel_to_each(&scene.start, &poses));
}
