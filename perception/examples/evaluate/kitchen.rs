//! Frames of a real kitchen with poses: merged at random, mugs against their reference places.

use super::mosd::cup;
use descry_perception::files::depth;
use descry_perception::merge::{MergeOptions, merge};
use descry_perception::nalgebra::{
    Isometry3, Matrix3, Point3, Rotation3, Translation3, Unit, UnitQuaternion, Vector3,
};
use descry_perception::recognise::{Descry, Published, Range};
use descry_perception::segment::{SceneOptions, segment};
use descry_perception::surface::SurfaceOptions;
use descry_perception::{Intrinsics, ObjectModel, Recogniser, View};
use std::path::Path;

const DRAWS: u64 = 20;
/// A mug farther from its reference than this is another thing, metres.
const SAME_M: f64 = 0.08;

struct Reference {
    name: String,
    place: Point3<f64>,
    is_mug: bool,
}

fn numbers(path: &Path) -> Result<Vec<f64>, String> {
    let text = std::fs::read_to_string(path).map_err(|e| format!("{}: {e}", path.display()))?;
    text.split_whitespace().map(|w| w.parse().map_err(|e| format!("{}: {e}", path.display()))).collect()
}

fn frames(dir: &Path) -> Result<Vec<(String, View)>, String> {
    let k = numbers(&dir.join("camera-intrinsics.txt"))?;
    let mut names: Vec<String> = std::fs::read_dir(dir)
        .map_err(|e| format!("{}: {e}", dir.display()))?
        .filter_map(|e| e.ok()?.file_name().to_str()?.strip_suffix(".depth.png").map(str::to_owned))
        .collect();
    names.sort();
    names
        .into_iter()
        .map(|name| {
            let bytes =
                std::fs::read(dir.join(format!("{name}.depth.png"))).map_err(|e| format!("{name}: {e}"))?;
            let image = depth::read(&bytes, 0.001).map_err(|e| format!("{name}: {e}"))?;
            let camera = Intrinsics {
                width: image.width,
                height: image.height,
                fx: k[0],
                fy: k[4],
                cx: k[2],
                cy: k[5],
            };
            let p = numbers(&dir.join(format!("{name}.pose.txt")))?;
            let turn = Matrix3::new(p[0], p[1], p[2], p[4], p[5], p[6], p[8], p[9], p[10]);
            let turn = UnitQuaternion::from_rotation_matrix(&Rotation3::from_matrix(&turn));
            let view = View {
                stamp_ns: 0,
                cloud: camera.cloud_from_depth(&image.depths_m).map_err(|e| e.to_string())?,
                intrinsics: Some(camera),
                world_from_camera: Isometry3::from_parts(Translation3::new(p[3], p[7], p[11]), turn),
                pose_sigma_m: 0.02,
                pose_sigma_rad: 0.015,
            };
            Ok((name, view))
        })
        .collect()
}

/// Mugs of a real kitchen: with a handle, 9 to 11 cm high.
fn mug() -> ObjectModel {
    ObjectModel {
        name: "mug".into(),
        kind: "mug".into(),
        height_m: Range { low: 0.085, high: 0.115 },
        diameter_m: Some(Range { low: 0.07, high: 0.095 }),
        ..cup()
    }
}

/// Scores random draws of 1, 2, 3, 5 and 8 frames that see the table.
pub fn run(dir: &Path) -> Result<(), String> {
    let frames = frames(dir)?;
    let text = std::fs::read_to_string(dir.join("objects.json")).map_err(|e| e.to_string())?;
    let json: serde_json::Value = serde_json::from_str(&text).map_err(|e| e.to_string())?;
    let three = |v: &serde_json::Value| {
        Vector3::new(v[0].as_f64().unwrap_or(0.0), v[1].as_f64().unwrap_or(0.0), v[2].as_f64().unwrap_or(0.0))
    };
    let up = Unit::new_normalize(three(&json["table_plane_up"]));
    let table = Point3::from(three(&json["table_point"]));
    let references: Vec<Reference> = json["objects"]
        .as_array()
        .into_iter()
        .flatten()
        .map(|o| {
            let name = o["name"].as_str().unwrap_or("").to_owned();
            Reference { is_mug: name.contains("mug"), name, place: Point3::from(three(&o["centroid"])) }
        })
        .collect();
    let height = up.dot(&table.coords);
    let on_table: Vec<usize> = (0..frames.len())
        .filter(|&i| {
            let v = &frames[i].1;
            v.cloud
                .points
                .iter()
                .filter(|p| {
                    p.x.is_finite()
                        && (up.dot(&(v.world_from_camera * p.cast::<f64>()).coords) - height).abs() < 0.02
                })
                .count()
                > 60_000
        })
        .collect();
    println!("frames that see the table: {:?}", on_table.iter().map(|&i| &frames[i].0).collect::<Vec<_>>());
    println!(
        "{:>5} {:>8} {:>10} {:>10} {:>8} {:>8} {:>10} {:>9}",
        "views", "mode", "recogniser", "precision", "recall", "median", "worst cm", "left out"
    );
    let recognisers: [&dyn Recogniser; 2] = [&Published::default(), &Descry::default()];
    for views in [1, 2, 3, 5, 8] {
        let mut tallies = vec![Tally::default(); 2 * recognisers.len()];
        let mut state = views as u64;
        for _ in 0..DRAWS {
            let mut chosen = on_table.clone();
            for i in 0..views {
                state = state.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
                let j = i + (state >> 33) as usize % (chosen.len() - i);
                chosen.swap(i, j);
            }
            let drawn: Vec<View> = chosen[..views].iter().map(|&i| frames[i].1.clone()).collect();
            for (mode, sets) in
                [vec![drawn.clone()], drawn.iter().map(|v| vec![v.clone()]).collect()].into_iter().enumerate()
            {
                for set in sets {
                    let options = MergeOptions {
                        up: Some(up),
                        height_band_m: Some((height - 0.3, height + 0.5)),
                        ..Default::default()
                    };
                    let merged = merge(&set, &options).map_err(|e| e.to_string())?;
                    let left = merged.fits.iter().filter(|f| !f.used).count();
                    let scene_options = SceneOptions {
                        surface: SurfaceOptions {
                            up: Some(up),
                            height_band_m: Some((height - 0.1, height + 0.1)),
                            ..Default::default()
                        },
                        ..Default::default()
                    };
                    let Ok(scene) = segment(&merged.cloud, &merged.visibility, &scene_options) else {
                        continue;
                    };
                    for (r, recogniser) in recognisers.iter().enumerate() {
                        let percepts = recogniser.recognise(&scene, &merged.visibility, &[mug()]);
                        let tally = &mut tallies[2 * r + mode];
                        tally.left += left;
                        let mut found = vec![false; references.len()];
                        for p in &percepts {
                            let distance = |q: &Reference| {
                                let gap = q.place - p.position_m;
                                (gap - up.scale(up.dot(&gap))).norm()
                            };
                            let near = (0..references.len()).min_by(|&a, &b| {
                                distance(&references[a]).total_cmp(&distance(&references[b]))
                            });
                            let Some(near) = near.filter(|&n| distance(&references[n]) < SAME_M) else {
                                if p.label.is_some() {
                                    tally.wrong += 1;
                                    println!("   wrong: nothing there, {}", super::mosd::words(p));
                                }
                                continue;
                            };
                            if std::env::args().any(|a| a == "all") && r == 1 {
                                println!(
                                    "   {} views {}: {} at {:.0} mm, {}",
                                    views,
                                    ["merged", "single"][mode],
                                    references[near].name,
                                    1e3 * distance(&references[near]),
                                    super::mosd::words(p)
                                );
                            }
                            match (p.label.is_some(), references[near].is_mug) {
                                (true, true) if !found[near] => {
                                    found[near] = true;
                                    tally.right += 1;
                                    tally.errors.push(distance(&references[near]));
                                }
                                (true, _) => tally.wrong += 1,
                                _ => {}
                            }
                        }
                        // A mug counts where some view of the set has it in its image.
                        tally.mugs += references
                            .iter()
                            .filter(|q| q.is_mug && set.iter().any(|v| in_view(v, &q.place)))
                            .count();
                    }
                }
            }
        }
        for (r, recogniser) in recognisers.iter().enumerate() {
            for (mode, name) in ["merged", "single"].into_iter().enumerate() {
                let t = &mut tallies[2 * r + mode];
                t.errors.sort_by(f64::total_cmp);
                let median = t.errors.get(t.errors.len() / 2).copied().unwrap_or(f64::NAN);
                let worst = t.errors.last().copied().unwrap_or(f64::NAN);
                println!(
                    "{views:>5} {name:>8} {:>10} {:>10.3} {:>8.3} {:>8.1} {:>10.1} {:>9}",
                    recogniser.name(),
                    t.right as f64 / (t.right + t.wrong).max(1) as f64,
                    t.right as f64 / t.mugs.max(1) as f64,
                    1e2 * median,
                    1e2 * worst,
                    t.left
                );
            }
        }
    }
    Ok(())
}

#[derive(Clone, Default)]
struct Tally {
    right: usize,
    wrong: usize,
    mugs: usize,
    left: usize,
    errors: Vec<f64>,
}

/// True if the place with some room around it lies in the image and a return is near it.
fn in_view(view: &View, place: &Point3<f64>) -> bool {
    const ROOM_PX: f64 = 35.0;
    let q = view.world_from_camera.inverse_transform_point(place);
    let Some(camera) = view.intrinsics else { return false };
    camera.project(&q).is_some_and(|(u, v)| {
        u > ROOM_PX && v > ROOM_PX && u < camera.width as f64 - ROOM_PX && v < camera.height as f64 - ROOM_PX
    })
}
