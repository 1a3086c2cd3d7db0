//! Times the kernels on one thread: `timings CLOUD [CLOUD2]` prints a JSON array of `{op, n, ms_min,
//! ms_median, result}`.
//!
//! Voxel filter: 1 cm centroids. Plane: 1,000 RANSAC rounds at 1 cm on the filtered cloud. Normals and
//! statistical outliers (2 sigma): 20 neighbours, including building the tree. Clusters: 2 cm gap, 30 points
//! or more, on the filtered cloud without its plane. Registration: from CLOUD2 (or CLOUD, moved by 2 cm and 2
//! degrees) to CLOUD, both filtered, from the identity, 5 cm, at most 50 iterations, including trees and
//! normals.

use descry_perception::cloud::Cloud;
use descry_perception::nalgebra::{Isometry3, Point3, Vector3};
use descry_perception::plane::{self, PlaneOptions};
use descry_perception::register::{Method, Prepared, RegisterOptions, align};
use descry_perception::{Neighbours, cluster, files, normals, outliers, voxel};
use std::time::Instant;

type Failure = Box<dyn std::error::Error>;

/// Maximum number of repetitions after a warm-up.
const REPETITIONS: usize = 15;
/// Time after which an operation is repeated no more, seconds.
const LONGEST_S: f64 = 5.0;
const EDGE_M: f32 = 0.01;
const NEIGHBOURS: usize = 20;

fn main() -> Result<(), Failure> {
    rayon::ThreadPoolBuilder::new().num_threads(1).build_global()?;
    let paths: Vec<String> = std::env::args().skip(1).collect();
    let (first, second) = match paths.as_slice() {
        [one] => (read(one)?, None),
        [one, two] => (read(one)?, Some(read(two)?)),
        _ => return Err("usage: timings CLOUD [CLOUD2]   (PCD or PLY)".into()),
    };
    let moved = || first.transformed(&Isometry3::new(Vector3::new(0.02, 0.0, 0.0), Vector3::y() * 0.035));
    let second = second.unwrap_or_else(moved);
    let rows = [surfaces(&first)?, registrations(&first, &second)?].concat();
    println!("[\n  {}\n]", rows.join(",\n  "));
    Ok(())
}

fn read(path: &str) -> Result<Cloud, Failure> {
    let bytes = std::fs::read(path).map_err(|e| format!("{path}: {e}"))?;
    let loaded = files::read_cloud(&bytes).map_err(|e| format!("{path}: {e}"))?;
    loaded.notes.iter().for_each(|note| eprintln!("{path}: {note}"));
    Ok(loaded.cloud)
}

/// Times an operation; returns its row of the output, and its result.
fn time<T>(
    op: &str,
    n: usize,
    mut run: impl FnMut() -> Result<T, Failure>,
    tell: impl Fn(&T) -> String,
) -> Result<(String, T), Failure> {
    let began = Instant::now();
    let result = run()?;
    let mut times: Vec<f64> = Vec::new();
    while times.len() < REPETITIONS && (times.is_empty() || began.elapsed().as_secs_f64() < LONGEST_S) {
        let start = Instant::now();
        std::hint::black_box(run()?);
        times.push(start.elapsed().as_secs_f64() * 1e3);
    }
    times.sort_by(f64::total_cmp);
    let (least, median) = (times[0], times[times.len() / 2]);
    let text = tell(&result);
    let row = format!(
        r#"{{"op": "{op}", "n": {n}, "ms_min": {least:.3}, "ms_median": {median:.3}, "result": "{text}"}}"#
    );
    Ok((row, result))
}

fn surfaces(cloud: &Cloud) -> Result<Vec<String>, Failure> {
    let full = cloud.finite();
    let origin = Point3::origin();
    let mut rows = Vec::new();
    let (row, small) = time(
        "voxel_1cm",
        full.len(),
        || Ok(voxel::downsample(&full, EDGE_M)?),
        |v| format!("{} of {}", v.len(), full.len()),
    )?;
    rows.push(row);
    let options = PlaneOptions::default();
    let (row, fit) = time(
        "plane",
        small.len(),
        || Ok(plane::find(&small.points, &options)?),
        |f| format!("{} inliers", f.inliers.len()),
    )?;
    rows.push(row);
    for (op, points) in [("normals_k20_voxelled", &small.points), ("normals_k20_full", &full.points)] {
        let run = || Ok(normals::estimate(&Neighbours::new(points)?, NEIGHBOURS, &origin));
        rows.push(time(op, points.len(), run, |n| counted(&n.normals))?.0);
    }
    if cloud.grid.is_some() {
        let run = || normals::organised(cloud, &Default::default()).ok_or_else(|| "no grid".into());
        rows.push(time("normals_organised", cloud.len(), run, |n| counted(&n.normals))?.0);
    }
    let run = || Ok(outliers::statistical(&Neighbours::new(&small.points)?, NEIGHBOURS, 2.0));
    rows.push(time("outliers_k20", small.len(), run, |k| format!("{} kept", k.indices.len()))?.0);
    let mut in_plane = vec![false; small.len()];
    fit.inliers.iter().for_each(|&i| in_plane[i as usize] = true);
    let rest: Vec<u32> = (0..small.len() as u32).filter(|&i| !in_plane[i as usize]).collect();
    let rest = small.select(&rest).points;
    let (row, _) = time(
        "clusters_2cm",
        rest.len(),
        || Ok(cluster::euclidean(&rest, 0.02, 30)?),
        |c| format!("{} of {} points", c.len(), rest.len()),
    )?;
    rows.push(row);
    Ok(rows)
}

fn counted(normals: &[Vector3<f32>]) -> String {
    normals.iter().filter(|n| !n.x.is_nan()).count().to_string()
}

fn registrations(target: &Cloud, source: &Cloud) -> Result<Vec<String>, Failure> {
    let target = voxel::downsample(target, EDGE_M)?.points;
    let source = voxel::downsample(source, EDGE_M)?.points;
    let kinds = [
        ("icp_point_to_point", Method::PointToPoint),
        ("icp_point_to_plane", Method::PointToPlane),
        ("gicp", Method::Generalised),
    ];
    let mut rows = Vec::new();
    for (op, method) in kinds {
        let prepare = |points: &[Point3<f32>], with_normals: bool| {
            if with_normals { Prepared::with_normals(points, NEIGHBOURS) } else { Prepared::new(points) }
        };
        let options = RegisterOptions { method, ..RegisterOptions::default() };
        let run = || {
            let target = prepare(&target, method != Method::PointToPoint)?;
            let source = prepare(&source, method == Method::Generalised)?;
            Ok(align(&source, &target, &options)?)
        };
        let row = time(op, source.len(), run, |fit| {
            let pose = fit.target_from_source;
            format!(
                "moved {:.1} mm, {:.2} deg; {} of {} matched, residual {:.2} mm, {} rounds, {}",
                1e3 * pose.translation.vector.norm(),
                pose.rotation.angle().to_degrees(),
                fit.matched,
                fit.of,
                1e3 * fit.residual_m,
                fit.rounds,
                fit.ending
            )
        })?;
        rows.push(row.0);
    }
    Ok(rows)
}
