//! Section 4: walls compared with the truth, before and after joining and constraining them.

use super::corridor::measure::{MAP_FAR_M, on_truth, score, survey};
use super::corridor::{Building, Rig, around};
use super::plot::{Sheet, write};
use super::poses::{LONG_M, SHORT_M, again, options, steps};
use descry_perception::mapping::{
    FuseOptions, MapOptions, Matcher, PlaneEstimator, Station, chained, correct_drive,
};
use descry_perception::nalgebra::Isometry2;
use std::path::Path;

/// Variants of plane processing, with short names.
pub fn ways() -> [(&'static str, MapOptions); 6] {
    let with = |fit, constrained, fuse: bool| MapOptions {
        fit,
        constrained,
        fuse: fuse.then(FuseOptions::default),
        ..MapOptions::default()
    };
    [
        ("median, patches", with(PlaneEstimator::Median, false, false)),
        ("median, joined", with(PlaneEstimator::Median, false, true)),
        ("median, joined, constrained", with(PlaneEstimator::Median, true, true)),
        ("least squares, patches", with(PlaneEstimator::LeastSquares, false, false)),
        ("least squares, joined", with(PlaneEstimator::LeastSquares, false, true)),
        ("l. squares, joined, constr.", with(PlaneEstimator::LeastSquares, true, true)),
    ]
}

/// Prints the walls of every variant, at true, rectified and odometry poses.
pub fn walls(seed: u64, out: Option<&Path>) -> Result<(), String> {
    let building = Building::corridor_loop(LONG_M, SHORT_M, seed);
    let truths = around(LONG_M, SHORT_M, 6.0, 0.8);
    let stations = building.drive(&truths, &Rig::default(), seed);
    let rectify = options(Matcher::IcpEm);
    let pairs = steps(&stations, &rectify)?;
    let found = again(&stations, &chained(&pairs), &rectify)?;
    let settled = correct_drive(&pairs, &found).map_err(|e| e.to_string())?;
    let odometry: Vec<Isometry2<f64>> = stations.iter().map(|s| s.odom_from_level).collect();
    println!(
        "\nwalls, seed {seed}: number, precision and recall (%), angle (degrees) and offset (cm) of those that agree, doors kept open; agree within 15 cm at true poses, 60 cm at others laid onto the truth as a whole"
    );
    if let Some(dir) = out {
        draw(dir, &stations, &odometry, &chained(&pairs), &settled.poses)?;
    }
    for (name, poses, within_m) in [
        ("true", truths.clone(), 0.15),
        ("closed", on_truth(&settled.poses, &truths), 0.6),
        ("chain", on_truth(&chained(&pairs), &truths), 0.6),
        ("odometry", on_truth(&odometry, &truths), 0.6),
    ] {
        let survey = survey(&stations, &poses);
        for (way, options) in ways() {
            let map = survey.map(&options).map_err(|e| e.to_string())?;
            let s = score(&map, &building, within_m, &poses, &truths);
            let upright = &map.walls;
            let tilt: f64 =
                upright.iter().map(|w| w.area_m2 * w.plane.normal.z.abs().asin().to_degrees()).sum();
            let area: f64 = upright.iter().map(|w| w.area_m2).sum();
            println!(
                "{name:<9} {way:<28} {:>4}  {:>5.1} {:>5.1}  {:>5.2} {:>5.1}  {:>2}/{}  tilted {:.2}",
                s.walls,
                100.0 * s.precision,
                100.0 * s.recall,
                s.angle_deg,
                100.0 * s.offset_m,
                s.openings.0,
                s.openings.1,
                tilt / area
            );
        }
        if name == "true" {
            let map = survey.map(&MapOptions::default()).map_err(|e| e.to_string())?;
            let tables = map.levels.iter().filter(|l| l.faces_up && l.height_m > 0.3);
            let told: Vec<String> =
                tables.map(|l| format!("{:.2} m high, {:.2} m²", l.height_m, l.area_m2)).collect();
            println!(
                "          level surfaces above the floor: {} (truth: {} of 0.74 m, 0.72 m²)",
                told.join("; "),
                building.tables.len()
            );
        }
    }
    Ok(())
}

/// Draws the points from above by odometry, rectified and closed, and the map (Fig. 4, 7 and 14).
fn draw(
    dir: &Path,
    stations: &[Station],
    odometry: &[Isometry2<f64>],
    chain: &[Isometry2<f64>],
    closed: &[Isometry2<f64>],
) -> Result<(), String> {
    const SCALE: f64 = 14.0;
    let sheet = |poses: &[Isometry2<f64>]| {
        let mut sheet = Sheet::around(poses.iter().map(|p| p.translation.vector.into()), SCALE).grown(3.0);
        sheet.stations(stations, poses, MAP_FAR_M);
        sheet.drive(poses);
        sheet
    };
    let clouds = [("odometry", sheet(odometry)), ("ICP-EM", sheet(chain)), ("closed", sheet(closed))];
    write(dir, "drive.svg", &clouds)?;
    let map = survey(stations, closed).map(&MapOptions::default()).map_err(|e| e.to_string())?;
    let mut walls = Sheet::around(closed.iter().map(|p| p.translation.vector.into()), 2.0 * SCALE).grown(3.0);
    if let Some(grid) = &map.grid {
        walls.grid(grid);
    }
    walls.upright(&map);
    walls.levels(&map);
    write(dir, "map.svg", &[("walls, tables and open floor", walls)])
}
