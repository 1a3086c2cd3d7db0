//! Simulated lab with a planar laser: rays against outlines, with exact ground truth. Objects have
//! the hull area and perimeter of Modayil and Kuipers, Fig. 7.

#![allow(dead_code)]

pub mod paper;

use super::tabletop::Draws;
use descry_perception::laser::{
    Alignment, FitOptions, KnownShape, ModelFit, ObserveOptions, Occupancy, PosedScan, Scan, ShapeModel,
    SolverOptions, Space, Start, align, fit, localise, observe,
};
use descry_perception::nalgebra::{Isometry2, Point2, Vector2};
use std::f64::consts::{FRAC_PI_2, PI, TAU};

/// Shrink factor of outlines, as noise enlarges hulls.
const SHRUNK: f64 = 0.985;

/// Closed outlines, metres, around the object's own origin.
#[derive(Clone, Debug)]
pub struct Outline(pub Vec<Vec<Point2<f64>>>);

/// A rectangle with rounded corners, centimetres.
pub fn rounded(width_cm: f64, depth_cm: f64, radius_cm: f64) -> Outline {
    const STEPS: usize = 12;
    let corners = [(1.0, 1.0), (-1.0, 1.0), (-1.0, -1.0), (1.0, -1.0)];
    let arc = |(k, (sx, sy)): (usize, (f64, f64))| {
        (0..=STEPS).map(move |i| {
            let angle = FRAC_PI_2 * (k as f64 + i as f64 / STEPS as f64);
            let x = sx * (0.5 * width_cm - radius_cm) + radius_cm * angle.cos();
            let y = sy * (0.5 * depth_cm - radius_cm) + radius_cm * angle.sin();
            Point2::new(x, y) * (0.01 * SHRUNK)
        })
    };
    Outline(vec![corners.into_iter().enumerate().flat_map(arc).collect()])
}

/// Four round legs at the corners of a square, centimetres.
pub fn four_legs(apart_cm: f64, thick_cm: f64) -> Outline {
    let leg = |x: f64, y: f64| {
        let at = move |i: i32| {
            let angle = TAU * f64::from(i) / 16.0;
            Point2::new(x + 0.5 * thick_cm * angle.cos(), y + 0.5 * thick_cm * angle.sin()) * 0.01
        };
        (0..16).map(at).collect()
    };
    let half = 0.5 * apart_cm;
    Outline([(half, half), (-half, half), (-half, -half), (half, -half)].map(|(x, y)| leg(x, y)).to_vec())
}

/// Rounded rectangle with a given hull area (cm²), perimeter (cm) and corner radius.
pub fn rounded_with(area_cm2: f64, perimeter_cm: f64, radius_cm: f64) -> Outline {
    let middle = (perimeter_cm + (8.0 - TAU) * radius_cm) / 4.0;
    let longer = (middle * middle - area_cm2 - (4.0 - PI) * radius_cm * radius_cm).max(0.0).sqrt();
    rounded(middle + longer, middle - longer, radius_cm)
}

/// Five objects of the paper, in its order.
pub const NAMES: [&str; 5] = ["recycle-bin", "big-chair", "garbage-can", "red-chair", "dell-box"];

/// Corner radius of the simulated recycle-bin, centimetres, undetermined by its published area and
/// perimeter.
pub const RECYCLE_RADIUS_CM: f64 = 11.0;

/// Outline of an object.
pub fn object(index: usize) -> Outline {
    match index {
        0 => rounded_with(932.0, 113.7, RECYCLE_RADIUS_CM),
        1 => rounded(59.0, 59.0, 14.8),
        2 => rounded(31.9, 31.9, 12.2),
        3 => rounded(50.0, 50.0, 17.6),
        _ => rounded(65.4, 65.4, 5.5),
    }
}

/// Room of 7 by 6 metres with furniture, centred at the map's origin.
fn room() -> Vec<Vec<Point2<f64>>> {
    let block = |x: f64, y: f64, w: f64, h: f64| {
        vec![Point2::new(x, y), Point2::new(x + w, y), Point2::new(x + w, y + h), Point2::new(x, y + h)]
    };
    vec![
        block(-3.5, -3.0, 7.0, 6.0),
        block(-3.5, 1.8, 0.6, 1.2),
        block(2.6, -3.0, 0.9, 0.5),
        block(3.1, 0.0, 0.4, 1.5),
    ]
}

/// Distance along a ray to the nearest side of closed outlines.
fn ray<'a>(
    from: &Point2<f64>,
    along: &Vector2<f64>,
    outlines: impl Iterator<Item = &'a Vec<Point2<f64>>>,
) -> f64 {
    let mut nearest = f64::INFINITY;
    for outline in outlines {
        for (i, a) in outline.iter().enumerate() {
            let side = outline[(i + 1) % outline.len()] - a;
            let to = a - from;
            let across = along.perp(&side);
            let (t, s) = (to.perp(&side) / across, to.perp(along) / across);
            if t > 0.0 && (0.0..=1.0).contains(&s) {
                nearest = nearest.min(t);
            }
        }
    }
    nearest
}

/// The differences of a run from the paper's.
#[derive(Clone, Copy, Debug)]
pub struct Run {
    /// Minimum and maximum number of scans of an object.
    pub scans: (usize, usize),
    /// Standard deviation of the laser's stated position along each axis, metres.
    pub pose_sigma_m: f64,
    /// Standard deviation of the stated heading, radians.
    pub pose_sigma_rad: f64,
    /// Share of readings whose background subtraction comes out wrong.
    pub wrong: f64,
}

impl Default for Run {
    fn default() -> Run {
        Run { scans: (7, 8), pose_sigma_m: 0.05, pose_sigma_rad: 0.01, wrong: 0.0 }
    }
}

/// An object somewhere near the middle of the lab.
pub struct Lab {
    room: Vec<Vec<Point2<f64>>>,
    object: Vec<Vec<Point2<f64>>>,
    /// Pose of the object in the map.
    pub map_from_object: Isometry2<f64>,
}

impl Lab {
    /// Lab with an outline at a random place.
    pub fn with(outline: &Outline, draws: &mut Draws) -> Lab {
        let place = Vector2::new(draws.next() - 0.5, draws.next() - 0.5) * 0.6;
        let map_from_object = Isometry2::new(place, TAU * draws.next());
        let put = |o: &Vec<Point2<f64>>| o.iter().map(|p| map_from_object * p).collect();
        Lab { room: room(), object: outline.0.iter().map(put).collect(), map_from_object }
    }

    /// Scan of a SICK LMS 200: 180 degrees, one reading per degree, standard deviation 5 mm,
    /// centimetre resolution.
    pub fn sweep(&self, map_from_laser: &Isometry2<f64>, stated: &Isometry2<f64>, draws: &mut Draws) -> Scan {
        let angles_rad: Vec<f64> = (-90..=90).map(|d| f64::from(d).to_radians()).collect();
        let from = Point2::from(map_from_laser.translation.vector);
        let range = |angle: &f64| {
            let along = map_from_laser.rotation * Vector2::new(angle.cos(), angle.sin());
            let exact = ray(&from, &along, self.room.iter().chain(&self.object));
            ((exact + 0.005 * draws.normal()) * 100.0).round() / 100.0
        };
        let ranges_m = angles_rad.iter().map(range).collect();
        Scan { ranges_m, angles_rad, map_from_laser: *stated }
    }

    /// A pose that looks at the object from a bearing, as exactly as a robot drives.
    pub fn look_from(&self, bearing_rad: f64, draws: &mut Draws) -> Isometry2<f64> {
        let range_m = 1.2 + 0.6 * draws.next();
        let away = Vector2::new(bearing_rad.cos(), bearing_rad.sin()) * range_m;
        Isometry2::new(
            self.map_from_object.translation.vector + away,
            bearing_rad + PI + 0.1 * draws.normal(),
        )
    }

    /// Scans on a circle around the object, with their true poses.
    pub fn circle(&self, run: &Run, draws: &mut Draws) -> Vec<(Scan, Isometry2<f64>)> {
        let (least, most) = run.scans;
        let count = least + (draws.next() * (most - least + 1) as f64) as usize;
        let first = TAU * draws.next();
        (0..count)
            .map(|i| {
                let bearing = first + TAU * i as f64 / count as f64 + 0.1 * draws.normal();
                let truth = self.look_from(bearing, draws);
                let stated = run.stated(&truth, draws);
                (self.sweep(&truth, &stated, draws), truth)
            })
            .collect()
    }
}

impl Run {
    /// Pose as stated by localisation.
    pub fn stated(&self, truth: &Isometry2<f64>, draws: &mut Draws) -> Isometry2<f64> {
        let off = Vector2::new(draws.normal(), draws.normal()) * self.pose_sigma_m;
        Isometry2::new(
            truth.translation.vector + off,
            truth.rotation.angle() + self.pose_sigma_rad * draws.normal(),
        )
    }
}

/// The map of the empty lab, made by sweeps from known poses.
pub fn map_of_the_lab(draws: &mut Draws) -> Occupancy {
    const CELL_M: f64 = 0.05;
    let (width, height) = (160, 140);
    let mut map = Occupancy {
        origin: Point2::new(-4.0, -3.5),
        cell_m: CELL_M,
        width,
        cells: vec![Space::Unknown; width * height],
    };
    let lab = Lab { room: room(), object: Vec::new(), map_from_object: Isometry2::identity() };
    let index = |map: &Occupancy, p: &Point2<f64>| {
        let cell = (p - map.origin) / CELL_M;
        cell.y.floor() as usize * width + cell.x.floor() as usize
    };
    for k in 0..24 {
        let bearing = TAU * f64::from(k) / 12.0;
        let at = Vector2::new(bearing.cos(), bearing.sin()) * if k < 12 { 0.8 } else { 2.0 };
        let pose = Isometry2::new(at, bearing + if k % 2 == 0 { 0.0 } else { PI });
        let scan = lab.sweep(&pose, &pose, draws);
        for end in (0..scan.ranges_m.len()).filter_map(|i| scan.endpoint(i)) {
            let steps = (end.coords.norm() / (0.5 * CELL_M)) as usize;
            for step in 0..steps.saturating_sub(2) {
                let cell = index(&map, &(pose * (end * (step as f64 / steps as f64))));
                if map.cells[cell] == Space::Unknown {
                    map.cells[cell] = Space::Free;
                }
            }
            let cell = index(&map, &(pose * end));
            map.cells[cell] = Space::Occupied;
        }
    }
    map
}

/// Observation of an object: scans and their true poses.
pub struct Observed {
    /// Used scans at their stated poses.
    pub scans: Vec<PosedScan>,
    /// True poses of these scans.
    pub map_from_lasers: Vec<Isometry2<f64>>,
    /// Scans that were ignored.
    pub ignored: usize,
}

/// Object's readings by background subtraction, near its stated position.
pub fn observed(
    lab: &Lab,
    sweeps: &[(Scan, Isometry2<f64>)],
    map: &Occupancy,
    run: &Run,
    draws: &mut Draws,
) -> Observed {
    let near = Point2::from(lab.map_from_object.translation.vector);
    let margin_m = 0.1 + 2.0 * run.pose_sigma_m;
    let draws = std::cell::RefCell::new(draws);
    let is_background = |place: &Point2<f64>| {
        let wrong = run.wrong > 0.0 && draws.borrow_mut().next() < run.wrong;
        map.is_background(place, margin_m) != wrong
    };
    let scans: Vec<Scan> = sweeps.iter().map(|s| s.0.clone()).collect();
    let observation =
        observe(&scans, &near, is_background, &ObserveOptions::default()).expect("sweeps are sound");
    let used = |i: &usize| observation.ignored.iter().all(|(ignored, _)| ignored != i);
    Observed {
        map_from_lasers: (0..sweeps.len()).filter(used).map(|i| sweeps[i].1).collect(),
        ignored: observation.ignored.len(),
        scans: observation.scans,
    }
}

/// An object that the robot circled once.
pub fn circled(outline: &Outline, run: &Run, map: &Occupancy, seed: u64) -> (Lab, Observed) {
    let mut draws = Draws(seed);
    let lab = Lab::with(outline, &mut draws);
    let sweeps = lab.circle(run, &mut draws);
    let observed = observed(&lab, &sweeps, map, run, &mut draws);
    (lab, observed)
}

/// Observations of each of the five objects.
pub const INSTANCES: usize = 5;

/// Seed of an observation of an object in an experiment.
pub fn seed_of(experiment: u64, object: usize, instance: usize) -> u64 {
    experiment * 1000 + (object * INSTANCES + instance) as u64
}

/// Models of all observations, object by object.
pub fn models(experiment: u64, run: &Run, options: &SolverOptions) -> Vec<Alignment> {
    let map = map_of_the_lab(&mut Draws(experiment));
    let all = (0..NAMES.len()).flat_map(|k| (0..INSTANCES).map(move |i| (k, i)));
    all.map(|(k, i)| {
        let (_, observed) = circled(&object(k), run, &map, seed_of(experiment, k, i));
        align(&observed.scans, options).expect("the object was seen")
    })
    .collect()
}

/// Models with the names of their objects.
pub fn named(models: &[Alignment]) -> Vec<KnownShape> {
    let name = |i: usize| NAMES[i / INSTANCES];
    models.iter().enumerate().map(|(i, a)| KnownShape::new(name(i), a.model.clone())).collect()
}

/// Minimum and maximum f_C, and root violation per pair of scans, between instances of two objects
/// (Fig. 8), without self-comparison.
pub fn f_c_range(models: &[Alignment], a: usize, b: usize, options: &FitOptions) -> [(f64, f64); 2] {
    let mut ranges = [(f64::INFINITY, 0.0_f64); 2];
    for i in 0..INSTANCES {
        for j in 0..if a == b { i } else { INSTANCES } {
            let found = fit(&models[a * INSTANCES + i].model, &models[b * INSTANCES + j].model, options);
            for (range, value) in ranges.iter_mut().zip([found.f_c_m2, found.between.per_pair_m()]) {
                *range = (range.0.min(value), range.1.max(value));
            }
        }
    }
    ranges
}

/// Displaced scan of an instance, relocalised on another model (Fig. 9).
pub struct Relocalised {
    /// Error of the object's centre, laser frame, metres.
    pub position_m: f64,
    /// Error of the object's heading, radians.
    pub angle_rad: f64,
    /// Final fit.
    pub fit: ModelFit,
}

/// The paper's procedure: aligns the instance with the model, displaces one of its scans by
/// `paper::MOVED` and relocalises it.
pub fn relocalised(
    model: &ShapeModel,
    instance: &ShapeModel,
    scan: usize,
    options: &FitOptions,
) -> Relocalised {
    let aligned = instance.moved(&fit(model, instance, options).model_from_other);
    let posed = &aligned.scans()[scan % aligned.scans().len()];
    let pose = posed.model_from_laser;
    let [x, y, turn] = paper::MOVED;
    let shift = pose.translation.vector + Vector2::new(x, y);
    let moved = Isometry2::new(shift, pose.rotation.angle() + turn);
    let fit = localise(model, &posed.scan, Start::Near(moved), options);
    let centre = model.features().centre;
    let place = |pose: &Isometry2<f64>| pose.inverse() * centre;
    Relocalised {
        position_m: (place(&fit.model_from_other) - place(&pose)).norm(),
        angle_rad: fit.model_from_other.rotation.angle_to(&pose.rotation).abs(),
        fit,
    }
}
