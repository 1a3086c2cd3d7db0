//! Figure 4 of paper 004 on simulated tables: four cups of two kinds, a mug with a handle, a large box and
//! other objects; five poses around.

use super::mosd::words;
use super::tabletop::{Draws, TABLE_M, Thing, disturbed, look, on_ring};
use descry_perception::calibration::reliability;
use descry_perception::merge::{MergeOptions, merge};
use descry_perception::nalgebra::{Point3, Unit, Vector3};
use descry_perception::picture::{PictureOptions, png};
use descry_perception::recognise::{Descry, Handle, Published, Range, Top};
use descry_perception::segment::{SceneOptions, segment};
use descry_perception::surface::SurfaceOptions;
use descry_perception::{Merged, ObjectModel, Percept, Recogniser, View};
use std::path::Path;

const POSES: usize = 5;

fn model(name: &str, kind: &str, diameter: f64, height: f64, top: Top, handle: Handle) -> ObjectModel {
    let exactly = |x: f64| Range { low: x, high: x };
    ObjectModel {
        name: name.into(),
        kind: kind.into(),
        phrases: Vec::new(),
        colours: Vec::new(),
        shape: Default::default(),
        height_m: exactly(height),
        diameter_m: Some(exactly(diameter)),
        width_m: None,
        depth_m: None,
        taper: Range { low: 0.95, high: 1.05 },
        top,
        handle,
    }
}

/// The known objects of paper 004.
pub fn models() -> Vec<ObjectModel> {
    vec![
        model("cup A", "cup", 0.070, 0.104, Top::Open, Handle::None),
        model("cup B", "cup", 0.088, 0.155, Top::Open, Handle::None),
    ]
}

/// An object, with its name if it is a cup.
pub type Known = (Thing, Option<&'static str>);

/// Places objects at random within a part of the table, metres, two centimetres apart; objects without room
/// are left out.
pub fn strewn<K: Copy>(
    draws: &mut Draws,
    [length_m, width_m]: [f64; 2],
    kinds: impl IntoIterator<Item = K>,
    thing: impl Fn(K, f64, f64, &mut Draws) -> Known,
) -> Vec<Known> {
    let mut placed: Vec<Known> = Vec::new();
    for kind in kinds {
        for _ in 0..200 {
            let (x, y) = (length_m * (draws.next() - 0.5), width_m * (draws.next() - 0.5));
            let drawn = thing(kind, x, y, draws);
            if placed.iter().all(|(other, _)| drawn.0.gap_m(other) > 0.02) {
                placed.push(drawn);
                break;
            }
        }
    }
    placed
}

pub fn arrangement(draws: &mut Draws) -> Vec<Known> {
    strewn(draws, [1.1, 0.5], [0, 0, 1, 1, 2, 3, 4, 5], |kind, x, y, draws| {
        let turn = std::f64::consts::TAU * draws.next();
        match kind {
            0 => (Thing::Cup { x, y, radius: 0.035, height: 0.104, handle_rad: None }, Some("cup A")),
            1 => (Thing::Cup { x, y, radius: 0.044, height: 0.155, handle_rad: None }, Some("cup B")),
            2 => (Thing::Cup { x, y, radius: 0.04, height: 0.095, handle_rad: Some(turn) }, None),
            3 => (Thing::Block { x, y, half: [0.1, 0.06], height: 0.25, turn_rad: turn }, None),
            4 => (Thing::Block { x, y, half: [0.035, 0.035], height: 0.1, turn_rad: turn }, None),
            _ => (Thing::Tin { x, y, radius: 0.036, height: 0.11 }, None),
        }
    })
}

#[derive(Clone, Default)]
struct Tally {
    right: usize,
    wrong: usize,
    cups: usize,
    mugs_called_cup: usize,
    errors: Vec<f64>,
    claims: Vec<(f64, bool)>,
}

/// Scores arrangements with seeds 1 to `count`; pictures of the first three are written to `out`.
pub fn run(count: u64, out: Option<&Path>) -> Result<(), String> {
    if let Some(dir) = out {
        std::fs::create_dir_all(dir).map_err(|e| format!("{}: {e}", dir.display()))?;
    }
    let recognisers: [&dyn Recogniser; 2] = [&Published::default(), &Descry::default()];
    // By recogniser, mode (merged, single), number of views.
    let mut tallies = vec![vec![vec![Tally::default(); POSES]; 2]; recognisers.len()];
    let (mut left_out, mut merge_ms) = (0, Vec::new());
    for seed in 1..=count {
        let mut draws = Draws(seed);
        let things = arrangement(&mut draws);
        let views = around(&things, &mut draws);
        for n in 1..=POSES {
            for (mode, set) in [&views[..n], &views[n - 1..n]].into_iter().enumerate() {
                let clock = std::time::Instant::now();
                let merged = merge(set, &options()).map_err(|e| e.to_string())?;
                if mode == 0 && n == POSES {
                    merge_ms.push(clock.elapsed().as_secs_f64() * 1e3);
                    for fit in merged.fits.iter().filter(|f| !f.used) {
                        println!("seed {seed}: {}", fit.why);
                        left_out += 1;
                    }
                }
                for (r, recogniser) in recognisers.iter().enumerate() {
                    let percepts = judge(&merged, *recogniser)?;
                    let loud = r == 1 && mode == 0 && n == POSES;
                    score(&things, &percepts, &mut tallies[r][mode][n - 1], loud.then_some(seed));
                    if let Some(dir) = out.filter(|_| loud && seed <= 3) {
                        let before = set.iter().fold(descry_perception::Cloud::default(), |mut all, v| {
                            all.append(&v.cloud.finite().transformed(&v.world_from_camera));
                            all
                        });
                        picture(&dir.join(format!("seed-{seed}-before.png")), &before, &[])?;
                        picture(&dir.join(format!("seed-{seed}-after.png")), &merged.cloud, &percepts)?;
                    }
                }
            }
        }
    }
    report(&recognisers, &tallies);
    merge_ms.sort_by(f64::total_cmp);
    println!(
        "five views merged in {:.0} ms (median); {left_out} of {} views left out",
        merge_ms[merge_ms.len() / 2],
        5 * count
    );
    Ok(())
}

pub fn options() -> MergeOptions {
    MergeOptions {
        up: Some(Unit::new_normalize(Vector3::z())),
        height_band_m: Some((0.5, 1.2)),
        ..MergeOptions::default()
    }
}

/// Views of objects from poses around their table, with localisation errors.
fn around(things: &[Known], draws: &mut Draws) -> Vec<View> {
    let bare: Vec<Thing> = things.iter().map(|t| t.0).collect();
    let start = std::f64::consts::TAU * draws.next();
    let view = |i: usize| {
        let angle = start + std::f64::consts::TAU * (i as f64 + 0.3 * draws.next()) / POSES as f64;
        let truth = on_ring(angle, 1.2 + 0.4 * draws.next(), 1.3 + 0.2 * draws.next());
        let stated = disturbed(&truth, 0.03, 0.035, draws);
        look(&bare, &truth, &stated, draws)
    };
    (0..POSES).map(view).collect()
}

/// Views of an arrangement.
pub fn views(seed: u64) -> Vec<View> {
    let mut draws = Draws(seed);
    let things = arrangement(&mut draws);
    around(&things, &mut draws)
}

/// One view of an arrangement.
pub fn view(seed: u64) -> View {
    let mut draws = Draws(seed);
    let things: Vec<Thing> = arrangement(&mut draws).iter().map(|t| t.0).collect();
    let pose = on_ring(std::f64::consts::TAU * draws.next(), 1.4, 1.4);
    look(&things, &pose, &pose, &mut draws)
}

/// Surface options for a horizontal surface at table height.
pub fn surface() -> SurfaceOptions {
    SurfaceOptions {
        up: Some(Unit::new_normalize(Vector3::z())),
        height_band_m: Some((0.5, 0.9)),
        ..SurfaceOptions::default()
    }
}

pub fn judge(merged: &Merged, recogniser: &dyn Recogniser) -> Result<Vec<Percept>, String> {
    let scene_options = SceneOptions { surface: surface(), ..SceneOptions::default() };
    match segment(&merged.cloud, &merged.visibility, &scene_options) {
        Ok(scene) => Ok(recogniser.recognise(&scene, &merged.visibility, &models())),
        Err(_) => Ok(Vec::new()),
    }
}

fn score(things: &[Known], percepts: &[Percept], tally: &mut Tally, seed: Option<u64>) {
    tally.cups += things.iter().filter(|t| t.1.is_some()).count();
    let mut found = vec![false; things.len()];
    for p in percepts {
        let off = |t: &Thing| (t.place().0 - p.position_m.x).hypot(t.place().1 - p.position_m.y);
        let near = (0..things.len()).min_by(|&a, &b| off(&things[a].0).total_cmp(&off(&things[b].0)));
        // Localisation of a single view errs by several centimetres.
        let owner = near.filter(|&i| off(&things[i].0) < 0.15);
        let truth = owner.and_then(|i| things[i].1);
        let cup: f64 = p.probability_of("cup");
        tally.claims.push((cup, truth.is_some()));
        let wrong = match (&p.label, owner, truth) {
            (Some(_), Some(i), Some(_)) if !found[i] => {
                found[i] = true;
                tally.right += 1;
                tally.errors.push(off(&things[i].0));
                false
            }
            (Some(_), Some(i), _) => {
                tally.wrong += 1;
                let mug = matches!(things[i].0, Thing::Cup { handle_rad: Some(_), .. });
                tally.mugs_called_cup += usize::from(mug);
                true
            }
            (Some(_), None, _) => {
                tally.wrong += 1;
                true
            }
            (None, _, _) => truth.is_some(),
        };
        if let Some(seed) = seed.filter(|_| wrong) {
            println!("seed {seed}: {:?} called {:?}: {}", owner.map(|i| things[i].0), p.label, words(p));
        }
    }
    for (i, thing) in things.iter().enumerate().filter(|(i, t)| t.1.is_some() && !found[*i]) {
        if let Some(seed) = seed {
            println!("seed {seed}: not found {i} {:?}", thing.0);
        }
    }
}

fn report(recognisers: &[&dyn Recogniser], tallies: &[Vec<Vec<Tally>>]) {
    println!(
        "{:>10} {:>7} {:>5} {:>9} {:>7} {:>8} {:>9} {:>9} {:>6}",
        "recogniser", "mode", "views", "precision", "recall", "mug=cup", "median cm", "95 % cm", "Brier"
    );
    for (r, recogniser) in recognisers.iter().enumerate() {
        for (mode, name) in ["merged", "single"].into_iter().enumerate() {
            for (n, t) in tallies[r][mode].iter().enumerate() {
                let mut errors = t.errors.clone();
                errors.sort_by(f64::total_cmp);
                let at = |share: f64| {
                    errors.get((errors.len() as f64 * share) as usize).map_or(f64::NAN, |e| 1e2 * e)
                };
                println!(
                    "{:>10} {name:>7} {:>5} {:>9.3} {:>7.3} {:>8} {:>9.1} {:>9.1} {:>6.3}",
                    recogniser.name(),
                    n + 1,
                    t.right as f64 / (t.right + t.wrong).max(1) as f64,
                    t.right as f64 / t.cups.max(1) as f64,
                    t.mugs_called_cup,
                    at(0.5),
                    at(0.95),
                    reliability(&t.claims, 10).brier
                );
            }
        }
    }
    let all: Vec<(f64, bool)> = tallies[1].iter().flatten().flat_map(|t| t.claims.clone()).collect();
    println!("reliability of `descry` over all views and modes:");
    for bin in reliability(&all, 10).bins {
        println!(
            "  {:.1}-{:.1}: {:5} claims, stated {:.2}, came true {:.2}",
            bin.low, bin.high, bin.count, bin.stated, bin.came_true
        );
    }
}

/// Picture of a cloud, coloured by percept.
pub fn picture(path: &Path, cloud: &descry_perception::Cloud, percepts: &[Percept]) -> Result<(), String> {
    let mut labels = vec![0_u32; cloud.len()];
    for (number, p) in percepts.iter().enumerate() {
        let label = 1 + number as u32;
        p.indices.iter().for_each(|&i| labels[i as usize] = label);
    }
    let options = PictureOptions { target: Point3::new(0.0, 0.0, TABLE_M), ..PictureOptions::default() };
    let bytes = png(cloud, &labels, &options).map_err(|e| e.to_string())?;
    std::fs::write(path, bytes).map_err(|e| format!("{}: {e}", path.display()))
}
