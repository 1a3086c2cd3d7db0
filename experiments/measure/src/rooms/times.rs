//! Time and memory against the number of points, with their growth.

use super::corridor::measure::{BODY_M, MAP_FAR_M, score};
use super::corridor::{Building, CAMERA_HEIGHT_M, Rig, around};
use super::poses::{LONG_M, SHORT_M, options};
use descry_perception::mapping::{MapOptions, Matcher, Station, Survey, rectify_drive};

/// Processor time of the process since its start, seconds.
pub fn processor_s() -> f64 {
    let stat = std::fs::read_to_string("/proc/self/stat").unwrap_or_default();
    // After the name in brackets; a tick is a hundredth of a second.
    let fields = stat.rsplit(')').next().unwrap_or_default().split_whitespace();
    fields.skip(11).take(2).filter_map(|ticks| ticks.parse::<f64>().ok()).sum::<f64>() / 100.0
}

/// Peak and current memory of the process, megabytes.
pub fn memory_mb() -> (f64, f64) {
    let status = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
    let of = |key: &str| {
        let line = status.lines().find(|l| l.starts_with(key));
        line.and_then(|l| l.split_whitespace().nth(1)).and_then(|v| v.parse::<f64>().ok()).unwrap_or(f64::NAN)
            / 1024.0
    };
    (of("VmHWM:"), of("VmRSS:"))
}

/// Prints time and memory for 0.1 to 16 million points of one drive.
pub fn print(seed: u64) {
    println!(
        "\none pass, one thread: points (millions), processor seconds for the steps (ICP-EM), to take all in, for the planes; cells (thousands), store (MB), memory taken by the pass itself (MB)"
    );
    let pool = rayon::ThreadPoolBuilder::new().num_threads(1).build().expect("one thread");
    let building = Building::corridor_loop(LONG_M, SHORT_M, seed);
    let truths = around(LONG_M, SHORT_M, 6.0, 0.8);
    let dense = building.drive(&truths, &Rig { stride: 1, ..Rig::default() }, seed);
    let all: usize = dense.iter().map(|s| s.points.len()).sum();
    for millions in [0.1, 0.4, 1.0, 4.0, 16.0] {
        let every = all as f64 / (1e6 * millions);
        let thin = |s: &Station| {
            let count = (s.points.len() as f64 / every) as usize;
            let points = (0..count).map(|i| s.points[(i as f64 * every) as usize]).collect();
            Station { points, odom_from_level: s.odom_from_level }
        };
        let stations: Vec<Station> = dense.iter().map(thin).collect();
        let points: usize = stations.iter().map(|s| s.points.len()).sum();
        pool.install(|| {
            let before_s = processor_s();
            let pairs = rectify_drive(&stations, &options(Matcher::IcpEm)).expect("sound options");
            let steps_s = processor_s() - before_s;
            let (_, had_mb) = memory_mb();
            let before_s = processor_s();
            let mut survey = Survey::new(0.1).expect("a length");
            for (i, station) in stations.iter().enumerate() {
                survey.add(station, &truths[i], CAMERA_HEIGHT_M, MAP_FAR_M, &BODY_M).expect("a pose");
            }
            let add_s = processor_s() - before_s;
            let before_s = processor_s();
            let map = survey.map(&MapOptions::default()).expect("sound options");
            let planes_s = processor_s() - before_s;
            let (_, has_mb) = memory_mb();
            let s = score(&map, &building, 0.15, &truths, &truths);
            println!(
                "{:>6.2}   {steps_s:>6.2} {add_s:>6.2} {planes_s:>6.2}   {:>5.0} {:>6.1}  {:>6.1}   precision {:>5.1}, recall {:>5.1} %, doors {}/{}, {} fits",
                points as f64 / 1e6,
                survey.cells().len() as f64 / 1e3,
                survey.cells().len() as f64 * 60.0 / 1e6,
                has_mb - had_mb,
                100.0 * s.precision,
                100.0 * s.recall,
                s.openings.0,
                s.openings.1,
                pairs.len()
            );
        });
    }
}
