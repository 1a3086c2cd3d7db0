//! Number of scans needed: the next scan from the most informative bearing, compared with a circle and with
//! chance.

use super::lab::{self, INSTANCES, Lab, NAMES, Run, map_of_the_lab, named, object, observed, seed_of};
use super::options;
use super::tabletop::Draws;
use super::variations::{area_m2, off_m};
use descry_perception::laser::{
    Alignment, KnownShape, NextOptions, PosedScan, RecogniseOptions, Verdict, align, next_scan, recognise,
    undetermined_m2,
};
use descry_perception::nalgebra::{Isometry2, Vector2};
use std::f64::consts::TAU;

/// Number of bearings from which the object can be scanned.
const PLACES: usize = 16;
pub const MOST: usize = 8;

/// Policy that chooses the bearing of the next scan.
#[derive(Clone, Copy, PartialEq)]
pub enum Policy {
    Settling,
    Circle,
    Chance,
}

#[derive(Clone, Copy, Default)]
struct Sum {
    off_m: f64,
    area: f64,
    open_m2: f64,
    right: usize,
}

/// Prints the remaining uncertainty after each scan.
pub fn print(seed: u64, learnt: &[Alignment]) {
    let known = named(learnt);
    println!(
        "\nscans one after the other, 25 new observations: undetermined area (cm²), area of the hull off from the true one (%), readings off (mm),"
    );
    println!(
        "named right of 25; the next scan from where it settles most | 45° farther around | anywhere of {PLACES} places"
    );
    let sums =
        [Policy::Settling, Policy::Circle, Policy::Chance].map(|policy| after_each(seed, policy, &known));
    for count in 0..MOST {
        print!("{:>2}", count + 1);
        for sum in &sums {
            let s = sum[count];
            let n = (NAMES.len() * INSTANCES) as f64;
            print!(
                "  | {:>5.0} {:>5.1} {:>5.1} {:>2}",
                1e4 * s.open_m2 / n,
                100.0 * s.area / n,
                1e3 * s.off_m / n,
                s.right
            );
        }
        println!();
    }
}

fn after_each(seed: u64, policy: Policy, known: &[KnownShape]) -> [Sum; MOST] {
    let map = map_of_the_lab(&mut Draws(seed));
    let mut sums = [Sum::default(); MOST];
    for (k, i) in (0..NAMES.len()).flat_map(|k| (0..INSTANCES).map(move |i| (k, i))) {
        let mut draws = Draws(seed_of(seed + 2000, k, i));
        let outline = object(k);
        let lab = Lab::with(&outline, &mut draws);
        let first = draws.next();
        let mut scans: Vec<PosedScan> = Vec::new();
        let mut truths: Vec<Isometry2<f64>> = Vec::new();
        let mut bearing = TAU * first;
        for sum in &mut sums {
            let truth = lab.look_from(bearing, &mut draws);
            let stated = Run::default().stated(&truth, &mut draws);
            let sweep = [(lab.sweep(&truth, &stated, &mut draws), truth)];
            let seen = observed(&lab, &sweep, &map, &Run::default(), &mut draws);
            scans.extend(seen.scans);
            truths.extend(seen.map_from_lasers);
            let Ok(alignment) = align(&scans, &options(0)) else { continue };
            let verdict = recognise(&alignment.model, known, &RecogniseOptions::default()).verdict;
            sum.right += usize::from(verdict == Verdict::Is(NAMES[k].into()));
            sum.off_m += off_m(alignment.model.scans(), &truths);
            sum.area += (alignment.model.features().area_m2 / area_m2(&outline) - 1.0).abs();
            sum.open_m2 += undetermined_m2(&alignment.model, &NextOptions::default());
            bearing = next_bearing(policy, bearing, first, &alignment, &lab, &mut draws);
        }
    }
    sums
}

/// Bearing of the next scan, radians.
pub fn next_bearing(
    policy: Policy,
    bearing: f64,
    first: f64,
    so_far: &Alignment,
    lab: &lab::Lab,
    draws: &mut Draws,
) -> f64 {
    let place = |i: usize| TAU * (first + i as f64 / PLACES as f64);
    match policy {
        Policy::Circle => bearing + TAU / MOST as f64,
        Policy::Chance => place((draws.next() * PLACES as f64) as usize),
        Policy::Settling => {
            let middle = lab.map_from_object.translation.vector;
            let poses: Vec<Isometry2<f64>> = (0..PLACES)
                .map(|i| {
                    let away = Vector2::new(place(i).cos(), place(i).sin()) * 1.5;
                    Isometry2::new(middle + away, place(i) + TAU / 2.0)
                })
                .collect();
            next_scan(&so_far.model, &poses, &NextOptions::default())
                .first()
                .map_or(bearing, |n| place(n.index))
        }
    }
}
