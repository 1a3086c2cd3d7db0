//! Unusual clouds: a clear error or a plausible answer, equal for every number of threads.

use descry_perception::cluster::{self, ClusterError};
use descry_perception::merge::{MergeOptions, merge};
use descry_perception::nalgebra::{Isometry3, Point3, Unit, Vector3};
use descry_perception::normals::{self, OrganisedOptions};
use descry_perception::plane::{self, PlaneError, PlaneOptions};
use descry_perception::recognise::Published;
use descry_perception::segment::{SceneOptions, segment};
use descry_perception::surface::SurfaceOptions;
use descry_perception::voxel::{self, VoxelError};
use descry_perception::{Cloud, Grid, Hull, Neighbours, Recogniser, View, outliers};

const NAN: Point3<f32> = Point3::new(f32::NAN, f32::NAN, f32::NAN);

/// Noisy table with a can; every thirteenth pixel has no return.
fn table() -> Vec<Point3<f32>> {
    let mut state = 1u32;
    let mut noise = || {
        state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        (state >> 8) as f32 / (1 << 24) as f32 - 0.5
    };
    let mut points = Vec::new();
    for i in 0..20_000 {
        let (x, y) = ((i % 200) as f32 * 0.005 - 0.5, (i / 200) as f32 * 0.005 - 0.25);
        points.push(if i % 13 == 0 { NAN } else { Point3::new(x, y, 0.7 + 0.002 * noise()) });
    }
    for i in 0..3000 {
        let turn = i as f32 * 2.399_963;
        let r = 0.035 + 0.001 * noise();
        points.push(Point3::new(r * turn.cos(), r * turn.sin(), 0.72 + 0.1 * i as f32 / 3000.0));
    }
    points
}

fn odd() -> Vec<(&'static str, Vec<Point3<f32>>)> {
    let at = Point3::new(0.3, -0.2, 0.9);
    vec![
        ("none", vec![]),
        ("no return", vec![NAN; 50]),
        ("one", vec![at]),
        ("two", vec![at, at * 2.0]),
        ("equal", vec![at; 3000]),
        ("on a line", (0..3000).map(|i| Point3::new(0.001 * i as f32, 0.5, 0.7)).collect()),
        (
            "infinite",
            vec![Point3::new(f32::INFINITY, 0.0, 0.0), at, NAN, Point3::new(0.0, f32::NEG_INFINITY, 1.0)],
        ),
        ("huge", vec![Point3::new(3e38, -3e38, 3e38), at, Point3::new(-3e38, 0.0, 0.0), at * 1.1, at * 1.2]),
        ("tiny", (0..100).map(|i| Point3::new(1e-38 * i as f32, 1e-40, 0.0)).collect()),
        ("table", table()),
    ]
}

#[test]
fn every_kernel_takes_every_cloud() {
    for (name, points) in odd() {
        let cloud = Cloud::from_points(points.clone());
        let finite = cloud.count_finite();
        match voxel::downsample(&cloud, 0.01) {
            Ok(small) => assert!(small.len() <= finite && (finite == 0) == small.is_empty(), "{name}"),
            Err(e) => assert!(matches!(e, VoxelError::TooFar { .. }), "{name}: {e}"),
        }
        let tree = Neighbours::new(&points).unwrap();
        assert_eq!(tree.len(), finite, "{name}");
        let found = normals::estimate(&tree, 20, &Point3::origin());
        assert_eq!(found.normals.len(), points.len(), "{name}");
        assert!(found.normals.iter().all(|n| n.x.is_nan() || (n.norm() - 1.0).abs() < 1e-4), "{name}");
        assert!(outliers::statistical(&tree, 20, 2.0).indices.len() <= finite, "{name}");
        match cluster::euclidean(&points, 0.02, 1) {
            Ok(clusters) => assert_eq!(clusters.iter().map(Vec::len).sum::<usize>(), finite, "{name}"),
            Err(e) => assert!(matches!(e, ClusterError::TooFar { .. }), "{name}: {e}"),
        }
        match plane::find(&points, &PlaneOptions::default()) {
            Ok(fit) => assert!(fit.inliers.len() >= 3 && fit.plane.offset_m.is_finite(), "{name}"),
            Err(e) => assert!(!matches!(e, PlaneError::Tolerance { .. }), "{name}: {e}"),
        }
        let level = plane::Plane { normal: Vector3::z(), offset_m: 0.0 };
        assert_eq!(Hull::around(level, &points).is_some(), finite > 0, "{name}");
    }
}

#[test]
fn wrong_wishes_are_refused() {
    let cloud = Cloud::from_points(table());
    for bad in [0.0, -1.0, f32::NAN, f32::INFINITY] {
        assert!(matches!(voxel::downsample(&cloud, bad), Err(VoxelError::Edge { .. })));
        assert!(matches!(cluster::euclidean(&cloud.points, bad, 1), Err(ClusterError::Step { .. })));
        let options = PlaneOptions { tolerance_m: bad, ..PlaneOptions::default() };
        assert!(matches!(plane::find(&cloud.points, &options), Err(PlaneError::Tolerance { .. })));
    }
    let thousandfold = cloud.finite().scaled(1e9);
    let message = voxel::downsample(&thousandfold, 0.01).unwrap_err().to_string();
    assert!(message.contains("millimetres"), "{message}");
}

#[test]
fn the_table_and_what_stands_on_it() {
    let points = table();
    let up = Unit::new_normalize(Vector3::z());
    let tilt = Some((up, 0.1));
    let options = PlaneOptions { tilt, offset_m: Some(0.6..=0.8), ..PlaneOptions::default() };
    let fit = plane::find(&points, &options).unwrap();
    assert!((fit.plane.offset_m - 0.7).abs() < 5e-4 && fit.plane.normal.z > 0.9999, "{fit:?}");
    assert_eq!(fit.inliers.len(), points[..20_000].iter().filter(|p| p.x.is_finite()).count());
    assert!(fit.rms_m < 0.001);
    let high = PlaneOptions { offset_m: Some(0.9..=1.2), ..options };
    assert!(matches!(plane::find(&points, &high), Err(PlaneError::None { .. })));

    let clusters = cluster::euclidean(&points[20_000..], 0.01, 10).unwrap();
    assert_eq!(clusters.len(), 1);
}

#[test]
fn returns_from_beyond_all_cells_leave_the_table_where_it_is() {
    let mut points = table();
    points.extend((0..200).map(|i| Point3::new(-1e10, 1e10, -1e10 - 1e6 * i as f32)));
    let cloud = Cloud::from_points(points);
    let surface = SurfaceOptions { up: Some(Unit::new_normalize(Vector3::z())), ..SurfaceOptions::default() };
    let options = SceneOptions { surface, ..SceneOptions::default() };
    let seen = descry_perception::visibility::Visibility::default();
    let scene = segment(&cloud, &seen, &options).expect("there is a table");
    assert!((scene.surface.offset_m - 0.7).abs() < 2e-3, "{}", scene.surface.offset_m);
}

#[test]
fn clusters_are_what_hangs_together() {
    let chain = |x: f32, n: usize, step: f32| (0..n).map(move |i| Point3::new(x, step * i as f32, 0.5));
    let points: Vec<Point3<f32>> = chain(0.0, 50, 0.019)
        .chain(chain(0.021, 30, 0.019))
        .chain([NAN])
        .chain(chain(5.0, 9, 0.001))
        .collect();
    let found = cluster::euclidean(&points, 0.02, 10).unwrap();
    assert_eq!(found.iter().map(Vec::len).collect::<Vec<_>>(), [50, 30]);
    let joined = cluster::euclidean(&points, 0.022, 1).unwrap();
    assert_eq!(joined.iter().map(Vec::len).collect::<Vec<_>>(), [80, 9]);
}

/// Clusters found by looking at every pair.
fn all_pairs(points: &[Point3<f32>], step_m: f32) -> usize {
    let mut label: Vec<usize> = (0..points.len()).collect();
    for i in 0..points.len() {
        for j in 0..i {
            if (points[i] - points[j]).norm_squared() <= step_m * step_m && label[i] != label[j] {
                let (from, to) = (label[i], label[j]);
                label.iter_mut().filter(|l| **l == from).for_each(|l| *l = to);
            }
        }
    }
    label.sort_unstable();
    label.dedup();
    label.len()
}

proptest::proptest! {
    #[test]
    fn as_many_clusters_as_by_looking_at_every_pair(raw in proptest::collection::vec((0u8..50, 0u8..50, 0u8..6), 1..250)) {
        let points: Vec<Point3<f32>> =
            raw.iter().map(|&(x, y, z)| Point3::new(f32::from(x), f32::from(y), f32::from(z)) * 0.0071).collect();
        proptest::prop_assert_eq!(cluster::euclidean(&points, 0.02, 1).unwrap().len(), all_pairs(&points, 0.02));
    }
}

#[test]
fn voxels_average_what_lies_in_them() {
    let cloud = Cloud {
        points: vec![
            Point3::new(0.001, 0.0, 0.0),
            NAN,
            Point3::new(0.003, 0.004, 0.0),
            Point3::new(-0.001, 0.0, 0.0),
        ],
        colours: Some(vec![[0, 0, 0], [9, 9, 9], [100, 50, 1], [7, 7, 7]]),
        normals: Some(vec![Vector3::z(), Vector3::x(), Vector3::y(), Vector3::repeat(f32::NAN)]),
        labels: Some(vec![4, 5, 6, 7]),
        grid: Some(Grid { width: 2, height: 2 }),
    };
    let small = voxel::downsample(&cloud, 0.01).unwrap();
    assert!(small.check().is_ok() && small.grid.is_none());
    assert!((small.points[0] - Point3::new(0.002, 0.002, 0.0)).norm() < 1e-9);
    assert_eq!(small.points[1], Point3::new(-0.001, 0.0, 0.0));
    assert_eq!((small.colours, small.labels), (Some(vec![[50, 25, 1], [7, 7, 7]]), Some(vec![4, 7])));
    let normals = small.normals.unwrap();
    assert!((normals[0] - Vector3::new(0.0, 1.0, 1.0).normalize()).norm() < 1e-6 && normals[1].x.is_nan());
}

#[test]
fn the_same_for_every_number_of_threads() {
    let points = table();
    let organised = Cloud {
        points: points[..20_000].to_vec(),
        grid: Some(Grid { width: 200, height: 100 }),
        ..Cloud::default()
    };
    let run = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| {
            let tree = Neighbours::new(&points).unwrap();
            let found = normals::estimate(&tree, 20, &Point3::origin());
            let grid = normals::organised(&organised, &OrganisedOptions::default()).unwrap();
            let kept = outliers::statistical(&tree, 20, 2.0);
            format!("{found:?} {grid:?} {kept:?}")
        })
    };
    let one = run(1);
    assert!(one == run(2) && one == run(5));
}

#[test]
fn organised_normals_keep_apart_what_is_apart() {
    // A near wall covers the left half of a far one.
    let points = (0..64 * 48)
        .map(|i| {
            let (u, v) = ((i % 64) as f32, (i / 64) as f32);
            let z = if u < 32.0 { 1.0 } else { 1.5 };
            Point3::new((u - 32.0) * z / 60.0, (v - 24.0) * z / 60.0, z)
        })
        .collect();
    let cloud = Cloud { points, grid: Some(Grid { width: 64, height: 48 }), ..Cloud::default() };
    let found = normals::organised(&cloud, &OrganisedOptions::default()).unwrap();
    assert!(found.normals.iter().all(|n| n.z < -0.9999));
    assert!(normals::organised(&cloud.finite(), &OrganisedOptions::default()).is_none());
}

#[test]
#[ignore = "slow: ten million points take seconds"]
fn ten_million_points() {
    let points: Vec<Point3<f32>> = (0..10_000_000u32)
        .map(|i| {
            Point3::new((i % 4000) as f32 * 0.001, (i / 4000) as f32 * 0.001, ((i * 7) % 13) as f32 * 0.00005)
        })
        .collect();
    let cloud = Cloud::from_points(points);
    let small = voxel::downsample(&cloud, 0.01).unwrap();
    assert!((99_000..110_000).contains(&small.len()), "{}", small.len());
    assert!(plane::find(&cloud.points, &PlaneOptions::default()).unwrap().inliers.len() > 9_000_000);
    let tree = Neighbours::new(&cloud.points).unwrap();
    let found = normals::estimate(&tree, 20, &Point3::new(0.0, 0.0, 1.0));
    assert!(found.normals.iter().filter(|n| n.z > 0.5).count() > 9_000_000);
    assert_eq!(cluster::euclidean(&cloud.points, 0.02, 30).unwrap().len(), 1);
    assert!(outliers::statistical(&tree, 20, 2.0).indices.len() > 9_000_000);
}

#[test]
#[ignore = "slow: ten million points take seconds"]
fn ten_million_points_from_table_to_cup() {
    // A table of 2.4 by 1.6 m, a cup with a floor, no grid; the camera stands 1 m beside and above.
    let camera = Isometry3::translation(0.0, -1.0, 1.7);
    let points: Vec<Point3<f32>> = (0..10_000_000u32)
        .map(|i| {
            let (turn, rise) = (i as f32 * 2.399_963, (i % 1013) as f32 / 1013.0);
            match i % 10 {
                0 => Point3::new(0.035 * turn.cos(), 0.035 * turn.sin(), 0.72 + 0.104 * rise),
                1 if rise < 0.1 => Point3::new(0.34 * rise * turn.cos(), 0.34 * rise * turn.sin(), 0.724),
                _ => {
                    Point3::new((i % 2400) as f32 * 0.001 - 1.2, (i / 2400 % 1600) as f32 * 0.001 - 0.8, 0.72)
                }
            }
        })
        .map(|p| camera.cast::<f32>().inverse() * p)
        .collect();
    let view = View {
        stamp_ns: 0,
        cloud: Cloud::from_points(points),
        intrinsics: None,
        world_from_camera: camera,
        pose_sigma_m: 0.0,
        pose_sigma_rad: 0.0,
    };
    let up = Some(Unit::new_normalize(Vector3::z()));
    let merged = merge(&[view], &MergeOptions { up, ..Default::default() }).unwrap();
    let surface = SurfaceOptions { up, height_band_m: Some((0.6, 0.9)), ..Default::default() };
    let options = SceneOptions { surface, ..Default::default() };
    let scene = segment(&merged.cloud, &merged.visibility, &options).unwrap();
    let found = Published::default().recognise(&scene, &merged.visibility, &[]);
    assert_eq!(found.len(), 1);
    assert!((found[0].size_m[2] - 0.104).abs() < 0.006, "{:?}", found[0].size_m);
}
