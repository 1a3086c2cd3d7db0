//! Registration recovers known motions, and reports failures.

use descry_perception::nalgebra::{Isometry3, Point3, Translation3, UnitQuaternion, Vector3};
use descry_perception::register::{
    Fit, Method, Prepared, RegisterError, RegisterOptions, Termination, align, pairs,
};

/// A floor, two walls and a ball in a corner: held in every direction.
fn corner(offset: f32) -> Vec<Point3<f32>> {
    let mut points = Vec::new();
    for i in 0..60 {
        for j in 0..60 {
            let (a, b) = (i as f32 * 0.01 + offset, j as f32 * 0.01 + offset);
            points.extend([Point3::new(a, b, 0.0), Point3::new(a, 0.0, b), Point3::new(0.0, a, b)]);
        }
    }
    for i in 0..1500 {
        let (turn, z) = (i as f32 * 2.399_963, 1.0 - (i as f32 + 0.5) / 750.0);
        let r = (1.0 - z * z).sqrt() * 0.1;
        points.push(Point3::new(0.3 + r * turn.cos(), 0.3 + r * turn.sin(), 0.25 + 0.1 * z));
    }
    points
}

fn disturbance(shift_m: f64, turn_rad: f64) -> Isometry3<f64> {
    let axis = Vector3::new(0.3, -0.5, 0.81).normalize();
    let shift = Vector3::new(0.6, -0.64, 0.48).normalize() * shift_m;
    Isometry3::from_parts(Translation3::from(shift), UnitQuaternion::from_scaled_axis(axis * turn_rad))
}

fn moved(points: &[Point3<f32>], by: &Isometry3<f64>) -> Vec<Point3<f32>> {
    points.iter().map(|p| (by * p.cast::<f64>()).cast()).collect()
}

fn run(source: &[Point3<f32>], target: &[Point3<f32>], options: &RegisterOptions) -> Fit {
    let source = Prepared::with_normals(source, 20).unwrap();
    let target = Prepared::with_normals(target, 20).unwrap();
    align(&source, &target, options).unwrap()
}

fn check(method: Method, shift_m: f64, turn_rad: f64, within_m: f64) {
    let away = disturbance(shift_m, turn_rad);
    let target = corner(0.0);
    let source = moved(&corner(0.004), &away);
    let options = RegisterOptions { method, within_m: 0.1, ..RegisterOptions::default() };
    let fit = run(&source, &target, &options);
    let left = fit.target_from_source * away;
    let error_m =
        target.iter().map(|p| (left * p.cast::<f64>() - p.cast::<f64>()).norm()).fold(0.0, f64::max);
    assert!(error_m < within_m, "{method:?}: {error_m} m left, {fit:?}");
    assert!(fit.free == 0 && fit.matched > source.len() * 9 / 10, "{fit:?}");
    assert!(fit.residual_m < 0.006, "{fit:?}");
}

#[test]
fn comes_back() {
    for (shift_m, turn_rad) in [(0.0, 0.0), (0.02, 0.02), (0.05, 0.06)] {
        // Samples 1 cm apart pull each other into step: that is how this method errs.
        check(Method::PointToPoint, shift_m, turn_rad, 0.012);
        check(Method::PointToPlane, shift_m, turn_rad, 0.001);
        check(Method::Generalised, shift_m, turn_rad, 0.001);
    }
}

#[test]
fn the_same_for_every_number_of_threads() {
    let source = moved(&corner(0.004), &disturbance(0.02, 0.03));
    let pose = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| run(&source, &corner(0.0), &RegisterOptions::default()))
    };
    let one = pose(1);
    assert_eq!(one, pose(2));
    assert_eq!(one, pose(7));
}

#[test]
fn a_plane_alone_leaves_three_directions_free() {
    let plane: Vec<Point3<f32>> =
        (0..6400).map(|i| Point3::new((i % 80) as f32 * 0.01, (i / 80) as f32 * 0.01, 1.0)).collect();
    let away = Isometry3::from_parts(Translation3::new(0.0, 0.0, 0.02), UnitQuaternion::identity());
    let options = RegisterOptions { method: Method::PointToPlane, ..RegisterOptions::default() };
    let fit = run(&moved(&plane, &away), &plane, &options);
    assert_eq!((fit.free, fit.converged()), (3, false));
    let shift = fit.target_from_source.translation.vector;
    assert!((shift - Vector3::new(0.0, 0.0, -0.02)).norm() < 1e-4, "{shift}");
}

#[test]
fn clouds_apart_say_so() {
    let away = Isometry3::translation(5.0, 0.0, 0.0);
    let fit = run(&moved(&corner(0.0), &away), &corner(0.0), &RegisterOptions::default());
    assert_eq!((fit.ending, fit.matched, fit.rounds), (Termination::TooFewPartners, 0, 0));
    assert_eq!(fit.target_from_source, Isometry3::identity());
}

#[test]
fn what_cannot_be_registered() {
    let empty = Prepared::new(&[Point3::new(f32::NAN, 0.0, 0.0)]).unwrap();
    let bare = Prepared::new(&corner(0.0)).unwrap();
    let options = RegisterOptions::default();
    assert_eq!(align(&empty, &bare, &options), Err(RegisterError::Empty { which: "source" }));
    assert!(matches!(align(&bare, &bare, &options), Err(RegisterError::NoNormals { which: "target", .. })));
    let options = RegisterOptions { method: Method::PointToPoint, within_m: f32::NAN, ..options };
    assert!(matches!(align(&bare, &bare, &options), Err(RegisterError::Length { .. })));
    let lost = Isometry3::translation(f64::NAN, 0.0, 0.0);
    let options = RegisterOptions { within_m: 0.05, start_target_from_source: lost, ..options };
    assert_eq!(align(&bare, &bare, &options), Err(RegisterError::Start));
    let one = Prepared::new(&[Point3::origin()]).unwrap();
    let options = RegisterOptions { start_target_from_source: Isometry3::identity(), ..options };
    assert_eq!(align(&one, &one, &options).unwrap().ending, Termination::TooFewPartners);
}

#[test]
fn partners_are_the_nearest() {
    let (source, target) = (moved(&corner(0.004), &disturbance(0.01, 0.01)), corner(0.0));
    let (source, target) = (Prepared::new(&source).unwrap(), Prepared::new(&target).unwrap());
    let found = pairs(&source, &target, &Isometry3::identity(), 0.02);
    assert!(found.len() > source.points().len() / 2);
    for pair in found.iter().step_by(97) {
        let at = source.points()[pair.source as usize];
        let nearest = target.points().iter().map(|p| (p - at).norm_squared()).fold(f32::INFINITY, f32::min);
        assert!((nearest - pair.distance_sq).abs() < 1e-9);
    }
}
