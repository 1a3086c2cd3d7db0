//! Recordings: a milk carton in a scene of clutter, and not in others; things of a kitchen, learned from one half of the frames and found in the
//! other.

use crate::frames::frames;
use crate::plot::picture;
use descry_perception::files::read_cloud;
use descry_perception::learning::{
    KnowOptions, LearnOptions, LearnedModel, Library, Recognised, learn, outward, register,
};
use descry_perception::nalgebra::{Isometry3, Point3, Unit, Vector3};
use descry_perception::{Cloud, View};
use std::path::{Path, PathBuf};
use std::time::Instant;

fn cloud(path: &Path) -> Result<Cloud, String> {
    let bytes = std::fs::read(path).map_err(|e| format!("{}: {e}", path.display()))?;
    read_cloud(&bytes).map(|l| l.cloud).map_err(|e| format!("{}: {e}", path.display()))
}

fn files(dir: &Path, ending: &str) -> Vec<PathBuf> {
    let Ok(entries) = std::fs::read_dir(dir) else { return Vec::new() };
    let mut all: Vec<PathBuf> = entries.flatten().map(|e| e.path()).collect();
    all.retain(|p| p.extension().is_some_and(|e| e == ending));
    all.sort();
    all
}

pub fn print(out: &Path) -> Result<(), String> {
    let shared = PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("../../shared/data");
    if !shared.is_dir() {
        println!("\nskipped: no ../shared/data beside the workspace");
        return Ok(());
    }
    milk(&shared, out)?;
    kitchen(&shared.join("kitchen"), out)
}

fn told(name: &str, found: &[Recognised], seconds: f64) {
    let poses: Vec<String> = found
        .iter()
        .map(|f| {
            let (at, turn) = (f.world_from_model.translation.vector, f.world_from_model.rotation.scaled_axis());
            format!(
                "model {} at {:.3} {:.3} {:.3} m, turned {:.2} {:.2} {:.2}, confidence {:.2} ({} explained, {} seen through, {} hidden)",
                f.model, at.x, at.y, at.z, turn.x, turn.y, turn.z, f.confidence, f.evidence.explained,
                f.evidence.through, f.evidence.hidden
            )
        })
        .collect();
    println!(
        "{name}: {} ({seconds:.1} s)",
        if poses.is_empty() { "nothing".to_owned() } else { poses.join("; ") }
    );
}

fn milk(shared: &Path, out: &Path) -> Result<(), String> {
    let options = KnowOptions::default();
    let mut library = Library::default();
    // The model is painted in one colour: that tells nothing of the carton.
    let bare = Cloud { colours: None, ..cloud(&shared.join("pcl/milk.pcd"))? };
    let milk = outward(&bare).map_err(|e| e.to_string())?;
    library.add(&milk, &options).map_err(|e| e.to_string())?;
    println!("\nThe milk carton of the Point Cloud Library");
    let mut scenes = vec![shared.join("pcl/milk_cartoon_all_small_clorox.pcd")];
    scenes.extend(files(&shared.join("mosd"), "pcd"));
    for (k, path) in scenes.iter().enumerate() {
        let view = in_optical_frame(cloud(path)?);
        let start = Instant::now();
        let found = library.recognise(&view, &options).map_err(|e| e.to_string())?;
        let name = path.file_stem().map_or(String::new(), |n| n.to_string_lossy().into_owned());
        told(&name, &found, start.elapsed().as_secs_f64());
        if found.is_empty() {
            let best = library.judged(&view, &options).map_err(|e| e.to_string())?;
            best.first().iter().for_each(|b| println!("  the best: {:.3} {:?}", b.confidence, b.evidence));
        }
        if k == 0 {
            draw(&view, &milk, &found, &out.join("milk.png"))?;
        }
    }
    Ok(())
}

/// The scene in grey and the models that were found in it.
fn draw(view: &View, model: &Cloud, found: &[Recognised], path: &Path) -> Result<(), String> {
    let mut all = view.cloud.transformed(&view.world_from_camera).finite();
    let mut labels = vec![0_u32; all.len()];
    for f in found {
        let model = model.transformed(&f.world_from_model);
        labels.extend(std::iter::repeat_n(1, model.len()));
        all.append(&model);
    }
    let from = (Point3::new(0.1, 0.35, 0.1), Point3::new(0.0, 0.0, -0.8), Vector3::y());
    picture(&all, &labels, path, from)
}

/// A view of a recording that may look along −z with y up: turned, so that its world is the frame of the file.
fn in_optical_frame(cloud: Cloud) -> View {
    let behind = cloud.points.iter().filter(|p| p.z < 0.0).count();
    if 2 * behind < cloud.count_finite() {
        return View::alone(cloud);
    }
    let turn = Isometry3::rotation(Vector3::x() * std::f64::consts::PI);
    View { world_from_camera: turn.inverse(), ..View::alone(cloud.transformed(&turn)) }
}

/// A thing of the kitchen: its name and where it stands.
struct Thing {
    name: String,
    at: Point3<f64>,
}

/// Which half of the frames is learned from.
fn kitchen(dir: &Path, out: &Path) -> Result<(), String> {
    let text = std::fs::read_to_string(dir.join("objects.json")).map_err(|e| e.to_string())?;
    let json: serde_json::Value = serde_json::from_str(&text).map_err(|e| e.to_string())?;
    let three = |v: &serde_json::Value| Vector3::from([0, 1, 2].map(|k| v[k].as_f64().unwrap_or(0.0)));
    let up = Unit::new_normalize(three(&json["table_plane_up"]));
    let table_m = up.dot(&three(&json["table_point"]));
    let thing = |o: &serde_json::Value| Thing {
        name: o["name"].as_str().unwrap_or("").to_owned(),
        at: Point3::from(three(&o["centroid"])),
    };
    let things: Vec<Thing> = json["objects"].as_array().into_iter().flatten().map(thing).collect();
    let all: Vec<View> = frames(dir)?.into_iter().map(|f| f.1).collect();
    let (even, odd): (Vec<_>, Vec<_>) = all.iter().enumerate().partition(|(k, _)| k % 2 == 0);
    let views =
        |half: Vec<(usize, &View)>| -> Vec<View> { half.into_iter().map(|(_, v)| v.clone()).collect() };
    let (learned_from, found_in) = (views(even), views(odd));
    println!(
        "\nThings of a kitchen, learned from {} frames, looked for in {}",
        learned_from.len(),
        found_in.len()
    );
    let options = KnowOptions::default();
    let mut library = Library::default();
    let mut known = Vec::new();
    for thing in &things {
        match model_of(thing, &learned_from, up, table_m) {
            Ok(model) => {
                let looks = model.looks.iter().filter(|l| l.pixels > 0).count();
                println!("{}: {} points of {looks} looks", thing.name, model.cloud.len());
                let eye = Point3::from(up.into_inner() * 0.25 - Vector3::z() * 0.4);
                let path = out.join(format!("kitchen-{}.png", thing.name.replace(' ', "-")));
                let labels = vec![1; model.cloud.len()];
                picture(&model.cloud, &labels, &path, (eye, Point3::origin(), up.into_inner()))?;
                library.add(&model.cloud, &options).map_err(|e| e.to_string())?;
                known.push((thing, model));
            }
            Err(why) => println!("{}: not learned: {why}", thing.name),
        }
    }
    found_again(&library, &known, &things, &found_in, &options)
}

/// Prints what is found in frames that were not learned from.
fn found_again(
    library: &Library,
    known: &[(&Thing, LearnedModel)],
    things: &[Thing],
    frames: &[View],
    options: &KnowOptions,
) -> Result<(), String> {
    for (k, view) in frames.iter().enumerate() {
        let start = Instant::now();
        let found = library.recognise(view, options).map_err(|e| e.to_string())?;
        let seconds = start.elapsed().as_secs_f64();
        let inside = |t: &&Thing| {
            let q = view.world_from_camera.inverse() * t.at;
            let camera = view.intrinsics.as_ref();
            let pixel = camera.and_then(|c| c.project(&q).and_then(|(u, v)| c.pixel(u, v)));
            pixel.is_some() && q.z < options.range_m
        };
        let there: Vec<&str> = things.iter().filter(inside).map(|t| t.name.as_str()).collect();
        let told: Vec<String> = found
            .iter()
            .map(|f| {
                let (thing, model) = &known[f.model];
                let off = f.world_from_model.translation.vector - model.world_from_model.translation.vector;
                format!("{} ({:.2}, {:.1} cm off)", thing.name, f.confidence, 100.0 * off.norm())
            })
            .collect();
        let (there, told) = (there.join(", "), told.join(", "));
        println!("frame {}: in the image: {there}; found: {told} ({seconds:.1} s)", 2 * k + 1);
    }
    Ok(())
}

/// A model of what stands at a place on the table, begun in the frame that shows most of it.
fn model_of(
    thing: &Thing,
    views: &[View],
    up: Unit<Vector3<f64>>,
    table_m: f64,
) -> Result<LearnedModel, String> {
    let mask_in = |view: &View| -> Vec<bool> {
        let of = |p: &Point3<f32>| {
            let world = view.world_from_camera * p.cast::<f64>();
            let off = world - thing.at;
            let aside = (off - up.into_inner() * off.dot(&up)).norm();
            let high = world.coords.dot(&up) - table_m;
            p.z.is_finite() && aside < 0.09 && (0.02..0.16).contains(&high)
        };
        view.cloud.points.iter().map(of).collect()
    };
    let masks: Vec<Vec<bool>> = views.iter().map(mask_in).collect();
    let count = |k: usize| masks[k].iter().filter(|m| **m).count();
    let shown: Vec<usize> = (0..views.len()).filter(|&k| count(k) > 200).collect();
    let first = shown.iter().copied().max_by_key(|&k| count(k)).ok_or("in no frame")?;
    let mut order = vec![first];
    order.extend(shown.into_iter().filter(|&k| k != first));
    let looks: Vec<View> = order.iter().map(|&k| views[k].clone()).collect();
    let keyframes = register(&looks, Some(up), 3.0).map_err(|e| e.to_string())?;
    learn(&looks, &keyframes, &masks[first], &LearnOptions::default()).map_err(|e| e.to_string())
}
