//! The map of a building: poses, planes and what is open, held to a simulated truth.

mod corridor;
mod tabletop;

use corridor::{Building, Rig, around, field_of_view, with_people};
use descry_perception::mapping::{
    ClosureOptions, Matcher, PairFit, RectifyOptions, Station, chained, closures, correct_drive,
    rectify_drive, rectify_pair,
};
use descry_perception::nalgebra::Isometry2;
use std::sync::OnceLock;
use tabletop::Draws;

const LONG_M: f64 = 16.0;
const SHORT_M: f64 = 10.0;

struct Drive {
    stations: Vec<Station>,
    truths: Vec<Isometry2<f64>>,
}

/// Once around a small loop, and a bit.
fn drive() -> &'static Drive {
    static DRIVE: OnceLock<Drive> = OnceLock::new();
    DRIVE.get_or_init(|| {
        let truths = around(LONG_M, SHORT_M, 4.0, 0.8);
        let building = Building::corridor_loop(LONG_M, SHORT_M, 5);
        let rig = Rig { stride: 6, ..Rig::default() };
        Drive { stations: building.drive(&truths, &rig, 5), truths }
    })
}

fn options(matcher: Matcher) -> RectifyOptions {
    RectifyOptions { matcher, field: field_of_view(), ..RectifyOptions::default() }
}

fn pairs() -> &'static [PairFit] {
    static PAIRS: OnceLock<Vec<PairFit>> = OnceLock::new();
    PAIRS.get_or_init(|| rectify_drive(&drive().stations, &options(Matcher::IcpEm)))
}

fn root_mean_square(values: impl Iterator<Item = f64> + Clone) -> f64 {
    (values.clone().map(|v| v * v).sum::<f64>() / values.count() as f64).sqrt()
}

/// How far the turns of steps are off, root mean square, radians.
fn turns_off_rad(stations: &[Station], matcher: Matcher) -> f64 {
    let truths = &drive().truths;
    let off: Vec<f64> = (1..stations.len())
        .map(|i| {
            let fit = rectify_pair(&stations[i - 1], &stations[i], &options(matcher));
            let truth = truths[i - 1].inv_mul(&truths[i]);
            fit.before_from_after.rotation.angle_to(&truth.rotation)
        })
        .collect();
    root_mean_square(off.iter().copied())
}

#[test]
fn expectations_turn_better_than_odometry_and_closest_points() {
    let mut draws = Draws(3);
    for share in [0.0, 0.2] {
        let seen: Vec<Station> = drive()
            .stations
            .iter()
            .map(|s| Station { points: with_people(&s.points, share, &mut draws), ..s.clone() })
            .collect();
        let [odometry, icp, em] = [Matcher::Odometry, Matcher::IcpShared, Matcher::IcpEm]
            .map(|matcher| turns_off_rad(&seen, matcher));
        println!("{share}: odometry {odometry:.4}, ICP {icp:.4}, ICP-EM {em:.4} rad");
        assert!(em < 0.6 * odometry && em < 0.6 * icp, "{share}: {odometry} {icp} {em}");
    }
}

#[test]
fn the_loop_closes() {
    let Drive { stations, truths } = drive();
    let chain = chained(pairs());
    let found = closures(stations, &chain, &options(Matcher::IcpEm), &ClosureOptions::default());
    let settled = correct_drive(pairs(), &found).unwrap();
    let off_m = |poses: &[Isometry2<f64>]| {
        let off = poses.iter().zip(truths).map(|(pose, truth)| {
            (pose.translation.vector - truths[0].inv_mul(truth).translation.vector).norm()
        });
        (off.clone().last().unwrap(), root_mean_square(off))
    };
    let (before, after) = (off_m(&chain), off_m(&settled.poses));
    println!("{} closures: off {before:?} m before, {after:?} after", found.len());
    assert!(!found.is_empty() && settled.converged);
    assert!(after.0 < 0.2 && after.0 < 0.5 * before.0 && after.1 < before.1, "{before:?} {after:?}");
}

/// A wall without texture shows nothing: the way along it is what odometry says, and its spread says so.
#[test]
fn nothing_seen_leaves_odometry() {
    let bare = Station { points: Vec::new(), odom_from_level: Isometry2::identity() };
    let next = Station { odom_from_level: Isometry2::new([0.8, 0.1].into(), 0.05), ..bare.clone() };
    for matcher in [Matcher::Odometry, Matcher::Icp, Matcher::IcpShared, Matcher::IcpEmSplit, Matcher::IcpEm]
    {
        let fit = rectify_pair(&bare, &next, &options(matcher));
        assert_eq!(fit.before_from_after, next.odom_from_level, "{matcher:?}");
        assert_eq!((fit.explained, fit.shared), (0.0, (0, 0)), "{matcher:?}");
    }
    assert!(chained(&[]).len() == 1 && correct_drive(&[], &[]).unwrap().converged);
}

#[test]
fn the_same_drive_gives_the_same_poses() {
    let by = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| rectify_drive(&drive().stations[..20], &options(Matcher::IcpEm)))
    };
    assert_eq!(by(1), by(3));
}
