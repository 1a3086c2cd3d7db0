//! Posed frames of a real kitchen: random subsets merged, and recognised mugs compared with reference
//! positions.

use super::frames::frames;
use super::mosd::cup;
use descry_perception::merge::{MergeOptions, Merger};
use descry_perception::nalgebra::{Point3, Unit, Vector3};
use descry_perception::recognise::{Descry, Published, Range};
use descry_perception::segment::{SceneOptions, segment};
use descry_perception::surface::SurfaceOptions;
use descry_perception::{ObjectModel, Recogniser, View};
use std::path::Path;

const DRAWS: u64 = 20;
/// Maximum distance of a mug from its reference, metres.
const SAME_M: f64 = 0.08;

struct Reference {
    name: String,
    place: Point3<f64>,
    is_mug: bool,
}

/// Mugs of a real kitchen: with a handle, 9 to 11 cm high.
pub fn mug() -> ObjectModel {
    ObjectModel {
        name: "mug".into(),
        kind: "mug".into(),
        height_m: Range { low: 0.085, high: 0.115 },
        diameter_m: Some(Range { low: 0.07, high: 0.095 }),
        ..cup()
    }
}

/// Reference data of the table and the objects on it.
pub struct ReferenceTable {
    up: Unit<Vector3<f64>>,
    /// Height along `up`, metres.
    height: f64,
    objects: Vec<Reference>,
}

impl ReferenceTable {
    pub fn read(dir: &Path) -> Result<ReferenceTable, String> {
        let text = std::fs::read_to_string(dir.join("objects.json")).map_err(|e| e.to_string())?;
        let json: serde_json::Value = serde_json::from_str(&text).map_err(|e| e.to_string())?;
        let three = |v: &serde_json::Value| Vector3::from([0, 1, 2].map(|k| v[k].as_f64().unwrap_or(0.0)));
        let up = Unit::new_normalize(three(&json["table_plane_up"]));
        let reference = |o: &serde_json::Value| {
            let name = o["name"].as_str().unwrap_or("").to_owned();
            Reference { is_mug: name.contains("mug"), name, place: Point3::from(three(&o["centroid"])) }
        };
        let objects = json["objects"].as_array().into_iter().flatten().map(reference).collect();
        Ok(ReferenceTable { up, height: up.dot(&three(&json["table_point"])), objects })
    }

    /// Surface options for the table's height, within a decimetre.
    pub fn surface(&self) -> SurfaceOptions {
        let height_band_m = Some((self.height - 0.1, self.height + 0.1));
        SurfaceOptions { up: Some(self.up), height_band_m, ..SurfaceOptions::default() }
    }

    fn is_seen_by(&self, view: &View) -> bool {
        let height = |p: &Point3<f32>| self.up.dot(&(view.world_from_camera * p.cast::<f64>()).coords);
        let on = |p: &&Point3<f32>| p.x.is_finite() && (height(p) - self.height).abs() < 0.02;
        view.cloud.points.iter().filter(on).count() > 60_000
    }

    /// Distance parallel to the table, metres.
    fn distance(&self, reference: &Reference, place: &Point3<f64>) -> f64 {
        let gap = reference.place - place;
        (gap - self.up.scale(self.up.dot(&gap))).norm()
    }

    fn nearest(&self, place: &Point3<f64>) -> Option<usize> {
        let distance = |n: &usize| self.distance(&self.objects[*n], place);
        let nearest = (0..self.objects.len()).min_by(|a, b| distance(a).total_cmp(&distance(b)));
        nearest.filter(|n| distance(n) < SAME_M)
    }
}

/// Scores random draws of 1, 2, 3, 5 and 8 frames that see the table.
pub fn run(dir: &Path) -> Result<(), String> {
    let frames = frames(dir)?;
    let table = ReferenceTable::read(dir)?;
    let on_table: Vec<usize> = (0..frames.len()).filter(|&i| table.is_seen_by(&frames[i].1)).collect();
    println!("frames that see the table: {:?}", on_table.iter().map(|&i| &frames[i].0).collect::<Vec<_>>());
    println!(
        "{:>5} {:>8} {:>10} {:>10} {:>8} {:>8} {:>10} {:>9}",
        "views", "mode", "recogniser", "precision", "recall", "median", "worst cm", "left out"
    );
    let recognisers: [&dyn Recogniser; 2] = [&Published::default(), &Descry::default()];
    for views in [1, 2, 3, 5, 8] {
        let mut tallies = [[Tally::default(), Tally::default()], [Tally::default(), Tally::default()]];
        let mut state = views as u64;
        for _ in 0..DRAWS {
            let mut chosen = on_table.clone();
            for i in 0..views {
                state = state.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
                let j = i + (state >> 33) as usize % (chosen.len() - i);
                chosen.swap(i, j);
            }
            let drawn: Vec<View> = chosen[..views].iter().map(|&i| frames[i].1.clone()).collect();
            score(&drawn, &table, &recognisers, &mut tallies[0])?;
            for view in drawn {
                score(&[view], &table, &recognisers, &mut tallies[1])?;
            }
        }
        for (r, recogniser) in recognisers.iter().enumerate() {
            for (mode, name) in ["merged", "single"].into_iter().enumerate() {
                let row = tallies[mode][r].row();
                println!("{views:>5} {name:>8} {:>10} {row}", recogniser.name());
            }
        }
    }
    Ok(())
}

/// Merges a set of views and scores each recogniser on it.
fn score(
    set: &[View],
    table: &ReferenceTable,
    recognisers: &[&dyn Recogniser],
    tallies: &mut [Tally],
) -> Result<(), String> {
    let height_band_m = Some((table.height - 0.3, table.height + 0.5));
    let options = MergeOptions { up: Some(table.up), height_band_m, ..Default::default() };
    let merged = Merger::default().merge(set, &options).map_err(|e| e.to_string())?;
    let scene_options = SceneOptions { surface: table.surface(), ..Default::default() };
    let Ok(scene) = segment(&merged.cloud, &merged.visibility, &scene_options) else { return Ok(()) };
    for (recogniser, tally) in recognisers.iter().zip(tallies) {
        tally.left += merged.fits.iter().filter(|f| !f.used).count();
        let mut found = vec![false; table.objects.len()];
        for p in recogniser.recognise(&scene, &merged.visibility, &[mug()]) {
            let near = table.nearest(&p.position_m);
            if std::env::args().any(|a| a == "all") {
                let name = near.map_or("nothing there", |n| table.objects[n].name.as_str());
                println!("   {} views, {}: {name}, {}", set.len(), recogniser.name(), super::mosd::words(&p));
            }
            match near.filter(|&n| table.objects[n].is_mug && !found[n]) {
                _ if p.label.is_none() => {}
                Some(n) => {
                    found[n] = true;
                    tally.right += 1;
                    tally.errors.push(table.distance(&table.objects[n], &p.position_m));
                }
                None => tally.wrong += 1,
            }
        }
        // A mug counts where some view of the set has it well in its image, and where it was found.
        let counts = |(q, found): &(&Reference, &bool)| {
            q.is_mug && (**found || set.iter().any(|v| in_view(v, &q.place)))
        };
        tally.mugs += table.objects.iter().zip(&found).filter(counts).count();
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

impl Tally {
    fn row(&mut self) -> String {
        self.errors.sort_by(f64::total_cmp);
        let median = self.errors.get(self.errors.len() / 2).copied().unwrap_or(f64::NAN);
        let worst = self.errors.last().copied().unwrap_or(f64::NAN);
        format!(
            "{:>10.3} {:>8.3} {:>8.1} {:>10.1} {:>9}",
            self.right as f64 / (self.right + self.wrong).max(1) as f64,
            self.right as f64 / self.mugs.max(1) as f64,
            1e2 * median,
            1e2 * worst,
            self.left
        )
    }
}

/// True if the place lies in the image with a margin and has a return near it.
fn in_view(view: &View, place: &Point3<f64>) -> bool {
    const ROOM_PX: f64 = 35.0;
    let q = view.world_from_camera.inverse_transform_point(place);
    let Some(camera) = view.intrinsics else { return false };
    camera.project(&q).is_some_and(|(u, v)| {
        u > ROOM_PX && v > ROOM_PX && u < camera.width as f64 - ROOM_PX && v < camera.height as f64 - ROOM_PX
    })
}
