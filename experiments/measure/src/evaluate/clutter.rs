//! Piles of labelled objects: choice of the table surface, and segmentation of each object.

use super::mosd::{SegmentTally, labelled_objects, overlap};
use super::tabletop::pile::Pile;
use super::tabletop::{Draws, TABLE_M};
use descry_perception::nalgebra::{Point3, Vector3};
use descry_perception::picture::{PictureOptions, png};
use descry_perception::segment::{SceneOptions, segment};
use descry_perception::{Cloud, Scene, View, Visibility};
use std::path::Path;

/// Height difference from which a surface is not the table, metres.
const OFF_M: f64 = 0.015;

/// Scores piles with `count` seeds from `first`; pictures of the first twenty are written to `out`.
pub fn run(count: u64, first: u64, out: Option<&Path>) -> Result<(), String> {
    if let Some(dir) = out {
        std::fs::create_dir_all(dir).map_err(|e| format!("{}: {e}", dir.display()))?;
    }
    let mut tally = SegmentTally::default();
    let (mut other, mut none, mut lost) = (0, 0, 0);
    for seed in first..first + count {
        let mut draws = Draws(seed);
        let view = Pile::drawn(&mut draws).look(&mut draws);
        let labels = view.cloud.labels.clone().unwrap_or_default();
        let known = labelled_objects(&labels);
        let seen = Visibility::from_views(std::slice::from_ref(&view));
        let cloud = view.cloud.transformed(&view.world_from_camera);
        let scene = match segment(&cloud, &seen, &SceneOptions::default()) {
            Ok(scene) => scene,
            Err(why) => {
                println!("seed {seed}: {why}");
                none += 1;
                tally.objects += known.len();
                continue;
            }
        };
        let height_m = scene.surface.middle().z - TABLE_M;
        println!(
            "seed {seed}: surface {:.2} m2, {:.0} mm off, {} of {} returns on things",
            scene.surface.area_m2,
            1e3 * height_m,
            labels.iter().filter(|label| **label >= 20).count(),
            cloud.count_finite()
        );
        let before = tally.found;
        overlap(&scene, &cloud, &labels, &known, &mut tally);
        if height_m.abs() > OFF_M {
            other += 1;
            lost += known.len() + before - tally.found;
        }
        if let Some(dir) = out.filter(|_| seed < first + 20) {
            picture(&dir.join(format!("seed-{seed}.png")), &view, &cloud, &scene)?;
        }
    }
    println!(
        "\n{:>6} {:>8} {:>6} {:>6} {:>7} {:>6} {:>14} {:>11} {:>16}",
        "piles",
        "objects",
        "found",
        "split",
        "merged",
        "extra",
        "other surface",
        "no surface",
        "lost by another"
    );
    println!(
        "{count:>6} {:>8} {:>6} {:>6} {:>7} {:>6} {other:>14} {none:>11} {lost:>16}",
        tally.objects, tally.found, tally.split, tally.merged, tally.extra
    );
    Ok(())
}

/// Picture of a view from its camera, with one colour a segment; its cloud is in the frame of its pose.
pub fn picture(path: &Path, view: &View, cloud: &Cloud, scene: &Scene) -> Result<(), String> {
    let mut labels = vec![0_u32; cloud.len()];
    for (label, segment) in (1..).zip(&scene.segments) {
        segment.indices.iter().for_each(|&i| labels[i as usize] = label);
    }
    let pose = view.world_from_camera;
    let options = PictureOptions {
        eye: Point3::from(pose.translation.vector),
        target: pose * Point3::new(0.0, 0.0, 1.0),
        up: pose * -Vector3::y(),
        ..PictureOptions::default()
    };
    let bytes = png(cloud, &labels, &options).map_err(|e| e.to_string())?;
    std::fs::write(path, bytes).map_err(|e| format!("{}: {e}", path.display()))
}
