//! Exports a drive for comparison with other programs, which `peers.py` in this folder runs, together with
//! our own results.

use super::corridor::measure::survey;
use super::corridor::{Building, Rig, around};
use super::poses::{LONG_M, SHORT_M, again, options, steps};
use super::times::{memory_mb, processor_s};
use descry_perception::cloud::Cloud;
use descry_perception::files::pcd;
use descry_perception::mapping::{MapOptions, Matcher, chained, correct_drive};
use descry_perception::nalgebra::Point2;
use std::fmt::Write;
use std::path::Path;

/// Writes a cloud for each stop, poses (x y heading by odometry, true, rectified, closed), the true walls and
/// ours at true poses (x y x y), and our cost: processor seconds for the steps, for loop closure and the
/// graph, and for the walls, and peak megabytes.
pub fn export(seed: u64, dir: &Path) -> Result<(), String> {
    let building = Building::corridor_loop(LONG_M, SHORT_M, seed);
    let truths = around(LONG_M, SHORT_M, 6.0, 0.8);
    let stations = building.drive(&truths, &Rig::default(), seed);
    let rectify = options(Matcher::IcpEm);
    let had_mb = memory_mb().1;
    let began_s = processor_s();
    let pairs = steps(&stations, &rectify)?;
    let steps_s = processor_s() - began_s;
    let chain = chained(&pairs);
    let found = again(&stations, &chain, &rectify)?;
    let settled = correct_drive(&pairs, &found).map_err(|e| e.to_string())?;
    let closed_s = processor_s() - began_s - steps_s;
    let began_s = processor_s();
    let map = survey(&stations, &truths).map(&MapOptions::default()).map_err(|e| e.to_string())?;
    let walls_s = processor_s() - began_s;
    let took = format!("{steps_s:.2} {closed_s:.2} {walls_s:.2} {:.0}\n", memory_mb().0 - had_mb);
    let folder = dir.join("drive");
    std::fs::create_dir_all(&folder).map_err(|e| format!("{}: {e}", folder.display()))?;
    let save = |name: &str, bytes: &[u8]| {
        std::fs::write(folder.join(name), bytes).map_err(|e| format!("{name}: {e}"))
    };
    let mut poses = String::new();
    for (i, station) in stations.iter().enumerate() {
        let cloud = Cloud::from_points(station.points.clone());
        save(&format!("{i:03}.pcd"), &pcd::write(&cloud, pcd::PcdEncoding::Binary))?;
        for pose in [&station.odom_from_level, &truths[i], &chain[i], &settled.poses[i]] {
            let _ = write!(poses, "{} {} {} ", pose.translation.x, pose.translation.y, pose.rotation.angle());
        }
        poses.push('\n');
    }
    let feet: Vec<(Point2<f64>, Point2<f64>)> = map.feet().collect();
    save("poses.txt", poses.as_bytes())?;
    save("walls.txt", lines(&building.walls).as_bytes())?;
    save("ours.txt", lines(&feet).as_bytes())?;
    save("took.txt", took.as_bytes())?;
    println!(
        "{}: {} stops; seconds for steps, closing, walls, and MB: {took}",
        folder.display(),
        stations.len()
    );
    Ok(())
}

fn lines(walls: &[(Point2<f64>, Point2<f64>)]) -> String {
    walls.iter().map(|(a, b)| format!("{} {} {} {}\n", a.x, a.y, b.x, b.y)).collect()
}
