//! Kinect scenes of the Object Segmentation Database, with a label for each point.

use super::clutter::picture;
use descry_perception::cloud::is_finite;
use descry_perception::files::read_cloud;
use descry_perception::nalgebra::Point3;
use descry_perception::recognise::{Descry, Published, Range, Top};
use descry_perception::segment::{SceneOptions, segment};
use descry_perception::{ObjectModel, Percept, Recogniser, Scene, View, Visibility};
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

/// Model of the cups in the labels.
pub fn cup() -> ObjectModel {
    ObjectModel {
        name: "cup".into(),
        kind: "cup".into(),
        phrases: Vec::new(),
        shape: Default::default(),
        height_m: Range { low: 0.085, high: 0.115 },
        diameter_m: Some(Range { low: 0.065, high: 0.095 }),
        width_m: None,
        depth_m: None,
        taper: Range { low: 0.7, high: 1.05 },
        top: Top::Open,
        handle: Default::default(),
        colours: Vec::new(),
    }
}

#[derive(Default)]
pub struct SegmentTally {
    pub found: usize,
    pub objects: usize,
    pub split: usize,
    pub merged: usize,
    pub extra: usize,
}

/// Scores every scene of a folder; pictures are written to `out`.
pub fn run(dir: &Path, out: Option<&Path>) -> Result<(), String> {
    if let Some(out) = out {
        std::fs::create_dir_all(out).map_err(|e| format!("{}: {e}", out.display()))?;
    }
    let (cups, objects) = (dir.join("cups.csv"), dir.join("objects.csv"));
    let cups = if cups.exists() { table(&cups)? } else { Vec::new() };
    let objects = if objects.exists() { Some(table(&objects)?) } else { None };
    let mut scenes: Vec<PathBuf> = std::fs::read_dir(dir)
        .map_err(|e| format!("{}: {e}", dir.display()))?
        .filter_map(|entry| entry.ok().map(|e| e.path()))
        .filter(|p| p.extension().is_some_and(|e| e == "pcd"))
        .collect();
    scenes.sort();
    let recognisers: [&dyn Recogniser; 2] = [&Published::default(), &Descry::default()];
    let mut hits = vec![Hits::default(); recognisers.len()];
    let mut tally = SegmentTally::default();
    for path in scenes {
        let name = path.file_stem().map(|s| s.to_string_lossy().into_owned()).unwrap_or_default();
        let (view, labels) = labelled(&path, &name)?;
        let start = std::time::Instant::now();
        let mut seen = Visibility::from_views(std::slice::from_ref(&view));
        if seen.maps.is_empty() {
            seen = Visibility::from_viewpoints(&view.cloud, &[Point3::origin()]);
        }
        let scene = match segment(&view.cloud, &seen, &SceneOptions::default()) {
            Ok(scene) => scene,
            Err(why) => {
                println!("{name}: {why}");
                continue;
            }
        };
        let segmented_ms = start.elapsed().as_secs_f64() * 1e3;
        println!(
            "{name}: table {:.2} m2, residual {:.1} mm, {} segments, {segmented_ms:.1} ms",
            scene.surface.area_m2,
            scene.surface.residual_m * 1e3,
            scene.segments.len()
        );
        if let Some(out) = out {
            picture(&out.join(format!("{name}.png")), &view, &view.cloud, &scene)?;
        }
        let of_scene = |rows: &[Vec<String>]| -> Vec<u32> {
            rows.iter().filter(|r| r[0] == name).filter_map(|r| r[1].parse().ok()).collect()
        };
        let known = objects.as_ref().map_or_else(|| labelled_objects(&labels), |rows| of_scene(rows));
        let owner = overlap(&scene, &view.cloud, &labels, &known, &mut tally);
        let cups: Vec<Vec<String>> = cups.iter().filter(|c| c[2] == "cup").cloned().collect();
        for (recogniser, hits) in recognisers.iter().zip(&mut hits) {
            let percepts = recogniser.recognise(&scene, &seen, &[cup()]);
            hits.count(*recogniser, &percepts, &owner, &of_scene(&cups));
        }
    }
    println!(
        "\nobjects found at IoU 0.5: {} of {}; split {}, merged {}, segments on no object {}",
        tally.found, tally.objects, tally.split, tally.merged, tally.extra
    );
    println!("\n{:12} {:>9} {:>9}   (cups found, false cups, cups)", "recogniser", "precision", "recall");
    for (recogniser, Hits { right, wrong, all }) in recognisers.iter().zip(hits) {
        let precision = right as f64 / (right + wrong).max(1) as f64;
        println!(
            "{:12} {precision:9.2} {:9.2}   {right} {wrong} {all}",
            recogniser.name(),
            right as f64 / all.max(1) as f64
        );
    }
    Ok(())
}

/// Reads a scene as one view, with the labels of its points.
fn labelled(path: &Path, name: &str) -> Result<(View, Vec<u32>), String> {
    let bytes = std::fs::read(path).map_err(|e| format!("{}: {e}", path.display()))?;
    let cloud = read_cloud(&bytes).map_err(|e| format!("{}: {e}", path.display()))?.cloud;
    let labels = cloud.labels.clone().ok_or_else(|| format!("{name}: no labels"))?;
    Ok((View::alone(cloud), labels))
}

/// The labels of objects, for scenes that no table lists.
pub fn labelled_objects(labels: &[u32]) -> Vec<u32> {
    const FEWEST: usize = 60;
    let mut sizes: BTreeMap<u32, usize> = BTreeMap::new();
    labels.iter().filter(|label| **label >= 20).for_each(|label| *sizes.entry(label / 10).or_default() += 1);
    sizes.into_iter().filter(|(_, size)| *size >= FEWEST).map(|(object, _)| object).collect()
}

/// Score of a recogniser on cups.
#[derive(Clone, Default)]
struct Hits {
    right: usize,
    wrong: usize,
    all: usize,
}

impl Hits {
    /// Counts the percepts of a scene, given the majority object of each and the set of cups.
    fn count(
        &mut self,
        recogniser: &dyn Recogniser,
        percepts: &[Percept],
        owner: &[Option<u32>],
        cups: &[u32],
    ) {
        let mut called = Vec::new();
        for (percept, owner) in percepts.iter().zip(owner) {
            let is_cup = owner.is_some_and(|o| cups.contains(&o));
            match (percept.label.is_some(), is_cup) {
                (true, true) => called.extend(*owner),
                (true, false) => self.wrong += 1,
                _ => {}
            }
            if recogniser.name() == "descry" || percept.label.is_some() {
                println!("   {:>10} object {owner:?} cup {is_cup}: {}", recogniser.name(), words(percept));
            }
        }
        called.sort_unstable();
        called.dedup();
        self.right += called.len();
        self.all += cups.len();
    }
}

pub fn words(p: &Percept) -> String {
    let e = &p.evidence;
    format!(
        "p {:.2} size {:.0}x{:.0}x{:.0} mm, d {:.0}±{:.0} taper {:.2} res {:.1} box {:.1} in {:.2} arc {:.2} open {:.2} lid {:.2} {:?}, handle {:?} unseen {:.2} out {:.0} mm, {:?}",
        p.probabilities.first().map_or(0.0, |p| p.1),
        p.size_m[0] * 1e3,
        p.size_m[1] * 1e3,
        p.size_m[2] * 1e3,
        2e3 * e.radius_m,
        2e3 * e.radius_sigma_m,
        e.taper,
        e.round_residual_m * 1e3,
        e.box_residual_m * 1e3,
        e.round_inliers,
        e.arc,
        e.open,
        e.lid,
        e.inside,
        e.handle,
        e.handle_unseen,
        e.protrusion_m * 1e3,
        p.stance
    )
}

/// The majority object of each segment; counts found, split and merged objects.
pub fn overlap(
    scene: &Scene,
    cloud: &descry_perception::Cloud,
    labels: &[u32],
    truth: &[u32],
    tally: &mut SegmentTally,
) -> Vec<Option<u32>> {
    let mut sizes: BTreeMap<u32, usize> = BTreeMap::new();
    for (label, p) in labels.iter().zip(&cloud.points) {
        if is_finite(p) {
            *sizes.entry(label / 10).or_default() += 1;
        }
    }
    let shares: Vec<BTreeMap<u32, usize>> = scene
        .segments
        .iter()
        .map(|s| {
            let mut counts = BTreeMap::new();
            s.indices.iter().for_each(|&i| *counts.entry(labels[i as usize] / 10).or_default() += 1);
            counts
        })
        .collect();
    for object in truth {
        let size = sizes.get(object).copied().unwrap_or(0);
        let best = scene
            .segments
            .iter()
            .zip(&shares)
            .map(|(s, share)| {
                let both = share.get(object).copied().unwrap_or(0);
                both as f64 / (s.indices.len() + size - both).max(1) as f64
            })
            .fold(0.0, f64::max);
        let pieces = shares.iter().filter(|s| s.get(object).copied().unwrap_or(0) * 10 > size).count();
        tally.objects += 1;
        tally.found += usize::from(best >= 0.5);
        tally.split += usize::from(pieces > 1);
        if best < 0.5 || pieces > 1 {
            println!("   object {object} of {size} points: best IoU {best:.2}, {pieces} pieces");
        }
    }
    scene
        .segments
        .iter()
        .zip(&shares)
        .map(|(s, share)| {
            let held = truth
                .iter()
                .filter(|o| share.get(o).copied().unwrap_or(0) * 5 > sizes.get(o).copied().unwrap_or(0))
                .count();
            tally.merged += usize::from(held > 1);
            let most = share.iter().max_by_key(|(_, n)| **n).map(|(&o, &n)| (o, n));
            let owner = most.filter(|&(o, n)| truth.contains(&o) && n * 2 > s.indices.len()).map(|(o, _)| o);
            tally.extra += usize::from(owner.is_none());
            owner
        })
        .collect()
}

fn table(path: &Path) -> Result<Vec<Vec<String>>, String> {
    let text = std::fs::read_to_string(path).map_err(|e| format!("{}: {e}", path.display()))?;
    let rows = text.lines().filter(|l| !l.starts_with('#')).skip(1);
    Ok(rows.map(|l| l.split(',').map(str::to_owned).collect()).collect())
}
