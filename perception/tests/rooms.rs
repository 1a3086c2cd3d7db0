//! Map of a building (poses, planes, openings) compared with simulated ground truth.

use crate::corridor;
use crate::corridor::{Building, CAMERA_HEIGHT_M, Rig, along, around, field_of_view, with_people};
use crate::tabletop::Draws;
use corridor::measure::{BODY_M, MAP_FAR_M, score, score_pillars, survey};
use descry_perception::mapping::{
    Cells, CellsError, ClosureOptions, ExploreOptions, FieldOfView, MapOptions, MappingError, Matcher,
    NormalOptions, PairFit, PlaneEstimator, Reach, RectifyOptions, RoomMap, Station, Survey, Unseen,
    by_regions, chained, closures, correct_drive, nearest_frontier, next_poses, outlooks, rectify_drive,
    rectify_pair, standable,
};
use descry_perception::nalgebra::{Isometry2, Point2, Point3, Vector2, Vector3};
use descry_perception::occupancy::Space;
use std::f64::consts::{FRAC_PI_4, TAU};
use std::sync::OnceLock;

const LONG_M: f64 = 16.0;
const SHORT_M: f64 = 10.0;

struct Drive {
    building: Building,
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
        Drive { stations: building.drive(&truths, &rig, 5), building, truths }
    })
}

fn options(matcher: Matcher) -> RectifyOptions {
    RectifyOptions { matcher, field: field_of_view(), ..RectifyOptions::default() }
}

fn pairs() -> &'static [PairFit] {
    static PAIRS: OnceLock<Vec<PairFit>> = OnceLock::new();
    PAIRS.get_or_init(|| rectify_drive(&drive().stations, &options(Matcher::IcpEm)).unwrap())
}

fn root_mean_square(values: impl Iterator<Item = f64> + Clone) -> f64 {
    (values.clone().map(|v| v * v).sum::<f64>() / values.count() as f64).sqrt()
}

/// The error of the turns of steps, root mean square, radians.
fn turns_off_rad(stations: &[Station], matcher: Matcher) -> f64 {
    let truths = &drive().truths;
    let off: Vec<f64> = (1..stations.len())
        .map(|i| {
            let fit = rectify_pair(&stations[i - 1], &stations[i], &options(matcher)).unwrap();
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
    let Drive { stations, truths, .. } = drive();
    let chain = chained(pairs());
    let found = closures(stations, &chain, &options(Matcher::IcpEm), &ClosureOptions::default()).unwrap();
    let settled = correct_drive(pairs(), &found).unwrap();
    let off_m = |poses: &[Isometry2<f64>]| {
        let off = poses.iter().zip(truths).map(|(pose, truth)| {
            (pose.translation.vector - truths[0].inv_mul(truth).translation.vector).norm()
        });
        (off.clone().next_back().unwrap(), root_mean_square(off))
    };
    let (before, after) = (off_m(&chain), off_m(&settled.poses));
    println!("{} closures: off {before:?} m before, {after:?} after", found.len());
    assert!(!found.is_empty() && settled.converged);
    assert!(after.0 < 0.2 && after.0 < 0.5 * before.0 && after.1 < before.1, "{before:?} {after:?}");
}

/// An untextured wall shows nothing: motion along it follows odometry, with its standard deviation.
#[test]
fn nothing_seen_leaves_odometry() {
    let bare = Station { points: Vec::new(), odom_from_level: Isometry2::identity() };
    let next = Station { odom_from_level: Isometry2::new([0.8, 0.1].into(), 0.05), ..bare.clone() };
    for matcher in [Matcher::Odometry, Matcher::Icp, Matcher::IcpShared, Matcher::IcpEmSplit, Matcher::IcpEm]
    {
        let fit = rectify_pair(&bare, &next, &options(matcher)).unwrap();
        assert_eq!(fit.before_from_after, next.odom_from_level, "{matcher:?}");
        assert_eq!((fit.explained, fit.shared), (0.0, (0, 0)), "{matcher:?}");
    }
    assert!(chained(&[]).len() == 1 && correct_drive(&[], &[]).unwrap().converged);
}

#[test]
fn the_same_drive_gives_the_same_poses() {
    let by = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| rectify_drive(&drive().stations[..20], &options(Matcher::IcpEm)).unwrap())
    };
    assert_eq!(by(1), by(3));
}

/// Everything seen on the drive, at true poses.
fn seen() -> &'static Survey {
    static SEEN: OnceLock<Survey> = OnceLock::new();
    SEEN.get_or_init(|| survey(&drive().stations, &drive().truths))
}

#[test]
fn normals_by_regions_are_those_of_the_surface() {
    let options = NormalOptions::default();
    let ring = |tilt: f64| -> Vec<Point3<f64>> {
        (0..8)
            .map(|i| TAU * f64::from(i) / 8.0)
            .map(|a| Point3::new(0.2 * a.cos(), 0.2 * a.sin(), 0.2 * tilt * a.cos()))
            .collect()
    };
    let normal = |regions: &[Point3<f64>], towards: Vector3<f64>| {
        by_regions(&Point3::origin(), regions, &towards, &options)
    };
    for (tilt, towards) in [(0.0, Vector3::z()), (0.5, Vector3::z()), (0.5, -Vector3::z())] {
        let expected = Vector3::new(-tilt, 0.0, 1.0).normalize() * towards.z;
        let found = normal(&ring(tilt), towards).unwrap();
        assert!((found - expected).norm() < 1e-9, "{found} for {expected}");
    }
    assert!(normal(&ring(0.0)[..4], Vector3::z()).is_none(), "too few regions are no evidence");
    // All around in space: no surface.
    let ball: Vec<Point3<f64>> = (0..40)
        .map(|i| (f64::from(i) + 0.5) / 40.0)
        .map(|t| {
            let (angle, z) = (40.0 * 2.399_963 * t, 1.0 - 2.0 * t);
            let r = (1.0 - z * z).sqrt();
            Point3::new(r * angle.cos(), r * angle.sin(), z)
        })
        .collect();
    assert!(normal(&ball, Vector3::z()).is_none());
}

#[test]
fn walls_stand_where_they_are_and_doors_stay_open() {
    let Drive { building, truths, .. } = drive();
    for (fit, constrained, off_deg, off_m) in [
        (PlaneEstimator::Median, true, 1.5, 0.08),
        (PlaneEstimator::LeastSquares, false, 0.8, 0.02),
        (PlaneEstimator::LeastSquares, true, 0.2, 0.01),
    ] {
        let map = seen().map(&MapOptions { fit, constrained, ..MapOptions::default() }).unwrap();
        let score = score(&map, building, 0.15, truths, truths);
        println!("{fit:?}, constrained {constrained}: {score:?}");
        assert!(score.precision > 0.95 && score.recall > 0.9, "{fit:?} {constrained}: {score:?}");
        assert!(score.angle_deg < off_deg && score.offset_m < off_m, "{fit:?} {constrained}: {score:?}");
        assert_eq!(score.openings.0, score.openings.1, "{fit:?} {constrained}: {score:?}");
        assert_eq!(map.main_rad.is_some(), constrained);
        if constrained {
            assert!(map.walls.iter().all(|w| w.plane.normal.z == 0.0));
        }
    }
}

#[test]
fn floor_ceiling_and_tables_are_level_surfaces() {
    let map = seen().map(&MapOptions::default()).unwrap();
    let at = |height_m: f64, faces_up: bool| {
        let near =
            map.levels.iter().filter(|l| (l.height_m - height_m).abs() < 0.03 && l.faces_up == faces_up);
        near.map(|l| l.area_m2).sum::<f64>()
    };
    println!(
        "floor {:.1}, ceiling {:.1}, tables {:.2} m²",
        at(0.0, true),
        at(corridor::CEILING_M, false),
        at(0.74, true)
    );
    assert!(
        at(0.0, true) > 10.0 && at(corridor::CEILING_M, false) > 5.0 && at(0.74, true) > 0.1,
        "{:?}",
        map.levels
    );
    let between = |l: &&descry_perception::mapping::Level| l.height_m > 0.9 && l.height_m < 2.0;
    assert_eq!(map.levels.iter().filter(between).count(), 0, "{:?}", map.levels);
}

#[test]
fn the_grid_is_open_where_the_camera_went_and_closed_at_walls() {
    let Drive { building, truths, .. } = drive();
    let grid = seen().map(&MapOptions::default()).unwrap().grid.unwrap();
    assert!(truths.iter().all(|t| grid.at(&t.translation.vector.into()) != Space::Occupied));
    let free = truths.iter().filter(|t| grid.at(&t.translation.vector.into()) == Space::Free).count();
    assert!(free * 10 > truths.len() * 9, "{free} of {}", truths.len());
    let middle = |(a, b): &(Point2<f64>, Point2<f64>)| a + (b - a) * 0.5;
    let near = |p: &Point2<f64>, space: Space| {
        let around = (-2..=2).flat_map(|x| (-2..=2).map(move |y| (x, y)));
        around.into_iter().any(|(x, y)| {
            grid.at(&(p + descry_perception::nalgebra::Vector2::new(f64::from(x), f64::from(y)) * 0.1))
                == space
        })
    };
    let walls = building.walls.iter().map(middle);
    let closed = walls.clone().filter(|p| near(p, Space::Occupied)).count();
    assert!(closed * 10 >= walls.count() * 9, "{closed}");
    let doors = building.openings.iter().map(|o| middle(&(o.a, o.b)));
    let open = doors.clone().filter(|p| grid.at(p) == Space::Free).count();
    assert!(open * 10 >= doors.count() * 9, "{open} of {}", building.openings.len());
}

#[test]
fn a_survey_is_saved_loaded_and_extended() {
    let Drive { stations, truths, .. } = drive();
    let half = stations.len() / 2;
    let first = survey(&stations[..half], &truths[..half]);
    let stored = serde_json::to_string(&first).unwrap();
    let mut later: Survey = serde_json::from_str(&stored).unwrap();
    assert_eq!(serde_json::to_string(&later).unwrap(), stored);
    for (station, pose) in stations[half..].iter().zip(&truths[half..]) {
        later.add(station, pose, CAMERA_HEIGHT_M, MAP_FAR_M, &BODY_M).unwrap();
    }
    let (whole, joined) =
        (seen().map(&MapOptions::default()).unwrap(), later.map(&MapOptions::default()).unwrap());
    assert_eq!(whole, joined);
    let map: RoomMap = serde_json::from_str(&serde_json::to_string(&whole).unwrap()).unwrap();
    assert_eq!(map, whole);
    assert_eq!(later.cells().points(), seen().cells().points());
    // A damaged store is not taken.
    let damaged = stored.replacen("\"count\":", "\"count\":0,\"was\":", 1);
    assert!(serde_json::from_str::<Survey>(&damaged).is_err());
    let damaged = stored.replacen("\"edge_m\":0.1", "\"edge_m\":-0.1", 1);
    let error = serde_json::from_str::<Survey>(&damaged).unwrap_err().to_string();
    assert!(error.contains("positive length"), "{error}");
    assert_eq!(Cells::new(0.0).unwrap_err(), CellsError::Edge { edge_m: 0.0 });
}

/// Results for buildings without two main orientations: corners, minimum number of found walls, and
/// true if most are perpendicular or parallel.
#[test]
fn rooms_that_are_not_square() {
    let ring = |n: usize, r: f64| -> Vec<Point2<f64>> {
        (0..n)
            .map(|i| TAU * (i as f64 + 0.5) / n as f64)
            .map(|a| Point2::new(r * a.cos(), r * a.sin()))
            .collect()
    };
    let cut =
        [(3.0, -2.5), (3.0, 0.5), (1.0, 2.5), (-3.0, 2.5), (-3.0, -2.5)].map(|(x, y)| Point2::new(x, y));
    let none: Option<f64> = None;
    for (name, corners, least, diagonal) in
        [("a cut corner", cut.to_vec(), 5, Some(FRAC_PI_4)), ("round", ring(48, 3.0), 0, none)]
    {
        let building = Building::room(&corners, |_| 0.6);
        let truths =
            along(&[Point2::new(-0.6, 0.0), Point2::new(0.6, 0.0), Point2::new(-0.6, 0.0)], 0.4, 0.3);
        let stations = building.drive(&truths, &Rig { stride: 5, ..Rig::default() }, 2);
        let full =
            Vec::from_iter((0..18).map(|i| Isometry2::new([0.3, 0.2].into(), TAU * f64::from(i) / 18.0)));
        let more = building.drive(&full, &Rig { stride: 5, ..Rig::default() }, 3);
        let all: Vec<Station> = stations.into_iter().chain(more).collect();
        let poses: Vec<Isometry2<f64>> = truths.iter().chain(&full).copied().collect();
        let map = survey(&all, &poses).map(&MapOptions::default()).unwrap();
        let score = score(&map, &building, 0.2, &poses, &poses);
        println!("{name}: {score:?}, main {:?}, {:?}", map.main_rad, map.cylinders);
        assert!(map.walls.len() >= least && score.precision > 0.9 && score.recall > 0.7, "{name}: {score:?}");
        let heading = |n: &Vector3<f64>| n.y.atan2(n.x).rem_euclid(TAU / 2.0);
        if let Some(diagonal) = diagonal {
            let found = map.walls.iter().any(|w| (heading(&w.plane.normal) - diagonal).abs() < 0.05);
            assert!(found && map.main_rad.is_some(), "{name}: {:?}", map.walls);
            assert!(map.cylinders.is_empty(), "{name}: {:?}", map.cylinders);
        } else {
            assert_eq!(map.main_rad, None, "{name}");
            let [wall] = &map.cylinders[..] else { panic!("{name}: {:?}", map.cylinders) };
            assert!(wall.from_inside && wall.middle.coords.norm() < 0.05, "{name}: {wall:?}");
            assert!((wall.radius_m - 3.0).abs() < 0.05 && wall.arc_rad() > 5.0, "{name}: {wall:?}");
        }
    }
}

/// Round posts become cylinders with position and radius, square ones and cupboards do not; saving
/// and loading keeps them.
#[test]
fn pillars_are_cylinders() {
    let at = Point2::new;
    let mut hall = Building::room(&[at(4.0, -3.0), at(4.0, 3.0), at(-4.0, 3.0), at(-4.0, -3.0)], |_| 0.5);
    for (x, y, radius_m) in [(-2.0, 0.0, 0.35), (1.8, 1.0, 0.4)] {
        hall.pillars.push(corridor::Pillar { middle: at(x, y), radius_m, texture: 0.6 });
    }
    hall.post(at(1.6, -1.0), [0.3, 0.3], 0.4, corridor::CEILING_M);
    hall.post(at(0.0, 2.7), [0.5, 0.3], 0.0, 1.8);
    let truths =
        along(&[at(-3.2, -2.0), at(3.2, -2.2), at(3.2, 2.2), at(-3.2, 2.0), at(-3.2, -2.0)], 0.8, 0.5);
    let stations = hall.drive(&truths, &Rig { stride: 5, ..Rig::default() }, 4);
    let seen = survey(&stations, &truths);
    let map = seen.map(&MapOptions::default()).unwrap();
    let found = score_pillars(&map.cylinders, &hall);
    println!("{found:?} {:?}", map.cylinders);
    assert_eq!((found.found, found.wrong), (2, 0), "{:?}", map.cylinders);
    assert!(found.off_m < 0.04 && found.radius_off_m < 0.03, "{found:?}");
    assert!(map.cylinders.iter().all(|c| !c.from_inside && c.arc_rad() > 2.0 && c.rms_m < 0.05));
    // Their sides are no walls.
    let off_m =
        |p: Point2<f64>| hall.pillars.iter().map(|c| (c.middle - p).norm()).fold(f64::INFINITY, f64::min);
    assert!(
        map.walls
            .iter()
            .flat_map(|w| w.feet().collect::<Vec<_>>())
            .all(|(a, b)| off_m(a + (b - a) * 0.5) > 0.5)
    );
    let stored: Survey = serde_json::from_str(&serde_json::to_string(&seen).unwrap()).unwrap();
    assert_eq!(stored.map(&MapOptions::default()).unwrap(), map);
    let read: RoomMap = serde_json::from_str(&serde_json::to_string(&map).unwrap()).unwrap();
    assert_eq!(read.cylinders, map.cylinders);
    let planes = seen.map(&MapOptions { cylinders: None, ..MapOptions::default() }).unwrap();
    assert!(planes.cylinders.is_empty() && planes.walls.len() >= map.walls.len());
}

#[test]
fn the_next_pose_shows_what_is_not_known_yet() {
    let Drive { stations, truths, .. } = drive();
    let field = FieldOfView { far_m: MAP_FAR_M, ..field_of_view() };
    let options = ExploreOptions { field, ..ExploreOptions::default() };
    let part = survey(&stations[..4], &truths[..4]).map(&MapOptions::default()).unwrap().grid.unwrap();
    let next = next_poses(&part, &truths[..4], &options);
    let away = next.iter().find(|n| n.way_m > 1.0).unwrap();
    let ahead = truths[3].inv_mul(&away.pose).translation.vector;
    println!("{} poses, the first {:?}; {ahead:?} from here {away:?}", next.len(), next[0]);
    assert!(ahead.x > 1.0, "the corridor goes on ahead: {away:?}");
    let whole = seen().map(&MapOptions::default()).unwrap().grid.unwrap();
    let left = next_poses(&whole, &truths[..4], &options);
    let gain = |poses: &[descry_perception::mapping::NextPose]| poses.first().map_or(0.0, |p| p.rate());
    assert!(gain(&left) < gain(&next), "{} {}", gain(&left), gain(&next));
}

/// A few poses jointly cover the visible floor; each gains less after the others; kept ones stay.
#[test]
fn a_few_outlooks_show_what_can_be_seen() {
    let truths = &drive().truths;
    let map = seen().map(&MapOptions::default()).unwrap();
    let floor = map.floor(&truths[..1], 0.35, 1.6).unwrap();
    let options = ExploreOptions { field: field_of_view(), ..ExploreOptions::default() };
    let reach = Reach::over(&floor, &truths[3], &standable(&floor, options.radius_m), &options);
    let found = outlooks(&floor, &reach, &truths[..4], &[], 6, &options);
    assert!(!found.is_empty() && found.len() <= 6);
    // Nobody looks twice from the same place with the same heading, whatever that has left unknown.
    let taken = vec![found[0].pose];
    let after = outlooks(&floor, &reach, &taken, &taken, 6, &options);
    assert!(
        !after.is_empty()
            && after.iter().all(|look| {
                let off = taken[0].inv_mul(&look.pose);
                off.translation.vector.norm() >= 0.3 || off.rotation.angle().abs() > 0.25
            })
    );
    let mut unseen = Unseen::default();
    for look in &found {
        let gain_m2 = unseen.gain_m2(look);
        assert!(gain_m2 >= 0.2 && gain_m2 <= Unseen::default().gain_m2(look) + 1e-9);
        unseen.look(look);
        assert!(unseen.gain_m2(look) < 0.9 * gain_m2);
    }
    let keep: Vec<Isometry2<f64>> = found.iter().rev().take(2).map(|look| look.pose).collect();
    let again = outlooks(&floor, &reach, &truths[..4], &keep, 6, &options);
    assert!(keep.iter().zip(&again).all(|(pose, look)| *pose == look.pose));
    let next = nearest_frontier(&floor, &truths[..4], &options).unwrap();
    assert!(next.way_m.is_finite());
    let may = standable(&floor, 0.3);
    let free = floor.cells.iter().filter(|c| **c == Space::Free).count();
    let stands = may.iter().filter(|may| **may).count();
    assert!(stands > 0 && stands < free);
    assert!(map.levels.iter().filter(|l| l.faces_up && l.height_m > 0.3).all(|table| {
        let middle =
            table.outline.iter().map(|p| p.coords).sum::<Vector2<f64>>() / table.outline.len() as f64;
        floor.at(&middle.into()) == Space::Occupied
    }));
}

/// A station is localised by the visible part of the survey; without any, the believed pose stays.
#[test]
fn a_station_is_located_in_a_survey() {
    let Drive { stations, truths, .. } = drive();
    let rectify = RectifyOptions { way_sigma: (0.0, 0.06), turn_sigma_rad: 0.04, ..options(Matcher::IcpEm) };
    let (mut before, mut after) = (0.0, 0.0);
    for k in (10..60).step_by(5) {
        let off = Isometry2::new(Vector2::new(0.05, -0.04), if k % 2 == 0 { 0.04 } else { -0.04 });
        let believed = truths[k] * off;
        let fit = seen().locate(&stations[k], &believed, &rectify).unwrap();
        before += truths[k].rotation.angle_to(&believed.rotation).abs();
        after += truths[k].rotation.angle_to(&fit.before_from_after.rotation).abs();
    }
    assert!(after < 0.4 * before, "{after} of {before} rad");
    let elsewhere = Isometry2::translation(500.0, 0.0);
    let fit = seen().locate(&stations[0], &elsewhere, &rectify).unwrap();
    assert_eq!(fit.before_from_after, elsewhere);
    let nowhere = Isometry2::translation(f64::NAN, 0.0);
    assert!(seen().locate(&stations[0], &nowhere, &rectify).is_err());
}

/// Invalid options and poses are reported, and leave a map unchanged.
#[test]
fn bad_options_and_poses_are_told() {
    let stations = &drive().stations[..2];
    let with = |change: fn(&mut RectifyOptions)| {
        let mut options = options(Matcher::IcpEm);
        change(&mut options);
        rectify_drive(stations, &options).unwrap_err().to_string()
    };
    assert!(with(|o| o.thin_m = 0.0).starts_with("thin_m is 0: give a number from"));
    assert!(with(|o| o.sigma_m.1 = f64::NAN).contains("sigma_m is NaN"));
    assert!(with(|o| o.field.far_m = f64::INFINITY).contains("field of view"));
    let mut astray = stations.to_vec();
    astray[1].odom_from_level.translation.x = f64::NAN;
    let error = rectify_drive(&astray, &options(Matcher::IcpEm)).unwrap_err();
    assert_eq!(error, MappingError::Pose { what: "station", index: 1 });
    let mut survey = Survey::new(0.1).unwrap();
    assert!(survey.add(&stations[0], &astray[1].odom_from_level, 1.2, 5.0, &BODY_M).is_err());
    assert!(survey.cells().is_empty() && survey.grid().is_none());
    let far =
        Station { points: vec![Point3::new(1e30, 1.0, 1.0); 9], odom_from_level: Isometry2::identity() };
    survey.add(&far, &far.odom_from_level, 1.2, f64::INFINITY, &BODY_M).unwrap();
    let map = survey.map(&MapOptions::default()).unwrap();
    assert!(map.walls.is_empty() && map.levels.is_empty() && map.main_rad.is_none());
    assert!(survey.map(&MapOptions { grow_m: 0.0, ..MapOptions::default() }).is_err());
}
