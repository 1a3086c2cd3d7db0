//! Five views merged, and one recognised: `cargo bench -p descry-perception --bench scene`.

#[path = "../tests/tabletop/mod.rs"]
mod tabletop;

use descry_perception::View;
use descry_perception::merge::{MergeOptions, merge};
use descry_perception::nalgebra::{Unit, Vector3};
use descry_perception::recognise::{Descry, Handle, ObjectModel, Range, Recogniser, Top};
use descry_perception::segment::{SceneOptions, segment};
use descry_perception::surface::SurfaceOptions;
use descry_perception::visibility::Visibility;
use tabletop::{Draws, Thing, disturbed, look, on_ring};

fn main() {
    divan::main();
}

fn views(count: usize) -> Vec<View> {
    let things = [
        Thing::Cup { x: 0.10, y: 0.05, radius: 0.035, height: 0.104, handle_rad: None },
        Thing::Cup { x: -0.22, y: 0.10, radius: 0.044, height: 0.155, handle_rad: None },
        Thing::Cup { x: 0.30, y: -0.12, radius: 0.04, height: 0.095, handle_rad: Some(2.0) },
        Thing::Block { x: -0.05, y: -0.15, half: [0.09, 0.05], height: 0.2, turn_rad: 0.5 },
    ];
    let mut draws = Draws(1);
    (0..count)
        .map(|i| {
            let truth = on_ring(1.25 * i as f64, 1.3, 1.4);
            let stated = disturbed(&truth, 0.03, 0.035, &mut draws);
            look(&things, &truth, &stated, &mut draws)
        })
        .collect()
}

fn merge_options() -> MergeOptions {
    let up = Some(Unit::new_normalize(Vector3::z()));
    MergeOptions { up, height_band_m: Some((0.5, 1.2)), ..MergeOptions::default() }
}

fn scene_options() -> SceneOptions {
    let up = Some(Unit::new_normalize(Vector3::z()));
    let surface = SurfaceOptions { up, height_band_m: Some((0.5, 0.9)), ..SurfaceOptions::default() };
    SceneOptions { surface, ..SceneOptions::default() }
}

fn cup() -> ObjectModel {
    ObjectModel {
        name: "cup A".into(),
        kind: "cup".into(),
        phrases: Vec::new(),
        shape: Default::default(),
        height_m: Range { low: 0.104, high: 0.104 },
        diameter_m: Some(Range { low: 0.07, high: 0.07 }),
        width_m: None,
        depth_m: None,
        taper: Range { low: 0.95, high: 1.05 },
        top: Top::Open,
        handle: Handle::None,
        colours: Vec::new(),
    }
}

#[divan::bench(args = [1, 2, 5])]
fn merged(bencher: divan::Bencher, count: usize) {
    let views = views(count);
    bencher.bench(|| merge(&views, &merge_options()).map(|m| m.cloud.len()));
}

#[divan::bench]
fn one_view_from_cloud_to_percepts(bencher: divan::Bencher) {
    let view = &views(1)[0];
    let seen = Visibility::from_views(std::slice::from_ref(view));
    let cloud = view.cloud.transformed(&view.world_from_camera);
    bencher.bench(|| {
        segment(&cloud, &seen, &scene_options())
            .map(|scene| Descry::default().recognise(&scene, &seen, &[cup()]).len())
    });
}
