//! Views of a known table with wrong poses, merged, against the truth.

use crate::tabletop::{Draws, TABLE_M, Thing, disturbed, look, on_ring};
use descry_perception::merge::{MergeError, MergeOptions, Merger, merge};
use descry_perception::nalgebra::{Isometry3, Point3, Unit, Vector3};
use descry_perception::surface::Region;
use descry_perception::{Merged, View};

fn things() -> Vec<Thing> {
    vec![
        Thing::Cup { x: 0.10, y: 0.05, radius: 0.035, height: 0.104, handle_rad: None },
        Thing::Cup { x: -0.22, y: 0.10, radius: 0.044, height: 0.155, handle_rad: None },
        Thing::Cup { x: 0.30, y: -0.12, radius: 0.04, height: 0.095, handle_rad: Some(2.0) },
        Thing::Block { x: -0.05, y: -0.15, half: [0.09, 0.05], height: 0.2, turn_rad: 0.5 },
        Thing::Tin { x: 0.42, y: 0.15, radius: 0.053, height: 0.277 },
    ]
}

fn options() -> MergeOptions {
    MergeOptions {
        up: Some(Unit::new_normalize(Vector3::z())),
        height_band_m: Some((0.5, 1.2)),
        ..MergeOptions::default()
    }
}

/// Views on a ring with true poses; localisation errs by the given standard deviations.
fn views(angles: &[f64], sigma_m: f64, sigma_rad: f64, seed: u64) -> (Vec<View>, Vec<Isometry3<f64>>) {
    let mut draws = Draws(seed);
    angles
        .iter()
        .map(|&angle| {
            let truth = on_ring(angle, 1.2 + 0.3 * draws.next(), 1.35 + 0.15 * draws.next());
            let stated = disturbed(&truth, sigma_m, sigma_rad, &mut draws);
            (look(&things(), &truth, &stated, &mut draws), truth)
        })
        .unzip()
}

/// Maximum disagreement between two used views about a point near the table's centre, metres.
fn disagreement_m(merged: &Merged, truths: &[Isometry3<f64>]) -> f64 {
    let places = [
        Point3::new(0.3, 0.1, TABLE_M),
        Point3::new(-0.3, -0.1, TABLE_M),
        Point3::new(0.0, 0.0, TABLE_M + 0.2),
    ];
    let used: Vec<usize> = (0..truths.len()).filter(|&i| merged.fits[i].used).collect();
    let at =
        |i: usize, p: &Point3<f64>| merged.fits[i].world_from_camera * truths[i].inverse_transform_point(p);
    let apart = |p: &Point3<f64>| {
        let all: Vec<_> = used.iter().map(|&i| at(i, p)).collect();
        all.iter().flat_map(|a| all.iter().map(move |b| (a - b).norm())).fold(0.0, f64::max)
    };
    places.iter().map(apart).fold(0.0, f64::max)
}

/// Distance of the middle of the table from the truth in the merged frame, metres.
fn offset_m(merged: &Merged, truths: &[Isometry3<f64>]) -> f64 {
    let middle = Point3::new(0.0, 0.0, TABLE_M);
    let used: Vec<usize> = (0..truths.len()).filter(|&i| merged.fits[i].used).collect();
    let sum: Vector3<f64> = used
        .iter()
        .map(|&i| merged.fits[i].world_from_camera * truths[i].inverse_transform_point(&middle) - middle)
        .sum();
    (sum / used.len().max(1) as f64).norm()
}

const RING: [f64; 5] = [0.0, 1.1, 2.4, 3.6, 5.0];

/// Limiting a merge to a region gives the same points there as without the limit.
#[test]
fn of_a_region_what_is_beside_it_is_left_away() {
    let (views, _) = views(&[0.0, 1.2, 2.4], 0.02, 0.01, 7);
    let corners = [(-0.3, -0.2), (-0.3, 0.2), (0.3, 0.2), (0.3, -0.2)];
    let corners = corners.map(|(x, y)| Point3::new(x, y, 0.0)).to_vec();
    let over = |p: &Point3<f32>, margin_m: f32| p.x.abs() < 0.3 + margin_m && p.y.abs() < 0.2 + margin_m;
    let whole = merge(&views, &options()).expect("the views are sound");
    for turned in [false, true] {
        let mut corners = corners.clone();
        corners.rotate_left(usize::from(turned));
        if turned {
            corners.reverse();
        }
        let region = Some(Region { corners, margin_m: 0.05 });
        let part = merge(&views, &MergeOptions { region, ..options() }).expect("the views are sound");
        assert_eq!(part.fits, whole.fits);
        let inner = |merged: &Merged| merged.cloud.points.iter().filter(|p| over(p, 0.03)).count();
        assert_eq!(inner(&part), inner(&whole));
        assert!(inner(&part) > 1_000);
        assert!(part.cloud.points.iter().all(|p| over(p, 0.06)), "beyond the region");
        assert!(whole.cloud.points.iter().any(|p| !over(p, 0.06)));
    }
}

#[test]
fn views_with_wrong_poses_come_together() {
    for (seed, sigma_m, sigma_rad, most_m) in
        [(1, 0.03, 0.035, 0.008), (2, 0.03, 0.035, 0.008), (4, 0.045, 0.04, 0.010)]
    {
        let (views, truths) = views(&RING, sigma_m, sigma_rad, seed);
        let merged = merge(&views, &options()).expect("the views are sound");
        let (apart, off) = (disagreement_m(&merged, &truths), offset_m(&merged, &truths));
        assert!(merged.fits.iter().all(|f| f.used), "seed {seed}: {:?}", merged.fits);
        assert!(apart < most_m, "seed {seed}: {apart} m apart");
        // The common frame is the average of what localisation said of five views.
        assert!(off < 2.0 * sigma_m, "seed {seed}: off by {off} m");
    }
}

#[test]
fn one_view_is_filtered_and_kept_where_it_is() {
    let (views, _) = views(&RING[..1], 0.0, 0.0, 4);
    let merged = merge(&views, &options()).expect("the view is sound");
    assert!(merged.fits[0].used && merged.fits[0].moved_m < 1e-9, "{:?}", merged.fits);
    assert!(merged.cloud.len() > 10_000);
}

#[test]
fn a_view_of_something_else_is_left_out_and_says_so() {
    let (mut views, truths) = views(&RING[..4], 0.02, 0.02, 5);
    let mut draws = Draws(6);
    let other = [
        Thing::Tin { x: -0.1, y: 0.1, radius: 0.08, height: 0.2 },
        Thing::Block { x: 0.3, y: 0.1, half: [0.05, 0.12], height: 0.1, turn_rad: 0.0 },
    ];
    let truth = on_ring(5.5, 1.3, 1.4);
    views.push(look(&other, &truth, &truth, &mut draws));
    let merged = merge(&views, &options()).expect("the views are sound");
    assert!(!merged.fits[4].used && merged.fits[4].why.contains("left out"), "{:?}", merged.fits[4]);
    assert!(merged.fits[..4].iter().all(|f| f.used));
    assert!(disagreement_m(&merged, &truths) < 0.01);
}

#[test]
fn what_cannot_be_merged_is_said() {
    let (views, _) = views(&RING[..1], 0.0, 0.0, 4);
    let mut lost = views.clone();
    lost[0].world_from_camera.translation.vector.x = f64::NAN;
    let narrow = MergeOptions { range_m: 0.2, ..options() };
    let wrong = MergeOptions { fuse_voxel_m: 0.0, ..options() };
    type Case<'a> = (&'a [View], MergeOptions, fn(&MergeError) -> bool);
    let cases: [Case; 4] = [
        (&[], options(), |e| matches!(e, MergeError::NoViews)),
        (&lost, options(), |e| matches!(e, MergeError::Pose { view: 0 })),
        (&views, narrow, |e| matches!(e, MergeError::Empty { .. })),
        (&views, wrong, |e| matches!(e, MergeError::Option { field: "fuse_voxel_m", .. })),
    ];
    for (views, options, expected) in cases {
        let error = merge(views, &options).err();
        assert!(error.as_ref().is_some_and(expected), "{error:?}");
    }
}

#[test]
fn the_same_merged_cloud_for_every_number_of_threads() {
    let (views, _) = views(&RING[..3], 0.03, 0.035, 7);
    let run = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("threads");
        let merged = pool.install(|| merge(&views, &options())).expect("the views are sound");
        (format!("{:?} {:?}", merged.fits, merged.cloud.normals), merged.cloud.points, merged.views_per_point)
    };
    let one = run(1);
    assert!(one == run(2) && one == run(5));
}

#[test]
fn the_merged_cloud_stays_within_its_bound() {
    let (views, _) = views(&RING[..2], 0.0, 0.0, 8);
    let whole = merge(&views, &options()).expect("the views are sound").cloud;
    for most_points in [whole.len() / 3, 1000] {
        let merged = merge(&views, &MergeOptions { most_points, ..options() }).expect("the views are sound");
        assert!(merged.cloud.len() <= most_points && merged.cloud.len() > most_points / 4);
        let (low, high) = merged.cloud.bounds().expect("points");
        let (all_low, all_high) = whole.bounds().expect("points");
        assert!((low - all_low).norm() < 0.2 && (high - all_high).norm() < 0.2, "{low} {high}");
    }
}

/// True if two merge results are equal, notes ignored.
fn same(one: &Merged, other: &Merged) -> bool {
    let maps = |m: &Merged| m.visibility.maps.iter().map(|map| map.camera_from_world).collect::<Vec<_>>();
    // Normals that are not known are no numbers.
    let normals = |m: &Merged| format!("{:?}", m.cloud.normals);
    one.cloud.points == other.cloud.points
        && one.cloud.colours == other.cloud.colours
        && normals(one) == normals(other)
        && one.views_per_point == other.views_per_point
        && one.fits == other.fits
        && maps(one) == maps(other)
}

#[test]
fn what_was_kept_of_other_views_changes_nothing() {
    let (mut views, _) = views(&RING, 0.03, 0.035, 5);
    let mut merger = Merger::default();
    let mut check = |what: &str, views: &[View]| {
        let kept = merger.merge(views, &options()).expect("the views are sound");
        let fresh = Merger::default().merge(views, &options()).expect("the views are sound");
        assert!(same(&kept, &fresh), "{what}");
        // Half of them find what was done ahead.
        if views.len().is_multiple_of(2) {
            merger.go_ahead(views.to_vec());
        }
    };
    for n in 1..=4 {
        check(&format!("{n} views"), &views[..n]);
    }
    check("one is gone", &views[1..4]);
    for p in &mut views[2].cloud.points[100_000..120_000] {
        *p = Point3::new(f32::NAN, f32::NAN, f32::NAN);
    }
    check("something moved where one had looked", &views[..4]);
    views.swap(0, 1);
    check("in another order", &views[..4]);
    let of_half = MergeOptions { align_voxel_m: 0.012, ..options() };
    let kept = merger.merge(&views[..4], &of_half).expect("the views are sound");
    let fresh = Merger::default().merge(&views[..4], &of_half).expect("the views are sound");
    assert!(same(&kept, &fresh), "other options");
}

#[test]
fn a_further_view_is_laid_on_those_before_it() {
    check_further(&[(1, 0.03, 0.035)], 7);
}

#[test]
#[ignore = "slow: more and worse views"]
fn more_further_views_are_laid_on_those_before_them() {
    check_further(&[(7, 0.03, 0.035), (4, 0.045, 0.04)], 11);
}

/// Merges that many views one after another, for each seed with errors of localisation, metres and radians.
fn check_further(arrangements: &[(u64, f64, f64)], count: usize) {
    /// Numbers of views around the limits of joint merging.
    const AT_ONCE: [usize; 5] = [2, 5, 9, 10, 11];
    let angles: Vec<f64> = (0..count).map(|i| 2.4 * i as f64).collect();
    for &(seed, sigma_m, sigma_rad) in arrangements {
        let (mut views, mut truths) = views(&angles, sigma_m, sigma_rad, seed);
        let mut merger = Merger::default();
        let mut laid = 0;
        for n in 1..=views.len() {
            let merged = merger.merge(&views[..n], &options()).expect("the views are sound");
            if n % 3 > 0 {
                merger.go_ahead(views[..n].to_vec());
            }
            laid += usize::from(merged.steps.iter().any(|step| step.name == "further look"));
            assert_eq!(merged.visibility.maps.len(), n, "seed {seed}: {:?}", merged.fits);
            let (apart, off) = (disagreement_m(&merged, &truths[..n]), offset_m(&merged, &truths[..n]));
            assert!(n < 5 || apart < 0.012, "seed {seed}, {n} views: {apart} m apart");
            assert!(n < 5 || off < 0.04, "seed {seed}, {n} views: {off} m off");
            if AT_ONCE.contains(&n) {
                let at_once = Merger::default().merge(&views[..n], &options()).expect("the views are sound");
                assert!(same(&merged, &at_once), "seed {seed}: {n} views at once give something else");
            }
        }
        assert!(laid + 3 >= count, "seed {seed}: only {laid} views were laid on those before");
        // A view that cannot be placed is left out as it is by merging anew.
        let lost = Isometry3::translation(0.0, 0.0, 0.4) * views[0].world_from_camera;
        views.push(View { world_from_camera: lost, stamp_ns: 1, ..views[0].clone() });
        truths.push(truths[0]);
        let merged = merger.merge(&views, &options()).expect("the views are sound");
        assert!(same(&merged, &merge(&views, &options()).expect("the views are sound")), "seed {seed}");
    }
}

/// Two views from opposite sides share few surfaces and contradict each other at their localised
/// poses; they are merged nevertheless.
#[test]
fn two_views_from_opposite_sides_come_together() {
    let of_seed = |seed: u64| {
        let (views, truths) = views(&[0.3, 0.3 + std::f64::consts::PI], 0.03, 0.035, seed);
        let merged = merge(&views, &options()).expect("two views of one table");
        let used = merged.fits.iter().filter(|fit| fit.used).count();
        (seed, used, disagreement_m(&merged, &truths))
    };
    let all: Vec<_> = (1..=12).map(of_seed).collect();
    let apart: Vec<_> = all.iter().filter(|(_, used, apart_m)| *used < 2 || *apart_m > 0.03).collect();
    assert!(apart.is_empty(), "seed, used, metres: {apart:.3?}");
}
