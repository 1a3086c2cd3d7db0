//! Variations: fewer and more scans, wrong background subtraction, worse poses, a porous object; ICP on the
//! same data.

use super::lab::{
    INSTANCES, NAMES, Outline, Run, circled, four_legs, map_of_the_lab, named, object, seed_of,
};
use super::tabletop::Draws;
use super::{METHODS, options};
use descry_perception::hull::convex;
use descry_perception::laser::{
    Alignment, KnownShape, PosedScan, RecogniseOptions, ShapeModel, Solver, Verdict, align, align_consistent,
    recognise,
};
use descry_perception::nalgebra::{Isometry2, Isometry3, Point2, Point3, Rotation2, Vector2};
use descry_perception::register::{self, Method, RegisterOptions};

/// Maximum distance of correspondences in ICP, metres: three standard deviations of a position.
const ICP_WITHIN_M: f32 = 0.15;

/// Results of a method over many observations.
#[derive(Default)]
struct Tally {
    /// Root mean square distance of readings from their true places on the object, after the best common
    /// motion, metres.
    off_m: Vec<f64>,
    /// Area of the model's hull divided by the true area.
    area: Vec<f64>,
    exterior_m: f64,
    /// Number of alignments that report contradictory scans.
    contradicts: usize,
    right: usize,
    wrong: usize,
    unsure: usize,
}

/// Prints a row for each variation and method.
pub fn print(seed: u64, learnt: &[Alignment]) {
    let known = named(learnt);
    let base = Run::default();
    let five: Vec<Outline> = (0..NAMES.len()).map(object).collect();
    let chair = vec![four_legs(45.0, 3.0)];
    let cases: [(&str, &[Outline], Run); 8] = [
        ("as in the paper", &five, base),
        ("3 scans", &five, Run { scans: (3, 3), ..base }),
        ("30 scans", &five, Run { scans: (30, 30), ..base }),
        ("20 % wrongly subtracted", &five, Run { wrong: 0.2, ..base }),
        ("poses off by 10 cm", &five, Run { pose_sigma_m: 0.1, ..base }),
        ("a chair on four legs", &chair, base),
        ("  20 % wrongly subtracted", &chair, Run { wrong: 0.2, ..base }),
        ("  poses off by 10 cm", &chair, Run { pose_sigma_m: 0.1, ..base }),
    ];
    println!(
        "\nvariations, new observations: readings off from their place on the object (mm, rms: mean and worst), hull area over the true one,"
    );
    println!(
        "longest exterior error (cm), alignments that own to errors over 2 cm, and what the 25 models of above say of it: right, unsure or unknown, wrong"
    );
    for (name, outlines, run) in cases {
        case(seed, name, outlines, &run, &known);
    }
    legs(seed, &chair[0]);
}

/// Number of observations of a chair's legs with wrong points.
const LEGS: usize = 40;
/// Maximum error of a correct alignment, metres.
const NEAR_M: f64 = 0.03;

/// Prints results for a chair's legs with a fifth of the readings wrongly subtracted, which often removes all
/// readings of a leg.
fn legs(seed: u64, chair: &Outline) {
    let map = map_of_the_lab(&mut Draws(seed));
    let run = Run { wrong: 0.2, ..Run::default() };
    let (mut near, mut far) = (0, 0);
    for i in 0..LEGS {
        let seen = circled(chair, &run, &map, seed_of(seed + 1000, 0, i)).1;
        let Ok(found) = align_consistent(&seen.scans, CONTRADICTS_M, &options(0)) else { continue };
        let truth = true_poses(&found, &seen.map_from_lasers);
        match off_m(found.model.scans(), &truth) {
            _ if found.longest_m() > CONTRADICTS_M => {}
            off_m if off_m < NEAR_M => near += 1,
            _ => far += 1,
        }
    }
    println!(
        "of {LEGS} such observations of the chair {near} agree within {:.0} cm of the truth, {far} agree farther off, {} own that their scans contradict",
        1e2 * NEAR_M,
        LEGS - near - far
    );
}

/// The true poses of the scans used in an alignment.
fn true_poses(alignment: &Alignment, map_from_lasers: &[Isometry2<f64>]) -> Vec<Isometry2<f64>> {
    let used = |i: &usize| !alignment.left_out.contains(i);
    (0..map_from_lasers.len()).filter(used).map(|i| map_from_lasers[i]).collect()
}

/// Residual from which scans contradict each other, metres: twice the precision of the laser.
pub const CONTRADICTS_M: f64 = 0.02;

/// Maximum number of scans that are also aligned by the simplex.
const MOST_BY_SIMPLEX: usize = 8;

fn case(seed: u64, name: &str, outlines: &[Outline], run: &Run, known: &[KnownShape]) {
    let map = map_of_the_lab(&mut Draws(seed));
    // The simplex takes seconds for thirty scans; see the times.
    let methods: Vec<usize> = (0..METHODS.len())
        .filter(|m| run.scans.1 <= MOST_BY_SIMPLEX || METHODS[*m].1 == Solver::LeastSquares)
        .collect();
    let mut tallies: Vec<(&str, Tally)> = ["as localised", "ICP", "ICP, none moved far"]
        .into_iter()
        .chain(methods.iter().map(|m| METHODS[*m].0))
        .chain(["the first, consistent scans"])
        .map(|name| (name, Tally::default()))
        .collect();
    let (mut ignored, mut left_out, mut opened) = (0, 0, 0);
    for (k, i) in (0..outlines.len()).flat_map(|k| (0..INSTANCES).map(move |i| (k, i))) {
        let (_, seen) = circled(&outlines[k], run, &map, seed_of(seed + 1000, k, i));
        ignored += seen.ignored;
        let truth = Truth {
            outline: &outlines[k],
            map_from_lasers: &seen.map_from_lasers,
            name: (outlines.len() == NAMES.len()).then_some(NAMES[k]),
        };
        let mut rows = tallies.iter_mut().map(|row| &mut row.1);
        for scans in [seen.scans.clone(), by_icp(&seen.scans, f64::INFINITY), by_icp(&seen.scans, FAR)] {
            rows.next().into_iter().for_each(|row| row.add(&scans, None, &truth, known));
        }
        let mut all: Vec<_> = methods.iter().map(|m| align(&seen.scans, &options(*m))).collect();
        all.push(align_consistent(&seen.scans, CONTRADICTS_M, &options(0)));
        for (row, alignment) in rows.zip(all.iter().flatten()) {
            row.add(alignment.model.scans(), Some(alignment), &truth, known);
        }
        if let Some(Ok(consistent)) = all.last() {
            left_out += consistent.left_out.len();
            opened += consistent.opened.len();
        }
    }
    println!("{name} ({ignored} scans ignored; by the last {left_out} left out, {opened} ends opened)");
    for (method, tally) in &tallies {
        tally.print(method);
    }
}

/// Ground truth of an observation.
struct Truth<'a> {
    outline: &'a Outline,
    map_from_lasers: &'a [Isometry2<f64>],
    name: Option<&'a str>,
}

impl Tally {
    fn add(
        &mut self,
        scans: &[PosedScan],
        alignment: Option<&Alignment>,
        truth: &Truth,
        known: &[KnownShape],
    ) {
        let Ok(model) = ShapeModel::new(scans.to_vec()) else { return };
        let poses = alignment
            .map_or_else(|| truth.map_from_lasers.to_vec(), |a| true_poses(a, truth.map_from_lasers));
        self.off_m.push(off_m(scans, &poses));
        self.area.push(model.features().area_m2 / area_m2(truth.outline));
        self.exterior_m = alignment.map_or(self.exterior_m, |a| self.exterior_m.max(a.after.exterior_m));
        self.contradicts += usize::from(alignment.is_some_and(|a| a.longest_m() > CONTRADICTS_M));
        match recognise(&model, known, &RecogniseOptions::default()).verdict {
            Verdict::Is(name) if Some(name.as_str()) == truth.name => self.right += 1,
            Verdict::Is(_) => self.wrong += 1,
            // The chair is none of those known: unknown is right.
            Verdict::Unknown if truth.name.is_none() => self.right += 1,
            _ => self.unsure += 1,
        }
    }

    fn print(&self, method: &str) {
        let mean = |v: &[f64]| v.iter().sum::<f64>() / v.len() as f64;
        let worst = self.off_m.iter().copied().fold(0.0, f64::max);
        let exterior =
            if self.exterior_m > 0.0 { format!("{:.2}", 100.0 * self.exterior_m) } else { "-".into() };
        println!(
            "    {method:<27} {:>5.1} {:>5.1}   {:.3}   {exterior:>5} {:>2}   {:>2} {:>2} {:>2}",
            1e3 * mean(&self.off_m),
            1e3 * worst,
            mean(&self.area),
            self.contradicts,
            self.right,
            self.unsure,
            self.wrong
        );
    }
}

/// Area of the hull of an outline, square metres.
pub fn area_m2(outline: &Outline) -> f64 {
    let corners = convex(outline.0.concat());
    let n = corners.len();
    (0..n).map(|i| corners[i].coords.perp(&corners[(i + 1) % n].coords)).sum::<f64>() / 2.0
}

/// Root mean square distance of the readings from their true places, after the best common rigid motion,
/// metres.
pub fn off_m(scans: &[PosedScan], truth: &[Isometry2<f64>]) -> f64 {
    let pairs: Vec<(Vector2<f64>, Vector2<f64>)> = scans
        .iter()
        .zip(truth)
        .flat_map(|(s, t)| {
            s.scan.points.iter().map(move |p| ((s.model_from_laser * p).coords, (t * p).coords))
        })
        .collect();
    let n = pairs.len() as f64;
    let [from, to] = [
        pairs.iter().map(|p| p.0).sum::<Vector2<f64>>() / n,
        pairs.iter().map(|p| p.1).sum::<Vector2<f64>>() / n,
    ];
    let (sine, cosine) = pairs.iter().fold((0.0, 0.0), |(s, c), (a, b)| {
        let (a, b) = (a - from, b - to);
        (s + a.perp(&b), c + a.dot(&b))
    });
    let turn = Rotation2::new(f64::atan2(sine, cosine));
    let squares = pairs.iter().map(|(a, b)| (turn * (a - from) - (b - to)).norm_squared()).sum::<f64>();
    (squares / n).sqrt()
}

/// Number of standard deviations from which a pose is far from its stated one.
pub const FAR: f64 = 3.0;

/// Registers scan after scan onto all previous ones by point-to-point ICP; a scan that would move by more
/// than `spreads` standard deviations of its stated pose stays there.
pub fn by_icp(scans: &[PosedScan], spreads: f64) -> Vec<PosedScan> {
    let flat = |p: Point2<f64>| Point3::new(p.x as f32, p.y as f32, 0.0);
    let mut placed: Vec<PosedScan> = Vec::new();
    let mut target: Vec<Point3<f32>> = Vec::new();
    for scan in scans {
        let source: Vec<Point3<f32>> =
            scan.scan.points.iter().map(|p| flat(scan.model_from_laser * p)).collect();
        let options = RegisterOptions {
            method: Method::PointToPoint,
            within_m: ICP_WITHIN_M,
            least: 2,
            ..RegisterOptions::default()
        };
        let prepared = |points: &[Point3<f32>]| register::Prepared::new(points).ok();
        let fit = prepared(&source)
            .zip(prepared(&target))
            .and_then(|(s, t)| register::align(&s, &t, &options).ok());
        let pose = &scan.model_from_laser;
        let usual = Run::default();
        let is_near = |moved: &Isometry2<f64>| {
            let shift_m = ((moved * pose).translation.vector - pose.translation.vector).norm();
            shift_m <= spreads * usual.pose_sigma_m
                && moved.rotation.angle().abs() <= spreads * usual.pose_sigma_rad
        };
        let moved = fit.map(|fit| planar(&fit.target_from_source)).filter(is_near).unwrap_or_default();
        let posed = PosedScan { scan: scan.scan.clone(), model_from_laser: moved * scan.model_from_laser };
        target.extend(posed.scan.points.iter().map(|p| flat(posed.model_from_laser * p)));
        placed.push(posed);
    }
    placed
}

fn planar(pose: &Isometry3<f64>) -> Isometry2<f64> {
    Isometry2::new(pose.translation.vector.xy(), pose.rotation.euler_angles().2)
}
