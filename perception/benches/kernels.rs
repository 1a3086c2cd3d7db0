//! The kernels on a made-up Kinect frame of a table with things on it: `cargo bench -p descry-perception --bench kernels`.

use descry_perception::cluster;
use descry_perception::nalgebra::{Isometry3, Point3, Vector3};
use descry_perception::normals::{self, OrganisedOptions};
use descry_perception::plane::{self, PlaneOptions};
use descry_perception::register::{Method, Prepared, RegisterOptions, align};
use descry_perception::{Cloud, Intrinsics, Neighbours, outliers, voxel};
use divan::Bencher;

fn main() {
    divan::main();
}

/// A wall, a table before it and four balls on the table, with a little noise.
fn frame() -> Cloud {
    let camera = Intrinsics { width: 640, height: 480, fx: 525.0, fy: 525.0, cx: 319.5, cy: 239.5 };
    let mut state = 1u32;
    let depths: Vec<f32> = (0..640 * 480)
        .map(|i| {
            state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            let noise = ((state >> 8) as f64 / f64::from(1 << 24) - 0.5) * 0.002;
            let ray = camera.unproject(f64::from(i % 640), f64::from(i / 640), 1.0).coords;
            (depth_along(&ray) + noise) as f32
        })
        .collect();
    camera.cloud_from_depth(&depths).unwrap_or_default()
}

fn depth_along(ray: &Vector3<f64>) -> f64 {
    let mut nearest = 2.5f64;
    if ray.y > 0.0 {
        nearest = nearest.min(0.35 / ray.y);
    }
    for k in 0..4 {
        let centre = Vector3::new(-0.4 + 0.25 * f64::from(k), 0.3, 1.1 + 0.1 * f64::from(k));
        let (a, b, c) = (ray.norm_squared(), ray.dot(&centre), centre.norm_squared() - 0.0036);
        let root = b * b - a * c;
        if root > 0.0 {
            nearest = nearest.min((b - root.sqrt()) / a);
        }
    }
    nearest
}

#[divan::bench]
fn voxels_1cm(bencher: Bencher) {
    let cloud = frame();
    bencher.bench(|| voxel::downsample(&cloud, 0.01));
}

#[divan::bench]
fn tree(bencher: Bencher) {
    let cloud = frame();
    bencher.bench(|| Neighbours::new(&cloud.points));
}

#[divan::bench(sample_count = 10)]
fn normals_of_20(bencher: Bencher) {
    let cloud = frame();
    bencher.bench(|| Neighbours::new(&cloud.points).map(|t| normals::estimate(&t, 20, &Point3::origin())));
}

#[divan::bench]
fn normals_organised(bencher: Bencher) {
    let cloud = frame();
    bencher.bench(|| normals::organised(&cloud, &OrganisedOptions::default()));
}

/// The frame in voxels of 1 cm.
fn small() -> Vec<Point3<f32>> {
    voxel::downsample(&frame(), 0.01).map(|c| c.points).unwrap_or_default()
}

#[divan::bench]
fn outliers_of_20(bencher: Bencher) {
    let points = small();
    bencher.bench(|| Neighbours::new(&points).map(|t| outliers::statistical(&t, 20, 2.0)));
}

#[divan::bench]
fn plane_1000_rounds(bencher: Bencher) {
    let points = small();
    bencher.bench(|| plane::find(&points, &PlaneOptions::default()));
}

#[divan::bench]
fn clusters_2cm(bencher: Bencher) {
    let points = small();
    bencher.bench(|| cluster::euclidean(&points, 0.02, 30));
}

#[divan::bench(args = [Method::PointToPoint, Method::PointToPlane, Method::Generalised], sample_count = 10)]
fn registration(bencher: Bencher, method: Method) {
    let target = small();
    let away = Isometry3::new(Vector3::new(0.02, -0.01, 0.015), Vector3::new(0.01, 0.02, -0.01));
    let source: Vec<Point3<f32>> = target.iter().map(|p| (away * p.cast::<f64>()).cast()).collect();
    let options = RegisterOptions { method, ..RegisterOptions::default() };
    bencher.bench(|| -> Option<_> {
        let source = Prepared::with_normals(&source, 20).ok()?;
        let target = Prepared::with_normals(&target, 20).ok()?;
        align(&source, &target, &options).ok()
    });
}
