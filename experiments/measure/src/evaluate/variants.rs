//! Invariance tests: the same points unorganised, in another order and frame, with a stray return, from a
//! rotated camera.

use super::mosd::cup;
use super::table::models;
use descry_perception::cloud::is_finite;
use descry_perception::files::read_cloud;
use descry_perception::nalgebra::{Isometry3, Point3, UnitQuaternion, Vector3};
use descry_perception::recognise::Descry;
use descry_perception::segment::{SceneOptions, segment};
use descry_perception::{Cloud, Percept, Recogniser, Scene, View, Visibility};
use std::path::{Path, PathBuf};

/// A variant of a cloud with the camera's visibility, and the transform back to the camera's frame.
struct Variant {
    name: &'static str,
    cloud: Cloud,
    seen: Visibility,
    camera_from_world: Isometry3<f64>,
}

/// Compares every variant of every scene in the folders with the original scene.
pub fn run(dirs: &[&str]) -> Result<(), String> {
    let mut models = models();
    models.push(cup());
    let mut rows: Vec<(&'static str, Tally)> = Vec::new();
    for path in dirs.iter().map(|dir| scenes(Path::new(dir))).collect::<Result<Vec<_>, _>>()?.concat() {
        let bytes = std::fs::read(&path).map_err(|e| format!("{}: {e}", path.display()))?;
        let cloud = read_cloud(&bytes).map_err(|e| format!("{}: {e}", path.display()))?.cloud;
        let mut first = None;
        for variant in variants(cloud) {
            let found = segment(&variant.cloud, &variant.seen, &SceneOptions::default()).map(|scene| {
                let percepts = Descry::default().recognise(&scene, &variant.seen, &models);
                (scene.surface.moved(&variant.camera_from_world), scene, percepts)
            });
            let Some(Ok(as_it_is)) = &first else {
                first = Some(found);
                continue;
            };
            let tally = match rows.iter_mut().find(|(name, _)| *name == variant.name) {
                Some((_, tally)) => tally,
                None => {
                    rows.push((variant.name, Tally::default()));
                    &mut rows.last_mut().expect("just pushed").1
                }
            };
            tally.scenes += 1;
            let Ok((surface, scene, percepts)) = found else {
                tally.none += 1;
                println!(
                    "{} {}: {}",
                    path.display(),
                    variant.name,
                    found.err().map_or(String::new(), |e| e.to_string())
                );
                continue;
            };
            let lift = (surface.offset_m - as_it_is.0.offset_m).abs();
            let other = surface.up.angle(&as_it_is.0.up) > 0.05 || lift > 0.02;
            tally.other += usize::from(other);
            if other {
                println!(
                    "{} {}: another table {:?} {:?}",
                    path.display(),
                    variant.name,
                    surface.up.as_slice(),
                    surface.because
                );
                continue;
            }
            compare(tally, (&as_it_is.1, &as_it_is.2), (&scene, &percepts), &variant.camera_from_world);
        }
    }
    println!(
        "{:32} {:>6} {:>5} {:>6} {:>8} {:>8} {:>8} {:>9}",
        "", "scenes", "none", "other", "percepts", "matched", "flipped", "worst p"
    );
    for (name, t) in rows {
        println!(
            "{name:32} {:6} {:5} {:6} {:8} {:8} {:8} {:9.3}",
            t.scenes, t.none, t.other, t.percepts, t.matched, t.flipped, t.worst
        );
    }
    Ok(())
}

#[derive(Default)]
struct Tally {
    scenes: usize,
    none: usize,
    other: usize,
    percepts: usize,
    matched: usize,
    flipped: usize,
    worst: f64,
}

fn compare(
    tally: &mut Tally,
    one: (&Scene, &[Percept]),
    other: (&Scene, &[Percept]),
    camera_from_world: &Isometry3<f64>,
) {
    for percept in one.1 {
        tally.percepts += 1;
        let place = |p: &Percept| camera_from_world * p.position_m;
        let near = other.1.iter().filter(|o| (place(o) - percept.position_m).norm() < 0.03);
        let Some(same) = near.min_by_key(|o| o.points.abs_diff(percept.points)) else { continue };
        tally.matched += usize::from(same.points.abs_diff(percept.points) * 10 < percept.points);
        tally.flipped += usize::from(same.label != percept.label);
        for ((_, a), (_, b)) in percept.probabilities.iter().zip(&same.probabilities) {
            tally.worst = tally.worst.max((a - b).abs());
        }
    }
}

fn variants(cloud: Cloud) -> Vec<Variant> {
    let at_home = Isometry3::identity();
    let away = Isometry3::from_parts(
        Vector3::new(2.0, -1.0, 0.4).into(),
        UnitQuaternion::from_euler_angles(0.7, -1.9, 2.3),
    );
    let level = Isometry3::from_parts(
        Vector3::new(1.3, 0.2, 1.1).into(),
        UnitQuaternion::from_euler_angles(-2.4, 0.0, 0.9),
    );
    let bare: Vec<Point3<f32>> = cloud.points.iter().copied().filter(is_finite).collect();
    let mut shuffled = bare.clone();
    let mut state = 7_u64;
    for k in (1..shuffled.len()).rev() {
        state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        shuffled.swap(k, (state >> 33) as usize % (k + 1));
    }
    let organised = |name, cloud: &Cloud, pose: Isometry3<f64>| {
        let view = View { world_from_camera: pose, ..View::alone(cloud.clone()) };
        let seen = Visibility::from_views(std::slice::from_ref(&view));
        Variant { name, cloud: cloud.transformed(&pose), seen, camera_from_world: pose.inverse() }
    };
    let loose = |name, points: &[Point3<f32>], pose: Isometry3<f64>| {
        let cloud = Cloud::from_points(points.to_vec()).transformed(&pose);
        let seen = Visibility::from_viewpoints(&cloud, &[Point3::from(pose.translation.vector)]);
        Variant { name, cloud, seen, camera_from_world: pose.inverse() }
    };
    let stray = |at: Point3<f32>| bare.iter().copied().chain([at]).collect::<Vec<_>>();
    let mut one_more = cloud.clone();
    if let Some(hole) = one_more.points.iter().position(|p| !is_finite(p)) {
        one_more.points[hole] = Point3::new(-0.6, -0.4, 2.0);
    }
    vec![
        organised("as it is", &cloud, at_home),
        organised("rows, turned", &cloud, away),
        organised("rows, level", &cloud, level),
        organised("rows, a stray return", &one_more, at_home),
        loose("loose", &bare, at_home),
        loose("loose, turned", &bare, away),
        loose("loose, level", &bare, level),
        loose("loose, shuffled", &shuffled, at_home),
        loose("loose, shuffled, turned", &shuffled, away),
        loose("loose, a stray return at 2 m", &stray(Point3::new(0.1, 0.2, 2.0)), at_home),
        loose("loose, a stray return aside", &stray(Point3::new(2.0, 0.2, 1.0)), at_home),
        loose("loose, a stray return behind", &stray(Point3::new(0.2, 0.2, -2.0)), at_home),
    ]
}

fn scenes(dir: &Path) -> Result<Vec<PathBuf>, String> {
    let entries = std::fs::read_dir(dir).map_err(|e| format!("{}: {e}", dir.display()))?;
    let mut scenes: Vec<PathBuf> = entries.filter_map(|entry| entry.ok().map(|e| e.path())).collect();
    scenes.retain(|p| p.extension().is_some_and(|e| e == "pcd"));
    scenes.sort();
    Ok(scenes)
}
