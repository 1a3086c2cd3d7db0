//! Shape models from laser scans: the cells of the paper's tables, and failure cases.

use crate::lab;
use crate::lab::{
    INSTANCES, NAMES, Run, circled, f_c_range, four_legs, map_of_the_lab, models, object, paper, relocalised,
    seed_of,
};
use crate::tabletop::Draws;
use descry_perception::laser::{
    Alignment, FitOptions, Ignored, KnownShape, NextOptions, ObjectScan, Objective, Observation,
    ObserveError, ObserveOptions, Occupancy, PosedScan, RecogniseOptions, Scan, ScanError, ShapeError,
    ShapeModel, Solver, SolverOptions, Space, Start, Verdict, align, align_consistent, classes, groups,
    localise, nearest, next_scan, observe, recognise, recognise_scan, undetermined_m2,
};
use descry_perception::nalgebra::{Isometry2, Point2};
use std::f64::consts::{PI, TAU};
use std::path::Path;
use std::sync::OnceLock;

const EXPERIMENT: u64 = 7;

/// 25 models of one experiment.
fn learnt() -> &'static [Alignment] {
    static LEARNT: OnceLock<Vec<Alignment>> = OnceLock::new();
    LEARNT.get_or_init(|| models(EXPERIMENT, &Run::default(), &SolverOptions::default()))
}

fn instance(object: usize, instance: usize) -> &'static ShapeModel {
    &learnt()[object * INSTANCES + instance].model
}

fn known() -> Vec<KnownShape> {
    (0..NAMES.len()).map(|k| KnownShape::new(NAMES[k], instance(k, 0).clone())).collect()
}

fn mean(values: impl Iterator<Item = f64> + Clone) -> f64 {
    values.clone().sum::<f64>() / values.count() as f64
}

/// The table of `lab/paper.rs` agrees with the paper's text.
#[test]
#[ignore = "data: the paper in ../shared/papers"]
fn the_table_is_that_of_the_paper() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../shared/papers");
    let files = std::fs::read_dir(folder).into_iter().flatten().flatten().map(|entry| entry.path());
    let texts = files.filter_map(|path| std::fs::read_to_string(path).ok());
    let text = texts.into_iter().find(|text| text.starts_with("Autonomous Shape Model Learning"));
    let text = text.expect("the paper is in ../shared/papers");
    // The numbers of each row below a heading; what is no number parts them.
    let rows = |heading: &str| -> Vec<Vec<f64>> {
        let below = text.lines().skip_while(|line| !line.starts_with(heading)).skip(1);
        let rows = below.take_while(|line| line.contains('\t')).map(|line| {
            let cells = line.split('\t').skip(1).flat_map(|cell| cell.split(['-', '–']));
            cells.filter_map(|cell| cell.parse().ok()).collect()
        });
        rows.filter(|row: &Vec<f64>| !row.is_empty()).collect()
    };
    let features: Vec<Vec<f64>> = paper::FEATURES.iter().map(|row| row.to_vec()).collect();
    assert_eq!(rows("Feature Reliability"), features);
    let f_c: Vec<Vec<f64>> =
        paper::F_C.iter().map(|row| row.iter().flat_map(|&(low, high)| [low, high]).collect()).collect();
    assert_eq!(rows("f_C error"), f_c);
    let localisation: Vec<Vec<f64>> = paper::LOCALISATION.iter().flatten().map(|row| row.to_vec()).collect();
    assert_eq!(rows("Error\tLocalization"), localisation);
}

/// Fig. 5.
#[test]
fn no_exterior_error_is_a_centimetre_after_alignment() {
    for (i, a) in learnt().iter().enumerate() {
        let name = NAMES[i / INSTANCES];
        assert!(a.converged && a.iterations > 0, "{name}: {a:?}");
        assert!(a.after.boundary_m2 < 0.01 * a.before.boundary_m2, "{name}: {:?} {:?}", a.before, a.after);
        assert!(a.after.exterior_m < paper::EXTERIOR_M, "{name}: {:?}", a.after);
    }
}

/// Fig. 7: the mean of five within two of the paper's spreads.
#[test]
fn hulls_are_as_large_as_in_the_paper() {
    for (k, &[area, area_spread, perimeter, perimeter_spread]) in paper::FEATURES.iter().enumerate() {
        let own = (0..INSTANCES).map(|i| instance(k, i).features());
        let area_cm2 = mean(own.clone().map(|f| 1e4 * f.area_m2));
        let perimeter_cm = mean(own.map(|f| 1e2 * f.perimeter_m));
        assert!((area_cm2 - area).abs() < 2.0 * area_spread, "{}: {area_cm2} cm², paper {area}", NAMES[k]);
        let off = (perimeter_cm - perimeter).abs();
        assert!(off < 2.0 * perimeter_spread, "{}: {perimeter_cm} cm, paper {perimeter}", NAMES[k]);
    }
}

/// Fig. 8: ranges off the diagonal match the paper's, those on it are no worse, and one threshold
/// separates all.
#[test]
fn model_alignment_tells_all_objects_apart() {
    let (mut same, mut other) = (0.0_f64, f64::INFINITY);
    let pairs = (0..NAMES.len()).flat_map(|a| (0..=a).map(move |b| (a, b)));
    for (a, b) in pairs {
        let [(low, high), _] = f_c_range(learnt(), a, b, &FitOptions::default());
        let (paper_low, paper_high) = paper::F_C[a][b];
        let cell = format!("{} {}: {low:.4}-{high:.4}, paper {paper_low}-{paper_high}", NAMES[a], NAMES[b]);
        if a == b {
            assert!(high <= paper_high, "{cell}");
            same = same.max(high);
        } else {
            assert!(low <= paper_high && high >= paper_low, "{cell}");
            other = other.min(low);
        }
    }
    assert!(other > 3.0 * same, "the same object up to {same}, another from {other}");
}

/// Fig. 9.
#[test]
fn a_moved_scan_is_brought_back() {
    for solver in [Solver::LeastSquares, Solver::Simplex] {
        let options = FitOptions {
            solver: SolverOptions { solver, ..SolverOptions::default() },
            ..FitOptions::default()
        };
        let mut off_m: Vec<f64> = Vec::new();
        for (k, i) in (0..NAMES.len()).flat_map(|k| (1..INSTANCES).map(move |i| (k, i))) {
            let found = relocalised(instance(k, 0), instance(k, i), 2 * i, &options);
            assert!(found.fit.between.exterior_m < paper::EXTERIOR_M, "{}: {:?}", NAMES[k], found.fit);
            off_m.push(found.position_m);
        }
        off_m.sort_by(f64::total_cmp);
        assert!(off_m[off_m.len() - 1] < paper::FARTHEST_M, "{solver:?}: {off_m:?}");
        assert!(off_m[off_m.len() / 2] < paper::TYPICAL_M, "{solver:?}: {off_m:?}");
    }
}

/// Both solvers reach the same objective, apart from occasional local minima of either.
#[test]
fn least_squares_are_no_worse_than_the_simplex() {
    let map = map_of_the_lab(&mut Draws(EXPERIMENT));
    for objective in [Objective::Violation, Objective::default()] {
        let by = |solver| {
            let options = SolverOptions { solver, objective, ..SolverOptions::default() };
            let all = (0..NAMES.len()).map(|k| {
                let seen = circled(&object(k), &Run::default(), &map, seed_of(EXPERIMENT, k, 0)).1;
                let a = align(&seen.scans, &options).unwrap();
                assert!(a.after.exterior_m < paper::EXTERIOR_M, "{solver:?} {objective:?}: {:?}", a.after);
                a.evaluations
            });
            all.sum::<usize>()
        };
        let (ours, simplex) = (by(Solver::LeastSquares), by(Solver::Simplex));
        assert!(8 * ours < simplex, "{objective:?}: {ours} evaluations, the simplex {simplex}");
    }
}

/// Two scans from opposite sides have no penalty for parts invisible to either: at true poses, a
/// box has nearly no violation.
#[test]
fn the_interior_error_is_gated() {
    let map = map_of_the_lab(&mut Draws(1));
    let run = Run { pose_sigma_m: 0.0, pose_sigma_rad: 0.0, ..Run::default() };
    let seen = circled(&object(4), &run, &map, 1).1;
    let violation = align(&seen.scans, &SolverOptions::default()).unwrap().before;
    assert!(violation.boundary_m2 < 0.01 && violation.interior_m < 0.02, "{violation:?}");
}

#[test]
fn the_same_input_gives_the_same_bytes() {
    for solver in [Solver::LeastSquares, Solver::Simplex] {
        let options = SolverOptions { solver, ..SolverOptions::default() };
        let map = map_of_the_lab(&mut Draws(1));
        let seen = circled(&object(0), &Run::default(), &map, 1).1;
        let written = || serde_json::to_string(&align(&seen.scans, &options).unwrap().model).unwrap();
        assert_eq!(written(), written());
    }
    let shapes = known();
    let recognised = || recognise(instance(2, 1), &shapes, &RecogniseOptions::default());
    assert_eq!(recognised(), recognised());
}

#[test]
fn features_name_and_group() {
    let named =
        (0..learnt().len()).filter(|i| i % INSTANCES > 0).map(|i| (NAMES[i / INSTANCES], &learnt()[i].model));
    let classes = classes(named);
    assert_eq!(classes.iter().map(|c| c.instances).collect::<Vec<_>>(), [4; 5]);
    for (k, name) in NAMES.iter().enumerate() {
        let found = nearest(&classes, &instance(k, 0).features()).unwrap();
        assert!(
            found.class.name == *name && found.distance < 5.0 && found.second > found.distance,
            "{found:?}"
        );
    }
    assert_eq!(nearest(&[], &instance(0, 0).features()), None);
    let all: Vec<_> = learnt().iter().map(|a| a.model.features()).collect();
    // Recycle-bins and garbage-cans have like hulls: the paper cannot tell them apart by features either.
    let large = groups(&all, 6.0).into_iter().filter(|g| !g.contains(&0)).collect::<Vec<_>>();
    for k in [1, 3, 4] {
        let own: Vec<usize> = (k * INSTANCES..(k + 1) * INSTANCES).collect();
        assert!(large.contains(&own), "{}: {large:?}", NAMES[k]);
    }
    assert!(groups(&[], 6.0).is_empty());
}

#[test]
fn what_is_known_is_named_and_what_is_not_is_not() {
    let map = map_of_the_lab(&mut Draws(EXPERIMENT));
    let chair = circled(&four_legs(45.0, 3.0), &Run::default(), &map, 5).1.scans;
    let chair = align(&chair, &SolverOptions::default()).unwrap();
    assert!(chair.longest_m() < paper::EXTERIOR_M, "{chair:?}");
    let mut twice = known();
    twice.push(KnownShape::new("waste-basket", instance(2, 2).clone()));
    let is = |name: &str| Verdict::Is(name.to_owned());
    let both = Verdict::OneOf(vec!["garbage-can".into(), "waste-basket".into()]);
    let check = |instance: &ShapeModel, known: &[KnownShape], expected: &Verdict| {
        let mut found = recognise(instance, known, &RecogniseOptions::default());
        if let Verdict::OneOf(names) = &mut found.verdict {
            names.sort();
        }
        assert_eq!(&found.verdict, expected, "{:?}", found.candidates);
        assert_eq!(found.ruled_out + found.candidates.len(), known.len());
    };
    for (k, name) in NAMES.iter().enumerate() {
        check(instance(k, 3), &known(), &is(name));
        check(instance(k, 3), &[], &Verdict::Unknown);
        check(
            instance(k, 3),
            &known().into_iter().filter(|s| s.name != *name).collect::<Vec<_>>(),
            &Verdict::Unknown,
        );
    }
    check(&chair.model, &known(), &Verdict::Unknown);
    check(instance(2, 3), &twice, &both);
}

/// An object two centimetres wider or narrower than a known one may be the known one for the laser,
/// and is not named.
#[test]
fn what_is_like_a_known_thing_is_not_named() {
    let map = map_of_the_lab(&mut Draws(EXPERIMENT));
    let check = |outline: &lab::Outline, like: &str| {
        let scans = circled(outline, &Run::default(), &map, 9).1.scans;
        let model = align(&scans, &SolverOptions::default()).unwrap().model;
        let found = recognise(&model, &known(), &RecogniseOptions::default());
        assert_eq!(found.verdict, Verdict::OneOf(vec![like.into()]), "{:?}", found.candidates);
    };
    check(&lab::rounded(57.5, 57.5, 14.8), "big-chair");
    check(&lab::rounded(61.0, 61.0, 14.8), "big-chair");
    check(&lab::rounded(48.0, 48.0, 17.6), "red-chair");
    check(&lab::rounded(52.0, 52.0, 17.6), "red-chair");
}

/// A single scan never names a wrong object with certainty, and keeps the right one possible.
#[test]
fn a_single_scan_leaves_the_right_object() {
    let shapes = known();
    for (k, name) in NAMES.iter().enumerate() {
        let posed = &instance(k, 1).scans()[0];
        let found = recognise_scan(&posed.scan, &shapes, &RecogniseOptions::default());
        let names = match found.verdict {
            Verdict::Is(name) => vec![name],
            Verdict::OneOf(names) => names,
            Verdict::Unknown => Vec::new(),
        };
        assert!(names.iter().any(|n| n == name), "{name}: {names:?}");
        let fit = &found.candidates.iter().find(|c| c.index == k).unwrap().fit;
        let middle = fit.model_from_other.inverse() * instance(k, 0).features().centre;
        let expected = posed.model_from_laser.inverse() * instance(k, 1).features().centre;
        assert!((middle - expected).norm() < paper::FARTHEST_M, "{name}: {middle}, {expected}");
    }
}

/// Cuts a scan's readings and bound on its left, as if the end of the object had been taken for
/// background.
fn cut_left(posed: &mut PosedScan, share: f64) {
    let scan = &mut posed.scan;
    scan.left_object_rad -= share * (scan.left_object_rad - scan.right_object_rad);
    scan.left_bound_rad = scan.left_object_rad + 0.017;
    let bound = scan.left_object_rad;
    scan.points.retain(|p| p.y.atan2(p.x) <= bound);
}

/// Ends taken for background contradict the other scans; the model excludes and reports them.
#[test]
fn ends_that_contradict_the_others_are_opened() {
    let options = SolverOptions::default();
    let map = map_of_the_lab(&mut Draws(EXPERIMENT));
    let check = |outline: &lab::Outline, seed: u64, cut: &[usize]| {
        let mut scans = circled(outline, &Run::default(), &map, seed).1.scans;
        cut.iter().for_each(|&index| cut_left(&mut scans[index], 1.0 / 3.0));
        let all = align(&scans, &options).unwrap();
        assert!(all.longest_m() > 0.02 && all.opened.is_empty(), "{seed} {cut:?}: {:?}", all.after);
        let rest = align_consistent(&scans, 0.02, &options).unwrap();
        assert!(rest.longest_m() <= 0.02, "{seed} {cut:?}: {:?}", rest.after);
        let mut opened: Vec<usize> = rest.opened.iter().map(|(index, _)| *index).collect();
        opened.extend(&rest.left_out);
        opened.sort_unstable();
        assert_eq!(opened, cut, "{seed}: {:?} {:?}", rest.opened, rest.left_out);
    };
    check(&object(1), 3, &[2]);
    check(&object(1), 3, &[0, 4]);
    check(&object(3), 4, &[1, 3]);
    let scans = circled(&object(1), &Run::default(), &map, 3).1.scans;
    let two = align_consistent(&scans[1..3], 1e-9, &options).unwrap();
    assert!(two.opened.is_empty() && two.left_out.is_empty());
    // Of a chair's legs too little is left: what would agree, agrees only far from where the scans were taken, and is owned to contradict.
    let mut legs = circled(&four_legs(45.0, 3.0), &Run::default(), &map, 5).1.scans;
    cut_left(&mut legs[2], 1.0 / 3.0);
    let all = align_consistent(&legs, 0.02, &options).unwrap();
    assert!(all.longest_m() > 0.02 && all.opened.is_empty(), "{:?}", all.after);
}

#[test]
fn the_next_scan_is_from_the_other_side() {
    let options = NextOptions::default();
    let model = ShapeModel::new(vec![instance(1, 0).scans()[0].clone()]).unwrap();
    let first = model.scans()[0].model_from_laser.translation.vector;
    // The middle of the thing is behind its readings.
    let middle = instance(1, 0).features().centre.coords;
    let from = |turn: f64| {
        let away = Isometry2::rotation(turn) * (first - middle);
        Isometry2::new(middle + away, away.y.atan2(away.x) + PI)
    };
    let poses: Vec<Isometry2<f64>> = (0..8).map(|i| from(TAU * f64::from(i) / 8.0)).collect();
    let ranked = next_scan(&model, &poses, &options);
    let place = |index: usize| ranked.iter().position(|n| n.index == index).unwrap();
    assert_eq!(place(0), 7, "the same place again settles least: {ranked:?}");
    let open_m2 = undetermined_m2(&model, &options);
    assert!(ranked.iter().all(|n| (n.settles_m2 + n.leaves_m2 - open_m2).abs() < 1e-9));
    assert!(undetermined_m2(instance(1, 0), &options) < 0.1 * open_m2);
    assert!(next_scan(&model, &[], &options).is_empty());
}

/// Sweep over half a turn in steps of a degree: a wall 3 m ahead, and an object at the given depth
/// between two angles (degrees).
fn sweep(thing: (i32, i32), thing_m: f64) -> Scan {
    let degrees: Vec<i32> = (-90..=90).collect();
    Scan {
        angles_rad: degrees.iter().map(|d| f64::from(*d).to_radians()).collect(),
        ranges_m: degrees
            .iter()
            .map(|d| if (thing.0..=thing.1).contains(d) { thing_m } else { 3.0 })
            .collect(),
        map_from_laser: Isometry2::identity(),
    }
}

/// Object of a scan: everything nearer than 2.5 m is foreground.
fn observed(scan: &Scan) -> Result<Observation, ObserveError> {
    let near = Point2::new(1.0, 0.0);
    let options = ObserveOptions { within_m: 2.0, ..ObserveOptions::default() };
    observe(std::slice::from_ref(scan), &near, |p| p.coords.norm() > 2.5, &options)
}

#[test]
fn a_scan_says_why_it_is_ignored() {
    let edit = |mut scan: Scan, edits: &[(i32, f64)]| {
        edits.iter().for_each(|&(degree, range)| scan.ranges_m[(degree + 90) as usize] = range);
        scan
    };
    let check = |name: &str, scan: Scan, expected: Result<[i32; 4], Ignored>| {
        let found = observed(&scan).unwrap();
        let degrees = |s: &ObjectScan| {
            [s.right_bound_rad, s.right_object_rad, s.left_object_rad, s.left_bound_rad]
                .map(|a| a.to_degrees().round() as i32)
        };
        let told = match found.scans.first() {
            Some(posed) => Ok(degrees(&posed.scan)),
            None => Err(found.ignored[0].1),
        };
        assert_eq!(told, expected, "{name}");
    };
    let thing = || sweep((-10, 10), 1.0);
    check("bounded", thing(), Ok([-11, -10, 10, 11]));
    check("nothing there", sweep((1, 0), 1.0), Err(Ignored::NotSeen));
    check("all readings NaN", sweep((-90, 90), f64::NAN), Err(Ignored::NotSeen));
    check("to the left end", sweep((-10, 90), 1.0), Err(Ignored::NoLeftBound));
    check("to the right end", sweep((-90, 10), 1.0), Err(Ignored::NoRightBound));
    check("fills the field of view", sweep((-90, 90), 1.0), Err(Ignored::NoLeftBound));
    check("nothing returned beside it", edit(thing(), &[(11, f64::INFINITY)]), Ok([-11, -10, 10, 11]));
    check("no reading beside it", edit(thing(), &[(11, f64::NAN), (12, 0.0)]), Ok([-11, -10, 10, 13]));
    check("taken for background", edit(thing(), &[(-11, 2.55)]), Ok([-11, -10, 10, 11]));
    check(
        "something nearer beside it",
        edit(sweep((-10, 10), 2.0), &[(11, 2.6), (12, 0.9)]),
        Ok([-11, -10, 10, 11]),
    );
    let covered: Vec<(i32, f64)> = vec![(11, 0.2), (12, 0.2)];
    check("covered on the left", edit(sweep((-10, 10), 2.0), &covered), Err(Ignored::LeftCovered));
    let covered: Vec<(i32, f64)> = vec![(-11, 0.2), (-12, 0.2)];
    check("covered on the right", edit(sweep((-10, 10), 2.0), &covered), Err(Ignored::RightCovered));
}

#[test]
fn a_laser_that_looks_all_around_has_no_seam() {
    let scan = Scan {
        angles_rad: (0..360).map(|d| f64::from(d).to_radians()).collect(),
        ranges_m: (0..360).map(|d| if !(10..350).contains(&d) { 1.0 } else { 3.0 }).collect(),
        map_from_laser: Isometry2::identity(),
    };
    let found = observed(&scan).unwrap();
    let s = &found.scans[0].scan;
    let width = |a: f64, b: f64| (a - b).to_degrees().round();
    assert_eq!(width(s.left_object_rad, s.right_object_rad), 19.0, "{s:?}");
    assert_eq!(width(s.left_bound_rad, s.right_bound_rad), 21.0, "{s:?}");
}

#[test]
fn unsound_scans_are_told() {
    let check = |change: &dyn Fn(&mut Scan), expected: ScanError| {
        let mut scan = sweep((-10, 10), 1.0);
        change(&mut scan);
        assert_eq!(observed(&scan), Err(ObserveError::Scan { index: 0, why: expected }));
    };
    check(&|s| s.ranges_m.truncate(3), ScanError::Lengths { angles: 181, ranges: 3 });
    check(&|s| s.angles_rad[5] = f64::INFINITY, ScanError::Angle { index: 5, angle_rad: f64::INFINITY });
    check(&|s| s.angles_rad[5] = -2.0, ScanError::Angle { index: 5, angle_rad: -2.0 });
    check(&|s| s.angles_rad[180] = 9.0, ScanError::Angle { index: 180, angle_rad: 9.0 });
    check(&|s| s.map_from_laser.translation.x = f64::NAN, ScanError::Pose);
    let empty = Scan { angles_rad: Vec::new(), ranges_m: Vec::new(), map_from_laser: Isometry2::identity() };
    assert_eq!(observed(&empty).unwrap().ignored, [(0, Ignored::NotSeen)]);
    let step = ObserveOptions { step_m: 0.0, ..ObserveOptions::default() };
    assert!(observe(&[sweep((-10, 10), 1.0)], &Point2::origin(), |_| false, &step).is_err());
    assert_eq!(
        observe(&[], &Point2::origin(), |_| false, &ObserveOptions::default()),
        Ok(Observation::default())
    );
}

#[test]
fn a_damaged_model_is_refused() {
    let sound = || instance(0, 0).scans().to_vec();
    let check = |change: &dyn Fn(&mut PosedScan), expected: fn(&ShapeError) -> bool| {
        let mut scans = sound();
        change(&mut scans[1]);
        let written = serde_json::json!({ "scans": scans });
        let told = ShapeModel::new(scans.clone()).unwrap_err();
        assert!(expected(&told), "{told}");
        assert!(serde_json::from_value::<ShapeModel>(written).is_err(), "{told}");
        assert!(align(&scans, &SolverOptions::default()).is_err());
    };
    check(&|s| s.scan.points.clear(), |e| matches!(e, ShapeError::Points { index: 1 }));
    check(&|s| s.scan.points[0].x = f64::NAN, |e| matches!(e, ShapeError::Points { index: 1 }));
    check(&|s| s.scan.left_bound_rad = s.scan.left_object_rad, |e| {
        matches!(e, ShapeError::Angles { index: 1, .. })
    });
    check(&|s| s.scan.left_bound_rad += PI, |e| matches!(e, ShapeError::Angles { index: 1, .. }));
    check(&|s| s.model_from_laser.translation.x = f64::INFINITY, |e| {
        matches!(e, ShapeError::Pose { index: 1 })
    });
    assert_eq!(ShapeModel::new(Vec::new()), Err(ShapeError::NoScans));
    assert!(align(&[], &SolverOptions::default()).is_err());
    let shape = KnownShape::new("bin", instance(0, 0).clone());
    let text = serde_json::to_string(&shape).unwrap();
    assert_eq!(serde_json::from_str::<KnownShape>(&text).unwrap(), shape);
}

/// One scan, or one reading, makes a model without violation, and no more.
#[test]
fn few_scans_and_few_readings_are_no_panic() {
    let one = ObjectScan {
        points: vec![Point2::new(1.0, 0.0)],
        right_bound_rad: -0.02,
        right_object_rad: 0.0,
        left_object_rad: 0.0,
        left_bound_rad: 0.02,
    };
    let posed = PosedScan { scan: one.clone(), model_from_laser: Isometry2::identity() };
    for solver in [Solver::LeastSquares, Solver::Simplex] {
        let options = SolverOptions { solver, ..SolverOptions::default() };
        for count in 1..4 {
            let found = align(&vec![posed.clone(); count], &options).unwrap();
            assert!(found.converged && found.after.boundary_m2 < 1e-6, "{solver:?}: {found:?}");
            assert_eq!(found.model.features().area_m2, 0.0);
            let fit = FitOptions { solver: options, starts: 0, followed: 0, ..FitOptions::default() };
            assert!(localise(&found.model, &one, Start::AllAngles, &fit).f_c_m2.is_finite());
            assert!(undetermined_m2(&found.model, &NextOptions::default()) > 0.0);
        }
    }
    let known = [KnownShape::new("post", ShapeModel::new(vec![posed]).unwrap())];
    recognise(&known[0].model.clone(), &known, &RecogniseOptions::default());
    recognise_scan(&one, &known, &RecogniseOptions::default());
}

#[test]
fn an_occupancy_grid_tells_background() {
    use Space::{Free, Occupied, Unknown};
    let map = Occupancy {
        origin: Point2::new(-1.0, -1.0),
        cell_m: 0.5,
        width: 4,
        cells: vec![Free, Free, Free, Occupied, Free, Free, Free, Free, Unknown],
    };
    let check = |x: f64, y: f64, margin_m: f64, expected: bool| {
        assert_eq!(map.is_background(&Point2::new(x, y), margin_m), expected, "{x}, {y}, {margin_m}");
    };
    check(0.75, -0.75, 0.0, true);
    check(0.45, -0.75, 0.0, false);
    check(0.45, -0.75, 0.1, true);
    check(0.4, -0.45, 0.11, false);
    check(0.4, -0.4, 0.15, true);
    check(-0.75, -0.25, 0.0, false);
    check(-0.75, 0.25, 0.0, true);
    check(-0.25, 0.25, 0.0, true);
    check(-9.0, 0.0, 0.0, true);
    check(f64::NAN, 0.0, 0.1, true);
}
