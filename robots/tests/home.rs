//! The flat of the built-in domain, for any seed.

use descry_robots::Pose2;
use descry_robots::nalgebra::Point2;
use descry_robots::route::Router;
use descry_robots::sim::body::{RADIUS_M, SAFETY_M, SPEEDS};
use descry_robots::sim::{Scene, SceneSpec, arrange};
use std::collections::BTreeMap;

fn spec(file: &str) -> SceneSpec {
    let path = format!("{}/../domains/{file}", env!("CARGO_MANIFEST_DIR"));
    SceneSpec::parse(file, &std::fs::read_to_string(path).unwrap()).unwrap_or_else(|e| panic!("{e}"))
}

fn router(scene: &Scene) -> Router {
    Router::new(&scene.map(), RADIUS_M + SAFETY_M, SPEEDS)
}

/// Reachable viewpoints of a surface, at least a metre apart, with every door open.
fn stands(scene: &Scene, router: &Router, centre: &Point2<f64>) -> Vec<Pose2> {
    let mut found: Vec<Pose2> = Vec::new();
    for ring in 0..8 {
        for k in 0..36 {
            let (radius_m, angle) =
                (0.9 + 0.1 * f64::from(ring), f64::from(k) * std::f64::consts::TAU / 36.0);
            let pose =
                Pose2::facing(centre.x + radius_m * angle.cos(), centre.y + radius_m * angle.sin(), centre);
            let apart = found.iter().all(|other| (other.point() - pose.point()).norm() >= 0.5);
            let same_room = scene.room_at(&pose.point()) == scene.room_at(centre);
            if apart && same_room && router.travel(&scene.start, &pose).is_ok() {
                found.push(pose);
            }
        }
    }
    found
}

#[test]
fn every_surface_can_be_looked_at_from_three_places() {
    for file in ["home/scenes/default.toml", "tabletop/scenes/two-tables.toml"] {
        let scene = arrange(&spec(file), 1).unwrap();
        let router = router(&scene);
        for s in &scene.surfaces {
            let stands = stands(&scene, &router, &s.centre_m());
            assert!(stands.len() >= 3, "{file}: \"{}\" from {} places", s.name, stands.len());
        }
    }
}

#[test]
fn two_hundred_seeds_fill_the_flat() {
    let spec = spec("home/scenes/default.toml");
    let (mut cup_on, mut shut) = (BTreeMap::new(), BTreeMap::new());
    for seed in 0..200 {
        let scene = arrange(&spec, seed).unwrap_or_else(|e| panic!("seed {seed}: {e}"));
        for o in &scene.objects {
            let surface = o.surface().and_then(|s| scene.surface(s)).unwrap();
            assert!(surface.covers(&o.map_from_object.translation.vector.xy().into(), 0.0));
            assert!((o.map_from_object.translation.z - surface.height_m).abs() < 1e-9);
            for other in &scene.objects {
                let gap_m = (o.centre_m() - other.centre_m()).norm();
                assert!(o.name == other.name || gap_m > 0.03, "seed {seed}: {} in {}", o.name, other.name);
            }
        }
        *cup_on.entry(scene.object("cup A").unwrap().surface().unwrap().to_string()).or_insert(0) += 1;
        for door in &scene.doors {
            *shut.entry(door.doorway.name.clone()).or_insert(0) += usize::from(door.shut);
        }
    }
    // Weights 3, 3, 2, 2, 1, 1 and chances 0.25, 0.35, 0.2, 0.5 of 200, give or take four standard deviations.
    for (name, expected) in
        [("kitchen table", 50.0), ("counter", 50.0), ("desk", 33.0), ("upper board", 17.0)]
    {
        let n = f64::from(cup_on[name]);
        assert!((n - expected).abs() < 4.0 * f64::sqrt(expected), "cup A on \"{name}\": {cup_on:?}");
    }
    for (name, chance) in [("kitchen door", 0.25), ("study door", 0.35), ("side door", 0.5)] {
        let n = shut[name] as f64;
        let sigma = f64::sqrt(200.0 * chance * (1.0 - chance));
        assert!((n - 200.0 * chance).abs() < 4.0 * sigma, "{shut:?}");
    }
}

#[test]
fn the_mug_is_not_where_the_cup_is() {
    let spec = spec("tabletop/scenes/two-tables.toml");
    let mut on_the_table = 0;
    for seed in 0..100 {
        let scene = arrange(&spec, seed).unwrap_or_else(|e| panic!("seed {seed}: {e}"));
        let on = |name: &str| scene.object(name).unwrap().surface().unwrap();
        assert_ne!(on("cup A"), on("handled mug"), "seed {seed}");
        on_the_table += usize::from(on("cup A") == "table");
    }
    assert!((30..=70).contains(&on_the_table), "{on_the_table} of 100");
    assert!(spec.without("cup A").check().is_ok(), "the mug then stands anywhere");
}
