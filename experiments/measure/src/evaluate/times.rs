//! Time from one view to its percepts, by stage, with a digest of the results to detect changes.

use super::kitchen::{self, ReferenceTable};
use super::{mosd, table};
use descry_perception::files::pcd::{PcdEncoding, write};
use descry_perception::files::{FileError, Loaded, read_cloud};
use descry_perception::merge::merge;
use descry_perception::recognise::{Descry, Recogniser};
use descry_perception::segment::{SceneOptions, segment_on};
use descry_perception::surface::find_surface;
use descry_perception::{Cloud, ObjectModel, Percept, Scene, View, Visibility};
use rayon::prelude::*;
use std::hash::{DefaultHasher, Hash, Hasher};
use std::path::{Path, PathBuf};
use std::time::Instant;

/// A view with its options.
struct Case {
    name: String,
    view: View,
    options: SceneOptions,
    models: Vec<ObjectModel>,
}

/// Times single views: simulated ones (`made`), and those of folders of point clouds or kitchen frames; or
/// merges of five (`merged`).
pub fn run(repetitions: usize, views: &[&str]) -> Result<(), String> {
    if views == ["merged"] {
        return merged(repetitions);
    }
    let mut cases = Vec::new();
    for &name in views {
        let dir = Path::new(name);
        cases.extend(match name {
            "made" => made(),
            _ if dir.join("objects.json").exists() => frames(dir)?,
            _ => clouds(dir)?,
        });
    }
    println!(
        "{:>14} {:>8} {:>8} {:>8} {:>9} {:>8}   ms, least of {repetitions}",
        "view", "segments", "surface", "segment", "recognise", "all"
    );
    let mut all = Vec::new();
    for case in &cases {
        let row = time(case, repetitions);
        let [surface, segment, recognise] = row.stages_ms;
        let found = row.segments.map_or("none".to_owned(), |n| n.to_string());
        println!(
            "{:>14} {found:>8} {surface:>8.2} {segment:>8.2} {recognise:>9.2} {:>8.2}   {:016x}",
            case.name, row.all_ms, row.digest
        );
        all.push(row.all_ms);
    }
    all.sort_by(f64::total_cmp);
    if let (Some(middle), Some(most)) = (all.get(all.len() / 2), all.last()) {
        println!("median {middle:.2} ms, most {most:.2} ms of {} views", all.len());
    }
    Ok(())
}

/// Times five views of a table from their files to percepts.
fn merged(repetitions: usize) -> Result<(), String> {
    println!("{:>6} {:>8} {:>8} {:>9}   ms, least of {repetitions}", "table", "read", "merge", "recognise");
    for seed in 1..=4 {
        let views = table::views(seed);
        let files: Vec<Vec<u8>> = views.iter().map(|view| write(&view.cloud, PcdEncoding::Binary)).collect();
        let mut least_ms = [f64::INFINITY; 3];
        let mut digest = 0;
        for _ in 0..repetitions.max(1) {
            let start = Instant::now();
            let clouds: Vec<_> = files.par_iter().map(|file| read_cloud(file)).collect();
            let read = Instant::now();
            let anew = |(view, loaded): (&View, Result<Loaded, FileError>)| {
                Ok(View { cloud: loaded?.cloud, ..view.clone() })
            };
            let again: Result<Vec<View>, FileError> = views.iter().zip(clouds).map(anew).collect();
            let again = again.map_err(|e| e.to_string())?;
            let begun = Instant::now();
            let merged = merge(&again, &table::options()).map_err(|e| e.to_string())?;
            let done = Instant::now();
            let percepts = table::judge(&merged, &Descry::default())?;
            let ms = [read - start, done - begun, done.elapsed()].map(|d| d.as_secs_f64() * 1e3);
            least_ms.iter_mut().zip(ms).for_each(|(least, ms)| *least = least.min(ms));
            let mut hasher = DefaultHasher::new();
            format!("{percepts:.5?}").hash(&mut hasher);
            digest = hasher.finish();
        }
        let [read, merge, recognise] = least_ms;
        println!("{seed:6} {read:8.1} {merge:8.1} {recognise:9.1}   {digest:016x}");
    }
    Ok(())
}

/// Minimum times, and a digest of the rounded results.
struct Row {
    /// Number of segments; none without a surface.
    segments: Option<usize>,
    stages_ms: [f64; 3],
    all_ms: f64,
    digest: u64,
}

fn time(case: &Case, repetitions: usize) -> Row {
    let seen = Visibility::from_views(std::slice::from_ref(&case.view));
    let cloud = case.view.cloud.transformed(&case.view.world_from_camera);
    let (scene, percepts, _) = stages(case, &cloud, &seen);
    let mut hasher = DefaultHasher::new();
    format!("{scene:.5?}{percepts:.5?}").hash(&mut hasher);
    let segments = scene.map(|s| s.segments.len());
    let (mut stages_ms, mut all_ms) = ([f64::INFINITY; 3], f64::INFINITY);
    for _ in 0..repetitions.max(1) {
        let (_, _, ms) = stages(case, &cloud, &seen);
        stages_ms.iter_mut().zip(ms).for_each(|(least, ms)| *least = least.min(ms));
        all_ms = all_ms.min(ms.iter().sum());
    }
    Row { segments, stages_ms, all_ms, digest: hasher.finish() }
}

/// Results of the stages, with the time of finding the surface, segmenting and recognising, milliseconds.
fn stages(case: &Case, cloud: &Cloud, seen: &Visibility) -> (Option<Scene>, Option<Vec<Percept>>, [f64; 3]) {
    let start = Instant::now();
    let surface = find_surface(cloud, seen, &case.options.surface).ok();
    let found = Instant::now();
    let scene = surface.map(|surface| segment_on(cloud, seen, surface, &case.options));
    let parted = Instant::now();
    let percepts = scene.as_ref().map(|s| Descry::default().recognise(s, seen, &case.models));
    let ms = [found - start, parted - found, parted.elapsed()].map(|d| d.as_secs_f64() * 1e3);
    (scene, percepts, ms)
}

fn made() -> Vec<Case> {
    let options = SceneOptions { surface: table::surface(), ..SceneOptions::default() };
    let case = |seed| Case {
        name: format!("made {seed}"),
        view: table::view(seed),
        options: options.clone(),
        models: table::models(),
    };
    (1..=4).map(case).collect()
}

fn clouds(dir: &Path) -> Result<Vec<Case>, String> {
    let mut paths: Vec<PathBuf> = std::fs::read_dir(dir)
        .map_err(|e| format!("{}: {e}", dir.display()))?
        .filter_map(|entry| entry.ok().map(|e| e.path()))
        .filter(|p| p.extension().is_some_and(|e| e == "pcd"))
        .collect();
    paths.sort();
    let case = |path: PathBuf| {
        let name = path.file_stem().map(|s| s.to_string_lossy().into_owned()).unwrap_or_default();
        let bytes = std::fs::read(&path).map_err(|e| format!("{name}: {e}"))?;
        let cloud = read_cloud(&bytes).map_err(|e| format!("{name}: {e}"))?.cloud;
        let (options, models) = (SceneOptions::default(), vec![mosd::cup()]);
        Ok(Case { name, view: View::alone(cloud), options, models })
    };
    paths.into_iter().map(case).collect()
}

fn frames(dir: &Path) -> Result<Vec<Case>, String> {
    let table = ReferenceTable::read(dir)?;
    let case = |(name, view)| {
        let options = SceneOptions { surface: table.surface(), ..SceneOptions::default() };
        Case { name, view, options, models: vec![kitchen::mug()] }
    };
    Ok(crate::frames::frames(dir)?.into_iter().map(case).collect())
}
