//! Section 3: errors of single steps, and the residual at loop closure.

use super::corridor::{Building, Rig, around, field_of_view, with_people};
use super::tabletop::Draws;
use descry_perception::mapping::{
    Closure, ClosureOptions, Matcher, PairFit, RectifyOptions, Station, chained, closures, correct_drive,
    rectify_drive, rectify_pair,
};
use descry_perception::nalgebra::Isometry2;

pub const LONG_M: f64 = 40.0;
pub const SHORT_M: f64 = 20.0;

/// Methods of matching successive stations, with short names.
const MATCHERS: [(&str, Matcher); 5] = [
    ("odometry", Matcher::Odometry),
    ("ICP, all points", Matcher::Icp),
    ("ICP, shared view", Matcher::IcpShared),
    ("ICP-EM, split (paper)", Matcher::IcpEmSplit),
    ("ICP-EM, together", Matcher::IcpEm),
];

pub fn options(matcher: Matcher) -> RectifyOptions {
    RectifyOptions { matcher, field: field_of_view(), ..RectifyOptions::default() }
}

/// Distance (metres) and angle (degrees) between two poses.
pub fn off(found: &Isometry2<f64>, truth: &Isometry2<f64>) -> (f64, f64) {
    let apart = (found.translation.vector - truth.translation.vector).norm();
    (apart, found.rotation.angle_to(&truth.rotation).abs().to_degrees())
}

fn mean_and_most(values: &mut [f64]) -> (f64, f64) {
    values.sort_by(f64::total_cmp);
    let at = values.len() * 95 / 100;
    (values.iter().sum::<f64>() / values.len() as f64, values[at.min(values.len() - 1)])
}

/// Relative pose fits between successive stations of a drive.
pub fn steps(stations: &[Station], rectify: &RectifyOptions) -> Result<Vec<PairFit>, String> {
    rectify_drive(stations, rectify).map_err(|e| e.to_string())
}

/// Loop closures found in a drive at given poses.
pub fn again(
    stations: &[Station],
    poses: &[Isometry2<f64>],
    rectify: &RectifyOptions,
) -> Result<Vec<Closure>, String> {
    closures(stations, poses, rectify, &ClosureOptions::default()).map_err(|e| e.to_string())
}

/// Errors of single steps against the share of outliers.
pub fn pairs(seed: u64) {
    let building = Building::corridor_loop(LONG_M, SHORT_M, seed);
    let rig = Rig::default();
    let truths = around(LONG_M, SHORT_M, 0.0, 0.8);
    let stations = building.drive(&truths, &rig, seed);
    println!(
        "every second step of a drive of {} stops: turn off (degrees, mean and 95 of 100), way off (cm, the same), by the share of points on people who walk",
        truths.len()
    );
    for share in [0.0, 0.1, 0.2, 0.4, 0.6] {
        let mut draws = Draws(seed + 77);
        let seen: Vec<Station> = stations
            .iter()
            .map(|s| Station { points: with_people(&s.points, share, &mut draws), ..s.clone() })
            .collect();
        for (name, matcher) in MATCHERS {
            let options = options(matcher);
            let (mut ways, mut turns): (Vec<f64>, Vec<f64>) = (1..seen.len())
                .step_by(2)
                .map(|i| {
                    let fit = rectify_pair(&seen[i - 1], &seen[i], &options).expect("sound options");
                    off(&fit.before_from_after, &truths[i - 1].inv_mul(&truths[i]))
                })
                .unzip();
            let (turn, most_turn) = mean_and_most(&mut turns);
            let (way, most_way) = mean_and_most(&mut ways);
            println!(
                "{:>3.0} %  {name:<22} {turn:>6.2} {most_turn:>6.2}   {:>6.1} {:>6.1}",
                100.0 * share,
                100.0 * way,
                100.0 * most_way
            );
        }
    }
}

/// Prints pose errors at loop closure, for drives around a corridor.
pub fn loops(seed: u64) -> Result<(), String> {
    println!(
        "\nonce around {:.0} m: way (m) and turn (degrees) off where the drive came back; farthest and mean pose off the truth (m)",
        2.0 * (LONG_M + SHORT_M)
    );
    for seed in seed..seed + 3 {
        let building = Building::corridor_loop(LONG_M, SHORT_M, seed);
        let truths = around(LONG_M, SHORT_M, 6.0, 0.8);
        let stations = building.drive(&truths, &Rig::default(), seed);
        let row = |name: &str, poses: &[Isometry2<f64>]| {
            let from_first: Vec<_> = truths.iter().map(|t| truths[0].inv_mul(t)).collect();
            let last = truths.len() - 1;
            let (way, turn) = off(&poses[last], &from_first[last]);
            let offs: Vec<f64> = poses.iter().zip(&from_first).map(|(p, t)| off(p, t).0).collect();
            let most = offs.iter().copied().fold(0.0, f64::max);
            let mean = offs.iter().sum::<f64>() / offs.len() as f64;
            println!("seed {seed}  {name:<28} {way:>6.2} {turn:>6.2}   {most:>6.2} {mean:>6.2}");
        };
        for (name, matcher) in MATCHERS {
            row(name, &chained(&steps(&stations, &options(matcher))?));
        }
        let rectify = options(Matcher::IcpEm);
        let pairs = steps(&stations, &rectify)?;
        let found = again(&stations, &chained(&pairs), &rectify)?;
        let settled = correct_drive(&pairs, &found).map_err(|e| e.to_string())?;
        row("closed", &settled.poses);
        let wrong = found
            .iter()
            .filter(|c| off(&c.fit.before_from_after, &truths[c.from].inv_mul(&truths[c.to])).0 > 0.3);
        let squares = settled.squares[..pairs.len()].iter().sum::<f64>() / pairs.len() as f64;
        println!(
            "        {} closures, {} of them off by more than 30 cm; squares a step {squares:.2}, {} rounds, converged {}",
            found.len(),
            wrong.count(),
            settled.rounds,
            settled.converged
        );
    }
    Ok(())
}
