//! Recordings: a milk carton in one scene of clutter, absent from others; kitchen objects, learned from half
//! of the frames and found in the rest.

use crate::frames::frames;
use crate::judge::line;
use crate::page::{Page, PageTable};
use crate::plot::{picture, said};
use descry_perception::files::read_cloud;
use descry_perception::learning::{
    KnowOptions, LearnOptions, LearnedModel, Library, Recognised, choose, learn, outward, register,
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

pub fn print(page: &mut Page) -> Result<(), String> {
    page.heading("Recordings");
    let shared = PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("../../../shared/data");
    if !shared.is_dir() {
        page.say("skipped: no ../shared/data beside the workspace");
        return Ok(());
    }
    milk(&shared, page)?;
    kitchen(&shared.join("kitchen"), page)
}

/// Formats answers: position, and rotation vector.
fn words(found: &[Recognised]) -> String {
    let pose = |f: &Recognised| {
        let (at, turn) = (f.world_from_model.translation.vector, f.world_from_model.rotation.scaled_axis());
        format!(
            "at {:.3} {:.3} {:.3} m, turned {:.2} {:.2} {:.2} rad, confidence {:.3} ({} points explained, {} seen through, {} hidden)",
            at.x,
            at.y,
            at.z,
            turn.x,
            turn.y,
            turn.z,
            f.confidence,
            f.evidence.explained,
            f.evidence.through,
            f.evidence.hidden
        )
    };
    match found {
        [] => "nothing".to_owned(),
        all => all.iter().map(pose).collect::<Vec<_>>().join("; "),
    }
}

fn milk(shared: &Path, page: &mut Page) -> Result<(), String> {
    let options = KnowOptions::default();
    let mut library = Library::default();
    // The model is painted in one colour: that tells nothing of the carton.
    let bare = Cloud { colours: None, ..cloud(&shared.join("pcl/milk.pcd"))? };
    let milk = outward(&bare).map_err(|e| e.to_string())?;
    library.add(&milk, &options).map_err(|e| e.to_string())?;
    page.say("The milk carton of the Point Cloud Library in its scene, and in scenes without it");
    let mut table = PageTable::new(&["scene", "found", "the most confidence in any pose", "s"]);
    let mut scenes = vec![shared.join("pcl/milk_cartoon_all_small_clorox.pcd")];
    scenes.extend(files(&shared.join("mosd"), "pcd"));
    for (k, path) in scenes.iter().enumerate() {
        let view = in_optical_frame(cloud(path)?);
        let start = Instant::now();
        let judged = library.judged(&view, &options).map_err(|e| e.to_string())?;
        let most = judged.iter().map(|c| c.recognised.confidence).fold(0.0, f64::max);
        let found = choose(judged, options.least_confidence);
        let name = path.file_stem().map_or(String::new(), |n| n.to_string_lossy().into_owned());
        let seconds = start.elapsed().as_secs_f64();
        table.row(vec![name, words(&found), format!("{most:.3}"), format!("{seconds:.1}")]);
        if k == 0 {
            draw(&view, &milk, &found, &page.file("milk.png"))?;
        }
    }
    page.table(&table);
    page.figure("milk.png", "The scene, and the model where it was found");
    Ok(())
}

/// Draws the scene in grey with the models found in it.
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

/// A view of a recording that may look along −z with y up, rotated so that its world is the frame of the
/// file.
fn in_optical_frame(cloud: Cloud) -> View {
    let behind = cloud.points.iter().filter(|p| p.z < 0.0).count();
    if 2 * behind < cloud.count_finite() {
        return View::alone(cloud);
    }
    let turn = Isometry3::rotation(Vector3::x() * std::f64::consts::PI);
    View { world_from_camera: turn.inverse(), ..View::alone(cloud.transformed(&turn)) }
}

/// Calibration of the recording's colour camera in the frame of its depth camera: focal length and principal
/// point, pixels, and shift, metres. Fitted by matching depth steps to image edges over all frames.
const COLOUR: (f64, [f64; 2], [f64; 2]) = (525.0, [322.0, 236.0], [-0.029, 0.005]);

/// View of a depth frame, coloured from the image of the frame.
fn coloured(mut view: View, dir: &Path, name: &str) -> Result<View, String> {
    let path = dir.join(format!("{name}.color.jpg"));
    let image = image::open(&path).map_err(|e| format!("{}: {e}", path.display()))?.to_rgb8();
    let (focal, centre, shift) = COLOUR;
    let colour = |p: &Point3<f32>| {
        let at = |k: usize| focal * (f64::from(p[k]) + shift[k]) / f64::from(p.z) + centre[k];
        let (u, v) = (at(0).round(), at(1).round());
        let inside = u >= 0.0 && v >= 0.0 && u < f64::from(image.width()) && v < f64::from(image.height());
        if inside { image.get_pixel(u as u32, v as u32).0 } else { [0; 3] }
    };
    view.cloud.colours = Some(view.cloud.points.iter().map(colour).collect());
    Ok(view)
}

/// Maximum distance of a correct answer, metres; the poses of the frames agree to a few centimetres.
const THERE_M: f64 = 0.08;

/// An object of the kitchen: its name and position.
struct Thing {
    name: String,
    at: Point3<f64>,
}

/// Learns the objects of a table from every other frame, and finds them in the rest.
fn kitchen(dir: &Path, page: &mut Page) -> Result<(), String> {
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
    let all: Vec<View> =
        frames(dir)?.into_iter().map(|(name, view)| coloured(view, dir, &name)).collect::<Result<_, _>>()?;
    for begin in [0, 1] {
        let half = |k: usize| all.iter().skip(k).step_by(2).cloned().collect::<Vec<View>>();
        let (learned_from, found_in) = (half(begin), half(1 - begin));
        page.say(&format!(
            "Things of a kitchen, learned from {} frames, looked for in the {} others",
            learned_from.len(),
            found_in.len()
        ));
        let options = KnowOptions { up: Some(up), ..KnowOptions::default() };
        let mut library = Library::default();
        let mut known = Vec::new();
        for thing in &things {
            match model_of(thing, &learned_from, up, table_m) {
                Ok(model) => {
                    let looks = model.looks.iter().filter(|l| l.pixels > 0).count();
                    page.say(&format!("{}: {} points of {looks} looks", thing.name, model.cloud.len()));
                    let eye = Point3::from(up.into_inner() * 0.25 - Vector3::z() * 0.4);
                    let name = format!("kitchen-{begin}-{}.png", thing.name.replace(' ', "-"));
                    let labels = vec![1; model.cloud.len()];
                    picture(
                        &model.cloud,
                        &labels,
                        &page.file(&name),
                        (eye, Point3::origin(), up.into_inner()),
                    )?;
                    page.figure(&name, &thing.name);
                    library.add(&model.cloud, &options).map_err(|e| e.to_string())?;
                    known.push((thing, model));
                }
                Err(why) => page.say(&format!("{}: not learned: {why}", thing.name)),
            }
        }
        found_again(&library, &known, (&found_in, 1 - begin), &options, page)?;
    }
    Ok(())
}

/// Scores recognition in the frames not used for learning: counts for each object, and every answer.
fn found_again(
    library: &Library,
    known: &[(&Thing, LearnedModel)],
    (frames, begin): (&[View], usize),
    options: &KnowOptions,
    page: &mut Page,
) -> Result<(), String> {
    let mut answers = PageTable::new(&["frame", "in the image", "found", "the most confidence in each", "s"]);
    let mut counts = vec![[0_usize; 3]; known.len()];
    let off_m = |f: &Recognised| {
        let truly = known[f.model].1.world_from_model.translation.vector;
        (f.world_from_model.translation.vector - truly).norm()
    };
    let mut claims = Vec::new();
    for (k, view) in frames.iter().enumerate() {
        let start = Instant::now();
        let judged = library.judged(view, options).map_err(|e| e.to_string())?;
        let seconds = start.elapsed().as_secs_f64();
        claims.extend(judged.iter().map(|c| {
            let found = &c.recognised;
            line(2 * k + begin, found.model, off_m(found) < THERE_M, &found.evidence)
        }));
        let most = |model: usize| {
            let own = judged.iter().filter(|c| c.recognised.model == model);
            own.map(|c| c.recognised.confidence).fold(0.0, f64::max)
        };
        let most: Vec<String> = known
            .iter()
            .enumerate()
            .map(|(m, (thing, _))| format!("{} {:.2}", thing.name, most(m)))
            .collect();
        let found = choose(judged, options.least_confidence);
        let inside = |t: &Thing| {
            let q = view.world_from_camera.inverse() * t.at;
            let camera = view.intrinsics.as_ref();
            let pixel = camera.and_then(|c| c.project(&q).and_then(|(u, v)| c.pixel(u, v)));
            pixel.is_some() && q.z < options.range_m
        };
        for (m, (thing, _)) in known.iter().enumerate() {
            let own: Vec<f64> = found.iter().filter(|f| f.model == m).map(off_m).collect();
            counts[m][0] += usize::from(inside(thing));
            counts[m][1] += usize::from(own.iter().any(|off| *off < THERE_M));
            counts[m][2] += own.iter().filter(|off| **off >= THERE_M).count();
        }
        let there =
            known.iter().filter(|k| inside(k.0)).map(|k| k.0.name.as_str()).collect::<Vec<_>>().join(", ");
        if !found.is_empty() {
            let answers: Vec<_> = found
                .iter()
                .map(|f| (&known[f.model].1.cloud, f.world_from_model, off_m(f) < THERE_M))
                .collect();
            let name = format!("kitchen-frame-{}.png", 2 * k + begin);
            said(view, &answers, &page.file(&name))?;
            page.figure(&name, &format!("Frame {}: what was said, green where it is right", 2 * k + begin));
        }
        let told = found.iter().map(|f| {
            format!("{} ({:.2}, {:.1} cm off)", known[f.model].0.name, f.confidence, 100.0 * off_m(f))
        });
        let told = told.collect::<Vec<_>>().join(", ");
        answers.row(vec![(2 * k + begin).to_string(), there, told, most.join(", "), format!("{seconds:.1}")]);
    }
    let mut table =
        PageTable::new(&["thing", "frames with it in the image, in range", "found there", "said elsewhere"]);
    for ((thing, _), count) in known.iter().zip(&counts) {
        let mut row = vec![thing.name.clone()];
        row.extend(count.map(|c| c.to_string()));
        table.row(row);
    }
    page.table(&table);
    page.table(&answers);
    let path = page.file(&format!("kitchen-claims-{begin}.csv"));
    std::fs::write(&path, claims.join("\n")).map_err(|e| format!("{}: {e}", path.display()))
}

/// Model of the object at a place on the table, started from the frame that shows most of it.
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
