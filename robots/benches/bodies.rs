//! What a frame and a table of routes cost: `cargo bench -p descry-robots`.

use descry_robots::nalgebra::Point3;
use descry_robots::route::Router;
use descry_robots::sim::noise::{DepthNoise, observe};
use descry_robots::sim::render::render;
use descry_robots::sim::{Scene, SceneSpec, arrange, body};
use descry_robots::{Pose2, head};
use divan::Bencher;

const DEFAULT_SCENE: &str =
    include_str!(concat!(env!("CARGO_MANIFEST_DIR"), "/../domains/tabletop/scenes/default.toml"));

fn main() {
    // One core: what a batch run has for each of its runs.
    let _ = rayon::ThreadPoolBuilder::new().num_threads(1).build_global();
    divan::main();
}

fn scene() -> Option<Scene> {
    arrange(&SceneSpec::parse("default.toml", DEFAULT_SCENE).ok()?, 1).ok()
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
    let (Some(scene), Some(head)) = (scene(), body::description().head) else { return };
    let solids = scene.solids();
    let look_at = Point3::new(0.0, 0.0, 0.75);
    let camera = head::camera_towards(&head, &ring(5)[1].isometry(), Some(&look_at));
    bencher.bench_local(|| render(&scene.room, &solids, &camera, &body::camera(), 0));
}

#[divan::bench]
fn noise_on_a_frame(bencher: Bencher) {
    let (Some(scene), Some(head)) = (scene(), body::description().head) else { return };
    let look_at = Point3::new(0.0, 0.0, 0.75);
    let camera = head::camera_towards(&head, &ring(5)[1].isometry(), Some(&look_at));
    let frame = render(&scene.room, &scene.solids(), &camera, &body::camera(), 0);
    bencher.bench_local(|| observe(&frame, &DepthNoise::default(), (0.45, 5.0), 1, 1));
}

#[divan::bench]
fn arrange_the_default_scene(bencher: Bencher) {
    let Ok(spec) = SceneSpec::parse("default.toml", DEFAULT_SCENE) else { return };
    bencher.bench_local(|| arrange(&spec, 1));
}

/// Every route between so many poses, the visibility graph built anew.
#[divan::bench(args = [5, 16, 100])]
fn routes_between(bencher: Bencher, poses: usize) {
    let Some(scene) = scene() else { return };
    let (map, speeds, poses) = (scene.map(), body::description().speeds, ring(poses));
    bencher.bench_local(|| Router::new(&map, 0.3, speeds).travel_table(&poses));
}
