//! Worlds that violate the model assumptions: other cameras, holes, and vessels without a model.

use super::mosd::words;
use super::table::{Known, arrangement, judge, options, picture, strewn};
use super::tabletop::device::{Device, KINECT};
use super::tabletop::{Draws, Thing, disturbed, on_ring};
use descry_perception::calibration::{Claim, reliability};
use descry_perception::merge::Merger;
use descry_perception::recognise::Descry;
use descry_perception::{Intrinsics, Percept, View};
use rayon::prelude::*;
use std::path::Path;

/// Numbers of views after which the result is judged.
const VIEWS: [usize; 5] = [1, 2, 3, 5, 8];
/// Confidence that the agent requires for a yes.
const SURE: f64 = 0.8;

/// Maximum distance at which a percept is attributed to an object, metres.
const NEAR_M: f64 = 0.06;

/// A world: its name, its camera, and its generator of objects.
type World = (&'static str, Device, fn(&mut Draws) -> Vec<Known>);

fn worlds() -> Vec<World> {
    let noisy =
        Device { axial: KINECT.axial.map(|a| 2.0 * a), lateral_px: 2.0 * KINECT.lateral_px, ..KINECT };
    let holed = Device { holes: 0.1, ..KINECT };
    let coarse = Intrinsics { width: 320, height: 240, fx: 285.0, fy: 285.0, cx: 159.5, cy: 119.5 };
    let flight = Device {
        camera: Intrinsics { width: 512, height: 424, fx: 366.0, fy: 366.0, cx: 255.5, cy: 211.5 },
        axial: [0.003, 0.001],
        base_m: None,
        ..KINECT
    };
    vec![
        ("matched", KINECT, arrangement),
        ("twice the noise", noisy, arrangement),
        ("holes of 10 %", holed, arrangement),
        ("320 x 240", Device { camera: coarse, ..KINECT }, arrangement),
        ("time of flight", flight, arrangement),
        ("vessels", KINECT, vessels),
        ("vessels, noise, holes", Device { holes: 0.1, ..noisy }, vessels),
        ("lying", KINECT, lying),
        ("lying, noise, holes", Device { holes: 0.1, ..noisy }, lying),
    ]
}

const BOWL: &[[f64; 2]] = &[[0.0, 0.03], [0.01, 0.045], [0.025, 0.06], [0.045, 0.068], [0.06, 0.07]];
const BOTTLE: &[[f64; 2]] = &[[0.0, 0.037], [0.15, 0.037], [0.18, 0.03], [0.2, 0.015], [0.26, 0.014]];
const JUG: &[[f64; 2]] = &[[0.0, 0.045], [0.06, 0.055], [0.13, 0.045], [0.17, 0.05]];
const VASE: &[[f64; 2]] = &[[0.0, 0.025], [0.05, 0.042], [0.09, 0.04], [0.13, 0.024], [0.16, 0.035]];
const BARREL: &[[f64; 2]] = &[[0.0, 0.034], [0.025, 0.041], [0.05, 0.044], [0.075, 0.041], [0.1, 0.034]];
const GLASS: &[[f64; 2]] = &[[0.0, 0.026], [0.11, 0.037]];

/// Two cups of each kind among vessels of varied size.
fn vessels(draws: &mut Draws) -> Vec<Known> {
    strewn(draws, [1.2, 0.6], 0..10, |kind, x, y, draws| {
        let scale = 0.85 + 0.3 * draws.next();
        let turn = std::f64::consts::TAU * draws.next();
        let vessel = |knots, open, handle_rad, spout| {
            (Thing::Turned { x, y, knots, scale, open, handle_rad, spout }, None)
        };
        let cup = |radius, height| Thing::Cup { x, y, radius, height, handle_rad: None };
        match kind {
            0 | 1 => (cup(0.035, 0.104), Some("cup A")),
            2 | 3 => (cup(0.044, 0.155), Some("cup B")),
            4 => vessel(BOWL, true, None, false),
            5 => vessel(BOTTLE, false, None, false),
            6 => vessel(JUG, true, Some(turn), true),
            7 => vessel(VASE, true, None, false),
            8 => vessel(BARREL, true, Some(turn), false),
            _ => vessel(GLASS, true, None, false),
        }
    })
}

/// Two cups of each kind lying on their sides, among tins and cartons of the same size, a mug and a standing
/// cup.
fn lying(draws: &mut Draws) -> Vec<Known> {
    strewn(draws, [1.2, 0.6], 0..10, |kind, x, y, draws| {
        let turn_rad = std::f64::consts::TAU * draws.next();
        let (small, large) = ((0.035, 0.104), (0.044, 0.155));
        let lies = |(radius, height), open, handle| Thing::Lying {
            x,
            y,
            radius,
            height,
            towards_rad: turn_rad,
            open,
            handle,
        };
        let carton = |(radius, height): (f64, f64)| {
            let half = [0.5 * height, radius];
            Thing::Block { x, y, half, height: 2.0 * radius, turn_rad }
        };
        match kind {
            0 | 1 => (lies(small, true, false), Some("cup A")),
            2 | 3 => (lies(large, true, false), Some("cup B")),
            4 => (lies(small, false, false), None),
            5 => (lies(large, false, false), None),
            6 => (carton(small), None),
            7 => (carton(large), None),
            8 => (lies((0.042, 0.095), true, true), None),
            _ => (Thing::Cup { x, y, radius: small.0, height: small.1, handle_rad: None }, Some("cup A")),
        }
    })
}

/// Score after a number of views.
#[derive(Clone, Default)]
struct Tally {
    right: usize,
    wrong: usize,
    sure_wrong: usize,
    cups: usize,
    claims: Vec<Claim>,
}

impl Tally {
    /// Scores percepts against the objects; returns a line for each error.
    fn score(&mut self, things: &[Known], percepts: &[Percept]) -> Vec<String> {
        self.cups += things.iter().filter(|t| t.1.is_some()).count();
        let mut found = vec![false; things.len()];
        let mut wrongs = Vec::new();
        for p in percepts {
            let off = |(t, _): &Known| (t.place().0 - p.position_m.x).hypot(t.place().1 - p.position_m.y);
            let near = (0..things.len()).min_by(|&a, &b| off(&things[a]).total_cmp(&off(&things[b])));
            let owner = near.filter(|&i| off(&things[i]) < NEAR_M);
            let Some((name, sure)) = p.probabilities.iter().max_by(|a, b| a.1.total_cmp(&b.1)) else {
                continue;
            };
            let right = owner.is_some_and(|i| things[i].1 == Some(name.as_str()) && !found[i]);
            self.claims.push((*sure, right));
            if p.label.is_some() {
                self.right += usize::from(right);
                self.wrong += usize::from(!right);
                self.sure_wrong += usize::from(!right && *sure >= SURE);
                owner.filter(|_| right).into_iter().for_each(|i| found[i] = true);
            }
            if right != p.label.is_some() {
                let what = owner.map(|i| things[i].0);
                wrongs.push(format!("{what:?} called {:?} with {sure:.2}: {}", p.label, words(p)));
            }
        }
        let missed = things.iter().zip(&found).filter(|(t, found)| t.1.is_some() && !**found);
        wrongs.extend(missed.map(|(t, _)| format!("not found: {:?}", t.0)));
        wrongs
    }

    fn add(&mut self, other: Tally) {
        self.right += other.right;
        self.wrong += other.wrong;
        self.sure_wrong += other.sure_wrong;
        self.cups += other.cups;
        self.claims.extend(other.claims);
    }
}

/// Runs `count` arrangements from a seed on, in the worlds whose names begin with `only` (all: ""); errors
/// are printed, and drawn to `out`.
pub fn run(count: u64, first_seed: u64, only: &str, out: Option<&Path>) -> Result<(), String> {
    if let Some(dir) = out {
        std::fs::create_dir_all(dir).map_err(|e| format!("{}: {e}", dir.display()))?;
    }
    println!(
        "{:22} {:>5} {:>9} {:>7} {:>5} {:>9} {:>6} {:>6} {:>6}",
        "world", "views", "precision", "recall", "false", "false, .8", "Brier", "ECE", "claims"
    );
    for world in worlds().into_iter().filter(|w| w.0.starts_with(only)) {
        let each: Vec<Vec<Tally>> = (first_seed..first_seed + count)
            .into_par_iter()
            .map(|seed| one(&world, seed, out))
            .collect::<Result<_, String>>()?;
        let mut tallies = vec![Tally::default(); VIEWS.len()];
        each.into_iter().for_each(|of| tallies.iter_mut().zip(of).for_each(|(sum, t)| sum.add(t)));
        for (views, t) in VIEWS.iter().zip(&tallies) {
            let told = reliability(&t.claims, 10);
            println!(
                "{:22} {views:>5} {:>9.3} {:>7.3} {:>5} {:>9} {:>6.4} {:>6.4} {:>6}",
                world.0,
                t.right as f64 / (t.right + t.wrong).max(1) as f64,
                t.right as f64 / t.cups.max(1) as f64,
                t.wrong,
                t.sure_wrong,
                told.brier,
                told.expected_error,
                told.count
            );
        }
    }
    Ok(())
}

fn one((name, device, strewn): &World, seed: u64, out: Option<&Path>) -> Result<Vec<Tally>, String> {
    let mut draws = Draws(seed);
    let things = strewn(&mut draws);
    let bare: Vec<Thing> = things.iter().map(|t| t.0).collect();
    let start = std::f64::consts::TAU * draws.next();
    let most = VIEWS[VIEWS.len() - 1];
    // Eighths of the ring in an order by which the first five lie around it.
    let (truths, views): (Vec<_>, Vec<View>) = (0..most)
        .map(|i| {
            let angle =
                start + std::f64::consts::TAU * ((3 * i % most) as f64 + 0.3 * draws.next()) / most as f64;
            let truth = on_ring(angle, 1.2 + 0.4 * draws.next(), 1.3 + 0.2 * draws.next());
            let stated = disturbed(&truth, 0.03, 0.035, &mut draws);
            (truth, device.look(&bare, &truth, &stated, &mut draws))
        })
        .unzip();
    let after = |&n: &usize| {
        let merged = Merger::default().merge(&views[..n], &options()).map_err(|e| e.to_string())?;
        // Where localisation has the table is not asked here: what is said is laid on the truth by where a view stood.
        let kept = merged.fits.iter().position(|fit| fit.used).unwrap_or_default();
        let truth_from_merged = truths[kept] * merged.fits[kept].world_from_camera.inverse();
        let merged = merged.moved(&truth_from_merged);
        let percepts = judge(&merged, &Descry::default())?;
        let mut tally = Tally::default();
        let wrongs = tally.score(&things, &percepts);
        wrongs.iter().for_each(|wrong| eprintln!("{name}, seed {seed}, {n} views: {wrong}"));
        if let Some(dir) = out.filter(|_| !wrongs.is_empty()) {
            let name = name.replace([' ', ',', '%'], "-");
            picture(&dir.join(format!("{name}-{seed}-{n}.png")), &merged.cloud, &percepts)?;
        }
        Ok(tally)
    };
    VIEWS.iter().map(after).collect()
}
